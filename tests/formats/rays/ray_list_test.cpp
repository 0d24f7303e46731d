// SPDX-License-Identifier: Apache-2.0
// Tests lists of rays in files of NumPy.
#include "formats/rays/ray_list.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <fstream>
#include <limits>

#include <peeler/error.h>
#include "core/scene/view.h"
#include "formats/arrays/array_writer.h"
#include "support/test_support.h"

namespace peeler::test {
namespace {

using Numbers = std::vector<double>;

void writeFile(const std::filesystem::path& path, const std::string& bytes) {
    std::ofstream(path, std::ios::binary) << bytes;
}

struct TestArray {
    const char* name;
    std::vector<std::uint64_t> shape;
    Numbers numbers;
};

std::string written(const std::string& path, const std::vector<TestArray>& arrays) {
    std::vector<NamedArray> names;
    for (const TestArray& array : arrays)
        names.push_back({array.name, NumberType::kDouble, array.shape});
    ArrayWriter writer(path, names);
    for (std::size_t i = 0; i < arrays.size(); ++i)
        writer.append(i, asBytes(arrays[i].numbers));
    writer.finish();
    return path;
}

/// Returns a .npy of 32-bit floats.
std::string npy(const std::string& shape, const std::vector<float>& numbers) {
    std::string header = "{'descr': '<f4', 'fortran_order': False, 'shape': " + shape + ", }";
    header.resize(118 - 1, ' ');
    header += '\n';
    std::string text =
        std::string("\x93NUMPY\x01\x00", 8) + static_cast<char>(header.size()) + '\0' + header;
    text.append(reinterpret_cast<const char*>(numbers.data()), numbers.size() * sizeof(float));
    return text;
}

Ray rayAt(const Bundle& bundle, int x, int y) {
    return rayOf(bundle.view, glm::dvec2(x, y) + 0.5);
}

void expectRay(const Ray& ray, const glm::dvec3& origin, const glm::dvec3& direction) {
    EXPECT_LT(glm::distance(ray.origin, origin), 1e-12);
    EXPECT_LT(glm::distance(ray.direction, direction), 1e-12);
}

TEST(RayList, RowsAreOriginAndDirection) {
    const ScratchDir scratch;
    const auto path = scratch / "r.npy";
    writeFile(path, npy("(3, 6)", {1, 2, 3, 0, 0, -2, 0, 0, 0, 3, 4, 0, 0, 0, 0, 0, 0, 0}));
    const auto bundles = readRays(path);
    ASSERT_EQ(bundles.size(), 1U);
    const View& view = bundles[0].view;
    EXPECT_EQ(view.crop, (Window{0, 0, 1, 3}));
    EXPECT_FALSE(bundles[0].oneEye());
    EXPECT_EQ(bundles[0].tScale(0, 0), 1);
    expectRay(rayAt(bundles[0], 0, 0), {1, 2, 3}, {0, 0, -1});
    expectRay(rayAt(bundles[0], 0, 1), {0, 0, 0}, {0.6, 0.8, 0});
    expectRay(rayAt(bundles[0], 0, 2), {0, 0, 0}, {0, 0, 0});  // without a direction
}

TEST(RayList, APictureOfRaysKeepsItsShape) {
    const ScratchDir scratch;
    Numbers rays;
    for (int i = 0; i < 6; ++i)
        rays.insert(rays.end(), {double(i), 0, 0, 0, 1e200 * (i + 1), 0});
    const auto bundles = readRays(written(scratch / "r.npz", {{"rays", {2, 3, 6}, rays}}));
    EXPECT_EQ(bundles[0].view.crop, (Window{0, 0, 3, 2}));
    expectRay(rayAt(bundles[0], 1, 1), {4, 0, 0}, {0, 1, 0});
    std::vector<Ray> some(4);
    bundles[0].view.rays->fill({1, 0, 3, 2}, glm::dvec2(0.5), some);
    EXPECT_EQ(some[3].origin.x, 5);

    const auto apart =
        readRays(written(scratch / "a.npz", {{"origins", {2, 3}, {1, 2, 3, 4, 5, 6}},
                                             {"directions", {2, 3}, {1, 0, 0, 0, 2, 0}}}));
    expectRay(rayAt(apart[0], 0, 1), {4, 5, 6}, {0, 1, 0});
}

TEST(RayList, RaysThatAreNotFiniteHaveNoDirection) {
    const ScratchDir scratch;
    constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
    const auto bundles =
        readRays(written(scratch / "r.npz", {{"rays",
                                              {3, 6},
                                              {0, 0, kNan, 0, 0, 1, 0, 0, 0, 0, kNan, 0, 1, 2, 3, 0,
                                               std::numeric_limits<double>::infinity(), 0}}}));
    for (int i = 0; i < 3; ++i)
        expectRay(rayAt(bundles[0], 0, i), glm::dvec3(0), glm::dvec3(0));
}

TEST(RayList, BeamsTurnFromTheSensorsXToItsY) {
    const ScratchDir scratch;
    const Numbers azimuths = {0, 90, 180}, elevations = {30, -90};
    const auto still = readRays(
        written(scratch / "l.npz", {{"azimuths", {3}, azimuths}, {"elevations", {2}, elevations}}));
    EXPECT_EQ(still[0].view.crop, (Window{0, 0, 3, 2}));
    const double c = std::cos(M_PI / 6);
    expectRay(rayAt(still[0], 0, 0), glm::dvec3(0), {0, 0.5, -c});
    expectRay(rayAt(still[0], 1, 0), glm::dvec3(0), {-c, 0.5, 0});
    expectRay(rayAt(still[0], 2, 0), glm::dvec3(0), {0, 0.5, c});
    expectRay(rayAt(still[0], 2, 1), glm::dvec3(0), {0, -1, 0});

    // The sensor's axes are the world's; it moves along x between columns.
    Numbers poses;
    for (int i = 0; i < 3; ++i)
        poses.insert(poses.end(), {1, 0, 0, 10.0 * i, 0, 1, 0, 5, 0, 0, 1, 0, 0, 0, 0, 1});
    const auto moving = readRays(written(scratch / "m.npz", {{"azimuths", {3}, azimuths},
                                                             {"elevations", {2}, elevations},
                                                             {"poses", {3, 4, 4}, poses}}));
    expectRay(rayAt(moving[0], 1, 0), {10, 5, 0}, {0, c, 0.5});
    const auto table =
        readRays(written(scratch / "t.npz",
                         {{"angles", {3, 2}, {0, 0, 90, 30, 0, 90}}, {"poses", {3, 4, 4}, poses}}));
    EXPECT_EQ(table[0].view.crop, (Window{0, 0, 1, 3}));
}

TEST(RayList, AMovingTableGivesEachRayItsPose) {
    const ScratchDir scratch;
    Numbers poses;
    for (int i = 0; i < 2; ++i)
        poses.insert(poses.end(), {1, 0, 0, 10.0 * i, 0, 1, 0, 5, 0, 0, 1, 0, 0, 0, 0, 1});
    const auto table = readRays(written(
        scratch / "t.npz", {{"angles", {2, 2}, {0, 0, 90, 30}}, {"poses", {2, 4, 4}, poses}}));
    expectRay(rayAt(table[0], 0, 0), {0, 5, 0}, {1, 0, 0});
    expectRay(rayAt(table[0], 0, 1), {10, 5, 0}, {0, std::cos(M_PI / 6), 0.5});
}

TEST(RayList, OtherShapesAreRefused) {
    const ScratchDir scratch;
    const auto refused = [&](const std::string& path, const char* what) {
        try {
            readRays(path);
            ADD_FAILURE() << what;
        } catch (const Error& error) {
            EXPECT_EQ(error.kind(), ErrorKind::kInput);
            EXPECT_TRUE(contains(error.what(), what)) << error.what();
        }
    };
    const auto npz = [&](const std::vector<TestArray>& arrays) {
        return written(scratch / "x.npz", arrays);
    };
    const auto file = [&](const std::string& bytes) {
        const auto path = scratch / "x.npy";
        writeFile(path, bytes);
        return path.string();
    };
    refused(file(""), "neither a .npy");
    refused(file("PK\x03\x04"), "");
    refused(file(npy("(2, 3)", {1, 2, 3, 4, 5, 6})), "(2, 3), not (n, 6)");
    refused(file(npy("(0, 6)", {})), "no rays");
    refused(npz({{"origins", {1, 3}, {1, 2, 3}}}), "not both");
    refused(npz({{"origins", {1, 3}, {1, 2, 3}}, {"directions", {2, 3}, Numbers(6)}}), "not both");
    refused(npz({{"azimuths", {1}, {1}}}), "no arrays `rays`");
    refused(npz({{"angles", {1, 2}, {1, 2}}, {"poses", {3, 4, 4}, Numbers(48)}}), "(3, 4, 4)");
    refused((scratch / "none.npy").string(), "does not exist");
}

}  // namespace
}  // namespace peeler::test
