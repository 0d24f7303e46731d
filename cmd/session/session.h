// SPDX-License-Identifier: Apache-2.0
// A session: scenes and GL contexts that successive runs reuse.
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

/// Throws Error (kUsage) if a GL device is chosen for an engine that does not use GL.
void checkEngine(RayEngine engine, const gl::ContextRequest& device);

/// A cache of scenes and GL contexts for successive runs. A run whose request equals an earlier one
/// reuses the scene and its uploads. It reads the scene again if a file of the scene has changed,
/// or was written less than 100 ms before it was read. A Session must be used by only one thread,
/// on which its contexts are current.
class Session {
  public:
    /// `keep` is the maximum number of bytes, in scenes and their uploads, to keep between runs; 0
    /// = keep nothing, not even contexts. The reporter must live until the session ends or
    /// setReporter() is called.
    explicit Session(Reporter& reporter, std::uint64_t keep = 0);
    Session(const Session&) = delete;
    Session& operator=(const Session&) = delete;

    Reporter& reporter() const { return *reporter_; }
    /// Sets the reporter for the following runs.
    void setReporter(Reporter& reporter) { reporter_ = &reporter; }

    /// Returns the scene, from the file or the cache. Reports the reader's warnings in both cases.
    /// Throws like OpenedScene().
    SharedScene open(const SceneRequest& request);

    /// Returns the context for a device. Throws like GlSession::context().
    gl::Context& context(const gl::ContextRequest& device) { return gl_.context(device); }
    bool hasContext() const { return gl_.hasContext(); }
    bool findGpu(std::string& reasons) { return gl_.findGpu(reasons); }

    /// Returns a renderer in the device's context, with the scene of `posed` uploaded and in that
    /// pose. If `scene` is null, the caller owns the scene and must keep it during the run. Throws
    /// like GlSession::renderer().
    GlRenderer& renderer(const gl::ContextRequest& device, const SharedScene& scene,
                         const PosedScene& posed);

    /// Ends the current run's use of the renderer. Closes everything that the session does not
    /// keep.
    void release();
    /// Closes the context and everything uploaded to it. Must be called after a lost context and
    /// after a failed run, which may leave GL objects in any state.
    void close() { gl_.close(); }
    /// Closes all kept scenes and contexts. Returns whether there were any.
    bool forget();

  private:
    struct KeptScene {
        SceneRequest request;
        SharedScene scene;
        std::vector<FileState> files;  ///< states of the scene's files when they were read
        std::uint64_t bytes = 0;       ///< approximate resident size
    };

    void evict();

    Reporter* reporter_;
    std::uint64_t keep_;
    std::list<KeptScene> scenes_;  ///< most recently used first
    GlSession gl_;
};

}  // namespace peeler::cmd
