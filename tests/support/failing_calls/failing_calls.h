// SPDX-License-Identifier: Apache-2.0
// Kinds of calls that can fail, and the record that the test reads. failing_calls.cpp describes the
// settings.
#pragma once

#include <atomic>
#include <cstdint>

namespace failing {

// The kinds' names, in the order in which the test lists them.
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
constexpr int kGlObjects = 31;  ///< index in Record::counts of the current number of GL objects

/// Counts of calls, mapped from a file that the test made. Forked children continue to count in it.
struct Record {
    std::atomic<std::uint64_t> counts[32];
    std::atomic<std::uint64_t> failed;       ///< number of failed calls
    std::atomic<std::uint64_t> place_count;  ///< number of places below
    /// First allocation of each call path, or number of bytes after each write.
    std::uint64_t places[kMostPlaces];
    ///< bytes after each write
};
static_assert(kCalls <= kGlObjects);

enum class How { kOnce, kOn, kLarge, kShort, kRemove, kMove };

/// The failure to inject, as set by the variables (failing_calls.cpp).
struct Plan {
    Call call = kCalls;
    std::uint64_t at = 0;  ///< number of the failing call, counted from 1; 0 = none fails
    How how = How::kOnce;
    int error = 0;
    char folder[4096] = {};
};
extern Plan plan;
extern Record* record;
extern std::atomic<bool> counting;  ///< whether main() is running

/// Whether calls made by this thread count at this moment.
bool counts();
/// Adds a place to the record.
void addPlace(std::uint64_t place);

/// isNew(): whether the caller of malloc() is operator new. mayFail(): whether the caller can
/// handle a failure.
bool isNew(const void* caller);
bool mayFail(const void* caller);

/// Returns the function of this name in the next library, the one that is wrapped.
void* real(const char* name);
#define REAL(name)                                                                              \
    ([]() {                                                                                     \
        static const auto function = reinterpret_cast<decltype(&::name)>(failing::real(#name)); \
        return function;                                                                        \
    }())

/// Counts a call. Returns whether the call must fail, and sets errno in that case.
bool fails(Call call);

/// Disables counting while the object exists, in this thread and in threads that it starts.
class Uncounted {
  public:
    Uncounted();
    ~Uncounted();
    Uncounted(const Uncounted&) = delete;
    Uncounted& operator=(const Uncounted&) = delete;
};

/// Returns the wrapper of an EGL or GL function that was looked up or, if there is none, the
/// function itself.
void* driverFunction(const char* name, void* found);

}  // namespace failing
