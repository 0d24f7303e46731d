// SPDX-License-Identifier: Apache-2.0
// Pictures as samples in tar shards: what -o OUT-%06d.tar asks for.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>

#include "cmd/cli/report.h"
#include "cmd/session/reporter.h"
#include "formats/file/tar_shards.h"
#include "formats/file/temporary_files.h"

namespace peeler::cmd {

class VerbOptions;
struct PictureRequest;
struct RenderOptions;

/// --shard-member, --shard-count and --shard-size.
struct ShardOptions {
    std::optional<std::string> sample;  ///< "EXT", or "NAME.EXT" with {stem} and {folder}
    std::optional<std::uint64_t> samples, bytes;
};

/// Declares the options; `options` must outlive the parse.
void addShardOptions(VerbOptions& verb, ShardOptions& options);

/// The shards of a run, which all its scenes share. The files of a sample are written as those of
/// any picture, into a scratch folder beside the shards, and from there into a shard.
class SampleShards {
  public:
    /// `options` ask for them: from here on their output is the file of a sample, with the places
    /// for {stem}, {folder}, the numbers of frames and views. Under --dry-run nothing is made.
    /// Notes what is there and cannot be kept. Throws Error (kUsage), (kOutput).
    SampleShards(RenderOptions& options, Reporter& reporter);

    /// The name of all shards, with the place for their number.
    const std::filesystem::path& name() const { return name_; }
    /// The key of the sample whose file this is.
    static std::string key(const std::filesystem::path& sample) { return sample.stem().string(); }
    bool contains(const PictureRequest& picture) const;
    /// Whether the sample is there from earlier, made of the same request.
    bool isUpToDate(const PictureRequest& picture) const;

    /// Keeps it. Fills in where it is, and its bytes.
    void keep(const PictureRequest& picture, PictureResult& result);
    /// Moves its files into a shard, and fills in the same.
    void add(const PictureRequest& picture, PictureResult& result);
    /// Ends the last shard. `all`: no sample is missing because the run was given up.
    void finish(bool all, Reporter& reporter);

  private:
    std::filesystem::path name_;
    std::optional<ScratchFolder> scratch_;
    std::optional<TarShards> shards_;
};

/// Ends the shards of a run, if there are any, before they are told of. `all`: no sample is missing
/// because the run was given up. Returns the exit code.
int endShards(const RenderOptions& options, bool all, Reporter& reporter);

/// Throws Error (kUsage) if one of the options is given, for an output without shards.
void refuseShardOptions(const VerbOptions& verb);

/// Whether the name of an output is one of shards.
bool namesShards(const std::filesystem::path& output);

}  // namespace peeler::cmd
