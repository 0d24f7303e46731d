// SPDX-License-Identifier: Apache-2.0
#include "cmd/render/render_options.h"

#include "cmd/options/animation_options.h"
#include "cmd/options/appearance_options.h"
#include "cmd/options/clip_options.h"
#include "cmd/render/channel_options.h"
#include "cmd/render/presets.h"
#include "cmd/render/render_request.h"

#include <peeler/error.h>
#include "cmd/cli/arguments.h"
#include "core/capture/gl_planner.h"
#include "core/capture/method.h"
#include "formats/writers.h"

namespace peeler::cmd {

namespace {

/// Returns the file extensions of all picture formats, separated by spaces, without duplicates.
std::string outputEndings() {
    std::string endings;
    for (const OutputFormat& format : outputFormats()) {
        for (const std::string_view extension : format.extensions) {
            const std::string word = std::string(extension) + ' ';
            if (endings.find(word) == std::string::npos) endings += word;
        }
    }
    return endings;
}

/// Restricts the capture to shadow casters, for a shadow map. Throws Error (kUsage) if options
/// request other fragments.
void chooseCasters(CaptureSettings& capture) {
    const CaptureSettings usual;
    if (capture.max_layers != usual.max_layers || capture.surfaces != usual.surfaces ||
        capture.faces != usual.faces || capture.shadows || capture.samples != usual.samples ||
        capture.occlusion_ratio != usual.occlusion_ratio) {
        throw Error(
            ErrorKind::kUsage, "a shadow map always shows both faces of all opaque surfaces",
            "--as midpoint-depth",
            "leave --layers, --occlusion-ratio, --samples, --surfaces, --faces and --shadows out");
    }
    capture.opaque_only = true;
    capture.faces = Faces::kBoth;
    capture.shading = Shading::kUnlit;
}

/// Chooses the channels to capture. For a composite with channels, the capture keeps the layers,
/// and the writer composites them. Throws Error (kUsage) if the output cannot have channels.
void chooseChannels(const RenderOptions& options, CaptureSettings& capture) {
    checkChannelOptions(options.channels, options.output);
    capture.channels = capturedChannels(options.channels);
    if (const auto needs =
            findOutputFormat(options.output.path.string(), options.output.options.as).needs)
        capture.channels.assign(needs().begin(), needs().end());
    if (capture.channels.empty()) return;
    const MethodInfo* method = findPeelMethod(capture.method);
    if (method && !method->exact()) {
        throw Error(ErrorKind::kUsage,
                    capture.method + " keeps no separate fragments, so there are no channels",
                    "--method " + capture.method,
                    "choose another method, or leave --channels and --cryptomatte out");
    }
    if (capture.tail == Tail::kBlend) {
        throw Error(ErrorKind::kUsage, "blended fragments have no channels", "--tail blend",
                    "leave it out, or leave out --channels and --cryptomatte");
    }
    if (options.fxaa) {
        throw Error(ErrorKind::kUsage, "FXAA filters colours and cannot smooth channels", "--fxaa",
                    "use --samples, or leave --channels and --cryptomatte out");
    }
    capture.composite = false;
}

}  // namespace

void addRenderOptions(VerbOptions& verb, RenderOptions& options) {
    verb.addFiles(
            "SCENE", options.scenes,
            "scenes (glTF, PLY, STL, OBJ, 3MF, SPZ, .splat), folders of scenes, or globs in "
            "quotes; in the "
            "output's "
            "name, {stem} stands for the scene's name, {folder} for the name of the scene's folder")
        .files(sceneExtensions());
    addOutputOptions(verb, options.output);
    addLayerOutputOptions(verb, options.output);
    verb.option("--output").files(outputEndings() + ".tar");
    addShardOptions(verb, options.shard);
    addPresetOption(verb, options.preset);
    addFxaaOption(verb, options.fxaa, "quick, but less accurate than --samples");
    addShownOptions(verb, options);
    addNormalizeOption(verb, options.scene);
    addFrameOptions(verb, options.animation);
    addCameraOptions(verb, options.camera, &options.scene.reading, true);
    addLensOptions(verb, options.lens);
    addViewOptions(verb, options.views);
    options.views.lenses = true;
    addViewFileOptions(verb, options.views);
    addLayerOptions(verb, options.capture);
    addValue(
        verb, "--splat-blending", "NAME", options.splat_blending,
        [](const std::string& text) {
            return choose<SplatBlending>("blending", kSplatBlendings, text);
        },
        "values in which Gaussian splats blend (default: display in .png, .jpg and .tif of splats "
        "alone whose colours are stored as sRGB, else linear):")
        .oneOf(describeChoices(kSplatBlendings))
        .group("Layers");
    addValue(
        verb, "--shade-per", "NAME", options.shade_per,
        [](const std::string& text) { return choose<ShadePer>("shading", kShadePer, text); },
        "how often an opaque triangle is shaded in a pixel with 4 samples (default: auto in .png, "
        ".jpg and .tif, else sample):")
        .oneOf(describeChoices(kShadePer))
        .group("Layers");
    verb.option("--samples")
        .description(
            "antialiasing samples per pixel; a layer's coverage goes into its alpha (default: " +
            std::to_string(kDisplaySamples) +
            " in .png, .jpg and .tif without --fxaa and not of Gaussian splats alone, else 1, the "
            "pixel's centre)");
    addChannelOptions(verb, options.channels);
    addClipOptions(verb, options.clip);
    addLightOptions(verb, options.capture, options.shadow_size);
    addAppearanceOptions(verb, options.appearance);
    addRunOptions(verb, options);
    addSequenceOptions(verb, options.sequence);
    verb.addFlag("--dry-run", options.sequence.dry_run,
                 "print as JSON what would be done, with the memory and disk space that the first "
                 "picture needs, and write nothing")
        .group("Output");
    verb.option("--strict")
        .description(
            "turn warnings about the input into errors (exit code 3), and also an empty picture or "
            "a layer limit that leaves out fragments (exit code 6); nothing is written then");
}

CaptureSettings captureSettings(const RenderOptions& options) {
    CaptureSettings capture = options.capture;
    const OutputFormat& format =
        findOutputFormat(options.output.path.string(), options.output.options.as);
    capture.composite = format.holds(OutputContent::kComposite);
    if (capture.composite && format.for_display && !options.samples_given && !options.fxaa)
        capture.samples = kDisplaySamples;
    const bool shadow_map = format.holds(OutputContent::kShadowMap);
    chooseChannels(options, capture);
    if (shadow_map) chooseCasters(capture);
    checkSettings(capture);
    if (options.fxaa && !capture.composite && capture.channels.empty()) {
        throw Error(ErrorKind::kUsage, "FXAA filters finished pictures and cannot smooth layers",
                    "--fxaa", "add --as composite, or use --samples instead");
    }
    if (options.camera.tile && (options.fxaa || shadow_map)) {
        throw Error(ErrorKind::kUsage,
                    options.fxaa ? "FXAA needs pixels beyond the tile"
                                 : "tiles of a shadow map cannot be merged",
                    "--tile " + options.camera.tile->text(),
                    options.fxaa ? "merge tiles of layers, then run peeler flatten --fxaa"
                                 : "render it as a whole");
    }
    if (format.takesOneSample() && capture.samples != 1) {
        throw Error(ErrorKind::kUsage, "each pixel of this output is one ray",
                    "--samples " + std::to_string(capture.samples),
                    "leave it out, or choose another format than --as " + std::string(format.kind));
    }
    setShadowSize(capture, options.shadow_size);
    return capture;
}

}  // namespace peeler::cmd
