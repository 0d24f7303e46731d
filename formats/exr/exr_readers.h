// SPDX-License-Identifier: Apache-2.0
// Readers of layered and deep images as fragment lists.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <peeler/composite.h>
#include <peeler/layered_image.h>
#include "core/image/layers.h"
#include "formats/exr/exr_files.h"
#include "formats/exr/exr_picture.h"
#include "formats/exr/layered_input.h"

namespace peeler {

/// A reader of layered depth images: files of ExrLdiWriter in every layout, and other files with
/// parts `layer_*` that hold R, G, B, A, Z. AR, AG, AB beside A are read as coloured opacity. A
/// pixel has a fragment if its Z is less than +inf.
///
/// Reads a flat picture of another program as one layer (exr_picture.h). Missing alpha becomes 1.
/// Without Z, a pixel has a fragment, at Z = 0, unless R, G, B and A are all 0. An infinite or NaN
/// Z becomes finite (makeDepthsFinite()). Y without RY and BY becomes grey; with RY and BY it
/// becomes a colour.
///
/// On request, reads a composite by peeler as pixels: each pixel has one entry, with Z = +inf where
/// there is no fragment.
class ExrLdiReader : public LayeredInput {
  public:
    /// Throws Error (kInput) if the file is not layered; `where` names the part.
    explicit ExrLdiReader(OpenedExr opened, const std::optional<ExrPicture>& picture = {},
                          bool composite = false);
    explicit ExrLdiReader(const std::string& path) : ExrLdiReader(OpenedExr(path)) {}
    ~ExrLdiReader() override;

    const ExrInfo& info() const override { return info_; }
    void read(const Window& window, LayeredImage& out) override;
    void readComposite(const Window& window, CompositeImage& out) override;
    int rowsFor(std::uint64_t bytes) const override;
    BandRead mostOf(int rows) const override;
    std::vector<Text> takeWarnings() override { return opened_.warnings.take(); }

  private:
    struct Layer;
    /// The location of a layer: its part, and the prefix of its channel names.
    struct Source {
        std::size_t part;
        std::string prefix;
    };
    std::uint64_t pixelBytes() const;
    std::vector<Layer> decode(const Window& window, std::span<const Source> sources,
                              std::span<const ExrInputChannel> channels) const;
    void checkLayers() const;
    void findChannels();
    void takeComposite();
    void takePicture(const ExrPicture& picture);
    std::string storedName(const Source& source, std::span<const ExrInputChannel> channels,
                           std::size_t c) const;
    void place();
    void completePicture(Layer& layer);
    template <class T>
    void completeColors(Layer& layer) const;
    template <class T>
    void completeAlpha(Layer& layer) const;
    void completeDepth(Layer& layer);

    OpenedExr opened_;
    ExrFiles& input_ = opened_.files;
    ExrInfo& info_ = opened_.info;
    bool flat_ = false;    ///< whether the file is a flat picture or a composite, read as one layer
    bool pixels_ = false;  ///< whether every pixel is read, with or without a fragment
    ExrColors colors_;     ///< channel names in another program's flat picture
    std::vector<Source> sources_;  ///< source of each layer
    /// R, G, B, A, Z, then AR, AG, AB if present, then the channels of extra_.
    std::vector<ExrInputChannel> channels_;
    /// For another program's flat picture: the names in the file of channels_; "" for missing
    /// channels.
    std::vector<std::string> stored_;
    std::size_t first_extra_ = 0;       ///< index in channels_ of the first channel of extra_
    std::vector<FragmentArray> extra_;  ///< extra arrays, without data
};

/// A reader of deep images in scan lines or tiles, from ExrDeepWriter or other programs. Reads one
/// picture (exr_picture.h), and the channels in other deep parts that belong to the same samples.
/// In a file by peeler, all parts must have the same samples. In another program's file, a part is
/// included if it has the same data window, the same blocks and the same sample count in every
/// pixel, and if Z and ZBack are the only channel names that it shares.
///
/// Samples are sorted by Z (stably). A Z of +inf becomes the largest finite value, since +inf marks
/// an empty pixel in a layered file. ZBack is kept as a channel. Missing A becomes the mean of AR,
/// AG and AB or, without them, 1. If R, G and B are all missing, they become Y or, without Y, 0.
/// Warns about a Z that is NaN or -inf, about overlapping samples, which are not split, and about
/// missing colours and alpha.
///
/// Opening reads all sample counts, so that info().plan has each layer's window and pixels, and the
/// actual fragment counts.
class ExrDeepReader : public LayeredInput {
  public:
    /// Throws Error (kInput) if the counts are damaged; `where` names the part.
    ExrDeepReader(OpenedExr opened, const ExrPicture& picture);
    ~ExrDeepReader() override;

    const ExrInfo& info() const override { return info_; }
    void read(const Window& window, LayeredImage& out) override;
    void readComposite(const Window& window, CompositeImage& out) override;
    int rowsFor(std::uint64_t bytes) const override;
    BandRead mostOf(int rows) const override;
    std::vector<Text> takeWarnings() override { return opened_.warnings.take(); }

  private:
    /// The destination of the values of a part's channel.
    struct Route {
        static constexpr int kNowhere = -4, kGrey = -3, kZ = -2, kColor = -1;
        PixelType type = PixelType::kHalf;  ///< type of the channel in the file
        int target = kNowhere;  ///< a constant above, or an index into LayeredImage::extra
        std::size_t component = 0;
    };
    struct Part {
        std::size_t index;          ///< index in ExrInfo::parts
        std::vector<Route> routes;  ///< routes of all channels of the part, in order
    };
    struct CountedBlock {
        ExrDeepBlock main, other;            ///< only the sample counts are read
        std::vector<std::size_t> different;  ///< indices of parts whose sample counts differ
    };

    std::vector<std::size_t> findOthers(std::size_t main) const;
    bool sameBlocks(std::size_t a, std::size_t b) const;
    void count(std::size_t block, CountedBlock& out) const;
    void countSamples();
    void warnOfColors();
    void findChannels();
    std::vector<std::size_t> blocksIn(const Window& window, std::size_t part) const;
    void readCounts(const Window& window, LayeredImage& out) const;
    void readSamples(const Window& window, LayeredImage& out) const;
    static void store(const Route& route, const std::byte* from, std::size_t begin, std::size_t end,
                      LayeredImage& out);
    void scatter(const ExrDeepBlock& block, const Part& part, LayeredImage& out) const;
    void completeAlpha(LayeredImage& out) const;
    void warnOfVolumes(const LayeredImage& image);

    OpenedExr opened_;
    ExrFiles& input_ = opened_.files;
    ExrInfo& info_ = opened_.info;
    ExrColors colors_;
    std::vector<Part> parts_;           ///< parts to read; the first part has Z and colour
    std::vector<FragmentArray> extra_;  ///< extra arrays, without data
    std::uint64_t sample_bytes_ = 0;    ///< bytes per sample in all parts together
    std::optional<DepthComplexity> complexity_;
};

}  // namespace peeler
