// SPDX-License-Identifier: Apache-2.0
// Override of pthread_mutex_destroy() that works around a race condition in Mesa's llvmpipe.
//
// lp_fence_signal() (lp_fence.c, Mesa 22.3.6 to 25.0.7 at least) increments the count in a
// rasteriser thread under the fence's mutex. lp_fence_signalled() reads the count without the
// mutex. At each framebuffer change, lp_setup_get_empty_scene() destroys and frees a signalled
// fence. The rasteriser thread may not have unlocked the mutex yet. When the thread unlocks the
// mutex, it writes to freed memory ("corrupted unsorted chunks", or SIGSEGV in a later malloc).
// Locking the mutex before destroying it waits for that thread; Mesa's util_queue_fence_destroy()
// does the same.
//
// Defined in the program and exported (CMakeLists.txt), this function overrides the C library's
// function for every library in the process. The peeler library does not define it: that decision
// is up to the host program (examples/guide/library.md, "Threads and contexts").
#include <dlfcn.h>
#include <pthread.h>

#include <cerrno>
#include <ctime>

extern "C" [[gnu::visibility("default")]] int pthread_mutex_destroy(
    pthread_mutex_t* mutex) noexcept {
    using Function = int (*)(pthread_mutex_t*);
    static const auto destroy =
        reinterpret_cast<Function>(dlsym(RTLD_NEXT, "pthread_mutex_destroy"));
    // The lock has a time limit, because the caller or a thread that has ended may still hold the
    // mutex.
    timespec latest{};
    clock_gettime(CLOCK_REALTIME, &latest);
    ++latest.tv_sec;
    const int locked = pthread_mutex_timedlock(mutex, &latest);
    if (locked == 0 || locked == EOWNERDEAD) pthread_mutex_unlock(mutex);
    return destroy(mutex);
}
