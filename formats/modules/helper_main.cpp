// SPDX-License-Identifier: Apache-2.0
#include "formats/modules/helper_main.h"

#include <sys/prctl.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <new>
#include <span>
#include <string>

#include <peeler/error.h>
#include "formats/file/regular_file.h"

namespace peeler {
namespace {

// Sanitizers reserve terabytes of address space, so no useful limit is possible with them.
#ifdef PEELER_SHADOW_MEMORY
constexpr bool kLimitsMemory = false;
#else
constexpr bool kLimitsMemory = true;
#endif

std::uint64_t address_space_at_start = 0;  ///< size in bytes; 0 if unknown

std::uint64_t addressSpace() {
    unsigned long long pages = 0;
    if (std::FILE* file = std::fopen("/proc/self/statm", "re")) {
        if (std::fscanf(file, "%llu", &pages) != 1) pages = 0;
        std::fclose(file);
    }
    return pages * static_cast<std::uint64_t>(sysconf(_SC_PAGESIZE));
}

/// Lowers a resource limit, unless the current limit is lower. Unless `for_good`, the limit can be
/// changed again later.
void limit(int resource, std::uint64_t value, bool for_good = true) {
    struct rlimit both {};
    if (getrlimit(static_cast<__rlimit_resource>(resource), &both) != 0) return;
    both.rlim_cur = std::min<rlim_t>(both.rlim_max, value);
    if (for_good) both.rlim_max = both.rlim_cur;
    setrlimit(static_cast<__rlimit_resource>(resource), &both);
}

void limitMemoryTo(std::uint64_t bytes, bool for_good) {
    limit(RLIMIT_FSIZE, bytes, for_good);
    if (kLimitsMemory && address_space_at_start > 0)
        limit(RLIMIT_AS, address_space_at_start + bytes, for_good);
}

void putText(SharedFile& file, const std::string& text) {
    file.put(std::span<const char>(text));
}

/// Replaces the result so far with an error.
void putError(SharedFile& result, const Error& error) {
    result.seek(sizeof(HelperState));
    result.putOne(error.kind());
    putText(result, error.what());
    putText(result, error.hint());
}

void workOn(SharedFile& request, SharedFile& result, HelperWork work) {
    try {
        work(request, result);
    } catch (const Error&) {
        throw;
    } catch (const std::bad_alloc&) {
        throw Error(ErrorKind::kInput, "decoding takes too much memory for the size of the data");
    } catch (const std::exception& error) {
        throw Error(ErrorKind::kInput, error.what());
    }
}

}  // namespace

void limitMemory(std::uint64_t bytes) {
    limitMemoryTo(bytes, true);
}

void limitSeconds(int seconds) {
    struct rlimit both {};
    if (getrlimit(RLIMIT_CPU, &both) != 0) return;
    both.rlim_cur = std::min(both.rlim_cur, static_cast<rlim_t>(seconds));
    setrlimit(RLIMIT_CPU, &both);
}

void helperMain(int count, char** arguments, HelperWork work) {
    openStandardStreams();
    if (count != 2) _exit(static_cast<int>(ErrorKind::kUsage));
    limit(RLIMIT_CORE, 0);
    // The soft limit is a second lower, because its signal (SIGXCPU) shows that the time is up. The
    // signal of the hard limit, SIGKILL, could have other causes.
    const std::uint64_t seconds = std::strtoull(arguments[1], nullptr, 10);
    limit(RLIMIT_CPU, seconds + 1);
    limit(RLIMIT_CPU, seconds, false);
    address_space_at_start = addressSpace();
    const off_t request_bytes = lseek(STDIN_FILENO, 0, SEEK_END);
    constexpr std::uint64_t kOfRequest = 16;
    limitMemoryTo(
        kFirstMemory + kOfRequest * static_cast<std::uint64_t>(std::max<off_t>(0, request_bytes)),
        false);
    limit(RLIMIT_NOFILE, 0);
    limit(RLIMIT_NPROC, 0);
    prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0);
    limitSystemCalls();  // on systems without support, only the limits above apply
    try {
        SharedFile request(STDIN_FILENO), result(STDOUT_FILENO, sizeof(HelperState));
        HelperState state = HelperState::kDone;
        try {
            workOn(request, result, work);
        } catch (const Error& error) {
            putError(result, error);
            state = HelperState::kFailed;
        }
        // Write the state last, so that a process killed earlier leaves no valid result.
        result.seek(0);
        result.putOne(state);
    } catch (const std::exception&) {
        _exit(1);  // not enough memory even for a message
    }
    _exit(0);
}

}  // namespace peeler
