// SPDX-License-Identifier: Apache-2.0
// Compares layers with an independent oracle: OpenEXR reads the file, the matrices in the file's
// header give each pixel's ray, and Embree finds all hits of that ray. Also compares the depth
// planes of a .npz of the same picture with Embree's hits.
#include <ImathMatrix.h>
#include <ImfChannelList.h>
#include <ImfFrameBuffer.h>
#include <ImfInputPart.h>
#include <ImfMultiPartInputFile.h>
#include <ImfStandardAttributes.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <span>

#include <peeler/scene.h>
#include "formats/gltf/gltf_reader.h"
#include "support/edge_distance.h"
#include "support/embree_oracle.h"
#include "support/npz_file.h"
#include "support/test_support.h"

namespace peeler::test {
namespace {

namespace fs = std::filesystem;

glm::dmat4 fromImath(const Imath::M44f& m) {
    // Imath multiplies row vectors from the left, GLM column vectors from the right. So the
    // matrices are transposes of each other, and Imath's rows are GLM's columns.
    glm::dmat4 out;
    for (int i = 0; i < 4; ++i)
        for (int j = 0; j < 4; ++j)
            out[i][j] = static_cast<double>(m[i][j]);
    return out;
}

/// The depths of each pixel, front to back.
using Depths = std::vector<std::vector<float>>;

struct LayeredFile {
    int width = 0, height = 0;
    glm::dmat4 world_to_camera{1}, world_to_ndc{1};
    Depths depths;
};

LayeredFile readFile(const fs::path& path) {
    Imf::MultiPartInputFile file(path.c_str());
    LayeredFile result;
    const auto& header = file.header(0);
    const Imath::Box2i display = header.displayWindow();
    result.width = display.max.x + 1;
    result.height = display.max.y + 1;
    result.world_to_camera = fromImath(Imf::worldToCamera(header));
    result.world_to_ndc = fromImath(Imf::worldToNDC(header));
    const auto width = static_cast<std::size_t>(result.width);
    result.depths.resize(width * static_cast<std::size_t>(result.height));
    for (int part = 0; part < file.parts(); ++part) {
        if (!file.header(part).name().starts_with("layer_")) continue;
        const Imath::Box2i window = file.header(part).dataWindow();
        const auto columns = static_cast<std::size_t>(window.max.x - window.min.x + 1);
        const auto rows = static_cast<std::size_t>(window.max.y - window.min.y + 1);
        std::vector<float> z(columns * rows);
        Imf::FrameBuffer buffer;
        buffer.insert("Z", Imf::Slice::Make(Imf::FLOAT, z.data(), window));
        Imf::InputPart input(file, part);
        input.setFrameBuffer(buffer);
        input.readPixels(window.min.y, window.max.y);
        for (std::size_t y = 0; y < rows; ++y)
            for (std::size_t x = 0; x < columns; ++x)
                if (std::isfinite(z[y * columns + x]))
                    result
                        .depths[(y + static_cast<std::size_t>(window.min.y)) * width + x +
                                static_cast<std::size_t>(window.min.x)]
                        .push_back(z[y * columns + x]);
    }
    return result;
}

/// Reads depth planes. Expects each pixel to have as many depths as its count, followed by NaN.
Depths readPlanes(const fs::path& path) {
    const auto arrays = readNpz(path);
    const auto z = arrays.at("z").as<float>();
    const auto counts = arrays.at("count").as<std::uint32_t>();
    const std::size_t planes = z.size() / counts.size();
    Depths depths;
    for (std::size_t pixel = 0; pixel < counts.size(); ++pixel) {
        const std::span all = std::span(z).subspan(pixel * planes, planes);
        const auto there = all.first(counts[pixel]), behind = all.subspan(counts[pixel]);
        depths.emplace_back(there.begin(), there.end());
        EXPECT_TRUE(std::ranges::all_of(behind, [](float f) { return std::isnan(f); })) << pixel;
    }
    return depths;
}

/// Returns the distance in pixels between a point and the nearest projected triangle edge.
double pixelsToEdge(const TriangleSoup& soup, const LayeredFile& file, double px, double py) {
    double nearest = std::numeric_limits<double>::infinity();
    const glm::dvec2 point(px, py);
    for (const auto& triangle : soup.triangles) {
        glm::dvec2 at[3];
        bool in_front = true;
        for (int i = 0; i < 3; ++i) {
            const glm::dvec4 clip = file.world_to_ndc * glm::dvec4(triangle.corner[i], 1);
            in_front = in_front && clip.w > 0;
            at[i] = glm::dvec2(clip.x / clip.w * file.width, clip.y / clip.w * file.height);
        }
        if (!in_front) continue;
        nearest = std::min(nearest, distanceToEdges(at, point));
    }
    return nearest;
}

/// The agreement of a file's pixels with Embree's hits.
struct Agreement {
    std::size_t covered = 0, disagreeing = 0;
    double worst_edge = 0;  ///< greatest distance of a disagreeing pixel from an edge, in pixels
};

/// Compares the layers with Embree's hits and, if `faces` is "gltf", the depth planes too.
void compareWithEmbree(const fs::path& scene_path, const std::string& faces,
                       const ScratchDir& scratch) {
    const auto render = [&](const char* name, const char* as) {
        const auto run =
            runPeelerProcess({"render", scene_path, "-o", scratch / name, "--as", as, "--size",
                              "400x300", "--faces", faces, "--backend", testBackend(), "--quiet"});
        EXPECT_EQ(run.exit_code, 0) << run.err;
        return scratch / name;
    };
    const LayeredFile file = readFile(render("layers.exr", "ldi"));
    std::map<std::string, Depths> found = {{"layers", file.depths}};
    if (faces == "gltf") found["planes"] = readPlanes(render("planes.npz", "dense"));
    std::map<std::string, Agreement> agreements;

    const TriangleSoup soup = soupOf(readGltf(scene_path));
    AllHits all_hits(soup);
    const glm::dmat4 world_from_ndc = glm::inverse(file.world_to_ndc);
    for (int y = 0; y < file.height; ++y) {
        for (int x = 0; x < file.width; ++x) {
            const double u = (x + 0.5) / file.width, v = (y + 0.5) / file.height;
            const auto unproject = [&](double depth) {
                const glm::dvec4 p = world_from_ndc * glm::dvec4(u, v, depth, 1);
                return glm::dvec3(p) / p.w;
            };
            // Two depths give two points of the ray. The ray begins in the camera's plane, camera z
            // = 0.
            const glm::dvec3 a = unproject(0), b = unproject(0.5);
            const auto camera_z = [&](const glm::dvec3& p) {
                return (file.world_to_camera * glm::dvec4(p, 1)).z;
            };
            const double za = camera_z(a), zb = camera_z(b);
            // This vector along the ray advances camera Z by 1.
            const glm::dvec3 per_z = (b - a) / (zb - za);
            const glm::dvec3 origin = a - za * per_z;
            std::vector<float> hits = all_hits(origin, per_z, faces == "gltf");
            std::sort(hits.begin(), hits.end());
            for (const auto& [name, pixels] : found) {
                const auto& depths = pixels.at(static_cast<std::size_t>(y * file.width + x));
                Agreement& agreement = agreements[name];
                if (hits.empty() && depths.empty()) continue;
                ++agreement.covered;
                const auto same = [](float hit, float z) {
                    return std::abs(hit - z) <= 2e-4F * hit;
                };
                if (std::ranges::equal(hits, depths, same)) continue;
                ++agreement.disagreeing;
                agreement.worst_edge =
                    std::max(agreement.worst_edge, pixelsToEdge(soup, file, x + 0.5, y + 0.5));
            }
        }
    }
    for (const auto& [name, agreement] : agreements) {
        std::printf(
            "%s of %s (--faces %s): %zu covered pixels, %zu disagree, farthest from an "
            "edge %.3f pixels\n",
            name.c_str(), scene_path.filename().c_str(), faces.c_str(), agreement.covered,
            agreement.disagreeing, agreement.worst_edge);
        EXPECT_GT(agreement.covered, 1000U) << name;
        EXPECT_LE(static_cast<double>(agreement.disagreeing),
                  0.001 * static_cast<double>(agreement.covered))
            << name;
        EXPECT_LE(agreement.worst_edge, 1.0) << name;
    }
}

// None of these models has MASK materials, because the oracle does not sample textures.
const char* const kModelsForLayers[] = {
    "2CylinderEngine/glTF/2CylinderEngine.gltf",
    "DamagedHelmet/glTF-Binary/DamagedHelmet.glb",
    "Duck/glTF-Quantized/Duck.gltf",
    "CesiumMilkTruck/glTF/CesiumMilkTruck.gltf",
    "NegativeScaleTest/glTF/NegativeScaleTest.gltf",
    "OrientationTest/glTF/OrientationTest.gltf",
    "MetalRoughSpheresNoTextures/glTF-Binary/MetalRoughSpheresNoTextures.glb",
};

class Oracle : public testing::TestWithParam<const char*> {};
INSTANTIATE_TEST_SUITE_P(Models, Oracle, testing::ValuesIn(kModelsForLayers), [](const auto& row) {
    const std::string path = row.param;
    std::string name = path.substr(0, path.find('/'));
    return name;
});

TEST_P(Oracle, EmbreeFindsTheSameHits) {
    PEELER_REQUIRE_ASSETS(assets);
    const ScratchDir scratch;
    for (const char* faces : {"both", "gltf"})
        compareWithEmbree(assets / "gltf-sample-assets" / GetParam(), faces, scratch);
}

TEST(Oracle, EmbreeFindsTheSameHitsInTheExampleScenes) {
    const ScratchDir scratch;
    for (const char* scene : {"engine.glb", "coincident.glb"})
        compareWithEmbree(sourceDir() / "examples" / "scenes" / scene, "both", scratch);
}

}  // namespace
}  // namespace peeler::test
