// SPDX-License-Identifier: Apache-2.0
// Wrappers of the C library: a wrapper for each function that may fail.
#include <dlfcn.h>
#include <fcntl.h>
#include <pthread.h>
#include <spawn.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <sys/file.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/uio.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdint>
#include <ctime>

#include "failing_calls.h"

extern "C" {
void* __libc_malloc(size_t size);
void* __libc_calloc(size_t count, size_t size);
void* __libc_realloc(void* old, size_t size);
void* __libc_memalign(size_t alignment, size_t size);
}

namespace failing {
namespace {

constexpr std::size_t kLarge = std::size_t{64} << 10U;

/// After a failure with How::kLarge, allocations of at least this size fail.
std::atomic<std::size_t> too_large{SIZE_MAX};

bool failsToAllocate(std::size_t size, const void* caller) {
    if (!mayFail(caller)) return false;
    if (fails(k_allocation) || (!isNew(caller) && fails(k_c_allocation)) ||
        (size >= kLarge && fails(k_large_allocation))) {
        if (plan.how == How::kLarge) too_large = size;
        return true;
    }
    if (size < too_large) return false;
    errno = plan.error;
    return true;
}

/// Returns the number of bytes that a read or write may transfer: half of them if the call must be
/// short.
std::size_t allowed(Call call, std::size_t bytes, bool& failed) {
    failed = fails(call);
    if (!failed || plan.how != How::kShort || plan.call != call) return bytes;
    failed = false;
    return std::max<std::size_t>(bytes / 2, 1);
}

/// Like allowed(), for a write, which also counts as a change of a file and as use of disk space.
std::size_t allowedWrite(int file, std::size_t bytes, bool& failed) {
    if (!counts()) return bytes;
    if (file == STDOUT_FILENO || file == STDERR_FILENO) return allowed(k_stream, bytes, failed);
    const std::size_t most = allowed(k_write, bytes, failed);
    if (!failed) failed = fails(k_change);
    if (failed) return 0;
    const std::uint64_t before = record->counts[k_room].fetch_add(most);
    if (plan.call != k_room) return most;
    if (plan.at == 0) addPlace(before + most);
    // If the disk has room for N bytes, byte N + 1 (plan.at) fails.
    if (plan.at == 0 || before + most < plan.at) return most;
    record->failed += 1;
    const std::uint64_t room = plan.at - 1;
    failed = before >= room;
    errno = plan.error;
    record->counts[k_room] = std::max(before, room);
    return failed ? 0 : static_cast<std::size_t>(room - before);
}

bool opensToWrite(int flags) {
    return (flags & O_ACCMODE) != O_RDONLY || (flags & O_CREAT) != 0;
}

bool failsToOpen(int flags) {
    return fails(k_open) || (opensToWrite(flags) && fails(k_change));
}

/// The function and argument of a thread that uncounted code starts. Calls of this thread do not
/// count.
struct Start {
    void* (*work)(void*);
    void* argument;
};

void* workUncounted(void* data) {
    const Uncounted all;
    const Start start = *static_cast<Start*>(data);
    free(data);
    return start.work(start.argument);
}

int (*program_main)(int, char**, char**) = nullptr;

int countedMain(int count, char** arguments, char** environment) {
    counting = true;
    const int code = program_main(count, arguments, environment);
    counting = false;
    return code;
}

}  // namespace
}  // namespace failing

using failing::fails;

#define CALLER __builtin_extract_return_addr(__builtin_return_address(0))

extern "C" {

int __libc_start_main(int (*main)(int, char**, char**), int count, char** arguments, void (*init)(),
                      void (*fini)(), void (*linker_fini)(), void* stack_end) {
    failing::program_main = main;
    return REAL(__libc_start_main)(failing::countedMain, count, arguments, init, fini, linker_fini,
                                   stack_end);
}

void* malloc(size_t size) {
    return failing::failsToAllocate(size, CALLER) ? nullptr : __libc_malloc(size);
}
void* calloc(size_t count, size_t size) {
    return failing::failsToAllocate(count * size, CALLER) ? nullptr : __libc_calloc(count, size);
}
void* realloc(void* old, size_t size) {
    return failing::failsToAllocate(size, CALLER) ? nullptr : __libc_realloc(old, size);
}
void* memalign(size_t alignment, size_t size) {
    return failing::failsToAllocate(size, CALLER) ? nullptr : __libc_memalign(alignment, size);
}
void* aligned_alloc(size_t alignment, size_t size) {
    return failing::failsToAllocate(size, CALLER) ? nullptr : __libc_memalign(alignment, size);
}
int posix_memalign(void** place, size_t alignment, size_t size) {
    if (failing::failsToAllocate(size, CALLER)) return ENOMEM;
    *place = __libc_memalign(alignment, size);
    return *place ? 0 : ENOMEM;
}

int open(const char* path, int flags, ...) {
    va_list more;
    va_start(more, flags);
    const mode_t mode = (flags & (O_CREAT | O_TMPFILE)) != 0 ? va_arg(more, mode_t) : 0;
    va_end(more);
    return failing::failsToOpen(flags) ? -1 : REAL(open)(path, flags, mode);
}
int open64(const char* path, int flags, ...) {
    va_list more;
    va_start(more, flags);
    const mode_t mode = (flags & (O_CREAT | O_TMPFILE)) != 0 ? va_arg(more, mode_t) : 0;
    va_end(more);
    return failing::failsToOpen(flags) ? -1 : REAL(open)(path, flags, mode);
}
int openat(int folder, const char* path, int flags, ...) {
    va_list more;
    va_start(more, flags);
    const mode_t mode = (flags & (O_CREAT | O_TMPFILE)) != 0 ? va_arg(more, mode_t) : 0;
    va_end(more);
    return failing::failsToOpen(flags) ? -1 : REAL(openat)(folder, path, flags, mode);
}
FILE* fopen(const char* path, const char* mode) {
    return failing::failsToOpen(*mode == 'r' ? O_RDONLY : O_CREAT) ? nullptr
                                                                   : REAL(fopen)(path, mode);
}
FILE* fopen64(const char* path, const char* mode) {
    return failing::failsToOpen(*mode == 'r' ? O_RDONLY : O_CREAT) ? nullptr
                                                                   : REAL(fopen64)(path, mode);
}
int memfd_create(const char* name, unsigned flags) noexcept {
    return fails(failing::k_memory_file) ? -1 : REAL(memfd_create)(name, flags);
}

ssize_t read(int file, void* bytes, size_t size) {
    bool failed = false;
    const size_t most = failing::allowed(failing::k_read, size, failed);
    return failed ? -1 : REAL(read)(file, bytes, most);
}
ssize_t pread(int file, void* bytes, size_t size, off_t at) {
    bool failed = false;
    const size_t most = failing::allowed(failing::k_read, size, failed);
    return failed ? -1 : REAL(pread)(file, bytes, most, at);
}
ssize_t pread64(int file, void* bytes, size_t size, off64_t at) {
    bool failed = false;
    const size_t most = failing::allowed(failing::k_read, size, failed);
    return failed ? -1 : REAL(pread64)(file, bytes, most, at);
}
ssize_t write(int file, const void* bytes, size_t size) {
    bool failed = false;
    const size_t most = failing::allowedWrite(file, size, failed);
    return failed ? -1 : REAL(write)(file, bytes, most);
}
ssize_t pwrite(int file, const void* bytes, size_t size, off_t at) {
    bool failed = false;
    const size_t most = failing::allowedWrite(file, size, failed);
    return failed ? -1 : REAL(pwrite)(file, bytes, most, at);
}
ssize_t pwrite64(int file, const void* bytes, size_t size, off64_t at) {
    bool failed = false;
    const size_t most = failing::allowedWrite(file, size, failed);
    return failed ? -1 : REAL(pwrite64)(file, bytes, most, at);
}
ssize_t writev(int file, const iovec* parts, int count) {
    size_t size = 0;
    for (int i = 0; i < count; ++i)
        size += parts[i].iov_len;
    bool failed = false;
    const size_t most = failing::allowedWrite(file, size, failed);
    if (failed) return -1;
    if (most == size) return REAL(writev)(file, parts, count);
    return REAL(write)(file, parts[0].iov_base, std::min(most, parts[0].iov_len));
}
/// Fails only for the standard streams, because glibc writes to them without the wrapped write().
size_t fwrite(const void* bytes, size_t size, size_t count, FILE* file) {
    if ((file == stdout || file == stderr) && fails(failing::k_stream)) return 0;
    return REAL(fwrite)(bytes, size, count, file);
}

int fsync(int file) {
    return fails(failing::k_fsync) ? -1 : REAL(fsync)(file);
}
int fdatasync(int file) {
    return fails(failing::k_fsync) ? -1 : REAL(fdatasync)(file);
}
int syncfs(int file) noexcept {
    return fails(failing::k_fsync) ? -1 : REAL(syncfs)(file);
}
int close(int file) {
    const bool failed = fails(failing::k_close);
    const int error = errno;
    const int result = REAL(close)(file);
    if (failed) errno = error;
    return failed ? -1 : result;
}
int fcntl(int file, int command, ...) {
    va_list more;
    va_start(more, command);
    void* const argument = va_arg(more, void*);  // an int, a pointer or nothing
    va_end(more);
    const bool duplicates = command == F_DUPFD || command == F_DUPFD_CLOEXEC;
    return duplicates && fails(failing::k_duplicate) ? -1 : REAL(fcntl)(file, command, argument);
}
int dup2(int file, int other) noexcept {
    return fails(failing::k_duplicate) ? -1 : REAL(dup2)(file, other);
}
int flock(int file, int operation) noexcept {
    return fails(failing::k_lock) ? -1 : REAL(flock)(file, operation);
}
off_t lseek(int file, off_t at, int from) noexcept {
    return fails(failing::k_seek) ? -1 : REAL(lseek)(file, at, from);
}
int stat(const char* path, struct stat* status) noexcept {
    return fails(failing::k_stat) ? -1 : REAL(stat)(path, status);
}
int lstat(const char* path, struct stat* status) noexcept {
    return fails(failing::k_stat) ? -1 : REAL(lstat)(path, status);
}
int fstat(int file, struct stat* status) noexcept {
    return fails(failing::k_stat) ? -1 : REAL(fstat)(file, status);
}
pid_t wait4(pid_t child, int* status, int options, rusage* used) {
    return fails(failing::k_wait) ? -1 : REAL(wait4)(child, status, options, used);
}
pid_t waitpid(pid_t child, int* status, int options) {
    return fails(failing::k_wait) ? -1 : REAL(waitpid)(child, status, options);
}
int rename(const char* from, const char* to) noexcept {
    return fails(failing::k_rename) || fails(failing::k_change) ? -1 : REAL(rename)(from, to);
}
int renameat(int folder, const char* from, int other, const char* to) noexcept {
    return fails(failing::k_rename) || fails(failing::k_change)
               ? -1
               : REAL(renameat)(folder, from, other, to);
}
int mkdir(const char* path, mode_t mode) noexcept {
    return fails(failing::k_mkdir) || fails(failing::k_change) ? -1 : REAL(mkdir)(path, mode);
}
int ftruncate(int file, off_t size) noexcept {
    return fails(failing::k_change) ? -1 : REAL(ftruncate)(file, size);
}
int unlink(const char* path) noexcept {
    return fails(failing::k_change) ? -1 : REAL(unlink)(path);
}
int unlinkat(int folder, const char* path, int flags) noexcept {
    return fails(failing::k_change) ? -1 : REAL(unlinkat)(folder, path, flags);
}
int rmdir(const char* path) noexcept {
    return fails(failing::k_change) ? -1 : REAL(rmdir)(path);
}

void* mmap(void* place, size_t size, int protection, int flags, int file, off_t at) noexcept {
    return fails(failing::k_mmap) ? MAP_FAILED
                                  : REAL(mmap)(place, size, protection, flags, file, at);
}

pid_t fork() noexcept {
    return fails(failing::k_child) ? -1 : REAL(fork)();
}
int execv(const char* path, char* const* arguments) noexcept {
    return fails(failing::k_child) ? -1 : REAL(execv)(path, arguments);
}
int pipe2(int* ends, int flags) noexcept {
    return fails(failing::k_child) ? -1 : REAL(pipe2)(ends, flags);
}
int posix_spawn(pid_t* child, const char* path, const posix_spawn_file_actions_t* actions,
                const posix_spawnattr_t* attributes, char* const* arguments,
                char* const* environment) {
    return fails(failing::k_child)
               ? errno
               : REAL(posix_spawn)(child, path, actions, attributes, arguments, environment);
}
int pthread_create(pthread_t* thread, const pthread_attr_t* attributes, void* (*work)(void*),
                   void* argument) noexcept {
    if (failing::counts()) {
        if (fails(failing::k_thread)) return errno;
        const failing::Uncounted inside;  // glibc's own allocations do not count
        return REAL(pthread_create)(thread, attributes, work, argument);
    }
    auto* const start = static_cast<failing::Start*>(__libc_malloc(sizeof(failing::Start)));
    *start = {work, argument};
    return REAL(pthread_create)(thread, attributes, failing::workUncounted, start);
}

int clock_gettime(clockid_t clock, timespec* now) noexcept {
    const bool jumps = fails(failing::k_clock);
    const int result = REAL(clock_gettime)(clock, now);
    constexpr time_t kDay = 86400, kYear = 365 * kDay;
    if (!jumps || result != 0) return result;
    // Clocks other than CLOCK_REALTIME must not go back, so they jump forward.
    if (clock == CLOCK_REALTIME)
        now->tv_sec -= kYear;
    else if (failing::plan.how == failing::How::kOn)
        now->tv_sec += kDay;
    return result;
}
time_t time(time_t* place) noexcept {
    timespec now{};
    clock_gettime(CLOCK_REALTIME, &now);
    if (place) *place = now.tv_sec;
    return now.tv_sec;
}

void* dlopen(const char* path, int flags) noexcept {
    // To fail, load a missing file, so that dlerror() has a message.
    const bool failed = fails(failing::k_library);
    const failing::Uncounted inside;
    return REAL(dlopen)(failed ? "/nowhere/a library that cannot be loaded" : path, flags);
}
void* dlsym(void* library, const char* name) noexcept {
    return failing::driverFunction(name, REAL(dlsym)(library, name));
}

}  // extern "C"
