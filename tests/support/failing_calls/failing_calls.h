// SPDX-License-Identifier: Apache-2.0
// Kinds of calls that can fail, and the record that the test reads. failing_calls.cpp describes the
// environment variables.
#pragma once

#include <atomic>
#include <cstdint>

namespace failing {

// The names of the kinds, in the order of the test's list.
#define FAILING_CALLS(X)                                                                          \
    X(allocation)       /* malloc, calloc etc., including those of operator new */                \
    X(c_allocation)     /* allocations that are not by operator new */                            \
    X(large_allocation) /* allocations of 64 KiB or more */                                       \
    X(open)             /* open, openat, fopen */                                                 \
    X(memory_file)      /* memfd_create */                                                        \
    X(read)             /* read, pread */                                                         \
    X(write)            /* write, pwrite, writev; not to standard output and error */             \
    X(room)             /* disk space for those writes; counts bytes, not calls */                \
    X(stream)           /* writes to standard output and error */                                 \
    X(fsync)            /* fsync, fdatasync, syncfs */                                            \
    X(close)            /* close; the descriptor is closed even so, as on Linux */                \
    X(rename)           /* rename, renameat */                                                    \
    X(mkdir)            /* mkdir */                                                               \
    X(change)           /* calls that a read-only file system refuses: open to write, write... */ \
    X(duplicate)        /* dup2, and fcntl that duplicates a descriptor */                        \
    X(lock)             /* flock */                                                               \
    X(seek)             /* lseek */                                                               \
    X(stat)             /* stat, fstat, lstat */                                                  \
    X(wait)             /* wait4, waitpid */                                                      \
    X(mmap)             /* mmap */                                                                \
    X(child)            /* fork, posix_spawn, execv, pipe2 */                                     \
    X(thread)           /* pthread_create */                                                      \
    X(clock)            /* clock_gettime, time */                                                 \
    X(library)          /* dlopen */                                                              \
    X(egl)              /* EGL functions */                                                       \
    X(gl)               /* GL commands: skipped, with an error */                                 \
    X(gl_allocation)    /* GL commands that allocate storage */                                   \
    X(gl_mapping)       /* glMapNamedBufferRange */                                               \
    X(gl_error)         /* glGetError and glGetGraphicsResetStatus: a false error */

enum Call : int {
#define X(name) k_##name,
    FAILING_CALLS(X)
#undef X
        kCalls
};

constexpr int kMostPlaces = 1 << 16;
constexpr int kGlObjects = 31;  ///< place of the number of GL objects in Record::counts

/// Counts of calls, in a mapped file that the test creates and that forked children share.
struct Record {
    std::atomic<std::uint64_t> counts[32];
    std::atomic<std::uint64_t> failed;
    std::atomic<std::uint64_t> place_count;  ///< number of entries in `places`
    /// For allocations: the number of the first call from each call path. For disk space: the total
    /// bytes after each write.
    std::uint64_t places[kMostPlaces];
};
static_assert(kCalls <= kGlObjects);

enum class How { kOnce, kOn, kLarge, kShort, kRemove, kMove };

/// The failure to inject, read from the environment variables (failing_calls.cpp).
struct Plan {
    Call call = kCalls;
    std::uint64_t at = 0;  ///< number of the failing call, counted from 1; 0: no call fails
    How how = How::kOnce;
    int error = 0;
    char folder[4096] = {};
};
extern Plan plan;
extern Record* record;
extern std::atomic<bool> counting;  ///< whether main() is running

/// Whether calls of this thread count now.
bool counts();
void addPlace(std::uint64_t place);

/// isNew() returns whether the caller of malloc() is operator new. mayFail() returns whether the
/// caller can handle a failure.
bool isNew(const void* caller);
bool mayFail(const void* caller);

/// Returns the wrapped function: the function of this name in the next library.
void* real(const char* name);
#define REAL(name)                                                                              \
    ([]() {                                                                                     \
        static const auto function = reinterpret_cast<decltype(&::name)>(failing::real(#name)); \
        return function;                                                                        \
    }())

/// Counts a call. Returns whether the call must fail, and sets errno if so.
bool fails(Call call);

/// While an object exists, calls do not count in its thread and in threads started by that thread.
class Uncounted {
  public:
    Uncounted();
    ~Uncounted();
    Uncounted(const Uncounted&) = delete;
    Uncounted& operator=(const Uncounted&) = delete;
};

/// Returns the wrapper of an EGL or GL function, or `found` if there is no wrapper.
void* driverFunction(const char* name, void* found);

}  // namespace failing
