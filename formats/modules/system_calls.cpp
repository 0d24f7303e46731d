// SPDX-License-Identifier: Apache-2.0
// The seccomp(2) filter for decoders: the table of allowed system calls, and the BPF program
// generated from it.
#include <linux/audit.h>
#include <linux/filter.h>
#include <linux/seccomp.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <fcntl.h>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "formats/modules/helper_main.h"

namespace peeler {
namespace {

#if defined(__x86_64__)
#define PEELER_AUDIT_ARCHITECTURE AUDIT_ARCH_X86_64
#elif defined(__aarch64__) && defined(__AARCH64EL__)
#define PEELER_AUDIT_ARCHITECTURE AUDIT_ARCH_AARCH64
#endif

// Builds with sanitizers get no filter, since the sanitizers' error reports read /proc and more.
#if defined(PEELER_AUDIT_ARCHITECTURE) && !defined(PEELER_SHADOW_MEMORY)

/// A system call that is allowed if the low 32 bits of an argument, masked, have this value.
struct Allowed {
    std::uint32_t call;
    unsigned argument = 0;
    std::uint32_t mask = 0;  ///< 0 allows any value of the argument
    std::uint32_t value = 0;
};

/// Returns the allowed calls: those for open files, for non-executable memory, and for the process
/// itself.
std::vector<Allowed> allowedCalls() {
    constexpr std::uint32_t kAll = ~std::uint32_t{0};
    const auto self = static_cast<std::uint32_t>(getpid());
    return {
        {SYS_read},
        {SYS_write},
        {SYS_pread64},
        {SYS_pwrite64},
        {SYS_lseek},
        {SYS_close},
        {SYS_brk},
        {SYS_munmap},
        {SYS_mremap},
        {SYS_madvise},
        {SYS_mmap, 2, PROT_EXEC, 0},
        {SYS_mprotect, 2, PROT_EXEC, 0},
        {SYS_futex},
        {SYS_clock_gettime},
        {SYS_getrandom},
        {SYS_sched_yield},
        {SYS_getpid},
        {SYS_gettid},
        {SYS_getuid},   // for libuuid's random numbers
        {SYS_getppid},  // for the same
        {SYS_exit},
        {SYS_exit_group},
        {SYS_rt_sigreturn},
        {SYS_rt_sigprocmask},
        {SYS_rt_sigaction},
        {SYS_tgkill, 0, kAll, self},  // for abort()
        {SYS_prlimit64, 0, kAll, 0},  // for limitMemory()
        {SYS_fcntl, 1, kAll, F_GETFD},
        {SYS_dup},  // allowed, but RLIMIT_NOFILE makes it fail
    };
}

std::vector<sock_filter> filterOf(const std::vector<Allowed>& allowed) {
    constexpr std::uint32_t kLoad = BPF_LD | BPF_W | BPF_ABS, kReturn = BPF_RET | BPF_K;
    constexpr std::uint32_t kIfEqual = BPF_JMP | BPF_JEQ | BPF_K;
    std::vector<sock_filter> filter;
    const auto add = [&](std::uint32_t code, std::size_t value, unsigned if_so = 0,
                         unsigned if_not = 0) {
        filter.push_back({static_cast<std::uint16_t>(code), static_cast<std::uint8_t>(if_so),
                          static_cast<std::uint8_t>(if_not), static_cast<std::uint32_t>(value)});
    };
    add(kLoad, offsetof(seccomp_data, arch));
    add(kIfEqual, PEELER_AUDIT_ARCHITECTURE, 1, 0);
    add(kReturn, SECCOMP_RET_KILL_PROCESS);
    // x32 calls have their own numbers, which are not in the table.
    add(kLoad, offsetof(seccomp_data, nr));
    for (const Allowed& row : allowed) {
        if (row.mask == 0) {
            add(kIfEqual, row.call, 0, 1);
            add(kReturn, SECCOMP_RET_ALLOW);
            continue;
        }
        add(kIfEqual, row.call, 0, 5);
        add(kLoad, offsetof(seccomp_data, args) + row.argument * sizeof(std::uint64_t));
        add(BPF_ALU | BPF_AND | BPF_K, row.mask);
        add(kIfEqual, row.value, 0, 1);
        add(kReturn, SECCOMP_RET_ALLOW);
        add(kReturn, SECCOMP_RET_KILL_PROCESS);
    }
    add(kReturn, SECCOMP_RET_KILL_PROCESS);
    return filter;
}

#endif

}  // namespace

bool limitSystemCalls() {
#if defined(PEELER_AUDIT_ARCHITECTURE) && !defined(PEELER_SHADOW_MEMORY)
    std::vector<sock_filter> filter = filterOf(allowedCalls());
    const sock_fprog program = {static_cast<unsigned short>(filter.size()), filter.data()};
    return prctl(PR_SET_SECCOMP, SECCOMP_MODE_FILTER, &program) == 0;
#else
    return false;
#endif
}

}  // namespace peeler
