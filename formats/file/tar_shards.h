// SPDX-License-Identifier: Apache-2.0
// Tar files of samples, as loaders of training data read them one after the other (webdataset).
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

/// When a shard is full.
struct ShardSettings {
    std::uint64_t samples = 100'000;  ///< that it has at most
    /// The bytes that its file has at most, unless a lone sample is larger.
    std::uint64_t bytes = 3'000'000'000;
    /// Whether a shard that is there may be replaced by another one.
    bool replaces = true;
};

/// A file that becomes KEY.EXTENSION.
struct SampleFile {
    std::string extension;  ///< without the dot behind the key: "png", "ldi.npz"
    std::filesystem::path file;
};

/// Writes samples, whole ones only, into shards, which are made in order and stand under their
/// names when they are full, or at the end. A sample is the members KEY.png, … with one key, and
/// KEY.json, which comes last: what is told of it, with the hash of what it was made of.
///
/// The format is ustar (IEEE Std 1003.1-2017, pax, "ustar Interchange Format"): regular files of
/// mode 0644, owner and group 0 without names, the date that SOURCE_DATE_EPOCH says, else 0; two
/// blocks of zeros at the end, and nothing behind them. So the same samples make the same bytes.
///
/// Samples that are there from earlier may be kept: they are copied, and a shard of which all
/// samples are kept, in their order, is not touched. Shards that are there are not trusted: what is
/// not whole, or not as written here, counts for nothing.
class TarShards {
  public:
    /// `pattern`: framePath() makes a shard's name of it and its number, from 0 on. Writes nothing.
    /// Throws Error (kUsage) if SOURCE_DATE_EPOCH is no date that a member can have.
    explicit TarShards(std::string pattern, const ShardSettings& settings = {});
    ~TarShards();
    TarShards(const TarShards&) = delete;
    TarShards& operator=(const TarShards&) = delete;

    struct Stored {
        std::string shard;        ///< its file, which is there once it is whole
        std::uint64_t bytes = 0;  ///< of the sample's files without KEY.json
    };

    /// Looks through the shards that are there; to be called before anything else. Returns those
    /// that count for nothing.
    std::vector<std::string> findExisting();
    /// Whether a sample is there from earlier; with a hash, whether it has that one.
    bool contains(const std::string& key) const;
    bool contains(const std::string& key, std::string_view hash) const;

    /// Appends a sample that contains(key). Throws Error (kOutput), and (kInput) if its shard has
    /// changed since.
    Stored keep(const std::string& key);
    /// Appends a sample. `about` has its hash as "outputHash". Throws Error (kOutput), also for a
    /// name of more than 100 bytes and a file of 8 GiB; (kUsage) if the shard is full and the
    /// pattern has no place for the next one's number. Nothing of the sample is in a shard then.
    Stored add(const std::string& key, const nlohmann::ordered_json& about,
               std::span<const SampleFile> files);

    /// Ends the last shard. If not `all` samples are there, because the run has failed, it appears
    /// only if it has no fewer samples than the one that it would replace.
    void finish(bool all = true);
    /// A shard from earlier that stands behind the last one; "" if there is none.
    std::string surplus() const;

    /// The name of a shard. Throws Error (kUsage) if it would be that of the first one.
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
    OldShard* oldShard() const;  ///< of the number at hand; null if there is none
    void checkUnbroken() const;

    std::string pattern_;
    ShardSettings settings_;
    std::time_t date_ = 0;  ///< of members

    std::unordered_map<int, std::unique_ptr<OldShard>> old_;  ///< by number
    std::unordered_map<std::string, OldSample> samples_;      ///< by key
    std::deque<OldShard*> open_;                              ///< a few, the latest last

    // The shard at hand. As long as all its samples are kept, and those that the old shard begins
    // with, it has no file.
    int number_ = 0;
    std::uint64_t count_ = 0, size_ = 0;  ///< samples, and their bytes with headers
    std::unique_ptr<AtomicFile> file_;
    bool broken_ = false;  ///< the file has a part of a sample, or could not be ended
};

}  // namespace peeler
