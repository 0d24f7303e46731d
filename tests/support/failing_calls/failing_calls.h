// SPDX-License-Identifier: Apache-2.0
// Failing kinds of calls, and their record, which the test reads (its settings: failing_calls.cpp).
#pragma once

#include <atomic>
#include <cstdint>

namespace failing {

// Names of the kinds, in the order of the test's list.
#define FAILING_CALLS(X)                                                                          \
    X(allocation)       /* malloc and its like, also for operator new */                          \
    X(c_allocation)     /* of these, those that are not for operator new */                       \
    X(large_allocation) /* of these, those of 64 KiB or more */                                   \
    X(open)             /* open, openat, fopen */                                                 \
    X(memory_file)      /* memfd_create */                                                        \
    X(read)             /* read, pread */                                                         \
    X(write)            /* write, pwrite, writev; not to standard output and error */             \
    X(room)             /* a byte that these write: not calls are counted, but bytes */           \
    X(stream)           /* writing to standard output and error */                                \
    X(fsync)            /* fsync, fdatasync, syncfs */                                            \
    X(close)            /* close: it is closed nevertheless, as Linux does it */                  \
    X(rename)           /* rename, renameat */                                                    \
    X(mkdir)            /* mkdir */                                                               \
    X(change)           /* whatever a read-only file system refuses: open to write, write, ... */ \
    X(duplicate)        /* fcntl that makes another descriptor, dup2 */                           \
    X(lock)             /* flock */                                                               \
    X(seek)             /* lseek */                                                               \
    X(stat)             /* stat, fstat, lstat */                                                  \
    X(wait)             /* wait4, waitpid */                                                      \
    X(mmap)             /* mmap */                                                                \
    X(child)            /* fork, posix_spawn, execv, pipe2 */                                     \
    X(thread)           /* pthread_create */                                                      \
    X(clock)            /* clock_gettime, time */                                                 \
    X(library)          /* dlopen */                                                              \
    X(egl)              /* what EGL returns */                                                    \
    X(gl)               /* a command of GL: it is not carried out, and leaves an error */         \
    X(gl_allocation)    /* likewise those that make storage */                                    \
    X(gl_mapping)       /* glMapNamedBufferRange: likewise */                                     \
    X(gl_error)         /* glGetError and glGetGraphicsResetStatus: an error that was not there */

enum Call : int {
#define X(name) k_##name,
    FAILING_CALLS(X)
#undef X
        kCalls
};

constexpr int kMostPlaces = 1 << 16;
constexpr int kGlObjects = 31;  ///< index in the counts: the current number of GL objects

/// Mapped from a file of the test; forked children continue to count.
struct Record {
    std::atomic<std::uint64_t> counts[32];
    std::atomic<std::uint64_t> failed;       ///< number of failed calls
    std::atomic<std::uint64_t> place_count;  ///< number of places below
    std::uint64_t places[kMostPlaces];  ///< the first allocation of each path, or the number of
                                        ///< bytes after each write
};
static_assert(kCalls <= kGlObjects);

enum class How { kOnce, kOn, kLarge, kShort, kRemove, kMove };

/// The planned failure (failing_calls.cpp).
struct Plan {
    Call call = kCalls;
    std::uint64_t at = 0;  ///< 0 = none
    How how = How::kOnce;
    int error = 0;
    char folder[4096] = {};
};
extern Plan plan;
extern Record* record;
extern std::atomic<bool> counting;  ///< main() is running

/// Whether calls of this thread count now.
bool counts();
/// Adds a place to the record.
void addPlace(std::uint64_t place);

/// Whether malloc()'s caller is operator new, and whether the caller can handle a failure.
bool isNew(const void* caller);
bool mayFail(const void* caller);

/// Returns the next library's function of this name.
void* real(const char* name);
#define REAL(name)                                                                              \
    ([]() {                                                                                     \
        static const auto function = reinterpret_cast<decltype(&::name)>(failing::real(#name)); \
        return function;                                                                        \
    }())

/// Counts a call. Returns whether it must fail, with errno set.
bool fails(Call call);

/// Disables counting, while it lives, on this thread and on those that it starts.
class Uncounted {
  public:
    Uncounted();
    ~Uncounted();
    Uncounted(const Uncounted&) = delete;
    Uncounted& operator=(const Uncounted&) = delete;
};

/// Returns the wrapper of a looked-up EGL or GL function, or the found one.
void* driverFunction(const char* name, void* found);

}  // namespace failing
