// SPDX-License-Identifier: Apache-2.0
// Writer of layers as an interactive web page.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include <peeler/layered_image.h>
#include <peeler/sink.h>
#include "formats/image/image_writer.h"

namespace peeler {

/// A writer of a self-contained HTML file: the packed cells of all fragments
/// (core/views/surface_cells.h), and a page that draws them with WebGL 2
/// (formats/page/view_page.html).
///
/// Colours are 8-bit sRGB, premultiplied and clipped per fragment, with exposure and tone map
/// applied (Display). If the background is all zeros, the page uses a background of its own. Each
/// fragment has its depth and the depths of its cell's corners, in 16 bits, as log2 Z for a
/// perspective camera. The page includes object and material ids if the fragments have ids;
/// `options` holds their names. Keeps the picture until finish(), which takes about another 90
/// bytes per fragment.
class HtmlViewWriter : public Sink {
  public:
    /// Throws Error (kUsage) if there is no tone map of this name.
    HtmlViewWriter(std::string path, OutputOptions options);

    /// Throws Error (kUsage) if the plan has too many fragments.
    void begin(const Plan& plan) override;
    void write(LayeredImage&& band) override;
    void finish() override;
    SinkMemory memory(const Plan& plan) const override;
    StageTimes times() const override { return times_; }

  private:
    std::string path_;
    OutputOptions options_;
    Display display_;
    Plan plan_;
    LayeredImage image_;
    StageTimes times_;
};

/// Returns the viewer page, formats/page/view_page.html, which is embedded when peeler is built.
/// HtmlViewWriter replaces {{hash}} with the output hash, {{view}} with the JSON, {{fragments}}
/// with the data, {{drawing}} and {{controls}} with the scripts.
std::string_view viewPage();
/// Returns the script that unpacks and draws fragments, formats/page/page_drawing.js.
std::string_view pageDrawing();
/// Returns the script of the page's user interface, formats/page/page_controls.js.
std::string_view pageControls();

}  // namespace peeler
