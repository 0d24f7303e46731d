// SPDX-License-Identifier: Apache-2.0
// peeler check: tests whether the parts of a scene are printable, and locates their faults.
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <vector>

#include <peeler/error.h>
#include "cmd/check/check_parts.h"
#include "cmd/check/check_text.h"
#include "cmd/check/part_report.h"
#include "cmd/check/places_scene.h"
#include "cmd/cli/arguments.h"
#include "cmd/cli/errors.h"
#include "cmd/cli/parse.h"
#include "cmd/cli/report.h"
#include "cmd/options/capture_job.h"
#include "cmd/options/output_checks.h"
#include "cmd/options/output_options.h"
#include "cmd/session/progress_report.h"
#include "cmd/verbs.h"
#include "core/base/stage_times.h"
#include "formats/image/legend.h"
#include "formats/meshes/scene_reader.h"
#include "formats/writers.h"

namespace peeler::cmd {

namespace {

namespace fs = std::filesystem;

struct CheckOptions : CaptureJobOptions {
    OutputRequest output;
    CameraOptions camera;
    bool together = false;
    std::optional<double> unit;              ///< metres per scene unit
    std::optional<double> least_wall, weld;  ///< millimetres

    bool writesPicture() const { return !output.path.empty(); }
};

class PlacesKeeper : public Sink {
  public:
    explicit PlacesKeeper(CompositeImage& picture) : picture_(picture) {}

    void begin(const Plan& plan) override { picture_.window = plan.view.crop; }
    void write(LayeredImage&& band) override {
        compositeOver(band, {1, 1, 1, 1}, band_);
        picture_.appendColors(band_);
    }
    void finish() override { picture_.z.assign(picture_.rgba.size(), 0); }

  private:
    CompositeImage& picture_;
    CompositeImage band_;
};

CompositeImage withLegend(const CompositeImage& picture, const std::vector<LegendLine>& lines) {
    const int width = picture.window.width(), height = picture.window.height();
    const LegendSize size = legendSize(lines, width);
    const CompositeImage legend = drawLegend(lines, size);
    CompositeImage both;
    both.window = {0, 0, size.width, height + size.height};
    for (int y = 0; y < height; ++y) {
        const auto row = picture.rgba.begin() + std::ptrdiff_t{y} * width;
        both.rgba.insert(both.rgba.end(), row, row + width);
        both.rgba.resize(both.rgba.size() + static_cast<std::size_t>(size.width - width),
                         {1, 1, 1, 1});
    }
    both.rgba.insert(both.rgba.end(), legend.rgba.begin(), legend.rgba.end());
    both.z.assign(both.rgba.size(), 0);
    return both;
}

class Check {
  public:
    Check(const CheckOptions& options, Session& session)
        : options_(options), reporter_(session.reporter()), job_(options, session) {}

    int run() {
        checkOptions();
        check();
        if (options_.writesPicture()) writePicture();
        return report();
    }

  private:
    void checkOptions() {
        job_.checkOptions();
        std::vector<fs::path> others{options_.scene.file};
        if (options_.writesPicture()) {
            OutputRequest output = options_.output;
            output.options.as = "composite";
            checkOutput(output, others);
            others.push_back(options_.output.path);
        }
        checkReport(options_.report, others);
    }

    void check() {
        job_.openScene();
        job_.checkOutputs(options_.writesPicture() ? std::vector{options_.output.path}
                                                   : std::vector<fs::path>{});
        const PosedScene posed = job_.pose();
        CheckSettings settings;
        settings.together = options_.together;
        const bool named = namesUnit(options_.scene.file);
        settings.metres = named ? 1 : options_.unit.value_or(1);
        const double millimetre = 1e-3 / settings.metres;
        if (options_.least_wall) settings.least_wall = *options_.least_wall * millimetre;
        if (options_.weld) settings.weld = *options_.weld * millimetre;
        const StageTimer timer(job_.times(), "check");
        ProgressReport progress(reporter_, "check");
        const std::string_view unit = lengthUnitName(options_.unit.value_or(1));
        report_ = checkParts(posed, settings, [&](double share) { progress.update(share); });
        if (options_.unit && !unit.empty())
            report_.unit = {std::string(unit), settings.metres / *options_.unit};
        else
            report_.unit.per_scene_unit = 1000 * settings.metres;
        if (!options_.unit && !named) noteUnit();
    }

    /// Prints a note with the assumed unit. If the scene is larger than any printer, prints a hint
    /// about --unit mm instead: files for printers are often in millimetres, although glTF
    /// specifies metres.
    void noteUnit() {
        constexpr double kLarge = 10;  // metres
        const glm::dvec3 size = report_.bounds.max - report_.bounds.min;
        const double largest = std::max({size.x, size.y, size.z});
        if (largest > kLarge)
            reporter_.hint("the scene is " + groupedText(static_cast<std::uint64_t>(largest)) +
                           " metres large; if the file is in millimetres, give --unit mm");
        else
            job_.noteUnit();
    }

    void writePicture() {
        const Scene scene = placesScene(report_);
        const PosedScene posed(scene);
        GlRenderer& renderer = job_.openRenderer(posed);
        CaptureSettings capture = options_.capture;
        capture.composite = true;
        capture.color_type = PixelType::kFloat;
        CompositeImage picture;
        PlacesKeeper keeper(picture);
        const CapturePlan plan =
            renderer.plan(makeView(posed, SceneExtent(posed), options_.camera), capture);
        keeper.begin(plan);
        renderer.capture(plan, keeper);
        keeper.finish();
        job_.releaseRenderer();
        OutputOptions output = options_.output.options;
        output.provenance.version = PEELER_VERSION;
        peeler::writePicture(options_.output.path.string(),
                             withLegend(picture, placesLegend(report_)), output);
    }

    int report() {
        RunResult result;
        job_.finish(result);
        if (options_.writesPicture()) result.setFile(options_.output.path);
        result.metres_per_unit = report_.metres;
        const Json json = toJson(result, toJson(report_));
        if (options_.report.file) writeReport(*options_.report.file, json);
        if (options_.report.json)
            reporter_.result(json);
        else
            reporter_.text(toText(report_, options_.scene.file.string()));
        if (options_.writesPicture())
            reporter_.note(options_.output.path.string() + ": " + bytesText(result.bytes) + ", " +
                           totalText(result.milliseconds));
        if (report_.faulty() == 0) return 0;
        reporter_.error(verdictText(report_));
        return static_cast<int>(ErrorKind::kInput);
    }

    const CheckOptions& options_;
    Reporter& reporter_;
    CaptureJob job_;
    CheckReport report_;
};

constexpr const char* kCheckFooter =
    "A part is a mesh at its place in the scene, with all its materials. Vertices with\n"
    "bit-identical positions are joined; so are vertices of open edges within --weld. A part\n"
    "can be printed if it is\n"
    "  closed        every edge has an even number of triangles\n"
    "  manifold      no edge has more than two triangles\n"
    "  oriented      adjacent triangles have consistent winding; outer shells face outwards,\n"
    "                inner shells (cavities) inwards\n"
    "  solid         every shell encloses a volume\n"
    "  not crossing  no triangle crosses another, and no shell lies in another's material;\n"
    "                penetration below a millionth of the part's size is treated as contact\n"
    "and if its thinnest wall is at least --min-wall, with a tolerance of 1e-4. Parts may\n"
    "overlap: the volume of their union is reported, and overlaps are a problem only with\n"
    "--together. If nearly everything crosses, the union and the thinnest wall are not\n"
    "determined.\n"
    "The thinnest wall is the shortest distance from the surface straight into the material,\n"
    "against the normal of a triangle, to a face whose normal is opposite to within 30 degrees.\n"
    "The minimum is over the whole surface, not over samples, with a relative error of at most\n"
    "1e-4. Faces that share a corner form an edge, not a wall; the number of sharp edges (less\n"
    "than 30 degrees) is reported. A wall between faces that other triangles cross can get\n"
    "arbitrarily thin; it is reported separately, as the crossed wall. In an open part, a\n"
    "wall is measured only where both of its faces exist. Alpha and textures are ignored.\n"
    "\n"
    "Exit codes: 0 printable; 3 not printable, or the file is not a scene.";

}  // namespace

VerbAction declareCheck(VerbOptions& verb) {
    const auto options = std::make_shared<CheckOptions>();
    addSceneArgument(verb, *options);
    addOutputFile(verb, options->output);
    verb.option("--output")
        .required(false)
        .description(
            "picture (.png, .jpg, .tif) of the parts as glass, with problems and the thinnest wall "
            "in bright colours")
        .files(".png .jpg .tif");
    addValue(verb, "--size", "WxH", options->camera.size, parseSize,
             "size of the picture (default: 1280x720)")
        .group("Output");
    addValue(verb, "--min-wall", "MM", options->least_wall, parsePositive,
             "minimum wall thickness in millimetres; a thinner wall is a problem")
        .group("Check");
    addValue(verb, "--weld", "MM", options->weld, parseAtLeastZero,
             "maximum distance in millimetres at which vertices of open edges are joined; 0 joins "
             "only vertices at the same position (default: a millionth of the part's size)")
        .group("Check");
    addValue(verb, "--unit", "NAME|METRES", options->unit, parseLengthUnit,
             "length unit of the scene, by name or in metres; a 3MF names its own; if you give a "
             "unit of this list, texts and pictures give lengths in it, else in millimetres:")
        .oneOf(describeChoices(kLengthUnits, true))
        .group("Check");
    verb.addFlag(
            "--together", options->together,
            "treat all parts as one: weld vertices at the same position, and allow no overlaps")
        .group("Check");
    addShownOptions(verb, *options);
    addUpOption(verb, options->scene.reading);
    addRunOptions(verb, *options, "for the picture only, not for the check itself");
    verb.footer(kCheckFooter);
    return [options](Session& session) { return Check(*options, session).run(); };
}

}  // namespace peeler::cmd
