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

struct ShardSettings {
    std::uint64_t samples = 100'000;  ///< maximum number of samples per shard
    /// Maximum size of the shard's file, in bytes. A sample larger than this gets its own shard.
    std::uint64_t bytes = 3'000'000'000;
    /// Whether existing files may be replaced.
    bool replaces = true;
};

/// A file to store as the member KEY.EXTENSION.
struct SampleFile {
    std::string extension;  ///< without the leading dot: "png", "ldi.npz"
    std::filesystem::path file;
};

/// A writer of samples into shards. Shards are created in order. Each is published when it is full,
/// the last one at the end. A sample consists of the members KEY.png, …, all with the same key. Its
/// last member is KEY.json: its metadata, with the hash of its inputs.
///
/// The format is ustar (IEEE Std 1003.1-2017, pax, "ustar Interchange Format"): regular files of
/// mode 0644, owner and group 0 without names, dated by SOURCE_DATE_EPOCH, else 0. The file ends
/// with two blocks of zeros. The same samples produce the same bytes.
///
/// Samples of earlier runs may be kept. They are copied to the new shards, but a shard that keeps
/// all its samples in order is not rewritten. Existing shards are not trusted: incomplete shards
/// and shards with a different layout are ignored.
class TarShards {
  public:
    /// The name of a shard is framePath() of `pattern` and the shard's number (from 0). The
    /// constructor writes nothing. Throws Error (kUsage) if SOURCE_DATE_EPOCH is not a valid date
    /// for a member.
    explicit TarShards(std::string pattern, const ShardSettings& settings = {});
    ~TarShards();
    TarShards(const TarShards&) = delete;
    TarShards& operator=(const TarShards&) = delete;

    struct Stored {
        std::string shard;        ///< path of the shard's file, which may not exist yet
        std::uint64_t bytes = 0;  ///< total bytes of the sample's files, without KEY.json
    };

    /// Scans the existing shards; must be called first. Returns the names of ignored shards.
    std::vector<std::string> findExisting();
    /// Whether an earlier run stored a sample with this key, and with this hash, if given.
    bool contains(const std::string& key) const;
    bool contains(const std::string& key, std::string_view hash) const;

    /// Appends a sample from an earlier run; contains(key) must be true. Throws Error (kOutput) if
    /// writing fails, Error (kInput) if the sample's shard has changed since findExisting().
    Stored keep(const std::string& key);
    /// Appends a new sample. The member "outputHash" of `about` is the hash of the sample's inputs.
    /// Throws Error (kOutput) if writing fails, a name is longer than 100 bytes, or a file has 8
    /// GiB or more. Throws Error (kUsage) if the shard is full and the pattern has no placeholder
    /// for the next number. After these errors, the shards hold no part of the sample.
    Stored add(const std::string& key, const nlohmann::ordered_json& about,
               std::span<const SampleFile> files);

    /// Ends the last shard. If `all` is false because the run failed, publishes this shard only if
    /// it has at least as many samples as the existing shard with its name.
    void finish(bool all = true);
    /// Returns the path of the first existing shard with a number after the last new shard, or "".
    std::string surplus() const;

    /// Returns the path of a shard. Throws Error (kUsage) if the pattern has no placeholder and
    /// `number` is not 0.
    std::string nameOf(int number) const;

  private:
    struct OldShard;
    struct OldSample {
        OldShard* shard = nullptr;
        std::string hash;
        std::uint64_t begin = 0, end = 0;  ///< range of the sample's bytes in the shard's file
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
    /// Returns the earlier shard with the current number, or null.
    OldShard* oldShard() const;
    void checkUnbroken() const;

    std::string pattern_;
    ShardSettings settings_;
    std::time_t date_ = 0;  ///< date of all members

    std::unordered_map<int, std::unique_ptr<OldShard>> old_;  ///< earlier shards by number
    std::unordered_map<std::string, OldSample> samples_;      ///< earlier samples by key
    /// A few shards whose files are open, in order of last use.
    std::deque<OldShard*> open_;

    // The current shard. It has no file as long as its samples are the first samples of the old
    // shard, kept in order.
    int number_ = 0;
    std::uint64_t count_ = 0, size_ = 0;  ///< number of samples; total bytes with headers
    std::unique_ptr<AtomicFile> file_;
    bool broken_ = false;  ///< whether file_ has a partial sample or is unfinished
};

}  // namespace peeler
