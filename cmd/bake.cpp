// SPDX-License-Identifier: Apache-2.0
// peeler bake: ambient occlusion and related quantities, at a scene's vertices or texels.
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <span>
#include <system_error>
#include <utility>
#include <vector>

#include <peeler/error.h>
#include "cmd/bake/bake_arrays.h"
#include "cmd/bake/bake_options.h"
#include "cmd/bake/bake_values.h"
#include "cmd/bake/write_memory.h"
#include "cmd/cli/arguments.h"
#include "cmd/cli/errors.h"
#include "cmd/cli/report.h"
#include "cmd/machine/resources.h"
#include "cmd/options/appearance_options.h"
#include "cmd/options/capture_job.h"
#include "cmd/options/forecast.h"
#include "cmd/options/output_checks.h"
#include "cmd/options/output_options.h"
#include "cmd/session/progress_report.h"
#include "cmd/verbs.h"
#include "core/bake/receivers.h"
#include "core/base/memory_budget.h"
#include "core/base/printable.h"
#include "core/base/process_memory.h"
#include "core/base/stage_times.h"
#include "formats/file/file_name.h"
#include "formats/gltf/glb_writer.h"
#include "formats/image/image_writer.h"

namespace peeler::cmd {

namespace {

namespace fs = std::filesystem;

struct BakeCommand : CaptureJobOptions {
    BakeOptions bake;
};

// Bits per value of an occlusion texture in a .glb. Every viewer supports 8 bits.
constexpr int kTextureBits = 8;
constexpr const char* kSoftware = "peeler " PEELER_VERSION;

class Bake {
  public:
    Bake(const BakeCommand& options, Session& session)
        : options_(options), reporter_(session.reporter()), job_(options, session) {}

    void run() {
        checkOptions();
        open();
        placeReceivers();
        nameOutputs();
        forecast();
        openHits();
        if (options_.bake.dry_run) return describe();
        reportForecast(forecast_, reporter_);
        gather();
        write();
        report();
    }

  private:
    void checkOptions();
    std::vector<fs::path> inputs() const;
    std::vector<fs::path> checkFiles(std::span<const int> materials) const;
    void open();
    void placeReceivers();
    void warnOfTexels() const;
    void nameOutputs();
    void forecast();
    SizeForecast sceneForecast() const;
    void openHits();
    void takeMemory(std::uint64_t bytes);
    void describe();
    void gather();
    void write();
    std::unique_ptr<GlbWriter> openPackage() const;
    void showWhatWasBaked(GlbWriter& package) const;
    void writePackage(GlbWriter& package) const;
    void writeArrays();
    void writeVertices();
    void writeTextures();
    std::string materialName(int material) const;
    void report();

    const Scene& scene() const { return scene_->scene(); }
    const Receivers& receivers() const {
        return texels_ ? texels_->receivers() : vertices_->receivers();
    }

    const BakeCommand& options_;
    Reporter& reporter_;
    CaptureJob job_;
    CaptureSettings capture_;
    const OpenedScene* scene_ = nullptr;  ///< owned by job_
    std::optional<PosedScene> posed_;
    std::optional<VertexReceivers> vertices_;
    std::optional<TexelReceivers> texels_;  ///< set only if the target is texels
    std::vector<fs::path> outputs_;         ///< one file, or one .png per texture
    Forecast forecast_;
    HitSource* source_ = nullptr;
    BakeSettings settings_;
    std::uint64_t memory_forecast_ = 0;  ///< bytes
    std::vector<float> values_;
};

std::vector<fs::path> Bake::inputs() const {
    std::vector<fs::path> files{options_.scene.file};
    if (const auto file = environmentFile(options_.appearance)) files.push_back(*file);
    return files;
}

/// Returns the output files. Throws Error (kUsage) if an output would replace an input or another
/// output, Error (kOutput) if an output cannot be written.
std::vector<fs::path> Bake::checkFiles(std::span<const int> materials) const {
    const std::vector<fs::path> read = inputs();
    OutputRequest output;
    output.path = options_.bake.output;
    output.no_clobber = options_.bake.no_clobber;
    output.no_mkdir = options_.bake.no_mkdir;
    std::vector<fs::path> outputs = checkSeries(output, materials, read);
    checkFolder(output.path);
    std::vector<fs::path> others = read;
    others.insert(others.end(), outputs.begin(), outputs.end());
    checkReport(options_.report, others);
    return outputs;
}

void Bake::checkOptions() {
    checkBakeOptions(options_.bake, options_.appearance);
    job_.checkOptions();
    checkFiles({});
    capture_ = options_.capture;
    capture_.faces = options_.bake.faces;
}

void Bake::open() {
    scene_ = &job_.openScene();
    posed_ = job_.pose();
    if (options_.bake.settings.quantity == BakeQuantity::kIrradiance) checkBakedLight(*posed_);
}

void Bake::placeReceivers() {
    const StageTimer timer(job_.times(), "receivers");
    vertices_.emplace(*posed_, capture_.memory);
    if (vertices_->receivers().size() == 0)
        throw Error(ErrorKind::kInput, "the scene shows no triangles to bake",
                    options_.scene.file.string(), "use peeler info to see its contents");
    if (options_.bake.chosenTarget() == BakeTarget::kVertices) return;
    texels_.emplace(*posed_, *vertices_, options_.bake.texels(), capture_.memory);
    warnOfTexels();
}

void Bake::warnOfTexels() const {
    const std::string set = "TEXCOORD_" + std::to_string(texels_->settings().uv_set);
    if (texels_->withoutUvs() > 0)
        reporter_.warning(countText(texels_->withoutUvs(), "surface") + " without " + set +
                          ": nothing is baked there.");
    for (const TexelAtlas& atlas : texels_->atlases()) {
        if (atlas.shared == 0) continue;
        const double share =
            100 * static_cast<double>(atlas.shared) / static_cast<double>(atlas.covered);
        reporter_.warning("The UVs of material " + materialName(atlas.material) +
                          " overlap (mirrored, tiled, or several instances): " +
                          countText(atlas.shared, "texel") + ", " +
                          std::to_string(static_cast<int>(std::ceil(share))) +
                          " % of those in use, hold a mean of several places.");
    }
}

std::string Bake::materialName(int material) const {
    const std::string number = std::to_string(material);
    const std::string& name = scene().materials[static_cast<std::size_t>(material)].name;
    return name.empty() ? number : number + " (" + printable(name) + ")";
}

/// Names the output files. Needs the open scene: each material gets a texture, and no output may
/// replace a file of the scene.
void Bake::nameOutputs() {
    std::vector<int> materials;
    if (texels_)
        for (const TexelAtlas& atlas : texels_->atlases())
            materials.push_back(atlas.material);
    const std::string output = options_.bake.output.string();
    if (options_.bake.file() == BakeFile::kPng && materials.size() > 1 && !hasFrameToken(output))
        throw Error(ErrorKind::kUsage,
                    "the textures of " + std::to_string(materials.size()) +
                        " materials would have the same name",
                    "--output " + output,
                    "put #### or %04d into the file's name, where the material's number goes, or "
                    "write an .exr");
    outputs_ = checkFiles(materials);
    job_.checkOutputs(outputs_);
}

/// Forecasts the sizes of the outputs. The sizes do not depend on the values.
void Bake::forecast() {
    const std::string contents = countText(receivers().size(), "receiver");
    if (options_.bake.file() == BakeFile::kGltf) {
        forecast_.files = {{outputs_.front(), sceneForecast(), contents}};
        return;
    }
    const std::size_t components = componentsOf(options_.bake.settings.quantity);
    if (options_.bake.file() == BakeFile::kArrays) {
        const std::vector<NamedArray> arrays =
            texels_ ? texelArrays(*texels_, components) : vertexArrays(*vertices_, components);
        const fs::path& output = outputs_.front();
        forecast_.files = {{output, {ArrayWriter::fileBytes(output.string(), arrays)}, contents}};
        return;
    }
    const auto size = static_cast<std::uint64_t>(texels_->settings().size);
    if (options_.bake.file() == BakeFile::kPng) {
        for (const fs::path& output : outputs_)
            forecast_.files.push_back({output, imageForecast(output.string(), 2 * size * size)});
        return;
    }
    const std::uint64_t part =
        exrHeaderBytes({}) + sizeof(float) * components * size * size + kExrChunkBytes * size;
    forecast_.files = {
        {outputs_.front(), {part * texels_->atlases().size(), Certainty::kAtMost}, contents}};
}

/// Forecasts the size of the scene with the baked data. The forecast is approximate: writing
/// changes the JSON, and moves base64 data and separate files into the buffer.
SizeForecast Bake::sceneForecast() const {
    std::vector<fs::path> files = scene().files;
    files.push_back(options_.scene.file);
    std::uint64_t bytes = 0;
    for (const fs::path& file : files) {
        std::error_code failure;
        const std::uint64_t of_file = fs::file_size(file, failure);
        if (!failure) bytes += of_file;
    }
    if (texels_) {
        const auto size = static_cast<std::uint64_t>(texels_->settings().size);
        bytes += texels_->atlases().size() * size * size * kTextureBits / 8;
    } else {
        constexpr std::uint64_t kColorBytes = 4 * sizeof(std::uint16_t);
        bytes += receivers().size() *
                 (kColorBytes + sizeof(float) * componentsOf(options_.bake.settings.quantity));
    }
    return {bytes, Certainty::kAbout};
}

/// Opens the hit source. Checks before the long bake that the memory suffices to write the outputs.
void Bake::openHits() {
    settings_ = options_.bake.settings;
    settings_.bounces = options_.bake.bounces.value_or(settings_.bounces);
    source_ = &job_.openHits(*posed_);
    add(job_.times(), source_->takeTimes());
    const std::uint64_t written =
        receivers().size() * componentsOf(settings_.quantity) * sizeof(float) +
        writeMemory(options_.bake, options_.scene, *scene_, receivers().size(),
                    texels_ ? &*texels_ : nullptr);
    returnFreeMemory();
    takeMemory(residentBytes() + written);
    const MemoryBudget& budget = capture_.memory;
    checkMemory(budget, usedBytes(budget) + written, "to write the results");
}

/// Raises the memory forecast to `bytes`, and to the process's peak so far, because the run may
/// reach this peak again.
void Bake::takeMemory(std::uint64_t bytes) {
    memory_forecast_ = std::max({memory_forecast_, repeatedPeak(peakMemory()), bytes});
}

/// Reports the plan, for --dry-run.
void Bake::describe() {
    {
        ProgressReport progress(reporter_, {"count", kCountEnd});
        takeMemory(forecastBake(*source_, receivers(), settings_, capture_,
                                [&](double share) { progress.update(share); }));
    }
    Json json;
    json["scene"] = options_.scene.file.string();
    json["quantity"] = nameOf<BakeQuantity>(kBakeQuantities, settings_.quantity);
    json["target"] = targetName(options_.bake.chosenTarget());
    json["receivers"] = receivers().size();
    json["settingsHash"] = job_.settingsHash(capture_, bakeSettings(options_.bake));
    json["forecastMemory"] = memory_forecast_;
    json["outputs"] = forecastJson(forecast_);
    reporter_.result(json);
    reportMemory(memory_forecast_, reporter_);
    reportForecast(forecast_, reporter_, true);
}

/// Bakes the values. The detail about memory uses the forecast for the first bundle; later bundles
/// may have more hits.
void Bake::gather() {
    bool told = false;
    const auto tell = [&](std::uint64_t bytes) {
        takeMemory(bytes);
        if (!std::exchange(told, true))
            reporter_.detail("uses at most " + bytesText(memory_forecast_) + " of memory");
    };
    {
        const SurfaceLookup lookup = texels_ ? texels_->lookup() : vertices_->lookup();
        ProgressReport progress(reporter_, "bake");
        const StageTimer timer(job_.times(), "bake");
        values_ = bake(
            *source_, receivers(), settings_, capture_, lookup,
            [&](double share) { progress.update(share); }, tell);
    }
    // The stage "bake" does not include captures, which have their own stages.
    const StageTimes captures = source_->takeTimes();
    for (const auto& [stage, milliseconds] : captures)
        job_.times()["bake"] -= milliseconds;
    add(job_.times(), captures);
    job_.releaseHits();
    returnFreeMemory();  // for writing the output
}

void Bake::write() {
    const StageTimer timer(job_.times(), "write");
    if (options_.bake.file() == BakeFile::kArrays)
        writeArrays();
    else if (texels_)
        writeTextures();
    else
        writeVertices();
}

/// Returns a writer for the scene's glTF file. If the scene has another format, the writer makes a
/// new glTF.
std::unique_ptr<GlbWriter> Bake::openPackage() const {
    if (scene_->assumed()) return std::make_unique<GlbWriter>(options_.scene.file, scene());
    return std::make_unique<GlbWriter>(options_.scene.file, options_.scene.reading);
}

/// Makes the baked scene the file's default and applies the baked variant, because viewers show the
/// default scene without a variant.
void Bake::showWhatWasBaked(GlbWriter& package) const {
    if (options_.scene.scene) setDefaultScene(package, scene_->index());
    if (const auto variant = chosenVariant(scene(), options_.appearance))
        setVariant(package, *variant);
}

void Bake::writePackage(GlbWriter& package) const {
    for (const Text& warning : package.warnings())
        reporter_.warning(warning);
    package.write(outputs_.front().string());
}

void Bake::writeArrays() {
    const std::size_t components = componentsOf(options_.bake.settings.quantity);
    const std::string path = outputs_.front().string();
    if (texels_)
        writeTexelArrays(path, *texels_, values_, components, options_.bake.texelPadding());
    else
        writeVertexArrays(path, *posed_, *vertices_, values_, components);
}

void Bake::writeVertices() {
    const BakeQuantity quantity = options_.bake.settings.quantity;
    const ShownValues shown(quantity, rangeOf(values_));
    const std::unique_ptr<GlbWriter> package = openPackage();
    showWhatWasBaked(*package);
    addVertexValues(*package, attributeOf(quantity),
                    bakedPrimitives(*posed_, *vertices_, values_, quantity, shown));
    if (options_.bake.values_alone) showVertexColorsAlone(*package);
    writePackage(*package);
}

void Bake::writeTextures() {
    const BakeQuantity quantity = options_.bake.settings.quantity;
    const BakeFile file = options_.bake.file();
    const ShownValues shown(quantity, rangeOf(values_));
    const auto default_material = static_cast<int>(scene().materials.size()) - 1;
    std::vector<ValueTexture> parts;
    std::vector<BakedTexture> occlusion;
    for (std::size_t i = 0; i < texels_->atlases().size(); ++i) {
        const TexelAtlas& atlas = texels_->atlases()[i];
        ValueTexture texture{
            "material_" + std::to_string(atlas.material), texels_->settings().size,
            componentsOf(quantity),
            texels_->pixels(atlas, values_, componentsOf(quantity), options_.bake.texelPadding())};
        if (file == BakeFile::kExr) {
            parts.push_back(std::move(texture));
            continue;
        }
        for (float& value : texture.values)
            value = shown(value);
        if (file == BakeFile::kPng)
            writePngTexture(outputs_[i].string(), texture, kSoftware);
        else
            occlusion.push_back({atlas.material == default_material ? -1 : atlas.material,
                                 encodePng(texture, kTextureBits)});
    }
    if (file == BakeFile::kExr) writeExrTextures(outputs_.front().string(), parts, kSoftware);
    if (file != BakeFile::kGltf) return;
    const std::unique_ptr<GlbWriter> package = openPackage();
    showWhatWasBaked(*package);
    addOcclusionTextures(*package, texels_->settings().uv_set, std::move(occlusion));
    writePackage(*package);
}

void Bake::report() {
    RunResult result;
    job_.finish(result);
    // Only the result contains the hash. The hash must not change the bytes of the baked files.
    result.settings_hash = job_.settingsHash(capture_, bakeSettings(options_.bake));
    result.setFiles(options_.bake.output, outputs_);
    result.forecast_bytes = forecast_.size().bytes;
    result.forecast_memory = memory_forecast_;
    const ValueRange range = rangeOf(values_);
    const BakeSettings& settings = options_.bake.settings;
    const std::string quantity(nameOf<BakeQuantity>(kBakeQuantities, settings.quantity));
    std::vector<std::string> lines;
    for (const WrittenFile& file : *result.files)
        lines.push_back(file.path.string() + ": " + quantity + " of " +
                        countText(receivers().size(), "receiver") + ", " +
                        countText(static_cast<std::uint64_t>(settings.directions), "direction") +
                        ", " + bytesText(file.bytes) + ", " + totalText(result.milliseconds));
    Json found;
    found["quantity"] = quantity;
    found["target"] = targetName(options_.bake.chosenTarget());
    found["directions"] = settings.directions;
    found["resolution"] = settings.resolution;
    found["receivers"] = receivers().size();
    found["least"] = range.least;
    found["mean"] = range.mean;
    found["greatest"] = range.greatest;
    found["textures"] = Json::array();
    if (texels_) {
        for (const TexelAtlas& atlas : texels_->atlases())
            found["textures"].push_back({{"material", atlas.material},
                                         {"texelsCovered", atlas.covered},
                                         {"texelsShared", atlas.shared}});
    }
    reportResult(options_.report, toJson(result, found), lines, reporter_);
}

constexpr const char* kBakeFooter =
    "A .glb gets a COLOR_0 for display (linear, 16 bits, clipped at 1), which viewers multiply\n"
    "with the material's colour. COLOR_0 contains ao and sky-visibility times the existing\n"
    "COLOR_0, bent-normal as n/2+1/2, thickness divided by the largest, irradiance as E/pi\n"
    "(the light that a white surface reflects). The .glb also gets the values themselves as\n"
    "32-bit floats: _AO and so on. A .png contains the values of COLOR_0 without the existing\n"
    "colour, an .exr the values themselves. Normals and distances are in world space. If nodes\n"
    "with the same mesh get different values, each node gets its own copy of the mesh. The\n"
    "instances of a node (EXT_mesh_gpu_instancing) share the mean of their values. Values are\n"
    "those of the front faces.\n"
    "Arrays of n vertices: values (n, 1 or 3), positions and normals (n, 3; world space),\n"
    "float32, and ranges (r, 5; int64): node, instance (among all drawn instances), primitive\n"
    "of its mesh, first vertex and number of vertices. With --target texture, arrays contain\n"
    "material_M (size, size, 1 or 3; v = 0 first) for each material M, and arrays_version.";

}  // namespace

VerbAction declareBake(VerbOptions& verb) {
    const auto options = std::make_shared<BakeCommand>();
    addSceneArgument(verb, *options);
    addBakeOptions(verb, options->bake);
    addShownOptions(verb, *options);
    addUpOption(verb, options->scene.reading);
    addBakedAppearanceOptions(verb, options->appearance);
    addEngineOption(verb, options->engine);
    addRunOptions(verb, *options, "rays are traced in bands; the receivers and one band must fit");
    addDryRunOption(verb, options->bake.dry_run);
    verb.footer(kBakeFooter);
    return [options](Session& session) {
        Bake(*options, session).run();
        return 0;
    };
}

}  // namespace peeler::cmd
