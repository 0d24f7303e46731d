// SPDX-License-Identifier: Apache-2.0
// OpenEXR band writer: finds the chunks that a band completes, gathers their pixels, packs and
// writes them.
#include "formats/exr/exr_band_writer.h"

#include <OpenEXR/ImfChannelList.h>
#include <OpenEXR/ImfIntAttribute.h>
#include <OpenEXR/ImfStringAttribute.h>

#include <algorithm>
#include <atomic>

#include <peeler/error.h>
#include "core/base/parallel.h"
#include "core/base/stage_times.h"
#include "core/image/composite.h"
#include "formats/exr/exr_header.h"
#include "formats/exr/exr_layout.h"
#include "formats/exr/exr_rows.h"

namespace peeler {
namespace {

/// Buffer size of an AtomicFile, in bytes.
constexpr std::size_t kFileBuffer = std::size_t{1} << 20;

/// Returns the channels for colour and Z. `color` and `z` are the sources of their values
/// (ExrChannel::Source).
std::vector<ExrChannel> colorChannels(const Plan& plan, int color, int z) {
    const std::vector<std::string> names = colorNames(plan.tinted);
    std::vector<ExrChannel> channels = {{"Z", PixelType::kFloat, z, 0, 1}};
    for (std::size_t c = 0; c < names.size(); ++c)
        channels.push_back({names[c], plan.color_type, color, c, names.size()});
    return channels;
}

/// Appends the channels of the arrays other than colour and Z.
void appendExrChannels(const std::vector<FragmentArray>& arrays,
                       std::vector<ExrChannel>& channels) {
    for (std::size_t i = 0; i < arrays.size(); ++i) {
        const FragmentArray& array = arrays[i];
        for (std::size_t c = 0; c < array.components(); ++c) {
            channels.push_back(
                {array.channels[c], array.type, static_cast<int>(i), c, array.components()});
        }
    }
}

void sortByName(std::vector<ExrChannel>& channels) {
    const auto name = [](const ExrChannel& a, const ExrChannel& b) { return a.name < b.name; };
    std::sort(channels.begin(), channels.end(), name);
}

std::size_t pixelBytes(const std::vector<ExrChannel>& channels) {
    std::size_t bytes = 0;
    for (const auto& channel : channels)
        bytes += pixelTypeSize(channel.type);
    return bytes;
}

}  // namespace

ExrBandWriter::ExrBandWriter(const std::vector<std::string>& paths, std::vector<ExrPart> parts,
                             Plan plan, OutputOptions options)
    : plan_(std::move(plan)),
      options_(std::move(options)),
      compression_(exrCompressionOf(options_.compression, false)),
      parts_(std::move(parts)),
      next_chunk_(parts_.size(), 0),
      next_row_(plan_.view.crop.y0) {
    for (const std::string& path : paths)
        files_.push_back(std::make_unique<AtomicFile>(path));
}

ExrBandWriter::~ExrBandWriter() = default;

void ExrBandWriter::write(const LayeredImage& band) {
    if (exr_.empty()) open(band);
    check(band);
    next_row_ = band.window.y1;
    fragments_seen_ += band.fragments();
    const std::vector<Job> jobs = finishedChunks(next_row_);
    for (std::size_t first = 0; first < jobs.size();) {
        std::size_t end = first;
        for (std::size_t bytes = 0; end < jobs.size() && bytes < kExrBytesInFlight; ++end)
            bytes += rawBytes(jobs[end]);
        run(std::span(jobs).subspan(first, end - first), band);
        first = end;
    }
    carry(band);
}

SinkMemory ExrBandWriter::memory(std::span<const ExrPart> parts, const Plan& plan,
                                 const OutputOptions& options) {
    // `widest`: the maximum number of values in one row of a part, per channel. `all`: the number
    // of values in all parts together, per channel.
    std::uint64_t widest = 0, all = 0;
    std::size_t last_file = 0;
    for (const ExrPart& part : parts) {
        const std::uint64_t row = static_cast<std::uint64_t>(part.window.width()) *
                                  static_cast<std::uint64_t>(part.layers.size());
        last_file = std::max(last_file, part.file);
        widest = std::max(widest, row);
        all += row * static_cast<std::uint64_t>(part.window.height());
    }
    const std::uint64_t pixel = colorNames(plan.tinted).size() * pixelTypeSize(plan.color_type) +
                                sizeof(float) + plan.channel_bytes;
    // Bytes per pixel for the composite's channels other than colour and Z.
    std::uint64_t composite = 0;
    if (std::ranges::any_of(parts, &ExrPart::nearest_channels)) composite += plan.channel_bytes;
    if (options.cryptomatte) {
        for (const CryptomatteLayer& layer : cryptomatteLayers({}))
            composite += cryptomatteArray(layer).stride();
    }
    const int rows = exrRowsPerChunk(exrCompressionOf(options.compression, false));
    const std::uint64_t chunk = widest * static_cast<std::uint64_t>(rows) * (pixel + composite);
    // Each thread holds a raw and a filtered chunk. Packed chunks wait until earlier chunks are
    // written.
    const auto threads = static_cast<std::uint64_t>(threadCount());
    const std::uint64_t packed =
        std::min<std::uint64_t>(kExrBytesInFlight, all * (pixel + composite));
    return {rows - 1, 2 * threads * chunk + packed + last_file * kFileBuffer, composite};
}

void ExrBandWriter::finish() {
    if (exr_.empty())
        throw Error(ErrorKind::kInternal, "no band was written", files_.front()->path());
    const StageTimer timer(times_, "write");
    for (const auto& exr : exr_)
        exr->finish();
    commitAll(files_);
}

bool ExrBandWriter::nearestChannels() const {
    return std::ranges::any_of(parts_, &ExrPart::nearest_channels);
}

/// Composites a row.
void ExrBandWriter::composite(const LayeredImage& image, int y, CompositeImage& out) const {
    compositeRows(image, y, y + 1, options_.background, out);
    out.extra.clear();
    if (nearestChannels()) appendNearestChannels(image, out);
    if (options_.composited) return;
    for (const CryptomatteLayer& layer : cryptomatte_)
        appendCryptomatte(image, layer, out);
}

void ExrBandWriter::open(const LayeredImage& first_band) {
    carried_ = emptyImage(first_band, next_row_);
    findChannels(first_band);
    std::vector<std::vector<Imf::Header>> headers(files_.size());
    bool layered = false;
    for (std::size_t part = 0; part < parts_.size(); ++part) {
        auto& of_file = headers[parts_[part].file];
        place_.push_back(of_file.size());
        of_file.push_back(header(part));
        for (const int layer : parts_[part].layers)
            layered = layered || layer != ExrPart::kComposite;
    }
    for (std::size_t file = 0; file < files_.size(); ++file)
        exr_.push_back(std::make_unique<ExrOutput>(*files_[file], std::move(headers[file])));
    for (std::size_t part = 0; part < parts_.size(); ++part)
        chunks_.push_back(exr_[parts_[part].file]->chunkCount(place_[part]));
    // Colours of composites are converted to the plan's type; colours of layers are not.
    if (layered && first_band.color.type != plan_.color_type) {
        throw Error(ErrorKind::kInternal, "a band's colours do not fit the plan",
                    files_.front()->path());
    }
}

/// Lists the channels of each part, for its layers and its composite.
void ExrBandWriter::findChannels(const LayeredImage& first_band) {
    auto layer_channels = colorChannels(plan_, ExrChannel::kColor, ExrChannel::kZ);
    appendExrChannels(first_band.extra, layer_channels);
    auto composite_channels =
        colorChannels(plan_, ExrChannel::kCompositeColor, ExrChannel::kCompositeZ);
    std::vector<FragmentArray> arrays;
    if (nearestChannels()) arrays = emptyImage(first_band, 0).extra;
    if (options_.cryptomatte) cryptomatte_ = cryptomatteLayers(options_.provenance.ids);
    for (const CryptomatteLayer& layer : cryptomatte_)
        if (!options_.composited) arrays.push_back(cryptomatteArray(layer));
    appendExrChannels(arrays, composite_channels);
    for (const ExrPart& part : parts_) {
        std::vector<ExrChannel>& channels = channels_.emplace_back();
        for (const int layer : part.layers) {
            const bool composite = layer == ExrPart::kComposite;
            const std::string prefix =
                composite || !part.prefixed ? "" : layerName(static_cast<std::size_t>(layer)) + ".";
            for (ExrChannel channel : composite ? composite_channels : layer_channels) {
                channel.name.insert(0, prefix);
                channel.layer = layer;
                channels.push_back(std::move(channel));
            }
        }
        sortByName(channels);
    }
}

Imf::Header ExrBandWriter::header(std::size_t part) const {
    const ExrPart& shown = parts_[part];
    Imf::Header header = exrHeader(plan_, options_.provenance, shown.window);
    header.setName(shown.name);
    header.compression() = compression_;
    if (!options_.layout.empty())
        header.insert("peeler:layout", Imf::StringAttribute(options_.layout));
    if (shown.layers.size() == 1 && shown.layers.front() != ExrPart::kComposite)
        header.insert("peeler:layer", Imf::IntAttribute(shown.layers.front()));
    if (shown.fragments != 0) {
        header.insert("peeler:fragmentsStored",
                      Imf::StringAttribute(std::to_string(shown.fragments)));
    }
    for (const ExrChannel& channel : channels_[part]) {
        if (header.channels().findChannel(channel.name))
            throw Error(ErrorKind::kInternal, "two channels have the same name", channel.name);
        header.channels().insert(channel.name, Imf::Channel(exrPixelType(channel.type)));
    }
    addIdManifest(header, options_.provenance.ids);
    const auto& layers = shown.layers;
    if (std::find(layers.begin(), layers.end(), ExrPart::kComposite) != layers.end()) {
        for (const CryptomatteLayer& layer : cryptomatte_) {
            for (const auto& [name, text] : cryptomatteAttributes(layer))
                header.insert(name, Imf::StringAttribute(text));
        }
    }
    return header;
}

void ExrBandWriter::check(const LayeredImage& band) const {
    const Window& crop = plan_.view.crop;
    const PixelType type = carried_.color.type;
    bool good = band.window.x0 == crop.x0 && band.window.x1 == crop.x1 &&
                band.window.y0 == next_row_ && band.window.y1 <= crop.y1 &&
                band.offsets.size() == band.window.pixels() + 1 && band.offsets.front() == 0 &&
                band.offsets.back() == band.fragments() && band.color.type == type &&
                band.tinted() == plan_.tinted &&
                band.color.data.size() == band.fragments() * band.color.stride() &&
                band.extra.size() == carried_.extra.size();
    for (std::size_t i = 0; good && i < band.extra.size(); ++i) {
        good = band.extra[i].channels == carried_.extra[i].channels &&
               band.extra[i].type == carried_.extra[i].type &&
               band.extra[i].data.size() == band.fragments() * band.extra[i].stride();
    }
    if (!good)
        throw Error(ErrorKind::kInternal, "a band does not fit the plan", files_.front()->path());
}

std::vector<ExrBandWriter::Job> ExrBandWriter::finishedChunks(int end_row) {
    std::vector<Job> jobs;
    for (std::size_t part = 0; part < parts_.size(); ++part) {
        const Window& window = parts_[part].window;
        for (int& chunk = next_chunk_[part]; chunk < chunks_[part]; ++chunk) {
            const int y0 = window.y0 + chunk * rowsPerChunk();
            const int y1 = std::min(y0 + rowsPerChunk(), window.y1);
            if (y1 > end_row) break;
            jobs.push_back({part, chunk, y0, y1});
        }
    }
    // Chunks are ordered by the row that completes them, so that their order in the file does not
    // depend on the bands.
    std::sort(jobs.begin(), jobs.end(), [](const Job& a, const Job& b) {
        return a.y1 != b.y1 ? a.y1 < b.y1 : a.part < b.part;
    });
    return jobs;
}

void ExrBandWriter::run(std::span<const Job> jobs, const LayeredImage& band) {
    packed_.resize(std::max(packed_.size(), jobs.size()));
    {
        const StageTimer timer(times_, "encode");
        encode(jobs, band);
    }
    const StageTimer timer(times_, "write");
    for (std::size_t i = 0; i < jobs.size(); ++i) {
        const std::size_t part = jobs[i].part;
        exr_[parts_[part].file]->append(place_[part], jobs[i].chunk, packed_[i]);
    }
    boundBuffers();
}

/// Frees the buffers if they exceed a limit. Otherwise every buffer would grow over time to the
/// size of the largest chunk.
void ExrBandWriter::boundBuffers() {
    std::size_t kept = packers_.bytesKept();
    for (const auto& packed : packed_)
        kept += packed.capacity();
    if (kept <= kExrCopiesInFlight * kExrBytesInFlight) return;
    packed_.clear();
    packers_.clear();
}

void ExrBandWriter::encode(std::span<const Job> jobs, const LayeredImage& band) {
    std::atomic<std::uint64_t> written{0};
    parallelFor(jobs.size(), [&](std::size_t i) {
        packers_.with([&](ExrChunkPacker& packer) {
            written += gather(jobs[i], band, packer);
            packer.pack(packed_[i]);
        });
    });
    fragments_written_ += written;
}

std::size_t ExrBandWriter::rawBytes(const Job& job) const {
    const ExrPart& part = parts_[job.part];
    return static_cast<std::size_t>(part.window.width()) *
           static_cast<std::size_t>(job.y1 - job.y0) * pixelBytes(channels_[job.part]);
}

std::uint64_t ExrBandWriter::gather(const Job& job, const LayeredImage& band,
                                    ExrChunkPacker& packer) const {
    const ExrPart& part = parts_[job.part];
    const auto width = static_cast<std::size_t>(part.window.width());
    const std::span<const ExrChannel> all = channels_[job.part];
    std::byte* out = packer.raw(rawBytes(job)).data();
    std::vector<std::uint32_t> row(width);
    CompositeImage flat;  // a row
    std::uint64_t found = 0;
    for (int y = job.y0; y < job.y1; ++y) {
        const bool is_carried = y < carried_.window.y1;
        const LayeredImage& image = is_carried ? carried_ : band;
        // Channels are sorted by name, so the channels of a layer are adjacent.
        for (std::size_t first = 0, end = 0; first < all.size(); first = end) {
            const int layer = all[first].layer;
            while (end < all.size() && all[end].layer == layer)
                ++end;
            const auto channels = all.subspan(first, end - first);
            if (layer == ExrPart::kComposite) {
                composite(image, y, flat);
                const auto left = static_cast<std::size_t>(part.window.x0 - image.window.x0);
                out = gatherExrComposite(flat, channels, left, width, out);
            } else {
                found += findExrFragments(image, static_cast<std::uint32_t>(layer), part.window.x0,
                                          y, row);
                out = gatherExrLayer(image, channels, row, out);
            }
        }
    }
    return found;
}

void ExrBandWriter::carry(const LayeredImage& band) {
    int needed = next_row_;
    for (std::size_t part = 0; part < parts_.size(); ++part) {
        if (next_chunk_[part] == chunks_[part]) continue;
        needed = std::min(needed, parts_[part].window.y0 + next_chunk_[part] * rowsPerChunk());
    }
    carried_ = rowsFrom(needed, carried_, band);
}

}  // namespace peeler
