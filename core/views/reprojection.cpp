// SPDX-License-Identifier: Apache-2.0
// Rasterisation of reprojected cells, in parallel strips of rows.
#include "core/views/reprojection.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <glm/glm.hpp>
#include <limits>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include <peeler/error.h>
#include "core/base/parallel.h"
#include "core/image/composite.h"
#include "core/scene/view.h"
#include "core/views/surface_cells.h"

namespace peeler {
namespace {

constexpr int kStripRows = 16;
constexpr int kBandStrips = 16;
/// Fixed-point steps per pixel. With this number, products of two coordinates fit into 64 bits.
constexpr double kSteps = 4096;
/// The maximum coordinate of a cell's corners, in pixels. Cells with larger coordinates almost
/// touch the camera, and are dropped.
constexpr double kFarOut = 1 << 17;
/// The minimum alpha of a fragment that hides the fragments behind it. The minimum is less than 1,
/// because interpolation of opaque fragments may give slightly less than 1.
constexpr float kOpaque = 0.9999F;

using Fixed = glm::tvec2<std::int64_t>;

/// A cell as seen by the other camera.
struct ScreenCell {
    std::array<Fixed, kCorners> corners;
    /// For each corner: the ratio of the two cameras' interpolation weights. Multiplying the
    /// corner's barycentric coordinate by this ratio makes interpolation a projective map between
    /// the pictures.
    std::array<double, kCorners> weights;
    Fixed least, most;
};

/// A fragment in a pixel, with the position (u, v) in its cell: -0.5 to 0.5 each, v down.
struct CellHit {
    std::uint32_t pixel, fragment;
    float z, u, v;
};

/// Rounds like std::llround, without a function call.
std::int64_t nearestInteger(double value) {
    return static_cast<std::int64_t>(value + (value < 0 ? -0.5 : 0.5));
}

/// Returns twice the signed area of a triangle. Exactly antisymmetric.
std::int64_t area(const Fixed& a, const Fixed& b, const Fixed& c) {
    return (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x);
}

class Reprojection {
  public:
    Reprojection(const LayeredImage& image, const View& from, const View& to)
        : image_(image),
          to_(to),
          from_rays_(from, image.window),
          to_rays_(to),
          // Exactly the identity if the two cameras are the same.
          from_to_to_(from.camera_to_world == to.camera_to_world
                          ? glm::dmat4(1)
                          : glm::inverse(to.camera_to_world) * from.camera_to_world),
          from_sample_(from.sample),
          cells_(surfaceCells(image, from_rays_)),
          strips_(static_cast<std::size_t>((to.crop.height() + kStripRows - 1) / kStripRows)) {
        findPixels();
        sortIntoStrips();
    }

    void run(const std::function<void(LayeredImage&& band)>& take) const {
        LayeredImage band;
        for (std::size_t first = 0; first < strips_; first += kBandStrips) {
            const std::size_t count = std::min<std::size_t>(kBandStrips, strips_ - first);
            std::vector<LayeredImage> parts(count);
            parallelFor(count, [&](std::size_t i) { render(first + i, parts[i]); });
            join(parts, band);
            take(std::move(band));
        }
    }

  private:
    /// Returns the pixel of a fragment.
    glm::ivec2 pixelOf(std::size_t fragment) const {
        const std::uint32_t pixel = pixels_[fragment];
        const auto width = static_cast<std::uint32_t>(image_.window.width());
        return {image_.window.x0 + static_cast<int>(pixel % width),
                image_.window.y0 + static_cast<int>(pixel / width)};
    }

    /// Returns a point in the other camera's space.
    glm::dvec3 seen(const glm::dvec3& point) const { return from_to_to_ * glm::dvec4(point, 1); }

    void findPixels() {
        pixels_.resize(image_.fragments());
        const auto width = static_cast<std::size_t>(image_.window.width());
        parallelFor(static_cast<std::size_t>(image_.window.height()), [&](std::size_t y) {
            for (std::size_t p = y * width; p < (y + 1) * width; ++p)
                std::fill(pixels_.begin() + image_.offsets[p],
                          pixels_.begin() + image_.offsets[p + 1], static_cast<std::uint32_t>(p));
        });
    }

    std::optional<ScreenCell> project(std::size_t fragment) const;
    /// The range [first, last) of the strips whose samples a cell may cover.
    using StripRange = std::array<std::uint16_t, 2>;
    StripRange stripsOf(const ScreenCell& cell) const;
    void sortIntoStrips();
    void rasterise(std::uint32_t fragment, const ScreenCell& cell, const Window& strip,
                   std::vector<CellHit>& hits) const;
    void addHit(std::uint32_t fragment, const glm::dvec2& in_cell, std::uint32_t pixel,
                std::vector<CellHit>& hits) const;
    TintedColor colorAt(const CellHit& hit) const;
    void render(std::size_t strip, LayeredImage& out) const;
    static void join(const std::vector<LayeredImage>& parts, LayeredImage& band);

    const LayeredImage& image_;
    const View& to_;
    CellRays from_rays_;
    PixelRays to_rays_;
    glm::dmat4 from_to_to_;
    glm::dvec2 from_sample_;
    SurfaceCells cells_;
    std::vector<std::uint32_t> pixels_;  ///< pixel of every fragment
    std::size_t strips_;
    /// For each strip: the index of its first entry in strip_fragments_. The last element is the
    /// end.
    std::vector<std::size_t> strip_offsets_;
    std::vector<std::uint32_t> strip_fragments_;  ///< fragments of each strip, in ascending order
};

std::optional<ScreenCell> Reprojection::project(std::size_t fragment) const {
    const glm::ivec2 pixel = pixelOf(fragment);
    const Projection& projection = to_.projection;
    ScreenCell cell;
    for (std::size_t c = 0; c < kCorners; ++c) {
        const double planar = cells_.corners[fragment][c];
        if (planar == 0 && from_rays_.perspective()) return {};
        const glm::dvec3 corner = from_rays_.corner(pixel.x, pixel.y, kCornerOffsets[c][0] > 0,
                                                    kCornerOffsets[c][1] > 0, planar);
        if (from_rays_.perspective() && corner == glm::dvec3(0)) return {};  // no ray
        const glm::dvec3 point = seen(corner);
        const double z = -point.z;
        if (!(z > projection.near && z <= projection.far)) return {};
        const glm::dvec2 at = to_rays_.pixel(point);
        if (!(std::abs(at.x) < kFarOut && std::abs(at.y) < kFarOut)) return {};
        cell.corners[c] = Fixed(nearestInteger(at.x * kSteps), nearestInteger(at.y * kSteps));
        cell.weights[c] = to_rays_.weight(z) / (from_rays_.perspective() ? planar : 1.0);
        cell.least = c == 0 ? cell.corners[c] : glm::min(cell.least, cell.corners[c]);
        cell.most = c == 0 ? cell.corners[c] : glm::max(cell.most, cell.corners[c]);
    }
    return cell;
}

/// Returns the first pixel whose sample is at or beyond a coordinate.
int firstPixel(std::int64_t coordinate, double sample) {
    return static_cast<int>(std::ceil(static_cast<double>(coordinate) / kSteps - sample));
}

Reprojection::StripRange Reprojection::stripsOf(const ScreenCell& cell) const {
    const int first = std::max(firstPixel(cell.least.y, to_.sample.y), to_.crop.y0);
    const int last = std::min(firstPixel(cell.most.y + 1, to_.sample.y), to_.crop.y1);
    const int left = std::max(firstPixel(cell.least.x, to_.sample.x), to_.crop.x0);
    const int right = std::min(firstPixel(cell.most.x + 1, to_.sample.x), to_.crop.x1);
    if (first >= last || left >= right) return {0, 0};
    return {static_cast<std::uint16_t>((first - to_.crop.y0) / kStripRows),
            static_cast<std::uint16_t>((last - 1 - to_.crop.y0) / kStripRows + 1)};
}

void Reprojection::sortIntoStrips() {
    // A counting sort in chunks of source rows. The result is in fragment order for any number of
    // threads.
    const auto width = static_cast<std::size_t>(image_.window.width());
    const auto height = static_cast<std::size_t>(image_.window.height());
    const std::size_t chunk_rows = 16, chunks = (height + chunk_rows - 1) / chunk_rows;
    std::vector<std::size_t> places(chunks * strips_);
    std::vector<StripRange> ranges(image_.fragments());
    const auto forEach = [&](std::size_t chunk, auto&& body) {
        const std::uint32_t begin = image_.offsets[chunk * chunk_rows * width];
        const std::uint32_t end =
            image_.offsets[std::min(height, (chunk + 1) * chunk_rows) * width];
        for (std::uint32_t f = begin; f < end; ++f) {
            for (std::size_t strip = ranges[f][0]; strip < ranges[f][1]; ++strip)
                body(f, places[chunk * strips_ + strip]);
        }
    };
    parallelFor(chunks, [&](std::size_t chunk) {
        const std::size_t end = std::min(height, (chunk + 1) * chunk_rows) * width;
        for (std::uint32_t f = image_.offsets[chunk * chunk_rows * width]; f < image_.offsets[end];
             ++f) {
            if (const auto cell = project(f)) ranges[f] = stripsOf(*cell);
        }
        forEach(chunk, [](std::uint32_t, std::size_t& place) { ++place; });
    });
    strip_offsets_.assign(strips_ + 1, 0);
    std::size_t total = 0;
    for (std::size_t strip = 0; strip < strips_; ++strip) {
        for (std::size_t chunk = 0; chunk < chunks; ++chunk) {
            const std::size_t count = places[chunk * strips_ + strip];
            places[chunk * strips_ + strip] = total;
            total += count;
        }
        strip_offsets_[strip + 1] = total;
    }
    strip_fragments_.resize(total);
    parallelFor(chunks, [&](std::size_t chunk) {
        forEach(chunk, [&](std::uint32_t f, std::size_t& place) { strip_fragments_[place++] = f; });
    });
}

void Reprojection::rasterise(std::uint32_t fragment, const ScreenCell& cell, const Window& strip,
                             std::vector<CellHit>& hits) const {
    const Window box = intersect(
        {firstPixel(cell.least.x, to_.sample.x), firstPixel(cell.least.y, to_.sample.y),
         firstPixel(cell.most.x + 1, to_.sample.x), firstPixel(cell.most.y + 1, to_.sample.y)},
        strip);
    if (box.empty()) return;
    const Fixed sample(nearestInteger(to_.sample.x * kSteps),
                       nearestInteger(to_.sample.y * kSteps));
    constexpr std::array<std::array<std::size_t, 3>, 2> kTriangles = {{{0, 1, 2}, {0, 2, 3}}};
    for (const auto& triangle : kTriangles) {
        std::array<std::size_t, 3> at = triangle;
        std::int64_t twice = area(cell.corners[at[0]], cell.corners[at[1]], cell.corners[at[2]]);
        if (twice == 0) continue;
        if (twice < 0) {  // seen from behind
            std::swap(at[1], at[2]);
            twice = -twice;
        }
        for (int y = box.y0; y < box.y1; ++y) {
            for (int x = box.x0; x < box.x1; ++x) {
                const auto step = static_cast<std::int64_t>(kSteps);
                const Fixed p = Fixed(x * step, y * step) + sample;
                std::array<double, 3> shares{};
                bool inside = true;
                for (std::size_t k = 0; k < 3 && inside; ++k) {
                    const Fixed& a = cell.corners[at[(k + 1) % 3]];
                    const Fixed& b = cell.corners[at[(k + 2) % 3]];
                    const std::int64_t edge = area(a, b, p);
                    // A sample on an edge belongs to one of the two cells that share the edge: the
                    // cell to the right of the edge or below it (clockwise, y down).
                    const bool owns = a.y == b.y ? b.x > a.x : b.y < a.y;
                    inside = edge > 0 || (edge == 0 && owns);
                    shares[k] = static_cast<double>(edge) * cell.weights[at[k]];
                }
                if (!inside) continue;
                glm::dvec2 in_cell(0);
                double sum = 0;
                for (std::size_t k = 0; k < 3; ++k) {
                    in_cell +=
                        shares[k] * glm::dvec2(kCornerOffsets[at[k]][0], kCornerOffsets[at[k]][1]);
                    sum += shares[k];
                }
                const auto pixel =
                    static_cast<std::uint32_t>((y - strip.y0) * strip.width() + x - strip.x0);
                addHit(fragment, in_cell / sum, pixel, hits);
            }
        }
    }
}

void Reprojection::addHit(std::uint32_t fragment, const glm::dvec2& in_cell, std::uint32_t pixel,
                          std::vector<CellHit>& hits) const {
    // Interpolates the corners' planar depth bilinearly, and corrects it so that the centre gets
    // the fragment's own depth. Nearly touching surfaces then keep their captured order when seen
    // from the captured camera.
    const auto& corners = cells_.corners[fragment];
    const double u = in_cell.x + 0.5, v = in_cell.y + 0.5;
    const double own = from_rays_.planar(image_.z[fragment]);
    const double mean =
        0.25 * (static_cast<double>(corners[0]) + corners[1] + corners[2] + corners[3]);
    const double planar =
        (1 - v) * ((1 - u) * corners[kUpperLeft] + u * corners[kUpperRight]) +
        v * ((1 - u) * corners[kLowerLeft] + u * corners[kLowerRight]) +
        (own - mean) * (1 - 2 * std::abs(in_cell.x)) * (1 - 2 * std::abs(in_cell.y));
    const glm::dvec2 at = from_sample_ + glm::dvec2(pixelOf(fragment)) + in_cell;
    const double z = -seen(from_rays_.point(at, planar)).z;
    hits.push_back({pixel, fragment, static_cast<float>(z), static_cast<float>(in_cell.x),
                    static_cast<float>(in_cell.y)});
}

TintedColor Reprojection::colorAt(const CellHit& hit) const {
    const auto& links = cells_.links;
    const Side across = hit.u < 0 ? kLeft : kRight, along = hit.v < 0 ? kUp : kDown;
    const std::uint32_t side = links[hit.fragment][across], end = links[hit.fragment][along];
    std::uint32_t far = kNoFragment;
    if (side != kNoFragment) far = links[side][along];
    if (far == kNoFragment && end != kNoFragment) far = links[end][across];
    const float u = std::abs(hit.u), v = std::abs(hit.v);
    const std::array<std::uint32_t, 4> around = {hit.fragment, side, end, far};
    const std::array<float, 4> shares = {(1 - u) * (1 - v), u * (1 - v), (1 - u) * v, u * v};
    TintedColor color{};
    float sum = 0;
    for (std::size_t i = 0; i < 4; ++i) {
        if (around[i] == kNoFragment || shares[i] <= 0) continue;
        const TintedColor one = tintedColorOf(image_, around[i]);
        for (std::size_t c = 0; c < one.size(); ++c)
            color[c] += shares[i] * one[c];
        sum += shares[i];
    }
    for (float& component : color)
        component /= sum;
    color[3] = meanOpacity(color[4], color[5], color[6]);
    return color;
}

void Reprojection::render(std::size_t strip, LayeredImage& out) const {
    out.window = to_.crop;
    out.window.y0 += static_cast<int>(strip) * kStripRows;
    out.window.y1 = std::min(out.window.y1, out.window.y0 + kStripRows);
    std::vector<CellHit> hits;
    for (std::size_t i = strip_offsets_[strip]; i < strip_offsets_[strip + 1]; ++i) {
        const std::uint32_t fragment = strip_fragments_[i];
        if (const auto cell = project(fragment)) rasterise(fragment, *cell, out.window, hits);
    }
    std::sort(hits.begin(), hits.end(), [](const CellHit& a, const CellHit& b) {
        if (a.pixel != b.pixel) return a.pixel < b.pixel;
        return a.z != b.z ? a.z < b.z : a.fragment < b.fragment;
    });

    out.color.channels = image_.color.channels;
    out.color.type = PixelType::kFloat;
    out.offsets.assign(out.window.pixels() + 1, 0);
    std::vector<TintedColor> colors;
    for (std::size_t i = 0; i < hits.size();) {
        const std::uint32_t pixel = hits[i].pixel;
        bool hidden = false;
        for (; i < hits.size() && hits[i].pixel == pixel; ++i) {
            if (hidden) continue;
            colors.push_back(colorAt(hits[i]));
            out.z.push_back(hits[i].z);
            ++out.offsets[pixel + 1];
            const TintedColor& color = colors.back();
            hidden = std::min({color[4], color[5], color[6]}) >= kOpaque;
        }
    }
    for (std::size_t p = 0; p + 1 < out.offsets.size(); ++p)
        out.offsets[p + 1] += out.offsets[p];
    out.color.data.resize(colors.size() * out.color.stride());
    for (std::size_t f = 0; f < colors.size(); ++f)
        storeColor(colors[f], out.color, f);
}

void Reprojection::join(const std::vector<LayeredImage>& parts, LayeredImage& band) {
    std::size_t fragments = 0;
    for (const LayeredImage& part : parts)
        fragments += part.fragments();
    if (fragments > std::numeric_limits<std::uint32_t>::max()) {
        throw Error(ErrorKind::kMemory, "a band of the view has more than 2^32 fragments", {},
                    "choose a smaller " + Parameter::kSize);
    }
    band.window = unite(parts.front().window, parts.back().window);
    band.color.channels = parts.front().color.channels;
    band.color.type = parts.front().color.type;
    band.extra.clear();
    band.offsets.assign(1, 0);
    band.z.clear();
    band.color.data.clear();
    for (const LayeredImage& part : parts) {
        const std::uint32_t before = band.offsets.back();
        for (std::size_t p = 1; p < part.offsets.size(); ++p)
            band.offsets.push_back(before + part.offsets[p]);
        band.z.insert(band.z.end(), part.z.begin(), part.z.end());
        band.color.data.insert(band.color.data.end(), part.color.data.begin(),
                               part.color.data.end());
    }
}

}  // namespace

void reproject(const LayeredImage& image, const View& from, const View& to,
               const std::function<void(LayeredImage&& band)>& take) {
    Reprojection(image, from, to).run(take);
}

}  // namespace peeler
