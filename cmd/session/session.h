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

/// A cache of scenes and GL contexts for successive runs. A run whose request equals an earlier
/// request reuses the scene and its uploads. A scene is read again if one of its files has changed,
/// or was written less than 100 ms before the scene was read. A Session must be used by only one
/// thread, on which its contexts are current.
class Session {
  public:
    /// `keep` is the maximum number of bytes, in scenes and their uploads, to keep between runs; 0
    /// = keep nothing, not even contexts. The reporter must live until setReporter() is called or
    /// the session ends.
    explicit Session(Reporter& reporter, std::uint64_t keep = 0);
    Session(const Session&) = delete;
    Session& operator=(const Session&) = delete;

    Reporter& reporter() const { return *reporter_; }
    void setReporter(Reporter& reporter) { reporter_ = &reporter; }

    /// Returns the scene, from the file or the cache. Reports the reader's warnings in both cases.
    /// Throws like OpenedScene().
    SharedScene open(const SceneRequest& request);

    /// Throws like GlSession::context().
    gl::Context& context(const gl::ContextRequest& device) { return gl_.context(device); }
    bool hasContext() const { return gl_.hasContext(); }
    bool findGpu(std::string& reasons) { return gl_.findGpu(reasons); }

    /// Returns a renderer in the device's context, with the scene of `posed` uploaded and posed. If
    /// `scene` is null, the caller owns the scene and must keep it during the run. Throws like
    /// GlSession::renderer().
    GlRenderer& renderer(const gl::ContextRequest& device, const SharedScene& scene,
                         const PosedScene& posed);

    /// Ends the current run's use of the renderer. Closes everything that the session does not
    /// keep.
    void release();
    /// Closes the context and everything uploaded to it. Must be called if the context was lost, or
    /// if a run failed and may have left GL objects in any state.
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
