// SPDX-License-Identifier: Apache-2.0
// Writes layers as a web page in which one can look around.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include <peeler/layered_image.h>
#include <peeler/sink.h>
#include "formats/image/image_writer.h"

namespace peeler {

/// Writes one HTML file that needs nothing else: the cells of all fragments
/// (core/views/surface_cells.h), packed, and a page that draws them with WebGL 2
/// (formats/page/view_page.html). Colours are sRGB in 8 bits, premultiplied and clipped fragment by
/// fragment, exposure and tone map included (Display); a background that is all zero is the page's
/// own. Depths have 16 bits, of log2 Z for a perspective camera: those of a cell's corners, and the
/// fragment's own. Ids of objects and materials are in the page, with the names that `options` give
/// them, if the fragments have them. Holds the picture until finish(), with about 90 bytes a
/// fragment beside it.
class HtmlViewWriter : public Sink {
  public:
    /// Throws Error (kUsage) if there is no such tone map.
    HtmlViewWriter(std::string path, OutputOptions options);

    /// Throws Error (kUsage) if there are too many fragments.
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

/// The page that shows layers in a browser, formats/page/view_page.html, embedded at build time.
/// {{hash}} stands where its output hash goes, {{view}} where its JSON goes, {{fragments}} where
/// its data goes, {{drawing}} and {{controls}} where its script goes.
std::string_view viewPage();
/// What unpacks and draws fragments, formats/page/page_drawing.js.
std::string_view pageDrawing();
/// What the page does at the hand of its user, formats/page/page_controls.js.
std::string_view pageControls();

}  // namespace peeler
