// SPDX-License-Identifier: Apache-2.0
// peeler sheet: the composite and the layers of a picture, side by side with labels.
#include <algorithm>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>
#include <tuple>
#include <vector>

#include <peeler/error.h>
#include "cmd/cli/arguments.h"
#include "cmd/cli/errors.h"
#include "cmd/cli/parse.h"
#include "cmd/cli/report.h"
#include "cmd/options/appearance_options.h"
#include "cmd/options/clip_options.h"
#include "cmd/options/output_checks.h"
#include "cmd/options/output_options.h"
#include "cmd/sheet/sheet_cells.h"
#include "cmd/sheet/sheet_layout.h"
#include "cmd/sheet/sheet_sources.h"
#include "cmd/verbs.h"
#include "core/base/stage_times.h"
#include "formats/file/content_hash.h"
#include "formats/file/file_name.h"
#include "formats/file/json_text.h"
#include "formats/layered/opened_picture.h"
#include "formats/output_hash.h"
#include "formats/writers.h"

namespace peeler::cmd {

namespace {

namespace fs = std::filesystem;

constexpr Choice<SheetShow> kShows[] = {
    {"color", SheetShow::kColor, "the composite, and the colour of every layer"},
    {"depth", SheetShow::kDepth, "the depth of every layer, near = white"},
};

constexpr Choice<SheetMethods> kMethodChoices[] = {
    {"unsorted", SheetMethods::kUnsorted, "plain blending in draw order, next to the composite"},
    {"all", SheetMethods::kAll,
     "the composite of every method instead of the layers, with its geometry passes and its error "
     "against the first"},
    {"none", SheetMethods::kNone, "only the layers"},
};

struct SheetOptions {
    SheetRequest request;
    std::optional<int> shadow_size;
    int columns = 0;  ///< 0 = chosen for a nearly square page
    OutputRequest output;
    std::set<std::string> given;  ///< the given options that apply only to scenes
};

constexpr const char* kOutputHelp = "the file to write: .png, .jpg, .jpeg, .tif, .tiff";

/// A run of the verb: makes the sheet of a picture file, or of each view of a scene.
class Sheets {
  public:
    Sheets(const SheetOptions& options, Session& session)
        : options_(options),
          request_(options.request),
          reporter_(session.reporter()),
          job_(options.request, session),
          views_(request_.views, request_.camera, request_.scene.reading.strict,
                 session.reporter()),
          results_(views_.asked() ? "view" : "", session.reporter()) {}

    int run();

  private:
    void checkOptions();
    void checkFiles() const;
    void ofFile();
    void ofScene();
    void ofView(SceneSheet& sheet, const OpenedScene& scene, std::size_t view);
    void refuseSceneOptions() const;
    std::vector<fs::path> outputs() const;
    fs::path outputOf(std::size_t view) const;
    std::string hashOf(const SceneSheet& sheet, const OpenedScene& scene, std::size_t view) const;
    void writeSheet(SheetContent& content, const fs::path& path, const std::string& hash) const;
    void report(SheetContent& content, std::size_t view);

    const SheetOptions& options_;
    const SheetRequest& request_;
    Reporter& reporter_;
    CaptureJob job_;
    ViewList views_;
    std::size_t first_ = 0, end_ = 1;  ///< range of the views that this run makes
    SequenceResults results_;
};

int Sheets::run() {
    checkOptions();
    int code = 0;
    try {
        if (isPictureFile(request_.scene.file.string())) {
            refuseSceneOptions();
            ofFile();
        } else if (sceneFormatOf(request_.scene.file)) {
            ofScene();
        } else {
            throw Error(
                ErrorKind::kInput, "neither a scene nor a layered depth image",
                request_.scene.file.string(),
                "give a glTF, PLY, STL, OBJ, 3MF, SPZ or .splat file, or an .exr of peeler render");
        }
    } catch (...) {
        if (!views_.asked()) throw;
        code = reportError(reporter_, currentError());
    }
    if (!results_.empty() || code == 0)
        reportResult(request_.report, results_.json(), {}, reporter_);
    results_.reportFailures();
    return std::max(code, results_.worst());
}

void Sheets::checkOptions() {
    const SheetRequest& request = request_;
    std::tie(first_, end_) = views_.part(request.sequence.chunk);
    views_.checkName(options_.output.path);
    checkFiles();
    const OutputFormat& format = findOutputFormat(options_.output.path.string(), "composite");
    if (!format.for_display) {
        throw Error(ErrorKind::kUsage, "a sheet needs a display format",
                    options_.output.path.string(), "choose one of: .png, .jpg, .tif");
    }
    const bool depth = request.cells.show == SheetShow::kDepth;
    if (request.cells.progression && depth) {
        throw Error(ErrorKind::kUsage, "a composite has no depth", "--progression, --show depth",
                    "leave one of them out");
    }
    if (request.capture.tail == Tail::kBlend) {
        throw Error(ErrorKind::kUsage, "a sheet shows layers without blending", "--tail blend",
                    "leave it out, or render a composite with it");
    }
    if (request.methods == SheetMethods::kAll &&
        (request.cells.progression || depth || request.capture.max_layers != 0 ||
         request.capture.occlusion_ratio > 0)) {
        throw Error(ErrorKind::kUsage, "methods are compared by the composites of all layers",
                    "--methods all",
                    "leave out --progression, --show depth, --layers and --occlusion-ratio");
    }
    if (request.against && (request.cells.progression || depth || request.capture.max_layers != 0))
        throw Error(ErrorKind::kUsage, "a comparison shows whole composites", "--against",
                    "leave out --progression, --show depth and --layers");
    checkClipOptions(request.clip);
    job_.checkOptions();
}

void Sheets::checkFiles() const {
    checkFormat(options_.output);
    std::vector<fs::path> inputs{request_.scene.file};
    if (const auto file = environmentFile(request_.appearance)) inputs.push_back(*file);
    if (request_.views.file) inputs.push_back(*request_.views.file);
    if (request_.against) inputs.push_back(*request_.against);
    std::vector<fs::path> others = outputs();
    checkTargets(options_.output, others, request_.sequence, inputs);
    others.insert(others.end(), inputs.begin(), inputs.end());
    checkReport(request_.report, others);
}

std::vector<fs::path> Sheets::outputs() const {
    std::vector<fs::path> files;
    for (std::size_t view = first_; view < end_; ++view)
        files.push_back(outputOf(view));
    return files;
}

fs::path Sheets::outputOf(std::size_t view) const {
    const fs::path& path = options_.output.path;
    return views_.asked() ? fs::path(viewPath(path.string(), static_cast<int>(view))) : path;
}

void Sheets::ofFile() {
    SheetContent content = sheetOfFile(request_, job_, reporter_);
    writeSheet(content, options_.output.path, "");
    report(content, 0);
}

void Sheets::ofScene() {
    refusePictureChoice(request_.file);
    if (request_.against)
        throw Error(ErrorKind::kUsage, "a scene has no original", "--against",
                    "leave it out, or make the sheet of a thinned file");
    const OpenedScene& scene = job_.openScene();
    job_.checkOutputs(outputs());
    views_.place(scene);
    SceneSheet sheet(request_, job_, scene, views_, reporter_);
    makeEachView(
        first_, end_, request_.sequence, results_,
        [&](std::size_t view) { ofView(sheet, scene, view); },
        [&](std::size_t view) {
            job_.discard();
            return outputOf(view);
        });
}

void Sheets::ofView(SceneSheet& sheet, const OpenedScene& scene, std::size_t view) {
    if (view != first_) job_.restartClock();
    const fs::path path = outputOf(view);
    const std::string hash = hashOf(sheet, scene, view);
    if (request_.sequence.skip_existing && outputHashOf(path.string()) == hash) {
        SheetContent there;
        there.result.skipped = true;
        return report(there, view);
    }
    if (options_.output.no_clobber) checkNotThere(path);
    SheetContent content = sheet.make(view);
    // A file without --views gets no hash.
    writeSheet(content, path, views_.asked() ? hash : "");
    report(content, view);
}

/// Returns the hash of everything that determines the sheet of a view.
std::string Sheets::hashOf(const SceneSheet& sheet, const OpenedScene& scene,
                           std::size_t view) const {
    const double time = request_.animation.time.value_or(0);
    const SheetSettings& cells = request_.cells;
    const Json settings = {sheet.settingsHash(view), cells.show,       cells.progression,
                           cells.most_cells,         cells.cell_width, options_.columns,
                           request_.methods};
    OutputOptions output = options_.output.options;
    output.automatic_exposure = cells.meters;
    output.provenance.scene_hash = hexText(scene.scene().content_hash);
    output.provenance.settings_hash = hashText(dumpJson(settings));
    output.provenance.time = time;
    return outputHash(sheet.view(view), options_.output.path.string(), output);
}

void Sheets::refuseSceneOptions() const {
    if (options_.given.empty()) return;
    throw Error(ErrorKind::kUsage, "the option is for scenes, but the input is an image",
                *options_.given.begin(), "leave it out, or make the sheet of the scene");
}

void Sheets::writeSheet(SheetContent& content, const fs::path& path,
                        const std::string& hash) const {
    SheetStyle style;
    style.columns = options_.columns;
    const OutputOptions& asked = options_.output.options;
    if (options_.output.isGiven("--background")) style.background = asked.background;
    // Depths are grey, so the background is coloured.
    constexpr std::array<float, 4> kBehindDepth{0.42F, 0.55F, 0.74F, 1};
    const bool depth = request_.cells.show == SheetShow::kDepth;
    if (depth && !style.background) style.background = kBehindDepth;
    style.exposure = content.exposure.value_or(asked.exposure);
    if (options_.output.isGiven("--tone-map"))
        style.tone_map = asked.tone_map;
    else if (!depth)  // depths are not tone-mapped
        style.tone_map = toneMaps().front().name;
    content.result.display = {style.tone_map, style.exposure, content.exposure.has_value(), 0};
    const CompositeImage page = layOut(content.cells, style);
    content.result.width = page.window.width();
    content.result.height = page.window.height();
    const StageTimer timer(content.result.milliseconds, "encode");
    OutputOptions output;  // exposure and tone map are already applied to the page
    output.provenance.version = PEELER_VERSION;
    output.provenance.output_hash = hash;
    writePicture(path.string(), page, output);
}

void Sheets::report(SheetContent& content, std::size_t view) {
    job_.finish(content.result);
    content.result.setFile(outputOf(view));
    if (views_.asked()) {
        content.result.view = static_cast<int>(view);
        content.result.camera = views_.name(view);
    }
    if (content.result.skipped)
        return results_.add(toJson(content.result), summary(content.result));
    noteDisplay(content.result, reporter_);
    Json found = findingsOf(content.result);
    found["cells"] = Json::array();
    for (const SheetCell& cell : content.cells) {
        Json entry = {{"label", cell.label}, {"detail", cell.detail}};
        if (cell.has_error) {
            entry["max"] = cell.error.largest;
            entry["rmse"] = cell.error.rmse();
        }
        if (cell.passes != 0) entry["passes"] = cell.passes;
        found["cells"].push_back(entry);
    }
    found["cellsOmitted"] = content.omitted;
    if (content.omitted != 0) {
        reporter_.note(countText(content.omitted, "cell") + " of " +
                       std::to_string(content.omitted + content.cells.size()) +
                       " left out; --cells " +
                       std::to_string(content.omitted + content.cells.size()) + " shows all");
    }
    results_.add(toJson(content.result, found), summary(content.result));
}

void addCellOptions(VerbOptions& verb, SheetOptions& options) {
    constexpr const char* kGroup = "Cells";
    const auto within = [](int least, int most) {
        return [least, most](const std::string& text) {
            return static_cast<int>(parseInteger(text, least, most));
        };
    };
    addChoice<SheetShow>(verb, "--show", options.request.cells.show, kShows, "content",
                         "content of the cells:")
        .group(kGroup);
    verb.addFlag("--progression", options.request.cells.progression,
                 "show composites of the nearest 1, 2, … layers instead of the layers, each with "
                 "its error against the composite of all")
        .group(kGroup);
    addChoice<SheetMethods>(verb, "--methods", options.request.methods, kMethodChoices,
                            "choice of methods",
                            "composites of peeling methods to show, for scenes only:")
        .group(kGroup);
    addFile(verb, "--against", "ORIGINAL", options.request.against,
            "the file that IN was thinned from (--deep-error): show both composites, and the "
            "transmittance over depth of the pixel that differs most, instead of the layers")
        .files(".exr .safetensors")
        .group(kGroup);
    addValue(verb, "--cells", "N", options.request.cells.most_cells, within(1, 1000),
             "maximum number of cells; the rest are left out (default: 24)")
        .group(kGroup);
    addValue(verb, "--columns", "N", options.columns, within(1, 1000),
             "number of cells per row (default: nearly square sheet)")
        .group(kGroup);
    addValue(verb, "--cell-width", "PIXELS", options.request.cells.cell_width, within(16, 8192),
             "width of a cell, at most the picture's width (default: 320)")
        .group(kGroup);
}

/// Returns the options on the command line that apply only to scenes.
std::set<std::string> sceneOptionsGiven(const VerbOptions& verb) {
    const std::set<std::string> groups{"Scene",  "Animation", "Camera", "Views",  "Picture",
                                       "Layers", "Clipping",  "Light",  "Machine"};
    const std::set<std::string> everywhere{"--layers", "--threads"};
    std::set<std::string> given;
    for (const Option& option : verb.given()) {
        const std::string name = option.name();
        const bool for_scenes = name == "--methods" || name == "--chunk" ||
                                name == "--skip-existing" || name == "--keep-going" ||
                                (groups.contains(option.group()) && !everywhere.contains(name));
        if (for_scenes) given.insert(name);
    }
    return given;
}

constexpr const char* kSheetFooter =
    "Options for scene, camera, clipping, light and machine, and those for layers except\n"
    "--layers, apply to scenes only; a sheet of a layered file shows the file's content.\n"
    "Errors are measured in linear premultiplied R, G, B and A against the composite of all\n"
    "layers. A file has no draw order, so unsorted blending is shown only for scenes (without\n"
    "Gaussian splats), next to the composite of all layers.";

}  // namespace

VerbAction declareSheet(VerbOptions& verb) {
    const auto options = std::make_shared<SheetOptions>();
    options->output.options.as = "composite";
    addFile(verb, "IN", "", options->request.scene.file,
            "a layered or deep image (.exr, .safetensors) or a scene: glTF (.gltf, .glb), PLY, "
            "STL, OBJ, 3MF, SPZ, .splat, or arrays in .npz or .safetensors")
        .files(".exr " + sceneExtensions())
        .required();
    addOutputOptions(verb, options->output);
    verb.option("--output").description(kOutputHelp);
    verb.option("--background")
        .description(
            "background of every cell: transparent (shown as a checkerboard), a basic colour of "
            "CSS "
            "such as white, #rrggbb[aa] or #rgb[a] in sRGB, or r,g,b[,a] in linear light (default: "
            "transparent)");
    addCellOptions(verb, *options);
    addShownOptions(verb, options->request);
    addNormalizeOption(verb, options->request.scene);
    addCameraOptions(verb, options->request.camera, &options->request.scene.reading);
    addViewOptions(verb, options->request.views);
    addSequenceOptions(verb, options->request.sequence);
    addLayerOptions(verb, options->request.capture);
    addClipOptions(verb, options->request.clip);
    addLightOptions(verb, options->request.capture, options->shadow_size);
    addAppearanceOptions(verb, options->request.appearance);
    addRunOptions(verb, options->request);
    addLayeredOptions(verb, options->request.file);
    verb.footer(kSheetFooter);
    return [options, verb](Session& session) {
        options->given = sceneOptionsGiven(verb);
        options->request.file.strict = options->request.scene.reading.strict;
        options->request.file.pixels_only = true;
        options->request.cells.meters = options->request.cells.show == SheetShow::kColor &&
                                        !options->output.isGiven("--exposure");
        chooseForEyes(verb, options->request.camera, options->request);
        setShadowSize(options->request.capture, options->shadow_size);
        return Sheets(*options, session).run();
    };
}

}  // namespace peeler::cmd
