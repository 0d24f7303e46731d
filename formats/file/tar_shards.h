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

/// The limits of shards.
struct ShardSettings {
    std::uint64_t samples = 100'000;  ///< maximum number of samples per shard
    /// Maximum size of the shard's file, in bytes. A larger sample gets a shard of its own.
    std::uint64_t bytes = 3'000'000'000;
    /// Whether an existing shard may be replaced.
    bool replaces = true;
};

/// A file to be stored as KEY.EXTENSION.
struct SampleFile {
    std::string extension;  ///< part of the name after the key, without the dot: "png", "ldi.npz"
    std::filesystem::path file;
};

/// A writer of samples into shards. Shards are created in order; each is published when it is full,
/// the last one at the end. A sample consists of the members KEY.png, …, all with the same key. Its
/// last member is KEY.json: its metadata, with the hash of its inputs.
///
/// The format is ustar (IEEE Std 1003.1-2017, pax, "ustar Interchange Format"): regular files of
/// mode 0644, owner and group 0 without names, dated by SOURCE_DATE_EPOCH, else 0. The file ends
/// with two blocks of zeros. The same samples produce the same bytes.
///
/// Samples from earlier runs may be kept. They are copied, but a shard whose samples are all kept
/// in order is not touched. Existing shards are not trusted: incomplete shards and shards with a
/// different layout are ignored.
class TarShards {
  public:
    /// The name of a shard is framePath() of `pattern` and the shard's number (from 0). Writes
    /// nothing. Throws Error (kUsage) if SOURCE_DATE_EPOCH is not a valid date for a member.
    explicit TarShards(std::string pattern, const ShardSettings& settings = {});
    ~TarShards();
    TarShards(const TarShards&) = delete;
    TarShards& operator=(const TarShards&) = delete;

    struct Stored {
        std::string shard;        ///< the shard's file; it does not exist before it is complete
        std::uint64_t bytes = 0;  ///< bytes of the sample's files, without KEY.json
    };

    /// Scans the existing shards; must be called first. Returns the names of ignored shards.
    std::vector<std::string> findExisting();
    /// Whether an earlier run stored a sample with this key (and, if given, this hash).
    bool contains(const std::string& key) const;
    bool contains(const std::string& key, std::string_view hash) const;

    /// Appends a sample from an earlier run; contains(key) must be true. Throws Error (kOutput) if
    /// writing fails, Error (kInput) if the sample's shard has changed since findExisting().
    Stored keep(const std::string& key);
    /// Appends a new sample. `about` has the hash of its inputs as "outputHash". Throws Error
    /// (kOutput), also for a name longer than 100 bytes or a file of 8 GiB or more. Throws Error
    /// (kUsage) if the shard is full and the pattern has no placeholder for the next number. After
    /// these errors, the shards hold no part of the sample.
    Stored add(const std::string& key, const nlohmann::ordered_json& about,
               std::span<const SampleFile> files);

    /// Ends the last shard. If `all` is false (the run failed before it wrote all samples),
    /// publishes the shard only if it has at least as many samples as the shard that it would
    /// replace.
    void finish(bool all = true);
    /// Returns the first shard of an earlier run with a number after the last new shard, or "" if
    /// there is none.
    std::string surplus() const;

    /// Returns the name of a shard. Throws Error (kUsage) if the pattern gives it the name of the
    /// first shard.
    std::string nameOf(int number) const;

  private:
    struct OldShard;
    struct OldSample {
        OldShard* shard = nullptr;
        std::string hash;
        std::uint64_t begin = 0, end = 0;  ///< range of the sample's bytes in the shard's file
        std::uint64_t bytes = 0;           ///< number of bytes, as in Stored::bytes
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
    /// Returns the earlier shard with the current number, or null if there is none.
    OldShard* oldShard() const;
    void checkUnbroken() const;

    std::string pattern_;
    ShardSettings settings_;
    std::time_t date_ = 0;  ///< date of all members

    std::unordered_map<int, std::unique_ptr<OldShard>> old_;  ///< earlier shards by number
    std::unordered_map<std::string, OldSample> samples_;      ///< earlier samples by key
    /// Shards whose files are open: a few, in order of last use.
    std::deque<OldShard*> open_;

    // The current shard. The shard has no file as long as it consists of kept samples in the same
    // order as at the beginning of the old shard.
    int number_ = 0;
    std::uint64_t count_ = 0, size_ = 0;  ///< number of samples; bytes of the samples with headers
    std::unique_ptr<AtomicFile> file_;
    bool broken_ = false;  ///< whether the file has a partial sample, or could not be finished
};

}  // namespace peeler
