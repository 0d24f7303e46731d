// SPDX-License-Identifier: Apache-2.0
// Deep image writer. Each part has one chunk per row.
#include "formats/exr/exr_writers.h"

#include <OpenEXR/ImfChannelList.h>
#include <OpenEXR/ImfDeepImageStateAttribute.h>
#include <OpenEXR/ImfIntAttribute.h>
#include <OpenEXR/ImfPartType.h>
#include <OpenEXR/ImfStandardAttributes.h>
#include <OpenEXR/ImfStringAttribute.h>

#include <algorithm>
#include <array>
#include <string_view>
#include <utility>

#include <peeler/error.h>
#include "core/base/parallel.h"
#include "core/base/stage_times.h"
#include "core/image/deep_thinning.h"
#include "core/image/merge.h"
#include "formats/exr/deep_certificate.h"
#include "formats/exr/exr_header.h"
#include "formats/exr/exr_rows.h"

namespace peeler {
namespace {

constexpr int kMostRowsInFlight = 64;
constexpr const char* kStored = "peeler:fragmentsStored";
constexpr const char* kMaxSamples = "maxSamplesPerPixel";  // required by the OpenEXR file layout

/// The channels other than R, G, B, A and Z that take part in compositing ("Interpreting OpenEXR
/// Deep Pixels").
constexpr std::array<std::string_view, 4> kOfColor = {"AR", "AG", "AB", "ZBack"};

/// Whether all channels of an array take part in compositing. The part `color` has only such
/// channels, since some programs (OpenImageIO's flatten) composite every channel of a part.
bool belongsToColor(const FragmentArray& array) {
    return std::ranges::all_of(array.channels, [](const std::string& channel) {
        return std::ranges::find(kOfColor, channel) != kOfColor.end();
    });
}

std::size_t sampleBytes(const LayeredImage& image) {
    std::size_t bytes = sizeof(float) + image.color.stride();
    for (const FragmentArray& array : image.extra)
        bytes += array.stride();
    return bytes;
}

}  // namespace

ExrDeepWriter::ExrDeepWriter(std::string path, OutputOptions options)
    : path_(std::move(path)),
      options_(std::move(options)),
      compression_(exrCompressionOf(options_.compression, true)) {
    if (options_.deep_merge.merges())
        options_.provenance.deep_merge = deepMergeText(options_.deep_merge);
}

ExrDeepWriter::~ExrDeepWriter() = default;

void ExrDeepWriter::begin(const Plan& plan) {
    plan_ = plan;
    for (const LayerPlan& layer : plan.layers)
        window_ = unite(window_, layer.data_window);
    if (window_.empty()) window_ = plan.view.crop;
    if (intersect(window_, plan.view.crop) != window_)
        throw Error(ErrorKind::kInternal, "a layer's window is outside the crop", path_);
    next_row_ = plan.view.crop.y0;
    file_ = std::make_unique<AtomicFile>(path_);
}

void ExrDeepWriter::write(LayeredImage&& band) {
    if (!exr_) open(band);
    check(band);
    fragments_seen_ += band.fragments();
    const int end = std::min(band.window.y1, window_.y1);
    for (int y = std::max(band.window.y0, window_.y0); y < end;) {
        const int next = std::min(end, y + rowsInFlight(band, y));
        writeRows(merged(band, y, next), y, next);
        y = next;
    }
    next_row_ = band.window.y1;
}

/// Returns an image with the rows [y0, y1) of the band, merged or thinned if requested.
const LayeredImage& ExrDeepWriter::merged(const LayeredImage& band, int y0, int y1) {
    if (!options_.deep_merge.merges()) return band;
    if (options_.deep_merge.error > 0) {
        const StageTimer timer(times_, "thin");
        source_hash_.add(band, y0, y1);
        thinDeepSamples(band, y0, y1, options_.deep_merge, merged_, thinning_);
    } else {
        mergeDeepSamples(band, y0, y1, options_.deep_merge, merged_);
    }
    return merged_;
}

/// Returns the certificate of the samples so far; "" if they are not thinned.
std::string ExrDeepWriter::certificate() const {
    const double error = options_.deep_merge.error;
    if (!(error > 0)) return options_.provenance.deep_certificate;
    return DeepCertificate{error, thinning_.largest_error, plan_.fragments_stored, thinning_.after,
                           source_hash_.text()}
        .text();
}

void ExrDeepWriter::open(const LayeredImage& first_band) {
    options_.provenance.deep_certificate = certificate();
    like_.color = {first_band.color.channels, first_band.color.type, {}};
    for (const FragmentArray& array : first_band.extra)
        like_.extra.push_back({array.channels, array.type, {}});

    const ExrChannel depth{"Z", PixelType::kFloat, ExrChannel::kZ};
    const bool has_ids = std::ranges::any_of(
        like_.extra, [](const FragmentArray& array) { return array.type == PixelType::kUint; });
    parts_ = {{"color", {depth}}, {has_ids ? "ids" : "aovs", {depth}}};
    const auto add = [&](Part& part, const FragmentArray& array, int source) {
        const std::vector<ExrChannel> more = deepChannels(array, source);
        part.channels.insert(part.channels.end(), more.begin(), more.end());
    };
    add(parts_.front(), like_.color, ExrChannel::kColor);
    for (std::size_t i = 0; i < like_.extra.size(); ++i)
        add(parts_[belongsToColor(like_.extra[i]) ? 0 : 1], like_.extra[i], static_cast<int>(i));
    if (parts_.back().channels.size() == 1) parts_.pop_back();

    std::vector<Imf::Header> headers;
    for (Part& part : parts_) {
        std::sort(part.channels.begin(), part.channels.end(),
                  [](const ExrChannel& a, const ExrChannel& b) { return a.name < b.name; });
        Imf::Header header = exrHeader(plan_, options_.provenance, window_);
        header.setName(part.name);
        header.setType(Imf::DEEPSCANLINE);
        header.setVersion(1);
        header.compression() = compression_;
        header.insert(kMaxSamples, Imf::IntAttribute(0));
        Imf::addDeepImageState(header, Imf::DIS_SORTED);
        for (const ExrChannel& channel : part.channels) {
            if (header.channels().findChannel(channel.name))
                throw Error(ErrorKind::kInternal, "two channels have the same name", channel.name);
            header.channels().insert(channel.name, Imf::Channel(exrPixelType(channel.type)));
        }
        addIdManifest(header, options_.provenance.ids);
        headers.push_back(std::move(header));
    }
    exr_ = std::make_unique<ExrOutput>(*file_, std::move(headers));
}

void ExrDeepWriter::check(const LayeredImage& band) const {
    const Window& crop = plan_.view.crop;
    const auto same = [&](const FragmentArray& array, const FragmentArray& like) {
        return array.channels == like.channels && array.type == like.type &&
               array.data.size() == band.fragments() * array.stride();
    };
    bool good = band.window.x0 == crop.x0 && band.window.x1 == crop.x1 &&
                band.window.y0 == next_row_ && band.window.y1 <= crop.y1 &&
                band.offsets.size() == band.window.pixels() + 1 && band.offsets.front() == 0 &&
                band.offsets.back() == band.fragments() && band.color.type == plan_.color_type &&
                same(band.color, like_.color) && band.extra.size() == like_.extra.size();
    for (std::size_t i = 0; good && i < band.extra.size(); ++i)
        good = same(band.extra[i], like_.extra[i]);
    if (!good) throw Error(ErrorKind::kInternal, "a band does not fit the plan", path_);
}

/// Returns the number of rows, from y on, that are encoded together before they are written.
int ExrDeepWriter::rowsInFlight(const LayeredImage& band, int y) const {
    const std::size_t first = band.offsets[band.pixelIndex(band.window.x0, y)];
    const std::size_t most = kExrBytesInFlight / sampleBytes(like_);
    int rows = 1;
    while (rows < kMostRowsInFlight && y + rows < band.window.y1 &&
           band.offsets[band.pixelIndex(band.window.x0, y + rows)] - first < most)
        ++rows;
    return rows;
}

void ExrDeepWriter::writeRows(const LayeredImage& image, int y0, int y1) {
    const std::size_t chunks = static_cast<std::size_t>(y1 - y0) * parts_.size();
    packed_.resize(std::max(packed_.size(), chunks));
    {
        const StageTimer timer(times_, "encode");
        noteSamples(image, y0, y1);
        encode(image, y0, chunks);
    }
    const StageTimer timer(times_, "write");
    for (std::size_t i = 0; i < chunks; ++i) {
        const int chunk = y0 - window_.y0 + static_cast<int>(i / parts_.size());
        exr_->append(i % parts_.size(), chunk, packed_[i]);
    }
    boundBuffers();
}

/// Updates the sample statistics for the header.
void ExrDeepWriter::noteSamples(const LayeredImage& image, int y0, int y1) {
    const auto width = static_cast<std::size_t>(window_.width());
    for (int y = y0; y < y1; ++y) {
        const std::size_t first = image.pixelIndex(window_.x0, y);
        fragments_written_ += image.offsets[first + width] - image.offsets[first];
        for (std::size_t p = first; p < first + width; ++p) {
            most_samples_ = std::max(most_samples_, image.count(p));
            for (std::size_t f = image.offsets[p] + 1; !coincident_ && f < image.offsets[p + 1];
                 ++f)
                coincident_ = image.z[f] == image.z[f - 1];
        }
    }
}

/// Packs `chunks` chunks from row y0 on. Every row has one chunk in each part.
void ExrDeepWriter::encode(const LayeredImage& image, int y0, std::size_t chunks) {
    parallelFor(chunks, [&](std::size_t i) {
        const int y = y0 + static_cast<int>(i / parts_.size());
        packers_.with([&](ExrChunkPacker& packer) {
            packDeepRow(image, parts_[i % parts_.size()].channels, window_, y, packer, packed_[i]);
        });
    });
}

/// Frees the buffers if they exceed a limit.
void ExrDeepWriter::boundBuffers() {
    std::size_t kept = packers_.bytesKept();
    for (const ExrDeepChunk& chunk : packed_)
        kept += chunk.counts.capacity() + chunk.samples.capacity();
    if (kept <= kExrCopiesInFlight * kExrBytesInFlight) return;
    packed_.clear();
    packers_.clear();
}

SinkMemory ExrDeepWriter::memory(const Plan& plan) const {
    const bool merging = options_.deep_merge.merges();
    const std::uint64_t sample = colorNames(plan.tinted).size() * pixelTypeSize(plan.color_type) +
                                 sizeof(float) + plan.channel_bytes;
    const std::uint64_t in_flight =
        std::min<std::uint64_t>(kExrBytesInFlight, plan.fragments_stored * sample);
    const std::uint64_t thinning = options_.deep_merge.error > 0 ? kThinSampleBytes : 0;
    return {merging ? kMostRowsInFlight : 0,
            kExrCopiesInFlight * in_flight + in_flight / sample * thinning};
}

void ExrDeepWriter::finish() {
    const bool merging = options_.deep_merge.merges();
    if (!exr_ || fragments_seen_ != plan_.fragments_stored ||
        (merging ? fragments_written_ > fragments_seen_ : fragments_written_ != fragments_seen_)) {
        throw Error(ErrorKind::kInternal,
                    "the plan has " + std::to_string(plan_.fragments_stored) +
                        " fragments, the bands " + std::to_string(fragments_seen_) +
                        ", the samples " + std::to_string(fragments_written_),
                    path_, "please report this with the scene");
    }
    const StageTimer timer(times_, "write");
    describeSamples();
    exr_->finish();
    file_->commit();
}

/// Sets the attributes that are known only at the end. Their sizes do not change.
void ExrDeepWriter::describeSamples() {
    const auto has_back = [](const FragmentArray& array) {
        return std::find(array.channels.begin(), array.channels.end(), "ZBack") !=
               array.channels.end();
    };
    const bool volumes = std::any_of(like_.extra.begin(), like_.extra.end(), has_back);
    const Imf::DeepImageState state =
        volumes ? Imf::DIS_MESSY : (coincident_ ? Imf::DIS_SORTED : Imf::DIS_TIDY);
    const auto most = static_cast<int>(most_samples_);
    const std::size_t digits = std::to_string(plan_.fragments_stored).size();
    std::string stored = std::to_string(fragments_written_);
    stored.insert(0, digits - stored.size(), '0');
    for (std::size_t part = 0; part < parts_.size(); ++part) {
        exr_->setAttribute(part, "deepImageState", Imf::DeepImageStateAttribute(state));
        exr_->setAttribute(part, kMaxSamples, Imf::IntAttribute(most));
        if (!options_.deep_merge.merges()) continue;
        const bool complete = fragments_written_ == plan_.fragments_counted;
        exr_->setAttribute(part, kStored, Imf::StringAttribute(stored));
        if (options_.deep_merge.error > 0)
            exr_->setAttribute(part, kDeepCertificate, Imf::StringAttribute(certificate()));
        exr_->setAttribute(part, "peeler:layers", Imf::IntAttribute(most));
        exr_->setAttribute(part, "peeler:complete", Imf::IntAttribute(complete ? 1 : 0));
    }
}

}  // namespace peeler
