// SPDX-License-Identifier: Apache-2.0
// peeler sheet: the composite and the layers of a picture side by side, labelled.
#include <algorithm>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>
#include <vector>

#include "cmd/camera_options.h"
#include "cmd/capture_options.h"
#include "cmd/options.h"
#include "cmd/output_options.h"
#include "cmd/parse.h"
#include "cmd/progress.h"
#include "cmd/report.h"
#include "cmd/resources.h"
#include "cmd/sheet_cells.h"
#include "cmd/sheet_layout.h"
#include "cmd/verbs.h"
#include "core/error.h"
#include "core/nearest.h"
#include "core/renderer.h"
#include "formats/exr_ldi_reader.h"
#include "formats/file_kind.h"
#include "formats/gltf_reader.h"
#include "formats/picture_file.h"

namespace peeler::cmd {

namespace {

namespace fs = std::filesystem;

constexpr std::uint64_t kBandBytes = std::uint64_t{256} << 20;

constexpr Choice<SheetShow> kShows[] = {
    {"color", SheetShow::kColor, "the composite, and the colour of every layer"},
    {"depth", SheetShow::kDepth, "the depth of every layer, near = white"},
};

struct SheetOptions {
    fs::path input;
    CameraOptions camera;
    CaptureSettings capture;
    gl::ContextRequest device;
    int threads = 0;
    SheetSettings cells;
    int columns = 0;  ///< 0 = near-square
    OutputFlags output;
    ReportFlags report;
    std::set<std::string> given;  ///< options for scenes that are on the command line
};

constexpr const char* kOutputHelp = "the file to write: .png, .jpg, .jpeg, .tif, .tiff";

/// One sheet. run() lists its stages.
class Sheet {
  public:
    Sheet(const SheetOptions& options, Console& console)
        : options_(options), console_(console), cells_(options.cells) {}

    void run() {
        {
            const StageTimer timer(result_.milliseconds, "total");
            checkOptions();
            makeCells();
            writeSheet();
        }
        tell();
    }

  private:
    void checkOptions();
    void makeCells();
    void captureScene();
    void readLayers();
    void writeSheet();
    void tell();

    const SheetOptions& options_;
    Console& console_;
    SheetCells cells_;
    PictureResult result_;
};

void Sheet::checkOptions() {
    console_.setQuiet(options_.report.quiet);
    checkOutput(options_.output, options_.input);
    const OutputFormat& format = findOutputFormat(options_.output.path.string(), "composite");
    if (format.extensions.front() == ".exr") {
        throw Error(ErrorKind::kUsage, "a sheet is a picture to look at",
                    options_.output.path.string(), "choose one of: .png, .jpg, .tif");
    }
    checkReport(options_.report, options_.input, options_.output.path);
    if (options_.cells.progression && options_.cells.show == SheetShow::kDepth) {
        throw Error(ErrorKind::kUsage, "a composite has no depth of its own",
                    "--progression, --show depth", "leave one of them out");
    }
    checkCameraOptions(options_.camera);
    setThreads(options_.threads);
}

void Sheet::makeCells() {
    const FileKind kind = fileKind(options_.input.string());
    if (kind == FileKind::kGltf) return captureScene();
    if (kind == FileKind::kExr) return readLayers();
    throw Error(ErrorKind::kInput, "neither a glTF scene nor a layered depth image",
                options_.input.string(), "sheet shows .gltf, .glb and the .exr of peeler render");
}

void Sheet::captureScene() {
    Scene scene;
    int scene_index = 0;
    {
        const StageTimer timer(result_.milliseconds, "load");
        scene = readGltf(options_.input, {});
        for (const std::string& warning : scene.warnings)
            console_.warning(warning);
        scene_index = chooseScene(scene, options_.camera);
    }
    const SceneContents shown = contents(scene, scene_index);
    const View view = makeView(scene, shown, options_.camera);
    std::unique_ptr<gl::Context> context;
    {
        const StageTimer timer(result_.milliseconds, "context");
        context = openContext(options_.device, console_);
    }
    Renderer renderer(*context, scene, shown);
    const Plan plan = renderer.plan(view, options_.capture);
    cells_.begin(plan);
    {
        ProgressReport progress(console_, options_.report.shownProgress(), "render");
        Sink* const sinks[] = {&cells_};
        result_.passes =
            renderer.capture(sinks, [&](double share) { progress.update(share); }).passes;
    }
    cells_.finish();
    add(result_.milliseconds, renderer.times());
    result_.layers = plan.layers.size();
    result_.fragments_counted = plan.fragments_counted;
    result_.fragments_stored = plan.fragments_stored;
    result_.method = options_.capture.method;
    result_.renderer = context->device().renderer;
    result_.backend = context->device().backend;
}

void Sheet::readLayers() {
    if (!options_.given.empty()) {
        throw Error(ErrorKind::kUsage, "the option is for scenes, and this is an image",
                    *options_.given.begin(), "leave it out, or make the sheet of the scene");
    }
    const std::uint32_t limit = options_.capture.max_layers;
    ExrLdiReader reader(options_.input.string());
    Plan plan = reader.info().plan;
    if (limit != 0 && limit < plan.layers.size()) plan.layers.resize(limit);
    cells_.begin(plan);
    const Window& crop = plan.view.crop;
    const int rows = reader.rowsFor(kBandBytes);
    ProgressReport progress(console_, options_.report.shownProgress(), "sheet");
    LayeredImage band;
    for (int y = crop.y0; y < crop.y1; y += rows) {
        {
            const StageTimer timer(result_.milliseconds, "load");
            reader.read({crop.x0, y, crop.x1, std::min(y + rows, crop.y1)}, band);
            if (limit != 0) keepNearest(band, limit);
        }
        result_.fragments_stored += band.fragments();
        cells_.write(band);
        progress.update(static_cast<double>(band.window.y1 - crop.y0) / crop.height());
    }
    cells_.finish();
    result_.layers = plan.layers.size();
    result_.fragments_counted = plan.fragments_counted;
    result_.method = reader.info().provenance.method;
    result_.renderer = reader.info().provenance.renderer;
}

void Sheet::writeSheet() {
    SheetLook look;
    look.columns = options_.columns;
    look.background = options_.output.background;
    // Grey means depth there, so what is behind it is not grey.
    constexpr std::array<float, 4> kBehindDepth{0.42F, 0.55F, 0.74F, 1};
    if (options_.cells.show == SheetShow::kDepth && !look.background)
        look.background = kBehindDepth;
    look.exposure = static_cast<float>(options_.output.exposure.value_or(0));
    look.tone_map = options_.output.tone_map.value_or(look.tone_map);
    const CompositeImage page = layOut(cells_.cells(), look);
    result_.width = page.window.width();
    result_.height = page.window.height();
    const StageTimer timer(result_.milliseconds, "encode");
    OutputOptions output;  // the page is finished: nothing is mapped once more
    output.provenance.version = PEELER_VERSION;
    writePicture(options_.output.path.string(), page, output);
}

void Sheet::tell() {
    add(result_.milliseconds, cells_.times());
    result_.output = options_.output.path;
    result_.bytes = fs::file_size(options_.output.path);
    result_.peak_memory = peakMemory();
    auto json = toJson(result_);
    json["cells"] = nlohmann::ordered_json::array();
    for (const SheetCell& cell : cells_.cells()) {
        nlohmann::ordered_json entry = {{"label", cell.label}, {"detail", cell.detail}};
        if (cell.has_error) {
            entry["max"] = cell.error.largest;
            entry["rmse"] = cell.error.rmse();
        }
        json["cells"].push_back(entry);
    }
    json["cellsOmitted"] = cells_.omitted();
    if (cells_.omitted() != 0) {
        console_.note(countText(cells_.omitted(), "cell") + " of " +
                      std::to_string(cells_.omitted() + cells_.cells().size()) +
                      " left out; --cells " +
                      std::to_string(cells_.omitted() + cells_.cells().size()) + " shows all");
    }
    if (options_.report.file) writeReport(*options_.report.file, json);
    console_.note(summary(result_));
    if (options_.report.json) console_.result(jsonText(json));
}

void addCellOptions(CLI::App& app, SheetOptions& options) {
    constexpr const char* kGroup = "Cells";
    const auto within = [](int least, int most) {
        return [least, most](const std::string& text) {
            return static_cast<int>(parseInteger(text, least, most));
        };
    };
    addChoice<SheetShow>(app, "--show", options.cells.show, kShows, "thing to show",
                         "what the cells show:")
        ->group(kGroup);
    app.add_flag("--progression", options.cells.progression,
                 wrapped("composites of the nearest 1, 2, … layers instead of the layers, each "
                         "with its error against that of all"))
        ->group(kGroup);
    addValue(app, "--cells", "N", options.cells.most_cells, within(1, 1000),
             "most cells; the rest are left out (default: 24)")
        ->group(kGroup);
    addValue(app, "--columns", "N", options.columns, within(1, 1000),
             "cells beside each other (default: near-square)")
        ->group(kGroup);
    addValue(app, "--cell-width", "PIXELS", options.cells.cell_width, within(16, 8192),
             "width of a cell, at most that of the picture (default: 320)")
        ->group(kGroup);
}

/// The options that have a meaning for scenes only, as far as they are on the command line.
std::set<std::string> sceneOptionsGiven(const CLI::App& app) {
    const std::set<std::string> groups{"Camera", "Picture", "Layers", "Machine"};
    const std::set<std::string> everywhere{"--layers", "--threads"};
    std::set<std::string> given;
    for (const CLI::Option* option : app.get_options()) {
        const std::string name = option->get_name();
        if (option->count() > 0 && groups.contains(option->get_group()) &&
            !everywhere.contains(name)) {
            given.insert(name);
        }
    }
    return given;
}

constexpr const char* kFooter =
    "Of a layered file the sheet shows what is in it: camera and machine options and those of\n"
    "the layers but --layers are for scenes. An error is that of linear premultiplied R, G, B\n"
    "and A against the composite of all layers.";

}  // namespace

VerbAction declareSheet(CLI::App& app) {
    const auto options = std::make_shared<SheetOptions>();
    options->output.as = "composite";
    addValue(
        app, "IN", "", options->input, [](const std::string& text) { return fs::path(text); },
        "a layered depth image (.exr) or a glTF scene (.gltf, .glb)")
        ->required();
    addOutputOptions(app, options->output);
    app.get_option("--output")->description(kOutputHelp);
    app.get_option("--background")
        ->description(wrapped("behind every cell: transparent (default), r,g,b[,a] in linear "
                              "light, or #rrggbb[aa] in sRGB; where it is transparent a "
                              "checkerboard shows"));
    addCellOptions(app, *options);
    addCameraOptions(app, options->camera);
    addLayerOptions(app, options->capture);
    addMachineOptions(app, options->device, options->threads, options->capture);
    addReportOptions(app, options->report);
    app.footer(kFooter);
    return [options, &app](Console& console) {
        options->given = sceneOptionsGiven(app);
        Sheet(*options, console).run();
        return 0;
    };
}

}  // namespace peeler::cmd
