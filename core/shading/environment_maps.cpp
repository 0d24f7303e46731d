// SPDX-License-Identifier: Apache-2.0
// Prefiltered environment maps. The mean of a lobe over an environment is a weighted sum over a few
// directions. Each direction represents a patch of sky. The mean radiance of a patch is looked up
// in a pyramid of cube maps, as in Křivánek & Colbert, "Real-time Shading with Filtered Importance
// Sampling", 2008. Unlike in their method, patches lie side by side in rings around the lobe's
// axis, so that there are no gaps, and bright lamps cause no grain.
#include "core/shading/environment_maps.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <functional>
#include <numbers>

#include "core/base/parallel.h"

namespace peeler {
namespace {

// Texels per side of the sharpest level. Mirror reflections keep the resolution of the environment
// picture (up to kLargestFace), and the levels for wide lobes do not become too coarse.
constexpr int kSmallFace = 16, kUsualFace = 128, kLargestFace = 512;
constexpr int kRoughestFace = 8;
constexpr int kIrradianceFace = 16, kIrradianceSource = 32;
// Texels per side of the pyramid's coarsest face. Patches are no larger than its texels.
constexpr int kCoarsestFace = 8;

// The axes of each face: along the rows, down the columns, and outward (OpenGL 4.6, table 8.19).
constexpr std::array<glm::mat3, 6> kFaceAxes = {
    glm::mat3(0, 0, -1, 0, -1, 0, 1, 0, 0), glm::mat3(0, 0, 1, 0, -1, 0, -1, 0, 0),
    glm::mat3(1, 0, 0, 0, 0, 1, 0, 1, 0),   glm::mat3(1, 0, 0, 0, 0, -1, 0, -1, 0),
    glm::mat3(1, 0, 0, 0, -1, 0, 0, 0, 1),  glm::mat3(-1, 0, 0, 0, -1, 0, 0, 0, -1)};

std::size_t index(int x, int y, int width) {
    return static_cast<std::size_t>(y) * static_cast<std::size_t>(width) +
           static_cast<std::size_t>(x);
}

std::size_t texelOf(const CubeMap& cube, int face, int x, int y) {
    return index(x, face * cube.size + y, cube.size);
}

/// Returns the number of rows of all faces.
std::size_t rowsOf(const CubeMap& cube) {
    return std::size_t{6} * static_cast<std::size_t>(cube.size);
}

CubeMap makeCube(int size) {
    CubeMap cube;
    cube.size = size;
    cube.texels.resize(6 * index(0, size, size));
    return cube;
}

/// The source texels under a destination texel, along one axis, with their weights.
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

/// Returns the radiance from a direction, interpolated between the four nearest pixels; wraps
/// around in longitude.
glm::vec3 lookUp(const Environment& image, double rotation, const glm::vec3& direction) {
    constexpr auto kPi = std::numbers::pi_v<float>;
    const float longitude = std::atan2(direction.x, direction.z) - static_cast<float>(rotation);
    const float latitude = std::asin(std::clamp(direction.y, -1.0F, 1.0F));
    const float u = 0.5F - longitude / (2 * kPi);
    const float x = (u - std::floor(u)) * static_cast<float>(image.width) - 0.5F;
    const float y = std::clamp((0.5F - latitude / kPi) * static_cast<float>(image.height) - 0.5F,
                               0.0F, static_cast<float>(image.height - 1));
    const int left = static_cast<int>(std::floor(x)), upper = static_cast<int>(y);
    const float across = x - static_cast<float>(left), down = y - static_cast<float>(upper);
    const int x0 = (left + image.width) % image.width, x1 = (left + 1) % image.width;
    const int y1 = std::min(upper + 1, image.height - 1);
    const std::vector<glm::vec3>& r = image.radiance;
    return glm::mix(
        glm::mix(r[index(x0, upper, image.width)], r[index(x1, upper, image.width)], across),
        glm::mix(r[index(x0, y1, image.width)], r[index(x1, y1, image.width)], across), down);
}

CubeMap toCube(const Environment& image, double rotation, int size) {
    CubeMap cube = makeCube(size);
    // If a texel of the cube is smaller than a pixel of the image, one lookup is enough. Otherwise
    // four lookups are averaged.
    const int parts = 4 * size > image.width ? 1 : 2;
    parallelFor(rowsOf(cube), [&](std::size_t row) {
        const int face = static_cast<int>(row) / size, y = static_cast<int>(row) % size;
        for (int x = 0; x < size; ++x) {
            glm::vec3 sum(0);
            for (int part = 0; part < parts * parts; ++part)
                sum += lookUp(image, rotation,
                              cubeDirection(face, parts * x + part % parts,
                                            parts * y + part / parts, parts * size));
            cube.texels[texelOf(cube, face, x, y)] = sum / static_cast<float>(parts * parts);
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

/// Returns the face that a direction hits.
int faceOf(const glm::vec3& d) {
    const glm::vec3 size = glm::abs(d);
    if (size.x >= size.y && size.x >= size.z) return d.x > 0 ? 0 : 1;
    if (size.y >= size.z) return d.y > 0 ? 2 : 3;
    return d.z > 0 ? 4 : 5;
}

/// A cube map whose faces have a border copied from their neighbours, for interpolation across
/// edges. Texels have four floats, so that one load reads a texel.
class SeamlessCube {
  public:
    explicit SeamlessCube(const CubeMap& cube)
        : size_(cube.size),
          width_(cube.size + 2),
          half_(0.5F * static_cast<float>(cube.size)),
          texels_(6 * index(0, width_, width_)) {
        for (int face = 0; face < 6; ++face) {
            for (int y = -1; y <= size_; ++y) {
                const bool inside = y >= 0 && y < size_;
                for (int x = -1; x <= size_; ++x)
                    texels_[index(x + 1, face * width_ + y + 1, width_)] = glm::vec4(
                        inside && x >= 0 && x < size_ ? cube.texels[texelOf(cube, face, x, y)]
                                                      : beyond(cube, face, x, y),
                        0);
            }
        }
    }

    int size() const { return size_; }

    /// Returns the interpolated radiance from a direction of any length. `own` is the direction in
    /// the axes of `face`, even if the direction hits another face.
    glm::vec4 at(int face, const glm::vec3& own) const {
        if (std::max(std::abs(own.x), std::abs(own.y)) <= own.z) return on(face, own);
        const glm::vec3 direction = kFaceAxes[static_cast<std::size_t>(face)] * own;
        const int other = faceOf(direction);
        return on(other, direction * kFaceAxes[static_cast<std::size_t>(other)]);
    }

  private:
    /// Returns the interpolated radiance from a direction that hits `face`.
    glm::vec4 on(int face, const glm::vec3& own) const {
        const float scale = half_ / own.z;
        // Texel index plus 1 for the border; never negative.
        const float x = own.x * scale + (half_ + 0.5F), y = own.y * scale + (half_ + 0.5F);
        const int left = static_cast<int>(x), upper = static_cast<int>(y);
        const float across = x - static_cast<float>(left), down = y - static_cast<float>(upper);
        const glm::vec4* row = texels_.data() + index(left, face * width_ + upper, width_);
        const glm::vec4* next = row + width_;
        return (row[0] * (1 - across) + row[1] * across) * (1 - down) +
               (next[0] * (1 - across) + next[1] * across) * down;
    }

    /// Returns a texel of a neighbouring face: the one nearest to a border texel of this face.
    static glm::vec3 beyond(const CubeMap& cube, int face, int x, int y) {
        const glm::vec3 direction = cubeDirection(face, x, y, cube.size);
        const int other = faceOf(direction);
        const glm::vec3 own = direction * kFaceAxes[static_cast<std::size_t>(other)];
        const float half = 0.5F * static_cast<float>(cube.size);
        const auto nearest = [&](float at) {
            return std::clamp(static_cast<int>((at / own.z + 1) * half), 0, cube.size - 1);
        };
        return cube.texels[texelOf(cube, other, nearest(own.x), nearest(own.y))];
    }

    int size_, width_;
    float half_;
    std::vector<glm::vec4> texels_;
};

/// A patch of a lobe around +Z. It has a centre (by the mean cosine), a weight in the lobe, and the
/// pyramid level whose texels have about the patch's size.
struct Patch {
    glm::vec3 direction{0};
    float weight = 0;
    std::size_t level = 0;
};

/// Returns the patches of a lobe. `angles` are the borders of rings, measured from the axis. Each
/// ring is divided into `around` patches of equal weight. The weight of a patch is the integral of
/// `lobe`, a function of the angle, over the patch's solid angle.
std::vector<Patch> patches(const std::vector<double>& angles, int around,
                           const std::function<double(double)>& lobe,
                           const std::vector<SeamlessCube>& pyramid) {
    constexpr int kSteps = 16;
    const double finest = pyramid.front().size();
    std::vector<Patch> all;
    double total = 0;
    for (std::size_t ring = 0; ring + 1 < angles.size(); ++ring) {
        const double begin = angles[ring], step = (angles[ring + 1] - begin) / kSteps;
        double sum = 0, moment = 0;
        for (int i = 0; i < kSteps; ++i) {
            const double angle = begin + (i + 0.5) * step, share = lobe(angle) * std::sin(angle);
            sum += share;
            moment += share * std::cos(angle);
        }
        if (!(sum > 0)) continue;
        const double middle = std::acos(moment / sum), turn = ring % 2 == 0 ? 0 : 0.5;
        const double solid_angle =
            2 * std::numbers::pi / around * (std::cos(begin) - std::cos(angles[ring + 1]));
        const double texel = 4 * std::numbers::pi / (6 * finest * finest);
        const double level = 0.5 * std::log2(solid_angle / texel);
        Patch patch;
        patch.level = static_cast<std::size_t>(
            std::clamp(level + 0.5, 0.0, static_cast<double>(pyramid.size() - 1)));
        patch.weight = static_cast<float>(sum * step);
        for (int i = 0; i < around; ++i) {
            const double phi = 2 * std::numbers::pi * (i + turn) / around;
            patch.direction = {std::sin(middle) * std::cos(phi), std::sin(middle) * std::sin(phi),
                               std::cos(middle)};
            all.push_back(patch);
        }
        total += sum * step * around;
    }
    for (Patch& patch : all)
        patch.weight = static_cast<float>(patch.weight / total);
    return all;
}

/// Returns the patches from which a GGX surface facing +Z reflects light toward a viewer at +Z,
/// weighted by the light's cosine.
std::vector<Patch> ggxPatches(double roughness, const std::vector<SeamlessCube>& pyramid) {
    const double alpha = roughness * roughness;
    // In units of alpha, all narrow lobes have the same shape, and half of their weight is within 1
    // unit of the axis. Wide lobes get more patches, which costs little because the maps for wide
    // lobes have few texels.
    constexpr int kWideRings = 10;
    const bool wide = alpha > 0.2;
    std::vector<double> angles{0};
    if (wide)
        for (int ring = 1; ring < kWideRings; ++ring)
            angles.push_back(std::numbers::pi / 2 * ring / kWideRings);
    else
        for (double x = 0.3; x * alpha < 1; x *= x < 4 ? 1.6 : 2)
            angles.push_back(2 * std::atan(x * alpha));
    angles.push_back(std::numbers::pi / 2);
    return patches(
        angles, wide ? 16 : 9,
        [&](double angle) {
            const double cosine = std::cos(angle / 2);
            const double d = cosine * cosine * (alpha * alpha - 1) + 1;
            return std::cos(angle) / (d * d);
        },
        pyramid);
}

CubeMap convolved(const std::vector<SeamlessCube>& pyramid, int size,
                  const std::vector<Patch>& lobe) {
    CubeMap cube = makeCube(size);
    parallelFor(rowsOf(cube), [&](std::size_t row) {
        const int face = static_cast<int>(row) / size, y = static_cast<int>(row) % size;
        const glm::mat3& axes = kFaceAxes[static_cast<std::size_t>(face)];
        for (int x = 0; x < size; ++x) {
            // Tangents are computed in the face's axes, where they vary smoothly from texel to
            // texel.
            const glm::vec3 n = cubeDirection(face, x, y, size) * axes;
            const glm::vec3 tangent = glm::normalize(glm::vec3(n.z, 0, -n.x));
            const glm::vec3 bitangent = glm::cross(n, tangent);
            glm::vec4 sum(0);
            for (const Patch& patch : lobe)
                sum +=
                    patch.weight * pyramid[patch.level].at(face, patch.direction.x * tangent +
                                                                     patch.direction.y * bitangent +
                                                                     patch.direction.z * n);
            cube.texels[texelOf(cube, face, x, y)] = glm::vec3(sum);
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
                // A texel's solid angle is inversely proportional to the cube of the texel's
                // distance from the cube's centre.
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
    // Shrinks the environment to about one pixel per direction.
    const int height = std::max(1, static_cast<int>(std::lround(std::sqrt(count / 2.0))));
    coarse_ = shrunk(environment, std::min(2 * height, environment.width),
                     std::min(height, environment.height));
    coarse_.rotation = environment.rotation;
}

glm::vec3 EnvironmentSamples::radiance(const glm::dvec3& direction) const {
    return lookUp(coarse_, coarse_.rotation, glm::vec3(direction));
}

glm::vec3 cubeDirection(int face, int x, int y, int size) {
    const float scale = 2 / static_cast<float>(size);
    const glm::vec3 own((static_cast<float>(x) + 0.5F) * scale - 1,
                        (static_cast<float>(y) + 0.5F) * scale - 1, 1);
    return kFaceAxes[static_cast<std::size_t>(face)] * glm::normalize(own);
}

double levelRoughness(int level, int levels) {
    const double t = static_cast<double>(level) / (levels - 1);
    return (1.4 - std::sqrt(1.96 - 1.6 * t)) / 0.8;
}

EnvironmentMaps prefilter(const Environment& environment) {
    const auto texels = [](int pixels) {
        return static_cast<int>(std::bit_ceil(static_cast<unsigned>(std::min(pixels, 1 << 16))));
    };
    const int least = std::clamp(texels(environment.width), kSmallFace, kUsualFace);
    const int size = std::clamp(texels(environment.width / 4), least, kLargestFace);
    // Sources with finer pixels than the cube's texels are reduced first, because they would alias.
    const int width = std::min(environment.width, 4 * size);
    const int height = std::min(environment.height, 2 * size);
    const bool fits = width == environment.width && height == environment.height;
    const Environment smaller = fits ? Environment() : shrunk(environment, width, height);

    EnvironmentMaps maps;
    maps.radiance.push_back(toCube(fits ? environment : smaller, environment.rotation, size));
    std::vector<SeamlessCube> pyramid;
    for (CubeMap cube = maps.radiance.front(); cube.size >= kCoarsestFace; cube = halved(cube)) {
        pyramid.emplace_back(cube);
        if (cube.size == std::min(kIrradianceSource, size)) maps.irradiance = irradianceOf(cube);
    }
    const int levels = std::countr_zero(static_cast<unsigned>(size / kRoughestFace)) + 1;
    for (int level = 1; level < levels; ++level)
        maps.radiance.push_back(
            convolved(pyramid, size >> level, ggxPatches(levelRoughness(level, levels), pyramid)));
    return maps;
}

}  // namespace peeler
