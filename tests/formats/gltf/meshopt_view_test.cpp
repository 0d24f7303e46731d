// SPDX-License-Identifier: Apache-2.0
// Tests meshopt streams: compares the output of every mode and filter with the input, and tests the
// extension's rules and damaged streams.
#include "formats/gltf/gltf_decoders.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <glm/glm.hpp>
#include <limits>
#include <random>
#include <string>

#include <peeler/error.h>
#include "formats/gltf/meshopt_stream.h"
#include "support/test_support.h"

namespace peeler::test {
namespace {

Bytes decode(const MeshoptStream& stream) {
    checkMeshoptStream(stream);
    Bytes out(stream.count * stream.stride);
    decodeMeshoptStream(stream, out);
    return out;
}

template <typename T>
std::vector<T> decodeAs(const MeshoptStream& stream) {
    const Bytes bytes = decode(stream);
    std::vector<T> values(bytes.size() / sizeof(T));
    std::memcpy(values.data(), bytes.data(), bytes.size());
    return values;
}

std::string problemOf(const MeshoptStream& stream) {
    try {
        decode(stream);
    } catch (const Error& error) {
        EXPECT_EQ(error.kind(), ErrorKind::kInput);
        EXPECT_FALSE(error.hint().empty());
        return error.what();
    }
    return "";
}

void expectProblem(const MeshoptStream& stream, const std::string& words) {
    EXPECT_NE(problemOf(stream).find(words), std::string::npos) << "got: " << problemOf(stream);
}

constexpr unsigned kSeed = 20240607;

std::vector<glm::vec4> unitVectors(std::size_t count, int dimensions) {
    std::mt19937 random(kSeed);
    std::normal_distribution<float> normal;
    std::vector<glm::vec4> result(count, glm::vec4(0));
    for (glm::vec4& v : result) {
        for (int i = 0; i < dimensions; ++i)
            v[i] = normal(random);
        v /= glm::length(v);
    }
    return result;
}

TEST(MeshoptView, GivesAttributesOfEveryStrideBack) {
    std::mt19937 random(kSeed);
    for (std::size_t stride = 4; stride <= 256; stride += 4) {
        // No count is a multiple of the codec's groups, and the largest exceeds a block.
        for (const std::size_t count : {std::size_t{1}, std::size_t{17}, std::size_t{300}}) {
            Bytes values(count * stride);
            for (std::size_t i = 0; i < values.size(); ++i)
                values[i] = static_cast<std::uint8_t>(i / stride * 3 + random() % 4);
            const Bytes bytes = encodeAttributes(values.data(), count, stride);
            EXPECT_EQ(decode({bytes, "ATTRIBUTES", "NONE", stride, count}), values)
                << stride << ", " << count;
        }
    }
}

TEST(MeshoptView, GivesTrianglesAndIndicesBack) {
    // A strip of quads, in which every triangle keeps its first vertex.
    std::vector<unsigned int> indices;
    for (unsigned int i = 0; i < 900; ++i)
        for (const unsigned int corner : {2 * i, 2 * i + 1, 2 * i + 2})
            indices.push_back(corner);
    const Bytes triangles = encodeTriangles(indices), sequence = encodeIndices(indices);
    const std::vector<std::uint16_t> narrow(indices.begin(), indices.end());
    // The codec may rotate a triangle's corners, so only their cyclic order is compared.
    const auto turned = [](auto values) {
        for (std::size_t i = 0; i < values.size(); i += 3)
            while (values[i] > values[i + 1] || values[i] > values[i + 2])
                std::rotate(values.begin() + static_cast<std::ptrdiff_t>(i),
                            values.begin() + static_cast<std::ptrdiff_t>(i) + 1,
                            values.begin() + static_cast<std::ptrdiff_t>(i) + 3);
        return values;
    };
    const std::size_t n = indices.size();
    EXPECT_EQ(turned(decodeAs<std::uint32_t>({triangles, "TRIANGLES", "NONE", 4, n})), indices);
    EXPECT_EQ(turned(decodeAs<std::uint16_t>({triangles, "TRIANGLES", "NONE", 2, n})), narrow);
    EXPECT_EQ(decodeAs<std::uint32_t>({sequence, "INDICES", "NONE", 4, n}), indices);
    EXPECT_EQ(decodeAs<std::uint16_t>({sequence, "INDICES", "NONE", 2, n}), narrow);
}

TEST(MeshoptView, DecodesOctahedralNormals) {
    const std::vector<glm::vec4> normals = unitVectors(500, 3);
    const auto compare = [&](auto number, int bits, float tolerance) {
        using Number = decltype(number);
        const float one = std::numeric_limits<Number>::max();
        std::vector<Number> encoded(normals.size() * 4);
        meshopt_encodeFilterOct(encoded.data(), normals.size(), 4 * sizeof(Number), bits,
                                &normals[0].x);
        const Bytes bytes = encodeAttributes(encoded.data(), normals.size(), 4 * sizeof(Number));
        const auto decoded = decodeAs<Number>(
            {bytes, "ATTRIBUTES", "OCTAHEDRAL", 4 * sizeof(Number), normals.size()});
        for (std::size_t i = 0; i < normals.size(); ++i)
            for (int c = 0; c < 3; ++c)
                EXPECT_NEAR(decoded[4 * i + static_cast<std::size_t>(c)] / one, normals[i][c],
                            tolerance);
    };
    // A step of the grid is 1 / (2^(bits − 1) − 1). Folding enlarges it by at most √3, and each
    // stored component adds half of its own step.
    compare(std::int8_t{}, 8, 1.8F / 127 + 0.5F / 127);
    compare(std::int16_t{}, 12, 1.8F / 2047 + 0.5F / 32767);
}

// The meshopt library estimates the length, and so misses the nearest number on some processors.
TEST(MeshoptView, DecodesEveryShortNormalToTheNearest) {
    std::vector<std::int8_t> codes;
    for (int x = -127; x <= 127; ++x)
        for (int y = -127; y <= 127; ++y)
            for (const int value : {x, y, 127, 0})
                codes.push_back(static_cast<std::int8_t>(value));
    const std::size_t count = codes.size() / 4;
    const Bytes bytes = encodeAttributes(codes.data(), count, 4);
    const auto decoded = decodeAs<std::int8_t>({bytes, "ATTRIBUTES", "OCTAHEDRAL", 4, count});
    for (std::size_t i = 0; i < count; ++i) {
        glm::dvec3 v(codes[4 * i], codes[4 * i + 1], 0);
        v.z = 127 - std::abs(v.x) - std::abs(v.y);
        const double fold = std::min(v.z, 0.0);
        v.x += v.x < 0 ? -fold : fold;
        v.y += v.y < 0 ? -fold : fold;
        v *= 127 / glm::length(v);
        for (int c = 0; c < 3; ++c)
            EXPECT_NEAR(decoded[4 * i + static_cast<std::size_t>(c)], v[c], 0.50001);
    }
}

TEST(MeshoptView, DecodesQuaternions) {
    const std::vector<glm::vec4> rotations = unitVectors(500, 4);
    std::vector<std::int16_t> encoded(rotations.size() * 4);
    meshopt_encodeFilterQuat(encoded.data(), rotations.size(), 8, 12, &rotations[0].x);
    const Bytes bytes = encodeAttributes(encoded.data(), rotations.size(), 8);
    const auto decoded =
        decodeAs<std::int16_t>({bytes, "ATTRIBUTES", "QUATERNION", 8, rotations.size()});
    for (std::size_t i = 0; i < rotations.size(); ++i) {
        glm::vec4 got;
        for (int c = 0; c < 4; ++c)
            got[c] = decoded[4 * i + static_cast<std::size_t>(c)] / 32767.0F;
        // q and −q are the same rotation. A step of 12 bits is √½ / 2047, within the tolerance.
        if (glm::dot(got, rotations[i]) < 0) got = -got;
        for (int c = 0; c < 4; ++c)
            EXPECT_NEAR(got[c], rotations[i][c], 1e-3F);
    }
}

/// Calls the encoder so that each number gets its own exponent. Newer versions of meshoptimizer
/// also take a mode; mode 0 selects separate exponents.
template <typename... Mode>
void encodeExponents(void (*encode)(void*, std::size_t, std::size_t, int, const float*, Mode...),
                     const std::vector<float>& values, std::vector<std::uint32_t>& encoded) {
    encoded.resize(values.size());
    // A float's mantissa has 24 bits.
    encode(encoded.data(), values.size(), 4, 24, values.data(), Mode{}...);
}

TEST(MeshoptView, DecodesExponents) {
    const std::vector<float> values = {0, 1, -1, 0.375F, -1234.5F, 6.5e20F, -3e-20F, 100};
    std::vector<std::uint32_t> encoded;
    encodeExponents(meshopt_encodeFilterExp, values, encoded);
    const Bytes bytes = encodeAttributes(encoded.data(), values.size(), 4);
    const auto decoded = decodeAs<float>({bytes, "ATTRIBUTES", "EXPONENTIAL", 4, values.size()});
    for (std::size_t i = 0; i < values.size(); ++i)
        EXPECT_NEAR(decoded[i], values[i], std::abs(values[i]) * 3e-7F) << i;
}

/// The inverse of KHR_meshopt_compression, Appendix B, filter 4. Y, Co and Cg have K bits. Alpha
/// has K − 1 bits; the bit above alpha is 1 and gives K.
template <typename Number>
std::vector<Number> encodeColors(const std::vector<glm::vec4>& colors, int bits) {
    const int max = (1 << bits) - 1;
    std::vector<Number> result;
    for (const glm::vec4& color : colors) {
        const auto level = [&](float value) {
            return static_cast<int>(std::lround(value * static_cast<float>(max)));
        };
        const int r = level(color.r), g = level(color.g), b = level(color.b);
        const int co = (r - b) / 2, t = b + co, cg = (g - t) / 2;
        result.insert(result.end(), {static_cast<Number>(t + cg), static_cast<Number>(co),
                                     static_cast<Number>(cg),
                                     static_cast<Number>(1 << (bits - 1) | level(color.a) >> 1)});
    }
    return result;
}

TEST(MeshoptView, DecodesColors) {
    std::mt19937 random(kSeed);
    std::uniform_real_distribution<float> unit(0, 1);
    std::vector<glm::vec4> colors = {glm::vec4(0), glm::vec4(1), {1, 0, 0, 1}, {0, 0, 1, 0.5F}};
    for (int i = 0; i < 200; ++i)
        colors.emplace_back(unit(random), unit(random), unit(random), unit(random));
    const auto compare = [&](auto number, int bits) {
        using Number = decltype(number);
        const float one = std::numeric_limits<Number>::max();
        const auto encoded = encodeColors<Number>(colors, bits);
        const Bytes bytes = encodeAttributes(encoded.data(), colors.size(), 4 * sizeof(Number));
        const auto decoded =
            decodeAs<Number>({bytes, "ATTRIBUTES", "COLOR", 4 * sizeof(Number), colors.size()});
        // Halving Co and Cg loses one bit of each; alpha has one bit less.
        const float step = 2.5F / static_cast<float>((1 << bits) - 1);
        for (std::size_t i = 0; i < decoded.size(); ++i)
            EXPECT_NEAR(static_cast<float>(decoded[i]) / one,
                        colors[i / 4][static_cast<int>(i % 4)], step)
                << bits << " bits, " << i;
    };
    compare(std::uint8_t{}, 8);
    compare(std::uint8_t{}, 6);
    compare(std::uint16_t{}, 12);
    compare(std::uint16_t{}, 16);
}

TEST(MeshoptView, KeepsTheRulesOfTheExtension) {
    const Bytes values(64 * 12), bytes = encodeAttributes(values.data(), 64, 12);
    const Bytes triangles = encodeTriangles({0, 1, 2}), sequence = encodeIndices({0, 1, 2});
    EXPECT_EQ(problemOf({bytes, "ATTRIBUTES", "NONE", 12, 64}), "");
    expectProblem({bytes, "ATTRIBUTES", "NONE", 10, 64}, "multiple of 4");
    expectProblem({bytes, "ATTRIBUTES", "NONE", 260, 64}, "multiple of 4 up to 256");
    expectProblem({bytes, "ATTRIBUTES", "OCTAHEDRAL", 12, 64}, "must be 4 or 8");
    expectProblem({bytes, "ATTRIBUTES", "COLOR", 12, 64}, "must be 4 or 8");
    expectProblem({bytes, "ATTRIBUTES", "QUATERNION", 4, 64}, "must be 8");
    expectProblem({bytes, "ATTRIBUTES", "SOMETHING", 12, 64}, "filter \"SOMETHING\" is not known");
    expectProblem({bytes, "POINTS", "NONE", 12, 64}, "mode \"POINTS\" is not known");
    expectProblem({triangles, "TRIANGLES", "NONE", 8, 3}, "must be 2 or 4");
    expectProblem({sequence, "INDICES", "NONE", 1, 3}, "must be 2 or 4");
    expectProblem({triangles, "TRIANGLES", "NONE", 2, 4}, "not a multiple of 3");
    expectProblem({triangles, "TRIANGLES", "OCTAHEDRAL", 4, 3}, "cannot be used with mode");
    expectProblem({sequence, "INDICES", "EXPONENTIAL", 4, 3}, "cannot be used with mode");
    expectProblem({{}, "INDICES", "NONE", 4, 3}, "empty");
    expectProblem({sequence, "TRIANGLES", "NONE", 4, 3}, "not a meshopt stream of mode TRIANGLES");
}

TEST(MeshoptView, SaysWhichVersionItDoesNotDecode) {
    Bytes bytes = encodeAttributes(Bytes(64).data(), 16, 4);
    bytes[0] = 0xA1;
    expectProblem({bytes, "ATTRIBUTES", "NONE", 4, 16}, "version 1 of the codec");
    bytes = encodeTriangles({0, 1, 2});
    bytes[0] = 0xE2;
    expectProblem({bytes, "TRIANGLES", "NONE", 4, 3}, "version 2 of the codec");
}

TEST(MeshoptView, BelievesNoCountThatTheBytesCannotHold) {
    // Zeros compress to the minimum that the codec allows.
    for (const std::size_t stride : {4U, 12U, 64U, 256U}) {
        const std::size_t count = 10000;
        const Bytes values(count * stride), bytes = encodeAttributes(values.data(), count, stride);
        EXPECT_EQ(problemOf({bytes, "ATTRIBUTES", "NONE", stride, count}), "") << stride;
        expectProblem({bytes, "ATTRIBUTES", "NONE", stride, count * 2}, "need at least");
        expectProblem({bytes, "ATTRIBUTES", "NONE", stride, std::uint64_t{1} << 52},
                      "need at least");
    }
    const Bytes triangles = encodeTriangles({0, 1, 2}), sequence = encodeIndices({0, 1, 2});
    expectProblem({triangles, "TRIANGLES", "NONE", 4, 3000000000}, "need at least");
    expectProblem({sequence, "INDICES", "NONE", 4, 3000000000}, "need at least");
}

TEST(MeshoptView, RefusesTruncatedStreams) {
    std::mt19937 random(kSeed);
    std::vector<std::uint32_t> noise(500);
    for (std::uint32_t& value : noise)
        value = static_cast<std::uint32_t>(random());
    const Bytes bytes = encodeAttributes(noise.data(), 125, 16);
    for (std::size_t size = 1; size < bytes.size(); size += 7) {
        const Bytes cut(bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(size));
        EXPECT_NE(problemOf({cut, "ATTRIBUTES", "NONE", 16, 125}), "") << size;
    }
}

TEST(MeshoptView, OutlivesAnyByte) {
    std::mt19937 random(kSeed);
    const std::vector<unsigned int> indices = {0, 1, 2, 2, 1, 3, 3, 1, 4, 9, 8, 7, 7, 8, 6};
    const std::vector<float> values(160, 0.25F);
    const std::pair<Bytes, MeshoptStream> streams[] = {
        {encodeAttributes(values.data(), 40, 16), {{}, "ATTRIBUTES", "EXPONENTIAL", 16, 40}},
        {encodeAttributes(values.data(), 80, 8), {{}, "ATTRIBUTES", "QUATERNION", 8, 80}},
        {encodeAttributes(values.data(), 160, 4), {{}, "ATTRIBUTES", "OCTAHEDRAL", 4, 160}},
        {encodeAttributes(values.data(), 160, 4), {{}, "ATTRIBUTES", "COLOR", 4, 160}},
        {encodeTriangles(indices), {{}, "TRIANGLES", "NONE", 4, 15}},
        {encodeIndices(indices), {{}, "INDICES", "NONE", 2, 15}}};
    for (const auto& [bytes, stream] : streams) {
        for (int round = 0; round < 2000; ++round) {
            Bytes damaged = bytes;
            for (int flips = 0; flips < 1 + round % 3; ++flips)
                damaged[1 + random() % (damaged.size() - 1)] = static_cast<std::uint8_t>(random());
            MeshoptStream other = stream;
            other.bytes = damaged;
            problemOf(other);  // the result is either an error or numbers, but never a crash
        }
    }
}

}  // namespace
}  // namespace peeler::test
