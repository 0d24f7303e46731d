// SPDX-License-Identifier: Apache-2.0
// Filtered importance sampling (Křivánek & Colbert, "Real-time Shading with Filtered Importance
// Sampling", 2008) of a pyramid of cube maps.
#include "core/shading/environment_maps.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <numbers>

#include "core/base/parallel.h"

namespace peeler {
namespace {

// Texels a side. What mirrors reflect is as fine as the picture, and for wide lobes not too coarse.
constexpr int kSmallFace = 16, kUsualFace = 128, kLargestFace = 512;
constexpr int kRoughestFace = 8;
constexpr int kIrradianceFace = 16, kIrradianceSource = 32;

std::size_t index(int x, int y, int width) {
    return static_cast<std::size_t>(y) * static_cast<std::size_t>(width) +
           static_cast<std::size_t>(x);
}

std::size_t texelOf(const CubeMap& cube, int face, int x, int y) {
    return index(x, face * cube.size + y, cube.size);
}

/// The rows of all faces together.
std::size_t rowsOf(const CubeMap& cube) {
    return std::size_t{6} * static_cast<std::size_t>(cube.size);
}

CubeMap makeCube(int size) {
    CubeMap cube;
    cube.size = size;
    cube.texels.resize(6 * index(0, size, size));
    return cube;
}

/// The source texels under a destination texel, along one axis, with their shares of it.
struct Covered {
    int first = 0;
    std::vector<float> weights;
};

std::vector<Covered> coveredTexels(int source, int destination) {
    std::vector<Covered> all(static_cast<std::size_t>(destination));
    const double scale = static_cast<double>(source) / destination;
    for (int i = 0; i < destination; ++i) {
        Covered& covered = all[static_cast<std::size_t>(i)];
        const double begin = i * scale, end = (i + 1) * scale;
        covered.first = static_cast<int>(begin);
        for (int t = covered.first; t < std::min<double>(source, end); ++t)
            covered.weights.push_back(
                static_cast<float>((std::min(end, t + 1.0) - std::max(begin, double(t))) / scale));
    }
    return all;
}

Environment shrunk(const Environment& source, int width, int height) {
    Environment out;
    out.width = width;
    out.height = height;
    out.radiance.resize(index(0, height, width));
    const auto columns = coveredTexels(source.width, width);
    const auto rows = coveredTexels(source.height, height);
    parallelFor(rows.size(), [&](std::size_t y) {
        for (int x = 0; x < width; ++x) {
            const Covered& column = columns[static_cast<std::size_t>(x)];
            glm::vec3 sum(0);
            for (std::size_t j = 0; j < rows[y].weights.size(); ++j)
                for (std::size_t i = 0; i < column.weights.size(); ++i)
                    sum +=
                        rows[y].weights[j] * column.weights[i] *
                        source.radiance[index(column.first + static_cast<int>(i),
                                              rows[y].first + static_cast<int>(j), source.width)];
            out.radiance[index(x, static_cast<int>(y), width)] = sum;
        }
    });
    return out;
}

/// Radiance from a direction, interpolated between the four nearest pixels; around in longitude.
glm::vec3 lookUp(const Environment& image, double rotation, const glm::vec3& direction) {
    const double longitude = std::atan2(double(direction.x), double(direction.z)) - rotation;
    const double latitude = std::asin(std::clamp(double(direction.y), -1.0, 1.0));
    const double u = 0.5 - longitude / (2 * std::numbers::pi);
    const double x = (u - std::floor(u)) * image.width - 0.5;
    const double y = std::clamp((0.5 - latitude / std::numbers::pi) * image.height - 0.5, 0.0,
                                static_cast<double>(image.height - 1));
    const int left = static_cast<int>(std::floor(x)), upper = static_cast<int>(y);
    const auto across = static_cast<float>(x - left), down = static_cast<float>(y - upper);
    const int x0 = (left + image.width) % image.width, x1 = (left + 1) % image.width;
    const int y1 = std::min(upper + 1, image.height - 1);
    const std::vector<glm::vec3>& r = image.radiance;
    return glm::mix(
        glm::mix(r[index(x0, upper, image.width)], r[index(x1, upper, image.width)], across),
        glm::mix(r[index(x0, y1, image.width)], r[index(x1, y1, image.width)], across), down);
}

CubeMap toCube(const Environment& image, double rotation, int size) {
    CubeMap cube = makeCube(size);
    parallelFor(rowsOf(cube), [&](std::size_t row) {
        const int face = static_cast<int>(row) / size, y = static_cast<int>(row) % size;
        for (int x = 0; x < size; ++x) {
            glm::vec3 sum(0);
            for (int part = 0; part < 4; ++part)
                sum += lookUp(image, rotation,
                              cubeDirection(face, 2 * x + part % 2, 2 * y + part / 2, 2 * size));
            cube.texels[texelOf(cube, face, x, y)] = sum * 0.25F;
        }
    });
    return cube;
}

CubeMap halved(const CubeMap& cube) {
    CubeMap out = makeCube(cube.size / 2);
    for (int face = 0; face < 6; ++face)
        for (int y = 0; y < out.size; ++y)
            for (int x = 0; x < out.size; ++x) {
                glm::vec3 sum(0);
                for (int part = 0; part < 4; ++part)
                    sum += cube.texels[texelOf(cube, face, 2 * x + part % 2, 2 * y + part / 2)];
                out.texels[texelOf(out, face, x, y)] = sum * 0.25F;
            }
    return out;
}

/// The texel values about a direction, interpolated inside the face that it meets.
glm::vec3 lookUp(const CubeMap& cube, const glm::vec3& d) {
    const glm::vec3 size = glm::abs(d);
    int face = 0;
    float s = 0, t = 0, along = 0;
    if (size.x >= size.y && size.x >= size.z) {
        face = d.x > 0 ? 0 : 1;
        along = size.x, s = d.x > 0 ? -d.z : d.z, t = -d.y;
    } else if (size.y >= size.z) {
        face = d.y > 0 ? 2 : 3;
        along = size.y, s = d.x, t = d.y > 0 ? d.z : -d.z;
    } else {
        face = d.z > 0 ? 4 : 5;
        along = size.z, s = d.z > 0 ? d.x : -d.x, t = -d.y;
    }
    const auto last = static_cast<float>(cube.size - 1),
               half = 0.5F * static_cast<float>(cube.size);
    const float x = std::clamp((s / along + 1) * half - 0.5F, 0.0F, last);
    const float y = std::clamp((t / along + 1) * half - 0.5F, 0.0F, last);
    const int x0 = static_cast<int>(x), y0 = static_cast<int>(y);
    const int x1 = std::min(x0 + 1, cube.size - 1), y1 = std::min(y0 + 1, cube.size - 1);
    const float across = x - static_cast<float>(x0), down = y - static_cast<float>(y0);
    const std::vector<glm::vec3>& texels = cube.texels;
    return glm::mix(
        glm::mix(texels[texelOf(cube, face, x0, y0)], texels[texelOf(cube, face, x1, y0)], across),
        glm::mix(texels[texelOf(cube, face, x0, y1)], texels[texelOf(cube, face, x1, y1)], across),
        down);
}

/// One direction of a lobe about +Z, how much it counts, and the pyramid's level as coarse as the
/// samples are sparse there.
struct LobeSample {
    glm::vec3 direction{0};
    float weight = 0;
    std::size_t level = 0;
};

/// Mirrored directions of a GGX surface that faces +Z and is seen from there.
std::vector<LobeSample> lobeSamples(double roughness, int count, int finest, std::size_t levels) {
    const double a2 = std::pow(roughness, 4);
    std::vector<LobeSample> samples;
    for (int i = 0; i < count; ++i) {
        const double u = (i + 0.5) / count;
        double v = 0;  // of van der Corput's sequence
        for (double digit = 0.5, n = i; n >= 1; n = std::floor(n / 2), digit /= 2)
            v += digit * std::fmod(n, 2);
        const double cosine2 = (1 - u) / (1 + (a2 - 1) * u), phi = 2 * std::numbers::pi * v;
        const double z = 2 * cosine2 - 1;  // the mirrored direction's cosine
        if (z <= 0) continue;
        const double d = cosine2 * (a2 - 1) + 1, density = a2 / (std::numbers::pi * d * d) / 4;
        const double solid_angle = 1 / (count * density);
        const double texel = 4 * std::numbers::pi / (6.0 * finest * finest);
        const double level = 0.5 * std::log2(solid_angle / texel) + 0.5;
        const double r = std::sqrt(1 - z * z);
        LobeSample sample;
        sample.direction = {r * std::cos(phi), r * std::sin(phi), z};
        sample.weight = static_cast<float>(z);
        sample.level =
            static_cast<std::size_t>(std::clamp(level + 0.5, 0.0, static_cast<double>(levels - 1)));
        samples.push_back(sample);
    }
    return samples;
}

CubeMap convolved(const std::vector<CubeMap>& pyramid, int size, double roughness) {
    // Small maps are of wide lobes, which need many samples; and they have few texels.
    const int count = std::clamp(8192 / size, 32, 512);
    const auto samples = lobeSamples(roughness, count, pyramid.front().size, pyramid.size());
    CubeMap cube = makeCube(size);
    parallelFor(rowsOf(cube), [&](std::size_t row) {
        const int face = static_cast<int>(row) / size, y = static_cast<int>(row) % size;
        for (int x = 0; x < size; ++x) {
            const glm::vec3 n = cubeDirection(face, x, y, size);
            const glm::vec3 helper = std::abs(n.z) < 0.9F ? glm::vec3(0, 0, 1) : glm::vec3(1, 0, 0);
            const glm::vec3 tangent = glm::normalize(glm::cross(helper, n));
            const glm::mat3 turn(tangent, glm::cross(n, tangent), n);
            glm::vec3 sum(0);
            float weights = 0;
            for (const LobeSample& sample : samples) {
                sum += sample.weight * lookUp(pyramid[sample.level], turn * sample.direction);
                weights += sample.weight;
            }
            cube.texels[texelOf(cube, face, x, y)] = sum / weights;
        }
    });
    return cube;
}

CubeMap irradianceOf(const CubeMap& source) {
    struct SourceTexel {
        glm::vec3 direction, radiance;
        float solid_angle;
    };
    std::vector<SourceTexel> texels;
    for (int face = 0; face < 6; ++face)
        for (int y = 0; y < source.size; ++y)
            for (int x = 0; x < source.size; ++x) {
                const glm::vec3 d = cubeDirection(face, x, y, source.size);
                // A texel's solid angle shrinks with the cube of its distance from the centre.
                const float near = std::max({std::abs(d.x), std::abs(d.y), std::abs(d.z)});
                texels.push_back(
                    {d, source.texels[texelOf(source, face, x, y)], near * near * near});
            }
    CubeMap cube = makeCube(kIrradianceFace);
    parallelFor(cube.texels.size(), [&](std::size_t i) {
        const int column = static_cast<int>(i) % cube.size, row = static_cast<int>(i) / cube.size;
        const glm::vec3 n = cubeDirection(row / cube.size, column, row % cube.size, cube.size);
        glm::vec3 sum(0);
        float weights = 0;
        for (const SourceTexel& texel : texels) {
            const float weight = std::max(0.0F, glm::dot(n, texel.direction)) * texel.solid_angle;
            sum += weight * texel.radiance;
            weights += weight;
        }
        cube.texels[i] = sum / weights;
    });
    return cube;
}

}  // namespace

EnvironmentSamples::EnvironmentSamples(const Environment& environment, int count) {
    // Shrunk to as many pixels as there are directions.
    const int height = std::max(1, static_cast<int>(std::lround(std::sqrt(count / 2.0))));
    coarse_ = shrunk(environment, std::min(2 * height, environment.width),
                     std::min(height, environment.height));
    coarse_.rotation = environment.rotation;
}

glm::vec3 EnvironmentSamples::radiance(const glm::dvec3& direction) const {
    return lookUp(coarse_, coarse_.rotation, glm::vec3(direction));
}

glm::vec3 cubeDirection(int face, int x, int y, int size) {
    // The orientation of faces is that of OpenGL 4.6, table 8.19.
    const float s = 2 * (static_cast<float>(x) + 0.5F) / static_cast<float>(size) - 1;
    const float t = 2 * (static_cast<float>(y) + 0.5F) / static_cast<float>(size) - 1;
    const glm::vec3 directions[] = {{1, -t, -s}, {-1, -t, s}, {s, 1, t},
                                    {s, -1, -t}, {s, -t, 1},  {-s, -t, -1}};
    return glm::normalize(directions[face]);
}

EnvironmentMaps prefilter(const Environment& environment) {
    const auto texels = [](int pixels) {
        return static_cast<int>(std::bit_ceil(static_cast<unsigned>(std::min(pixels, 1 << 16))));
    };
    const int least = std::clamp(texels(environment.width), kSmallFace, kUsualFace);
    const int size = std::clamp(texels(environment.width / 4), least, kLargestFace);
    // Finer than the cube's texels would alias.
    const int width = std::min(environment.width, 4 * size);
    const int height = std::min(environment.height, 2 * size);
    const bool fits = width == environment.width && height == environment.height;
    const Environment smaller = fits ? Environment() : shrunk(environment, width, height);

    std::vector<CubeMap> pyramid{toCube(fits ? environment : smaller, environment.rotation, size)};
    while (pyramid.back().size > 1)
        pyramid.push_back(halved(pyramid.back()));

    EnvironmentMaps maps;
    const int levels = std::countr_zero(static_cast<unsigned>(size / kRoughestFace)) + 1;
    maps.radiance.push_back(pyramid.front());
    for (int level = 1; level < levels; ++level)
        maps.radiance.push_back(
            convolved(pyramid, size >> level, static_cast<double>(level) / (levels - 1)));
    const auto source = std::find_if(pyramid.begin(), pyramid.end(), [](const CubeMap& cube) {
        return cube.size <= kIrradianceSource;
    });
    maps.irradiance = irradianceOf(*source);
    return maps;
}

}  // namespace peeler
