// SPDX-License-Identifier: Apache-2.0
// Contact sheet cells, downsampled as bands arrive.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <peeler/composite.h>
#include <peeler/sink.h>
#include "core/image/box_filter.h"
#include "core/image/difference.h"
#include "core/image/fxaa.h"
#include "formats/image/display.h"

namespace peeler::cmd {

/// The content of layer cells.
enum class SheetShow {
    kColor,
    kDepth  ///< grey, near = white
};

/// A picture with its label.
struct SheetCell {
    std::string label, detail;  ///< one line each
    CompositeImage picture;     ///< linear, premultiplied; window from (0, 0)
    /// The error of an approximate composite against the exact one.
    DifferenceStatistics error;
    bool has_error = false;
    int passes = 0;  ///< geometry passes of a method's cell; else 0
};

struct SheetSettings {
    SheetShow show = SheetShow::kColor;
    bool progression = false;  ///< composites of the nearest layers, not the layers
    int most_cells = 24;
    int cell_width = 320;  ///< pixels; smaller pictures are not scaled
    bool meters = false;   ///< meter the exposure
};

/// Returns the width and height in pixels of a cell for this crop.
std::pair<int, int> cellSize(const Window& crop, int cell_width);

/// Returns "RMSE 0.0123, 38.2 dB".
std::string errorText(const DifferenceStatistics& error);

/// Adds a band's rows to a filter.
void addRows(const CompositeImage& band, BoxFilter& filter);
/// Sets the colours of a picture, whose window is set, from filtered pixels.
void setColors(const std::vector<BoxFilter::Pixel>& pixels, CompositeImage& picture);

/// A sink that makes cells from layers: the composite and every layer, front to back; or the
/// composites of the nearest 1, 2, … layers. Omits cells over the limit: the deepest layers, or, in
/// a progression, those before the last.
class SheetCells : public Sink {
  public:
    explicit SheetCells(const SheetSettings& settings) : settings_(settings) {}

    void begin(const Plan& plan) override;
    void write(LayeredImage&& band) override;
    void finish() override;
    SinkMemory memory(const Plan& plan) const override;
    StageTimes times() const override { return times_; }

    /// Returns the cells; valid after finish().
    std::vector<SheetCell>& cells() { return finished_; }
    std::uint32_t omitted() const { return omitted_; }  ///< cells over the limit
    /// Returns the meter of the composite, if the settings request it.
    const ExposureMeter& meter() const { return meter_; }

  private:
    /// A cell in progress.
    struct Pending {
        std::uint32_t layer = 0;  ///< layer index; for composites, the number of nearest layers
        bool composites = false;
        std::uint64_t fragments = 0;  ///< fragments shown
        BoxFilter filter;
        DifferenceStatistics error;
    };

    void addCell(std::uint32_t layer, bool composites);
    bool hasComposite(const Plan& plan) const;
    /// Returns the number of cells without the limit.
    std::uint32_t cellsOf(const Plan& plan) const;
    void addComposite(const LayeredImage& band, Pending& cell);
    void addLayer(const LayeredImage& band, Pending& cell) const;
    void findRange(const LayeredImage& band);
    void showDepth(CompositeImage& picture) const;
    SheetCell finishCell(const Pending& cell) const;

    SheetSettings settings_;
    Window crop_;
    int width_ = 0, height_ = 0;  ///< of a cell
    std::uint32_t layers_ = 0, omitted_ = 0;
    float nearest_ = 0, farthest_ = 0;  ///< Z of all fragments
    bool has_range_ = false;
    std::vector<Pending> pending_;
    CompositeImage exact_, shown_;  ///< of a band
    ExposureMeter meter_;
    std::vector<SheetCell> finished_;
    StageTimes times_;
};

}  // namespace peeler::cmd
