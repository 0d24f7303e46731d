// SPDX-License-Identifier: Apache-2.0
// peeler masks: full and visible masks of every object, from a single capture per view.
#include <algorithm>
#include <filesystem>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <tuple>
#include <utility>
#include <vector>

#include <peeler/error.h>
#include "cmd/cli/arguments.h"
#include "cmd/cli/errors.h"
#include "cmd/cli/parse.h"
#include "cmd/cli/report.h"
#include "cmd/masks/lens_masks.h"
#include "cmd/masks/mask_pictures.h"
#include "cmd/masks/scene_objects.h"
#include "cmd/options/appearance_options.h"
#include "cmd/options/camera_options.h"
#include "cmd/options/capture_job.h"
#include "cmd/options/capture_options.h"
#include "cmd/options/clip_options.h"
#include "cmd/options/lens_options.h"
#include "cmd/options/many_scenes.h"
#include "cmd/options/output_checks.h"
#include "cmd/options/output_options.h"
#include "cmd/options/sequence_options.h"
#include "cmd/options/view_options.h"
#include "cmd/session/progress_report.h"
#include "cmd/verbs.h"
#include "core/base/parallel.h"
#include "core/base/stage_times.h"
#include "core/image/object_masks.h"
#include "core/lens/picture_rays.h"
#include "formats/file/content_hash.h"
#include "formats/file/json_text.h"
#include "formats/masks/mask_folder.h"
#include "formats/output_hash.h"

namespace peeler::cmd {

namespace {

namespace fs = std::filesystem;

/// Returns a view's camera for the place of a message.
std::string ofCamera(const View& view) {
    return view.camera_name.empty() ? "" : ", camera " + view.camera_name;
}

struct MaskFormatRow {
    std::string_view name;
    bool MaskFormats::*asked;
    std::string_view summary;
};

constexpr MaskFormatRow kMaskFormats[] = {
    {"bop", &MaskFormats::bop,
     "mask/, mask_visib/, scene_gt.json, scene_gt_info.json, scene_camera.json, camera.json"},
    {"coco", &MaskFormats::coco, "coco.json, run lengths of the visible and amodal masks"},
    {"ids", &MaskFormats::ids, "ids/, a 16-bit picture of object numbers for each layer"},
};

struct MasksOptions : CaptureJobOptions {
    std::vector<fs::path> scenes;  ///< files, folders and globs
    CameraOptions camera;
    LensOptions lens;  ///< of `camera`, and of views around the scene
    ViewListOptions views;
    SequenceOptions sequence;
    ClipOptions clip;
    ObjectsRequest objects;
    MaskFormats formats{true, true, true};
    MaskPictureOptions pictures;
    double see_through = 0;
    int canvas = 1;
    fs::path output;
    bool no_clobber = false, no_mkdir = false;
};

/// A run of the verb: masks of all views of a scene.
class Masks {
  public:
    Masks(const MasksOptions& options, Session& session)
        : options_(options),
          reporter_(session.reporter()),
          job_(options, session),
          views_(options.views, options.camera, options.scene.reading.strict, session.reporter()),
          results_(views_.asked() ? "view" : "", session.reporter()),
          capture_(options.capture),
          pictures_(options.pictures, options.capture, job_, views_) {
        capture_.channels = {Channel::kId};
        // Opacity does not depend on light.
        capture_.shading = Shading::kUnlit;
        // In half precision, an alpha of 0.1 would be rounded down.
        if (options.see_through > 0) capture_.color_type = PixelType::kFloat;
    }

    /// Returns the exit code. Sets `result` to the result as JSON, or to null without a result.
    int run(Json& result);

  private:
    /// Hashes of a view's settings, and of everything that determines the view's files.
    struct ViewHashes {
        std::string settings, output;
    };

    void checkOptions();
    void checkOutput(const OpenedScene& scene) const;
    void open();
    void checkLenses();
    void ofViews();
    void ofView(std::size_t view);
    PosedScene poseOf(std::size_t view) const;
    HitSource& sourceFor(const View& seen, const PosedScene& posed);
    Plan capture(std::size_t view, const View& seen, const PosedScene& posed, ObjectMaskSink& sink,
                 int& passes);
    const ViewHashes& hashesOf(std::size_t view);
    Provenance provenanceOf(std::size_t view) const;
    bool writeShared();
    void report(std::size_t view, PictureResult& result, const Json& objects,
                const std::string& counts);

    const MasksOptions& options_;
    Reporter& reporter_;
    CaptureJob job_;
    ViewList views_;
    std::size_t first_ = 0, end_ = 1;  ///< range of the views that this run makes
    SequenceResults results_;
    CaptureSettings capture_;
    MaskPictures pictures_;
    const OpenedScene* scene_ = nullptr;  ///< owned by job_
    HitSource* tracer_ = nullptr;         ///< of views with lenses; owned by job_
    std::vector<View> seen_;
    std::map<std::size_t, ViewHashes> hashes_;  ///< by view index; only of requested views
    SceneObjects objects_;
    std::optional<MaskFolder> folder_;
    std::optional<ProgressReport> progress_;
};

int Masks::run(Json& result) {
    checkOptions();
    int code = 0;
    bool whole = false;
    try {
        open();
        ofViews();
        whole = writeShared();
    } catch (...) {
        if (!views_.asked()) throw;
        code = reportError(reporter_, currentError());
    }
    if (!results_.empty() || code == 0) {
        result = results_.json();
        if (!result.is_null()) {
            result["sharedFiles"] = Json::array();
            if (whole)
                for (const fs::path& file : folder_->sharedFiles())
                    result["sharedFiles"].push_back(file.string());
        }
    }
    results_.reportFailures();
    return std::max(code, results_.worst());
}

void Masks::checkOptions() {
    std::tie(first_, end_) = views_.part(options_.sequence.chunk);
    if (options_.no_mkdir) checkFolderIsThere(options_.output, options_.output);
    checkFolder(options_.output / "objects.json");
    checkReport(options_.report, {options_.scene.file});
    checkClipOptions(options_.clip);
    job_.checkOptions();
}

/// Throws Error if an output would replace an input, the report, or a file that --no-clobber
/// protects.
void Masks::checkOutput(const OpenedScene& scene) const {
    std::vector<fs::path> inputs = scene.scene().files;
    inputs.push_back(options_.scene.file);
    if (options_.views.file) inputs.push_back(*options_.views.file);
    if (options_.report.file) inputs.push_back(*options_.report.file);
    for (const fs::path& input : inputs)
        if (folder_->owns(input))
            refuse("the masks could replace an input or the report", input.string(),
                   "choose another folder");
    job_.checkOutputs({});
    if (!options_.no_clobber || options_.sequence.skip_existing) return;
    for (std::size_t view = first_; view < end_; ++view)
        checkNotThere(folder_->record(view));
}

void Masks::open() {
    scene_ = &job_.openScene();
    views_.place(*scene_);
    for (std::size_t view = 0; view < views_.size(); ++view)
        seen_.push_back(views_.view(*scene_, poseOf(view), view));
    checkLenses();
    objects_ = objectsOf(job_.pose(), options_.objects);
    folder_.emplace(MaskFolderOptions{options_.output, options_.formats, options_.objects.text(),
                                      std::string("peeler ") + PEELER_VERSION},
                    objects_.objects);
    folder_->checkViews(seen_);
    checkOutput(*scene_);
    reporter_.detail("found " + countText(objects_.objects.size(), "object"));
}

/// Throws Error (kUsage) if a view has a lens and the options clip the scene. Warns of lines and
/// points, which rays do not hit.
void Masks::checkLenses() {
    const auto lens =
        std::ranges::find_if(seen_, [](const View& view) { return view.rays != nullptr; });
    if (lens == seen_.end()) return;
    if (options_.clip.volume.active() || !options_.clip.meshes.empty())
        refuse("masks through a lens cannot be clipped",
               "--clip-box, --clip-plane, --clip-mesh" + ofCamera(*lens), "leave them out");
    warnOfThin(job_.pose(), options_.scene, "masks", reporter_);
}

PosedScene Masks::poseOf(std::size_t view) const {
    return views_.pose(*scene_, options_.animation.time.value_or(0), view);
}

void Masks::ofViews() {
    progress_.emplace(reporter_, "masks");
    makeEachView(
        first_, end_, options_.sequence, results_, [this](std::size_t view) { ofView(view); },
        [this](std::size_t) {
            job_.discard();
            tracer_ = nullptr;
            return options_.output;
        });
    progress_->update(1);
    progress_.reset();
}

const Masks::ViewHashes& Masks::hashesOf(std::size_t view) {
    if (const auto found = hashes_.find(view); found != hashes_.end()) return found->second;
    ViewHashes hashes;
    nlohmann::json more = {{"by", options_.objects.text()}};
    if (options_.see_through > 0) more["seeThrough"] = options_.see_through;
    if (options_.canvas > 1) more["canvas"] = options_.canvas;
    views_.addSettings(view, more);
    if (seen_[view].rays) more["rays"] = seen_[view].rays->text();
    CaptureSettings capture = capture_;
    capture.clip = clipVolume(options_.clip, poseOf(view));
    hashes.settings = job_.settingsHash(capture, more, seen_[view].crop);

    const MaskFormats& formats = options_.formats;
    Json kinds = {hashes.settings, formats.bop, formats.coco, formats.ids, "numbers from indices"};
    if (formats.rgb)
        kinds.push_back(pictures_.hash(seen_[view], capture.clip, more, provenanceOf(view)));
    OutputOptions output;
    output.as = "composite";
    output.provenance = provenanceOf(view);
    output.provenance.settings_hash = hashText(dumpJson(kinds));
    hashes.output = outputHash(seen_[view], "masks.png", output);
    return hashes_.emplace(view, std::move(hashes)).first->second;
}

Provenance Masks::provenanceOf(std::size_t view) const {
    Provenance provenance;
    provenance.version = PEELER_VERSION;
    provenance.scene_hash = hexText(scene_->scene().content_hash);
    provenance.time = options_.animation.time.value_or(0);
    provenance.view = static_cast<int>(view);
    return provenance;
}

HitSource& Masks::sourceFor(const View& seen, const PosedScene& posed) {
    if (seen.rays) {
        if (!tracer_ || views_.placesObjects()) tracer_ = &job_.openTracer(posed);
        return *tracer_;
    }
    return job_.openRenderer(posed);
}

Plan Masks::capture(std::size_t view, const View& seen, const PosedScene& posed,
                    ObjectMaskSink& sink, int& passes) {
    HitSource& source = sourceFor(seen, posed);
    CaptureSettings settings = capture_;
    settings.clip = clipVolume(options_.clip, posed);
    std::optional<TranslucentHits> hits;
    if (seen.rays) {
        settings.hit_mode = HitMode::kRefined;
        if (options_.see_through > 0) hits.emplace(posed, seen, sink);
    }
    Sink& used = hits ? static_cast<Sink&>(*hits) : sink;
    const auto done = static_cast<double>(view - first_);
    const Progress progress = [&](double share) {
        progress_->update((done + 0.9 * share) / static_cast<double>(end_ - first_));
    };
    CapturePlan plan = source.plan(seen, settings, progress);
    used.begin(plan);
    passes = source.capture(plan, used, progress).passes;
    used.finish();
    return plan;
}

void Masks::ofView(std::size_t view) {
    PictureResult result;
    const ViewHashes& hashes = hashesOf(view);
    if (options_.sequence.skip_existing) {
        if (const auto bytes = folder_->bytesOf(view, hashes.output)) {
            result.skipped = true;
            result.bytes = *bytes;
            return report(view, result, {}, "");
        }
    }
    ObjectMaskOptions masks;
    const View canvas = canvasOf(seen_[view], options_.canvas, masks.picture);
    masks.see_through = static_cast<float>(options_.see_through);
    masks.layers = options_.formats.ids;
    // Each thread writes one picture at a time, and needs memory for the picture's pixels and for
    // the encoder.
    constexpr std::uint64_t kEncoderBytes = std::uint64_t{24} << 20;
    const std::uint64_t pixels = seen_[view].crop.pixels();
    masks.more_bytes =
        static_cast<std::uint64_t>(threadCount()) *
        (2 * pixels + std::min(8 * pixels, kEncoderBytes) + (std::uint64_t{2} << 20));
    ObjectMaskSink sink(objects_.table, masks);
    const PosedScene posed = poseOf(view);
    const Plan plan = capture(view, canvas, posed, sink, result.passes);
    add(job_.times(), sink.times());
    {
        const StageTimer timer(job_.times(), "write");
        const std::vector<glm::dmat4> places = placesOf(posed, objects_);
        const auto write_rgb = [&](const fs::path& path) {
            Provenance provenance = provenanceOf(view);
            provenance.output_hash = hashes.output;
            pictures_.write(seen_[view], posed, clipVolume(options_.clip, posed), provenance, path,
                            result);
        };
        result.bytes = folder_->write(
            {view, seen_[view], hashes.output, sink.objects(), places, sink.layers(), write_rgb});
    }
    Provenance provenance;
    provenance.method = capture_.method;
    provenance.settings_hash = hashes.settings;
    describePicture(plan, provenance, result);
    result.normalized = scene_->normalized();
    result.width = seen_[view].crop.width();
    result.height = seen_[view].crop.height();

    Json objects = Json::array();
    std::size_t there = 0, visible = 0;
    const auto box = [](const Window& window) -> Json {
        if (window.empty()) return nullptr;
        return {window.x0, window.y0, window.width(), window.height()};
    };
    for (std::size_t i = 0; i < sink.objects().size(); ++i) {
        const ObjectMasks& of = sink.objects()[i];
        if (of.canvas_pixels == 0) continue;
        ++there;
        if (of.visible.count() > 0) ++visible;
        objects.push_back({{"object", objects_.objects[i].number},
                           {"name", objects_.objects[i].name},
                           {"canvasPixels", of.canvas_pixels},
                           {"amodalPixels", of.amodal.count()},
                           {"visiblePixels", of.visible.count()},
                           {"visibleFraction", of.visibleFraction()},
                           {"amodalBox", box(of.canvas_box)},
                           {"visibleBox", box(of.visible.box())}});
    }
    report(view, result, objects,
           countText(there, "object") + ", " + groupedText(visible) + " seen");
}

/// Writes the files shared by all views if every view is finished and up to date. Otherwise reports
/// the missing views and returns false.
bool Masks::writeShared() {
    std::size_t missing = 0;
    for (std::size_t view = 0; view < views_.size(); ++view)
        if (!folder_->bytesOf(view, hashesOf(view).output)) ++missing;
    if (missing == 0) {
        folder_->writeShared(views_.size());
        return true;
    }
    reporter_.note(
        countText(missing, "view") + " of " + groupedText(views_.size()) +
        " still missing; the JSON files that all views share are written with the last view");
    return false;
}

void Masks::report(std::size_t view, PictureResult& result, const Json& objects,
                   const std::string& counts) {
    job_.finish(result);
    result.output = options_.output;
    const std::string of = views_.asked() ? "view " + std::to_string(view) + ": " : "";
    if (views_.asked()) {
        result.view = static_cast<int>(view);
        result.camera = views_.name(view);
    }
    if (view + 1 == end_) progress_->update(1);  // before the last result is reported
    const std::string line = options_.output.string() + ": " + of;
    if (result.skipped) return results_.add(toJson(result), line + "skipped, already complete");
    if (results_.empty()) noteDisplay(result, reporter_);
    Json found = findingsOf(result);
    found["objects"] = objects;
    results_.add(toJson(result, found), line + counts + ", " + countText(result.layers, "layer") +
                                            ", " + bytesText(result.bytes) + ", " +
                                            totalText(result.milliseconds));
}

int reportMasks(const MasksOptions& options, const Json& result, Reporter& reporter) {
    if (result.is_null()) return 0;
    return runReported(reporter, [&] {
        reportResult(options.report, result, {}, reporter);
        return 0;
    });
}

int masksOfOne(MasksOptions& options, Session& session) {
    options.scene.file = options.scenes.front();
    options.output = namedAfter(options.scene.file, options.output);
    Json result;
    const int code = Masks(options, session).run(result);
    return std::max(code, reportMasks(options, result, session.reporter()));
}

/// Makes a folder of masks for each scene. Reports {"scenes": [one result per scene]} with a list
/// "failed" if any scene failed.
int masksOfEach(const MasksOptions& options, Session& session) {
    Reporter& reporter = session.reporter();
    options.report.applyTo(reporter);
    const std::vector<fs::path> scenes = listScenes(options.scenes);
    SceneOutputs outputs;
    for (const fs::path& scene : scenes)
        outputs.take(namedAfter(scene, options.output), scene,
                     "--output " + options.output.string());
    Json results;
    int worst = makeEachScene(scenes, options.sequence.keep_going, reporter, results,
                              [&](std::size_t i, Json& result) {
                                  MasksOptions one = options;
                                  one.scene.file = scenes[i];
                                  one.output = namedAfter(scenes[i], options.output);
                                  one.report.json = false;
                                  one.report.file.reset();
                                  return Masks(one, session).run(result);
                              });
    worst = std::max(worst, reportMasks(options, results, reporter));
    reportFailedScenes(results, scenes.size(), reporter);
    return worst;
}

MaskFormats parseFormats(const std::string& text) {
    std::vector<std::string_view> names;
    for (const MaskFormatRow& row : kMaskFormats)
        names.push_back(row.name);
    MaskFormats formats;
    for (const std::string_view name : listedNames("kind of masks", text, names))
        for (const MaskFormatRow& row : kMaskFormats)
            if (row.name == name) formats.*row.asked = true;
    return formats;
}

int parseCanvas(const std::string& text) {
    const auto times = static_cast<int>(parseInteger(text, 1, 9));
    if (times % 2 == 0)
        throw Error(ErrorKind::kUsage,
                    "expected an odd number, so that the picture is in the middle");
    return times;
}

double parseOpacity(const std::string& text) {
    const double opacity = parseNumber(text);
    if (opacity < 0 || opacity > 1) throw Error(ErrorKind::kUsage, "expected a number from 0 to 1");
    return opacity;
}

void addMaskOptions(VerbOptions& verb, MasksOptions& options) {
    addFile(verb, "-o,--output", "FOLDER", options.output,
            "folder to write into; it may also contain other files, such as pictures of a render")
        .group("Output")
        .required();
    addValue(verb, "--as", "NAMES", options.formats, parseFormats,
             "formats to write, separated by commas (default: all):")
        .someOf(describeChoices(kMaskFormats))
        .group("Output");
    verb.addFlag("--no-clobber", options.no_clobber, "fail if a view exists").group("Output");
    verb.addFlag("--no-mkdir", options.no_mkdir,
                 "fail if the folder is missing (default: create it)")
        .group("Output");
    addObjectsOption(verb, options.objects);
    addValue(
        verb, "--see-through", "A", options.see_through, parseOpacity,
        "minimum opacity at which a fragment hides the objects behind it; a pixel belongs to the "
        "object of its nearest hiding fragment or, if no fragment hides, of its nearest "
        "fragment; 0: all fragments hide, 1: only opaque fragments hide (default: 0)")
        .group("Objects");
    addValue(verb, "--canvas", "K", options.canvas, parseCanvas,
             "capture a canvas around the picture, K times as wide and high, so that counts, "
             "fractions and amodal boxes include objects outside the picture; K is odd, 1 to 9; "
             "BOP uses 3 (default: 1)")
        .group("Objects");
}

constexpr const char* kMasksFooter =
    "The amodal mask of an object covers all pixels in which it has a fragment, hidden or\n"
    "not. The visible mask covers the pixels that belong to the object (see --see-through).\n"
    "Visible masks do not overlap; all other pixels are background or empty. The visible\n"
    "fraction is the visible area in the picture, divided by the area of the silhouette on\n"
    "the canvas. Objects without a pixel on a view's canvas are not listed for this view.\n"
    "Each view's record views/NNNNNN.json is written last; --skip-existing looks for it. The\n"
    "--chunk that completes the last view writes the JSON files that all views share, such as\n"
    "scene_gt.json and coco.json.";

}  // namespace

VerbAction declareMasks(VerbOptions& verb) {
    const auto options = std::make_shared<MasksOptions>();
    verb.addFiles("SCENE", options->scenes,
                  "scenes (glTF, PLY, STL, OBJ, 3MF, SPZ, .splat), folders of scenes, or globs in "
                  "quotes; in the "
                  "name of the output folder, {stem} stands for the scene's name, {folder} for the "
                  "name of the scene's folder")
        .files(sceneExtensions());
    addMaskOptions(verb, *options);
    addMaskPictureOptions(verb, options->pictures, *options);
    addShownOptions(verb, *options);
    addVariantOption(verb, options->appearance);
    addNormalizeOption(verb, options->scene);
    addCameraOptions(verb, options->camera, &options->scene.reading, true);
    addLensOptions(verb, options->lens);
    addViewOptions(verb, options->views);
    options->views.lenses = true;
    addSequenceOptions(verb, options->sequence);
    addAllLayersOptions(verb, options->capture);
    addClipOptions(verb, options->clip);
    addRunOptions(verb, *options);
    verb.option("--cameras")
        .description(
            "render a view for each camera of a file: transforms.json, BOP's scene_camera.json, a "
            "COLMAP model, .npy, .npz or .jsonl");
    verb.footer(kMasksFooter);
    return [options, verb](Session& session) {
        takeLens(options->lens, options->camera);
        checkMaskPictureOptions(verb, options->pictures);
        options->formats.rgb = options->pictures.asked;
        if (options->formats.rgb) chooseStudio(options->camera, *options);
        setShadowSize(options->capture, options->pictures.shadow_size);
        return isOneScene(options->scenes) ? masksOfOne(*options, session)
                                           : masksOfEach(*options, session);
    };
}

}  // namespace peeler::cmd
