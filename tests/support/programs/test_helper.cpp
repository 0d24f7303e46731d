// SPDX-License-Identifier: Apache-2.0
// A helper program. Its requests have an array of characters, an array of bytes, and a number.
#include <fcntl.h>
#include <sys/mman.h>
#include <sys/ptrace.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <cstdint>
#include <cstdlib>
#include <stdexcept>
#include <string>
#include <vector>

#include <peeler/error.h>
#include "formats/modules/helper_main.h"

namespace peeler {
namespace {

/// Reports the inherited state: number of open descriptors, whether more can be opened, the
/// environment, and signals.
void tellWhatIsInherited(SharedFile& result) {
    std::uint64_t open = 0;
    for (int file = 0; file < 1024; ++file)
        if (fcntl(file, F_GETFD) >= 0) ++open;
    sigset_t blocked;
    sigprocmask(SIG_BLOCK, nullptr, &blocked);
    result.putOne(open);
    for (const bool is_so :
         {dup(STDIN_FILENO) >= 0, std::getenv("PATH") != nullptr,
          sigismember(&blocked, SIGTERM) != 0, std::signal(SIGPIPE, SIG_DFL) == SIG_IGN})
        result.putOne(std::uint64_t{is_so ? 1U : 0U});
}

/// Does something that decoders must not do, chosen by number. Returns only if the sandbox permits
/// this or makes the call fail.
void transgress(std::uint64_t number) {
    int pair[2] = {};
    struct rlimit limits {};
    switch (number) {
        case 0:
            open("/etc/passwd", O_RDONLY);
            return;
        case 1:
            socket(AF_INET, SOCK_STREAM, 0);
            return;
        case 2:
            fork();
            return;
        case 3:
            execl("/bin/true", "true", nullptr);
            return;
        case 4:
            kill(getppid(), 0);
            return;
        case 5:
            ptrace(PTRACE_TRACEME, 0, nullptr, nullptr);
            return;
        case 6:
            mmap(nullptr, 4096, PROT_READ | PROT_EXEC, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
            return;
        case 7:
            prlimit(getppid(), RLIMIT_CPU, nullptr, &limits);
            return;
        case 8:
            if (pipe(pair) != 0) return;
            return;
        case 9:
            unlink("/nowhere/file");
            return;
        default:
            _exit(0);  // no such case
    }
}

void obey(SharedFile& request, SharedFile& result) {
    const auto word = request.take<char>();
    const auto bytes = request.take<std::uint8_t>();
    const auto number = request.takeOne<std::uint64_t>();
    const std::string wish(word.begin(), word.end());
    if (wish == "echo") return result.put(bytes);
    if (wish == "abort") std::abort();
    if (wish == "exit") _exit(static_cast<int>(number));
    if (wish == "error") throw Error(ErrorKind::kMemory, "what", "where", "hint");
    if (wish == "throw") throw std::runtime_error("what");
    if (wish == "half an answer") {
        result.put(bytes);
        throw Error(ErrorKind::kInput, "and no more");
    }
    if (wish == "loop") {
        for (volatile int i = 0; i == 0;) {
        }
    }
    if (wish.ends_with("memory")) {
        if (wish == "memory") limitMemory(std::uint64_t{64} << 20);
        std::vector<std::uint8_t> taken(number);
        std::fill(taken.begin(), taken.end(), std::uint8_t{1});
        return result.putOne(static_cast<std::uint64_t>(std::count(taken.begin(), taken.end(), 1)));
    }
    if (wish == "transgression") {
        transgress(number);
        return result.putOne(std::uint64_t{1});
    }
    if (wish == "inheritance") return tellWhatIsInherited(result);
    throw std::runtime_error("no such wish");
}

}  // namespace
}  // namespace peeler

int main(int count, char** arguments) {
    peeler::helperMain(count, arguments, peeler::obey);
}
