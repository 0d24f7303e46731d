// SPDX-License-Identifier: Apache-2.0
// Layered depth images back as fragment lists.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "core/image/composite.h"
#include "core/image/layered_image.h"
#include "formats/exr/exr_files.h"
#include "formats/exr/exr_info.h"
#include "formats/exr/layered_input.h"

namespace peeler {

/// Reads files of ExrLdiWriter in every layout, and any other whose parts `layer_*` hold R, G, B,
/// A, Z. A fragment is where Z is less than +inf.
///
/// A flat picture of others is read as one layer: the first scan-line part with R, G, B or Y. Where
/// it has no A, alpha is 1; where it has no Z, a pixel that is not all 0 has a fragment, at Z = 0.
/// A composite of our own is read, where it is asked for, as pixels: each is one entry, with
/// Z = +inf where there is no fragment.
class ExrLdiReader : public LayeredInput {
  public:
    /// Throws Error (kInput) if the file is not layered; `where` names the part.
    explicit ExrLdiReader(OpenedExr opened, bool composite = false);
    explicit ExrLdiReader(const std::string& path) : ExrLdiReader(OpenedExr(path)) {}
    ~ExrLdiReader() override;

    const ExrInfo& info() const override { return info_; }
    void read(const Window& window, LayeredImage& out) override;
    void readComposite(const Window& window, CompositeImage& out) override;
    int rowsFor(std::uint64_t bytes) const override;

  private:
    struct Layer;
    /// A part, and what stands before the names of its channels.
    struct Source {
        std::size_t part;
        std::string prefix;
    };
    std::vector<Layer> decode(const Window& window, std::span<const Source> sources,
                              std::span<const ExrInputChannel> channels) const;
    void checkLayers() const;
    void findChannels();
    void takeComposite();
    void takeFlatPicture();
    void completeFlatPicture(Layer& layer) const;

    ExrFiles input_;
    ExrInfo info_;
    bool flat_ = false;                      ///< a flat picture, as one layer
    bool pixels_ = false;                    ///< a composite, every pixel of it
    std::vector<Source> sources_;            ///< of the layers
    std::vector<ExrInputChannel> channels_;  ///< R, G, B, A, Z, then those of extra_
    std::vector<FragmentArray> extra_;       ///< without data
};

}  // namespace peeler
