// SPDX-License-Identifier: Apache-2.0
#include "cmd/verified_file.h"

#include <algorithm>
#include <cstring>
#include <limits>
#include <memory>

#include "cmd/console.h"
#include "cmd/report.h"
#include "core/error.h"
#include "core/layer_checks.h"
#include "formats/exr_layout.h"
#include "formats/layered_input.h"

namespace peeler::cmd {

namespace {

constexpr std::uint64_t kBandBytes = std::uint64_t{128} << 20;

std::string pixelsText(const BrokenPixels& broken) {
    return countText(broken.pixels, "pixel") + ", the first at (" + std::to_string(broken.x) +
           ", " + std::to_string(broken.y) + ")";
}

void blameIfAny(VerifiedFile& file, const BrokenPixels& broken, const std::string& what) {
    if (broken.pixels != 0) file.blame(Verdict::kBad, what + " in " + pixelsText(broken));
}

std::string at(const std::map<std::string, std::string>& attributes, const std::string& name) {
    const auto found = attributes.find(name);
    return found == attributes.end() ? std::string() : found->second;
}

/// The pixels of a layer in some rows, all channels.
struct PartRows {
    Window window;
    std::vector<std::vector<std::byte>> planes;  ///< in the order of the part's channels
    std::size_t depth = 0;                       ///< which of them is Z

    bool hasFragment(std::size_t pixel) const {
        float z = 0;
        std::memcpy(&z, planes[depth].data() + pixel * sizeof z, sizeof z);
        return z < std::numeric_limits<float>::infinity();
    }
};

void readRows(const ExrInput& input, std::size_t part, const std::string& prefix,
              const Window& window, PartRows& out) {
    const ExrInputPart& info = input.parts()[part];
    out.window = window;
    out.planes.clear();
    std::vector<ExrTarget> targets;
    for (const ExrInputChannel& channel : info.channels) {
        if (!channel.name.starts_with(prefix)) continue;
        const bool is_depth = channel.name == prefix + "Z";
        if (is_depth) out.depth = out.planes.size();
        const PixelType type = is_depth ? PixelType::kFloat : channel.type;
        auto& plane = out.planes.emplace_back(window.pixels() * pixelTypeSize(type));
        targets.push_back({channel.name, type, plane.data(),
                           static_cast<std::size_t>(window.width()) * pixelTypeSize(type)});
    }
    const int rows = input.rowsPerChunk(part);
    const int first = (window.y0 - info.data_window.y0) / rows * rows + info.data_window.y0;
    for (int y = first; y < window.y1; y += rows)
        input.readChunk(part, y, window, targets);
}

/// What the fragment lists do not show: pixels without a fragment, and layers that skip one.
void checkLayerParts(const std::string& path, const ExrInfo& info, VerifiedFile& file) {
    const ExrInput input(path);
    for (std::size_t k = 0; k < info.layers.size(); ++k) {
        const std::size_t part = info.layers[k];
        // Of a set of files the others are not checked here.
        if (part >= input.parts().size() || input.parts()[part].type != "scanlineimage" ||
            !input.parts()[part].channel(info.prefixes[k] + "Z"))
            return;
    }
    constexpr int kRows = 128;
    const Window& crop = info.plan.view.crop;
    const auto width = static_cast<std::size_t>(crop.width());
    std::vector<BrokenPixels> coloured(info.layers.size()), orphaned(info.layers.size());
    std::vector<BrokenPixels> not_a_number(info.layers.size());
    std::vector<bool> before, now;
    PartRows rows;
    for (int y0 = crop.y0; y0 < crop.y1; y0 += kRows) {
        const Window band{crop.x0, y0, crop.x1, std::min(y0 + kRows, crop.y1)};
        before.assign(band.pixels(), true);
        for (std::size_t k = 0; k < info.layers.size(); ++k) {
            const std::size_t part = info.layers[k];
            const Window window = intersect(band, input.parts()[part].data_window);
            now.assign(band.pixels(), false);
            if (!window.empty()) readRows(input, part, info.prefixes[k], window, rows);
            std::size_t pixel = 0;
            for (int y = window.y0; y < window.y1; ++y) {
                for (int x = window.x0; x < window.x1; ++x, ++pixel) {
                    const std::size_t in_band = static_cast<std::size_t>(y - band.y0) * width +
                                                static_cast<std::size_t>(x - band.x0);
                    now[in_band] = rows.hasFragment(pixel);
                    if (now[in_band]) {
                        if (!before[in_band]) orphaned[k].add(x, y);
                        continue;
                    }
                    bool zero = true;
                    for (std::size_t c = 0; c < rows.planes.size(); ++c) {
                        const auto& plane = rows.planes[c];
                        const std::size_t size = plane.size() / window.pixels();
                        const std::byte* value = plane.data() + pixel * size;
                        if (c == rows.depth) {
                            constexpr float kNone = std::numeric_limits<float>::infinity();
                            if (std::memcmp(value, &kNone, size) != 0) not_a_number[k].add(x, y);
                        } else {
                            zero = zero && std::all_of(value, value + size, [](std::byte b) {
                                       return b == std::byte{0};
                                   });
                        }
                    }
                    if (!zero) coloured[k].add(x, y);
                }
            }
            std::swap(before, now);
        }
    }
    for (std::size_t k = 0; k < info.layers.size(); ++k) {
        const std::string name = layerName(k);
        blameIfAny(file, not_a_number[k], name + ": Z is not a number");
        blameIfAny(file, coloured[k], name + ": there is colour without a fragment");
        blameIfAny(file, orphaned[k], name + ": there is a fragment and none in the layer before");
    }
}

void checkFragments(LayeredInput& input, VerifiedFile& file) {
    const ExrInfo& info = input.info();
    const Window& crop = info.plan.view.crop;
    BrokenPixels unsorted, infinite, wrong;
    LayeredImage band;
    CompositeImage composite;
    PixelType composite_type = PixelType::kFloat;
    if (info.composite >= 0) {
        const ExrInputPart& part = info.parts[static_cast<std::size_t>(info.composite)];
        if (const auto* red = part.channel("R")) composite_type = red->type;
        if (part.data_window != crop) {
            file.blame(Verdict::kBad, "the composite does not cover the pixels of the picture");
        }
    }
    const bool has_composite =
        info.composite >= 0 &&
        info.parts[static_cast<std::size_t>(info.composite)].data_window == crop;
    const int rows = input.rowsFor(kBandBytes);
    for (int y = crop.y0; y < crop.y1; y += rows) {
        const Window window{crop.x0, y, crop.x1, std::min(y + rows, crop.y1)};
        input.read(window, band);
        file.fragments += band.fragments();
        findUnsorted(band, unsorted);
        findInfinite(band, infinite);
        if (!has_composite) continue;
        input.readComposite(window, composite);
        findWrongComposite(band, composite, composite_type, wrong);
    }
    blameIfAny(file, unsorted, "the layers are not in order of Z");
    blameIfAny(file, infinite, "a fragment's Z is not finite");
    blameIfAny(file, wrong, "the composite is not what the layers make");
    if (file.fragments != info.plan.fragments_stored) {
        file.blame(Verdict::kBad, "the header says " + groupedText(info.plan.fragments_stored) +
                                      " fragments, and there are " + groupedText(file.fragments));
    }
}

void checkCompleteness(const ExrInfo& info, VerifiedFile& file) {
    const Plan& plan = info.plan;
    const bool says_complete = at(info.attributes(), "peeler:complete") == "1";
    if (says_complete != plan.complete()) {
        file.blame(Verdict::kBad, "peeler:complete is " + at(info.attributes(), "peeler:complete") +
                                      ", which the numbers of fragments deny");
    }
    if (plan.complete()) return;
    file.blame(Verdict::kIncomplete, "not complete: " + groupedText(plan.fragments_stored) +
                                         " of " + countText(plan.fragments_counted, "fragment"));
}

void verify(VerifiedFile& file) {
    const ExrInfo info = readExrInfo(file.path);
    file.width = info.plan.view.width;
    file.height = info.plan.view.height;
    file.provenance = info.provenance;
    file.kind = !info.is_peeler   ? VerifiedKind::kForeign
                : isLayered(info) ? VerifiedKind::kLayered
                                  : VerifiedKind::kFlat;
    if (info.is_peeler) checkCompleteness(info, file);
    if (file.kind == VerifiedKind::kLayered) {
        const std::unique_ptr<LayeredInput> input = openLayered(file.path);
        file.layers = input->info().plan.layers.size();
        checkFragments(*input, file);
        checkLayerParts(file.path, input->info(), file);
        return;
    }
    const ExrInput input(file.path);
    bool deep = false;
    for (std::size_t part = 0; part < input.parts().size(); ++part) {
        const bool part_is_deep = input.parts()[part].type.starts_with("deep");
        deep = deep || part_is_deep;
        if (!part_is_deep) input.decodeAll(part);
    }
    if (!deep) return;
    const std::unique_ptr<LayeredInput> layers = openLayered(file.path);
    const Window& crop = layers->info().plan.view.crop;
    const int rows = layers->rowsFor(kBandBytes);
    LayeredImage band;
    for (int y = crop.y0; y < crop.y1; y += rows)
        layers->read({crop.x0, y, crop.x1, std::min(y + rows, crop.y1)}, band);
}

}  // namespace

void VerifiedFile::blame(Verdict found, const std::string& problem) {
    verdict = std::max(verdict, found);
    problems.push_back(problem);
}

VerifiedFile verifyFile(const std::string& path) {
    VerifiedFile file;
    file.path = path;
    try {
        verify(file);
    } catch (const Error& error) {
        if (error.kind() != ErrorKind::kInput) throw;
        const std::string where = error.where() == path ? "" : ": " + printable(error.where());
        file.blame(Verdict::kBad, error.what() + where);
    }
    return file;
}

}  // namespace peeler::cmd
