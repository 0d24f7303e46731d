// SPDX-License-Identifier: Apache-2.0
#include "cmd/verify/verified_layers.h"

#include <algorithm>
#include <bit>
#include <cstring>
#include <limits>
#include <vector>

#include "cmd/verify/verified_file.h"
#include "formats/exr/exr_layout.h"

namespace peeler::cmd {

namespace {

constexpr int kRowsAtOnce = 128;

/// Some rows of a layer, with all channels.
class PartRows {
  public:
    /// Reads a window of the layer whose channel names begin with `prefix`.
    void read(const ExrInput& input, std::size_t part, const std::string& prefix,
              const Window& window);

    const Window& window() const { return window_; }
    bool hasFragment(std::size_t pixel) const { return depth(pixel) < kNone; }
    /// Whether Z is exactly +infinity, as required for a pixel without a fragment.
    bool hasNoDepth(std::size_t pixel) const {
        return std::bit_cast<std::uint32_t>(depth(pixel)) == std::bit_cast<std::uint32_t>(kNone);
    }
    /// Whether any channel except Z has a bit that is not 0.
    bool hasColor(std::size_t pixel) const;

  private:
    static constexpr float kNone = std::numeric_limits<float>::infinity();
    struct Plane {
        std::size_t size = 0;  ///< bytes of each value
        std::vector<std::byte> values;
    };
    float depth(std::size_t pixel) const {
        float z = 0;
        std::memcpy(&z, planes_[depth_].values.data() + pixel * sizeof z, sizeof z);
        return z;
    }

    Window window_;
    std::vector<Plane> planes_;  ///< one plane per channel, in the order of the part's channels
    std::size_t depth_ = 0;      ///< index of the plane of Z
};

void PartRows::read(const ExrInput& input, std::size_t part, const std::string& prefix,
                    const Window& window) {
    const ExrInputPart& info = input.parts()[part];
    window_ = window;
    if (window.empty()) return;
    planes_.resize(info.channels.size());  // channels of other layers get empty planes
    std::vector<ExrTarget> targets;
    for (std::size_t c = 0; c < info.channels.size(); ++c) {
        Plane& plane = planes_[c];
        plane = {};
        if (!info.channels[c].name.starts_with(prefix)) continue;
        const bool is_depth = info.channels[c].name == prefix + "Z";
        if (is_depth) depth_ = c;
        const PixelType type = is_depth ? PixelType::kFloat : info.channels[c].type;
        plane.size = pixelTypeSize(type);
        plane.values.resize(window.pixels() * plane.size);
        targets.push_back({info.channels[c].name, type, plane.values.data(),
                           static_cast<std::size_t>(window.width()) * plane.size});
    }
    const int rows = input.rowsPerChunk(part);
    const int skipped = (window.y0 - info.data_window.y0) / rows * rows;
    for (int y = info.data_window.y0 + skipped; y < window.y1; y += rows)
        input.readChunk(part, y, window, targets);
}

bool PartRows::hasColor(std::size_t pixel) const {
    for (std::size_t c = 0; c < planes_.size(); ++c) {
        if (c == depth_) continue;
        const std::byte* value = planes_[c].values.data() + pixel * planes_[c].size;
        if (std::any_of(value, value + planes_[c].size,
                        [](std::byte b) { return b != std::byte{}; }))
            return true;
    }
    return false;
}

/// The pixels with faults. `no_number`: Z is not +infinity although there is no fragment;
/// `colored`: a colour without a fragment; `orphaned`: a fragment although the previous layer has
/// no fragment in this pixel.
struct LayerFindings {
    BrokenPixels no_number, colored, orphaned;
};

/// Checks rows of a layer. `before` has a flag for each pixel of the band: whether the previous
/// layer has a fragment in the pixel. `now` receives the flags of this layer.
void checkRows(const PartRows& rows, const Window& band, const std::vector<bool>& before,
               std::vector<bool>& now, LayerFindings& findings) {
    const Window& window = rows.window();
    const auto width = static_cast<std::size_t>(band.width());
    std::size_t pixel = 0;
    now.assign(band.pixels(), false);
    for (int y = window.y0; y < window.y1; ++y) {
        for (int x = window.x0; x < window.x1; ++x, ++pixel) {
            const std::size_t in_band = static_cast<std::size_t>(y - band.y0) * width +
                                        static_cast<std::size_t>(x - band.x0);
            if (rows.hasFragment(pixel)) {
                now[in_band] = true;
                if (!before[in_band]) findings.orphaned.add(x, y);
                continue;
            }
            if (!rows.hasNoDepth(pixel)) findings.no_number.add(x, y);
            if (rows.hasColor(pixel)) findings.colored.add(x, y);
        }
    }
}

/// Whether every layer is stored in scan-line parts of this file. Other layers cannot be checked:
/// deep layers store no pixels without a fragment, and other layouts store layers in other files.
bool hasPartsOfLayers(const ExrInput& input, const ExrInfo& info) {
    for (std::size_t k = 0; k < info.layers.size(); ++k) {
        if (info.layers[k] >= input.parts().size()) return false;
        const ExrInputPart& part = input.parts()[info.layers[k]];
        if (part.type != "scanlineimage" || !part.channel(info.prefixes[k] + "Z")) return false;
    }
    return true;
}

}  // namespace

void checkLayerParts(const std::string& path, const ExrInfo& info, VerifiedFile& file) {
    const ExrInput input(path);
    if (!hasPartsOfLayers(input, info)) return;
    std::vector<LayerFindings> findings(info.layers.size());
    std::vector<bool> before, now;
    PartRows rows;
    const Window& crop = info.plan.view.crop;
    for (int y = crop.y0; y < crop.y1; y += kRowsAtOnce) {
        const Window band{crop.x0, y, crop.x1, std::min(y + kRowsAtOnce, crop.y1)};
        before.assign(band.pixels(), true);
        for (std::size_t k = 0; k < info.layers.size(); ++k) {
            const std::size_t part = info.layers[k];
            rows.read(input, part, info.prefixes[k],
                      intersect(band, input.parts()[part].data_window));
            checkRows(rows, band, before, now, findings[k]);
            std::swap(before, now);
        }
    }
    for (std::size_t k = 0; k < info.layers.size(); ++k) {
        const std::string name = layerName(k);
        file.blame(findings[k].no_number, name + ": Z is not a number");
        file.blame(findings[k].colored, name + ": colour without a fragment");
        file.blame(findings[k].orphaned, name + ": fragment, but none in the previous layer");
    }
}

}  // namespace peeler::cmd
