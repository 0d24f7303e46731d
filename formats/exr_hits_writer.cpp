// SPDX-License-Identifier: Apache-2.0
#include "formats/exr_hits_writer.h"

#include <OpenEXR/ImfChannelList.h>
#include <OpenEXR/ImfDeepImageStateAttribute.h>
#include <OpenEXR/ImfPartType.h>
#include <OpenEXR/ImfStandardAttributes.h>

#include <algorithm>
#include <utility>

#include "core/parallel.h"
#include "formats/exr_deep_rows.h"
#include "formats/exr_header.h"
#include "formats/id_manifest.h"

namespace peeler {
namespace {

constexpr int kRowsInFlight = 32;

}  // namespace

ExrHitsWriter::ExrHitsWriter(const std::string& path, std::vector<ExrBundle> bundles,
                             Provenance provenance)
    : bundles_(std::move(bundles)),
      provenance_(std::move(provenance)),
      file_(path),
      packers_(kDefaultZipLevel, Imf::ZIPS_COMPRESSION) {}

ExrHitsWriter::~ExrHitsWriter() = default;

void ExrHitsWriter::open(const LayeredImage& first_band, std::string_view left_out) {
    channels_ = {{"Z", PixelType::kFloat, ExrChannel::kZ}};
    for (std::size_t i = 0; i < first_band.extra.size(); ++i) {
        const FragmentArray& array = first_band.extra[i];
        if (array.channels.front() == left_out) continue;
        const auto more = deepChannels(array, static_cast<int>(i));
        channels_.insert(channels_.end(), more.begin(), more.end());
    }
    std::ranges::sort(channels_, {}, &ExrChannel::name);
    std::vector<Imf::Header> headers;
    for (const ExrBundle& bundle : bundles_) {
        Plan plan;
        plan.view = bundle.view;
        plan.fragments_counted = plan.fragments_stored = bundle.hits;
        Imf::Header header = exrHeader(plan, provenance_, bundle.view.crop);
        header.setName(bundle.name);
        header.setType(Imf::DEEPSCANLINE);
        header.setVersion(1);
        header.compression() = Imf::ZIPS_COMPRESSION;
        Imf::addDeepImageState(header, Imf::DIS_SORTED);
        for (const ExrChannel& channel : channels_)
            header.channels().insert(channel.name, Imf::Channel(exrPixelType(channel.type)));
        addIdManifest(header, provenance_.ids);
        headers.push_back(std::move(header));
    }
    exr_ = std::make_unique<ExrFile>(file_, std::move(headers));
}

void ExrHitsWriter::write(std::size_t bundle, const LayeredImage& band, std::string_view left_out) {
    if (!exr_) open(band, left_out);
    const Window& window = bundles_[bundle].view.crop;
    packed_.resize(kRowsInFlight);
    for (int y = band.window.y0; y < band.window.y1; y += kRowsInFlight) {
        const int rows = std::min(kRowsInFlight, band.window.y1 - y);
        parallelFor(static_cast<std::size_t>(rows), [&](std::size_t row) {
            packers_.with([&](ExrChunkPacker& packer) {
                packDeepRow(band, channels_, window, y + static_cast<int>(row), packer,
                            packed_[row]);
            });
        });
        for (int row = 0; row < rows; ++row)
            exr_->append(bundle, y + row - window.y0, packed_[static_cast<std::size_t>(row)]);
    }
}

void ExrHitsWriter::finish() {
    exr_->finish();
    file_.commit();
}

}  // namespace peeler
