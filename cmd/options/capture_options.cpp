// SPDX-License-Identifier: Apache-2.0
// The options under the headings Layers, Light and Machine.
#include "cmd/options/capture_options.h"

#include <algorithm>
#include <string>
#include <utility>
#include <vector>

#include <peeler/error.h>
#include "cmd/cli/arguments.h"
#include "cmd/cli/errors.h"
#include "cmd/cli/parse.h"
#include "cmd/machine/resources.h"
#include "cmd/options/output_options.h"
#include "core/capture/method.h"
#include "core/scene/camera_choice.h"

namespace peeler::cmd {

namespace {

std::string parseMethod(const std::string& text) {
    std::vector<std::string_view> names;
    for (const MethodInfo& method : peelMethods()) {
        if (method.name == text) return text;
        names.push_back(method.name);
    }
    refuseName("method", text, names);
}

std::vector<ChoiceDescription> methodChoices() {
    std::vector<ChoiceDescription> choices = describeChoices(peelMethods(), true);
    const auto approximate =
        std::ranges::find_if_not(peelMethods(), [](const MethodInfo& m) { return m.exact(); });
    choices.insert(choices.begin() + (approximate - peelMethods().begin()),
                   {"", "These methods are approximate, for composites only:"});
    return choices;
}

double parseRatio(const std::string& text) {
    const double ratio = parseNumber(text);
    if (ratio < 0 || ratio >= 1)
        throw Error(ErrorKind::kUsage, "expected a ratio from 0 to below 1");
    return ratio;
}

std::uint64_t parseMemory(const std::string& text) {
    const std::uint64_t bytes = parseBytes(text);
    if (bytes < kLeastMemory) {
        throw Error(ErrorKind::kUsage, "too little memory to render anything", "",
                    "give at least " + std::to_string(kLeastMemory >> 20) + "M");
    }
    return bytes;
}

std::string parseBackend(const std::string& text) {
    const std::vector<std::string> backends = gl::backendNames();
    std::vector<std::string_view> names{"auto"};
    names.insert(names.end(), backends.begin(), backends.end());
    if (std::find(names.begin(), names.end(), text) == names.end())
        refuseName("backend", text, names);
    return text;
}

}  // namespace

namespace {

constexpr const char* kLayersGroup = "Layers";

void addMethodOption(VerbOptions& verb, CaptureSettings& capture) {
    capture.method = peelMethods().front().name;
    addValue(verb, "--method", "NAME", capture.method, parseMethod,
             "peeling method; all of these find the same layers:")
        .oneOf(methodChoices())
        .group(kLayersGroup);
}

void addFacesOption(VerbOptions& verb, CaptureSettings& capture) {
    addChoice<Faces>(verb, "--faces", capture.faces, kFaces, "choice of faces",
                     "sides of triangles to draw:")
        .group(kLayersGroup);
}

void addPointSizeOption(VerbOptions& verb, CaptureSettings& capture, const std::string& otherwise) {
    addValue(
        verb, "--point-size", "N", capture.point_size,
        [](const std::string& text) { return static_cast<int>(parseInteger(text, 1, 1024)); },
        "width and height of points in pixels (default: " + otherwise + ")")
        .group(kLayersGroup);
}

}  // namespace

void addAllLayersOptions(VerbOptions& verb, CaptureSettings& capture) {
    addMethodOption(verb, capture);
    addFacesOption(verb, capture);
    addPointSizeOption(verb, capture, "1");
}

void addLayerOptions(VerbOptions& verb, CaptureSettings& capture) {
    constexpr const char* kGroup = kLayersGroup;
    addMethodOption(verb, capture);
    addValue(
        verb, "--layers", "N|all", capture.max_layers,
        [](const std::string& text) { return parseLayers(text); },
        "keep only the N nearest layers; 0 means all (default: all)")
        .group(kGroup);
    addValue(verb, "--occlusion-ratio", "R", capture.occlusion_ratio, parseRatio,
             "stop after the first layer that covers less than this share of the pixels (default: "
             "0, all layers)")
        .group(kGroup);
    addChoice<Tail>(verb, "--tail", capture.tail, kTails, "choice of tail",
                    "treatment of fragments behind the kept layers:")
        .group(kGroup);
    addValue(
        verb, "--samples", "N", capture.samples,
        [](const std::string& text) { return static_cast<int>(parseInteger(text, 1, 256)); },
        "antialiasing samples per pixel; a layer's coverage goes into its alpha (default: 1, the "
        "pixel's centre)")
        .group(kGroup);
    addChoice<Surfaces>(verb, "--surfaces", capture.surfaces, kSurfaces, "choice of surfaces",
                        "fragments that become layers:")
        .group(kGroup);
    addFacesOption(verb, capture);
    addChoice<Shading>(verb, "--shading", capture.shading, kShading, "shading",
                       "shading of surfaces:")
        .group(kGroup);
    addPointSizeOption(verb, capture,
                       std::to_string(kDisplayPointSize) +
                           " in display formats: .png, .jpg, .tif, .html and sheets; else 1");
    addChoice<SplatOrder>(verb, "--splat-order", capture.splat_order, kSplatOrders,
                          "order of splats", "order and Z of Gaussian splats:")
        .group(kGroup);
    addValue(
        verb, "--splat-dilation", "PX2", capture.splat_dilation,
        [](const std::string& text) { return parseAtLeastZero(text); },
        "variance added to projected Gaussian splats, in square pixels (default: the file's "
        "format's: 0.3, in glTF 0)")
        .group(kGroup);
    addChoice<PixelType>(verb, "--precision", capture.color_type, kPrecisions, "precision",
                         "precision of stored colour; Z is always 32 bits:")
        .group(kGroup);
}

void addRayFacesOption(VerbOptions& verb, std::optional<Faces>& faces) {
    addValue(
        verb, "--faces", "NAME", faces,
        [](const std::string& text) { return choose<Faces>("choice of faces", kRayFaces, text); },
        "sides of triangles that rays hit (default: both; for the rays of a camera gltf, as in "
        "peeler render, except with --parity or a map of the inside of solids):")
        .oneOf(describeChoices(kRayFaces))
        .group("Rays");
}

void addLightOptions(VerbOptions& verb, CaptureSettings& capture, std::optional<int>& shadow_size) {
    constexpr const char* kGroup = "Light";
    verb.addFlag("--shadows", capture.shadows,
                 "cast shadows from directional and spot lights, including the built-in one; "
                 "OPAQUE and MASK surfaces that transmit no light cast them; point lights and "
                 "environments have no shadows")
        .group(kGroup);
    addValue(
        verb, "--shadow-size", "N", shadow_size,
        [](const std::string& text) {
            return static_cast<int>(parseInteger(text, 1, kMostPictureSide));
        },
        "texels per side of each light's shadow map (default: 2048)")
        .group(kGroup);
}

void setShadowSize(CaptureSettings& capture, const std::optional<int>& shadow_size) {
    if (!shadow_size) return;
    if (!capture.shadows) {
        throw Error(ErrorKind::kUsage, "there are no shadow maps",
                    "--shadow-size " + std::to_string(*shadow_size), "add --shadows");
    }
    capture.shadow_size = *shadow_size;
}

void addMemoryOption(VerbOptions& verb, MemoryBudget& budget, const std::string& remark) {
    budget = inheritedBudget();
    addValue(verb, "--memory", "SIZE", budget, parseMemory,
             "memory limit, e.g. 8G or 512M; " + remark +
                 " (default: 7/8 of the limit set by the cgroup, SLURM_MEM_PER_NODE, "
                 "SLURM_MEM_PER_CPU or CUE_MEMORY, else no limit)")
        .group("Machine");
}

void addMachineOptions(VerbOptions& verb, gl::ContextRequest& device, int& threads,
                       CaptureSettings& capture, const std::string& memory) {
    constexpr const char* kGroup = "Machine";
    std::vector<ChoiceDescription> backends{{"auto", "", true}};
    for (const std::string& name : gl::backendNames())
        backends.push_back({name, ""});
    addValue(verb, "--backend", "NAME", device.backend, parseBackend, "source of the GL context:")
        .oneOf(std::move(backends))
        .group(kGroup);
    addValue(verb, "--device", "NAME", device.device, gl::parseDeviceChoice,
             "device to use: its number in peeler devices, cuda:N for its CUDA ordinal, or uuid: "
             "and an unambiguous beginning of its UUID (default: the first usable one that "
             "CUDA_VISIBLE_DEVICES does not hide)")
        .group(kGroup);
    verb.addFlag("--require-gpu", device.require_gpu, "fail instead of rendering in software")
        .group(kGroup);
    addThreadsOption(verb, threads);
    addMemoryOption(verb, capture.memory, memory);
}

void addEngineOption(VerbOptions& verb, RayEngine& engine) {
    addChoice<RayEngine>(verb, "--engine", engine, kEngines, "engine",
                         "engine that finds the hits of rays:")
        .group("Machine");
}

}  // namespace peeler::cmd
