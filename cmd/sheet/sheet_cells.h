// SPDX-License-Identifier: Apache-2.0
// The pictures of a contact sheet, made small while the layers pass by.
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

/// What the cells of layers show.
enum class SheetShow {
    kColor,
    kDepth  ///< grey, near = white
};

/// One picture with what is written over it.
struct SheetCell {
    std::string label, detail;  ///< one line each
    CompositeImage picture;     ///< linear, premultiplied; window from (0, 0)
    /// How far a cell that shows another composite than the exact one is from that.
    DifferenceStatistics error;
    bool has_error = false;
    int passes = 0;  ///< geometry passes, for cells that show a method; else 0
};

struct SheetSettings {
    SheetShow show = SheetShow::kColor;
    bool progression = false;  ///< composites of the nearest layers, not the layers
    int most_cells = 24;
    int cell_width = 320;  ///< pixels; a picture that is smaller stays as it is
    bool meters = false;   ///< the exposure is to be found
};

/// Width and height in pixels of a cell that shows this crop.
std::pair<int, int> cellSize(const Window& crop, int cell_width);

/// "RMSE 0.0123, 38.2 dB"
std::string errorText(const DifferenceStatistics& error);

/// Adds a band's rows to a filter.
void addRows(const CompositeImage& band, BoxFilter& filter);
/// The colours of a filtered picture, whose window is set.
void setColors(const std::vector<BoxFilter::Pixel>& pixels, CompositeImage& picture);

/// Takes layers and makes cells of them: the composite and every layer, front to back; or the
/// composites of the nearest 1, 2, … layers. Cells above the limit are left out: the deepest
/// layers, or those of the progression before the last.
class SheetCells : public Sink {
  public:
    explicit SheetCells(const SheetSettings& settings) : settings_(settings) {}

    void begin(const Plan& plan) override;
    void write(LayeredImage&& band) override;
    void finish() override;
    SinkMemory memory(const Plan& plan) const override;
    StageTimes times() const override { return times_; }

    /// After finish().
    std::vector<SheetCell>& cells() { return finished_; }
    std::uint32_t omitted() const { return omitted_; }  ///< cells over the limit
    /// Of the composite, if the settings ask for it.
    const ExposureMeter& meter() const { return meter_; }

  private:
    /// What a cell shows, and its pixels so far.
    struct Pending {
        std::uint32_t layer = 0;  ///< which one; of composites, how many of the nearest
        bool composites = false;
        std::uint64_t fragments = 0;  ///< that it shows
        BoxFilter filter;
        DifferenceStatistics error;
    };

    void addCell(std::uint32_t layer, bool composites);
    bool hasComposite(const Plan& plan) const;
    /// How many cells there would be without a limit.
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
