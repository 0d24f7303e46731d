// SPDX-License-Identifier: Apache-2.0
// A layered file whose fragments pass through a filter.
#pragma once

#include <functional>
#include <memory>

#include "formats/exr/layered_input.h"

namespace peeler::cmd {

/// A layered input that a filter changes band by band. It has no composite and no output hash.
class FilteredInput final : public LayeredInput {
  public:
    /// Called with each band that was read; may remove fragments or change colours.
    using Filter = std::function<void(LayeredImage&)>;

    /// Reads the whole file, to count the layers after filtering. Throws like LayeredInput::read().
    FilteredInput(std::unique_ptr<LayeredInput> input, Filter filter);

    const ExrInfo& info() const override { return info_; }
    Provenance& provenance() { return info_.provenance; }

    void read(const Window& window, LayeredImage& out) override;
    void readComposite(const Window& window, CompositeImage& out) override;
    std::vector<Text> takeWarnings() override { return input_->takeWarnings(); }
    int rowsFor(std::uint64_t bytes) const override { return input_->rowsFor(bytes); }
    BandRead mostOf(int rows) const override;

  private:
    std::unique_ptr<LayeredInput> input_;
    Filter filter_;
    ExrInfo info_;
};

}  // namespace peeler::cmd
