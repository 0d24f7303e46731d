// SPDX-License-Identifier: Apache-2.0
#include "core/base/worker_thread.h"

#include <pthread.h>
#include <signal.h>

#include <utility>

namespace peeler {
namespace {

/// A new thread inherits the mask of the one that starts it.
class SignalsBlocked {
  public:
    SignalsBlocked() {
        sigset_t all;
        sigfillset(&all);
        pthread_sigmask(SIG_SETMASK, &all, &before_);
    }
    ~SignalsBlocked() { pthread_sigmask(SIG_SETMASK, &before_, nullptr); }
    SignalsBlocked(const SignalsBlocked&) = delete;
    SignalsBlocked& operator=(const SignalsBlocked&) = delete;

  private:
    sigset_t before_;
};

}  // namespace

std::thread startWorker(std::function<void()> work) {
    const SignalsBlocked blocked;
    return std::thread(std::move(work));
}

}  // namespace peeler
