// SPDX-License-Identifier: Apache-2.0
// Runs decoders that are not to be trusted with any input: as programs of their own, with limits.
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <limits>
#include <span>
#include <vector>

namespace peeler {

/// Arrays of numbers, one after the other, in a file that has no name and lies in memory. Two
/// processes may have it open: each end has a place of its own. Throws Error (kMemory) where there
/// is no room, (kInput) where something else than what is there is asked for.
class SharedFile {
  public:
    /// An empty one.
    SharedFile();
    /// The one behind this descriptor, from `place` on.
    explicit SharedFile(int descriptor, std::uint64_t place = 0)
        : descriptor_(descriptor), place_(place) {}
    ~SharedFile();
    SharedFile(SharedFile&& other) noexcept;
    SharedFile& operator=(SharedFile&&) = delete;

    int descriptor() const { return descriptor_; }
    void seek(std::uint64_t place) { place_ = place; }

    /// Puts an array, before it how long it is.
    template <typename T>
    void put(std::span<const T> values) {
        const std::uint64_t size = values.size_bytes();
        write(&size, sizeof size);
        write(values.data(), size);
    }
    template <typename T>
    void put(const std::vector<T>& values) {
        put(std::span<const T>(values));
    }
    template <typename T>
    void putOne(const T& value) {
        write(&value, sizeof value);
    }

    /// The array that comes next. Throws Error (kInput) if it has more than `most` values.
    template <typename T>
    std::vector<T> take(std::uint64_t most = std::numeric_limits<std::uint64_t>::max()) {
        std::vector<T> values(takeSize(sizeof(T), most));
        read(values.data(), values.size() * sizeof(T));
        return values;
    }
    template <typename T>
    T takeOne() {
        T value{};
        read(&value, sizeof value);
        return value;
    }

  private:
    void write(const void* from, std::size_t size);
    void read(void* to, std::size_t size);
    /// The number of values of the array that comes next, which is there as a whole.
    std::uint64_t takeSize(std::size_t of_value, std::uint64_t most);

    int descriptor_ = -1;
    std::uint64_t place_ = 0;
};

/// What stands at the beginning of a helper's result.
enum class HelperState : std::uint32_t {
    kUnfinished = 0,
    kDone,    ///< the result follows
    kFailed,  ///< an Error follows: its kind (int), what and hint
};

struct HelperRun {
    std::filesystem::path program;
    int cpu_seconds = 10;
    const char* hint = "";  ///< of the errors below
    /// Gets the processor time that it takes added, in microseconds, however it ends.
    std::atomic<std::uint64_t>* used = nullptr;
};

/// Starts the program, whose main is helperMain() (formats/modules/helper_main.h), and gives back
/// its result. It has the request and the result open and nothing else, and of the environment
/// LD_LIBRARY_PATH; memory and threads of this process are not copied. An Error (kInput or kMemory)
/// that its work throws is thrown here with the same kind, what and hint. One that crashes, goes
/// over its limits or answers anything else ends in Error(kInput) with an empty `where`. Hostile
/// data may control the helper, so the caller checks all that it takes from the result. May be
/// called from several threads. Throws Error(kInternal) if it cannot be started.
SharedFile runHelper(const HelperRun& run, const SharedFile& request);

}  // namespace peeler
