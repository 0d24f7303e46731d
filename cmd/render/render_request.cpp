// SPDX-License-Identifier: Apache-2.0
#include "cmd/render/render_request.h"

#include <algorithm>
#include <nlohmann/json.hpp>
#include <utility>

#include "core/base/error.h"
#include "formats/file/content_hash.h"
#include "formats/file/file_name.h"
#include "formats/output_hash.h"

namespace peeler::cmd {

namespace fs = std::filesystem;

RenderRequest::RenderRequest(const RenderOptions& options, CaptureJob& job)
    : options_(options), job_(job) {
    checkCameraOptions(options.camera);
    job.checkOptions();
    const std::string path = options.output.path.string();
    const std::size_t frames = isSequence() ? options.animation.frames->size() : 1;
    if (frames > 1 && !hasFrameToken(path)) {
        throw Error(ErrorKind::kUsage,
                    "all " + std::to_string(frames) + " frames would have the same name",
                    "--output " + path,
                    "put #### or %04d into the file's name, where the frame's number goes");
    }
    moments_ = momentsOf(options.animation);
    checkFiles();
    capture_ = captureSettings(options);
    checkClipOptions(options.clip);
    scene_ = &job.openScene();
    job.checkOutputs(outputs());
}

void RenderRequest::checkFiles() const {
    checkFormat(options_.output);
    std::vector<fs::path> inputs{options_.scene.file};
    if (const auto file = environmentFile(options_.appearance)) inputs.push_back(*file);
    std::vector<fs::path> others = inputs;
    for (std::size_t i = 0; i < moments_.size(); ++i) {
        OutputRequest output = outputOf(i);
        // A file that is there may be the one that is wanted, or no reason to stop.
        const SequenceOptions& sequence = options_.sequence;
        if (sequence.skip_existing || sequence.keep_going || sequence.dry_run)
            output.no_clobber = false;
        checkTarget(output, inputs);
        // Whether the folder takes files is better known before any work.
        if (i == 0 && !sequence.keep_going && !sequence.dry_run) checkFolder(output.path);
        others.push_back(output.path);
    }
    if (options_.sequence.dry_run) return;  // the rest tries to write
    if (options_.channels.manifest) {
        const std::string manifest = options_.channels.manifest->string();
        if (isSequence() && hasFrameToken(manifest)) {
            throw Error(ErrorKind::kUsage, "one manifest serves all frames",
                        "--manifest " + manifest, "give it a name without a frame number");
        }
        checkExtraFile(manifest, others, "the manifest", "--manifest");
        if (options_.output.no_clobber) checkNotThere(manifest);
        others.push_back(*options_.channels.manifest);
    }
    checkReport(options_.report, others);
}

/// Everything that is written but the report.
std::vector<fs::path> RenderRequest::outputs() const {
    std::vector<fs::path> files;
    for (std::size_t i = 0; i < moments_.size(); ++i)
        files.push_back(outputFile(i));
    if (options_.channels.manifest) files.push_back(*options_.channels.manifest);
    return files;
}

std::optional<int> RenderRequest::frame(std::size_t index) const {
    return isSequence() ? std::optional(moments_[index].frame) : std::nullopt;
}

/// A lone picture keeps the name it is given, whatever is in it.
OutputRequest RenderRequest::outputOf(std::size_t index) const {
    OutputRequest output = options_.output;
    if (isSequence()) output.path = framePath(output.path.string(), moments_[index].frame);
    return output;
}

PictureRequest RenderRequest::picture(std::size_t index) const {
    const Moment& moment = moments_[index];
    PictureRequest picture;
    picture.index = index;
    picture.frame = frame(index);
    picture.time = moment.time;
    picture.output = outputOf(index);
    picture.posed = scene_->at(moment.time);
    picture.view = scene_->view(*picture.posed, options_.camera);
    picture.capture = capture_;
    picture.capture.clip = clipVolume(options_.clip, *picture.posed);
    if (options_.channels.wants(Channel::kMotion)) {
        const PosedScene next = scene_->at(moment.next_time);
        picture.next = NextFrame{next, scene_->view(next, options_.camera)};
    }
    picture.provenance = provenanceOf(index, picture);
    picture.provenance.output_hash =
        outputHash(picture.view, picture.output.path.string(), writerOptions(picture));
    return picture;
}

Provenance RenderRequest::provenanceOf(std::size_t index, const PictureRequest& picture) const {
    const Moment& moment = moments_[index];
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
    provenance.settings_hash = job_.settingsHash(capture, std::move(more), picture.view.crop,
                                                 picture.next ? moment.motion_rate : 0);
    if (options_.camera.tile) provenance.tile = options_.camera.tile->text();
    provenance.frame = moment.frame;
    provenance.time = moment.time;
    provenance.frames_per_second = moment.frames_per_second;
    if (std::ranges::find(capture.channels, Channel::kId) != capture.channels.end())
        provenance.ids = idNames(scene());
    return provenance;
}

OutputOptions RenderRequest::writerOptions(const PictureRequest& picture) const {
    OutputOptions output = picture.output.from(picture.provenance);
    output.cryptomatte = options_.channels.cryptomatte;
    return output;
}

bool RenderRequest::isUpToDate(const PictureRequest& picture) const {
    const CaptureSettings& capture = picture.capture;
    if (options_.strict && (capture.max_layers != 0 || capture.occlusion_ratio > 0)) return false;
    return outputHashOf(picture.output.path.string()) == picture.provenance.output_hash;
}

nlohmann::ordered_json RenderRequest::plan() const {
    nlohmann::ordered_json json;
    json["scene"] = options_.scene.file.string();
    json["pictures"] = nlohmann::ordered_json::array();
    for (std::size_t i = 0; i < moments_.size(); ++i) {
        const PictureRequest asked = picture(i);
        const Window& crop = asked.view.crop;
        const bool up_to_date = isUpToDate(asked);
        nlohmann::ordered_json entry;
        entry["output"] = asked.output.path.string();
        if (asked.frame) entry["frame"] = *asked.frame;
        entry["time"] = asked.time;
        entry["width"] = asked.view.width;
        entry["height"] = asked.view.height;
        entry["crop"] = {crop.x0, crop.y0, crop.width(), crop.height()};
        entry["camera"] = asked.view.camera_name;
        entry["method"] = asked.provenance.method;
        entry["settingsHash"] = asked.provenance.settings_hash;
        entry["outputHash"] = asked.provenance.output_hash;
        const bool exists = fs::exists(asked.output.path);
        entry["exists"] = exists;
        entry["upToDate"] = up_to_date;
        entry["action"] = up_to_date && options_.sequence.skip_existing ? "skip"
                          : exists && options_.output.no_clobber        ? "refuse"
                                                                        : "render";
        json["pictures"].push_back(std::move(entry));
    }
    return json;
}

}  // namespace peeler::cmd
