// SPDX-License-Identifier: Apache-2.0
// Helper processes: separate programs with resource limits, which run decoders on untrusted data.
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <limits>
#include <span>
#include <vector>

namespace peeler {

/// An unnamed in-memory file of consecutive arrays, for exchange between two processes. Each
/// SharedFile has its own position in the file. Throws Error (kMemory) if memory runs out, Error
/// (kInput) if a read does not match the content.
class SharedFile {
  public:
    /// Creates an empty file. Throws Error (kInternal) if that fails.
    SharedFile();
    /// Takes ownership of the descriptor. Starts at the position `place`.
    explicit SharedFile(int descriptor, std::uint64_t place = 0)
        : descriptor_(descriptor), place_(place) {}
    ~SharedFile();
    SharedFile(SharedFile&& other) noexcept;
    SharedFile& operator=(SharedFile&&) = delete;

    int descriptor() const { return descriptor_; }
    void seek(std::uint64_t place) { place_ = place; }

    /// Writes an array, preceded by its size in bytes.
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

    /// Reads the next array. Throws Error (kInput) if it has more than `most` values.
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
    /// Returns the number of values in the next array. Throws Error (kInput) if the array is
    /// incomplete or exceeds `most`.
    std::uint64_t takeSize(std::size_t of_value, std::uint64_t most);

    int descriptor_ = -1;
    std::uint64_t place_ = 0;
};

/// The state of a helper, stored as the first value of its result.
enum class HelperState : std::uint32_t {
    kUnfinished = 0,
    kDone,    ///< the helper's result follows
    kFailed,  ///< the helper's Error follows: kind (int), message and hint
};

struct HelperRun {
    std::filesystem::path program;
    int cpu_seconds = 10;
    const char* hint = "";
    /// If set, runHelper() adds the helper's processor time, in microseconds, even if the helper
    /// fails.
    std::atomic<std::uint64_t>* used = nullptr;
    const char* install = "";  ///< hint of the Error for a program that lacks a library
};

/// Runs the program, whose main is helperMain() (formats/modules/helper_main.h), and returns its
/// result. The helper has only the request and the result open, and only LD_LIBRARY_PATH in its
/// environment. It gets no copy of this process's memory or threads. Rethrows an Error (kInput or
/// kMemory) that the helper reports, with the same kind, message and hint. Throws Error (kInput)
/// with an empty `where` if the helper crashes, exceeds its limits or returns anything else. Throws
/// Error (kInternal) if the helper cannot be started or lacks a library. Hostile data may control
/// the helper, so the caller must check all values of the result. Thread-safe.
SharedFile runHelper(const HelperRun& run, const SharedFile& request);

}  // namespace peeler
