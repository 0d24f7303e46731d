// SPDX-License-Identifier: Apache-2.0
// Tar shards of samples, for -o OUT-%06d.tar.
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

/// The shards of a run, shared by all its scenes. A sample's files are first written like those of
/// any picture, to a scratch folder beside the shards, and then moved into a shard.
class SampleShards {
  public:
    /// `options` must request shards. Changes their output to the file of a sample, with the
    /// patterns for {stem}, {folder}, frame and view numbers. Creates nothing under --dry-run.
    /// Notes existing shards that cannot be kept. Throws Error (kUsage) if the options are invalid,
    /// Error (kOutput) if the shards cannot be written.
    SampleShards(RenderOptions& options, Reporter& reporter);

    /// Returns the name of all shards, with the pattern for their number.
    const std::filesystem::path& name() const { return name_; }
    /// Returns the key of a sample, from its file.
    static std::string key(const std::filesystem::path& sample) { return sample.stem().string(); }
    bool contains(const PictureRequest& picture) const;
    /// Whether the sample exists from an earlier run with the same request.
    bool isUpToDate(const PictureRequest& picture) const;

    /// Keeps an existing sample. Fills in its location and bytes.
    void keep(const PictureRequest& picture, PictureResult& result);
    /// Moves a sample's files into a shard. Fills in its location and bytes.
    void add(const PictureRequest& picture, PictureResult& result);
    /// Finishes the last shard. `all`: the run was not aborted, so no sample is missing.
    void finish(bool all, Reporter& reporter);

  private:
    std::filesystem::path name_;
    std::optional<ScratchFolder> scratch_;
    std::optional<TarShards> shards_;
};

/// Finishes the shards of a run, if any, before the report. `all`: the run was not aborted, so no
/// sample is missing. Returns the exit code.
int endShards(const RenderOptions& options, bool all, Reporter& reporter);

/// Throws Error (kUsage) if one of the options is given. For outputs without shards.
void refuseShardOptions(const VerbOptions& verb);

/// Whether an output's name is that of shards.
bool namesShards(const std::filesystem::path& output);

}  // namespace peeler::cmd
