// SPDX-License-Identifier: Apache-2.0
// A library for LD_PRELOAD that makes the n-th call of a kind fail. Variables:
//
//   PEELER_FAILING_RECORD=FILE  where calls are counted: a Record (failing_calls.h) of zeros
//   PEELER_FAILING_CALL=KIND    a name in FAILING_CALLS
//   PEELER_FAILING_AT=N         the N-th of them, counted from 1, fails; without it none does, and
//                               the record gets a list of places
//   PEELER_FAILING_HOW=...      once (default); on: and so do all after it; large: and so do all
//                               allocations after it that are as large or larger, as where there is
//                               a limit; short: reads and writes do the half; remove, move: instead
//                               of failing, PEELER_FAILING_FOLDER goes, with its files or under
//                               another name
//   PEELER_FAILING_ERROR=N      errno
//
// Counted is what the program does between the beginning and the end of main(). What drivers do is
// not theirs to catch, and many end the process where memory does: calls of EGL and GL are told
// apart as they are entered, threads that they start by who starts them, and so is what libraries
// do while they are loaded. The dynamic linker and glibc abort without memory for thread-local
// variables and their destructors; such calls are told by the address that they return to.
//
// Children that the program starts begin without these variables.
#include "failing_calls.h"

#include <dlfcn.h>
#include <fcntl.h>
#include <ftw.h>
#include <link.h>
#include <pthread.h>
#include <spawn.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/auxv.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <sys/uio.h>
#include <unistd.h>
#include <unwind.h>

#include <algorithm>
#include <cerrno>
#include <cstdint>
#include <ctime>
#include <string>
#include <utility>

extern "C" {
void* __libc_malloc(size_t size);
void* __libc_calloc(size_t count, size_t size);
void* __libc_realloc(void* old, size_t size);
void* __libc_memalign(size_t alignment, size_t size);
}

/// Where a debugger finds the call that is to fail.
extern "C" __attribute__((noinline)) void failing_calls_here() {
    asm volatile("");
}

namespace failing {
namespace {

enum class How { kOnce, kOn, kLarge, kShort, kRemove, kMove };

struct Plan {
    Call call = kCalls;
    std::uint64_t at = 0;  ///< 0 = none
    How how = How::kOnce;
    int error = EIO;
    char folder[4096] = {};
};

struct Range {
    std::uintptr_t begin = 0, end = 0;
    bool has(const void* address) const {
        const auto value = reinterpret_cast<std::uintptr_t>(address);
        return value >= begin && value < end;
    }
};

Plan plan;
Record* record = nullptr;
std::atomic<bool> counting{false};  ///< main() runs
Range linker, cxx_library, thread_exits;
__attribute__((tls_model("initial-exec"))) thread_local int uncounted = 0;

template <class Function>
Function real(const char* name) {
    using Find = void* (*)(void*, const char*);
    // Not dlsym(), which is below; of this version since glibc has no library for it any more.
    static const auto find = reinterpret_cast<Find>(dlvsym(RTLD_NEXT, "dlsym", "GLIBC_2.34"));
    return reinterpret_cast<Function>(find(RTLD_NEXT, name));
}
/// The function of this name behind this library.
#define REAL(name)                                                            \
    ([]() {                                                                   \
        static const auto function = failing::real<decltype(&::name)>(#name); \
        return function;                                                      \
    }())

void addPlace(std::uint64_t place) {
    const std::uint64_t index = record->place_count.fetch_add(1);
    if (index < kMostPlaces) record->places[index] = place;
}

struct Walk {
    int left;
    std::uint64_t hash;
};

/// Lists the allocation if none before has had the same callers.
void notePath(std::uint64_t number) {
    constexpr int kDepth = 24;
    constexpr std::size_t kSlots = 1 << 18;
    static std::atomic<std::uint64_t> known[kSlots];
    Walk walk{kDepth, 1469598103934665603ULL};
    _Unwind_Backtrace(
        [](_Unwind_Context* context, void* data) {
            auto* const at = static_cast<Walk*>(data);
            at->hash = (at->hash ^ _Unwind_GetIP(context)) * 1099511628211ULL;
            return --at->left > 0 ? _URC_NO_REASON : _URC_END_OF_STACK;
        },
        &walk);
    for (std::size_t slot = walk.hash >> 20U;; ++slot) {
        std::uint64_t there = 0;
        if (known[slot % kSlots].compare_exchange_strong(there, walk.hash)) return addPlace(number);
        if (there == walk.hash) return;
    }
}

void takeFolderAway() {
    const Uncounted inside;
    if (plan.how == How::kMove) {
        const std::string other = std::string(plan.folder) + ".moved";
        REAL(rename)(plan.folder, other.c_str());
        return;
    }
    nftw(
        plan.folder, [](const char* path, const struct stat*, int, FTW*) { return remove(path); },
        16, FTW_DEPTH | FTW_PHYS);
}

/// How many bytes of a read or a write are done; all of them unless it is to be a short one.
std::size_t allowed(Call call, std::size_t bytes, bool& failed) {
    failed = fails(call);
    if (!failed || plan.how != How::kShort || plan.call != call || bytes < 2) return bytes;
    failed = false;
    return bytes / 2;
}

/// Likewise of a write, which changes a file and needs room for it.
std::size_t allowedWrite(int file, std::size_t bytes, bool& failed) {
    if (uncounted != 0 || !counting) return bytes;
    if (file == STDOUT_FILENO || file == STDERR_FILENO) return allowed(k_stream, bytes, failed);
    const std::size_t most = allowed(k_write, bytes, failed);
    if (!failed) failed = fails(k_change);
    if (failed) return 0;
    const std::uint64_t before = record->counts[k_room].fetch_add(most);
    if (plan.call != k_room) return most;
    if (plan.at == 0) addPlace(before + most);
    // A room of N bytes is full before the N+1-st; none is asked for by N = 1.
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

/// Where the machine's code of a function is.
Range codeOf(const char* name) {
    Dl_info info{};
    void* extra = nullptr;
    void* const address = dlsym(RTLD_DEFAULT, name);
    if (!address || dladdr1(address, &info, &extra, RTLD_DL_SYMENT) == 0 || !extra) return {};
    const auto begin = reinterpret_cast<std::uintptr_t>(info.dli_saddr);
    return {begin, begin + static_cast<const ElfW(Sym)*>(extra)->st_size};
}

/// Where in memory a library lies.
Range rangeOf(const dl_phdr_info& info) {
    std::uintptr_t end = info.dlpi_addr;
    for (int i = 0; i < info.dlpi_phnum; ++i)
        end = std::max<std::uintptr_t>(
            end, info.dlpi_addr + info.dlpi_phdr[i].p_vaddr + info.dlpi_phdr[i].p_memsz);
    return {info.dlpi_addr, end};
}

int findRanges(dl_phdr_info* info, std::size_t, void*) {
    if (info->dlpi_addr == getauxval(AT_BASE)) linker = rangeOf(*info);
    if (strstr(info->dlpi_name, "/libstdc++.so")) cxx_library = rangeOf(*info);
    return 0;
}

const char* takeVariable(const char* name) {
    const char* const text = getenv(name);
    return text ? text : "";
}

__attribute__((constructor)) void prepare() {
    constexpr const char* kVariables[] = {
        "LD_PRELOAD",         "PEELER_FAILING_RECORD", "PEELER_FAILING_CALL",  "PEELER_FAILING_AT",
        "PEELER_FAILING_HOW", "PEELER_FAILING_ERROR",  "PEELER_FAILING_FOLDER"};
    constexpr const char* kNames[] = {
#define X(name) #name,
        FAILING_CALLS(X)
#undef X
    };
    constexpr std::pair<const char*, How> kHows[] = {{"on", How::kOn},
                                                     {"large", How::kLarge},
                                                     {"short", How::kShort},
                                                     {"remove", How::kRemove},
                                                     {"move", How::kMove}};
    const int file = REAL(open)(takeVariable("PEELER_FAILING_RECORD"), O_RDWR | O_CLOEXEC);
    void* const place =
        file < 0 ? MAP_FAILED
                 : REAL(mmap)(nullptr, sizeof(Record), PROT_READ | PROT_WRITE, MAP_SHARED, file, 0);
    if (place == MAP_FAILED) {
        fputs("failing calls: there is no record\n", stderr);
        _exit(126);
    }
    REAL(close)(file);
    record = static_cast<Record*>(place);
    for (int i = 0; i < kCalls; ++i)
        if (strcmp(kNames[i], takeVariable("PEELER_FAILING_CALL")) == 0)
            plan.call = static_cast<Call>(i);
    plan.at = strtoull(takeVariable("PEELER_FAILING_AT"), nullptr, 10);
    for (const auto& [name, how] : kHows)
        if (strcmp(name, takeVariable("PEELER_FAILING_HOW")) == 0) plan.how = how;
    plan.error = atoi(takeVariable("PEELER_FAILING_ERROR"));
    strncpy(plan.folder, takeVariable("PEELER_FAILING_FOLDER"), sizeof plan.folder - 1);
    for (const char* name : kVariables)
        unsetenv(name);
    dl_iterate_phdr(findRanges, nullptr);
    thread_exits = codeOf("__cxa_thread_atexit_impl");
}

/// A thread and whether the one that starts it counts.
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

Uncounted::Uncounted() {
    ++uncounted;
}
Uncounted::~Uncounted() {
    --uncounted;
}

bool fails(Call call) {
    if (uncounted != 0 || !counting) return false;
    const std::uint64_t number = record->counts[call].fetch_add(1) + 1;
    if (call != plan.call) return false;
    if (plan.at == 0) {
        const Uncounted inside;
        if (call == k_allocation || call == k_c_allocation) notePath(number);
        return false;
    }
    if (plan.how == How::kOn ? number < plan.at : number != plan.at) return false;
    record->failed += 1;
    failing_calls_here();
    if (plan.how == How::kRemove || plan.how == How::kMove) {
        takeFolderAway();
        return false;
    }
    errno = plan.error;
    return true;
}

}  // namespace failing

using failing::fails;

namespace {

constexpr std::size_t kLarge = std::size_t{64} << 10U;

/// The size of the allocation that has failed, from which on all fail.
std::atomic<std::size_t> too_large{SIZE_MAX};

bool failsToAllocate(std::size_t size, const void* caller) {
    if (failing::uncounted != 0 || !failing::counting || failing::linker.has(caller) ||
        failing::thread_exits.has(caller))
        return false;
    const bool is_new = failing::cxx_library.has(caller);
    if (fails(failing::k_allocation) || (!is_new && fails(failing::k_c_allocation)) ||
        (size >= kLarge && fails(failing::k_large_allocation))) {
        if (failing::plan.how == failing::How::kLarge) too_large = size;
        return true;
    }
    if (size < too_large) return false;
    errno = failing::plan.error;
    return true;
}

}  // namespace

#define CALLER __builtin_extract_return_addr(__builtin_return_address(0))

extern "C" {

int __libc_start_main(int (*main)(int, char**, char**), int count, char** arguments, void (*init)(),
                      void (*fini)(), void (*linker_fini)(), void* stack_end) {
    failing::program_main = main;
    return REAL(__libc_start_main)(failing::countedMain, count, arguments, init, fini, linker_fini,
                                   stack_end);
}

void* malloc(size_t size) {
    return failsToAllocate(size, CALLER) ? nullptr : __libc_malloc(size);
}
void* calloc(size_t count, size_t size) {
    return failsToAllocate(count * size, CALLER) ? nullptr : __libc_calloc(count, size);
}
void* realloc(void* old, size_t size) {
    return failsToAllocate(size, CALLER) ? nullptr : __libc_realloc(old, size);
}
void* memalign(size_t alignment, size_t size) {
    return failsToAllocate(size, CALLER) ? nullptr : __libc_memalign(alignment, size);
}
void* aligned_alloc(size_t alignment, size_t size) {
    return failsToAllocate(size, CALLER) ? nullptr : __libc_memalign(alignment, size);
}
int posix_memalign(void** place, size_t alignment, size_t size) {
    if (failsToAllocate(size, CALLER)) return ENOMEM;
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
    return fails(failing::k_open) ? -1 : REAL(memfd_create)(name, flags);
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
/// Of glibc's own buffered files, only of the standard streams: what they write in the end is a
/// call within glibc.
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
int close(int file) {
    const bool failed = fails(failing::k_close);
    const int error = errno;
    const int result = REAL(close)(file);
    if (failed) errno = error;
    return failed ? -1 : result;
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
    if (failing::uncounted == 0) {
        if (fails(failing::k_thread)) return errno;
        const failing::Uncounted inside;  // glibc's memory for it
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
    // What counts the time since the start never goes back, but may miss some.
    if (jumps && result == 0) now->tv_sec += clock == CLOCK_REALTIME ? -kYear : kDay;
    return result;
}
time_t time(time_t* place) noexcept {
    timespec now{};
    clock_gettime(CLOCK_REALTIME, &now);
    if (place) *place = now.tv_sec;
    return now.tv_sec;
}

void* dlopen(const char* path, int flags) noexcept {
    // What fails is found nowhere, so that dlerror() has something to say.
    const bool failed = fails(failing::k_library);
    const failing::Uncounted inside;
    return REAL(dlopen)(failed ? "/nowhere/a library that cannot be loaded" : path, flags);
}
void* dlsym(void* library, const char* name) noexcept {
    return failing::driverFunction(name, REAL(dlsym)(library, name));
}

}  // extern "C"
