// SPDX-License-Identifier: Apache-2.0
#include "core/splats/projected_splats.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <bit>
#include <cmath>
#include <glm/gtc/quaternion.hpp>
#include <limits>
#include <utility>

#include "core/base/color.h"
#include "core/base/parallel.h"
#include "core/scene/view.h"

namespace peeler {
namespace {

constexpr std::size_t kSplatsAtOnce = 4096;
constexpr double kLeastOpacity = 1.0 / 255;
constexpr double kLeastExponent = -4.5;  // 3 standard deviations
constexpr double kFieldMargin = 1.3;     // of the first paper's code
// The least standard deviation of an axis, as a share of the largest, so that thin splats have a
// depth along rays.
constexpr double kLeastScale = 1e-4;

/// Returns the colour toward a direction of mesh space, of length 1.
glm::dvec3 colorToward(const Splats& splats, std::size_t i, const glm::dvec3& d) {
    const glm::vec3* const sh = splats.harmonics.data() + i * splats.coefficients();
    const auto at = [&](std::size_t n) { return glm::dvec3(sh[n]); };
    const double x = d.x, y = d.y, z = d.z, xx = x * x, yy = y * y, zz = z * z;
    glm::dvec3 color = 0.5 + 0.28209479177387814 * at(0);
    if (splats.degree >= 1) color += 0.4886025119029199 * (z * at(2) - y * at(1) - x * at(3));
    if (splats.degree >= 2)
        color += 1.092548430592079 * (x * y * at(4) - y * z * at(5) - x * z * at(7)) +
                 0.31539156525252 * (2 * zz - xx - yy) * at(6) +
                 0.5462742152960395 * (xx - yy) * at(8);
    if (splats.degree >= 3)
        color += -0.5900435899266435 * (y * (3 * xx - yy) * at(9) + x * (xx - 3 * yy) * at(15)) +
                 2.890611442640554 * x * y * z * at(10) -
                 0.4570457994644657 * (4 * zz - xx - yy) * (y * at(11) + x * at(13)) +
                 0.3731763325901154 * z * (2 * zz - 3 * xx - 3 * yy) * at(12) +
                 1.445305721320277 * z * (xx - yy) * at(14);
    return glm::max(color, 0.0);
}

/// Returns the rotation of a matrix: its axes with length 1.
glm::dmat3 rotationOf(const glm::dmat3& m) {
    return {unitOrZero(m[0]), unitOrZero(m[1]), unitOrZero(m[2])};
}

/// Rounds a distance to 21 bits. Different ones are then different when divided by the length of a
/// pixel's ray, so that splats in order of distance are in order of Z in every pixel.
float sortedDistance(double distance) {
    const auto bits = std::bit_cast<std::uint32_t>(static_cast<float>(distance));
    return std::bit_cast<float>((bits + 4) & ~7U);
}

/// The splats of one instance of a primitive.
struct SplatPiece {
    const Splats* splats = nullptr;
    const std::vector<glm::vec3>* means = nullptr;
    glm::dmat4 camera_from_mesh{1};  ///< to camera space, x right, y down, z forward
    glm::dmat3 toward_mesh{1};       ///< turns directions of camera space to mesh space
    std::uint32_t first_key = 0;
};

/// Returns the direction of the camera's ray to a mean, of length 1, in mesh space.
glm::dvec3 rayTo(const SplatPiece& piece, const glm::dvec3& mean, bool perspective) {
    const glm::dvec3 ray = perspective ? glm::dvec3(piece.camera_from_mesh * glm::dvec4(mean, 1))
                                       : glm::dvec3(0, 0, 1);
    return unitOrZero(piece.toward_mesh * ray);
}

/// Returns the colour of a splat toward the camera: sRGB-encoded if `encoded`, else linear.
glm::dvec3 colorOf(const SplatPiece& piece, std::size_t i, bool perspective, bool encoded) {
    const glm::dvec3 toward = rayTo(piece, glm::dvec3((*piece.means)[i]), perspective);
    glm::dvec3 color = colorToward(*piece.splats, i, toward);
    for (int c = 0; c < 3; ++c) {
        if (encoded && piece.splats->linear) color[c] = srgbFromLinear(color[c]);
        if (!encoded && !piece.splats->linear) color[c] = linearFromSrgb(color[c]);
    }
    return glm::min(color, 65504.0);
}

class SplatProjector {
  public:
    SplatProjector(const View& view, const CaptureSettings& settings)
        : settings_(settings),
          perspective_(view.projection.perspective),
          by_center_(settings.splat_order == SplatOrder::kCenter),
          near_(view.projection.near),
          far_(view.projection.far),
          middle_(0.5 * glm::dvec2(view.width, view.height)),
          focal_(middle_ / glm::dvec2(view.projection.half_width, view.projection.half_height)),
          field_(kFieldMargin *
                 glm::dvec2(view.projection.half_width, view.projection.half_height)) {}

    /// Projects a splat. Returns false if it has no fragments.
    bool project(const SplatPiece& piece, std::size_t i, ProjectedSplat& out,
                 SplatDepth* depth) const {
        const Splats& splats = *piece.splats;
        const glm::dvec3 mean((*piece.means)[i]);
        const glm::dvec3 at(piece.camera_from_mesh * glm::dvec4(mean, 1));
        if (!(at.z > near_ && at.z < far_)) return false;
        const auto& q = splats.rotations[i];
        const glm::dmat3 axes =
            glm::dmat3(piece.camera_from_mesh) * glm::mat3_cast(glm::dquat(q.w, q.x, q.y, q.z));
        const glm::dvec3 scale(splats.scales[i]);
        glm::dmat3 half;  // of the covariance: half · halfᵀ
        for (int k = 0; k < 3; ++k)
            half[k] = axes[k] * scale[k];

        // The rows of the Jacobian.
        glm::dvec3 to_x(focal_.x, 0, 0), to_y(0, focal_.y, 0);
        glm::dvec2 place = middle_ + focal_ * glm::dvec2(at);
        if (perspective_) {
            const glm::dvec2 slope = glm::clamp(glm::dvec2(at) / at.z, -field_, field_);
            to_x = focal_.x / at.z * glm::dvec3(1, 0, -slope.x);
            to_y = focal_.y / at.z * glm::dvec3(0, 1, -slope.y);
            place = middle_ + focal_ * glm::dvec2(at) / at.z;
        }
        const glm::dvec3 along_x = glm::transpose(half) * to_x,
                         along_y = glm::transpose(half) * to_y;
        const double plain_xx = glm::dot(along_x, along_x), plain_yy = glm::dot(along_y, along_y),
                     xy = glm::dot(along_x, along_y);
        const double dilation = settings_.splat_dilation.value_or(splats.dilation);
        const double xx = plain_xx + dilation, yy = plain_yy + dilation;
        const double determinant = xx * yy - xy * xy;
        if (!(determinant > 0) || !std::isfinite(determinant)) return false;
        double opacity = static_cast<double>(splats.opacities[i]);
        if (splats.compensated)
            opacity *= std::sqrt(std::max(plain_xx * plain_yy - xy * xy, 0.0) / determinant);
        if (!(opacity >= kLeastOpacity)) return false;

        const double least = std::max(kLeastExponent, std::log(kLeastOpacity / opacity));
        out.x = static_cast<float>(place.x);
        out.y = static_cast<float>(place.y);
        out.half_width = static_cast<float>(std::sqrt(-2 * least * xx));
        out.half_height = static_cast<float>(std::sqrt(-2 * least * yy));
        // The rows of a Gaussian are Gaussians of one width, whose means lie on a line.
        out.lean = static_cast<float>(xy / yy);
        out.across = static_cast<float>(std::sqrt(0.5 * yy / determinant));
        out.down = static_cast<float>(std::sqrt(0.5 / yy));
        out.least = static_cast<float>(least);
        out.opacity = static_cast<float>(opacity);
        out.z = static_cast<float>(at.z);
        if (splats.by_distance && by_center_ && perspective_)
            out.distance = sortedDistance(glm::length(at));
        out.key = piece.first_key + static_cast<std::uint32_t>(i);
        setColor(piece, i, out);
        if (depth) setDepth(axes, scale, at, dilation, *depth);
        return std::isfinite(out.x) && std::isfinite(out.y) && std::isfinite(out.half_width) &&
               std::isfinite(out.half_height);
    }

  private:
    void setColor(const SplatPiece& piece, std::size_t i, ProjectedSplat& out) const {
        const glm::dvec3 color =
            colorOf(piece, i, perspective_, settings_.splat_blending == SplatBlending::kDisplay);
        out.red = static_cast<float>(color.r);
        out.green = static_cast<float>(color.g);
        out.blue = static_cast<float>(color.b);
    }

    /// Sets the depth along rays of the dilated splat, up to a common factor of both terms. The
    /// dilation adds to the variances across the viewing axis.
    void setDepth(const glm::dmat3& axes, const glm::dvec3& scale, const glm::dvec3& at,
                  double dilation, SplatDepth& depth) const {
        const double largest = std::max({scale.x, scale.y, scale.z});
        const glm::dmat3 own = glm::inverse(axes);  // to the splat's axes
        glm::dmat3 white;                           // to where the splat is a sphere
        for (int k = 0; k < 3; ++k)
            for (int row = 0; row < 3; ++row)
                white[k][row] =
                    own[k][row] * (largest / std::max(scale[row], kLeastScale * largest));
        glm::dmat3 p = glm::transpose(white) * white;
        if (dilation > 0) {
            // The inverse of a sum (Woodbury), which is exact for thin splats, too.
            const glm::dvec2 pixel = (perspective_ ? at.z : 1) / (focal_ * largest);
            glm::dmat2 sum(p);
            sum[0][0] += 1 / (dilation * pixel.x * pixel.x);
            sum[1][1] += 1 / (dilation * pixel.y * pixel.y);
            const glm::dmat2x3 across(p[0], p[1]);
            p -= across * glm::inverse(sum) * glm::transpose(across);
        }
        const glm::dvec3 along = p * at;
        for (int k = 0; k < 3; ++k)
            depth.along[k] = static_cast<float>(along[k]);
        constexpr std::array<std::array<int, 2>, 6> kEntries{
            {{0, 0}, {0, 1}, {0, 2}, {1, 1}, {1, 2}, {2, 2}}};
        for (std::size_t e = 0; e < 6; ++e)
            depth.precision[e] = static_cast<float>(p[kEntries[e][0]][kEntries[e][1]]);
    }

    const CaptureSettings& settings_;
    bool perspective_, by_center_;
    double near_, far_;
    glm::dvec2 middle_, focal_, field_;
};

std::vector<SplatPiece> piecesOf(const PosedScene& posed, const View& view) {
    std::vector<SplatPiece> pieces;
    glm::dmat4 camera_from_world = glm::inverse(view.camera_to_world);
    for (int column = 0; column < 4; ++column) {
        camera_from_world[column].y *= -1;
        camera_from_world[column].z *= -1;
    }
    for (const DrawnSurface& surface : posed.drawList().surfaces()) {
        const MeshInstance& instance = posed.meshes()[surface.instance];
        const Primitive& primitive = posed.primitives(instance)[surface.primitive];
        if (!primitive.splats) continue;
        SplatPiece piece;
        piece.splats = primitive.splats.get();
        piece.means = &posed.positions(instance, surface.primitive);
        piece.camera_from_mesh = camera_from_world * instance.world;
        // Colours turn with the node, but its scale does not change them.
        piece.toward_mesh = glm::transpose(rotationOf(glm::dmat3(instance.world))) *
                            glm::inverse(glm::dmat3(camera_from_world));
        piece.first_key = surface.first_key;
        pieces.push_back(piece);
    }
    return pieces;
}

/// The projected splats of some successive splats of a scene.
struct SplatPart {
    std::vector<ProjectedSplat> splats;
    std::vector<SplatDepth> depths;
};

/// Where a projected splat is. `depth`: the bits of its distance or Z, which are positive and so
/// have the same order.
struct SplatPlace {
    std::uint32_t depth, part;
    std::uint16_t at;
};

std::vector<SplatPlace> placesOf(const std::vector<SplatPart>& parts) {
    std::vector<std::size_t> first(parts.size() + 1);
    for (std::size_t part = 0; part < parts.size(); ++part)
        first[part + 1] = first[part] + parts[part].splats.size();
    std::vector<SplatPlace> places(first.back());
    parallelFor(parts.size(), [&](std::size_t part) {
        for (std::size_t i = 0; i < parts[part].splats.size(); ++i) {
            const ProjectedSplat& s = parts[part].splats[i];
            places[first[part] + i] = {
                std::bit_cast<std::uint32_t>(s.distance > 0 ? s.distance : s.z),
                static_cast<std::uint32_t>(part), static_cast<std::uint16_t>(i)};
        }
    });
    return places;
}

/// Sorts by depth: a stable radix sort.
void sortByDepth(std::vector<SplatPlace>& places) {
    constexpr unsigned kBits = 8, kDigits = 1U << kBits;
    constexpr std::size_t kAtOnce = std::size_t{1} << 16;
    const std::size_t chunks = (places.size() + kAtOnce - 1) / kAtOnce;
    std::vector<SplatPlace> sorted(places.size());
    std::vector<std::array<std::uint32_t, kDigits>> starts(chunks);
    for (unsigned shift = 0; shift < 32; shift += kBits) {
        const auto forChunk = [&](std::size_t chunk, const auto& use) {
            const std::size_t end = std::min(places.size(), (chunk + 1) * kAtOnce);
            for (std::size_t i = chunk * kAtOnce; i < end; ++i)
                use(places[i], starts[chunk][places[i].depth >> shift & (kDigits - 1)]);
        };
        parallelFor(chunks, [&](std::size_t chunk) {
            starts[chunk] = {};
            forChunk(chunk, [](const SplatPlace&, std::uint32_t& count) { ++count; });
        });
        std::uint32_t start = 0;
        for (unsigned digit = 0; digit < kDigits; ++digit)
            for (std::size_t chunk = 0; chunk < chunks; ++chunk)
                start += std::exchange(starts[chunk][digit], start);
        parallelFor(chunks, [&](std::size_t chunk) {
            forChunk(chunk,
                     [&](const SplatPlace& place, std::uint32_t& to) { sorted[to++] = place; });
        });
        places.swap(sorted);
    }
}

/// Returns the splats in the order of `places`.
SplatPicture pictureOf(const std::vector<SplatPart>& parts, const std::vector<SplatPlace>& places,
                       bool by_ray) {
    constexpr std::size_t kLanes = 8;
    const std::size_t count = places.size(), padded = (count + kLanes - 1) / kLanes * kLanes;
    SplatPicture picture;
    picture.splats.resize(count);
    picture.depths.resize(by_ray ? count : 0);
    SplatBoxes& boxes = picture.boxes;
    for (std::vector<float>* low : {&boxes.low_x, &boxes.low_y})
        low->resize(padded, std::numeric_limits<float>::infinity());
    for (std::vector<float>* high : {&boxes.high_x, &boxes.high_y})
        high->resize(padded, -std::numeric_limits<float>::infinity());
    std::atomic<bool> by_z = false, by_distance = false;
    parallelFor((count + kSplatsAtOnce - 1) / kSplatsAtOnce, [&](std::size_t task) {
        const std::size_t end = std::min(count, (task + 1) * kSplatsAtOnce);
        for (std::size_t i = task * kSplatsAtOnce; i < end; ++i) {
            const SplatPart& part = parts[places[i].part];
            const std::size_t from = places[i].at;
            const ProjectedSplat& s = picture.splats[i] = part.splats[from];
            if (by_ray) picture.depths[i] = part.depths[from];
            boxes.low_x[i] = s.x - s.half_width;
            boxes.low_y[i] = s.y - s.half_height;
            boxes.high_x[i] = s.x + s.half_width;
            boxes.high_y[i] = s.y + s.half_height;
            (s.distance > 0 ? by_distance : by_z).store(true, std::memory_order_relaxed);
        }
    });
    picture.by_distance = by_distance;
    picture.mixed = by_distance && by_z;
    return picture;
}

}  // namespace

namespace {

template <class Is>
bool hasSplats(const PosedScene& posed, Is&& is) {
    return std::ranges::any_of(posed.meshes(), [&](const MeshInstance& instance) {
        return std::ranges::any_of(posed.primitives(instance), [&](const Primitive& primitive) {
            return primitive.splats && is(*primitive.splats);
        });
    });
}

}  // namespace

bool hasSplats(const PosedScene& posed) {
    return hasSplats(posed, [](const Splats&) { return true; });
}

bool hasOnlySplats(const PosedScene& posed) {
    return posed.drawList().draws().empty() && hasSplats(posed);
}

bool hasLinearSplats(const PosedScene& posed) {
    return hasSplats(posed, [](const Splats& splats) { return splats.linear; });
}

SplatPicture projectSplats(const PosedScene& posed, const View& view,
                           const CaptureSettings& settings) {
    const bool by_ray = settings.splat_order == SplatOrder::kRay;
    const SplatProjector projector(view, settings);
    const std::vector<SplatPiece> pieces = piecesOf(posed, view);
    struct Task {
        const SplatPiece* piece;
        std::size_t first;
    };
    std::vector<Task> tasks;
    for (const SplatPiece& piece : pieces)
        for (std::size_t first = 0; first < piece.splats->size(); first += kSplatsAtOnce)
            tasks.push_back({&piece, first});
    std::vector<SplatPart> parts(tasks.size());
    parallelFor(tasks.size(), [&](std::size_t task) {
        const auto [piece, first] = tasks[task];
        const std::size_t end = std::min(piece->splats->size(), first + kSplatsAtOnce);
        SplatPart& part = parts[task];
        part.splats.reserve(end - first);
        part.depths.reserve(by_ray ? end - first : 0);
        for (std::size_t i = first; i < end; ++i) {
            ProjectedSplat splat;
            SplatDepth depth;
            if (!projector.project(*piece, i, splat, by_ray ? &depth : nullptr)) continue;
            part.splats.push_back(splat);
            if (by_ray) part.depths.push_back(depth);
        }
    });
    std::vector<SplatPlace> places = placesOf(parts);
    sortByDepth(places);
    return pictureOf(parts, places, by_ray);
}

std::uint64_t projectionBytes(std::uint64_t splats, const CaptureSettings& settings) {
    const std::uint64_t depth = settings.splat_order == SplatOrder::kRay ? sizeof(SplatDepth) : 0;
    constexpr std::uint64_t kBox = 4 * sizeof(float);
    return splats * (2 * (sizeof(ProjectedSplat) + depth + sizeof(SplatPlace)) + kBox) +
           splats / kSplatsAtOnce * sizeof(SplatPart);
}

std::vector<glm::vec3> splatColors(const PosedScene& posed, const View& view,
                                   std::span<const std::uint32_t> keys) {
    const std::vector<SplatPiece> pieces = piecesOf(posed, view);
    std::vector<glm::vec3> colors(keys.size());
    parallelFor((keys.size() + kSplatsAtOnce - 1) / kSplatsAtOnce, [&](std::size_t part) {
        const std::size_t end = std::min(keys.size(), (part + 1) * kSplatsAtOnce);
        for (std::size_t i = part * kSplatsAtOnce; i < end; ++i) {
            const auto after =
                std::ranges::upper_bound(pieces, keys[i], {}, &SplatPiece::first_key);
            const SplatPiece& piece = *std::prev(after);
            colors[i] =
                colorOf(piece, keys[i] - piece.first_key, view.projection.perspective, false);
        }
    });
    return colors;
}

}  // namespace peeler
