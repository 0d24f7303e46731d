// SPDX-License-Identifier: Apache-2.0
// A mesh file that is being read, and the scene made from it.
#include <algorithm>
#include <cmath>
#include <limits>

#include <peeler/error.h>
#include "core/base/color.h"
#include "formats/file/content_hash.h"
#include "formats/file/regular_file.h"
#include "formats/file/text_words.h"
#include "formats/meshes/mesh_parts.h"

namespace peeler {
namespace {

std::vector<std::uint8_t> readWithin(ReadingMemory& memory, const std::filesystem::path& path,
                                     std::uint64_t most_bytes) {
    const RegularFile file(path);
    file.check();
    memory.allow(file.size(), path.string());
    return readRegularFile(path, most_bytes);
}

bool showsSomething(const Mesh& mesh) {
    return std::ranges::any_of(mesh.primitives,
                               [](const Primitive& p) { return !p.positions.empty(); });
}

}  // namespace

std::string_view withoutByteOrderMark(std::string_view text) {
    constexpr std::string_view kMark = "\xEF\xBB\xBF";
    if (text.starts_with(kMark)) text.remove_prefix(kMark.size());
    return text;
}

Material plainMaterial(const std::string& name, const glm::vec4& color) {
    Material material;
    material.name = name;
    material.base_color = color;
    material.metallic = 0;
    material.double_sided = true;
    return material;
}

std::optional<float> coordinate(double value) {
    if (!(std::abs(value) <= double{std::numeric_limits<float>::max()})) return {};
    return static_cast<float>(value);
}

bool makeLinear(std::vector<glm::vec4>& colors, const ColorTypes& types) {
    constexpr float kRounded = 1.001F;  // tolerance for rounded sums of weights
    float most_rgb = 0, most_alpha = 0;
    bool whole = true;
    for (const glm::vec4& color : colors) {
        if (color.a < 0) continue;
        most_rgb = std::max({most_rgb, color.r, color.g, color.b});
        most_alpha = std::max(most_alpha, color.a);
        whole = whole && glm::vec3(color) == glm::floor(glm::vec3(color));
    }
    bool fits = true;
    const auto unitOf = [&](float most, double greatest) {
        if (greatest == 255) return 255.0F;
        if (greatest == 1 && most <= kRounded) return 1.0F;
        for (const float unit : {255.0F, 65535.0F})
            if (whole && most <= unit) return unit;
        fits = false;
        return static_cast<float>(greatest);
    };
    const float rgb = unitOf(most_rgb, types.rgb), alpha = unitOf(most_alpha, types.alpha);
    const auto share = [](float value, float unit) { return std::clamp(value / unit, 0.0F, 1.0F); };
    for (glm::vec4& color : colors) {
        if (color.a < 0) continue;
        for (int c = 0; c < 3; ++c)
            color[c] = linearFromSrgb(share(color[c], rgb));
        color.a = share(color.a, alpha);
    }
    return fits;
}

MeshFile::MeshFile(const std::filesystem::path& path, const SceneReadOptions& options)
    : options_(options),
      name_(path.string()),
      memory_(options.memory),
      geometry_("the geometry needs", options.max_geometry_bytes),
      bytes_(readWithin(memory_, path, options.max_file_bytes)),
      folder_(path, options.max_file_bytes, options.allow_outside),
      warnings_(options.strict, name_) {
    scene_.content_hash = contentHash(std::as_bytes(std::span(bytes_)), 0);
}

std::string_view MeshFile::text() const {
    return {reinterpret_cast<const char*>(bytes_.data()), bytes_.size()};
}

std::string MeshFile::stem() const {
    return std::filesystem::path(name_).stem().string();
}

void MeshFile::allowGeometry(std::uint64_t bytes) {
    geometry_.take(bytes, name_);
    allow(bytes);
}

std::uint64_t MeshFile::memoryLeft() const {
    return memory_.budget() == 0 ? std::numeric_limits<std::uint64_t>::max() : memory_.left();
}

std::string MeshFile::atLine(std::size_t place) const {
    return name_ + ":" + std::to_string(lineAt(text(), place));
}

std::string MeshFile::atByte(std::size_t place) const {
    return name_ + ", byte " + std::to_string(place);
}

std::vector<std::uint8_t> MeshFile::readBeside(const std::string& file, const std::string& from,
                                               const std::string& where) {
    if (const auto path = folder_.findFile(file, from);
        path && std::ranges::find(scene_.files, *path) == scene_.files.end())
        scene_.files.push_back(*path);
    std::vector<std::uint8_t> bytes = folder_.readFile(file, from, where, warnings_);
    scene_.content_hash = contentHash(std::as_bytes(std::span(bytes)), scene_.content_hash);
    return bytes;
}

std::string MeshFile::folderOf(const std::string& file) const {
    return std::filesystem::path(folder_.nameOf(file)).parent_path().generic_string();
}

void MeshFile::missing(const std::string& what, const Error& problem, const std::string& where) {
    if (problem.kind() != ErrorKind::kInput) throw Error(problem);
    const Text why = what + ": " + problem.whatText();
    warnings_.warn(what + " (" + where + "): " + problem.whatText() + ".",
                   Error(ErrorKind::kInput, why, where, problem.hintText()));
}

int MeshFile::addMesh(const std::string& mesh_name, Mesh mesh) {
    for (std::size_t i = 0; i < mesh.primitives.size(); ++i) {
        mesh.primitives[i].source.primitive = i;
        mesh.primitives[i].source.vertices = mesh.primitives[i].positions.size();
    }
    mesh.name = mesh_name;
    scene_.meshes.push_back(std::move(mesh));
    return static_cast<int>(scene_.meshes.size()) - 1;
}

int MeshFile::addNode(const std::string& node_name, Mesh mesh) {
    Node node;
    node.name = node_name;
    if (showsSomething(mesh)) node.mesh = addMesh(node_name, std::move(mesh));
    scene_.nodes.push_back(std::move(node));
    return static_cast<int>(scene_.nodes.size()) - 1;
}

int MeshFile::neutralMaterial() {
    if (neutral_ < 0) {
        neutral_ = static_cast<int>(scene_.materials.size());
        scene_.materials.push_back(plainMaterial("neutral", {0.5F, 0.5F, 0.5F, 1}));
    }
    return neutral_;
}

int MeshFile::colorMaterial() {
    if (colored_ < 0) {
        colored_ = static_cast<int>(scene_.materials.size());
        scene_.materials.push_back(plainMaterial("colours", glm::vec4(1)));
    }
    return colored_;
}

Scene MeshFile::finish() {
    const bool smooth = options_.smooth_normals.has_value();
    for (Mesh& mesh : scene_.meshes) {
        for (Primitive& primitive : mesh.primitives) {
            if (!smooth || !primitive.normals.empty() || primitive.topology != Topology::kTriangles)
                continue;
            addSmoothNormals(primitive, *options_.smooth_normals,
                             [&](std::uint64_t bytes) { allow(bytes); });
            primitive.source.vertices = primitive.positions.size();
        }
    }
    if (scene_.meshes.empty()) warn("There is nothing to draw in the file.");
    // glTF's default material, which is always the last; these formats do not use it.
    scene_.materials.emplace_back();
    scene_.scenes.push_back({"", rootsOf(scene_.nodes)});
    scene_.warnings = warnings_.take();
    return std::move(scene_);
}

}  // namespace peeler
