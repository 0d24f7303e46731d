// SPDX-License-Identifier: Apache-2.0
// The cells of a contact sheet, downsampled as bands arrive.
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

/// The quantity that layer cells show.
enum class SheetShow {
    kColor,
    kDepth  ///< depth as grey; the nearest depth is white
};

/// A picture with its label.
struct SheetCell {
    std::string label, detail;  ///< two lines of text for the picture
    CompositeImage picture;     ///< linear, premultiplied; the window starts at (0, 0)
    /// The error of an approximate composite, relative to the exact composite.
    DifferenceStatistics error;
    bool has_error = false;
    int passes = 0;  ///< number of geometry passes of the method; 0 = no method
};

struct SheetSettings {
    SheetShow show = SheetShow::kColor;
    bool progression = false;  ///< show composites of the nearest 1, 2, … layers
    int most_cells = 24;
    int cell_width = 320;  ///< width in pixels; smaller pictures keep their size
    bool meters = false;   ///< whether to meter the exposure
};

/// Returns the width and height, in pixels, of a cell that shows this crop.
std::pair<int, int> cellSize(const Window& crop, int cell_width);

/// Returns an error as text: "RMSE 0.0123, 38.2 dB".
std::string errorText(const DifferenceStatistics& error);

/// Adds all rows of a band to a filter.
void addRows(const CompositeImage& band, BoxFilter& filter);
/// Sets the colours of a picture to the filtered pixels. The picture's window must be set.
void setColors(const std::vector<BoxFilter::Pixel>& pixels, CompositeImage& picture);

/// A sink that makes cells from layers: either the composite and every layer, front to back, or the
/// composites of the nearest 1, 2, … layers. If there are more cells than the limit, omits the
/// deepest layers, or the composites before the last one.
class SheetCells : public Sink {
  public:
    explicit SheetCells(const SheetSettings& settings) : settings_(settings) {}

    void begin(const Plan& plan) override;
    void write(LayeredImage&& band) override;
    void finish() override;
    SinkMemory memory(const Plan& plan) const override;
    StageTimes times() const override { return times_; }

    /// Returns the cells. Valid after finish().
    std::vector<SheetCell>& cells() { return finished_; }
    std::uint32_t omitted() const { return omitted_; }  ///< number of cells over the limit
    /// Returns the exposure meter. If `meters` is set, it has metered the composite.
    const ExposureMeter& meter() const { return meter_; }

  private:
    /// A cell in progress.
    struct Pending {
        /// Index of the layer; with `composites`, the number of nearest layers.
        std::uint32_t layer = 0;
        bool composites = false;
        std::uint64_t fragments = 0;  ///< number of fragments shown in the cell
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
    int width_ = 0, height_ = 0;  ///< size of a cell, pixels
    std::uint32_t layers_ = 0, omitted_ = 0;
    float nearest_ = 0, farthest_ = 0;  ///< range of Z over all fragments
    bool has_range_ = false;
    std::vector<Pending> pending_;
    CompositeImage exact_, shown_;  ///< composites of the current band
    ExposureMeter meter_;
    std::vector<SheetCell> finished_;
    StageTimes times_;
};

}  // namespace peeler::cmd
