// SPDX-License-Identifier: Apache-2.0
// Which calls fail, and the record of them that the test reads (failing_calls.cpp tells how it is
// asked for).
#pragma once

#include <atomic>
#include <cstdint>

namespace failing {

// The names as the test knows them, in the order of its list.
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
constexpr int kGlObjects = 31;  ///< in the counts: the objects of GL that there are now

/// Lies in a file that the test has made; forked children count on.
struct Record {
    std::atomic<std::uint64_t> counts[32];
    std::atomic<std::uint64_t> failed;       ///< calls that were made to fail
    std::atomic<std::uint64_t> place_count;  ///< of those below
    std::uint64_t places[kMostPlaces];       ///< allocations that are the first of their path, or
                                             ///< how many bytes there were after each write
};
static_assert(kCalls <= kGlObjects);

enum class How { kOnce, kOn, kLarge, kShort, kRemove, kMove };

/// What is to fail (failing_calls.cpp).
struct Plan {
    Call call = kCalls;
    std::uint64_t at = 0;  ///< 0 = none
    How how = How::kOnce;
    int error = 0;
    char folder[4096] = {};
};
extern Plan plan;
extern Record* record;
extern std::atomic<bool> counting;  ///< main() runs

/// Whether calls are counted here and now.
bool counts();
/// Lists a place in the record.
void addPlace(std::uint64_t place);

/// Whether who calls malloc() is operator new, and whether anybody could go on without memory.
bool isNew(const void* caller);
bool mayFail(const void* caller);

/// The function of this name behind this library.
void* real(const char* name);
#define REAL(name)                                                                              \
    ([]() {                                                                                     \
        static const auto function = reinterpret_cast<decltype(&::name)>(failing::real(#name)); \
        return function;                                                                        \
    }())

/// Counts a call. True if it is to fail; then errno is set.
bool fails(Call call);

/// While one lives, nothing is counted on this thread, nor on those that it starts.
class Uncounted {
  public:
    Uncounted();
    ~Uncounted();
    Uncounted(const Uncounted&) = delete;
    Uncounted& operator=(const Uncounted&) = delete;
};

/// What stands for a function of EGL or GL that was looked up, or what was found.
void* driverFunction(const char* name, void* found);

}  // namespace failing
