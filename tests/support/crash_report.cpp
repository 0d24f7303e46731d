// SPDX-License-Identifier: Apache-2.0
// Crash reports of test programs. Some crashes, especially in drivers' threads, occur once in
// thousands of runs, on a machine that cannot be inspected afterwards.
#include <execinfo.h>
#include <fcntl.h>
#include <ucontext.h>
#include <unistd.h>

#include <array>
#include <csignal>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>

namespace peeler::test {
namespace {

// AddressSanitizer and ThreadSanitizer report crashes themselves.
#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)

void say(const char* text) {
    [[maybe_unused]] const ssize_t written = write(STDERR_FILENO, text, std::strlen(text));
}

std::uintptr_t instruction(const void* context) {
    const mcontext_t& machine = static_cast<const ucontext_t*>(context)->uc_mcontext;
#if defined(__x86_64__)
    return static_cast<std::uintptr_t>(machine.gregs[REG_RIP]);
#elif defined(__aarch64__)
    return static_cast<std::uintptr_t>(machine.pc);
#else
    return 0;
#endif
}

/// Prints the memory mappings that contain these addresses. The mappings identify the crashed
/// library even if a driver compiled the code, so that it has no name and no unwind information.
void sayMaps(const std::array<std::uintptr_t, 2>& addresses) {
    static std::array<char, 1 << 18> maps;  // static, because the heap may be corrupt
    std::size_t size = 0;
    const int file = open("/proc/self/maps", O_RDONLY | O_CLOEXEC);
    for (ssize_t got; (got = read(file, maps.data() + size, maps.size() - 1 - size)) > 0;)
        size += static_cast<std::size_t>(got);
    close(file);
    maps[size] = '\0';
    for (char *line = maps.data(), *end; (end = std::strchr(line, '\n')); line = end + 1) {
        *end = '\0';
        char* rest = line;
        const std::uintptr_t first = std::strtoull(line, &rest, 16);
        const std::uintptr_t last = std::strtoull(rest + 1, nullptr, 16);
        for (const std::uintptr_t address : addresses) {
            if (address < first || address >= last) continue;
            say(line);
            say("\n");
        }
    }
}

void report(int number, siginfo_t* info, void* context) {
    std::array<char, 160> line;
    std::snprintf(line.data(), line.size(), "\nsignal %d, code %d: address %p, instruction %#zx\n",
                  number, info->si_code, info->si_addr, instruction(context));
    say(line.data());
    sayMaps({instruction(context), reinterpret_cast<std::uintptr_t>(info->si_addr)});
    std::array<void*, 64> frames;
    backtrace_symbols_fd(frames.data(), backtrace(frames.data(), static_cast<int>(frames.size())),
                         STDERR_FILENO);
    raise(number);  // ends the process, because SA_RESETHAND has removed the handler
}

const bool kReports = [] {
    // The first call allocates memory, to load the unwinder. A handler may not allocate.
    std::array<void*, 1> frame;
    backtrace(frame.data(), 1);
    // After a stack overflow, the handler needs its own stack.
    static std::array<char, 1 << 16> stack;
    const stack_t own{.ss_sp = stack.data(), .ss_flags = 0, .ss_size = stack.size()};
    sigaltstack(&own, nullptr);
    struct sigaction action {};
    action.sa_sigaction = report;
    action.sa_flags = static_cast<int>(SA_SIGINFO | SA_RESETHAND | SA_ONSTACK);
    for (const int signal : {SIGSEGV, SIGBUS, SIGILL, SIGFPE, SIGABRT})
        sigaction(signal, &action, nullptr);
    return true;
}();

#endif

}  // namespace
}  // namespace peeler::test
