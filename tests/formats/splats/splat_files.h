// SPDX-License-Identifier: Apache-2.0
// Writers of Gaussian splats in every format that peeler reads, for tests.
#pragma once

#include <libdeflate.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "formats/cameras/camera_files.h"
#include "formats/gltf/gltf_builder.h"
#include "formats/splats/splat_scene.h"

namespace peeler::test {

/// Returns a splat with a different value everywhere. Its harmonics are multiples of 1/64.
inline Splat knownSplat(int number = 0) {
    Splat splat;
    splat.mean = {1 + number, -2, 0.5};
    splat.scale = glm::exp(glm::dvec3(-2, -1.5, -1));
    splat.rotation = glm::normalize(glm::dvec4(-0.4, 0.2, 0.5, 0.7 + 0.1 * number));
    splat.opacity = 204 / 255.0;
    splat.harmonics[0] = {0.7, -0.4, 0.1};
    for (int i = 1; i < 16; ++i)
        splat.harmonics[static_cast<std::size_t>(i)] = {i / 64.0, -i / 64.0, (i - 8) / 64.0};
    return splat;
}

inline std::size_t higherOf(int degree) {
    return static_cast<std::size_t>((degree + 1) * (degree + 1) - 1);
}

/// Returns f_rest_*: the coefficients after the first, all of red, then green, then blue.
inline std::vector<double> restOf(const Splat& splat, int degree) {
    std::vector<double> rest;
    for (int c = 0; c < 3; ++c)
        for (std::size_t i = 1; i <= higherOf(degree); ++i)
            rest.push_back(splat.harmonics[i][c]);
    return rest;
}

inline std::string properties(const std::string& type, const std::vector<std::string>& names) {
    std::string text;
    for (const std::string& name : names)
        text += "property " + type + " " + name + "\n";
    return text;
}

/// Returns the text of a PLY header; `more` are lines after the format.
inline std::string plyHeader(const std::string& more) {
    return "ply\nformat binary_little_endian 1.0\n" + more + "end_header\n";
}

/// Returns the names of a splat's properties in a 3DGS PLY.
inline std::vector<std::string> splatProperties(int degree) {
    std::vector<std::string> names = {"x",  "y",      "z",      "nx",    "ny",
                                      "nz", "f_dc_0", "f_dc_1", "f_dc_2"};
    for (std::size_t i = 0; i < 3 * higherOf(degree); ++i)
        names.push_back("f_rest_" + std::to_string(i));
    for (const char* name :
         {"opacity", "scale_0", "scale_1", "scale_2", "rot_0", "rot_1", "rot_2", "rot_3"})
        names.emplace_back(name);
    return names;
}

/// Returns a 3DGS PLY.
inline std::string splatPly(const std::vector<Splat>& splats, int degree,
                            const std::string& comments = "") {
    PackedNumbers data;
    for (const Splat& splat : splats) {
        const auto add = [&](double value) { data.add(static_cast<float>(value)); };
        for (int i = 0; i < 3; ++i)
            add(splat.mean[i]);
        for (int i = 0; i < 3; ++i)
            add(9);
        for (int i = 0; i < 3; ++i)
            add(splat.harmonics[0][i]);
        for (const double value : restOf(splat, degree))
            add(value);
        add(std::log(splat.opacity / (1 - splat.opacity)));
        for (int i = 0; i < 3; ++i)
            add(std::log(splat.scale[i]));
        for (const int i : {3, 0, 1, 2})
            add(splat.rotation[i]);
    }
    return plyHeader(comments + "element vertex " + std::to_string(splats.size()) + "\n" +
                     properties("float", splatProperties(degree))) +
           data.text;
}

inline std::uint32_t steps(double fraction, int bits) {
    return static_cast<std::uint32_t>(
        std::lround(std::clamp(fraction, 0.0, 1.0) * ((1 << bits) - 1)));
}

/// Returns the index of the largest component, and the others with the sign that makes it positive.
inline std::uint32_t smallestThree(const std::array<double, 4>& turn,
                                   std::array<double, 3>& others) {
    std::size_t largest = 0;
    for (std::size_t i = 1; i < 4; ++i)
        if (std::abs(turn[i]) > std::abs(turn[largest])) largest = i;
    for (std::size_t i = 0, k = 0; i < 4; ++i)
        if (i != largest) others[k++] = turn[largest] < 0 ? -turn[i] : turn[i];
    return static_cast<std::uint32_t>(largest);
}

/// Returns a compressed PLY with one chunk. Its limits are: means −4 to 4, logarithms of scales −4
/// to 0, colours −1 to 2 (0 to 1 without `colored`).
inline std::string compressedPly(const std::vector<Splat>& splats, int degree, bool colored = true,
                                 const std::string& comments = "") {
    PackedNumbers data;
    std::vector<std::string> limits;
    for (const char* kind : {"", "scale_", "color"}) {
        if (std::string(kind) == "color" && !colored) continue;
        const bool is_color = std::string(kind) == "color";
        for (const char* end : {"min_", "max_"})
            for (const char* axis :
                 {is_color ? "r" : "x", is_color ? "g" : "y", is_color ? "b" : "z"})
                limits.push_back(std::string(end) + (is_color ? "" : kind) + axis);
    }
    for (const float limit : {-4.F, -4.F, -4.F, 4.F, 4.F, 4.F, -4.F, -4.F, -4.F, 0.F, 0.F, 0.F})
        data.add(limit);
    for (int i = 0; colored && i < 6; ++i)
        data.add(i < 3 ? -1.F : 2.F);
    for (const Splat& splat : splats) {
        const auto packed = [](const glm::dvec3& t) {
            return steps(t.x, 11) << 21U | steps(t.y, 10) << 11U | steps(t.z, 11);
        };
        std::array<double, 3> others{};
        const auto& q = splat.rotation;
        std::uint32_t turn = smallestThree({q.w, q.x, q.y, q.z}, others);
        for (const double other : others)
            turn = turn << 10U | steps(other / std::sqrt(2.0) + 0.5, 10);
        std::uint32_t color = 0;
        for (int i = 0; i < 3; ++i) {
            const double rgb = splat.harmonics[0][i] * 0.28209479177387814 + 0.5;
            color = color << 8U | steps(colored ? (rgb + 1) / 3 : rgb, 8);
        }
        data.add(packed((splat.mean + 4.0) / 8.0)).add(turn);
        data.add(packed((glm::log(splat.scale) + 4.0) / 4.0));
        data.add(color << 8U | steps(splat.opacity, 8));
    }
    for (const Splat& splat : splats)
        for (const double value : restOf(splat, degree))
            data.add(static_cast<std::uint8_t>((value / 8 + 0.5) * 256));
    std::string sh;
    if (degree > 0) {
        std::vector<std::string> rest;
        for (std::size_t i = 0; i < 3 * higherOf(degree); ++i)
            rest.push_back("f_rest_" + std::to_string(i));
        sh = "element sh " + std::to_string(splats.size()) + "\n" + properties("uchar", rest);
    }
    return plyHeader(comments + "element chunk 1\n" + properties("float", limits) +
                     "element vertex " + std::to_string(splats.size()) + "\n" +
                     properties("uint", {"packed_position", "packed_rotation", "packed_scale",
                                         "packed_color"}) +
                     sh) +
           data.text;
}

inline std::string gzip(const std::string& bytes) {
    libdeflate_compressor* const compressor = libdeflate_alloc_compressor(6);
    std::string packed(libdeflate_gzip_compress_bound(compressor, bytes.size()), '\0');
    packed.resize(libdeflate_gzip_compress(compressor, bytes.data(), bytes.size(), packed.data(),
                                           packed.size()));
    libdeflate_free_compressor(compressor);
    return packed;
}

/// Returns an SPZ before gzip.
inline std::string unpackedSpzOf(const std::vector<Splat>& splats, int degree,
                                 std::uint32_t version, std::uint8_t flags = 0) {
    PackedNumbers data;
    const auto byte = [&](double value) {
        data.add(static_cast<std::uint8_t>(std::clamp(std::round(value), 0.0, 255.0)));
    };
    data.text = "NGSP";
    data.add(version).add(static_cast<std::uint32_t>(splats.size()));
    data.add(static_cast<std::uint8_t>(degree)).add(std::uint8_t{12}).add(flags);
    data.add(std::uint8_t{0});
    for (const Splat& splat : splats)
        for (int i = 0; i < 3; ++i) {
            const auto fixed = static_cast<std::int32_t>(std::lround(splat.mean[i] * 4096));
            data.text.append(reinterpret_cast<const char*>(&fixed), 3);
        }
    for (const Splat& splat : splats)
        byte(splat.opacity * 255);
    for (const Splat& splat : splats)
        for (int i = 0; i < 3; ++i)
            byte((splat.harmonics[0][i] * 0.15 + 0.5) * 255);
    for (const Splat& splat : splats)
        for (int i = 0; i < 3; ++i)
            byte((std::log(splat.scale[i]) + 10) * 16);
    for (const Splat& splat : splats) {
        const glm::dvec4 q = splat.rotation * (splat.rotation.w < 0 ? -1.0 : 1.0);
        if (version == 2) {
            for (int i = 0; i < 3; ++i)
                byte(q[i] * 127.5 + 127.5);
            continue;
        }
        std::array<double, 3> others{};
        std::uint32_t turn = smallestThree({q.x, q.y, q.z, q.w}, others);
        for (const double other : others)
            turn = turn << 10U | (other < 0 ? 512U : 0U) |
                   static_cast<std::uint32_t>(std::abs(other) * std::sqrt(2.0) * 511 + 0.5);
        data.add(turn);
    }
    for (const Splat& splat : splats)
        for (std::size_t i = 1; i <= higherOf(degree); ++i)
            for (int c = 0; c < 3; ++c)
                byte(splat.harmonics[i][c] * 128 + 128);
    return data.text;
}

/// Returns a .splat.
inline std::string dotSplat(const std::vector<Splat>& splats) {
    PackedNumbers data;
    const auto byte = [&](double value) {
        data.add(static_cast<std::uint8_t>(std::clamp(std::round(value), 0.0, 255.0)));
    };
    for (const Splat& splat : splats) {
        for (int i = 0; i < 3; ++i)
            data.add(static_cast<float>(splat.mean[i]));
        for (int i = 0; i < 3; ++i)
            data.add(static_cast<float>(splat.scale[i]));
        for (int i = 0; i < 3; ++i)
            byte((splat.harmonics[0][i] * 0.28209479177387814 + 0.5) * 255);
        byte(splat.opacity * 255);
        for (const int i : {3, 0, 1, 2})
            byte(splat.rotation[i] * 128 + 128);
    }
    return data.text;
}

inline Json& splatExtension(GltfBuilder& builder) {
    return builder.primitive()["extensions"]["KHR_gaussian_splatting"];
}

/// Returns the name of an attribute of KHR_gaussian_splatting.
inline std::string splatName(const std::string& name) {
    return "KHR_gaussian_splatting:" + name;
}

/// Returns a glTF with KHR_gaussian_splatting.
inline GltfBuilder splatGltf(const std::vector<Splat>& splats, int degree) {
    GltfBuilder builder = triangle();
    std::vector<float> means, scales, rotations, opacities;
    std::vector<std::vector<float>> harmonics(higherOf(degree) + 1);
    for (const Splat& splat : splats) {
        opacities.push_back(static_cast<float>(splat.opacity));
        for (int i = 0; i < 4; ++i)
            rotations.push_back(static_cast<float>(splat.rotation[i]));
        for (int i = 0; i < 3; ++i) {
            means.push_back(static_cast<float>(splat.mean[i]));
            scales.push_back(static_cast<float>(splat.scale[i]));
            for (std::size_t k = 0; k < harmonics.size(); ++k)
                harmonics[k].push_back(static_cast<float>(splat.harmonics[k][i]));
        }
    }
    builder.primitive()["mode"] = 0;
    builder.attributes() = {{"POSITION", builder.addAccessor(means, "VEC3")},
                            {splatName("ROTATION"), builder.addAccessor(rotations, "VEC4")},
                            {splatName("SCALE"), builder.addAccessor(scales, "VEC3")},
                            {splatName("OPACITY"), builder.addAccessor(opacities, "SCALAR")}};
    std::size_t k = 0;
    for (int l = 0; l <= degree; ++l)
        for (int i = 0; i <= 2 * l; ++i)
            builder.attributes()[splatName("SH_DEGREE_" + std::to_string(l) + "_COEF_" +
                                           std::to_string(i))] =
                builder.addAccessor(harmonics[k++], "VEC3");
    splatExtension(builder) = {{"kernel", "ellipse"}, {"colorSpace", "srgb_rec709_display"}};
    builder.gltf["extensionsUsed"] = {"KHR_gaussian_splatting"};
    return builder;
}

/// The greatest differences that a format's rounding causes.
struct Rounding {
    double mean = 0, scale = 0, rotation = 0, opacity = 0, color = 0, harmonics = 0;
};

/// Expects that splat `i` of a scene is this splat, within the rounding and float's.
inline void expectSplat(const Scene& scene, std::size_t i, Splat splat, int degree,
                        const Rounding& rounding) {
    constexpr double kFloats = 4e-7;
    const Primitive& primitive = scene.meshes.at(0).primitives.at(0);
    ASSERT_TRUE(primitive.splats);
    const Splats& splats = *primitive.splats;
    ASSERT_EQ(splats.degree, degree);
    ASSERT_LT(i, splats.size());
    ASSERT_EQ(splats.harmonics.size(), splats.size() * splats.coefficients());
    if (glm::dot(glm::dvec4(splats.rotations[i]), splat.rotation) < 0) splat.rotation *= -1.0;
    EXPECT_NEAR(splats.opacities[i], splat.opacity, rounding.opacity + kFloats);
    EXPECT_NEAR(glm::length(splats.rotations[i]), 1, kFloats);
    for (int c = 0; c < 4; ++c)
        EXPECT_NEAR(splats.rotations[i][c], splat.rotation[c], rounding.rotation + kFloats) << c;
    for (int c = 0; c < 3; ++c) {
        EXPECT_NEAR(primitive.positions[i][c], splat.mean[c], rounding.mean + kFloats) << c;
        EXPECT_NEAR(splats.scales[i][c] / splat.scale[c], 1, rounding.scale + kFloats) << c;
        for (std::size_t k = 0; k < splats.coefficients(); ++k)
            EXPECT_NEAR(splats.harmonics[i * splats.coefficients() + k][c], splat.harmonics[k][c],
                        (k == 0 ? rounding.color : rounding.harmonics) + kFloats)
                << k << ", " << c;
    }
}

}  // namespace peeler::test
