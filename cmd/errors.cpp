// SPDX-License-Identifier: Apache-2.0
// From exceptions to lines and exit codes.
#include "cmd/errors.h"

#include <csignal>
#include <exception>
#include <new>
#include <string>

#include "core/error.h"

namespace peeler::cmd {

namespace {

constexpr const char* kOurBug =
    "this is a bug in peeler; please report it with the command that shows it";

int report(Console& console, const Error& error) {
    const std::string what = error.what();
    console.error(error.where().empty() ? what : what + ": " + error.where());
    if (!error.hint().empty()) {
        console.hint(error.hint());
    } else if (error.kind() == ErrorKind::kInternal) {
        console.hint(kOurBug);
    }
    return static_cast<int>(error.kind());
}

}  // namespace

int runReported(Console& console, const std::function<int()>& work) {
    try {
        return work();
    } catch (const Error& error) {
        return report(console, error);
    } catch (const ReaderGone&) {
        return 128 + SIGPIPE;
    } catch (const std::bad_alloc&) {
        return report(console, Error(ErrorKind::kMemory, "out of memory", "",
                                     "use a smaller --size, fewer --layers or a lower --memory"));
    } catch (const std::exception& error) {
        return report(console, Error(ErrorKind::kInternal, error.what()));
    } catch (...) {
        return report(console, Error(ErrorKind::kInternal, "unknown exception"));
    }
}

}  // namespace peeler::cmd
