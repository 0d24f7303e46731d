// SPDX-License-Identifier: Apache-2.0
// Hits as a deep image.
#include <algorithm>
#include <optional>
#include <utility>

#include "core/capture/supersampling.h"
#include "core/rays/bundle.h"
#include "formats/exr/exr_hits_writer.h"
#include "formats/rays/hit_columns.h"

namespace peeler {
namespace {

class HitImage final : public RayOutput {
  public:
    HitImage(std::string path, const HitOptions& options)
        : path_(std::move(path)), provenance_(options.provenance) {
        provenance_.ids = idNames(options.posed.scene());
    }

    std::vector<Channel> channels() const override {
        std::vector<Channel> channels = hitChannels();
        channels.push_back(Channel::kId);
        channels.push_back(Channel::kDistance);
        std::ranges::sort(channels);
        return channels;
    }
    bool needsHits() const override { return true; }

    void begin(std::span<const Bundle> bundles, std::span<const std::uint64_t> hits) override {
        const std::vector<View> views = withCommonDisplay(bundles);
        std::vector<ExrBundle> parts;
        for (std::size_t i = 0; i < bundles.size(); ++i)
            parts.push_back({bundles[i].name, views[i], hits[i]});
        writer_.emplace(path_, std::move(parts), provenance_);
    }
    void take(std::size_t bundle, const LayeredImage& band) override {
        writer_->write(bundle, band, kKeyChannel);
    }
    void finish() override { writer_->finish(); }

  private:
    std::string path_;
    Provenance provenance_;
    std::optional<ExrHitsWriter> writer_;
};

}  // namespace

std::unique_ptr<RayOutput> makeHitImage(const std::string& path, const HitOptions& options) {
    return std::make_unique<HitImage>(path, options);
}

}  // namespace peeler
