// SPDX-License-Identifier: Apache-2.0
// One part, one channel.
#include "formats/exr_midpoint_writer.h"

#include <OpenEXR/ImfChannelList.h>

#include <algorithm>
#include <cstring>
#include <span>
#include <utility>

#include "core/midpoint.h"
#include "formats/exr_band_writer.h"
#include "formats/exr_header.h"

namespace peeler {

ExrMidpointWriter::ExrMidpointWriter(std::string path, Provenance provenance)
    : path_(std::move(path)), provenance_(std::move(provenance)), packer_(kDefaultZipLevel) {}

ExrMidpointWriter::~ExrMidpointWriter() = default;

void ExrMidpointWriter::begin(const Plan& plan) {
    plan_ = plan;
    Imf::Header header = exrHeader(plan, provenance_, plan.view.crop);
    header.setName("midpoint");
    header.channels().insert("Z", Imf::Channel(Imf::FLOAT));
    file_ = std::make_unique<AtomicFile>(path_);
    exr_ = std::make_unique<ExrFile>(*file_, std::vector<Imf::Header>{header});
}

void ExrMidpointWriter::write(const LayeredImage& band) {
    {
        const StageTimer timer(times_, "composite");
        const std::size_t kept = rows_.size();
        rows_.resize(kept + band.window.pixels());
        midpoints(band, plan_.view.projection, std::span(rows_).subspan(kept));
    }
    writeChunks(false);
}

/// Writes the chunks that are complete, and with `last` the rest.
void ExrMidpointWriter::writeChunks(bool last) {
    const auto width = static_cast<std::size_t>(plan_.view.crop.width());
    std::size_t written = 0;
    while (written < rows_.size()) {
        const std::size_t floats = std::min(kExrRowsPerChunk * width, rows_.size() - written);
        if (floats < kExrRowsPerChunk * width && !last) break;
        {
            const StageTimer timer(times_, "encode");
            const auto raw = packer_.raw(floats * sizeof(float));
            std::memcpy(raw.data(), rows_.data() + written, raw.size());
            packer_.pack(packed_);
        }
        const StageTimer timer(times_, "write");
        exr_->append(0, next_chunk_++, packed_);
        written += floats;
    }
    rows_.erase(rows_.begin(), rows_.begin() + static_cast<std::ptrdiff_t>(written));
}

void ExrMidpointWriter::finish() {
    writeChunks(true);
    const StageTimer timer(times_, "write");
    exr_->finish();
    file_->commit();
}

SinkMemory ExrMidpointWriter::memory() const {
    // The rows of a chunk: kept, raw, filtered and packed. Those of a band are what other sinks
    // composite into.
    const auto width = static_cast<std::uint64_t>(plan_.view.crop.width());
    return {0, 4 * width * sizeof(float) * kExrRowsPerChunk};
}

}  // namespace peeler
