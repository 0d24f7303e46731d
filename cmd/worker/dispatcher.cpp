// SPDX-License-Identifier: Apache-2.0
#include "cmd/worker/dispatcher.h"

#include <fcntl.h>
#include <poll.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <utility>

#include <peeler/error.h>
#include "cmd/cli/errors.h"
#include "formats/file/json_text.h"

namespace peeler::cmd {

namespace {

using Clock = std::chrono::steady_clock;

constexpr std::size_t kLongestLine = std::size_t{4} << 20;
/// The maximum number of waiting jobs of all clients. At this number, the worker stops reading
/// lines.
constexpr std::size_t kMostWaiting = 10'000;
/// The maximum number of unsent bytes per client. Above this number, the worker neither reads the
/// client's lines nor sends progress.
constexpr std::size_t kMostUnsent = std::size_t{8} << 20;
/// The time limit for answering a cancelled job, even if its process is still freeing memory.
constexpr std::chrono::milliseconds kAnswered{75};

[[noreturn]] void fail(const std::string& what, const std::filesystem::path& path) {
    throw Error(ErrorKind::kOutput, what + ": " + std::strerror(errno), path.string(),
                "name a socket in an existing folder that you can write to");
}

sockaddr_un addressOf(const std::filesystem::path& path) {
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    if (path.native().size() >= sizeof address.sun_path)
        throw Error(ErrorKind::kUsage, "the socket's name is longer than 106 bytes", path.string(),
                    "choose a shorter one");
    std::memcpy(address.sun_path, path.c_str(), path.native().size());
    return address;
}

/// Whether a worker is listening on this address.
bool isAnswered(const sockaddr_un& address) {
    const int probe = socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
    const bool answered =
        connect(probe, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0;
    close(probe);
    return answered;
}

bool isOwnUser(int client) {
    ucred peer{};
    socklen_t size = sizeof peer;
    return getsockopt(client, SOL_SOCKET, SO_PEERCRED, &peer, &size) == 0 && peer.uid == geteuid();
}

std::string failedLine(const nlohmann::json& id, const Error& error) {
    WorkerResult result;
    result.exit_code = static_cast<int>(error.kind());
    result.error = error;
    return resultLine(id, result);
}

std::string cancelledLine(const nlohmann::json& id) {
    WorkerResult result;
    result.exit_code = kCancelledCode;
    result.error = Error(ErrorKind::kInternal, "the job was cancelled");
    result.error_kind = "cancelled";
    return resultLine(id, result);
}

}  // namespace

Dispatcher::Dispatcher(const DispatcherOptions& options)
    : options_(options), slots_(static_cast<std::size_t>(options.jobs)) {
    if (options_.socket) {
        listen();
        return;
    }
    Client& client = clients_.emplace_back();
    client.in = STDIN_FILENO;
    client.out = STDOUT_FILENO;
    sendTo(client, helloLine(options_.jobs));
}

Dispatcher::~Dispatcher() {
    slots_.clear();
    if (listening_ < 0) return;
    close(listening_);
    unlink(options_.socket->c_str());
}

void Dispatcher::listen() {
    const std::filesystem::path& path = *options_.socket;
    struct stat there {};
    if (lstat(path.c_str(), &there) == 0) {
        if (!S_ISSOCK(there.st_mode))
            throw Error(ErrorKind::kOutput, "a file of this name exists and is not a socket",
                        path.string(), "choose another name");
        if (isAnswered(addressOf(path)))
            throw Error(ErrorKind::kOutput, "another worker is listening on this socket",
                        path.string(), "connect to it, or choose another name");
    }
    // The socket gets its final name after it listens: a client may connect as soon as the name
    // exists.
    const std::filesystem::path unnamed = path.string() + "~";
    const sockaddr_un address = addressOf(unnamed);
    unlink(unnamed.c_str());
    listening_ = socket(AF_UNIX, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
    const mode_t mask = umask(0177);  // creates the socket without access for other users
    const int bound = bind(listening_, reinterpret_cast<const sockaddr*>(&address), sizeof address);
    umask(mask);
    if (bound != 0 || ::listen(listening_, 64) != 0 ||
        std::rename(unnamed.c_str(), path.c_str()) != 0) {
        const int error = errno;
        unlink(unnamed.c_str());
        errno = error;
        fail("cannot make the socket", path);
    }
}

void Dispatcher::accept() {
    const int file = accept4(listening_, nullptr, nullptr, SOCK_NONBLOCK | SOCK_CLOEXEC);
    if (file < 0) return;
    if (!isOwnUser(file)) {
        close(file);
        return;
    }
    Client& client = clients_.emplace_back();
    client.in = client.out = file;
    sendTo(client, helloLine(options_.jobs));
}

int Dispatcher::run() {
    while (!isDone()) {
        if (const int signal = wait(); signal != 0) return 128 + signal;
        startJobs();
        dropGoneClients();
    }
    return 0;
}

bool Dispatcher::isDone() const {
    return listening_ < 0 && clients_.empty();
}

/// Waits for events and handles them. Returns the signal that ends the worker, or 0.
int Dispatcher::wait() {
    std::vector<pollfd> files{{signals_.file(), POLLIN, 0}, {listening_, POLLIN, 0}};
    for (const Slot& slot : slots_)
        files.push_back({slot.process ? slot.process->file() : -1, POLLIN, 0});
    for (const Client& client : clients_) {
        const bool listens =
            client.reads && waiting_.size() < kMostWaiting && client.unsent.size() < kMostUnsent;
        files.push_back({listens ? client.in : -1, POLLIN, 0});
        // Even if no events are requested, poll() reports that the reader has closed.
        const short wanted = client.unsent.empty() ? 0 : POLLOUT;
        files.push_back({client.out, wanted, 0});
    }
    for (const auto& process : ending_)
        files.push_back({process->file(), POLLIN, 0});
    poll(files.data(), files.size(), untilDeadline());
    while (const int signal = signals_.take())
        if (signal != SIGCHLD) return signal;
    std::size_t next = 2;
    for (Slot& slot : slots_)
        if (files[next++].revents != 0 && slot.process) readProcess(slot);
    for (Client& client : clients_) {
        const short in = files[next++].revents, out = files[next++].revents;
        if ((out & (POLLERR | POLLNVAL)) != 0) client.gone = true;
        if ((out & POLLOUT) != 0) flush(client);
        if (in != 0 && !client.gone) receive(client);
    }
    std::erase_if(ending_, [&](const auto& process) {
        std::vector<std::string> progress;
        std::string ended;
        return files[next++].revents != 0 && !process->read(progress, ended);
    });
    if (files[1].revents != 0) accept();
    answerLateJobs();
    return 0;
}

/// Returns the milliseconds until a cancelled job must be answered, or −1 without such a job.
int Dispatcher::untilDeadline() const {
    int least = -1;
    for (const Slot& slot : slots_) {
        if (!slot.cancelled) continue;
        const auto left = std::chrono::ceil<std::chrono::milliseconds>(slot.cancelled_at +
                                                                       kAnswered - Clock::now());
        const int wait = std::max(0, static_cast<int>(left.count()));
        least = least < 0 ? wait : std::min(least, wait);
    }
    return least;
}

void Dispatcher::receive(Client& client) {
    std::array<char, 65536> bytes;
    const ssize_t count = ::read(client.in, bytes.data(), bytes.size());
    if (count < 0 && (errno == EINTR || errno == EAGAIN)) return;
    if (count <= 0) {
        client.reads = false;
        if (!client.received.empty() && !client.skips_line) take(client, client.received);
        client.received.clear();
        // If a socket's input ends, the client is gone. If stdin ends, stdout may still be read.
        if (client.in == client.out) client.gone = true;
        return;
    }
    client.received.append(bytes.data(), static_cast<std::size_t>(count));
    for (std::size_t end; (end = client.received.find('\n')) != std::string::npos;) {
        const std::string line = client.received.substr(0, end);
        client.received.erase(0, end + 1);
        if (!std::exchange(client.skips_line, false)) take(client, line);
    }
    if (client.received.size() <= kLongestLine) return;
    if (!client.skips_line)
        sendTo(client, failedLine(nullptr, Error(ErrorKind::kUsage, "a line is longer than 4 MiB",
                                                 "", "see peeler worker --help")));
    client.skips_line = true;
    client.received.clear();
}

void Dispatcher::take(Client& client, const std::string& line) {
    if (line.find_first_not_of(" \t\r") == std::string::npos) return;
    try {
        const WorkerRequest request(line);
        if (request.cancels) return cancel(client, request.id);
        const auto same = [&](const Waiting& job) {
            return job.client == &client && job.id == request.id;
        };
        const bool known = std::ranges::any_of(waiting_, same) ||
                           std::ranges::any_of(slots_, [&](const Slot& slot) {
                               return slot.job && same(*slot.job);
                           });
        if (known) {
            // The line has no id. With the id, the client would take the line for the result of the
            // unfinished job.
            sendTo(client, failedLine(nullptr, Error(ErrorKind::kUsage,
                                                     "a job with this id has not finished yet",
                                                     dumpJson(request.id), "choose another id")));
            return;
        }
        waiting_.push_back({&client, line + '\n', request.id,
                            request.arguments.empty() ? "" : request.arguments.front()});
        ++client.jobs;
    } catch (...) {
        sendTo(client, failedLine(requestId(line), currentError()));
    }
}

void Dispatcher::cancel(Client& client, const nlohmann::json& id) {
    const auto waits = std::ranges::find_if(
        waiting_, [&](const Waiting& job) { return job.client == &client && job.id == id; });
    if (waits != waiting_.end()) {
        sendTo(client, cancelledLine(id));
        waiting_.erase(waits);
        --client.jobs;
        return;
    }
    for (Slot& slot : slots_) {
        if (!slot.job || slot.job->client != &client || slot.job->id != id) continue;
        slot.cancelled = true;
        slot.cancelled_at = Clock::now();
        slot.process->cancel();
    }
    // A finished job needs no answer: its result has already been sent.
}

void Dispatcher::startJobs() {
    while (!waiting_.empty()) {
        const auto job = waiting_.begin();
        Slot* chosen = nullptr;
        for (Slot& slot : slots_) {
            if (slot.job) continue;
            if (!chosen || (slot.scene == job->scene && chosen->scene != job->scene))
                chosen = &slot;
        }
        if (!chosen) return;
        if (!chosen->process) {
            try {
                chosen->process = std::make_unique<JobProcess>(options_.process);
            } catch (const Error& error) {
                sendTo(*job->client, failedLine(job->id, error));
                --job->client->jobs;
                waiting_.erase(job);
                continue;
            }
        }
        chosen->job = std::move(*job);
        waiting_.erase(job);
        chosen->cancelled = false;
        chosen->start = Clock::now();
        chosen->scene = chosen->job->scene;
        chosen->process->start(chosen->job->line);
    }
}

void Dispatcher::readProcess(Slot& slot) {
    std::vector<std::string> progress;
    std::string ended;
    const bool alive = slot.process->read(progress, ended);
    if (slot.job) {
        for (const std::string& line : progress)
            if (slot.job->client->unsent.size() < kMostUnsent) sendTo(*slot.job->client, line);
        if (!ended.empty()) endJob(slot, ended);
    }
    if (alive) return;
    if (slot.job) endJob(slot, brokenLine(slot));
    slot.process.reset();
    slot.scene.clear();
}

/// Returns the result line for a job whose process ended before the job did.
std::string Dispatcher::brokenLine(const Slot& slot) const {
    if (slot.cancelled) return cancelledLine(slot.job->id);
    WorkerResult result;
    result.milliseconds =
        std::chrono::duration<double, std::milli>(Clock::now() - slot.start).count();
    result.exit_code = slot.process->exitCode();
    if (result.exit_code == static_cast<int>(ErrorKind::kMemory)) {
        result.error = Error(ErrorKind::kMemory, "out of memory", "",
                             "give the job more memory, or run fewer at a time");
        return resultLine(slot.job->id, result);
    }
    const int signal = slot.process->endingSignal();
    std::string what = "the job's process ended ";
    what += signal == 0 ? "with exit code " + std::to_string(result.exit_code)
                        : "by signal " + std::to_string(signal) + " (" + strsignal(signal) + ")";
    result.error = Error(ErrorKind::kInternal, what, "",
                         signal == SIGKILL ? "the system may have run out of memory"
                                           : "a driver may be at fault; other jobs continue");
    result.error_kind = "crash";
    return resultLine(slot.job->id, result);
}

void Dispatcher::endJob(Slot& slot, const std::string& line) {
    Client& client = *slot.job->client;
    --client.jobs;
    slot.job.reset();
    slot.cancelled = false;
    sendTo(client, line);
}

void Dispatcher::answerLateJobs() {
    for (Slot& slot : slots_) {
        if (!slot.cancelled || Clock::now() - slot.cancelled_at < kAnswered) continue;
        const std::string line = cancelledLine(slot.job->id);
        giveUp(slot);
        endJob(slot, line);
    }
}

/// Terminates the slot's process. Does not wait for its end.
void Dispatcher::giveUp(Slot& slot) {
    slot.process->terminate();
    ending_.push_back(std::move(slot.process));
    slot.scene.clear();
}

void Dispatcher::sendTo(Client& client, std::string_view text) {
    if (client.gone) return;
    client.unsent += text;
    flush(client);
}

void Dispatcher::flush(Client& client) {
    while (!client.unsent.empty()) {
        // Writes at most PIPE_BUF bytes at a time. If stdout is a pipe, a larger write could block
        // although poll() reports room.
        pollfd room{client.out, POLLOUT, 0};
        if (poll(&room, 1, 0) <= 0 || (room.revents & POLLOUT) == 0) {
            client.gone = client.gone || (room.revents & (POLLERR | POLLNVAL)) != 0;
            return;
        }
        const std::size_t size = std::min<std::size_t>(client.unsent.size(), PIPE_BUF);
        const ssize_t count = ::write(client.out, client.unsent.data(), size);
        if (count < 0 && errno == EINTR) continue;
        if (count < 0) {
            client.gone = errno != EAGAIN;
            return;
        }
        client.unsent.erase(0, static_cast<std::size_t>(count));
    }
}

/// Drops all jobs of a client.
void Dispatcher::leave(Client& client) {
    std::erase_if(waiting_, [&](const Waiting& job) { return job.client == &client; });
    for (Slot& slot : slots_) {
        if (!slot.job || slot.job->client != &client) continue;
        giveUp(slot);
        slot.job.reset();
        slot.cancelled = false;
    }
    client.jobs = 0;
}

void Dispatcher::dropGoneClients() {
    for (auto client = clients_.begin(); client != clients_.end();) {
        const bool finished = !client->reads && client->jobs == 0 && client->unsent.empty();
        if (!client->gone && !finished) {
            ++client;
            continue;
        }
        leave(*client);
        if (client->in == client->out) close(client->in);
        client = clients_.erase(client);
    }
}

}  // namespace peeler::cmd
