// SPDX-License-Identifier: Apache-2.0
// Data image writers, which write part by part and row by row.
#include "formats/exr/exr_plane_writer.h"

#include <OpenEXR/ImfChannelList.h>

#include <algorithm>
#include <cstring>
#include <numeric>
#include <utility>

#include <peeler/error.h>
#include "core/base/color.h"
#include "core/base/stage_times.h"
#include "core/image/statistics.h"
#include "formats/exr/exr_chunks.h"
#include "formats/exr/exr_header.h"
#include "formats/file/atomic_file.h"
#include "formats/file/file_name.h"
#include "formats/image/image_writer.h"

namespace peeler {
namespace {

constexpr std::size_t kNumberBytes = 4;

Imf::Header planeHeader(const ExrPlanePart& part, const Provenance& provenance,
                        const std::vector<ExrPlaneChannel>& channels) {
    Imf::Header header = exrHeader(part.plan, provenance, part.plan.view.crop, part.layers_known);
    header.setName(part.name);
    for (const ExrPlaneChannel& channel : channels)
        header.channels().insert(channel.name, Imf::Channel(exrPixelType(channel.type)));
    return header;
}

}  // namespace

struct ExrPlaneWriter::File {
    explicit File(const std::string& path) : atomic(path), packer(kDefaultZipLevel) {}

    AtomicFile atomic;
    std::unique_ptr<ExrOutput> exr;  // declared after `atomic`, which it refers to
    ExrChunkPacker packer;
    ByteBuffer packed;
};

ExrPlaneWriter::ExrPlaneWriter(const std::string& path, std::span<const ExrPlanePart> parts,
                               const Provenance& provenance, std::vector<ExrPlaneChannel> channels)
    : file_(std::make_unique<File>(path)), order_(channels.size()) {
    // OpenEXR sorts channels by name, so the order in the file may differ from that of `channels`.
    std::iota(order_.begin(), order_.end(), std::size_t{0});
    std::ranges::sort(order_, {}, [&](std::size_t i) { return channels[i].name; });
    std::vector<Imf::Header> headers;
    for (const ExrPlanePart& part : parts) {
        const Window& crop = part.plan.view.crop;
        parts_.push_back(
            {static_cast<std::size_t>(crop.width()), static_cast<std::size_t>(crop.height())});
        headers.push_back(planeHeader(part, provenance, channels));
    }
    file_->exr = std::make_unique<ExrOutput>(file_->atomic, std::move(headers));
}

ExrPlaneWriter::ExrPlaneWriter(const std::string& path, const Plan& plan,
                               const Provenance& provenance, const std::string& part,
                               const std::string& channel, PixelType type)
    : ExrPlaneWriter(path, std::vector<ExrPlanePart>{{part, plan}}, provenance, {{channel, type}}) {
}

ExrPlaneWriter::~ExrPlaneWriter() = default;

std::size_t ExrPlaneWriter::rowBytes() const {
    return parts_[part_].width * order_.size() * kNumberBytes;
}

void ExrPlaneWriter::append(std::span<const std::byte> planes) {
    if (planes.empty()) return;
    const std::size_t rows = part_ < parts_.size() ? planes.size() / rowBytes() : 0;
    if (rows == 0 || rows_seen_ + rows > parts_[part_].height) {
        throw Error(ErrorKind::kInternal, "more rows than the picture has", file_->atomic.path());
    }
    const std::size_t width = parts_[part_].width * kNumberBytes;
    for (std::size_t row = 0; row < rows; ++row) {
        for (const std::size_t channel : order_) {
            const auto numbers = planes.subspan((channel * rows + row) * width, width);
            rows_.insert(rows_.end(), numbers.begin(), numbers.end());
        }
    }
    rows_seen_ += rows;
    const bool full = rows_seen_ == parts_[part_].height;
    writeChunks(full);
    if (full) nextPart();
}

void ExrPlaneWriter::nextPart() {
    ++part_;
    rows_seen_ = 0;
    next_chunk_ = 0;
}

/// Writes the complete chunks. If `last` is true, also writes the incomplete chunk.
void ExrPlaneWriter::writeChunks(bool last) {
    const std::size_t chunk = kExrRowsPerChunk * rowBytes();
    std::size_t written = 0;
    while (written < rows_.size()) {
        const std::size_t bytes = std::min(chunk, rows_.size() - written);
        if (bytes < chunk && !last) break;
        {
            const StageTimer timer(times_, "encode");
            std::memcpy(file_->packer.raw(bytes).data(), rows_.data() + written, bytes);
            file_->packer.pack(file_->packed);
        }
        const StageTimer timer(times_, "write");
        file_->exr->append(part_, next_chunk_++, file_->packed);
        written += bytes;
    }
    rows_.erase(rows_.begin(), rows_.begin() + static_cast<std::ptrdiff_t>(written));
}

void ExrPlaneWriter::finish() {
    const StageTimer timer(times_, "write");
    file_->exr->finish();
    file_->atomic.commit();
}

std::uint64_t ExrPlaneWriter::memory(int width, std::size_t channels) {
    // The rows of a chunk are in memory four times: kept, raw, filtered and packed.
    return 4 * static_cast<std::uint64_t>(width) * channels * kNumberBytes * kExrRowsPerChunk;
}

ExrMidpointWriter::ExrMidpointWriter(std::string path, OutputOptions options)
    : path_(std::move(path)), options_(std::move(options)) {}

void ExrMidpointWriter::begin(const Plan& plan) {
    projection_ = plan.view.projection;
    plane_ = std::make_unique<ExrPlaneWriter>(path_, plan, options_.provenance, "midpoint", "Z",
                                              PixelType::kFloat);
}

void ExrMidpointWriter::write(LayeredImage&& band) {
    {
        const StageTimer timer(times_, "composite");
        midpoints_.resize(band.window.pixels());
        midpoints(band, projection_, midpoints_);
    }
    plane_->append(std::as_bytes(std::span(midpoints_)));
}

void ExrMidpointWriter::finish() {
    plane_->finish();
}

SinkMemory ExrMidpointWriter::memory(const Plan& plan) const {
    // The budget always includes a band's composite, which takes at least as much memory as its
    // midpoints.
    return {0, ExrPlaneWriter::memory(plan.view.crop.width(), 1)};
}

StageTimes ExrMidpointWriter::times() const {
    StageTimes all = times_;
    if (plane_) add(all, plane_->times());
    return all;
}

CountMap::CountMap(std::string path, OutputOptions options)
    : path_(std::move(path)), options_(std::move(options)) {}

SizeForecast CountMap::forecast(const Plan& plan) const {
    const Window& crop = plan.view.crop;
    if (lowerExtension(path_) != ".exr") return imageForecast(path_, crop.pixels());
    return {exrHeaderBytes(options_.provenance.ids) + sizeof(std::uint32_t) * crop.pixels() +
                kExrChunkBytes * static_cast<std::uint64_t>(crop.height()),
            Certainty::kAtMost};
}

void CountMap::begin(const Plan& plan) {
    ramp_end_ = static_cast<float>(std::max<std::size_t>(1, plan.layers.size()));
    if (lowerExtension(path_) == ".exr") {
        plane_ = std::make_unique<ExrPlaneWriter>(path_, plan, options_.provenance,
                                                  "depth-complexity", "count", PixelType::kUint);
        return;
    }
    picture_ = std::make_unique<ImageWriter>(path_, options_);
    picture_->begin(plan);
}

void CountMap::write(LayeredImage&& band) {
    const std::size_t pixels = band.window.pixels();
    counts_.resize(pixels);
    for (std::size_t p = 0; p < pixels; ++p) {
        counts_[p] = band.count(p);
        largest_ = std::max(largest_, counts_[p]);
    }
    if (plane_) {
        plane_->append(std::as_bytes(std::span(counts_)));
        return;
    }
    const std::span<float> out = onePerPixel(band.window, colors_);
    for (std::size_t p = 0; p < pixels; ++p) {
        const auto color = inferno(static_cast<float>(counts_[p]) / ramp_end_);
        std::copy(color.begin(), color.end(), &out[4 * p]);
        out[4 * p + 3] = 1;
    }
    picture_->write(std::move(colors_));
}

void CountMap::finish() {
    if (plane_) {
        plane_->finish();
    } else {
        picture_->finish();
    }
}

SinkMemory CountMap::memory(const Plan& plan) const {
    if (lowerExtension(path_) == ".exr")
        return {.bytes = ExrPlaneWriter::memory(plan.view.crop.width(), 1),
                // `counts_` takes one number per pixel. The writer's `rows_` takes two, because
                // reallocation copies it.
                .pixel_bytes = 3 * kNumberBytes};
    SinkMemory memory = ImageWriter(path_, options_).memory(plan);
    // Memory for the counts, the band of colours (offset, Z, RGBA), and the band's composite (RGBA,
    // Z).
    memory.pixel_bytes += 3 * sizeof(std::uint32_t) + 9 * sizeof(float);
    return memory;
}

StageTimes CountMap::times() const {
    return plane_ ? plane_->times() : picture_->times();
}

}  // namespace peeler
