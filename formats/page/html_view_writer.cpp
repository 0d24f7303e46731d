// SPDX-License-Identifier: Apache-2.0
// Writer of the viewer page.
//
// Fragments are packed in 18 bytes each (3 more with coloured opacity, 4 with object ids, 4 with
// material ids), as differences, which DEFLATE compresses well.
#include "formats/page/html_view_writer.h"

#include <libdeflate.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>
#include <memory>
#include <nlohmann/json.hpp>
#include <set>
#include <span>
#include <string_view>
#include <utility>
#include <vector>

#include <peeler/composite.h>
#include <peeler/error.h>
#include "core/base/color.h"
#include "core/base/parallel.h"
#include "core/base/stage_times.h"
#include "core/image/statistics.h"
#include "core/scene/view.h"
#include "core/views/surface_cells.h"
#include "formats/file/atomic_file.h"
#include "formats/file/content_hash.h"
#include "formats/file/json_text.h"

namespace peeler {
namespace {

using Json = nlohmann::ordered_json;
using Rgba = std::array<float, 4>;

/// The bytes per fragment before compression: kPlanes without colour and ids; kIdPlanes for each
/// kind of id.
constexpr std::size_t kPlanes = 14, kIdPlanes = 4;
/// The bytes of memory per fragment in finish(): kScratch without ids; kIdScratch in addition if
/// there are ids.
constexpr std::uint64_t kScratch = 84, kIdScratch = 2 * kIdPlanes;

/// The fragments in the page's order: layer by layer, row by row.
struct LayerOrder {
    struct Place {
        std::uint32_t fragment, pixel;
    };
    std::vector<Place> places;
    std::vector<std::uint64_t> ends;  ///< index in `places` of the end of each layer
};

LayerOrder orderByLayer(const LayeredImage& image, const PixelRays& rays) {
    LayerOrder order;
    const auto pixels = static_cast<std::uint32_t>(image.window.pixels());
    std::uint32_t layers = 0;
    for (std::uint32_t p = 0; p < pixels; ++p)
        layers = std::max(layers, image.count(p));
    order.places.reserve(image.fragments());
    for (std::uint32_t layer = 0; layer < layers; ++layer) {
        for (std::uint32_t p = 0; p < pixels; ++p) {
            if (layer >= image.count(p)) continue;
            const std::uint32_t fragment = image.offsets[p] + layer;
            if (rays.isSeen(rays.planar(image.z[fragment]))) order.places.push_back({fragment, p});
        }
        order.ends.push_back(order.places.size());
    }
    return order;
}

/// Returns the depth value that the page stores. For a perspective camera, this is log2 Z, which
/// has the same relative precision near and far. For an orthographic camera, this is Z, which may
/// be 0.
double depthMeasure(const PixelRays& rays, double planar) {
    return rays.perspective() ? -std::log2(planar) : planar;
}

struct Range {
    double low = std::numeric_limits<double>::infinity();
    double high = -std::numeric_limits<double>::infinity();
    void add(double value) {
        low = std::min(low, value);
        high = std::max(high, value);
    }
    /// Returns the 16-bit code for a value's position in the range.
    std::uint16_t code(double value) const {
        const double share = std::clamp((value - low) / (high - low), 0.0, 1.0);
        return static_cast<std::uint16_t>(std::lround(65535 * share));
    }
    /// Returns the range, slightly enlarged if its length is zero; 0 to 1 if it is empty.
    Range widened() const {
        if (!(low <= high)) return {0, 1};
        return {low, high > low ? high : low + std::max(1e-6, 1e-6 * std::abs(low))};
    }
};

/// R, G, B, A, AR, AG, AB as bytes.
using EncodedColor = std::array<std::uint8_t, kTintedComponents>;

/// A kind of ids that fragments have, and its key in the page.
struct IdKind {
    const char *channel, *key;
    std::vector<std::string> IdNames::*names;
};
constexpr std::array<IdKind, 2> kIdKinds = {{{"id.object", "objects", &IdNames::objects},
                                             {"id.material", "materials", &IdNames::materials}}};

/// A fragment's values, as the page stores them.
struct PackedFragment {
    std::uint32_t pixel = 0;                        ///< index of the pixel in the window, row-major
    std::array<std::uint16_t, kCorners> corners{};  ///< depth codes of the corners
    std::uint16_t depth = 0;                        ///< depth code of the fragment itself
    EncodedColor color{};
    std::array<std::uint32_t, kIdKinds.size()> ids{};
};

/// A packer of fragments in byte planes. Each value is stored as the difference from a prediction.
/// The planes are: pixel (4 bytes); the upper left corner, the lower left corner, the rise from the
/// upper left to the upper right corner, and the additional rise of the lower right corner (2 bytes
/// each); colour (4, or 7 with opacity per channel); the code of the fragment's own depth less the
/// mean of its corners (2); and the ids, if any (4 each). unpack() in page_drawing.js reverses the
/// packing.
class Packer {
  public:
    Packer(std::size_t count, bool tinted, const std::array<bool, kIdKinds.size()>& ids)
        : count_(count),
          colors_(colorComponents(tinted)),
          ids_(ids),
          planes_((kPlanes + colors_ +
                   kIdPlanes * static_cast<std::size_t>(std::ranges::count(ids, true))) *
                  count) {}

    void add(const PackedFragment& fragment) {
        plane_ = 0;
        put(fragment.pixel - last_.pixel, 4);
        // On a surface, the left corners equal the right corners of the previous fragment, and the
        // slope changes little, so the stored differences are small.
        const auto& corners = fragment.corners;
        const std::uint32_t rise = corners[kUpperRight] - std::uint32_t{corners[kUpperLeft]};
        put(corners[kUpperLeft] - std::uint32_t{last_.corners[kUpperRight]}, 2);
        put(corners[kLowerLeft] - std::uint32_t{last_.corners[kLowerRight]}, 2);
        put(rise - rise_, 2);
        put(corners[kLowerRight] - std::uint32_t{corners[kLowerLeft]} - rise, 2);
        rise_ = rise;
        for (std::size_t c = 0; c < colors_; ++c)
            put(std::uint32_t{fragment.color[c]} - last_.color[c], 1);
        std::uint32_t sum = 2;  // half of kCorners, for rounding
        for (const std::uint16_t corner : corners)
            sum += corner;
        put(fragment.depth - static_cast<std::uint32_t>(sum / kCorners), 2);
        for (std::size_t kind = 0; kind < kIdKinds.size(); ++kind)
            if (ids_[kind]) put(fragment.ids[kind] - last_.ids[kind], 4);
        last_ = fragment;
        ++at_;
    }

    std::span<const std::uint8_t> bytes() const { return planes_; }

  private:
    void put(std::uint32_t value, int bytes) {
        for (int i = 0; i < bytes; ++i)
            planes_[plane_++ * count_ + at_] = static_cast<std::uint8_t>(value >> (8 * i));
    }

    std::size_t count_, colors_, at_ = 0, plane_ = 0;
    std::array<bool, kIdKinds.size()> ids_;
    std::vector<std::uint8_t> planes_;
    PackedFragment last_;
    std::uint32_t rise_ = 0;
};

std::vector<std::uint8_t> deflated(std::span<const std::uint8_t> bytes) {
    const std::unique_ptr<libdeflate_compressor, decltype(&libdeflate_free_compressor)> compressor(
        libdeflate_alloc_compressor(6), libdeflate_free_compressor);
    std::vector<std::uint8_t> packed(
        libdeflate_zlib_compress_bound(compressor.get(), bytes.size()));
    packed.resize(libdeflate_zlib_compress(compressor.get(), bytes.data(), bytes.size(),
                                           packed.data(), packed.size()));
    return packed;
}

/// Returns the bytes as Base64 (RFC 4648, section 4).
std::string base64(std::span<const std::uint8_t> bytes) {
    constexpr std::string_view kDigits =
        "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    std::string text;
    text.reserve((bytes.size() + 2) / 3 * 4);
    for (std::size_t i = 0; i < bytes.size(); i += 3) {
        const std::size_t count = std::min<std::size_t>(3, bytes.size() - i);
        std::uint32_t group = 0;
        for (std::size_t k = 0; k < 3; ++k)
            group = group << 8 | (k < count ? bytes[i + k] : 0U);
        for (std::size_t k = 0; k < 4; ++k)
            text += k <= count ? kDigits[group >> (18 - 6 * k) & 63] : '=';
    }
    return text;
}

/// Returns JSON for a <script> element, with '<' escaped so that no text looks like a tag.
std::string scriptText(const Json& value) {
    std::string text;
    for (const char c : dumpJson(value, -1, true)) {
        if (c == '<')
            text += "\\u003c";
        else
            text += c;
    }
    return text;
}

/// Returns a colour as the page stores it: premultiplied sRGB after the display transform, alpha,
/// and the opacity of each channel. `color` is linear and premultiplied.
EncodedColor encodedColor(const TintedColor& color, const Display& display) {
    const Rgba shown = display.shown(untinted(color));
    const auto byte = [](float value) {
        return static_cast<std::uint8_t>(std::lround(255 * value));
    };
    EncodedColor bytes{};
    for (std::size_t c = 0; c < 3; ++c)
        bytes[c] = byte(encodeSrgb(shown[c]));
    for (std::size_t c = 3; c < color.size(); ++c)
        bytes[c] = byte(color[c] > 0 ? std::min(color[c], 1.0F) : 0);  // NaN gives 0
    return bytes;
}

/// Returns the exposure in stops. Automatic exposure is metered from the composite of the layers,
/// unless the view is a part of a picture.
float exposureOf(const OutputOptions& options, const LayeredImage& image, const View& view) {
    if (!options.automatic_exposure || isPart(view)) return options.exposure;
    CompositeImage composite;
    compositeOver(image, {}, composite);
    ExposureMeter meter;
    meter.add(composite);
    return meter.stopsIfNeeded();
}

/// Returns the axis around which the page turns the layers: world +Y in camera space or, if the
/// camera looks along world Y, the picture's up direction.
glm::dvec3 turningAxis(const View& view) {
    const glm::dvec3 up(view.camera_to_world[0].y, view.camera_to_world[1].y,
                        view.camera_to_world[2].y);
    return std::abs(up.z) < 0.999 ? glm::normalize(up) : glm::dvec3(0, 1, 0);
}

Json describeView(const View& view, const LayeredImage& image, const LayerOrder& order,
                  const Range& codes) {
    const PixelRays rays(view);
    const double distance = medianDepth(image, view).value_or(1);
    Range depths;
    double radius = 0;
    const auto width = static_cast<std::uint32_t>(image.window.width());
    for (const auto& [fragment, pixel] : order.places) {
        const double z = image.z[fragment];
        depths.add(z);
        const glm::dvec2 at(image.window.x0 + static_cast<int>(pixel % width),
                            image.window.y0 + static_cast<int>(pixel / width));
        const glm::dvec3 point = rays.point(at + view.sample, rays.planar(z));
        radius = std::max(radius, glm::length(point + glm::dvec3(0, 0, distance)));
    }
    const Range shown = depths.widened();
    const Projection& projection = view.projection;
    const glm::dvec3 up = turningAxis(view);
    return {{"width", view.width},
            {"height", view.height},
            {"window", {image.window.x0, image.window.y0, std::max(1U, width)}},
            {"sample", {view.sample.x, view.sample.y}},
            {"perspective", projection.perspective},
            {"half", {projection.half_width, projection.half_height}},
            {"up", {up.x, up.y, up.z}},
            {"range", {codes.low, codes.high}},
            {"depths", {shown.low, shown.high}},
            {"distance", distance},
            // The corners of cells lie slightly farther from the centre than the samples.
            {"radius", 1.05 * radius + 0.01 * std::abs(distance)},
            {"layerEnds", order.ends}};
}

/// Returns the ids in use with their names. An id without a name has null.
Json namesOf(const FragmentChannel& ids, const LayerOrder& order,
             const std::vector<std::string>& names) {
    std::set<std::uint32_t> used;
    for (const auto& place : order.places)
        used.insert(ids.id(place.fragment));
    Json named = Json::object();
    for (const std::uint32_t id : used) {
        const std::size_t row = id - std::size_t{1};
        named[std::to_string(id)] = row < names.size() ? Json(names[row]) : Json();
    }
    return named;
}

void appendArray(FragmentArray& to, const FragmentArray& from) {
    to.channels = from.channels;
    to.type = from.type;
    to.data.insert(to.data.end(), from.data.begin(), from.data.end());
}

}  // namespace

HtmlViewWriter::HtmlViewWriter(std::string path, OutputOptions options)
    : path_(std::move(path)),
      options_(std::move(options)),
      display_(options_.exposure, options_.tone_map) {}

void HtmlViewWriter::begin(const Plan& plan) {
    if (plan.fragments_stored > options_.max_fragments) {
        throw Error(ErrorKind::kUsage,
                    "the page is limited to " + std::to_string(options_.max_fragments) +
                        " fragments, but there are " + std::to_string(plan.fragments_stored),
                    path_,
                    "give a smaller " + Parameter::kMaxLayers + ", render a smaller " +
                        Parameter::kSize + ", or raise " + Parameter::kMaxFragments +
                        " (1 to 7 bytes of page each)");
    }
    plan_ = plan;
    image_ = {};
    image_.window = plan.view.crop;
    image_.offsets.assign(1, 0);
}

void HtmlViewWriter::write(LayeredImage&& band) {
    const std::uint32_t before = image_.offsets.back();
    for (std::size_t p = 1; p < band.offsets.size(); ++p)
        image_.offsets.push_back(before + band.offsets[p]);
    image_.z.insert(image_.z.end(), band.z.begin(), band.z.end());
    appendArray(image_.color, band.color);
    image_.extra.resize(band.extra.size());
    for (std::size_t i = 0; i < band.extra.size(); ++i)
        appendArray(image_.extra[i], band.extra[i]);
}

SinkMemory HtmlViewWriter::memory(const Plan& plan) const {
    const std::uint64_t bytes = kScratch + (options_.provenance.ids.empty() ? 0 : kIdScratch);
    return {.rows = plan.view.crop.height(), .bytes = plan.fragments_stored * bytes};
}

void HtmlViewWriter::finish() {
    const View& view = plan_.view;
    std::string json, data;
    {
        const StageTimer timer(times_, "encode");
        const PixelRays rays(view);
        const LayerOrder order = orderByLayer(image_, rays);
        const SurfaceCells cells = surfaceCells(image_, view);
        Range codes;
        for (const auto& place : order.places) {
            codes.add(depthMeasure(rays, rays.planar(image_.z[place.fragment])));
            for (const float planar : cells.corners[place.fragment])
                codes.add(depthMeasure(rays, planar));
        }
        codes = codes.widened();

        const float exposure = exposureOf(options_, image_, view);
        if (options_.outcome) *options_.outcome = {exposure, 0};
        display_ = Display(exposure, options_.tone_map);
        std::array<FragmentChannel, kIdKinds.size()> ids;
        std::array<bool, kIdKinds.size()> has_ids{};
        for (std::size_t kind = 0; kind < kIdKinds.size(); ++kind) {
            ids[kind] = findIds(image_, kIdKinds[kind].channel);
            has_ids[kind] = static_cast<bool>(ids[kind]);
        }
        Packer packer(order.places.size(), plan_.tinted, has_ids);
        for (const auto& [fragment, pixel] : order.places) {
            PackedFragment packed{.pixel = pixel};
            for (std::size_t c = 0; c < kCorners; ++c)
                packed.corners[c] = codes.code(depthMeasure(rays, cells.corners[fragment][c]));
            packed.depth = codes.code(depthMeasure(rays, rays.planar(image_.z[fragment])));
            packed.color = encodedColor(tintedColorOf(image_, fragment), display_);
            for (std::size_t kind = 0; kind < kIdKinds.size(); ++kind)
                if (has_ids[kind]) packed.ids[kind] = ids[kind].id(fragment);
            packer.add(packed);
        }
        data = base64(deflated(packer.bytes()));

        Json about = describeView(view, image_, order, codes);
        if (plan_.tinted) about["tinted"] = true;
        for (std::size_t kind = 0; kind < kIdKinds.size(); ++kind) {
            if (!has_ids[kind]) continue;
            const auto& [channel, key, names] = kIdKinds[kind];
            about[key] = namesOf(ids[kind], order, options_.provenance.ids.*names);
        }
        const std::string& scene = options_.provenance.scene;
        about["title"] = scene.empty() ? "A scene" : scene;
        Rgba background = options_.background;
        if (background == Rgba{}) background.fill(linearFromSrgb(0.86F));
        about["background"] = {background[0], background[1], background[2]};
        json = scriptText(about);
    }
    const StageTimer timer(times_, "write");
    AtomicFile file(path_);
    std::string_view rest = viewPage();
    const std::string hash = outputHashText(options_.provenance.output_hash);
    const std::array<std::pair<std::string_view, std::string_view>, 5> fields = {
        {{"{{hash}}", hash},
         {"{{view}}", json},
         {"{{fragments}}", data},
         {"{{drawing}}", pageDrawing()},
         {"{{controls}}", pageControls()}}};
    const auto append = [&](std::string_view text) { file.append(std::as_bytes(std::span(text))); };
    for (const auto& [name, text] : fields) {
        const std::size_t at = rest.find(name);
        append(rest.substr(0, at));
        append(text);
        rest.remove_prefix(at + name.size());
    }
    append(rest);
    file.commit();
    image_ = {};
}

}  // namespace peeler
