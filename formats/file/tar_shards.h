// SPDX-License-Identifier: Apache-2.0
// Tar shards of training samples, read sequentially by data loaders (webdataset).
#pragma once

#include <cstdint>
#include <ctime>
#include <deque>
#include <filesystem>
#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <span>
#include <string>
#include <string_view>
#include <unordered_map>
#include <utility>
#include <vector>

#include "formats/file/atomic_file.h"

namespace peeler {

class RegularFile;

/// The limits of a shard.
struct ShardSettings {
    std::uint64_t samples = 100'000;  ///< maximum per shard
    /// Maximum file size, unless a single sample is larger.
    std::uint64_t bytes = 3'000'000'000;
    /// Whether an existing shard may be replaced.
    bool replaces = true;
};

/// A file to be stored as KEY.EXTENSION.
struct SampleFile {
    std::string extension;  ///< without the dot behind the key: "png", "ldi.npz"
    std::filesystem::path file;
};

/// A writer of complete samples into shards, which are created in order and published when they are
/// full, or at the end. A sample is the members KEY.png, … with one key, and KEY.json, which comes
/// last: its metadata, with the hash of its inputs.
///
/// The format is ustar (IEEE Std 1003.1-2017, pax, "ustar Interchange Format"): regular files of
/// mode 0644, owner and group 0 without names, the date from SOURCE_DATE_EPOCH, else 0; two blocks
/// of zeros at the end, and nothing behind them. So the same samples produce the same bytes.
///
/// Samples of earlier runs may be kept: they are copied, and a shard is not touched if all its
/// samples are kept in order. Existing shards are not trusted: incomplete ones, or ones in a
/// different layout, are ignored.
class TarShards {
  public:
    /// `pattern`: framePath() turns it and the shard's number (from 0) into a name. Writes nothing.
    /// Throws Error (kUsage) if SOURCE_DATE_EPOCH is not a valid date for a member.
    explicit TarShards(std::string pattern, const ShardSettings& settings = {});
    ~TarShards();
    TarShards(const TarShards&) = delete;
    TarShards& operator=(const TarShards&) = delete;

    struct Stored {
        std::string shard;        ///< its file, which exists once it is complete
        std::uint64_t bytes = 0;  ///< of the sample's files, without KEY.json
    };

    /// Scans the existing shards; must be called first. Returns the ignored ones.
    std::vector<std::string> findExisting();
    /// Whether a sample exists from an earlier run; with a hash, whether it has that hash.
    bool contains(const std::string& key) const;
    bool contains(const std::string& key, std::string_view hash) const;

    /// Appends an existing sample, for which contains(key). Throws Error (kOutput), and (kInput) if
    /// its shard has changed since.
    Stored keep(const std::string& key);
    /// Appends a sample. `about` has its hash as "outputHash". Throws Error (kOutput), also for a
    /// name longer than 100 bytes or a file of 8 GiB or more; (kUsage) if the shard is full and the
    /// pattern has no placeholder for the next number. In that case, no part of the sample is in a
    /// shard.
    Stored add(const std::string& key, const nlohmann::ordered_json& about,
               std::span<const SampleFile> files);

    /// Ends the last shard. If not `all` samples were written because the run failed, publishes it
    /// only if it has at least as many samples as the one it would replace.
    void finish(bool all = true);
    /// Returns an earlier run's shard behind the last one; "" if no such shard exists.
    std::string surplus() const;

    /// Returns the name of a shard. Throws Error (kUsage) if it equals that of the first one.
    std::string nameOf(int number) const;

  private:
    struct OldShard;
    struct OldSample {
        OldShard* shard = nullptr;
        std::string hash;
        std::uint64_t begin = 0, end = 0;  ///< in the shard's file
        std::uint64_t bytes = 0;           ///< as Stored::bytes
    };

    static std::unique_ptr<OldShard> read(const std::string& path,
                                          std::vector<std::pair<std::string, OldSample>>& samples);
    void makeRoom(std::uint64_t bytes);
    void startFile();
    void endShard(bool all);
    void copy(OldShard& from, std::uint64_t begin, std::uint64_t end);
    void append(const std::string& name, std::uint64_t size);
    RegularFile& opened(OldShard& shard);
    void close(OldShard& shard);
    OldShard* oldShard() const;  ///< with the current number; null if missing
    void checkUnbroken() const;

    std::string pattern_;
    ShardSettings settings_;
    std::time_t date_ = 0;  ///< of members

    std::unordered_map<int, std::unique_ptr<OldShard>> old_;  ///< by number
    std::unordered_map<std::string, OldSample> samples_;      ///< by key
    std::deque<OldShard*> open_;                              ///< a few, the most recent last

    // The current shard. It has no file as long as all its samples are kept and match the beginning
    // of the old shard.
    int number_ = 0;
    std::uint64_t count_ = 0, size_ = 0;  ///< samples, and their bytes with headers
    std::unique_ptr<AtomicFile> file_;
    bool broken_ = false;  ///< the file has a partial sample, or could not be finished
};

}  // namespace peeler
