// SPDX-License-Identifier: Apache-2.0
// Cells of a contact sheet that show what a method composites, and how far that is from the truth.
#pragma once

#include <optional>
#include <string>

#include "cmd/sheet/sheet_cells.h"
#include "core/capture/method.h"
#include "core/capture/renderer.h"

namespace peeler::cmd {

/// Keeps the composite of all bands that pass through it at full size, 20 bytes a pixel.
class CompositeKeeper : public Sink {
  public:
    /// Both must outlive it.
    CompositeKeeper(CompositeImage& composite, Sink& next) : composite_(composite), next_(next) {}

    void begin(const Plan& plan) override;
    void write(LayeredImage&& band) override;
    void finish() override { next_.finish(); }
    SinkMemory memory() const override;
    StageTimes times() const override { return next_.times(); }

  private:
    CompositeImage& composite_;
    Sink& next_;
    CompositeImage band_;
};

/// Makes one cell of composited bands, with their difference from the exact composite.
class CompositeCell : public Sink {
  public:
    /// `exact` must outlive the cell. If it is empty when a band comes, the error is not known.
    CompositeCell(int cell_width, const CompositeImage& exact)
        : cell_width_(cell_width), exact_(exact) {}

    void begin(const Plan& plan) override;
    void write(LayeredImage&& band) override;
    void finish() override;
    StageTimes times() const override { return times_; }

    /// After finish(); without labels.
    SheetCell& cell() { return cell_; }

  private:
    int cell_width_;
    const CompositeImage& exact_;
    std::optional<BoxFilter> filter_;  ///< from begin() to finish()
    CompositeImage band_, exact_band_;
    SheetCell cell_;
    StageTimes times_;
};

/// Captures the composite of one method and hands it to `sink`, which is the cell or ends in it.
/// The labels say its name, its geometry passes and its error.
SheetCell captureMethod(Renderer& renderer, const View& view, CaptureSettings settings,
                        const MethodInfo& method, CompositeCell& cell, Sink& sink,
                        const Progress& progress);

}  // namespace peeler::cmd
