// SPDX-License-Identifier: Apache-2.0
#include "formats/exr/exr_hits_writer.h"

#include <OpenEXR/ImfChannelList.h>
#include <OpenEXR/ImfDeepImageStateAttribute.h>
#include <OpenEXR/ImfIntAttribute.h>
#include <OpenEXR/ImfPartType.h>
#include <OpenEXR/ImfStandardAttributes.h>

#include <algorithm>
#include <utility>

#include "core/base/parallel.h"
#include "formats/exr/exr_deep_rows.h"
#include "formats/exr/exr_header.h"
#include "formats/exr/id_manifest.h"

namespace peeler {
namespace {

constexpr int kRowsInFlight = 32;

}  // namespace

struct ExrHitsWriter::File {
    void open(const LayeredImage& first_band, std::string_view left_out);
    void write(std::size_t bundle, const LayeredImage& band);

    std::vector<ExrBundle> bundles;
    Provenance provenance;
    AtomicFile file;
    std::unique_ptr<ExrFile> exr{};  // from the first band on: it says which channels there are
    std::vector<ExrChannel> channels{};
    std::vector<int> next_row{};  // of each part
    std::vector<ExrDeepChunk> packed{};
    ExrPackerPool packers{kDefaultZipLevel, Imf::ZIPS_COMPRESSION};
};

ExrHitsWriter::ExrHitsWriter(const std::string& path, std::vector<ExrBundle> bundles,
                             Provenance provenance)
    : file_(new File{std::move(bundles), std::move(provenance), AtomicFile(path)}) {}

ExrHitsWriter::~ExrHitsWriter() = default;

void ExrHitsWriter::File::open(const LayeredImage& first_band, std::string_view left_out) {
    channels = {{"Z", PixelType::kFloat, ExrChannel::kZ}};
    for (std::size_t i = 0; i < first_band.extra.size(); ++i) {
        const FragmentArray& array = first_band.extra[i];
        if (array.channels.front() == left_out) continue;
        const auto more = deepChannels(array, static_cast<int>(i));
        channels.insert(channels.end(), more.begin(), more.end());
    }
    std::ranges::sort(channels, {}, &ExrChannel::name);
    next_row.resize(bundles.size());
    std::vector<Imf::Header> headers;
    for (const ExrBundle& bundle : bundles) {
        Plan plan;
        plan.view = bundle.view;
        plan.fragments_counted = plan.fragments_stored = bundle.hits;
        Imf::Header header = exrHeader(plan, provenance, bundle.view.crop);
        header.setName(bundle.name);
        header.setType(Imf::DEEPSCANLINE);
        header.setVersion(1);
        header.compression() = Imf::ZIPS_COMPRESSION;
        Imf::addDeepImageState(header, Imf::DIS_SORTED);
        header.insert("peeler:bundle", Imf::IntAttribute(static_cast<int>(headers.size())));
        for (const ExrChannel& channel : channels)
            header.channels().insert(channel.name, Imf::Channel(exrPixelType(channel.type)));
        addIdManifest(header, provenance.ids);
        headers.push_back(std::move(header));
    }
    exr = std::make_unique<ExrFile>(file, std::move(headers));
}

void ExrHitsWriter::File::write(std::size_t bundle, const LayeredImage& band) {
    packed.resize(kRowsInFlight);
    for (int y = band.window.y0; y < band.window.y1; y += kRowsInFlight) {
        const int rows = std::min(kRowsInFlight, band.window.y1 - y);
        parallelFor(static_cast<std::size_t>(rows), [&](std::size_t row) {
            packers.with([&](ExrChunkPacker& packer) {
                packDeepRow(band, channels, band.window, y + static_cast<int>(row), packer,
                            packed[row]);
            });
        });
        for (int row = 0; row < rows; ++row)
            exr->append(bundle, next_row[bundle]++, packed[static_cast<std::size_t>(row)]);
    }
}

void ExrHitsWriter::write(std::size_t bundle, const LayeredImage& band, std::string_view left_out) {
    if (!file_->exr) file_->open(band, left_out);
    file_->write(bundle, band);
}

void ExrHitsWriter::finish() {
    file_->exr->finish();
    file_->file.commit();
}

}  // namespace peeler
