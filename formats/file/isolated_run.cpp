// SPDX-License-Identifier: Apache-2.0
// Forks, limits the child, and carries its result or its error through a pipe.
#include "formats/file/isolated_run.h"

#include <fcntl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <mutex>
#include <new>
#include <string>

#include "core/base/error.h"

namespace peeler {
namespace {

// AddressSanitizer reserves terabytes of address space, so that no limit of it would be right.
#ifdef __SANITIZE_ADDRESS__
constexpr bool kLimitsMemory = false;
#else
constexpr bool kLimitsMemory = true;
#endif

/// The bytes of address space that this process has; 0 if the system does not say.
std::uint64_t addressSpace() {
    unsigned long long pages = 0;
    if (std::FILE* file = std::fopen("/proc/self/statm", "re")) {
        if (std::fscanf(file, "%llu", &pages) != 1) pages = 0;
        std::fclose(file);
    }
    return pages * static_cast<std::uint64_t>(sysconf(_SC_PAGESIZE));
}

/// The end of a pipe, closed with the object.
class PipeEnd {
  public:
    explicit PipeEnd(int fd) : fd_(fd) {}
    ~PipeEnd() { close(); }
    PipeEnd(const PipeEnd&) = delete;
    PipeEnd& operator=(const PipeEnd&) = delete;
    int get() const { return fd_; }
    void close() {
        if (fd_ >= 0) ::close(fd_);
        fd_ = -1;
    }

  private:
    int fd_;
};

void limit(int resource, std::uint64_t value) {
    const struct rlimit both = {value, value};
    setrlimit(resource, &both);
}

bool writeAll(int fd, const std::uint8_t* bytes, std::size_t size) {
    while (size > 0) {
        const ssize_t done = ::write(fd, bytes, size);
        if (done < 0 && errno == EINTR) continue;
        if (done <= 0) return false;
        bytes += done;
        size -= static_cast<std::size_t>(done);
    }
    return true;
}

/// The child's answer: the bytes and a 0, or an error's two texts, each ended by a zero, and its
/// kind (never 0).
std::vector<std::uint8_t> answerOf(const std::function<std::vector<std::uint8_t>()>& work) {
    const auto failed = [](ErrorKind kind, const std::string& what, const std::string& hint) {
        std::vector<std::uint8_t> answer;
        for (const std::string& text : {what, hint}) {
            for (const char c : text)
                answer.push_back(static_cast<std::uint8_t>(c));
            answer.push_back(0);
        }
        answer.push_back(static_cast<std::uint8_t>(kind));
        return answer;
    };
    try {
        std::vector<std::uint8_t> answer = work();
        answer.push_back(0);
        return answer;
    } catch (const Error& error) {
        return failed(error.kind(), error.what(), error.hint());
    } catch (const std::bad_alloc&) {
        return failed(ErrorKind::kInput, "decoding takes more memory than the data can be worth",
                      "");
    } catch (const std::exception& error) {
        return failed(ErrorKind::kInput, error.what(), "");
    }
}

[[noreturn]] void runChild(const std::function<std::vector<std::uint8_t>()>& work,
                           const IsolationLimits& limits, int out) {
    // The handlers that the child has inherited would remove the parent's files.
    for (const int number : {SIGINT, SIGTERM, SIGHUP, SIGPIPE})
        std::signal(number, SIG_DFL);
    limit(RLIMIT_CORE, 0);
    limit(RLIMIT_CPU, static_cast<std::uint64_t>(limits.cpu_seconds));
    if (const std::uint64_t now = addressSpace(); kLimitsMemory && now > 0)
        limit(RLIMIT_AS, now + limits.memory_bytes);
    bool written = false;
    try {
        const std::vector<std::uint8_t> answer = answerOf(work);
        written = writeAll(out, answer.data(), answer.size());
    } catch (const std::exception&) {
        // There is no memory left even to say so.
    }
    _exit(written ? 0 : 1);
}

std::vector<std::uint8_t> readAll(int fd) {
    std::vector<std::uint8_t> bytes;
    std::size_t size = 0;
    for (;;) {
        if (bytes.size() - size < 65536) bytes.resize(std::max<std::size_t>(2 * size, 131072));
        const ssize_t got = ::read(fd, bytes.data() + size, bytes.size() - size);
        if (got < 0 && errno == EINTR) continue;
        if (got <= 0) break;
        size += static_cast<std::size_t>(got);
    }
    bytes.resize(size);
    return bytes;
}

}  // namespace

std::vector<std::uint8_t> runIsolated(const std::function<std::vector<std::uint8_t>()>& work,
                                      const IsolationLimits& limits, const char* hint) {
    // A child that another thread starts meanwhile would keep the writing end of this pipe open,
    // and the reader would wait for that child, too.
    static std::mutex starting;
    std::unique_lock lock(starting);
    int ends[2];
    if (pipe2(ends, O_CLOEXEC) != 0)
        throw Error(ErrorKind::kInternal, "no pipe: " + std::string(std::strerror(errno)));
    PipeEnd in(ends[0]), out(ends[1]);
    // Answers are of megabytes; what a pipe holds by default is a fraction of one. May be refused.
    fcntl(out.get(), F_SETPIPE_SZ, 1 << 20);
    const pid_t child = fork();
    if (child < 0)
        throw Error(ErrorKind::kInternal,
                    "no process can be started: " + std::string(std::strerror(errno)));
    if (child == 0) runChild(work, limits, out.get());
    out.close();
    lock.unlock();
    std::vector<std::uint8_t> answer = readAll(in.get());
    int status = 0;
    rusage used{};
    while (wait4(child, &status, 0, &used) < 0 && errno == EINTR) {
    }
    const bool late =
        used.ru_utime.tv_sec + used.ru_stime.tv_sec + 1 >= static_cast<time_t>(limits.cpu_seconds);
    if (WIFSIGNALED(status) && WTERMSIG(status) == SIGKILL && !late)
        throw Error(ErrorKind::kMemory, "the decoder was killed, as where memory runs out");
    if (WIFSIGNALED(status))
        throw Error(ErrorKind::kInput,
                    WTERMSIG(status) == SIGXCPU || WTERMSIG(status) == SIGKILL
                        ? "decoding takes longer than " + std::to_string(limits.cpu_seconds) +
                              " s: the data is damaged"
                        : "the decoder crashes on the data, which is damaged (signal " +
                              std::to_string(WTERMSIG(status)) + ")",
                    "", hint);
    if (!WIFEXITED(status) || WEXITSTATUS(status) != 0 || answer.empty())
        throw Error(ErrorKind::kInput, "the decoder ends without a result on the data", "", hint);
    const std::uint8_t kind = answer.back();
    answer.pop_back();
    if (kind == 0) return answer;
    const char* text = reinterpret_cast<const char*>(answer.data());
    const std::string what = text;
    throw Error(static_cast<ErrorKind>(kind), what, "", text + what.size() + 1);
}

}  // namespace peeler
