// SPDX-License-Identifier: Apache-2.0
// Tar shards of samples: the output -o OUT-%06d.tar.
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

/// The values of --shard-member, --shard-count and --shard-size.
struct ShardOptions {
    std::optional<std::string> sample;  ///< "EXT", or "NAME.EXT", possibly with {stem} and {folder}
    std::optional<std::uint64_t> samples, bytes;
};

/// Declares the options in ShardOptions. `options` must outlive the parse.
void addShardOptions(VerbOptions& verb, ShardOptions& options);

/// The shards of a run, shared by all scenes. The files of a sample are written as for any picture,
/// to a scratch folder beside the shards, and then moved into a shard.
class SampleShards {
  public:
    /// `options` must request shards. Changes the output in `options` to the file of a sample,
    /// whose name contains {stem}, {folder} and the patterns for frame and view numbers. Creates
    /// nothing under --dry-run. Reports existing shards that cannot be kept, as notes. Throws Error
    /// (kUsage) if the options are invalid, Error (kOutput) if the shards cannot be written.
    SampleShards(RenderOptions& options, Reporter& reporter);

    /// Returns the common name of the shards, with the pattern for their number.
    const std::filesystem::path& name() const { return name_; }
    /// Returns the key of a sample, which is part of its file's name.
    static std::string key(const std::filesystem::path& sample) { return sample.stem().string(); }
    bool contains(const PictureRequest& picture) const;
    /// Whether an earlier run has made the sample, with the same request.
    bool isUpToDate(const PictureRequest& picture) const;

    /// Keeps an existing sample. Fills in the sample's shard and size in `result`.
    void keep(const PictureRequest& picture, PictureResult& result);
    /// Moves a sample's files into a shard. Fills in the sample's shard and size in `result`.
    void add(const PictureRequest& picture, PictureResult& result);
    /// Finishes the last shard. `all`: whether all samples were added, that is, the run was not
    /// aborted.
    void finish(bool all, Reporter& reporter);

  private:
    std::filesystem::path name_;
    std::optional<ScratchFolder> scratch_;
    std::optional<TarShards> shards_;
};

/// Finishes the shards of a run, if any, before the result is reported. `all`: whether all samples
/// were added, that is, the run was not aborted. Returns the exit code.
int endShards(const RenderOptions& options, bool all, Reporter& reporter);

/// Throws Error (kUsage) if an option in ShardOptions is given, for outputs that are not shards.
void refuseShardOptions(const VerbOptions& verb);

/// Whether the name of an output is that of shards.
bool namesShards(const std::filesystem::path& output);

}  // namespace peeler::cmd
