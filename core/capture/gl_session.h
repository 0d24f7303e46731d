// SPDX-License-Identifier: Apache-2.0
// Sessions: owners of GL contexts and of the scenes uploaded to them. Only sessions open contexts.
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

/// Whether rendering a scene needs a context: splats alone do not, unless the request chooses a
/// device.
bool needsContext(const gl::ContextRequest& device, const PosedScene& posed);

/// A GL context and the scenes uploaded to it, which are kept for later renders. A session belongs
/// to the thread on which its context is current. The owner of a borrowed context may make it
/// current on another thread.
class GlSession {
  public:
    /// Creates a session that opens its own contexts. If `keeps_scenes`, earlier scenes stay
    /// uploaded until closeOldest(). Otherwise only the last rendered scene stays.
    explicit GlSession(bool keeps_scenes = false);
    /// Creates a session that borrows the context that is current on this thread. `function_of`
    /// returns the context's functions by name. If `function_of` is null, the session opens its own
    /// contexts. Throws like gl::AdoptedContext().
    explicit GlSession(void* (*function_of)(const char* name));
    /// Leaks the session's GL objects if they are in a borrowed context that is not current on this
    /// thread.
    ~GlSession();
    GlSession(const GlSession&) = delete;
    GlSession& operator=(const GlSession&) = delete;

    /// Returns the context of this device, current on this thread. Closes an open context of
    /// another device. Throws like gl::createContext().
    ///
    /// A session that borrows ignores `device` and returns the borrowed context, with GL state set
    /// for peeler until giveBack(). It throws Error (kUsage) if the borrowed context is not current
    /// on this thread or has an operation in progress (gl::requireNothingBegun()).
    gl::Context& context(const gl::ContextRequest& device);
    bool hasContext() const { return context_ != nullptr; }

    /// Opens a context of the first usable GPU, if no context is open. If there is no usable GPU,
    /// returns false and lists in `reasons` why each device was rejected.
    bool findGpu(std::string& reasons);

    /// Returns the renderer of the scene in this pose, uploaded to the context of this device.
    /// `index` is the index of the posed scene in the file. If `scene` is null, the session does
    /// not own the scene, and the scene of `posed` must remain valid until closeUnowned(). Opens no
    /// context unless needsContext() or the session borrows. Throws like context() and
    /// GlRenderer().
    GlRenderer& renderer(const gl::ContextRequest& device,
                         const std::shared_ptr<const Scene>& scene, int index,
                         const PosedScene& posed);

    /// Returns the approximate resident bytes of all uploads.
    std::uint64_t uploadedBytes() const;
    /// Closes the least recently used upload if there are several uploads. Returns whether it
    /// closed one.
    bool closeOldest();
    /// Closes the uploads of scenes that the session does not own.
    void closeUnowned();
    /// Closes all uploads and the context.
    void close();

    /// Restores the owner's GL state in a borrowed context.
    void giveBack();
    /// Cleans up after a render that threw: closes the uploads, which may be in any state; restores
    /// the owner's GL state; closes the context if the device was lost. Does nothing if the session
    /// is for borrowed contexts and no context is borrowed.
    void giveUp(bool device_lost);
    /// Returns and clears the GL errors that were pending when the context was borrowed: each code
    /// once, oldest first.
    std::vector<unsigned> takePendingErrors() { return std::exchange(pending_errors_, {}); }

  private:
    struct Upload {
        std::shared_ptr<const Scene> scene;  ///< null if the session does not own the scene
        int index;
        std::unique_ptr<GlRenderer> renderer;
        std::uint64_t bytes;
    };

    void adopt();
    gl::Context& borrow();

    /// Null if the session opens its own contexts.
    void* (*function_of_)(const char* name) = nullptr;
    bool keeps_scenes_ = false;
    gl::ContextRequest request_;             // the request that opened context_
    std::unique_ptr<gl::Context> context_;   // declared before uploads_, so destroyed after them
    gl::AdoptedContext* adopted_ = nullptr;  ///< context_ if it is adopted, otherwise null
    std::unique_ptr<gl::BorrowedState> borrowed_;
    std::vector<unsigned> pending_errors_;
    std::string no_gpu_;         ///< why findGpu() found no GPU; empty until it fails
    std::list<Upload> uploads_;  ///< uploads, the most recently used first
};

}  // namespace peeler
