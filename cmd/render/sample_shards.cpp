// SPDX-License-Identifier: Apache-2.0
#include "cmd/render/sample_shards.h"

#include <algorithm>
#include <nlohmann/json.hpp>
#include <string_view>
#include <system_error>
#include <vector>

#include <peeler/error.h>
#include "cmd/cli/arguments.h"
#include "cmd/cli/errors.h"
#include "cmd/cli/parse.h"
#include "cmd/options/output_checks.h"
#include "cmd/render/render_options.h"
#include "cmd/render/render_request.h"
#include "formats/cameras/calibration.h"
#include "formats/exr/exr_files.h"
#include "formats/file/atomic_file.h"
#include "formats/file/file_name.h"
#include "formats/file/json_text.h"

namespace peeler::cmd {

namespace {

namespace fs = std::filesystem;

constexpr const char* kShardsGroup = "Shards";

/// Returns the file extension of the first output format of this kind.
std::string usualExtension(const std::string& kind) {
    for (const OutputFormat& format : outputFormats())
        if (kind.empty() || format.kind == kind)
            return std::string(format.extensions.front().substr(1));
    return "exr";  // other functions refuse unknown kinds
}

/// Returns the file name of a sample, with {stem} and {folder} still in it.
std::string sampleName(const RenderOptions& options) {
    const std::string asked =
        options.shard.sample.value_or(usualExtension(options.output.options.as));
    const std::size_t dot = asked.find('.');
    const std::string extension = dot == std::string::npos ? asked : asked.substr(dot + 1);
    std::string key = dot == std::string::npos ? "{stem}" : asked.substr(0, dot);
    if (key.empty() || key.find_first_of("/#%@") != std::string::npos)
        refuse("a sample's name cannot have a folder or a placeholder for numbers",
               "--shard-member " + asked,
               "use a name such as '{folder}_{stem}.npz', to which numbers are added");
    std::vector<std::string_view> extensions;
    for (const OutputFormat& format : outputFormats())
        for (const std::string_view each : format.extensions)
            if (std::ranges::find(extensions, each.substr(1)) == extensions.end())
                extensions.push_back(each.substr(1));
    if (std::ranges::find(extensions, extension) == extensions.end())
        refuseName("sample", extension, extensions);
    findOutputFormat(key + '.' + extension, options.output.options.as);
    if (options.animation.frames) key += "_####";
    if (options.views.asked()) key += "_@@@@";
    return key + '.' + extension;
}

void checkShardName(const RenderOptions& options) {
    const std::string name = options.output.path.string();
    const std::string option = "--output " + name;
    if (isStandardOutput(name))
        refuse("shards cannot be written to standard output", option, "name a file");
    for (const char* place : {"{stem}", "{folder}"})
        if (name.find(place) != std::string::npos)
            refuse("all scenes of a run share the shards", option,
                   "leave " + std::string(place) + " out, or use it in --shard-member");
    if (hasViewToken(name))
        refuse("shards are not numbered by views", option, "use %06d for the shard's number");
    if (options.sequence.chunk && chunkName(name, *options.sequence.chunk) == name)
        refuse("all chunks would write the same shards", option,
               "put {chunk} into the file's name");
    if (options.output.hasFilePerLayer())
        refuse("a sample cannot have one file per layer", "--layout per-file",
               "choose another layout");
}

}  // namespace

void addShardOptions(VerbOptions& verb, ShardOptions& options) {
    addValue(
        verb, "--shard-member", "EXT", options.sample, [](const std::string& text) { return text; },
        "name of the samples' files in the shards (tar files for webdataset) that an output "
        "such as 'train-%06d.tar' writes: an extension, for the name {stem}.EXT, or a whole name, "
        "such as '{folder}_{stem}.npz'; the numbers of frame and view are added (default: "
        "the extension that --as implies; exr without --as)")
        .group(kShardsGroup);
    addValue(
        verb, "--shard-count", "N", options.samples,
        [](const std::string& text) {
            return static_cast<std::uint64_t>(parseInteger(text, 1, 1'000'000'000));
        },
        "maximum number of samples per shard (default: 100000)")
        .group(kShardsGroup);
    addValue(
        verb, "--shard-size", "BYTES", options.bytes,
        [](const std::string& text) { return parseBytes(text); },
        "maximum size of a shard in bytes, unless a single sample is larger (default: 3GB)")
        .group(kShardsGroup);
}

int endShards(const RenderOptions& options, bool all, Reporter& reporter) {
    if (!options.shards || options.sequence.dry_run) return 0;
    return runReported(reporter, [&] {
        options.shards->finish(all, reporter);
        return 0;
    });
}

void refuseShardOptions(const VerbOptions& verb) {
    for (const char* option : {"--shard-member", "--shard-count", "--shard-size"})
        if (verb.given(option))
            refuse("there are no shards", option, "write to a .tar, or leave it out");
}

bool namesShards(const fs::path& output) {
    return lowerExtension(output) == ".tar";
}

SampleShards::SampleShards(RenderOptions& options, Reporter& reporter) {
    options.report.applyTo(reporter);
    checkShardName(options);
    const std::string sample = sampleName(options);
    name_ = chunkName(options.output.path.string(), options.sequence.chunk.value_or(Shard()));
    ShardSettings settings;
    settings.samples = options.shard.samples.value_or(settings.samples);
    settings.bytes = options.shard.bytes.value_or(settings.bytes);
    settings.replaces = !options.output.no_clobber;
    shards_.emplace(name_.string(), settings);

    const SequenceOptions& sequence = options.sequence;
    OutputRequest first;
    first.path = shards_->nameOf(0);
    first.no_mkdir = options.output.no_mkdir;
    first.no_clobber = options.output.no_clobber && !sequence.skip_existing && !sequence.dry_run;
    checkTarget(first, {});
    checkFolder(first.path);
    options.output.no_mkdir = false;
    if (sequence.skip_existing || sequence.dry_run)
        for (const std::string& bad : shards_->findExisting())
            reporter.note(bad + " is rendered again: it is incomplete, or peeler did not write it");
    if (!sequence.dry_run) scratch_.emplace(name_.parent_path());
    options.output.path =
        (scratch_ ? scratch_->path() : name_.parent_path() / hiddenName("samples")) / sample;
}

bool SampleShards::contains(const PictureRequest& picture) const {
    return shards_->contains(key(picture.output.path));
}

bool SampleShards::isUpToDate(const PictureRequest& picture) const {
    return shards_->contains(key(picture.output.path), picture.provenance.output_hash);
}

void SampleShards::keep(const PictureRequest& picture, PictureResult& result) {
    result.sample = key(picture.output.path);
    const TarShards::Stored stored = shards_->keep(result.sample);
    result.output = stored.shard;
    result.bytes = stored.bytes;
}

void SampleShards::add(const PictureRequest& picture, PictureResult& result) {
    const std::string file = picture.output.path.string();
    std::vector<std::string> files = filesBeside(file, picture.output.options);
    files.insert(files.begin(), file);
    result.sample = key(file);
    std::vector<SampleFile> members;
    for (const std::string& each : files) {
        // The rest after the key is a suffix such as ".npy" or "_ldi.npz".
        const std::string name = fs::path(each).filename().string();
        members.push_back({name.substr(result.sample.size() + 1), each});
    }
    const Provenance& provenance = picture.provenance;
    Json about;
    about["outputHash"] = provenance.output_hash;
    about["scene"] = provenance.scene;
    if (picture.number.frame) {
        about["frame"] = *picture.number.frame;
        about["time"] = picture.time;
    }
    if (picture.number.view) about["view"] = *picture.number.view;
    about["camera"] = parseOrderedJson(cameraJson(picture.view), "peeler:cameraJson");
    about.update(calibrationJson(picture.view));
    if (result.normalized) about["normalized"] = normalizingJson(*result.normalized);
    const TarShards::Stored stored = shards_->add(result.sample, about, members);
    result.output = stored.shard;
    result.bytes = stored.bytes;
    std::error_code failure;  // ignored, because the folder is removed later
    for (const std::string& each : files)
        fs::remove(each, failure);
}

void SampleShards::finish(bool all, Reporter& reporter) {
    shards_->finish(all);
    if (!all) return;
    if (const std::string behind = shards_->surplus(); !behind.empty())
        reporter.warning("Shards of an earlier run remain: " + behind + " and any that follow.");
}

}  // namespace peeler::cmd
