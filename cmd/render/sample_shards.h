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
    std::optional<std::string> sample;  ///< "EXT" or "NAME.EXT"; NAME may have {stem} and {folder}
    std::optional<std::uint64_t> samples, bytes;
};

/// Declares the options in ShardOptions. `options` must outlive the parse.
void addShardOptions(VerbOptions& verb, ShardOptions& options);

/// The shards of a run, shared by all scenes. A sample's files are written to a scratch folder
/// beside the shards and then moved into a shard.
class SampleShards {
  public:
    /// `options` must request shards. Sets the output in `options` to the file of a sample, whose
    /// name contains {stem}, {folder} and the patterns for frame and view numbers. Creates nothing
    /// in a dry run. Prints notes about existing shards that cannot be kept. Throws Error (kUsage)
    /// if the options are invalid, Error (kOutput) if the shards cannot be written.
    SampleShards(RenderOptions& options, Reporter& reporter);

    /// Returns the common name of the shards, with a number pattern.
    const std::filesystem::path& name() const { return name_; }
    /// Returns a sample's key: the file's name without its extension.
    static std::string key(const std::filesystem::path& sample) { return sample.stem().string(); }
    bool contains(const PictureRequest& picture) const;
    /// Whether an earlier run made the sample from the same request.
    bool isUpToDate(const PictureRequest& picture) const;

    /// Keeps an existing sample. Sets the sample's shard and size in `result`.
    void keep(const PictureRequest& picture, PictureResult& result);
    /// Moves a sample's files into a shard. Sets the sample's shard and size in `result`.
    void add(const PictureRequest& picture, PictureResult& result);
    /// Finishes the last shard. `all`: whether all samples were added; false if the run was
    /// aborted.
    void finish(bool all, Reporter& reporter);

  private:
    std::filesystem::path name_;
    std::optional<ScratchFolder> scratch_;
    std::optional<TarShards> shards_;
};

/// Finishes the shards of a run, if any, before the result is reported. `all`: whether all samples
/// were added; false if the run was aborted. Returns the exit code.
int endShards(const RenderOptions& options, bool all, Reporter& reporter);

/// Throws Error (kUsage) if a shard option is given for an output that is not shards.
void refuseShardOptions(const VerbOptions& verb);

/// Whether an output's name has the extension of shards.
bool namesShards(const std::filesystem::path& output);

}  // namespace peeler::cmd
