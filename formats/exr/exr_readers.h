// SPDX-License-Identifier: Apache-2.0
// Reads layered depth images and deep images as fragment lists.
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

/// Reads files of ExrLdiWriter in every layout, and any other whose parts `layer_*` hold R, G, B,
/// A, Z; AR, AG, AB beside A are coloured opacity. A fragment is where Z is less than +inf.
///
/// A flat picture of others is read as one layer (exr_picture.h). Where it has no alpha, that is 1;
/// where it has no Z, a pixel that is not all 0 has a fragment, at Z = 0, and where its Z is
/// infinite or no number, at the largest finite one. Y is three times grey, or with RY and BY a
/// colour. A composite of our own is read, where it is asked for, as pixels: each is one entry,
/// with Z = +inf where there is no fragment.
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
    /// The part that a layer is in, and what stands there before the names of its channels.
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
    bool flat_ = false;            ///< a flat picture, as one layer
    bool pixels_ = false;          ///< a composite, every pixel of it
    ExrColors colors_;             ///< of a flat picture of others
    std::vector<Source> sources_;  ///< of the layers
    /// R, G, B, A, Z, then AR, AG, AB of coloured opacity, then those of extra_.
    std::vector<ExrInputChannel> channels_;
    std::vector<std::string> stored_;   ///< their names in a flat picture of others; "" = none
    std::size_t first_extra_ = 0;       ///< of them
    std::vector<FragmentArray> extra_;  ///< without data
};

/// Reads files of ExrDeepWriter and deep scan lines or tiles of others: a picture (exr_picture.h),
/// and what other deep parts say of the same samples. Our own files' parts must have the same
/// samples; a foreign part joins if it has the same data window, the same blocks and as many
/// samples in every pixel, and no channel of the same name but Z and ZBack.
///
/// Samples are sorted by Z (stably); a Z of +inf becomes the largest finite one, since +inf means
/// "nothing here" in a layered file; ZBack is kept as a channel. Where there is no A, alpha is the
/// mean of AR, AG and AB, or 1; where R, G or B is missing it is Y, or 0. Warns of a Z that is NaN
/// or -inf, of samples that overlap, which are not split, and of colours and alpha that are
/// missing.
///
/// Opening reads all sample counts, so that info().plan has the layers with their windows and
/// pixels, and the fragments as they are.
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
    /// Where the values of one channel of a part go.
    struct Route {
        static constexpr int kNowhere = -4, kGrey = -3, kZ = -2, kColor = -1;
        PixelType type = PixelType::kHalf;  ///< in the file
        int target = kNowhere;  ///< a constant above, or an index into LayeredImage::extra
        std::size_t component = 0;
    };
    struct Part {
        std::size_t index;          ///< in ExrInfo::parts
        std::vector<Route> routes;  ///< of all its channels, in their order
    };
    struct CountedBlock {
        ExrDeepBlock main, other;            ///< without samples
        std::vector<std::size_t> different;  ///< parts with other counts
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
    std::vector<Part> parts_;           ///< the first has Z and colour
    std::vector<FragmentArray> extra_;  ///< without data
    std::uint64_t sample_bytes_ = 0;    ///< of all parts together
    std::optional<DepthComplexity> complexity_;
};

}  // namespace peeler
