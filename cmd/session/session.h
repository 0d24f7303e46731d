// SPDX-License-Identifier: Apache-2.0
// Session: opens scenes and GL contexts for runs, and caches both.
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

/// Throws Error (kUsage) if the engine does not use GL but a GL device is chosen.
void checkEngine(RayEngine engine, const gl::ContextRequest& device);

/// A cache of scenes and contexts for successive runs. A run with an equal request reuses the
/// scene, still uploaded, if the file is unchanged and had not been written just before it was
/// read. Belongs to one thread, where its contexts are current.
class Session {
  public:
    /// `keep`: limit on the bytes of scenes and their uploads kept between runs; 0 = keep nothing,
    /// contexts included. The reporter must outlive the session or be replaced.
    explicit Session(Reporter& reporter, std::uint64_t keep = 0);
    Session(const Session&) = delete;
    Session& operator=(const Session&) = delete;

    Reporter& reporter() const { return *reporter_; }
    /// Sets the reporter of the following runs.
    void setReporter(Reporter& reporter) { reporter_ = &reporter; }

    /// Returns the scene, read or cached. Reports its readers' warnings in both cases. Throws like
    /// OpenedScene().
    SharedScene open(const SceneRequest& request);

    /// Returns the context for a device, like GlSession::context().
    gl::Context& context(const gl::ContextRequest& device) { return gl_.context(device); }
    bool hasContext() const { return gl_.hasContext(); }
    bool findGpu(std::string& reasons) { return gl_.findGpu(reasons); }

    /// Returns a renderer with the scene uploaded to the device's context, in a pose of that scene.
    /// If `scene` is null, the session does not own the scene, which must outlive the run. Throws
    /// like GlSession::renderer().
    GlRenderer& renderer(const gl::ContextRequest& device, const SharedScene& scene,
                         const PosedScene& posed);

    /// Ends a run's use of its renderer; closes everything that is not cached.
    void release();
    /// Closes the context and its uploads. For a lost context, and after a failed run, which may
    /// leave GL objects in any state.
    void close() { gl_.close(); }
    /// Empties the cache. Returns whether it held anything.
    bool forget();

  private:
    struct KeptScene {
        SceneRequest request;
        SharedScene scene;
        std::vector<FileState> files;  ///< state when they were read
        std::uint64_t bytes = 0;       ///< resident, roughly
    };

    void evict();

    Reporter* reporter_;
    std::uint64_t keep_;
    std::list<KeptScene> scenes_;  ///< most recently used first
    GlSession gl_;
};

}  // namespace peeler::cmd
