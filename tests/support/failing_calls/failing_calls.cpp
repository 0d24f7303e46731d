// SPDX-License-Identifier: Apache-2.0
// A fault-injection library for LD_PRELOAD: makes the n-th call of a kind fail. Variables:
//
//   PEELER_FAILING_RECORD=FILE  the file that counts calls: a Record (failing_calls.h) of zeros
//   PEELER_FAILING_CALL=KIND    a name in FAILING_CALLS
//   PEELER_FAILING_AT=N         the N-th call, counted from 1, fails. Without this variable no call
//                               fails, and the record gets a list of places
//   PEELER_FAILING_HOW=...      once (default): only this call fails
//                               on: all later calls fail, too
//                               large: all later allocations of at least the same size fail, too,
//                               as under a memory limit
//                               short: only half of a read or write is done
//                               remove, move: instead of a failure, PEELER_FAILING_FOLDER is
//                               deleted with its files, or renamed
//   PEELER_FAILING_ERROR=N      errno
//
// Counts the program's own calls from the beginning to the end of main(). Many drivers abort if
// memory is exhausted, so their calls do not count: calls inside EGL and GL functions, in threads
// started by drivers, and during the loading of libraries. The dynamic linker and glibc abort, too,
// if there is no memory for thread-local variables and their destructors; such calls are recognised
// by their return address.
//
// The program's children do not inherit these variables.
#include "failing_calls.h"
#include "cmd/bake/bake_values.h"

#include <dlfcn.h>
#include <fcntl.h>
#include <ftw.h>
#include <link.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/auxv.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>
#include <unwind.h>

#include <algorithm>
#include <cerrno>
#include <cstdint>
#include <utility>

/// Does nothing. A breakpoint in this function stops at the failing call.
extern "C" __attribute__((noinline)) void failing_calls_here() {
    asm volatile("");
}

namespace failing {

Plan plan;
Record* record = nullptr;
std::atomic<bool> counting{false};

namespace {

struct Range {
    std::uintptr_t begin = 0, end = 0;
    bool has(const void* address) const {
        const auto value = reinterpret_cast<std::uintptr_t>(address);
        return value >= begin && value < end;
    }
};

Range linker, cxx_library, thread_exits;
__attribute__((tls_model("initial-exec"))) thread_local int uncounted = 0;

struct Walk {
    int left;
    std::uint64_t hash;
};

/// Adds an allocation to the record's places if its call path is new.
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
        char other[sizeof plan.folder + 8];
        snprintf(other, sizeof other, "%s.moved", plan.folder);
        REAL(rename)(plan.folder, other);
        return;
    }
    nftw(
        plan.folder, [](const char* path, const struct stat*, int, FTW*) { return remove(path); },
        16, FTW_DEPTH | FTW_PHYS);
}

Range codeOf(const char* name) {
    Dl_info info{};
    void* extra = nullptr;
    void* const address = dlsym(RTLD_DEFAULT, name);
    if (!address || dladdr1(address, &info, &extra, RTLD_DL_SYMENT) == 0 || !extra) return {};
    const auto begin = reinterpret_cast<std::uintptr_t>(info.dli_saddr);
    return {begin, begin + static_cast<const ElfW(Sym)*>(extra)->st_size};
}

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

}  // namespace

Uncounted::Uncounted() {
    ++uncounted;
}
Uncounted::~Uncounted() {
    --uncounted;
}

bool counts() {
    return uncounted == 0 && counting;
}

bool isNew(const void* caller) {
    return cxx_library.has(caller);
}

bool mayFail(const void* caller) {
    return counts() && !linker.has(caller) && !thread_exits.has(caller);
}

void addPlace(std::uint64_t place) {
    const std::uint64_t index = record->place_count.fetch_add(1);
    if (index < kMostPlaces) record->places[index] = place;
}

void* real(const char* name) {
    using Find = void* (*)(void*, const char*);
    // A call of dlsym() would reach our wrapper, so use dlvsym() to find the C library's dlsym().
    // Since glibc 2.34, dlsym() is in libc.so.6 and has the symbol version GLIBC_2.34.
    static const auto find = reinterpret_cast<Find>(dlvsym(RTLD_NEXT, "dlsym", "GLIBC_2.34"));
    return find(RTLD_NEXT, name);
}

bool fails(Call call) {
    if (!counts()) return false;
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
