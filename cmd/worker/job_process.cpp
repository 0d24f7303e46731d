// SPDX-License-Identifier: Apache-2.0
#include "cmd/worker/job_process.h"

#include <fcntl.h>
#include <sys/prctl.h>
#include <sys/socket.h>
#include <sys/time.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <csignal>
#include <cstring>
#include <memory>
#include <utility>

#include <peeler/error.h>
#include <peeler/work.h>
#include "cmd/cli/errors.h"
#include "cmd/cli/option_names.h"
#include "cmd/cli/parsed_verb.h"
#include "cmd/options/output_checks.h"
#include "cmd/session/session.h"
#include "cmd/worker/worker_job.h"
#include "formats/file/temporary_files.h"

namespace peeler::cmd {

namespace {

using Clock = std::chrono::steady_clock;

/// The first character of each line from a process: the line's type.
constexpr char kProgress = 'p', kEnd = 'e';

/// The minimum interval between progress lines.
constexpr std::chrono::milliseconds kBetween{100};
/// The time that a cancelled job has to stop by itself. After this time, the job's process is
/// ended.
constexpr suseconds_t kPatience = 60'000;  // microseconds

volatile std::sig_atomic_t running = 0, cancelled = 0;

extern "C" void cancelRunningJob(int) {
    if (!running) return;
    cancelled = 1;
    const itimerval patience{{0, 0}, {0, kPatience}};
    setitimer(ITIMER_REAL, &patience, nullptr);
}

extern "C" void endProcess(int) {
    removeTemporaryFiles();
    _exit(kCancelledCode);
}

void act(int number, void (*action)(int)) {
    struct sigaction wanted {};
    wanted.sa_handler = action;
    wanted.sa_flags = SA_RESTART;
    sigfillset(&wanted.sa_mask);
    sigaction(number, &wanted, nullptr);
}

void send(int file, std::string_view text) {
    while (!text.empty()) {
        const ssize_t count = ::send(file, text.data(), text.size(), MSG_NOSIGNAL);
        if (count < 0 && errno == EINTR) continue;
        if (count < 0) endProcess(0);  // the worker has ended
        text.remove_prefix(static_cast<std::size_t>(count));
    }
}

/// A reporter that collects a job's messages and sends the job's progress.
class JobReporter final : public Reporter {
  public:
    JobReporter(int file, WorkerRequest request) : file_(file), request_(std::move(request)) {}

    void failure(const Error& error) override {
        if (!found.error) found.error = error;
    }
    void result(const Json& result) override { found.result = result; }
    void text(std::string_view text) override { found.result = Json{{"text", text}}; }
    void progress(const RunProgress& progress) override {
        if (cancelled) throw Cancelled();
        const auto now = Clock::now();
        if (!request_.wants_progress || (progress.of_run < 1 && now - last_ < kBetween)) return;
        last_ = now;
        send(file_, kProgress + progressLine(request_.id, progress));
    }

    WorkerResult found;

  private:
    void message(Severity severity, const Text& text) override {
        if (severity == Severity::kWarning) found.warnings.push_back(inOptions(text));
        if (severity == Severity::kError && !found.error)
            found.error = Error(ErrorKind::kInput, inOptions(text));
    }

    int file_;
    WorkerRequest request_;
    Clock::time_point last_{};
};

/// Returns the worker's defaults (JSON results, threads, memory) and then the job's arguments,
/// which take precedence: the last value of a repeated option wins.
std::vector<std::string> completed(const WorkerRequest& request, const VerbOptions& options,
                                   const JobLimits& limits) {
    std::vector<std::string> arguments;
    if (options.knows("--json")) arguments.emplace_back("--json");
    if (limits.threads > 0 && options.knows("--threads"))
        arguments.insert(arguments.end(), {"--threads", std::to_string(limits.threads)});
    if (limits.memory > 0 && options.knows("--memory"))
        arguments.insert(arguments.end(), {"--memory", std::to_string(limits.memory)});
    arguments.insert(arguments.end(), request.arguments.begin(), request.arguments.end());
    return arguments;
}

void checkVerb(const Verb& verb) {
    if (verb.name == "batch" || verb.name == "worker")
        throw Error(ErrorKind::kUsage, "this verb runs jobs itself", std::string(verb.name),
                    "send its jobs one by one");
}

void checkOutput(const VerbOptions& options) {
    if (options.knows("--output") && options.value("--output").starts_with('-'))
        throw Error(ErrorKind::kUsage, "a worker writes its results to standard output",
                    "--output -", "name a file");
}

/// A verb whose options were declared before the next job arrived.
using DeclaredVerb = std::unique_ptr<ParsedVerb>;

DeclaredVerb declaredLike(const std::string& verb) {
    try {
        return std::make_unique<ParsedVerb>(verbNamed(verb));
    } catch (const Error&) {
        return nullptr;  // there is no such verb
    }
}

int runJob(const WorkerRequest& request, const JobLimits& limits, Session& session,
           DeclaredVerb& declared) {
    const Verb& verb = verbNamed(request.verb);
    checkVerb(verb);
    if (!declared || declared->name() != verb.name) declared = std::make_unique<ParsedVerb>(verb);
    const DeclaredVerb parsed = std::move(declared);
    parsed->parse(completed(request, parsed->options(), limits));
    checkOutput(parsed->options());
    return parsed->run(session);
}

/// Runs a job once and stores the result in `found`.
void tryJob(const WorkerRequest& request, const JobLimits& limits, Session& session,
            DeclaredVerb& declared, WorkerResult& found) {
    const auto start = Clock::now();
    try {
        found.exit_code = runJob(request, limits, session, declared);
    } catch (const Cancelled&) {
        found.exit_code = kCancelledCode;
        found.error = Error(ErrorKind::kInternal, "the job was cancelled");
        found.error_kind = "cancelled";
    } catch (...) {
        found.exit_code = reportError(session.reporter(), currentError());
    }
    found.milliseconds = std::chrono::duration<double, std::milli>(Clock::now() - start).count();
}

/// Whether the job may have left GL objects in an undefined state.
bool mayHaveBroken(const WorkerResult& found) {
    if (!found.error_kind.empty()) return true;
    return found.error && found.error->kind() != ErrorKind::kUsage &&
           found.error->kind() != ErrorKind::kInput;
}

std::string finished(int file, const WorkerRequest& request, const JobLimits& limits,
                     Session& session, DeclaredVerb& declared) {
    while (true) {
        JobReporter reporter(file, request);
        session.setReporter(reporter);
        tryJob(request, limits, session, declared, reporter.found);
        if (mayHaveBroken(reporter.found)) session.close();
        // Runs the job again without the data of earlier jobs, which may have used up the memory.
        const bool full = reporter.found.error &&
                          reporter.found.error->kind() == ErrorKind::kMemory &&
                          reporter.found.error_kind.empty();
        if (full && session.forget()) continue;
        return resultLine(request.id, reporter.found);
    }
}

}  // namespace

void JobProcess::serve(int file, const JobLimits& limits, pid_t parent) {
    prctl(PR_SET_PDEATHSIG, SIGTERM);
    if (getppid() != parent) _exit(128 + SIGTERM);  // the worker ended before prctl()
    // Closes all file descriptors of the worker except stderr.
    const int nothing = open("/dev/null", O_RDWR);
    dup2(nothing, STDIN_FILENO);
    dup2(STDERR_FILENO, STDOUT_FILENO);
    constexpr int kOwn = STDERR_FILENO + 1;
    if (file != kOwn) dup2(file, kOwn);
    closefrom(kOwn + 1);
    fcntl(kOwn, F_SETFD, FD_CLOEXEC);
    act(SIGUSR1, cancelRunningJob);
    act(SIGALRM, endProcess);
    act(SIGTERM, endProcess);
    for (const int number : {SIGINT, SIGHUP})  // the worker handles these signals
        std::signal(number, SIG_IGN);
    sigset_t none;
    sigemptyset(&none);
    sigprocmask(SIG_SETMASK, &none, nullptr);

    std::string text;
    std::array<char, 65536> bytes;
    JobReporter idle(kOwn, WorkerRequest(R"({"id":0,"verb":"info"})"));
    Session session(idle, limits.keep);
    DeclaredVerb declared;
    while (true) {
        const ssize_t count = ::read(kOwn, bytes.data(), bytes.size());
        if (count < 0 && errno == EINTR) continue;
        if (count <= 0) break;
        text.append(bytes.data(), static_cast<std::size_t>(count));
        for (std::size_t end; (end = text.find('\n')) != std::string::npos;) {
            const WorkerRequest request(text.substr(0, end));
            text.erase(0, end + 1);
            cancelled = 0;
            running = 1;
            const std::string line = finished(kOwn, request, limits, session, declared);
            running = 0;
            constexpr itimerval kNever{};
            setitimer(ITIMER_REAL, &kNever, nullptr);
            session.setReporter(idle);
            send(kOwn, kEnd + line);
            // Declares options while the client reads the result. The next job usually has the same
            // verb.
            declared = declaredLike(request.verb);
        }
    }
    removeTemporaryFiles();
    _exit(0);
}

JobProcess::JobProcess(const JobLimits& limits) {
    std::array<int, 2> ends{-1, -1};
    const auto fail = [](const std::string& what) {
        throw Error(ErrorKind::kInternal, what + ": " + std::strerror(errno), "",
                    "the system's limit of processes or open files may be reached");
    };
    if (socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends.data()) != 0)
        fail("cannot make a socket");
    const pid_t parent = getpid();
    process_ = fork();
    if (process_ == 0) serve(ends[1], limits, parent);
    ::close(ends[1]);
    file_ = ends[0];
    if (process_ < 0) {
        ::close(file_);
        fail("cannot start a process");
    }
    fcntl(file_, F_SETFL, O_NONBLOCK);
}

JobProcess::~JobProcess() {
    ::close(file_);
    if (process_ < 0) return;
    kill(process_, SIGTERM);
    for (int i = 0; i < 50; ++i) {
        if (waitpid(process_, nullptr, WNOHANG) == process_) return;
        usleep(10'000);
    }
    kill(process_, SIGKILL);
    waitpid(process_, nullptr, 0);
}

void JobProcess::start(const std::string& line) {
    // A full socket is drained quickly, because an idle process is always reading.
    std::string_view rest = line;
    while (!rest.empty()) {
        const ssize_t count = ::send(file_, rest.data(), rest.size(), MSG_NOSIGNAL);
        if (count > 0) {
            rest.remove_prefix(static_cast<std::size_t>(count));
        } else if (errno == EAGAIN) {
            usleep(100);
        } else if (errno != EINTR) {
            return;  // the process has ended; read() detects this
        }
    }
}

void JobProcess::cancel() const {
    if (process_ > 0) kill(process_, SIGUSR1);
}

void JobProcess::terminate() const {
    if (process_ > 0) kill(process_, SIGTERM);
}

bool JobProcess::read(std::vector<std::string>& progress, std::string& ended) {
    std::array<char, 65536> bytes;
    bool open = true;
    while (open) {
        const ssize_t count = ::read(file_, bytes.data(), bytes.size());
        if (count < 0 && errno == EINTR) continue;
        if (count < 0 && errno == EAGAIN) break;
        if (count <= 0) open = false;
        if (count > 0) text_.append(bytes.data(), static_cast<std::size_t>(count));
    }
    for (std::size_t end; (end = text_.find('\n')) != std::string::npos;) {
        std::string line = text_.substr(0, end + 1);
        text_.erase(0, end + 1);
        const char kind = line.front();
        line.erase(0, 1);
        if (kind == kEnd)
            ended = std::move(line);
        else
            progress.push_back(std::move(line));
    }
    if (open) return true;
    int status = 0;
    while (waitpid(process_, &status, 0) < 0 && errno == EINTR) {
    }
    process_ = -1;
    ending_signal_ = WIFSIGNALED(status) ? WTERMSIG(status) : 0;
    exit_code_ = WIFSIGNALED(status) ? 128 + ending_signal_ : WEXITSTATUS(status);
    return false;
}

}  // namespace peeler::cmd
