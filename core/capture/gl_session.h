// SPDX-License-Identifier: Apache-2.0
// The owner of GL rendering contexts and the scenes uploaded to them; the only place that opens
// contexts.
#pragma once

#include <cstdint>
#include <list>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include <peeler/scene.h>
#include "core/capture/gl_renderer.h"
#include "core/gl/context.h"

namespace peeler {

namespace gl {
class AdoptedContext;
class BorrowedState;
}  // namespace gl

/// A GL context and the scenes uploaded to it, kept for later renders. Belongs to the thread on
/// which its context is current; a borrowed context may move between threads.
class GlSession {
  public:
    /// Opens its own contexts. `keeps_scenes`: other scenes stay uploaded beside the rendered one,
    /// until closeOldest(); false = only the rendered one stays.
    explicit GlSession(bool keeps_scenes = false);
    /// Borrows the context that is current on this thread, with the functions that `function_of`
    /// returns by name; null = the session opens its own contexts. Throws like
    /// gl::AdoptedContext().
    explicit GlSession(void* (*function_of)(const char* name));
    /// Leaks its GL objects if a borrowed context is not current on this thread.
    ~GlSession();
    GlSession(const GlSession&) = delete;
    GlSession& operator=(const GlSession&) = delete;

    /// Returns the context of this device, current on this thread; closes an open context of
    /// another device. Throws like gl::createContext(). A session that borrows ignores `device` and
    /// returns the borrowed context, with GL state set for peeler until giveBack(). It throws Error
    /// (kUsage) if that context is not current on this thread or has an operation in progress
    /// (gl::requireNothingBegun()).
    gl::Context& context(const gl::ContextRequest& device);
    bool hasContext() const { return context_ != nullptr; }

    /// Opens a context of the first usable GPU, unless one is open. Returns false if there is no
    /// such GPU; then `reasons` lists why each device was not used.
    bool findGpu(std::string& reasons);

    /// Returns the renderer of the scene in this pose, uploaded to the context of this device. The
    /// pose must be one of the file's scene number `index`. If `scene` is null, the session does
    /// not own the scene, and the scene of `posed` must stay valid until closeUnowned(). Throws
    /// like context() and GlRenderer().
    GlRenderer& renderer(const gl::ContextRequest& device,
                         const std::shared_ptr<const Scene>& scene, int index,
                         const PosedScene& posed);

    /// Returns the approximate resident bytes of all uploads.
    std::uint64_t uploadedBytes() const;
    /// Closes the least recently used upload, unless it is the only one. Returns whether it closed
    /// one.
    bool closeOldest();
    /// Closes the uploads of scenes that the session does not own.
    void closeUnowned();
    /// Closes all uploads and the context.
    void close();

    /// Restores the owner's state in a borrowed context.
    void giveBack();
    /// Cleans up after a render that threw: closes the uploads, which may be in any state, restores
    /// the owner's state, and closes the context if it was lost. Does nothing if the session
    /// borrows but has not borrowed yet.
    void giveUp(bool device_lost);
    /// Returns and clears the GL errors that were pending when the context was borrowed: each code
    /// once, oldest first.
    std::vector<unsigned> takePendingErrors() { return std::exchange(pending_errors_, {}); }

  private:
    struct Upload {
        std::shared_ptr<const Scene> scene;  ///< null: not owned by the session
        int index;
        std::unique_ptr<GlRenderer> renderer;
        std::uint64_t bytes;
    };

    void adopt();
    gl::Context& borrow();

    void* (*function_of_)(const char* name) = nullptr;  ///< null = no context is borrowed
    bool keeps_scenes_ = false;
    gl::ContextRequest request_;             // for which context_ was opened
    std::unique_ptr<gl::Context> context_;   // declared first: uploads are destroyed before it
    gl::AdoptedContext* adopted_ = nullptr;  ///< the context, if adopted
    std::unique_ptr<gl::BorrowedState> borrowed_;
    std::vector<unsigned> pending_errors_;
    std::string no_gpu_;         ///< why there is no GPU; "" = not yet known
    std::list<Upload> uploads_;  ///< most recently used first
};

}  // namespace peeler
