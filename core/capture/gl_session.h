// SPDX-License-Identifier: Apache-2.0
// The one place that opens GL contexts to render with, and keeps them and what is uploaded to them.
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

/// A GL context and the scenes that are uploaded to it, kept for the renders that follow. Belongs
/// to one thread, which its context is current on; a borrowed context may be current on any.
class GlSession {
  public:
    /// Opens contexts of its own. `keeps_scenes`: other scenes stay uploaded beside the one that is
    /// rendered, until closeOldest(); false = only that one.
    explicit GlSession(bool keeps_scenes = false);
    /// Borrows the context that is current on this thread, with functions that `function_of` gives
    /// by name; null = the session opens contexts of its own. Throws like gl::AdoptedContext().
    explicit GlSession(void* (*function_of)(const char* name));
    /// Leaves its objects in a borrowed context that is not current here.
    ~GlSession();
    GlSession(const GlSession&) = delete;
    GlSession& operator=(const GlSession&) = delete;

    /// The context of such a device, current on this thread; one of another device is closed.
    /// Throws like gl::createContext(). A borrowed context is the same whatever is asked for, and
    /// its state is peeler's until giveBack(); throws Error (kUsage) if it is not current on this
    /// thread, or if something is begun in it (gl::requireNothingBegun()).
    gl::Context& context(const gl::ContextRequest& device);
    bool hasContext() const { return context_ != nullptr; }

    /// Opens a context of the first GPU that can be used, unless one is open. Returns whether there
    /// is one; `reasons` says why each device was not used.
    bool findGpu(std::string& reasons);

    /// The scene uploaded to the context of such a device, in this pose, which must be one of the
    /// scene's number `index`. A scene that is null, which the session does not own, has to outlive
    /// closeUnowned(). Throws like context() and GlRenderer().
    GlRenderer& renderer(const gl::ContextRequest& device,
                         const std::shared_ptr<const Scene>& scene, int index,
                         const PosedScene& posed);

    /// Resident bytes of what is uploaded, roughly.
    std::uint64_t uploadedBytes() const;
    /// Closes the upload that was used longest ago, unless it is the only one. Returns whether
    /// there was another.
    bool closeOldest();
    /// Closes the uploads of scenes that the session does not own.
    void closeUnowned();
    /// Closes everything that is uploaded, and the context.
    void close();

    /// The owner's state is back in a borrowed context.
    void giveBack();
    /// Gives back after a render that threw: the uploads it has drawn may be in any state and are
    /// closed, and so is the context if it was lost. Where nothing was borrowed yet, all is as it
    /// was.
    void giveUp(bool device_lost);
    /// GL errors that were pending in a borrowed context: each code once, oldest first. Empty
    /// afterwards.
    std::vector<unsigned> takePendingErrors() { return std::exchange(pending_errors_, {}); }

  private:
    struct Upload {
        std::shared_ptr<const Scene> scene;  ///< null: not the session's
        int index;
        std::unique_ptr<GlRenderer> renderer;
        std::uint64_t bytes;
    };

    void adopt();
    gl::Context& borrow();

    void* (*function_of_)(const char* name) = nullptr;  ///< null = no context is borrowed
    bool keeps_scenes_ = false;
    gl::ContextRequest request_;             // of the context
    std::unique_ptr<gl::Context> context_;   // before the uploads, which need it to the end
    gl::AdoptedContext* adopted_ = nullptr;  ///< the context, if it is one
    std::unique_ptr<gl::BorrowedState> borrowed_;
    std::vector<unsigned> pending_errors_;
    std::string no_gpu_;         ///< why; "" = not known
    std::list<Upload> uploads_;  ///< used last comes first
};

}  // namespace peeler
