// SPDX-License-Identifier: Apache-2.0
// Writer of hits as a deep image.
#include <OpenEXR/ImfChannelList.h>
#include <OpenEXR/ImfDeepImageStateAttribute.h>
#include <OpenEXR/ImfIntAttribute.h>
#include <OpenEXR/ImfPartType.h>
#include <OpenEXR/ImfStandardAttributes.h>

#include <algorithm>
#include <memory>
#include <numeric>
#include <utility>
#include <vector>

#include <peeler/bundle.h>
#include "core/base/parallel.h"
#include "core/fragments/supersampling.h"
#include "core/image/channels.h"
#include "formats/exr/exr_chunks.h"
#include "formats/exr/exr_header.h"
#include "formats/exr/exr_rows.h"
#include "formats/file/atomic_file.h"
#include "formats/rays/hit_columns.h"

namespace peeler {
namespace {

constexpr int kHitRowsInFlight = 32;
constexpr const char* kCameraZ = "cameraZ";

/// A deep image with a scan-line part for each bundle. The data window of a part is the crop. Every
/// hit of a ray is a point sample of the ray's pixel, in list order. A sample has Z (camera Z) and
/// the components of the extra arrays except the keys, including integers, but no colours. If a
/// bundle has a lens, all samples have kCameraZ too, because their Z is the distance. The
/// compression is ZIPS. The parts follow each other in the file. The sizes of the bands do not
/// affect the bytes of the file.
class HitImage final : public RayOutput {
  public:
    HitImage(std::string path, const HitOptions& options)
        : path_(std::move(path)),
          provenance_(options.provenance),
          camera_z_(haveLens(options.bundles)) {
        provenance_.ids = idNames(options.posed.scene());
    }

    std::vector<Channel> channels() const override {
        std::vector<Channel> channels = channelsOf(hitColumns());
        channels.push_back(Channel::kId);
        channels.push_back(Channel::kDistance);
        std::ranges::sort(channels);
        return channels;
    }
    bool needsHits() const override { return true; }
    SizeForecast forecast(std::span<const Bundle> bundles,
                          std::span<const std::uint64_t> hits) const override {
        const std::uint64_t hit =
            (camera_z_ ? 2 : 1) * sizeof(float) + channelBytes(channels(), PixelType::kFloat);
        std::uint64_t bytes = hit * std::accumulate(hits.begin(), hits.end(), std::uint64_t{0}) +
                              // Sample count of each pixel.
                              sizeof(std::uint32_t) * raysOf(bundles);
        const std::uint64_t header = exrHeaderBytes(provenance_.ids);
        for (const Bundle& bundle : bundles) {
            const Window& crop = bundle.view.crop;
            bytes += header + kExrChunkBytes * static_cast<std::uint64_t>(crop.height());
        }
        return {bytes, Certainty::kAtMost};
    }

    void begin(std::span<const Bundle> bundles, std::span<const std::uint64_t> hits) override {
        const std::vector<View> views = withCommonDisplay(bundles);
        for (std::size_t i = 0; i < bundles.size(); ++i)
            parts_.push_back({bundles[i].name, views[i], hits[i]});
        file_ = std::make_unique<AtomicFile>(path_);
    }
    void take(std::size_t bundle, const LayeredImage& band) override;
    void finish() override {
        exr_->finish();
        file_->commit();
    }
    /// Returns half the number of rows that are packed before they are written, because sinkUse()
    /// counts each row twice. With a lens, the rows are also copied.
    SinkMemory memory(const Bundle& bundle) const override {
        const int rows = std::min(kHitRowsInFlight, bundle.view.crop.height());
        return {.rows = camera_z_ ? rows : rows / 2};
    }

  private:
    struct Part {
        std::string name;
        View view;
        std::uint64_t hits = 0;
        int next_row = 0;
    };

    void open(const LayeredImage& first_band);
    Imf::Header header(std::size_t part) const;
    void writeRows(std::size_t bundle, const LayeredImage& rows, int first);
    LayeredImage withCameraZ(const View& view, const LayeredImage& band, int first) const;

    std::string path_;
    Provenance provenance_;
    bool camera_z_;  ///< whether samples have kCameraZ
    std::vector<Part> parts_;
    std::unique_ptr<AtomicFile> file_;
    std::unique_ptr<ExrOutput> exr_;  ///< created with the first band, which has the channels
    std::vector<ExrChannel> channels_;
    std::vector<ExrDeepChunk> packed_;
    ExrPackerPool packers_{kDefaultZipLevel, Imf::ZIPS_COMPRESSION};
};

void HitImage::open(const LayeredImage& first_band) {
    channels_ = {{"Z", PixelType::kFloat, ExrChannel::kZ}};
    for (std::size_t i = 0; i < first_band.extra.size(); ++i) {
        const FragmentArray& array = first_band.extra[i];
        if (array.channels.front() == kKeyChannel) continue;
        const auto more = deepChannels(array, static_cast<int>(i));
        channels_.insert(channels_.end(), more.begin(), more.end());
    }
    if (camera_z_) {
        const auto source = static_cast<int>(first_band.extra.size());
        channels_.push_back({kCameraZ, PixelType::kFloat, source, 0, 1});
    }
    std::ranges::sort(channels_, {}, &ExrChannel::name);
    std::vector<Imf::Header> headers;
    for (std::size_t part = 0; part < parts_.size(); ++part)
        headers.push_back(header(part));
    exr_ = std::make_unique<ExrOutput>(*file_, std::move(headers));
}

Imf::Header HitImage::header(std::size_t part) const {
    const auto& [name, view, hits, next_row] = parts_[part];
    Plan plan;
    plan.view = view;
    plan.fragments_counted = plan.fragments_stored = hits;
    Imf::Header header = exrHeader(plan, provenance_, view.crop);
    header.setName(name);
    header.setType(Imf::DEEPSCANLINE);
    header.setVersion(1);
    header.compression() = Imf::ZIPS_COMPRESSION;
    Imf::addDeepImageState(header, Imf::DIS_SORTED);
    header.insert("peeler:bundle", Imf::IntAttribute(static_cast<int>(part)));
    for (const ExrChannel& channel : channels_)
        header.channels().insert(channel.name, Imf::Channel(exrPixelType(channel.type)));
    addIdManifest(header, provenance_.ids);
    return header;
}

/// Returns up to kHitRowsInFlight rows of a band, with camera Z as the last array.
LayeredImage HitImage::withCameraZ(const View& view, const LayeredImage& band, int first) const {
    LayeredImage rows = emptyImage(band, first);
    appendRows(band, first, std::min(first + kHitRowsInFlight, band.window.y1), rows);
    FragmentArray& array = rows.extra.emplace_back();
    array.channels = {kCameraZ};
    array.type = PixelType::kFloat;
    array.data.resize(rows.z.size() * sizeof(float));
    const auto camera_z = array.as<float>();
    std::size_t pixel = 0;
    for (int y = rows.window.y0; y < rows.window.y1; ++y) {
        for (int x = rows.window.x0; x < rows.window.x1; ++x, ++pixel) {
            if (rows.count(pixel) == 0) continue;
            const double scale = cameraZScale(view, x, y);
            for (std::size_t f = rows.offsets[pixel]; f < rows.offsets[pixel + 1]; ++f)
                camera_z[f] = static_cast<float>(static_cast<double>(rows.z[f]) * scale);
        }
    }
    return rows;
}

/// Writes up to kHitRowsInFlight rows of an image, from row `first` on.
void HitImage::writeRows(std::size_t bundle, const LayeredImage& image, int first) {
    const int rows = std::min(kHitRowsInFlight, image.window.y1 - first);
    parallelFor(static_cast<std::size_t>(rows), [&](std::size_t row) {
        packers_.with([&](ExrChunkPacker& packer) {
            packDeepRow(image, channels_, image.window, first + static_cast<int>(row), packer,
                        packed_[row]);
        });
    });
    for (int row = 0; row < rows; ++row)
        exr_->append(bundle, parts_[bundle].next_row++, packed_[static_cast<std::size_t>(row)]);
}

void HitImage::take(std::size_t bundle, const LayeredImage& band) {
    if (!exr_) open(band);
    packed_.resize(kHitRowsInFlight);
    for (int y = band.window.y0; y < band.window.y1; y += kHitRowsInFlight) {
        if (camera_z_)
            writeRows(bundle, withCameraZ(parts_[bundle].view, band, y), y);
        else
            writeRows(bundle, band, y);
    }
}

}  // namespace

std::unique_ptr<RayOutput> makeHitImage(const std::string& path, const HitOptions& options) {
    return std::make_unique<HitImage>(path, options);
}

}  // namespace peeler
