// SPDX-License-Identifier: Apache-2.0
// Writers of layered pictures and composites as arrays.
#include <algorithm>
#include <array>
#include <cstring>
#include <optional>
#include <set>
#include <utility>

#include <peeler/channels.h>
#include <peeler/error.h>
#include "core/base/resize_anew.h"
#include "core/base/stage_times.h"
#include "core/image/channels.h"
#include "core/image/composite.h"
#include "formats/arrays/array_writer.h"
#include "formats/arrays/fragment_columns.h"
#include "formats/arrays/picture_arrays.h"
#include "formats/arrays/picture_texts.h"
#include "formats/file/file_name.h"

namespace peeler {
namespace {

constexpr std::size_t kTintOnly = kTintedComponents - kPlainComponents;

/// The channels other than colour and Z, as arrays. The arrays and their components have the order
/// of the channel table. (In pictures read from files, they may be sorted by name.)
class ArrangedChannels {
  public:
    explicit ArrangedChannels(std::span<const FragmentArray> channels = {}) {
        for (std::size_t i = 0; i < channels.size(); ++i)
            rows_.push_back(rowOf(channels[i], i));
        std::ranges::stable_sort(rows_, {}, &Row::rank);
        for (const Row& row : rows_)
            arrays_.push_back({row.names, channels[row.source].type, {}});
    }

    /// Returns the arrays without data.
    std::span<const FragmentArray> arrays() const { return arrays_; }
    /// Returns the values of arrays()[i], reordered in `storage` if needed. `channels` are the
    /// constructor's channels, with their data.
    std::span<const std::byte> numbers(std::span<const FragmentArray> channels, std::size_t i,
                                       std::vector<std::byte>& storage) const {
        const FragmentArray& array = channels[rows_[i].source];
        const std::vector<std::size_t>& from = rows_[i].components;
        if (std::ranges::is_sorted(from)) return array.data;
        const std::size_t number = pixelTypeSize(array.type), stride = array.stride();
        resizeAnew(storage, array.data.size());
        for (std::size_t at = 0; at < storage.size(); at += stride)
            for (std::size_t c = 0; c < from.size(); ++c)
                std::memcpy(&storage[at + c * number], &array.data[at + from[c] * number], number);
        return storage;
    }

  private:
    struct Row {
        std::size_t source;  ///< index of the array among the channels
        /// Index in the channel table; the table's size for unknown channels.
        std::size_t rank;
        std::vector<std::string> names;
        /// For each component, its index in the source array.
        std::vector<std::size_t> components;
    };

    static Row rowOf(const FragmentArray& array, std::size_t source) {
        const std::span<const ChannelInfo> table = channelTable();
        const auto row = std::ranges::find_if(table, [&](const ChannelInfo& info) {
            return std::ranges::is_permutation(info.components, array.channels);
        });
        Row arranged{source, static_cast<std::size_t>(row - table.begin()), array.channels, {}};
        if (row != table.end())
            arranged.names.assign(row->components.begin(), row->components.end());
        for (const std::string& name : arranged.names)
            arranged.components.push_back(static_cast<std::size_t>(
                std::ranges::find(array.channels, name) - array.channels.begin()));
        return arranged;
    }

    std::vector<Row> rows_;
    std::vector<FragmentArray> arrays_;
};

struct PictureLayout {
    std::vector<NamedArray> arrays;
    ArrayChannels channels;

    /// Adds an array of shape (`records`…), or (`records`…, `numbers`) if `numbers` > 1.
    void add(std::string name, PixelType type, std::vector<std::uint64_t> records,
             std::size_t numbers) {
        if (numbers > 1) records.push_back(numbers);
        arrays.push_back({std::move(name), numberTypeOf(type), std::move(records)});
    }
    /// Adds arrays for channels. Makes the arrays' names unique, because a channel of another
    /// program may have the name of an existing array.
    void add(std::span<const FragmentArray> extra, const std::vector<std::uint64_t>& records) {
        std::set<std::string> taken{"opacity", "arrays_version", "__metadata__"};
        for (const NamedArray& array : arrays)
            taken.insert(array.name);
        for (const FragmentArray& array : extra) {
            std::string name = nameOf(array);
            while (!taken.insert(name).second)
                name += '_';
            add(name, array.type, records, array.components());
            channels.emplace_back(std::move(name), array.channels);
        }
    }
};

/// The indices of the layers' arrays in the file. kTintList is the index of coloured opacity or,
/// without coloured opacity, of the first channel array.
enum LayerArray : std::size_t { kSplitList, kDepthList, kColorList, kTintList };

PictureLayout layersLayout(const Plan& plan, PixelType color,
                           std::span<const FragmentArray> extra) {
    const std::vector<std::uint64_t> n{plan.fragments_stored};
    PictureLayout layout;
    layout.arrays.push_back({"splits", NumberType::kInt64, {plan.view.crop.pixels() + 1}});
    layout.add("z", PixelType::kFloat, n, 1);
    layout.add("rgba", color, n, kPlainComponents);
    if (plan.tinted) layout.add("opacity", color, n, kTintOnly);
    layout.add(extra, n);
    return layout;
}

/// The indices of a composite's arrays in the file.
enum CompositeArray : std::size_t { kPixelColors, kPixelDepths, kPixelTints };

PictureLayout compositeLayout(const Plan& plan, std::span<const FragmentArray> extra) {
    const std::vector<std::uint64_t> pixels{static_cast<std::uint64_t>(plan.view.crop.height()),
                                            static_cast<std::uint64_t>(plan.view.crop.width())};
    PictureLayout layout;
    layout.add("rgba", PixelType::kFloat, pixels, kPlainComponents);
    layout.add("z", PixelType::kFloat, pixels, 1);
    if (plan.tinted) layout.add("opacity", PixelType::kFloat, pixels, kTintOnly);
    layout.add(extra, pixels);
    return layout;
}

/// Returns the texts to store. A .npz stores texts as arrays, so it gets only the output hash.
ArrayTexts textsOf(const std::string& path, const char* kind, const Plan& plan,
                   const Provenance& provenance, const PictureLayout& layout) {
    if (lowerExtension(path) == ".npz") return {{"output_hash", provenance.output_hash}};
    return pictureTexts(kind, plan, provenance, layout.channels);
}

class LayerArrays final : public Sink {
  public:
    LayerArrays(std::string path, Provenance provenance)
        : path_(std::move(path)), provenance_(std::move(provenance)) {}

    void begin(const Plan& plan) override { plan_ = plan; }
    void write(LayeredImage&& band) override;
    void finish() override {
        const StageTimer timer(times_, "write");
        writer_->finish();
    }
    /// Returns the memory of the splits and of one array's reordered values.
    SinkMemory memory(const Plan& plan) const override {
        std::size_t widest = plan.tinted ? kPlainComponents * pixelTypeSize(plan.color_type) : 0;
        for (const FragmentArray& array : plan.channels)
            widest = std::max(widest, array.stride());
        return {.pixel_bytes = sizeof(std::int64_t), .fragment_bytes = widest};
    }
    StageTimes times() const override { return times_; }

  private:
    void open(const LayeredImage& band);

    std::string path_;
    Provenance provenance_;
    Plan plan_;
    ArrangedChannels channels_;
    std::optional<ArrayWriter> writer_;  ///< created with the first band
    std::int64_t fragments_ = 0;         ///< number of fragments written so far
    std::vector<std::int64_t> splits_;
    std::vector<std::byte> values_;
    StageTimes times_;
};

void LayerArrays::open(const LayeredImage& band) {
    channels_ = ArrangedChannels(band.extra);
    const PictureLayout layout = layersLayout(plan_, band.color.type, channels_.arrays());
    writer_.emplace(path_, layout.arrays, textsOf(path_, kLayersKind, plan_, provenance_, layout));
    writer_->append(kSplitList, asBytes(std::span(&fragments_, 1)));
}

void LayerArrays::write(LayeredImage&& band) {
    const StageTimer timer(times_, "write");
    if (!writer_) open(band);
    splits_.clear();
    for (std::size_t p = 1; p < band.offsets.size(); ++p)
        splits_.push_back(fragments_ + band.offsets[p]);
    fragments_ += static_cast<std::int64_t>(band.fragments());
    writer_->append(kSplitList, asBytes(splits_));
    writer_->append(kDepthList, asBytes(band.z));
    if (plan_.tinted) {
        writer_->append(kColorList, componentsOf(band.color, 0, kPlainComponents, values_));
        writer_->append(kTintList, componentsOf(band.color, kPlainComponents, kTintOnly, values_));
    } else {
        writer_->append(kColorList, band.color.data);
    }
    const std::size_t first = plan_.tinted ? kTintList + 1 : kTintList;
    for (std::size_t i = 0; i < band.extra.size(); ++i)
        writer_->append(first + i, channels_.numbers(band.extra, i, values_));
}

class CompositeArrays final : public Sink {
  public:
    CompositeArrays(std::string path, OutputOptions options)
        : path_(std::move(path)), options_(std::move(options)) {}

    void begin(const Plan& plan) override { plan_ = plan; }
    void write(LayeredImage&& band) override {
        composite(band);
        const StageTimer timer(times_, "write");
        if (!writer_) {
            channels_ = ArrangedChannels(composite_.extra);
            const PictureLayout layout = compositeLayout(plan_, channels_.arrays());
            writer_.emplace(path_, layout.arrays,
                            textsOf(path_, kCompositeKind, plan_, options_.provenance, layout),
                            options_.compress);
        }
        writer_->append(kPixelColors, asBytes(composite_.rgba));
        writer_->append(kPixelDepths, asBytes(composite_.z));
        if (plan_.tinted) writer_->append(kPixelTints, asBytes(composite_.opacity));
        const std::size_t first = plan_.tinted ? kPixelTints + 1 : kPixelTints;
        for (std::size_t i = 0; i < composite_.extra.size(); ++i)
            writer_->append(first + i, channels_.numbers(composite_.extra, i, values_));
    }
    void finish() override {
        const StageTimer timer(times_, "write");
        writer_->finish();
    }
    SinkMemory memory(const Plan& plan) const override {
        if (!options_.compress) return {};
        return {.bytes =
                    ArrayWriter::compressionBytes(forecastCompositeArrays(path_, plan, options_))};
    }
    StageTimes times() const override { return times_; }

  private:
    void composite(const LayeredImage& band) {
        const StageTimer timer(times_, "composite");
        compositeOver(band, options_.background, composite_);
        composite_.extra.clear();
        appendNearestChannels(band, composite_);
    }

    std::string path_;
    OutputOptions options_;
    Plan plan_;
    std::optional<ArrayWriter> writer_;  ///< created with the first band
    ArrangedChannels channels_;
    CompositeImage composite_;
    std::vector<std::byte> values_;
    StageTimes times_;
};

}  // namespace

std::unique_ptr<Sink> makeLayerArrays(const std::string& path, const OutputOptions& options) {
    return std::make_unique<LayerArrays>(path, options.provenance);
}

SizeForecast forecastLayerArrays(const std::string& path, const Plan& plan,
                                 const OutputOptions& options) {
    const ArrangedChannels channels(plan.channels);
    const PictureLayout layout = layersLayout(plan, plan.color_type, channels.arrays());
    return {ArrayWriter::fileBytes(path, layout.arrays,
                                   textsOf(path, kLayersKind, plan, options.provenance, layout))};
}

std::unique_ptr<Sink> makeCompositeArrays(const std::string& path, const OutputOptions& options) {
    return std::make_unique<CompositeArrays>(path, options);
}

SizeForecast forecastCompositeArrays(const std::string& path, const Plan& plan,
                                     const OutputOptions& options) {
    const ArrangedChannels channels(plan.channels);
    const PictureLayout layout = compositeLayout(plan, channels.arrays());
    return ArrayWriter::forecast(path, layout.arrays,
                                 textsOf(path, kCompositeKind, plan, options.provenance, layout),
                                 options.compress);
}

}  // namespace peeler
