// SPDX-License-Identifier: Apache-2.0
// Tests that the points of a point cloud lie on the rendered surfaces.
#include <gtest/gtest.h>

#include <cstdio>
#include <cstring>
#include <limits>

#include "formats/gltf/gltf_reader.h"
#include "support/surface_distance.h"
#include "support/test_support.h"

namespace peeler::test {
namespace {

namespace fs = std::filesystem;

/// Reads the first three properties of every point: x, y, z.
std::vector<glm::dvec3> readPoints(const fs::path& path, std::size_t point_size) {
    const std::string bytes = bytesOf(path);
    const std::string end = "end_header\n";
    std::vector<glm::dvec3> points;
    for (std::size_t at = bytes.find(end) + end.size(); at + point_size <= bytes.size();
         at += point_size) {
        std::memcpy(&points.emplace_back(), bytes.data() + at, sizeof(glm::dvec3));
    }
    return points;
}

void expectOnSurface(const fs::path& scene, std::vector<std::string> options) {
    const ScratchDir scratch;
    const fs::path exr = scratch / "out.exr", ply = scratch / "out.ply";
    options.insert(options.begin(), {"render", scene, "-o", exr, "--size", "400x300", "--backend",
                                     testBackend(), "--quiet"});
    auto run = runPeelerProcess(options);
    ASSERT_EQ(run.exit_code, 0) << run.err;
    run = runPeelerProcess({"extract", exr, "--points", ply, "--double", "--quiet"});
    ASSERT_EQ(run.exit_code, 0) << run.err;
    constexpr std::size_t kPointSize = 3 * sizeof(double) + 4 + sizeof(std::uint32_t);
    const std::vector<glm::dvec3> points = readPoints(ply, kPointSize);
    ASSERT_GT(points.size(), 1000U);

    const TriangleSoup soup = soupOf(readGltf(scene));
    glm::dvec3 low(std::numeric_limits<double>::infinity()), high(-low);
    for (const Triangle& triangle : soup.triangles) {
        for (const glm::dvec3& corner : triangle.corner) {
            low = glm::min(low, corner);
            high = glm::max(high, corner);
        }
    }
    const double size = glm::distance(low, high), tolerance = 1e-4 * size;
    const SurfaceDistance distance(soup);
    std::size_t off = 0;
    double farthest = 0;
    for (const glm::dvec3& point : points) {
        const double d = distance(point, 2 * tolerance);
        farthest = std::max(farthest, d);
        off += d <= tolerance ? 0 : 1;
    }
    std::printf("%s: %zu points, %zu farther than 1e-4 of the size, the farthest %.2g of it\n",
                scene.filename().c_str(), points.size(), off, farthest / size);
    EXPECT_LE(static_cast<double>(off), 0.001 * static_cast<double>(points.size()));
}

TEST(SurfacePoints, OfRealModels) {
    PEELER_REQUIRE_ASSETS(assets);
    const fs::path models = assets / "gltf-sample-assets";
    expectOnSurface(models / "DamagedHelmet/glTF-Binary/DamagedHelmet.glb", {"--faces", "both"});
    expectOnSurface(models / "2CylinderEngine/glTF/2CylinderEngine.gltf", {});
}

TEST(SurfacePoints, OfAnExampleSceneFromBothCameras) {
    const fs::path engine = sourceDir() / "examples" / "scenes" / "engine.glb";
    expectOnSurface(engine, {});
    expectOnSurface(engine, {"--camera", "top"});  // an orthographic camera
}

}  // namespace
}  // namespace peeler::test
