// SPDX-License-Identifier: Apache-2.0
// The worker's job dispatcher.
#pragma once

#include <chrono>
#include <cstddef>
#include <filesystem>
#include <list>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "cmd/machine/child_process.h"
#include "cmd/worker/job_process.h"
#include "cmd/worker/worker_job.h"

namespace peeler::cmd {

struct DispatcherOptions {
    int jobs = 1;  ///< concurrent jobs, one process each
    JobLimits process{};
    /// The socket for clients; none = a single client on stdin and stdout.
    std::optional<std::filesystem::path> socket{};
};

/// A worker that takes jobs from clients, runs them in processes and returns results. It has a
/// single thread, which waits only for clients, processes and signals.
class Dispatcher {
  public:
    /// Throws Error (kOutput) if the socket cannot be created or another worker listens on it.
    explicit Dispatcher(const DispatcherOptions& options);
    ~Dispatcher();
    Dispatcher(const Dispatcher&) = delete;
    Dispatcher& operator=(const Dispatcher&) = delete;

    /// Runs until a signal arrives. Without a socket, also ends when the client on stdin is gone
    /// and its jobs are done. Returns the exit code: 0, or 128 + n for signal n.
    int run();

  private:
    struct Client {
        int in = -1, out = -1;
        std::string received;     ///< the beginning of a line whose end has not arrived yet
        bool skips_line = false;  ///< whether to skip the rest of a line that is too long
        bool reads = true;        ///< whether more lines may arrive
        bool gone = false;        ///< whether the client no longer reads its output
        std::string unsent;
        std::size_t jobs = 0;  ///< number of the client's waiting and running jobs
    };
    struct Waiting {
        Client* client;
        std::string line;  ///< the job line, with its line feed
        nlohmann::json id;
        /// The job's first argument. A process whose last job had the same first argument may have
        /// the scene open.
        std::string scene;
    };
    struct Slot {
        std::unique_ptr<JobProcess> process{};  ///< process of the slot, started when needed
        std::optional<Waiting> job{};
        bool cancelled = false;
        std::chrono::steady_clock::time_point start{}, cancelled_at{};
        std::string scene{};  ///< the first argument of the previous job
    };

    void listen();
    void accept();
    void receive(Client& client);
    void take(Client& client, const std::string& line);
    void cancel(Client& client, const nlohmann::json& id);
    void leave(Client& client);
    void startJobs();
    void readProcess(Slot& slot);
    int untilDeadline() const;
    void answerLateJobs();
    void giveUp(Slot& slot);
    void endJob(Slot& slot, const std::string& line);
    std::string brokenLine(const Slot& slot) const;
    void sendTo(Client& client, std::string_view text);
    void flush(Client& client);
    void dropGoneClients();
    bool isDone() const;
    int wait();

    DispatcherOptions options_;
    SignalFile signals_;
    int listening_ = -1;
    std::list<Client> clients_;
    std::list<Waiting> waiting_;
    std::vector<Slot> slots_;
    /// Processes that are ending; their output is ignored.
    std::list<std::unique_ptr<JobProcess>> ending_;
};

}  // namespace peeler::cmd
