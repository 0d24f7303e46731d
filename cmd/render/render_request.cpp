// SPDX-License-Identifier: Apache-2.0
#include "cmd/render/render_request.h"

#include <algorithm>
#include <iterator>
#include <nlohmann/json.hpp>
#include <tuple>
#include <utility>

#include <peeler/error.h>
#include "cmd/options/clip_options.h"
#include "cmd/options/differences.h"
#include "cmd/options/output_checks.h"
#include "cmd/render/render_options.h"
#include "core/image/merge.h"
#include "core/splats/projected_splats.h"
#include "formats/cameras/calibration.h"
#include "formats/exr/exr_integrity.h"
#include "formats/exr/exr_layout.h"
#include "formats/exr/layered_input.h"
#include "formats/file/content_hash.h"
#include "formats/file/file_name.h"
#include "formats/file/regular_file.h"
#include "formats/output_hash.h"

namespace peeler::cmd {

namespace fs = std::filesystem;

namespace {

/// Returns the value of --as for an OpenEXR file written by peeler.
std::string kindOf(const ExrInfo& info) {
    if (isLayered(info)) return info.deep.empty() ? "ldi" : "deep";
    return info.parts.front().channel("R") ? "composite" : "midpoint-depth";
}

/// Whether an OpenEXR file is complete but was modified after it was written.
bool hasChanged(const std::string& path) {
    try {
        const ExrFiles files(path);
        for (std::size_t part = 0; part < files.parts().size(); ++part)
            files.checkChunks(part);
        return exrIntegrity(path).state == ExrIntegrity::kChanged;
    } catch (const Error&) {
        return false;
    }
}

/// Returns the differences between a picture and its existing OpenEXR file, from the headers.
std::vector<Difference> headerDifferences(const PictureRequest& picture,
                                          const OutputOptions& output) {
    const std::string path = picture.output.path.string();
    const ExrInfo there = readExrInfo(path);
    std::vector<Difference> found = sceneDifferences(picture.provenance, there.provenance);
    const auto take = [&](const std::vector<Difference>& more) {
        found.insert(found.end(), more.begin(), more.end());
    };
    const auto add = [&](const char* what, const std::string& asked, const std::string& stored) {
        if (asked != stored) found.push_back({what, asked, stored});
    };
    const auto windowText = [](const Window& w) {
        return std::to_string(w.x0) + ',' + std::to_string(w.y0) + ',' + std::to_string(w.width()) +
               ',' + std::to_string(w.height());
    };
    take(settingsDifferences(picture.provenance, there.provenance));
    add("the frame", std::to_string(picture.provenance.frame),
        std::to_string(there.provenance.frame));
    add("--time", std::to_string(picture.provenance.time), std::to_string(there.provenance.time));
    take(sizeDifferences(picture.view, there.plan.view));
    take(cameraDifferences(picture.view, there.plan.view));
    add("--crop", windowText(picture.view.crop), windowText(there.plan.view.crop));
    const auto onOff = [](bool on) { return std::string(on ? "on" : "off"); };
    const auto orOff = [](const std::string& text) { return text.empty() ? "off" : text; };
    const std::string kind(findOutputFormat(path, output.as).kind);
    add("--as", kind, kindOf(there));
    const ExrInputPart& part = there.parts.front();
    const bool ldi = kind == "ldi" && kindOf(there) == kind, deep = kind == "deep";
    if (ldi) {
        add("--layout", std::string(findExrLayout(output.layout).name),
            part.attribute("peeler:layout"));
        add("--no-composite", onOff(output.no_composite), onOff(there.composite < 0));
    }
    if (!deep) add("--cryptomatte", onOff(output.cryptomatte), onOff(there.has_cryptomatte));
    if (deep)
        add("--deep-merge", orOff(deepMergeText(output.deep_merge)),
            orOff(there.provenance.deep_merge));
    if (ldi || deep)
        add("--compression", std::string(findExrCompression(output.compression, deep).name),
            part.compression);
    return found;
}

}  // namespace

RenderRequest::RenderRequest(const RenderOptions& options, CaptureJob& job, Reporter& reporter)
    : options_(options),
      views_(options.views, options.camera, options.scene.reading.strict, reporter),
      job_(job) {
    job.checkOptions();
    choosePictures();
    checkFiles();
    capture_ = captureSettings(options);
    checkClipOptions(options.clip);
}

void RenderRequest::openScene() {
    scene_ = &job_.openScene();
    job_.checkOutputs(outputs());
    views_.place(*scene_);
    chooseForScene();
    meters_exposure_ = options_.output.leavesExposureOpen() && !shows_splats_ &&
                       capture_.shading != Shading::kUnlit && !scene_->at(0).lights().empty();
}

/// Chooses the shading rate, and how splats blend. Display pictures of splats alone look as in
/// other viewers by default: one sample per pixel, blended as stored, without a tone map. Throws
/// Error (kUsage) if the output blends its background otherwise.
void RenderRequest::chooseForScene() {
    const PosedScene posed = scene_->at(0);
    const OutputRequest& output = options_.output;
    const bool for_eyes =
        capture_.composite && findOutputFormat(output.path.string(), output.options.as).for_display;
    capture_.shade_per =
        options_.shade_per.value_or(for_eyes ? ShadePer::kAuto : ShadePer::kSample);
    shows_splats_ = for_eyes && hasOnlySplats(posed);
    if (shows_splats_ && !options_.samples_given) capture_.samples = 1;
    if (shows_splats_ && !hasLinearSplats(posed)) capture_.splat_blending = SplatBlending::kDisplay;
    if (options_.splat_blending) capture_.splat_blending = *options_.splat_blending;
    if (capture_.splat_blending == SplatBlending::kDisplay && !for_eyes &&
        output.isGiven("--background"))
        throw Error(ErrorKind::kUsage, "this format blends the background in linear light",
                    "--splat-blending display", "leave --background out, or write a .png");
}

/// Chooses the pictures to make, from the options and the camera file, without the scene.
void RenderRequest::choosePictures() {
    const std::optional<Shard>& chunk = options_.sequence.chunk;
    if (chunk && !isSequence())
        throw Error(ErrorKind::kUsage, "there are no frames or views to divide",
                    "--chunk " + chunk->text(), "add --frames, --cameras or --views");
    moments_ = momentsOf(options_.animation);
    std::tie(first_, end_) = chunk.value_or(Shard()).of(moments_.size() * views_.size());
    const std::string path = options_.output.path.string();
    if (moments_.size() > 1 && !hasFrameToken(path)) {
        throw Error(
            ErrorKind::kUsage,
            "all " + std::to_string(moments_.size()) + " frames would have the same file name",
            "--output " + path, "put #### or %04d into the file's name for the frame's number");
    }
    views_.checkName(path);
}

const Moment& RenderRequest::moment(std::size_t index) const {
    return moments_[(first_ + index) / views_.size()];
}

std::size_t RenderRequest::view(std::size_t index) const {
    return (first_ + index) % views_.size();
}

void RenderRequest::checkFiles() const {
    checkFormat(options_.output);
    std::vector<fs::path> inputs{options_.scene.file};
    if (const auto file = environmentFile(options_.appearance)) inputs.push_back(*file);
    if (options_.views.file)
        std::ranges::move(cameraFiles(*options_.views.file), std::back_inserter(inputs));
    std::vector<fs::path> others = inputs;
    for (std::size_t i = 0; i < pictures(); ++i)
        others.push_back(outputOf(i).path);
    checkTargets(options_.output, std::span(others).subspan(inputs.size()), options_.sequence,
                 inputs);
    if (options_.channels.manifest) {
        const std::string manifest = options_.channels.manifest->string();
        if ((hasFrames() && hasFrameToken(manifest)) || (hasViews() && hasViewToken(manifest))) {
            throw Error(ErrorKind::kUsage, "all frames and views share one manifest",
                        "--manifest " + manifest, "use a name without a number");
        }
        checkExtraFile(manifest, others, "the manifest", "--manifest");
        if (options_.output.no_clobber && !options_.sequence.dry_run) checkNotThere(manifest);
        others.push_back(*options_.channels.manifest);
    }
    if (const auto& cameras = options_.views.cameras_out) {
        checkCameraOutput(cameras->string());
        for (const fs::path& file : cameraFiles(*cameras)) {
            checkExtraFile(file, others, "the file of cameras", "--cameras-out");
            if (options_.output.no_clobber && !options_.sequence.dry_run) checkNotThere(file);
            others.push_back(file);
        }
    }
    checkReport(options_.report, others);
}

/// Returns all output files except the report.
std::vector<fs::path> RenderRequest::outputs() const {
    std::vector<fs::path> files;
    for (std::size_t i = 0; i < pictures(); ++i)
        files.push_back(outputFile(i));
    if (options_.channels.manifest) files.push_back(*options_.channels.manifest);
    if (const auto& cameras = options_.views.cameras_out)
        std::ranges::move(cameraFiles(*cameras), std::back_inserter(files));
    return files;
}

bool RenderRequest::makesSamples() const {
    const OutputFormat& format =
        findOutputFormat(options_.output.path.string(), options_.output.options.as);
    return hasViews() || options_.shards || format.isSample();
}

PictureNumber RenderRequest::number(std::size_t index) const {
    PictureNumber number;
    if (hasFrames()) number.frame = moment(index).frame;
    if (hasViews()) number.view = views_.number(view(index));
    return number;
}

/// Returns the output of a picture. If the run is not a sequence, number patterns stay in the name.
OutputRequest RenderRequest::outputOf(std::size_t index) const {
    OutputRequest output = options_.output;
    output.path = fileOf(number(index));
    return output;
}

fs::path RenderRequest::fileOf(const PictureNumber& number) const {
    std::string path = options_.output.path.string();
    if (number.view) path = viewPath(path, *number.view);
    if (number.frame) path = framePath(path, *number.frame);
    return path;
}

View RenderRequest::firstView(std::size_t view) const {
    return views_.view(*scene_, views_.pose(*scene_, moments_.front().time, view), view);
}

fs::path RenderRequest::firstFile(std::size_t view) const {
    PictureNumber number{.view = views_.number(view)};
    if (hasFrames()) number.frame = moments_.front().frame;
    fs::path file = fileOf(number);
    if (!options_.shards) return file;
    // A picture in a shard has no path of its own, so the camera file contains only the picture's
    // name.
    return options_.views.cameras_out->parent_path() / file.filename();
}

PictureRequest RenderRequest::picture(std::size_t index) const {
    const Moment& moment = this->moment(index);
    PictureRequest picture;
    picture.index = index;
    picture.number = number(index);
    picture.time = moment.time;
    picture.output = outputOf(index);
    picture.posed = views_.pose(*scene_, moment.time, view(index));
    picture.view = views_.view(*scene_, *picture.posed, view(index));
    picture.capture = capture_;
    picture.capture.clip = clipVolume(options_.clip, *picture.posed);
    // Shadow casters have no coloured opacity.
    picture.capture.tinted = !picture.capture.opaque_only && job_.wantsTint(*picture.posed);
    if (options_.channels.wants(Channel::kMotion)) {
        const PosedScene next = views_.pose(*scene_, moment.next_time, view(index));
        picture.next = NextFrame{next, views_.view(*scene_, next, view(index))};
    }
    picture.provenance = provenanceOf(index, picture);
    picture.provenance.output_hash =
        outputHash(picture.view, picture.output.path.string(), writerOptions(picture));
    return picture;
}

Provenance RenderRequest::provenanceOf(std::size_t index, const PictureRequest& picture) const {
    const Moment& moment = this->moment(index);
    const CaptureSettings& capture = picture.capture;
    Provenance provenance;
    provenance.version = PEELER_VERSION;
    provenance.method = capture.method;
    provenance.surfaces =
        capture.opaque_only ? "opaque" : nameOf<Surfaces>(kSurfaces, capture.surfaces);
    provenance.scene = options_.scene.file.filename().string();
    provenance.scene_hash = hexText(scene().content_hash);
    nlohmann::json more = nlohmann::json::object();
    if (options_.fxaa) more["fxaa"] = true;
    views_.addSettings(view(index), more);
    provenance.settings = job_.settingsText(capture, std::move(more), picture.view.crop,
                                            picture.next ? moment.motion_rate : 0);
    provenance.settings_hash = hashText(provenance.settings);
    if (options_.camera.tile) provenance.tile = options_.camera.tile->text();
    provenance.frame = moment.frame;
    provenance.view = picture.number.view;
    provenance.time = moment.time;
    provenance.frames_per_second = moment.frames_per_second;
    if (std::ranges::find(capture.channels, Channel::kId) != capture.channels.end())
        provenance.ids = idNames(scene());
    return provenance;
}

OutputOptions RenderRequest::writerOptions(const PictureRequest& picture) const {
    OutputOptions output = picture.output.from(picture.provenance);
    output.automatic_exposure = meters_exposure_;
    output.blends_encoded = picture.capture.splat_blending == SplatBlending::kDisplay;
    if (shows_splats_ && !options_.output.isGiven("--tone-map")) output.tone_map = "none";
    return output;
}

std::string RenderRequest::lightText(const PosedScene& posed, bool with_options) const {
    const auto& environment = scene().environment;
    const bool studio = environment && environment->is_studio;
    std::string text = studio ? "studio light" : environment ? "environment light" : "";
    if (!posed.lights().empty())
        text += text.empty() ? "the scene's lights" : ", the scene's lights";
    if (text.empty()) text = "key light";
    if (capture_.shading == Shading::kUnlit || shows_splats_) text = "unlit";
    if (capture_.splat_blending == SplatBlending::kDisplay) text += ", blended in sRGB";
    text +=
        ", " + std::to_string(capture_.samples) + (capture_.samples == 1 ? " sample" : " samples");
    if (!with_options) return text;
    std::string options;
    if (studio && !options_.appearance.environment && capture_.shading != Shading::kUnlit)
        options += " --environment none";
    if (capture_.samples > 1 && !options_.samples_given) options += " --samples 1";
    return text + (options.empty() ? "" : " (as in an EXR:" + options + ')');
}

bool RenderRequest::isUpToDate(const PictureRequest& picture) const {
    const CaptureSettings& capture = picture.capture;
    if (options_.scene.reading.strict && (capture.max_layers != 0 || capture.occlusion_ratio > 0))
        return false;
    if (options_.shards) return options_.shards->isUpToDate(picture);
    const std::string path = picture.output.path.string();
    return outputHashOf(path) == picture.provenance.output_hash &&
           std::ranges::all_of(filesBeside(path, picture.output.options), [](const auto& file) {
               return fileExists(file, ErrorKind::kOutput);
           });
}

bool RenderRequest::exists(const PictureRequest& picture) const {
    return options_.shards ? options_.shards->contains(picture)
                           : fileExists(picture.output.path, ErrorKind::kOutput);
}

std::string RenderRequest::differenceOf(const PictureRequest& picture) const {
    if (options_.shards) return "another scene or other options; a shard does not record which";
    const std::string path = picture.output.path.string();
    const std::string there = outputHashOf(path);
    const bool exr = lowerExtension(path) == ".exr";
    if (there.empty() && exr && hasChanged(path))
        return "the file has changed since it was written";
    if (there.empty()) return "the file is incomplete, or does not record its settings";
    for (const std::string& file : filesBeside(path, picture.output.options))
        if (!fileExists(file, ErrorKind::kOutput)) return file + " is missing";
    if (there == picture.provenance.output_hash) return "--strict counts fragments again";
    std::vector<Difference> found =
        exr ? headerDifferences(picture, writerOptions(picture)) : std::vector<Difference>();
    if (!found.empty()) return differencesText(found);
    return exr ? "other options of the file format"
               : "another scene or other options; this file format does not record which";
}

nlohmann::ordered_json RenderRequest::plan() const {
    nlohmann::ordered_json json;
    json["scene"] = options_.scene.file.string();
    json["pictures"] = nlohmann::ordered_json::array();
    for (std::size_t i = 0; i < pictures(); ++i) {
        const PictureRequest asked = picture(i);
        const Window& crop = asked.view.crop;
        const bool up_to_date = isUpToDate(asked);
        nlohmann::ordered_json entry;
        entry["output"] = outputFile(i).string();
        if (options_.shards) entry["sample"] = SampleShards::key(asked.output.path);
        if (asked.number.frame) entry["frame"] = *asked.number.frame;
        if (asked.number.view) entry["view"] = *asked.number.view;
        entry["time"] = asked.time;
        entry["width"] = asked.view.width;
        entry["height"] = asked.view.height;
        entry["crop"] = {crop.x0, crop.y0, crop.width(), crop.height()};
        entry["camera"] = asked.view.camera_name;
        if (makesSamples()) entry.update(calibrationJson(asked.view));
        entry["method"] = asked.provenance.method;
        entry["samples"] = asked.capture.samples;
        const OutputOptions output = writerOptions(asked);
        if (output.outcome) {  // set only for display pictures
            entry["toneMap"] = output.tone_map;
            entry["exposure"] = meters_exposure_ ? nlohmann::ordered_json()
                                                 : nlohmann::ordered_json(output.exposure);
            entry["exposureAutomatic"] = meters_exposure_;
        }
        entry["settingsHash"] = asked.provenance.settings_hash;
        entry["outputHash"] = asked.provenance.output_hash;
        const bool exists = this->exists(asked);
        entry["exists"] = exists;
        entry["upToDate"] = up_to_date;
        entry["difference"] = exists && !up_to_date ? differenceOf(asked) : "";
        entry["action"] = up_to_date && options_.sequence.skip_existing ? "skip"
                          : exists && options_.output.no_clobber        ? "refuse"
                                                                        : "render";
        json["pictures"].push_back(std::move(entry));
    }
    return json;
}

std::optional<std::size_t> RenderRequest::firstOf(const nlohmann::ordered_json& plan) {
    const auto& pictures = plan.at("pictures");
    for (std::size_t i = 0; i < pictures.size(); ++i)
        if (pictures[i].at("action") == "render") return i;
    return std::nullopt;
}

}  // namespace peeler::cmd
