// SPDX-License-Identifier: Apache-2.0
// Prints hashes of all data of CPU hits for same_hits.py, one line per scene and view.
//
//     hit_hashes [FILE ...]
//
// A FILE has a mesh: the numbers of vertices and indices (uint32), then positions (3 floats each)
// and indices (uint32).
#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <fstream>
#include <random>
#include <span>
#include <stdexcept>
#include <string>
#include <tuple>
#include <type_traits>
#include <vector>

#include <peeler/bundle.h>
#include "core/lens/picture_rays.h"
#include "core/raster/hit_rasterizer.h"
#include "core/trace/traced_hits.h"
#include "support/closed_meshes.h"
#include "support/traced_hits.h"

namespace peeler::test {
namespace {

/// An FNV-1a hash of the bytes of numbers.
class Hash {
  public:
    template <class Value>
    void add(std::span<Value> values) {
        static_assert(std::is_trivially_copyable_v<Value>);
        for (const std::byte byte : std::as_bytes(values)) {
            value_ ^= static_cast<std::uint64_t>(byte);
            value_ *= 0x100000001B3U;
        }
    }
    void add(const LayeredImage& image) {
        add(std::span(image.offsets));
        add(std::span(image.z));
        add(std::span(image.color.data));
        for (const FragmentArray& array : image.extra)
            add(std::span(array.data));
    }
    unsigned long long value() const { return value_; }

  private:
    std::uint64_t value_ = 0xCBF29CE484222325U;
};

/// Returns triangles of many sizes. Their coordinates are exact in binary, so all builds start with
/// the same scene. A texture cuts holes into a third of the triangles.
Scene generated() {
    std::mt19937 random(20);
    const auto number = [&](int bits) {
        const auto half = static_cast<int>(1U << (bits - 1));
        return static_cast<float>(static_cast<int>(random() >> (32 - bits)) - half) / 4096;
    };
    std::vector<Primitive> primitives(3);
    for (std::size_t p = 0; p < primitives.size(); ++p) {
        Primitive& primitive = primitives[p];
        primitive.material = static_cast<int>(p);
        for (int i = 0; i < 4000; ++i) {
            const glm::vec3 center(number(14), number(14), number(14));
            const int bits = 6 + i % 8;
            for (int k = 0; k < 3; ++k) {
                primitive.positions.push_back(center +
                                              glm::vec3(number(bits), number(bits), number(bits)));
                primitive.normals.emplace_back(number(13), number(13), 1);
                primitive.texcoords[0].emplace_back(number(14), number(14));
            }
        }
    }
    Scene scene = sceneOf({{"", primitives}});
    Image image;
    image.width = 64;
    image.height = 32;
    for (int i = 0; i < 4 * 64 * 32; ++i)
        image.rgba.push_back(static_cast<std::uint8_t>(random() >> 24));
    scene.images = {image};
    scene.materials[1].alpha_mode = AlphaMode::kMask;
    for (const std::size_t textured : {1U, 2U})
        scene.materials[textured].base_color_texture.image = 0;
    // A rotation whose entries are not exact in binary.
    scene.nodes[0].local = {
        {0.36, 0.48, -0.8, 0}, {-0.8, 0.6, 0, 0}, {0.48, 0.64, 0.6, 0}, {0.1, 0.2, 0.3, 1}};
    return scene;
}

Scene meshIn(const std::string& path) {
    std::ifstream file(path, std::ios::binary);
    const auto read = [&](auto* values, std::size_t count) {
        file.read(reinterpret_cast<char*>(values),
                  static_cast<std::streamsize>(count * sizeof *values));
    };
    std::uint32_t counts[2] = {};
    read(counts, 2);
    Primitive primitive;
    primitive.positions.resize(counts[0]);
    primitive.indices.resize(counts[1]);
    read(primitive.positions.data(), counts[0]);
    read(primitive.indices.data(), counts[1]);
    if (!file) throw std::runtime_error("cannot read " + path);
    return sceneOf({{"", {primitive}}});
}

void printHashes(const std::string& name, const Scene& scene) {
    Hash input;
    for (const Mesh& mesh : scene.meshes)
        for (const Primitive& primitive : mesh.primitives)
            input.add(std::span(primitive.positions));
    std::printf("%s: the triangles %016llx\n", name.c_str(), input.value());
    const PosedScene posed(scene);
    const Bounds box = posed.bounds().value();
    std::vector<View> views;
    for (const glm::dvec3& direction :
         {glm::dvec3(1, 2, 3), glm::dvec3(0, 0, -1), glm::dvec3(-0.3, 0.01, 0.2)})
        views.push_back(parallelBundle("b", box, box, direction, {160}).view);
    View eye;  // a camera inside the box, so that triangles are clipped
    const glm::dvec3 toward(-0.5, -0.3, -0.8);
    eye.camera_to_world = *lookAlong(0.6 * box.max + 0.4 * box.min, toward, {0.1, 1, 0.2});
    eye.width = eye.height = 160;
    eye.crop = {0, 0, 160, 160};
    eye.projection.half_width = eye.projection.half_height = 0.7;
    eye.projection.near = 0.01 * glm::length(box.max - box.min);
    views.push_back(eye);
    // Lenses see the same from the same eye, and a moving camera sees it from two.
    eye.projection.near = 0;
    for (const auto& [model, coefficients, size] :
         {std::tuple("fisheye", std::vector<double>(), Size{160, 160}),
          std::tuple("opencv", std::vector{0.1, -0.02, 1e-3, -2e-3, 0.01}, Size{160, 160}),
          std::tuple("equirectangular", std::vector<double>(), Size{320, 160})}) {
        eye.width = size.width;
        eye.height = size.height;
        eye.crop = {0, 0, size.width, size.height};
        eye.rays = lensPicture({{model, coefficients}, {60, 61, 79.3, 80.1}}, size);
        views.push_back(eye);
    }
    View moving = views[views.size() - 2];
    moving.rays = shutterPicture(moving.rays, {eye.camera_to_world, views[0].camera_to_world}, 160);
    moving.camera_to_world = glm::dmat4(1);
    views.push_back(moving);
    HitRasterizer rasterizer(posed);
    peeler::TracedHits source(posed, &rasterizer);
    for (const View& view : views) {
        for (const HitMode mode : {HitMode::kRefined, HitMode::kSloped}) {
            if (view.rays && mode == HitMode::kSloped) continue;
            CaptureSettings settings = hitSettings(mode);
            settings.depth_clamp = mode == HitMode::kRefined;
            settings.channels = {Channel::kNormal,   Channel::kGeometricNormal, Channel::kFacing,
                                 Channel::kId,       Channel::kBarycentric,     Channel::kDistance,
                                 Channel::kBaseColor};
            std::ranges::sort(settings.channels);
            const TracedHits traced = trace(source, view, settings);
            Hash hash;
            hash.add(traced.image);
            std::printf("%s: %s%s, %zu hits %016llx\n", name.c_str(),
                        view.rays                     ? view.rays->text().c_str()
                        : view.projection.perspective ? "a pinhole"
                                                      : "parallel rays",
                        mode == HitMode::kSloped ? " with slopes" : "", traced.image.fragments(),
                        hash.value());
        }
    }
}

}  // namespace
}  // namespace peeler::test

int main(int count, char** arguments) try {
    using namespace peeler::test;
    printHashes("generated triangles", generated());
    for (const std::string path : std::span(arguments, static_cast<std::size_t>(count)).subspan(1))
        printHashes(path.substr(path.rfind('/') + 1), meshIn(path));
    return 0;
} catch (const std::exception& error) {
    std::fprintf(stderr, "hit_hashes: %s\n", error.what());
    return 1;
}
