// SPDX-License-Identifier: Apache-2.0
// Tests Draco-compressed primitives: output of the library's encoder, fallbacks, and wrong claims.
#include <draco/compression/expert_encode.h>
#include <draco/mesh/mesh.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <random>

#include "formats/file/lying_helper.h"
#include "formats/gltf/gltf_builder.h"
#include "formats/gltf/gltf_decoders.h"

namespace peeler::test {
namespace {

constexpr const char* kName = "KHR_draco_mesh_compression";

/// A mesh to encode: vertices on a wavy grid of n × n, their triangles, and optional attributes.
struct Grid {
    std::uint32_t n = 0;
    std::vector<std::array<float, 3>> positions;
    std::vector<std::array<std::uint32_t, 3>> faces;
    std::vector<std::array<std::uint8_t, 4>> joints;
    /// Colours, also used as weights, since the four values add up to 1.
    std::vector<std::array<std::uint8_t, 4>> colors;

    explicit Grid(std::uint32_t size) : n(size) {
        for (std::uint32_t y = 0; y < n; ++y)
            for (std::uint32_t x = 0; x < n; ++x) {
                const auto fx = static_cast<float>(x), fy = static_cast<float>(y);
                positions.push_back({fx, fy, std::sin(0.7F * fx) * std::cos(0.3F * fy)});
                joints.push_back({static_cast<std::uint8_t>(x % 200), 1, 2, 3});
                const auto share = static_cast<std::uint8_t>(x % 128);
                colors.push_back({share, 100, 20, static_cast<std::uint8_t>(135 - share)});
            }
        for (std::uint32_t y = 0; y + 1 < n; ++y)
            for (std::uint32_t x = 0; x + 1 < n; ++x) {
                const std::uint32_t a = y * n + x, b = a + 1, c = a + n, d = c + 1;
                faces.push_back({a, b, c});
                faces.push_back({c, b, d});
            }
    }

    /// Fills libdraco's mesh with positions (ID 0), generic joints (1) and normalised colours (2).
    void fill(draco::Mesh& result) const {
        result.SetNumFaces(faces.size());
        for (std::uint32_t i = 0; i < faces.size(); ++i)
            result.SetFace(draco::FaceIndex(i),
                           {draco::PointIndex(faces[i][0]), draco::PointIndex(faces[i][1]),
                            draco::PointIndex(faces[i][2])});
        const auto count = static_cast<std::uint32_t>(positions.size());
        result.set_num_points(count);
        const auto add = [&](draco::GeometryAttribute::Type type, int components,
                             draco::DataType data_type, bool normalized, const auto& values) {
            draco::GeometryAttribute info;
            info.Init(type, nullptr, static_cast<std::uint8_t>(components), data_type, normalized,
                      static_cast<std::int64_t>(sizeof(values[0])), 0);
            const int id = result.AddAttribute(info, true, count);
            for (std::uint32_t i = 0; i < count; ++i)
                result.attribute(id)->SetAttributeValue(draco::AttributeValueIndex(i),
                                                        values[i].data());
        };
        add(draco::GeometryAttribute::POSITION, 3, draco::DT_FLOAT32, false, positions);
        add(draco::GeometryAttribute::GENERIC, 4, draco::DT_UINT8, false, joints);
        add(draco::GeometryAttribute::COLOR, 4, draco::DT_UINT8, true, colors);
    }

    Bytes encode(int method, int position_bits = 14) const {
        draco::Mesh source;
        fill(source);
        draco::ExpertEncoder encoder(source);
        encoder.SetEncodingMethod(method);
        if (position_bits > 0) encoder.SetAttributeQuantization(0, position_bits);
        draco::EncoderBuffer buffer;
        const draco::Status status = encoder.EncodeToBuffer(&buffer);
        if (!status.ok()) throw std::runtime_error(status.error_msg_string());
        return {buffer.data(), buffer.data() + buffer.size()};
    }
};

/// Returns a file whose accessors have no buffer view. With `mode` 5, the primitive is a triangle
/// strip.
GltfBuilder dracoGrid(const Grid& grid, const Bytes& bytes, int mode = 4) {
    GltfBuilder builder;
    const int view = builder.addView(bytes);
    const std::size_t points = grid.positions.size();
    const auto accessor = [](int type, const char* shape, std::size_t count) {
        return Json{{"componentType", type}, {"type", shape}, {"count", count}};
    };
    builder.gltf["accessors"] = {
        accessor(5126, "VEC3", points), accessor(5121, "VEC4", points),
        accessor(5121, "VEC4", points),
        accessor(5125, "SCALAR", mode == 4 ? 3 * grid.faces.size() : grid.faces.size() + 2)};
    builder.gltf["accessors"][2]["normalized"] = true;
    builder.gltf["meshes"] = {{{"primitives", Json::array({Json::object()})}}};
    builder.primitive() = {
        {"mode", mode},
        {"indices", 3},
        {"attributes", {{"POSITION", 0}, {"JOINTS_0", 1}, {"COLOR_0", 2}, {"WEIGHTS_0", 2}}},
        {"extensions",
         {{kName,
           {{"bufferView", view},
            {"attributes",
             {{"POSITION", 0}, {"JOINTS_0", 1}, {"COLOR_0", 2}, {"WEIGHTS_0", 2}}}}}}}};
    builder.gltf["nodes"] = {{{"mesh", 0}}};
    builder.gltf["scenes"] = {{{"nodes", {0}}}};
    builder.gltf["extensionsRequired"] = builder.gltf["extensionsUsed"] = {kName};
    return builder;
}

Json& dracoExtension(GltfBuilder& builder) {
    return builder.primitive()["extensions"][kName];
}

/// Returns the corners of all triangles in sorted order. Each triangle begins with its smallest
/// corner, so that the result is the same if an encoder renumbers vertices or rotates triangles.
std::vector<std::array<std::array<long, 3>, 3>> shapes(const std::vector<glm::vec3>& positions,
                                                       const std::vector<std::uint32_t>& indices) {
    std::vector<std::array<std::array<long, 3>, 3>> result;
    for (std::size_t i = 0; i + 2 < indices.size(); i += 3) {
        auto& shape = result.emplace_back();
        for (std::size_t c = 0; c < 3; ++c)
            for (int axis = 0; axis < 3; ++axis)
                // Uses only x and y, which are whole numbers and identify the vertex.
                shape[c][static_cast<std::size_t>(axis)] =
                    std::lround(positions[indices[i + c]][axis] * (axis == 2 ? 0.0F : 1.0F));
        std::rotate(shape.begin(), std::min_element(shape.begin(), shape.end()), shape.end());
    }
    std::sort(result.begin(), result.end());
    return result;
}

void expectGrid(const Grid& grid, const Primitive& primitive, float tolerance) {
    ASSERT_EQ(primitive.topology, Topology::kTriangles);
    ASSERT_EQ(primitive.indices.size(), 3 * grid.faces.size());
    std::vector<glm::vec3> positions;
    for (const auto& p : grid.positions)
        positions.emplace_back(p[0], p[1], p[2]);
    std::vector<std::uint32_t> indices;
    for (const auto& face : grid.faces)
        indices.insert(indices.end(), face.begin(), face.end());
    EXPECT_EQ(shapes(primitive.positions, primitive.indices), shapes(positions, indices));
    for (std::size_t i = 0; i < primitive.positions.size(); ++i) {
        const glm::vec3& p = primitive.positions[i];
        const auto x = static_cast<std::size_t>(std::lround(p.x)),
                   y = static_cast<std::size_t>(std::lround(p.y));
        const std::size_t vertex = y * grid.n + x;
        for (int axis = 0; axis < 3; ++axis)
            ASSERT_NEAR(p[axis], positions[vertex][axis], tolerance);
        for (int c = 0; c < 4; ++c)
            ASSERT_EQ(primitive.colors[i][c],
                      static_cast<float>(grid.colors[vertex][static_cast<std::size_t>(c)]) / 255);
    }
}

TEST(GltfDraco, GivesBackWhatWasEncodedByBothMethods) {
    const Grid grid(20);
    for (const int method : {draco::MESH_SEQUENTIAL_ENCODING, draco::MESH_EDGEBREAKER_ENCODING}) {
        // With 14 bits for a range of 19, the error is at most half a step; without quantisation,
        // it is 0.
        const std::pair<int, float> precisions[] = {{14, 19.0F / 16383}, {0, 0}};
        for (const auto& [bits, tolerance] : precisions) {
            SCOPED_TRACE(std::to_string(method) + ", " + std::to_string(bits));
            const Scene scene = load(dracoGrid(grid, grid.encode(method, bits)));
            expectGrid(grid, scene.meshes[0].primitives[0], tolerance);
            EXPECT_TRUE(scene.warnings.empty());
        }
    }
}

TEST(GltfDraco, KeepsIntegersOfSkinsAsTheyAre) {
    const Grid grid(20);
    const DracoAttribute wanted[] = {{1, 5121, 4}, {1, 5123, 4}, {0, 5126, 3}};
    const Bytes bytes = grid.encode(draco::MESH_EDGEBREAKER_ENCODING);
    const DracoMesh mesh = decodeDracoMesh(bytes, wanted, {2000, 2000});
    ASSERT_EQ(mesh.attributes.size(), 3U);
    ASSERT_EQ(mesh.attributes[0].size(), mesh.points * 4);
    ASSERT_EQ(mesh.attributes[1].size(), mesh.points * 8);
    for (std::size_t i = 0; i < mesh.points; ++i) {
        float x = 0;
        std::memcpy(&x, mesh.attributes[2].data() + 12 * i, 4);
        EXPECT_EQ(mesh.attributes[0][4 * i], std::lround(x));
        EXPECT_EQ(mesh.attributes[0][4 * i + 3], 3);
        EXPECT_EQ(mesh.attributes[1][8 * i], std::lround(x));
        EXPECT_EQ(mesh.attributes[1][8 * i + 1], 0);
    }
}

TEST(GltfDraco, DecodesStripsToTheirTriangles) {
    const Grid grid(9);
    const Bytes bytes = grid.encode(draco::MESH_EDGEBREAKER_ENCODING);
    expectGrid(grid, load(dracoGrid(grid, bytes, 5)).meshes[0].primitives[0], 1e-3F);
}

TEST(GltfDraco, DecodesSharedDataOnceAndForEveryPrimitive) {
    const Grid grid(9);
    GltfBuilder builder = dracoGrid(grid, grid.encode(draco::MESH_EDGEBREAKER_ENCODING));
    for (Json* attributes : {&builder.attributes(), &dracoExtension(builder)["attributes"]})
        for (const char* name : {"JOINTS_0", "WEIGHTS_0"})
            attributes->erase(name);
    Json& primitives = builder.gltf["meshes"][0]["primitives"];
    primitives.push_back(primitives[0]);
    GltfOptions options;
    // One decoding counts as 12 + 4 bytes per point (at most 3 points per triangle) and 12 bytes
    // per triangle. The limit allows one decoding for both primitives; with one byte less, reading
    // must fail.
    options.max_geometry_bytes = grid.faces.size() * (3 * 16 + 12);
    EXPECT_EQ(load(builder).meshes[0].primitives.size(), 2U);
    EXPECT_EQ(load(builder, options).meshes[0].primitives.size(), 2U);
    options.max_geometry_bytes -= 1;
    EXPECT_EQ(errorOf(builder, options).where(),
              std::string("/meshes/0/primitives/0/extensions/") + kName);
}

TEST(GltfDraco, GoesBeforeTheFallbackUnlessItIsDamaged) {
    const Grid grid(5);
    const Bytes bytes = grid.encode(draco::MESH_EDGEBREAKER_ENCODING);
    GltfBuilder builder = dracoGrid(grid, bytes);
    builder.gltf.erase("extensionsRequired");
    builder.primitive()["attributes"] = {{"POSITION", 0}};
    const int corners = builder.addView(toBytes<float>({0, 0, 9, 1, 0, 9, 0, 1, 9}));
    const int indices = builder.addView(toBytes<std::uint32_t>({0, 1, 2}));
    GltfBuilder with_fallback = builder;
    with_fallback.gltf["accessors"][0]["bufferView"] = corners;
    with_fallback.gltf["accessors"][3]["bufferView"] = indices;
    EXPECT_EQ(load(with_fallback).meshes[0].primitives[0].indices.size(), 3 * grid.faces.size());

    builder.bin[0] ^= 1;  // damages the signature "DRACO"
    const std::string where = std::string("/meshes/0/primitives/0/extensions/") + kName;
    EXPECT_EQ(errorOf(builder).where(), where);
    with_fallback.bin[0] ^= 1;
    with_fallback.gltf["accessors"][0]["count"] = with_fallback.gltf["accessors"][3]["count"] = 3;
    const Scene scene = load(with_fallback);
    EXPECT_EQ(scene.meshes[0].primitives[0].positions[0], glm::vec3(0, 0, 9));
    EXPECT_TRUE(warned(scene, "The uncompressed fallback is used"));
    GltfOptions strict;
    strict.strict = true;
    EXPECT_EQ(errorOf(with_fallback, strict).where(), where);
}

TEST(GltfDraco, LeavesAttributesAloneThatItDoesNotHold) {
    const Grid grid(5);
    GltfBuilder builder = dracoGrid(grid, grid.encode(draco::MESH_SEQUENTIAL_ENCODING));
    std::vector<float> normals;
    for (std::size_t i = 0; i < grid.positions.size(); ++i)
        normals.insert(normals.end(), {0, 0, 1});
    builder.attributes()["NORMAL"] = builder.addAccessor<float>(normals, "VEC3");
    const Scene scene = load(builder);
    EXPECT_EQ(scene.meshes[0].primitives[0].normals[7], glm::vec3(0, 0, 1));
}

class GltfDracoLies : public testing::TestWithParam<Lie> {};

TEST_P(GltfDracoLies, AreRefused) {
    const Grid grid(5);
    GltfBuilder builder = dracoGrid(grid, grid.encode(draco::MESH_EDGEBREAKER_ENCODING));
    GetParam().tell(builder);
    const Error error = errorOf(builder);
    EXPECT_EQ(error.kind(), ErrorKind::kInput);
    EXPECT_EQ(error.where(), std::string("/meshes/0/primitives/0") + GetParam().where);
    EXPECT_NE(std::string(error.what()).find(GetParam().words), std::string::npos) << error.what();
}

// Offsets in the data: "DRACO", two bytes of version, type, method, two bytes of flags, the kind of
// traversal, and the numbers of vertices and triangles.
constexpr std::size_t kType = 7, kFaces = 13;

#define DRACO_EXTENSION "/extensions/KHR_draco_mesh_compression"
INSTANTIATE_TEST_SUITE_P(
    All, GltfDracoLies,
    testing::Values(
        Lie{"NoDraco", [](GltfBuilder& b) { b.bin[1] = 'X'; }, DRACO_EXTENSION, "not Draco data"},
        Lie{"OtherVersion", [](GltfBuilder& b) { b.bin[5] = 9; }, DRACO_EXTENSION, "version"},
        Lie{"PointCloud", [](GltfBuilder& b) { b.bin[kType] = 0; }, DRACO_EXTENSION,
            "not a triangle mesh"},
        Lie{"MoreFaces", [](GltfBuilder& b) { b.bin[kFaces] = 33; }, DRACO_EXTENSION,
            "33 triangles, but the accessors have room for 32"},
        Lie{"HugeFaces",
            [](GltfBuilder& b) {
                b.bin.erase(b.bin.begin() + kFaces);
                const Bytes huge = {0xFF, 0xFF, 0xFF, 0xFF, 0x04};
                b.bin.insert(b.bin.begin() + kFaces, huge.begin(), huge.end());
                b.gltf["bufferViews"][0]["byteLength"] = b.bin.size();
            },
            DRACO_EXTENSION, "1342177279 triangles"},
        Lie{"HugeFacesAndAccessors",
            [](GltfBuilder& b) {
                b.bin.erase(b.bin.begin() + kFaces);
                const Bytes huge = {0x80, 0x80, 0x80, 0x10};
                b.bin.insert(b.bin.begin() + kFaces, huge.begin(), huge.end());
                b.gltf["bufferViews"][0]["byteLength"] = b.bin.size();
                b.gltf["accessors"][0]["count"] = 33554432 / 2;
                b.gltf["accessors"][3]["count"] = 33554432 * 3;
            },
            DRACO_EXTENSION, "33554432 triangles in"},
        Lie{"HugeAccessors",
            [](GltfBuilder& b) {
                for (Json& accessor : b.gltf["accessors"])
                    accessor["count"] = 9000000000000;
            },
            DRACO_EXTENSION, "more than the limit"},
        Lie{"FewIndices", [](GltfBuilder& b) { b.gltf["accessors"][3]["count"] = 93; },
            DRACO_EXTENSION, "32 triangles, but the accessors have room for 31"},
        Lie{"Truncated", [](GltfBuilder& b) { b.gltf["bufferViews"][0]["byteLength"] = 40; },
            DRACO_EXTENSION, "damaged"},
        Lie{"NoSuchAttribute",
            [](GltfBuilder& b) { dracoExtension(b)["attributes"]["COLOR_0"] = 77; },
            DRACO_EXTENSION, "no attribute with the id 77"},
        Lie{"OtherShape", [](GltfBuilder& b) { dracoExtension(b)["attributes"]["COLOR_0"] = 0; },
            DRACO_EXTENSION, "3 components, but its accessor has 4"},
        Lie{"NegativeAttribute",
            [](GltfBuilder& b) { dracoExtension(b)["attributes"]["COLOR_0"] = -1; },
            DRACO_EXTENSION "/attributes/COLOR_0", "must be an integer"},
        Lie{"NoSuchView", [](GltfBuilder& b) { dracoExtension(b)["bufferView"] = 5; },
            DRACO_EXTENSION "/bufferView", "index into \"bufferViews\""},
        Lie{"Lines", [](GltfBuilder& b) { b.primitive()["mode"] = 1; }, "/mode",
            "triangles and triangle strips only"}),
    [](const auto& test) { return std::string(test.param.name); });

TEST(GltfDraco, OutlivesAnyByte) {
    std::mt19937 random(20240607);
    const Grid grid(12);
    const DracoAttribute wanted[] = {{0, 5126, 3}, {1, 5121, 4}, {2, 5121, 4}};
    for (const int method : {draco::MESH_SEQUENTIAL_ENCODING, draco::MESH_EDGEBREAKER_ENCODING}) {
        const Bytes bytes = grid.encode(method);
        int refused = 0;
        for (int round = 0; round < 150; ++round) {
            Bytes damaged = bytes;
            for (int flips = 0; flips < 1 + round % 3; ++flips)
                damaged[random() % damaged.size()] = static_cast<std::uint8_t>(random());
            try {
                decodeDracoMesh(damaged, wanted, {grid.faces.size(), 3 * grid.faces.size()});
            } catch (const Error& error) {
                EXPECT_EQ(error.kind(), ErrorKind::kInput) << error.what();
                ++refused;
            }
        }
        EXPECT_GT(refused, 20);
    }
}

TEST(GltfDraco, BelievesNoLieOfItsDecoder) {
    constexpr std::uint64_t kHuge = std::uint64_t{1} << 62;
    const DracoAttribute attributes[] = {{0, 5126, 3}, {1, 5121, 4}};
    const DracoLimits limits{.faces = 2, .points = 6};
    const Bytes triangle = {0, 0, 0, 0, 1, 0, 0, 0, 2, 0, 0, 0};
    const auto mesh = [](std::uint64_t points) {
        return Answer().add(HelperState::kDone).add(points);
    };
    const auto with = [&](std::uint64_t points, const Bytes& indices, std::size_t positions,
                          std::size_t colors) {
        return mesh(points)
            .addArray(indices.size(), indices)
            .addArray(positions, Bytes(positions))
            .addArray(colors, Bytes(colors));
    };
    Bytes outside = triangle, negative = triangle, three = triangle;
    outside[8] = 3;
    negative[11] = 0xFF;
    for (int i = 0; i < 2; ++i)
        three.insert(three.end(), triangle.begin(), triangle.end());
    const std::pair<const char*, Answer> lies[] = {
        {"nothing", Answer().add(HelperState::kDone)},
        {"2^62 points, of which nothing is there", with(kHuge, triangle, 0, 0)},
        {"2^60 points, of which nothing is there", with(kHuge >> 2, triangle, 0, 0)},
        {"all points that there can be", with(~std::uint64_t{0}, triangle, 0, 0)},
        {"more points than accessors have room for", with(7, triangle, 84, 28)},
        {"no points", with(0, {}, 0, 0)},
        {"no triangle", with(3, {}, 36, 12)},
        {"more triangles than accessors have room for", with(3, three, 36, 12)},
        {"a triangle of two corners", with(3, Bytes(8), 36, 12)},
        {"an index of half a number", with(3, Bytes(13), 36, 12)},
        {"a corner that there is not", with(3, outside, 36, 12)},
        {"a corner far away", with(3, negative, 36, 12)},
        {"positions for two of three points", with(3, triangle, 24, 12)},
        {"positions for four of three points", with(3, triangle, 48, 12)},
        {"no colours", with(3, triangle, 36, 0)},
        {"an attribute too few", mesh(3).addArray(12, triangle).addArray(36, Bytes(36))},
        {"indices without end", mesh(3).addArray(kHuge, triangle)},
        {"positions without end", mesh(3).addArray(12, triangle).addArray(kHuge, Bytes(36))},
    };
    for (const auto& [name, lie] : lies) {
        SharedFile result = lie.run();
        try {
            takeDracoMesh(result, attributes, limits);
            ADD_FAILURE() << name << " is believed";
        } catch (const Error& error) {
            EXPECT_EQ(error.kind(), ErrorKind::kInput) << name;
            EXPECT_EQ(error.where(), "") << name;
        }
    }
    SharedFile truth = with(3, triangle, 36, 12).run();
    const DracoMesh taken = takeDracoMesh(truth, attributes, limits);
    EXPECT_EQ(taken.points, 3U);
    EXPECT_EQ(taken.indices, (std::vector<std::uint32_t>{0, 1, 2}));
    EXPECT_EQ(taken.attributes[0].size(), 36U);
}

}  // namespace
}  // namespace peeler::test
