// SPDX-License-Identifier: Apache-2.0
// One part, one channel.
#include "formats/exr_plane_writer.h"

#include <OpenEXR/ImfChannelList.h>

#include <algorithm>
#include <cstring>

#include "formats/atomic_file.h"
#include "formats/exr_band_writer.h"
#include "formats/exr_chunks.h"
#include "formats/exr_header.h"

namespace peeler {

struct ExrPlaneWriter::File {
    explicit File(const std::string& path) : atomic(path), packer(kDefaultZipLevel) {}

    AtomicFile atomic;
    std::unique_ptr<ExrFile> exr;  // after the file it writes to
    ExrChunkPacker packer;
    std::vector<std::byte> packed;
};

ExrPlaneWriter::ExrPlaneWriter(const std::string& path, const Plan& plan,
                               const Provenance& provenance, const std::string& part,
                               const std::string& channel, PixelType type)
    : row_bytes_(static_cast<std::size_t>(plan.view.crop.width()) * pixelTypeSize(type)),
      file_(std::make_unique<File>(path)) {
    Imf::Header header = exrHeader(plan, provenance, plan.view.crop);
    header.setName(part);
    header.channels().insert(channel,
                             Imf::Channel(type == PixelType::kUint ? Imf::UINT : Imf::FLOAT));
    file_->exr = std::make_unique<ExrFile>(file_->atomic, std::vector<Imf::Header>{header});
}

ExrPlaneWriter::~ExrPlaneWriter() = default;

void ExrPlaneWriter::append(std::span<const std::byte> rows) {
    rows_.insert(rows_.end(), rows.begin(), rows.end());
    writeChunks(false);
}

/// Writes the chunks that are complete, and with `last` the rest.
void ExrPlaneWriter::writeChunks(bool last) {
    const std::size_t chunk = kExrRowsPerChunk * row_bytes_;
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
        file_->exr->append(0, next_chunk_++, file_->packed);
        written += bytes;
    }
    rows_.erase(rows_.begin(), rows_.begin() + static_cast<std::ptrdiff_t>(written));
}

void ExrPlaneWriter::finish() {
    writeChunks(true);
    const StageTimer timer(times_, "write");
    file_->exr->finish();
    file_->atomic.commit();
}

std::uint64_t ExrPlaneWriter::memory() const {
    // The rows of a chunk: kept, raw, filtered and packed.
    return 4 * row_bytes_ * kExrRowsPerChunk;
}

}  // namespace peeler
