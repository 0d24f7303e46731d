// SPDX-License-Identifier: Apache-2.0
#include "cmd/cli/errors.h"

#include <csignal>
#include <exception>
#include <new>
#include <string>

#include <peeler/error.h>
#include <peeler/work.h>
#include "cmd/cli/console.h"
#include "cmd/cli/option_names.h"

namespace peeler::cmd {

namespace {

/// The hint for errors of a kind, if an error has no hint of its own.
struct DefaultHint {
    ErrorKind kind;
    const char* hint;
};
constexpr DefaultHint kDefaultHints[] = {
    {ErrorKind::kInternal,
     "this is a bug in peeler; please report it with the command that shows it"},
    {ErrorKind::kUsage, "see peeler --help"},
    {ErrorKind::kInput,
     "the file may be damaged or in an unsupported variant; copy or export it again"},
    {ErrorKind::kOutput, "check the folder and the free space on its disk"},
    {ErrorKind::kDevice, "run peeler devices to see which devices work, and why the others do not"},
    {ErrorKind::kIncomplete, "leave --strict out to keep the incomplete result"},
    {ErrorKind::kMemory, "free some memory, or make the input or the output smaller"},
};

Text hintOf(const Error& error) {
    if (!error.hint().empty()) return error.hintText();
    for (const DefaultHint& row : kDefaultHints) {
        if (row.kind == error.kind()) return row.hint;
    }
    return {};
}

constexpr ExitCode kExitCodes[] = {
    {"0", "done"},
    {"1", "internal error (compare: beyond a threshold)"},
    {"2", "usage"},
    {"3", "input unreadable or invalid"},
    {"4", "output not written"},
    {"5", "no usable GL device, or it was lost"},
    {"6", "incomplete under --strict"},
    {"33", "out of memory or over --memory"},
    {"128 + n", "ended by signal n"},
};

}  // namespace

std::string_view kindName(ErrorKind kind) {
    constexpr std::pair<ErrorKind, std::string_view> kNames[] = {
        {ErrorKind::kInternal, "internal"}, {ErrorKind::kUsage, "usage"},
        {ErrorKind::kInput, "input"},       {ErrorKind::kOutput, "output"},
        {ErrorKind::kDevice, "device"},     {ErrorKind::kIncomplete, "incomplete"},
        {ErrorKind::kMemory, "memory"},
    };
    for (const auto& [of, name] : kNames)
        if (of == kind) return name;
    return "internal";
}

std::span<const ExitCode> exitCodes() {
    return kExitCodes;
}

void refuse(const Text& what, const Text& where, const Text& hint) {
    throw Error(ErrorKind::kUsage, what, where, hint);
}

int reportError(Reporter& reporter, const Error& error) {
    reporter.failure({error.kind(), error.whatText(), error.whereText(), hintOf(error)});
    return static_cast<int>(error.kind());
}

Error currentError() {
    try {
        throw;
    } catch (const Error& error) {
        return inOptions(error);
    } catch (const ReaderGone&) {
        throw;
    } catch (const Cancelled&) {
        throw;
    } catch (const std::bad_alloc&) {
        return Error(ErrorKind::kMemory, "out of memory");
    } catch (const std::exception& error) {
        return Error(ErrorKind::kInternal, error.what());
    } catch (...) {
        return Error(ErrorKind::kInternal, "unknown exception");
    }
}

int runReported(Reporter& reporter, const std::function<int()>& work) {
    try {
        return work();
    } catch (const ReaderGone&) {
        return 128 + SIGPIPE;
    } catch (...) {
        return reportError(reporter, currentError());
    }
}

}  // namespace peeler::cmd
