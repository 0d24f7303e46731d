// SPDX-License-Identifier: Apache-2.0
// Parts shared by the fuzz targets: their declaration, and conversion of bytes to files and
// numbers.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include <peeler/error.h>

namespace peeler::fuzz {

using Input = std::span<const std::uint8_t>;

/// A function that accepts any bytes. It may throw Error to reject its input; every other failure
/// is a finding.
struct Target {
    const char* name;
    void (*take)(Input);
};

/// Returns all targets linked into the program, in no particular order.
std::vector<Target>& targets();

/// Runs `work`. Rethrows only findings: exceptions other than Error, and Errors that report a bug.
template <class Work>
void attempt(Work&& work) {
    try {
        work();
    } catch (const Error& error) {
        if (error.kind() == ErrorKind::kInternal) throw;
    }
}

/// Returns the path of a new file with this name and these bytes. The end of the process removes
/// the file's folder.
std::string fileOf(std::string_view name, Input bytes);
std::filesystem::path scratchFolder();

inline std::string textOf(Input bytes) {
    return {bytes.begin(), bytes.end()};
}

/// Takes numbers from the beginning of the bytes. After the last byte, every number is 0.
class Taker {
  public:
    explicit Taker(Input bytes) : bytes_(bytes) {}

    template <class T>
    T take() {
        static_assert(std::is_trivially_copyable_v<T>);
        T value{};
        const std::size_t size = std::min(sizeof value, bytes_.size());
        if (size > 0) std::memcpy(&value, bytes_.data(), size);
        bytes_ = bytes_.subspan(size);
        return value;
    }
    /// Returns a number from 0 to `count` − 1, from one byte.
    std::size_t below(std::size_t count) { return take<std::uint8_t>() % count; }
    bool flip() { return below(2) == 1; }
    Input rest() const { return bytes_; }

  private:
    Input bytes_;
};

}  // namespace peeler::fuzz

// A libFuzzer program has one target. It has a single thread, because inputs are small and findings
// must be reproducible. The regression tests have all targets in a table.
#ifdef PEELER_LIBFUZZER
#include <peeler/work.h>
#include "formats/image/image_library.h"

#define PEELER_FUZZ_TARGET(name, function)                                             \
    extern "C" int LLVMFuzzerInitialize(int* count, char*** arguments);                \
    int LLVMFuzzerInitialize(int*, char***) {                                          \
        peeler::setThreadCount(1);                                                     \
        peeler::setLibraryThreads(1);                                                  \
        return 0;                                                                      \
    }                                                                                  \
    extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size); \
    int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {           \
        peeler::fuzz::attempt([&] { function({data, size}); });                        \
        return 0;                                                                      \
    }
#else
#define PEELER_FUZZ_TARGET(name, function)        \
    [[maybe_unused]] const bool name##_is_known = \
        (peeler::fuzz::targets().push_back({#name, function}), true);
#endif
