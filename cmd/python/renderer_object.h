// SPDX-License-Identifier: Apache-2.0
// The Renderer of Python, for what it renders and for what it traces.
#pragma once

#include <unistd.h>

#include <atomic>
#include <memory>
#include <mutex>
#include <thread>

#include <peeler/error.h>
#include <peeler/renderer.h>
#include "cmd/python/binding.h"

#pragma GCC visibility push(hidden)

namespace peeler::python {

/// A Renderer as Python holds it. It serves one thread at a time; others wait.
class RendererObject {
  public:
    explicit RendererObject(const RendererOptions& options)
        : renderer_(std::make_unique<Renderer>(options)) {}
    // NOLINTNEXTLINE(bugprone-exception-escape): what ends a thread of ours does not throw
    ~RendererObject() {
        // Calls hold a reference, so none is going on. In a forked process there is no thread to
        // wait for; what the parent had is left as it is.
        if (process_ == getpid()) {
            if (renderer_) unlocked([this] { renderer_.reset(); });
        } else {
            static_cast<void>(renderer_.release());
        }
    }
    RendererObject(const RendererObject&) = delete;
    RendererObject& operator=(const RendererObject&) = delete;

    /// Calls work(renderer) without Python's lock. Throws Error (kUsage) if it is closed, or called
    /// from its own callback.
    template <class Work>
    auto use(Work&& work) {
        return unlocked([&] {
            const std::unique_lock lock = own();
            if (!renderer_) throw Error(ErrorKind::kUsage, "the Renderer is closed", "Renderer");
            const Busy busy(user_);
            return work(*renderer_);
        });
    }
    void close() {
        unlocked([&] {
            const std::unique_lock lock = own();
            renderer_.reset();
        });
    }
    bool closed() const { return !renderer_; }

  private:
    struct Busy {
        explicit Busy(std::atomic<std::thread::id>& user) : user_(user) {
            user_ = std::this_thread::get_id();
        }
        ~Busy() { user_ = std::thread::id(); }
        Busy(const Busy&) = delete;
        Busy& operator=(const Busy&) = delete;
        std::atomic<std::thread::id>& user_;
    };
    std::unique_lock<std::mutex> own() {
        if (process_ != getpid())
            throw Error(ErrorKind::kUsage, "a Renderer does not outlive a fork", "Renderer",
                        "make it in the process that uses it, or start that by 'spawn'");
        if (user_ == std::this_thread::get_id())
            throw Error(ErrorKind::kUsage, "the Renderer is at work, and called this", "progress",
                        "make another Renderer for what a callback renders");
        return std::unique_lock(mutex_);
    }

    const pid_t process_ = getpid();
    std::mutex mutex_;
    std::atomic<std::thread::id> user_{};
    std::unique_ptr<Renderer> renderer_;
};

/// The scene as it is seen.
Shown shownOf(const SceneObject& scene, const std::vector<int>& animations, double time);

/// Where it comes from, as the files of `peeler render` say it. `motion_rate`: frames a second by
/// which motion is measured; 0 = it is not.
Provenance provenanceOf(const SceneObject& scene, const std::vector<int>& animations, double time,
                        const CaptureSettings& capture, const Window& crop, double motion_rate = 0);

/// Adds the methods that trace rays (tracing.cpp).
void defineTracing(py::class_<RendererObject, std::shared_ptr<RendererObject>>& type,
                   const std::string& camera);

}  // namespace peeler::python

#pragma GCC visibility pop
