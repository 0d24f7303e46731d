// SPDX-License-Identifier: Apache-2.0
// The one place that opens scenes and devices, and keeps them for the runs that follow.
#pragma once

#include <cstdint>
#include <list>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "cmd/session/capture_choices.h"
#include "cmd/session/file_state.h"
#include "cmd/session/opened_scene.h"
#include "cmd/session/reporter.h"
#include "cmd/session/scene_request.h"
#include "core/base/stage_times.h"
#include "core/capture/gl_renderer.h"
#include "core/fragments/hit_source.h"
#include "core/gl/context.h"

namespace peeler::cmd {

using SharedScene = std::shared_ptr<const OpenedScene>;

/// Whether the request says anything of which device it is.
bool asksForDevice(const gl::ContextRequest& device);

/// Throws Error (kUsage) if an engine without GL is asked for as well as a device of GL.
void checkEngine(Engine engine, const gl::ContextRequest& device);

/// Opens scenes and contexts for runs, one run after the other, and keeps both. Runs that show the
/// same file in the same way get the scene that was read before, uploaded as it was, as long as the
/// file is as it was then, and had not been written just before. Belongs to one thread, which its
/// contexts are current on.
class Session {
  public:
    /// `keep`: most bytes that scenes and what is uploaded of them may take between runs; 0 =
    /// nothing is kept, contexts included. The reporter must outlive the session, or be replaced.
    explicit Session(Reporter& reporter, std::uint64_t keep = 0);
    ~Session();
    Session(const Session&) = delete;
    Session& operator=(const Session&) = delete;

    Reporter& reporter() const { return *reporter_; }
    /// Of the runs that follow.
    void setReporter(Reporter& reporter) { reporter_ = &reporter; }

    /// The scene; the warnings of its readers are reported, whether it is read now or was before.
    /// Throws like OpenedScene().
    SharedScene open(const SceneRequest& request);

    /// The context of such a device, current on this thread; one of another device is closed.
    /// Throws like gl::createContext().
    gl::Context& context(const gl::ContextRequest& device);
    /// Whether there is one.
    bool hasContext() const { return context_ != nullptr; }
    /// Opens a context of the first GPU that can be used, unless one is open; whether there is one.
    /// `reasons` says why each device was not used.
    bool findGpu(std::string& reasons);

    /// The scene uploaded to the context of such a device, in this pose, which must be one of it. A
    /// scene that is null, which the session does not own, has to outlive the run. Throws like
    /// context() and GlRenderer().
    GlRenderer& renderer(const gl::ContextRequest& device, const SharedScene& scene,
                         const PosedScene& posed);

    /// A run needs its renderer no longer: closes what is not kept.
    void release();
    /// Closes the context and what is uploaded to it. For a context that was lost, and after a run
    /// that failed: what it has drawn with may be in any state.
    void close();
    /// Forgets everything that is kept; whether there was anything.
    bool forget();

  private:
    struct KeptScene {
        SceneRequest request;
        SharedScene scene;
        std::vector<FileState> files;  ///< as they were when they were read
        std::uint64_t bytes = 0;       ///< resident, roughly
    };
    struct KeptRenderer {
        SharedScene scene;  ///< null: of a scene that the session does not own
        std::unique_ptr<GlRenderer> renderer;
        std::uint64_t bytes = 0;
    };

    void evict();

    Reporter* reporter_;
    std::uint64_t keep_;
    gl::ContextRequest request_;            // of the context
    std::unique_ptr<gl::Context> context_;  // before the renderers, which need it to the end
    std::string no_gpu_;                    ///< why; "" = not known
    std::list<KeptScene> scenes_;           ///< used last comes first
    std::list<KeptRenderer> renderers_;     ///< likewise
};

}  // namespace peeler::cmd
