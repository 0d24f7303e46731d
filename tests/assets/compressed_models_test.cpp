// SPDX-License-Identifier: Apache-2.0
// Tests that compressed and quantised variants of real models have the same triangles as the plain
// models, with every corner within one quantisation step.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>

#include "core/scene/posed_scene.h"
#include "formats/gltf/gltf_reader.h"
#include "support/test_support.h"

namespace peeler::test {
namespace {

namespace fs = std::filesystem;

/// The triangles of all drawn meshes in world space. `longest` is the longest side of any mesh's
/// bounding box; quantisation divides this side into steps.
struct Soup {
    std::vector<std::array<glm::dvec3, 3>> triangles;
    double longest = 0;
};

Soup decodedSoup(const Scene& scene) {
    Soup soup;
    const PosedScene shown(scene);
    for (const MeshInstance& instance : shown.meshes()) {
        glm::dvec3 low(INFINITY), high(-INFINITY);
        const Mesh& mesh = scene.meshes[static_cast<std::size_t>(instance.mesh)];
        for (std::size_t k = 0; k < mesh.primitives.size(); ++k) {
            const Primitive& primitive = mesh.primitives[k];
            const auto& positions = shown.positions(instance, k);
            EXPECT_EQ(primitive.topology, Topology::kTriangles);
            const auto corner = [&](std::size_t i) {
                const std::size_t vertex =
                    primitive.indices.empty() ? i : std::size_t{primitive.indices[i]};
                const glm::dvec3 p(instance.world * glm::dvec4(glm::dvec3(positions[vertex]), 1));
                low = glm::min(low, p);
                high = glm::max(high, p);
                return p;
            };
            const std::size_t count =
                primitive.indices.empty() ? primitive.positions.size() : primitive.indices.size();
            for (std::size_t i = 0; i + 2 < count; i += 3)
                soup.triangles.push_back({corner(i), corner(i + 1), corner(i + 2)});
        }
        const glm::dvec3 size = high - low;
        soup.longest = std::max({soup.longest, size.x, size.y, size.z});
    }
    return soup;
}

glm::dvec3 middle(const std::array<glm::dvec3, 3>& triangle) {
    return (triangle[0] + triangle[1] + triangle[2]) / 3.0;
}

/// Whether two triangles have the same corners and winding, starting from any corner.
bool alike(const std::array<glm::dvec3, 3>& a, const std::array<glm::dvec3, 3>& b, double step) {
    for (std::size_t turn = 0; turn < 3; ++turn) {
        bool same = true;
        for (std::size_t i = 0; same && i < 3; ++i) {
            const glm::dvec3 d = glm::abs(a[i] - b[(i + turn) % 3]);
            same = std::max({d.x, d.y, d.z}) <= step;
        }
        if (same) return true;
    }
    return false;
}

bool degenerate(const std::array<glm::dvec3, 3>& t, double step) {
    return glm::length(glm::cross(t[1] - t[0], t[2] - t[0])) <=
           4 * step * std::max(glm::length(t[1] - t[0]), glm::length(t[2] - t[0]));
}

/// Returns the number of triangles of `wanted` without a match in `other`. Ignores triangles that
/// quantisation may flatten, because encoders drop them.
std::size_t missing(const Soup& wanted, const Soup& other, double step) {
    std::vector<std::pair<double, std::size_t>> by_x;
    for (std::size_t i = 0; i < other.triangles.size(); ++i)
        by_x.emplace_back(middle(other.triangles[i]).x, i);
    std::sort(by_x.begin(), by_x.end());
    std::size_t result = 0;
    for (const auto& triangle : wanted.triangles) {
        const double x = middle(triangle).x;
        auto candidate =
            std::lower_bound(by_x.begin(), by_x.end(), std::pair<double, std::size_t>{x - step, 0});
        bool found = false;
        for (; !found && candidate != by_x.end() && candidate->first <= x + step; ++candidate)
            found = alike(triangle, other.triangles[candidate->second], step);
        if (!found && !degenerate(triangle, step)) ++result;
    }
    return result;
}

struct Pair {
    const char *name, *plain, *variant;
    int bits;  ///< bits per coordinate; their range is a mesh's longest side
};

// The bits are the quantisation settings of the tools: 11 for gltf-pipeline (Draco), 14 and 16 for
// gltfpack and for the quantised variants.
const Pair kPairs[] = {
    {"BoxDraco", "Box/glTF/Box.gltf", "Box/glTF-Draco/Box.gltf", 11},
    {"DuckDraco", "Duck/glTF/Duck.gltf", "Duck/glTF-Draco/Duck.gltf", 11},
    {"CylinderEngineDraco", "2CylinderEngine/glTF/2CylinderEngine.gltf",
     "2CylinderEngine/glTF-Draco/2CylinderEngine.gltf", 11},
    {"MilkTruckDraco", "CesiumMilkTruck/glTF/CesiumMilkTruck.gltf",
     "CesiumMilkTruck/glTF-Draco/CesiumMilkTruck.gltf", 11},
    {"CesiumManDraco", "CesiumMan/glTF-Binary/CesiumMan.glb", "CesiumMan/glTF-Draco/CesiumMan.gltf",
     11},
    {"RiggedSimpleDraco", "RiggedSimple/glTF/RiggedSimple.gltf",
     "RiggedSimple/glTF-Draco/RiggedSimple.gltf", 11},
    {"MorphPrimitivesDraco", "MorphPrimitivesTest/glTF/MorphPrimitivesTest.gltf",
     "MorphPrimitivesTest/glTF-Draco/MorphPrimitivesTest.gltf", 11},
    {"DuckQuantized", "Duck/glTF/Duck.gltf", "Duck/glTF-Quantized/Duck.gltf", 14},
    {"MorphCubeQuantized", "AnimatedMorphCube/glTF/AnimatedMorphCube.gltf",
     "AnimatedMorphCube/glTF-Quantized/AnimatedMorphCube.gltf", 14},
    {"BoxTexturedMeshopt", "BoxTextured/glTF/BoxTextured.gltf",
     "BoxTexturedMeshopt/BoxTextured_meshopt.glb", 14},
    // The second file stores the decoded data of the first, so the two models are the same bit for
    // bit.
    {"MeshoptWithAndWithoutFallback", "MeshoptFallback/meshopt-fallback.gltf",
     "MeshoptNoFallback/meshopt-no-fallback.gltf", 60},
};

class CompressedModels : public testing::TestWithParam<Pair> {};

TEST_P(CompressedModels, HaveTheTrianglesOfThePlainOne) {
    PEELER_REQUIRE_ASSETS(assets);
    const fs::path folder = assets / "gltf-sample-assets";
    const Soup plain = decodedSoup(readGltf(folder / GetParam().plain));
    const Soup variant = decodedSoup(readGltf(folder / GetParam().variant));
    ASSERT_FALSE(plain.triangles.empty());
    // The tolerance per axis is one step: half a step for quantisation, and half a step for rounded
    // numbers in the plain file.
    const double step = plain.longest * std::ldexp(1.0, -GetParam().bits);
    std::printf("%s: %zu and %zu triangles, step %.3g\n", GetParam().name, plain.triangles.size(),
                variant.triangles.size(), step);
    EXPECT_LE(variant.triangles.size(), plain.triangles.size());
    EXPECT_EQ(missing(plain, variant, step), 0U);
    EXPECT_EQ(missing(variant, plain, step), 0U);
}

INSTANTIATE_TEST_SUITE_P(Pairs, CompressedModels, testing::ValuesIn(kPairs),
                         [](const auto& test) { return std::string(test.param.name); });

/// There is no plain variant, so the test compares with the bounds of the file's accessors.
TEST(CompressedModel, PirateFillsTheBoxOfItsAccessor) {
    PEELER_REQUIRE_ASSETS(assets);
    const Scene scene = readGltf(assets / "gltf-sample-assets/Pirate/pirate.glb");
    const Primitive& primitive = scene.meshes.at(0).primitives.at(0);
    glm::vec3 low(INFINITY), high(-INFINITY);
    for (const glm::vec3& p : primitive.positions) {
        low = glm::min(low, p);
        high = glm::max(high, p);
    }
    EXPECT_EQ(low, glm::vec3(0));
    EXPECT_EQ(high, glm::vec3(13081, 16383, 3915));
    EXPECT_EQ(primitive.indices.size(), 15030U);
    // OCTAHEDRAL normals must have unit length to 8 bits, and must not all be the same.
    glm::vec3 sum(0);
    for (const glm::vec3& n : primitive.normals) {
        EXPECT_NEAR(glm::length(n), 1, 0.02);
        sum += glm::abs(n);
    }
    for (int axis = 0; axis < 3; ++axis)
        EXPECT_GT(sum[axis], 0.2F * static_cast<float>(primitive.normals.size()));
}

}  // namespace
}  // namespace peeler::test
