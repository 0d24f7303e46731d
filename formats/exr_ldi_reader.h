// SPDX-License-Identifier: Apache-2.0
// Layered depth images back as fragment lists.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "core/composite.h"
#include "core/layered_image.h"
#include "formats/exr_info.h"
#include "formats/exr_input.h"
#include "formats/layered_input.h"

namespace peeler {

/// Reads files of ExrLdiWriter, and any other whose parts `layer_*` hold R, G, B, A, Z. A fragment
/// is where Z is less than +inf. Memory grows with the window that is read, not with the file.
class ExrLdiReader : public LayeredInput {
  public:
    /// Throws Error (kInput) if the file is not layered; `where` names the part.
    explicit ExrLdiReader(const std::string& path);
    ~ExrLdiReader() override;

    const ExrInfo& info() const override { return info_; }
    void read(const Window& window, LayeredImage& out) override;
    void readComposite(const Window& window, CompositeImage& out) override;
    int rowsFor(std::uint64_t bytes) const override;

  private:
    struct Layer;
    std::vector<Layer> decode(const Window& window, std::span<const std::size_t> parts,
                              std::span<const ExrInputChannel> channels) const;
    void findChannels();

    ExrInput input_;
    ExrInfo info_;
    std::vector<ExrInputChannel> channels_;  ///< R, G, B, A, Z, then those of extra_
    std::vector<FragmentArray> extra_;       ///< without data
};

}  // namespace peeler
