// SPDX-License-Identifier: Apache-2.0
// The program's pthread_mutex_destroy(), which mends a race of Mesa's llvmpipe from outside.
//
// lp_fence_signal() (lp_fence.c, Mesa 22.3.6 to 25.0.7 at least), in a rasteriser's thread, counts
// under the fence's mutex. lp_fence_signalled() reads the count without it, and at each change of
// the framebuffer lp_setup_get_empty_scene() destroys and frees a fence that is signalled. The
// thread may still be about to unlock the mutex, and then writes into freed memory ("corrupted
// unsorted chunks", or SIGSEGV in a later malloc). Locking the mutex before it is destroyed waits
// for that thread; Mesa's util_queue_fence_destroy() does the same.
//
// A definition in the program precedes the C library's for every library of the process
// (CMakeLists.txt exports it). The library has none: that is for its host to decide
// (examples/guide/library.md, "Threads and contexts").
#include <dlfcn.h>
#include <pthread.h>

#include <cerrno>
#include <ctime>

extern "C" [[gnu::visibility("default")]] int pthread_mutex_destroy(
    pthread_mutex_t* mutex) noexcept {
    using Function = int (*)(pthread_mutex_t*);
    static const auto destroy =
        reinterpret_cast<Function>(dlsym(RTLD_NEXT, "pthread_mutex_destroy"));
    // Bounded, since a mutex may stay locked: by the caller, or by a thread that has ended.
    timespec latest{};
    clock_gettime(CLOCK_REALTIME, &latest);
    ++latest.tv_sec;
    const int locked = pthread_mutex_timedlock(mutex, &latest);
    if (locked == 0 || locked == EOWNERDEAD) pthread_mutex_unlock(mutex);
    return destroy(mutex);
}
