// SPDX-License-Identifier: Apache-2.0
// Deep image reader: reads the sample counts, then the samples; stores each sample in its fragment;
// and sorts the fragments.
#include "formats/exr/exr_readers.h"

#include <Imath/half.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <limits>
#include <numeric>
#include <set>

#include <peeler/error.h>
#include "core/base/parallel.h"
#include "core/base/resize_anew.h"
#include "core/image/composite.h"
#include "core/image/layers.h"
#include "formats/exr/exr_attributes.h"

namespace peeler {
namespace {

/// The maximum number of samples per pixel, and thus of layers.
constexpr std::uint32_t kMostSamples = 1 << 16;
/// The maximum size of the samples read at once, in bytes. A larger value is not faster, because
/// touching new memory takes time.
constexpr std::uint64_t kMostSampleBytes = std::uint64_t{64} << 20U;

float floatAt(const std::byte* from, PixelType type) {
    if (type == PixelType::kFloat) {
        float value = 0;
        std::memcpy(&value, from, sizeof value);
        return value;
    }
    std::uint16_t bits = 0;
    std::memcpy(&bits, from, sizeof bits);
    return imath_half_to_float(bits);
}

/// Stores consecutive values as one component of the fragments [begin, end).
template <class T>
void storeComponent(const std::byte* from, FragmentArray& array, std::size_t component,
                    std::size_t begin, std::size_t end) {
    const std::span<T> to = array.as<T>();
    const std::size_t step = array.components();
    for (std::size_t f = begin; f < end; ++f, from += sizeof(T))
        std::memcpy(&to[f * step + component], from, sizeof(T));
}

void storeComponent(const std::byte* from, PixelType type, FragmentArray& color,
                    std::size_t component, std::size_t begin, std::size_t end) {
    if (color.type == type) {
        if (type == PixelType::kHalf) {
            storeComponent<std::uint16_t>(from, color, component, begin, end);
        } else {
            storeComponent<float>(from, color, component, begin, end);
        }
        return;
    }
    // The channel is half in the file, but the colours are float because of another channel.
    for (std::size_t f = begin; f < end; ++f, from += pixelTypeSize(type))
        color.as<float>()[f * color.components() + component] = floatAt(from, type);
}

/// Reorders the fragments of an array. `order` holds the old index of each fragment.
template <class T>
void permute(T* values, std::size_t stride, const std::vector<std::uint32_t>& order,
             std::vector<std::byte>& scratch) {
    const std::size_t bytes = stride * sizeof(T);
    scratch.resize(order.size() * bytes);
    std::memcpy(scratch.data(), values, scratch.size());
    for (std::size_t i = 0; i < order.size(); ++i)
        std::memcpy(values + i * stride, scratch.data() + order[i] * bytes, bytes);
}

/// Sorts the fragments of each pixel by Z, stably.
void sortFragments(LayeredImage& image) {
    const auto width = static_cast<std::size_t>(image.window.width());
    parallelFor(static_cast<std::size_t>(image.window.height()), [&](std::size_t row) {
        std::vector<std::uint32_t> order;
        std::vector<std::byte> scratch;
        for (std::size_t p = row * width; p < (row + 1) * width; ++p) {
            float* z = image.z.data() + image.offsets[p];
            if (std::is_sorted(z, z + image.count(p))) continue;
            order.resize(image.count(p));
            std::iota(order.begin(), order.end(), 0U);
            std::stable_sort(order.begin(), order.end(),
                             [&](std::uint32_t a, std::uint32_t b) { return z[a] < z[b]; });
            permute(z, 1, order, scratch);
            const auto reorder = [&](FragmentArray& array) {
                permute(array.data.data() + image.offsets[p] * array.stride(), array.stride(),
                        order, scratch);
            };
            reorder(image.color);
            for (FragmentArray& array : image.extra)
                reorder(array);
        }
    });
}

std::uint64_t sampleBytes(const ExrInputPart& part) {
    std::uint64_t bytes = 0;
    for (const ExrInputChannel& channel : part.channels)
        bytes += pixelTypeSize(channel.type);
    return bytes;
}

}  // namespace

ExrDeepReader::ExrDeepReader(OpenedExr opened, const ExrPicture& picture)
    : opened_(std::move(opened)), colors_(picture.colors) {
    parts_.push_back({picture.part, {}});
    placePixels(info_.plan.view, info_.parts[picture.part].data_window, opened_.options.pixels_only,
                input_.path());
    if (opened_.options.part.empty()) {
        for (const std::size_t other : findOthers(picture.part))
            parts_.push_back({other, {}});
    }
    countSamples();
    info_.deep.clear();
    for (const Part& part : parts_)
        info_.deep.push_back(part.index);
    findChannels();
    if (!info_.is_peeler) warnOfColors();
    warnOfUnread(opened_, info_.deep);
    readCarried(opened_, picture.part);
}

ExrDeepReader::~ExrDeepReader() = default;

void ExrDeepReader::warnOfColors() {
    ReadWarnings& warnings = opened_.warnings;
    const std::string where = input_.where(parts_.front().index);
    if (!colors_.colored())
        warnings.warn("The samples have no colours (R, G, B or Y): they are black.", where);
    else if (!colors_.complete())
        warnings.warn("The samples lack R, G or B; what is missing is taken as 0.", where);
    if (!colors_.chroma[0].empty())
        warnings.warn("The samples' colours are taken as grey (Y), without RY and BY.", where);
    if (colors_.alpha.empty() && !colors_.tinted())
        warnings.warn("The samples have no alpha (A, or AR, AG and AB): they are opaque.", where);
}

/// Returns the parts other than `main` that may describe the same samples, judged by their headers.
std::vector<std::size_t> ExrDeepReader::findOthers(std::size_t main) const {
    std::vector<std::size_t> others;
    std::set<std::string> known;
    const auto isDepth = [](const std::string& name) { return name == "Z" || name == "ZBack"; };
    const ExrInputPart& first = info_.parts[main];
    for (const ExrInputChannel& channel : first.channels)
        known.insert(channel.name);
    for (const std::string& name : colorNames(colors_.tinted()))
        known.insert(name);
    for (const std::size_t index : info_.deep) {
        if (index == main) continue;
        const ExrInputPart& part = info_.parts[index];
        bool joins = part.data_window == first.data_window && sameBlocks(main, index) &&
                     part.attribute("view") == first.attribute("view");
        for (const ExrInputChannel& channel : part.channels)
            joins = joins && (isDepth(channel.name) || !known.contains(channel.name));
        if (!joins && info_.is_peeler) {
            throw Error(ErrorKind::kInput,
                        "the part and the first part differ in window, view or block size, or "
                        "share a channel",
                        input_.where(index), "render it again");
        }
        if (!joins) continue;
        for (const ExrInputChannel& channel : part.channels)
            known.insert(channel.name);
        others.push_back(index);
    }
    return others;
}

bool ExrDeepReader::sameBlocks(std::size_t a, std::size_t b) const {
    return input_.deepBlocks(a) == input_.deepBlocks(b) &&
           input_.deepBlockWindow(a, 0) == input_.deepBlockWindow(b, 0);
}

/// Reads the sample counts of a block in all parts. Lists the parts whose counts differ from the
/// first part's.
void ExrDeepReader::count(std::size_t block, CountedBlock& out) const {
    const std::size_t main = parts_.front().index;
    input_.readDeepBlock(main, block, true, out.main);
    if (std::ranges::any_of(out.main.counts, [](std::uint32_t n) { return n > kMostSamples; })) {
        throw Error(ErrorKind::kInput, "a pixel has more than 65536 samples", input_.where(main),
                    "write it again with fewer samples per pixel");
    }
    out.different.clear();
    for (const Part& part : parts_) {
        if (part.index == main) continue;
        input_.readDeepBlock(part.index, block, true, out.other);
        if (out.other.counts != out.main.counts) out.different.push_back(part.index);
    }
}

/// Fills in the plan from the sample counts. Leaves out parts whose counts differ from the first
/// part's. In a file by peeler, different counts are an error.
void ExrDeepReader::countSamples() {
    const std::size_t main = parts_.front().index;
    Window counted_pixels = intersect(info_.parts[main].data_window, info_.plan.view.crop);
    if (counted_pixels.empty()) counted_pixels = {};
    DepthComplexity& complexity = complexity_.emplace(counted_pixels);
    std::set<std::size_t> different;
    const std::size_t blocks = input_.deepBlocks(main);
    constexpr std::size_t kAtOnce = 256;
    std::vector<CountedBlock> counted(std::min(blocks, kAtOnce));
    for (std::size_t first = 0; first < blocks; first += kAtOnce) {
        const std::size_t end = std::min(blocks, first + kAtOnce);
        parallelFor(end - first, [&](std::size_t i) { count(first + i, counted[i]); });
        for (std::size_t i = 0; i < end - first; ++i) {
            const CountedBlock& block = counted[i];
            different.insert(block.different.begin(), block.different.end());
            const Window& window = block.main.window;
            const Window shared = intersect(window, counted_pixels);
            if (shared.empty()) continue;
            const auto width = static_cast<std::size_t>(window.width());
            const std::span<const std::uint32_t> counts = block.main.counts;
            for (int y = shared.y0; y < shared.y1; ++y) {
                const auto first_count = static_cast<std::size_t>(y - window.y0) * width +
                                         static_cast<std::size_t>(shared.x0 - window.x0);
                complexity.addRow(
                    shared.x0, y,
                    counts.subspan(first_count, static_cast<std::size_t>(shared.width())));
            }
        }
    }
    if (!different.empty() && info_.is_peeler) {
        throw Error(ErrorKind::kInput, "the part's samples differ from the first part's",
                    input_.where(*different.begin()), "render it again");
    }
    std::erase_if(parts_, [&](const Part& part) { return different.contains(part.index); });

    Plan& plan = info_.plan;
    plan.layers = complexity.layers();
    plan.fragments_stored = complexity.counted();
    if (!info_.is_peeler) plan.fragments_counted = plan.fragments_stored;
    for (const Part& part : parts_)
        sample_bytes_ += sampleBytes(info_.parts[part.index]);
}

void ExrDeepReader::findChannels() {
    info_.plan.color_type = PixelType::kHalf;
    info_.plan.tinted = colors_.tinted();
    const std::vector<std::string> colors = colorNames(info_.plan.tinted);
    const auto routeOf = [&](const std::string& name, bool first) -> Route {
        for (std::size_t c = 0; first && c < colors.size(); ++c)
            if (colors_.named(colors[c]) == name) return {.target = Route::kColor, .component = c};
        if (first && name == colors_.luminance) return {.target = Route::kGrey};
        if (first && name == colors_.depth) return {.target = Route::kZ};
        // Skip the colours and Z of other pictures in the part, and the depth channels that every
        // part repeats.
        const bool taken = name == "Z" || std::ranges::find(colors, name) != colors.end();
        return {.target = taken || (!first && name == "ZBack") ? Route::kNowhere : 0};
    };
    std::vector<ExrInputChannel> others;
    for (Part& part : parts_) {
        const bool first = &part == &parts_.front();
        for (const ExrInputChannel& channel : info_.parts[part.index].channels) {
            Route route = routeOf(channel.name, first);
            route.type = channel.type;
            const bool colored = route.target == Route::kColor || route.target == Route::kGrey;
            if (colored && channel.type == PixelType::kUint) {
                throw Error(ErrorKind::kInput, "a colour is stored as integers",
                            input_.where(part.index));
            }
            if (colored && channel.type == PixelType::kFloat)
                info_.plan.color_type = PixelType::kFloat;
            if (route.target >= 0) others.push_back(channel);
            part.routes.push_back(route);
        }
    }
    std::sort(others.begin(), others.end(),
              [](const ExrInputChannel& a, const ExrInputChannel& b) { return a.name < b.name; });
    extra_ = fragmentArrays(others);
    for (Part& part : parts_) {
        for (std::size_t c = 0; c < part.routes.size(); ++c) {
            if (part.routes[c].target < 0) continue;
            const std::string& name = info_.parts[part.index].channels[c].name;
            for (std::size_t i = 0; i < extra_.size(); ++i) {
                const auto& names = extra_[i].channels;
                const auto found = std::find(names.begin(), names.end(), name);
                if (found == names.end()) continue;
                part.routes[c].target = static_cast<int>(i);
                part.routes[c].component = static_cast<std::size_t>(found - names.begin());
            }
        }
    }
}

std::vector<std::size_t> ExrDeepReader::blocksIn(const Window& window, std::size_t part) const {
    std::vector<std::size_t> blocks;
    for (std::size_t b = 0; b < input_.deepBlocks(part); ++b) {
        if (!intersect(input_.deepBlockWindow(part, b), window).empty()) blocks.push_back(b);
    }
    return blocks;
}

void ExrDeepReader::readCounts(const Window& window, LayeredImage& out) const {
    const std::size_t main = parts_.front().index;
    const std::vector<std::size_t> blocks = blocksIn(window, main);
    out.offsets.assign(window.pixels() + 1, 0);
    parallelFor(blocks.size(), [&](std::size_t i) {
        ExrDeepBlock block;
        input_.readDeepBlock(main, blocks[i], true, block);
        const Window shared = intersect(block.window, window);
        const auto width = static_cast<std::size_t>(block.window.width());
        for (int y = shared.y0; y < shared.y1; ++y) {
            const auto row = static_cast<std::size_t>(y - block.window.y0) * width;
            for (int x = shared.x0; x < shared.x1; ++x) {
                out.offsets[out.pixelIndex(x, y) + 1] =
                    block.counts[row + static_cast<std::size_t>(x - block.window.x0)];
            }
        }
    });
    countsToOffsets(out.offsets, input_.path());
}

void ExrDeepReader::readSamples(const Window& window, LayeredImage& out) const {
    for (const Part& part : parts_) {
        const std::vector<std::size_t> blocks = blocksIn(window, part.index);
        parallelFor(blocks.size(), [&](std::size_t i) {
            ExrDeepBlock block;
            input_.readDeepBlock(part.index, blocks[i], false, block);
            scatter(block, part, out);
        });
    }
}

void ExrDeepReader::store(const Route& route, const std::byte* from, std::size_t begin,
                          std::size_t end, LayeredImage& out) {
    if (route.target == Route::kZ) {
        const std::size_t size = pixelTypeSize(route.type);
        for (std::size_t f = begin; f < end; ++f, from += size)
            out.z[f] = floatAt(from, route.type);
    } else if (route.target == Route::kColor) {
        storeComponent(from, route.type, out.color, route.component, begin, end);
    } else if (route.target == Route::kGrey) {
        for (std::size_t c = 0; c < 3; ++c)
            storeComponent(from, route.type, out.color, c, begin, end);
    } else if (route.target >= 0) {
        FragmentArray& array = out.extra[static_cast<std::size_t>(route.target)];
        // Float and uint are handled alike: their bits are copied unchanged.
        if (array.type == PixelType::kHalf) {
            storeComponent<std::uint16_t>(from, array, route.component, begin, end);
        } else {
            storeComponent<std::uint32_t>(from, array, route.component, begin, end);
        }
    }
}

/// Stores the samples of a block that are inside the window of `out`.
void ExrDeepReader::scatter(const ExrDeepBlock& block, const Part& part, LayeredImage& out) const {
    const auto width = static_cast<std::size_t>(block.window.width());
    const Window wanted = intersect(block.window, out.window);
    const std::byte* from = block.samples.data();
    for (int y = block.window.y0; y < block.window.y1; ++y) {
        const std::span counts(
            block.counts.data() + static_cast<std::size_t>(y - block.window.y0) * width, width);
        const bool wanted_row = y >= wanted.y0 && y < wanted.y1;
        // The fragments of a row are contiguous both in `out` and in the file.
        const auto left = static_cast<std::size_t>(wanted_row ? wanted.x0 - block.window.x0 : 0);
        const auto columns = static_cast<std::size_t>(wanted_row ? wanted.width() : 0);
        const std::size_t skipped = std::accumulate(
            counts.begin(), counts.begin() + static_cast<std::ptrdiff_t>(left), std::size_t{0});
        std::size_t samples = skipped, begin = 0, end = 0;
        if (wanted_row) {
            const std::uint32_t* offsets = out.offsets.data() + out.pixelIndex(wanted.x0, y);
            begin = offsets[0];
            end = offsets[columns];
            for (std::size_t x = 0; x < columns; ++x) {
                // Another program may have changed the file since it was opened. Samples must not
                // be stored beyond the row.
                if (offsets[x + 1] - offsets[x] != counts[left + x]) {
                    throw Error(ErrorKind::kInput,
                                "the sample counts have changed since the file was opened",
                                input_.where(part.index), "run the command again");
                }
            }
            samples += end - begin;
        }
        samples = std::accumulate(counts.begin() + static_cast<std::ptrdiff_t>(left + columns),
                                  counts.end(), samples);
        for (const Route& route : part.routes) {
            const std::size_t size = pixelTypeSize(route.type);
            store(route, from + skipped * size, begin, end, out);
            from += samples * size;
        }
    }
}

void ExrDeepReader::read(const Window& window, LayeredImage& out) {
    if (window.empty() || intersect(window, info_.plan.view.crop) != window) {
        throw Error(ErrorKind::kInternal, "the window is empty or outside the picture",
                    input_.path());
    }
    out.window = window;
    readCounts(window, out);
    const std::size_t fragments = out.offsets.back();
    resizeAnew(out.z, fragments);
    out.color = {colorNames(info_.plan.tinted), info_.plan.color_type, std::move(out.color.data)};
    const auto missing = [&](const std::string& name) { return colors_.named(name).empty(); };
    if (std::ranges::any_of(out.color.channels, missing))
        out.color.data.clear();  // clear reused storage, so that missing channels are 0
    resizeAnew(out.color.data, fragments * out.color.stride());
    out.extra.resize(extra_.size());
    for (std::size_t i = 0; i < extra_.size(); ++i) {
        out.extra[i] = {extra_[i].channels, extra_[i].type, std::move(out.extra[i].data)};
        resizeAnew(out.extra[i].data, fragments * extra_[i].stride());
    }
    readSamples(window, out);
    if (colors_.alpha.empty()) completeAlpha(out);
    makeDepthsFinite(out.z, opened_.warnings);
    sortFragments(out);
    warnOfVolumes(out);
}

/// Sets alpha to the mean of AR, AG and AB, or to 1 if these channels are missing.
void ExrDeepReader::completeAlpha(LayeredImage& out) const {
    parallelFor(static_cast<std::size_t>(out.window.height()), [&](std::size_t row) {
        const auto width = static_cast<std::size_t>(out.window.width());
        const std::size_t end = out.offsets[(row + 1) * width];
        for (std::size_t f = out.offsets[row * width]; f < end; ++f) {
            TintedColor color = tintedColorOf(out, f);
            color[3] = out.tinted() ? meanOpacity(color[4], color[5], color[6]) : 1;
            storeColor(color, out.color, f);
        }
    });
}

/// Warns about samples that overlap in depth (Z to ZBack), because they are not split
/// ("Interpreting OpenEXR Deep Pixels", openexr.com).
void ExrDeepReader::warnOfVolumes(const LayeredImage& image) {
    const FragmentChannel back = findChannel(image, colors_.depth_back);
    if (!back) return;
    for (std::size_t p = 0; p + 1 < image.offsets.size(); ++p) {
        float farthest = -std::numeric_limits<float>::infinity();
        for (std::size_t f = image.offsets[p]; f < image.offsets[p + 1]; ++f) {
            if (image.z[f] < farthest)
                return opened_.warnings.warn("Samples that overlap (ZBack) are not split.",
                                             input_.where(parts_.front().index));
            farthest = std::max(farthest, back.value(f));
        }
    }
}

void ExrDeepReader::readComposite(const Window&, CompositeImage&) {
    throw Error(ErrorKind::kInput, "a deep image has no part \"composite\"", input_.path(),
                "flatten the image first");
}

int ExrDeepReader::rowsFor(std::uint64_t bytes) const {
    const Window& crop = info_.plan.view.crop;
    const std::uint64_t row = 2 * sample_bytes_ * complexity_->mostFragments(1) +
                              static_cast<std::uint64_t>(crop.width()) * sizeof(std::uint32_t);
    const auto rows = static_cast<std::uint64_t>(std::max(1, crop.height()));
    return static_cast<int>(
        std::clamp(std::min(bytes, kMostSampleBytes) / std::max<std::uint64_t>(1, row),
                   std::uint64_t{1}, rows));
}

BandRead ExrDeepReader::mostOf(int rows) const {
    std::uint64_t block_bytes = 0;
    for (const Part& part : parts_) {
        const ExrInputPart& info = info_.parts[part.index];
        const int height = std::max(1, info.tile_height);
        const int width = info.tile_width > 0 ? info.tile_width : info.data_window.width();
        const std::uint64_t table = static_cast<std::uint64_t>(width) *
                                    static_cast<std::uint64_t>(height) * sizeof(std::uint32_t);
        // The samples and the table are in memory twice, packed and unpacked.
        block_bytes = std::max(
            block_bytes, 2 * (sampleBytes(info) * complexity_->mostFragments(height) + table));
    }
    return {complexity_->mostFragments(rows),
            block_bytes * static_cast<std::uint64_t>(threadCount()), true};
}

}  // namespace peeler
