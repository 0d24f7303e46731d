// SPDX-License-Identifier: Apache-2.0
// The one place that opens scenes and devices for runs, and keeps them for those that follow.
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
#include "core/capture/gl_session.h"

namespace peeler::cmd {

using SharedScene = std::shared_ptr<const OpenedScene>;

/// Throws Error (kUsage) if an engine without GL is asked for as well as a device of GL.
void checkEngine(RayEngine engine, const gl::ContextRequest& device);

/// Opens scenes and contexts for runs, one run after the other, and keeps both. Runs that show the
/// same file in the same way get the scene that was read before, uploaded as it was, as long as the
/// file is as it was then, and had not been written just before. Belongs to one thread, which its
/// contexts are current on.
class Session {
  public:
    /// `keep`: most bytes that scenes and what is uploaded of them may take between runs; 0 =
    /// nothing is kept, contexts included. The reporter must outlive the session, or be replaced.
    explicit Session(Reporter& reporter, std::uint64_t keep = 0);
    Session(const Session&) = delete;
    Session& operator=(const Session&) = delete;

    Reporter& reporter() const { return *reporter_; }
    /// Of the runs that follow.
    void setReporter(Reporter& reporter) { reporter_ = &reporter; }

    /// The scene; the warnings of its readers are reported, whether it is read now or was before.
    /// Throws like OpenedScene().
    SharedScene open(const SceneRequest& request);

    /// As GlSession has them.
    gl::Context& context(const gl::ContextRequest& device) { return gl_.context(device); }
    bool hasContext() const { return gl_.hasContext(); }
    bool findGpu(std::string& reasons) { return gl_.findGpu(reasons); }

    /// The scene uploaded to the context of such a device, in this pose, which must be one of it. A
    /// scene that is null, which the session does not own, has to outlive the run. Throws like
    /// GlSession::renderer().
    GlRenderer& renderer(const gl::ContextRequest& device, const SharedScene& scene,
                         const PosedScene& posed);

    /// A run needs its renderer no longer: closes what is not kept.
    void release();
    /// Closes the context and what is uploaded to it. For a context that was lost, and after a run
    /// that failed: what it has drawn with may be in any state.
    void close() { gl_.close(); }
    /// Forgets everything that is kept; whether there was anything.
    bool forget();

  private:
    struct KeptScene {
        SceneRequest request;
        SharedScene scene;
        std::vector<FileState> files;  ///< as they were when they were read
        std::uint64_t bytes = 0;       ///< resident, roughly
    };

    void evict();

    Reporter* reporter_;
    std::uint64_t keep_;
    std::list<KeptScene> scenes_;  ///< used last comes first
    GlSession gl_;
};

}  // namespace peeler::cmd
