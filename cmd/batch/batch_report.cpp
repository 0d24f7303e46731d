// SPDX-License-Identifier: Apache-2.0
#include "cmd/batch/batch_report.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cmath>
#include <cstring>
#include <iterator>
#include <nlohmann/json.hpp>
#include <set>
#include <span>
#include <sstream>
#include <utility>

#include <peeler/error.h>
#include "cmd/cli/report.h"
#include "formats/file/atomic_file.h"
#include "formats/file/json_text.h"
#include "formats/file/regular_file.h"

namespace peeler::cmd {

namespace {

namespace fs = std::filesystem;

[[noreturn]] void failOutput(const std::string& what, const fs::path& path) {
    throw Error(ErrorKind::kOutput, what + ": " + std::strerror(errno), path.string());
}

bool isResult(const Json& line) {
    if (!line.is_object()) return false;
    const auto hash = line.find("hash"), code = line.find("exitCode");
    return hash != line.end() && hash->is_string() && code != line.end() &&
           code->is_number_integer();
}

/// Returns the lines in a job's stderr that begin with "peeler: WORD: ", without that prefix.
std::vector<std::string> messagesOf(const std::string& err, const std::string& word) {
    std::vector<std::string> lines;
    std::istringstream stream(err);
    const std::string start = "peeler: " + word + ": ";
    for (std::string line; std::getline(stream, line);)
        if (line.starts_with(start)) lines.push_back(line.substr(start.size()));
    return lines;
}

std::string joined(const std::vector<std::string>& lines) {
    std::string text;
    for (const std::string& line : lines)
        text += (text.empty() ? "" : "\n") + line;
    return text;
}

Json errorOf(const ChildProcess& process) {
    Json error;
    error["what"] = joined(messagesOf(process.err(), "error"));
    if (const int number = process.endingSignal())
        error["what"] =
            "ended by signal " + std::to_string(number) + " (" + strsignal(number) + ")";
    else if (error["what"] == "")
        error["what"] = process.err();
    const std::string hint = joined(messagesOf(process.err(), "hint"));
    if (!hint.empty()) error["hint"] = hint;
    return error;
}

}  // namespace

Json resultLine(std::size_t number, const Job& job, const ChildProcess& process) {
    Json line;
    line["job"] = number;
    if (!job.id.empty()) line["id"] = job.id;
    line["verb"] = job.verb;
    line["hash"] = job.hash;
    line["exitCode"] = process.exitCode();
    line["milliseconds"] = std::llround(process.milliseconds());
    const auto warnings = messagesOf(process.err(), "warning");
    if (!warnings.empty()) line["warnings"] = warnings;
    Json result = parseOrderedJsonOrNull(process.out());
    if (!result.is_null()) line["result"] = std::move(result);
    if (process.exitCode() != 0) line["error"] = errorOf(process);
    return line;
}

std::string lineText(const Json& line) {
    return dumpJson(line) + '\n';
}

std::vector<Json> readBatchReport(const fs::path& path, std::size_t* whole) {
    if (!fileExists(path, ErrorKind::kOutput)) return {};
    const std::string text = readRegularText(path);
    std::vector<Json> lines;
    std::size_t at = 0;
    // Stops before a partial last line, which a killed batch may have left.
    for (std::size_t end; (end = text.find('\n', at)) != std::string::npos; at = end + 1) {
        Json line = parseOrderedJsonOrNull(std::string_view(text).substr(at, end - at));
        if (!isResult(line)) {
            throw Error(
                ErrorKind::kUsage,
                "line " + std::to_string(lines.size() + 1) + " of this file is not a batch result",
                "--report " + path.string(), "choose another name for the report");
        }
        lines.push_back(std::move(line));
    }
    // A partial line is accepted only if it begins like a result.
    if (at < text.size() && lines.empty() && !text.starts_with("{\"job\":")) {
        throw Error(ErrorKind::kUsage, "this file contains no batch results",
                    "--report " + path.string(), "choose another name for the report");
    }
    if (whole) *whole = at;
    return lines;
}

BatchReport::BatchReport(fs::path path) : path_(std::move(path)) {
    try {
        open();
        readLines();
    } catch (...) {
        if (file_ >= 0) close(file_);
        throw;
    }
}

BatchReport::~BatchReport() {
    if (file_ >= 0) close(file_);
}

void BatchReport::open() {
    struct stat locked {
    }, named{};
    do {
        if (file_ >= 0) close(file_);
        file_ = openFile(path_.c_str(), O_RDWR | O_CREAT | O_APPEND | O_CLOEXEC | O_NONBLOCK, 0666);
        if (file_ < 0) failOutput("cannot open the report", path_);
        if (flock(file_, LOCK_EX | LOCK_NB) != 0 && errno == EWOULDBLOCK) {
            throw Error(ErrorKind::kOutput, "another batch is writing this report", path_.string(),
                        "wait for it, or choose another name");
        }
        // Opens the file again if another batch has just replaced it.
    } while (fstat(file_, &locked) == 0 && stat(path_.c_str(), &named) == 0 &&
             locked.st_ino != named.st_ino);
}

void BatchReport::readLines() {
    std::size_t whole = 0;
    lines_ = readBatchReport(path_, &whole);
    if (ftruncate(file_, static_cast<off_t>(whole)) != 0)
        failOutput("cannot write the report", path_);
}

void BatchReport::add(const Json& line) {
    const std::string text = lineText(line);
    // A single call usually writes the whole line, so that a kill leaves at most a partial line.
    for (std::size_t done = 0; done < text.size();) {
        const ssize_t count = write(file_, text.data() + done, text.size() - done);
        if (count < 0 && errno == EINTR) continue;
        if (count < 0) failOutput("cannot write the report", path_);
        done += static_cast<std::size_t>(count);
    }
}

void BatchReport::finish(const std::vector<Json>& lines) {
    std::set<std::string> ours;
    for (const Json& line : lines)
        ours.insert(line["hash"]);
    std::string text;
    for (const Json& line : lines_)
        if (!ours.contains(line["hash"])) text += lineText(line);
    for (const Json& line : lines)
        text += lineText(line);
    AtomicFile file(path_.string());
    file.append(std::as_bytes(std::span(text)));
    file.commit();
}

}  // namespace peeler::cmd
