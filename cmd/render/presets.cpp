// SPDX-License-Identifier: Apache-2.0
#include "cmd/render/presets.h"

#include <cmath>
#include <numbers>

#include "cmd/cli/arguments.h"
#include "cmd/render/render_options.h"
#include "cmd/render/render_request.h"
#include "formats/file/file_name.h"

namespace peeler::cmd {

namespace {

/// Returns the vertical field of view, in degrees, of a square picture. `widths` is the focal
/// length in picture widths.
double fovOfFocalLength(double widths) {
    return 2 * std::atan(0.5 / widths) * 180 / std::numbers::pi;
}

struct Preset {
    std::string_view name, summary;
    std::string_view as;
    Size size;
    double focal_length;   ///< focal length in picture widths; 0 = the default field of view
    bool through_corners;  ///< ViewsAround::through_corners
    int clip = 0;          ///< frames or views of a clip; 0 = no clip
    bool compress = false;
};

constexpr Preset kPresets[] = {
    {"lari",
     "samples for LaRI's loader: --as lari --size 512x512 --normalize unit-cube --faces both; for "
     "--views also a focal length of 35/32 of the width",
     "lari",
     {512, 512},
     35.0 / 32,
     false},
    {"xray",
     "samples for X-Ray: --as xray --size 256x256 --normalize unit-cube --faces both; for "
     "--views also rays through the upper left corners of pixels",
     "xray",
     {256, 256},
     0,
     true},
    {"world-tracing",
     "clips for World Tracing: --as world-tracing --compress --size 504x504 --normalize unit-cube "
     "--faces both; if the output's name has ####, --frames 0-15; if it has @@@@, --views 16 "
     "--around orbit; for --views also a focal length of 500/512 of the width, and rays through "
     "the upper left corners of pixels",
     "world-tracing",
     {504, 504},
     500.0 / 512,
     true,
     16,
     true},
};

/// Sets options for a clip: `count` frames if the output's name has a placeholder for frames, and
/// `count` views if the name has a placeholder for views. Keeps the frames or views that the user
/// asked for.
void chooseClip(int count, RenderOptions& options) {
    const std::string name = options.output.path.string();
    if (hasFrameToken(name) && !options.animation.frames) {
        options.animation.frames.emplace();
        for (int frame = 0; frame < count; ++frame)
            options.animation.frames->push_back(frame);
    }
    if (!hasViewToken(name) || options.views.asked()) return;
    options.views.count = count;
    if (!options.views.around) options.views.around = Around::kOrbit;
}

}  // namespace

void addPresetOption(VerbOptions& verb, std::optional<std::string>& preset) {
    addValue(
        verb, "--preset", "NAME", preset,
        [](const std::string& text) {
            std::vector<std::string_view> names;
            for (const Preset& row : kPresets)
                names.push_back(row.name);
            return std::string(listedNames("preset", text, names).front());
        },
        "options for data sets; options that you give take precedence:")
        .oneOf(describeChoices(kPresets))
        .group("Output");
}

void applyPreset(const VerbOptions& verb, RenderOptions& options) {
    if (!options.preset) return;
    const Preset* preset = kPresets;
    while (preset->name != *options.preset)
        ++preset;
    if (options.output.options.as.empty()) options.output.options.as = preset->as;
    if (!options.camera.size_given) {
        options.camera.size = preset->size;
        options.camera.size_given = true;
    }
    if (preset->clip > 0 && !namesShards(options.output.path)) chooseClip(preset->clip, options);
    if (preset->compress) options.output.options.compress = true;
    const bool is_around = options.views.count.has_value();
    if (is_around && preset->focal_length > 0 && !options.camera.fov)
        options.camera.fov = fovOfFocalLength(preset->focal_length);
    options.views.through_corners = preset->through_corners;
    if (!options.scene.normalize) options.scene.normalize = Normalized::kUnitCube;
    if (!verb.given("--faces")) options.capture.faces = Faces::kBoth;
}

}  // namespace peeler::cmd
