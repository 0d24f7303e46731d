// SPDX-License-Identifier: Apache-2.0
// The tiles or elements of a picture, one file each.
#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <peeler/layered_image.h>
#include "cmd/session/reporter.h"
#include "formats/layered/opened_picture.h"

namespace peeler::cmd {

/// An open file that contains a part of the picture.
struct PictureTile {
    std::string path;
    std::unique_ptr<LayeredInput> input{};
    LayeredImage arrays{};  ///< the tile's first row, for the names and types of its arrays
    /// The offsets added to the file's object and material ids, which make ids unique among
    /// elements.
    std::uint32_t first_object = 0, first_material = 0;

    const ExrInfo& info() const { return input->info(); }
    const Window& window() const { return info().plan.view.crop; }
    bool hasLayers() const { return !info().plan.layers.empty(); }
};

/// The files that a picture is merged from.
class PictureTiles {
  public:
    /// The content of the files. Composites are read as flat pictures (openComposite()).
    enum class Kind { kLayered, kDeep, kComposite };
    /// Whether the picture is divided by pixels or by fragments.
    enum class Parts { kTiles, kElements };

    /// Opens the files. A tile without fragments is read as a composite or as layers, like the
    /// other tiles; if no tile has fragments, `composites_wanted` decides. Throws Error (kInput) if
    /// a tile was not written by peeler, or the files do not belong to one picture; warns about
    /// lesser differences. Elements may come from different scenes, settings and programs, but must
    /// not be composites. Elements must share size, precision, channels and, if known, the camera.
    /// Their ids are renumbered.
    PictureTiles(const std::vector<std::filesystem::path>& paths, Parts parts,
                 const LayeredReadOptions& reading, bool composites_wanted, Reporter& reporter);

    Kind kind() const { return kind_; }
    const std::vector<PictureTile>& all() const { return tiles_; }
    /// Returns the headers of the first file.
    const ExrInfo& info() const { return tiles_.front().info(); }
    /// Returns the provenance of the first file. For elements, the provenance has the id names of
    /// all files, and no scene or settings if these differ.
    const Provenance& provenance() const { return provenance_; }
    const Window& window() const { return window_; }  ///< returns the bounding window of all tiles
    /// Whether opacity is coloured in any of the files.
    bool tinted() const { return arrays_.tinted(); }
    /// Whether two tiles share a pixel.
    bool overlap() const;
    /// Returns a rectangle of the window that no tile covers, if any.
    std::optional<Window> gap() const;
    /// If all tiles are strips (--tile I/N) with the same N, returns the first missing strip, or ""
    /// if all strips exist. The window cannot show that a strip is missing at the top or bottom.
    /// Throws Error (kInput) if an attribute peeler:tile is not a strip.
    std::string missingStrip() const;

    /// Returns the number of rows that can be read at once within `bytes`, however the tiles are
    /// arranged.
    int rowsFor(std::uint64_t bytes) const;
    /// Reads the pixels of a window; `band` gets the arrays of the first tile that has layers. If
    /// overlapping tiles differ, returns a pixel in which they differ, and `band` is invalid.
    /// Elements may overlap: their fragments are merged by Z. Throws Error (kInput) if a file is
    /// damaged.
    std::optional<Window> read(const Window& window, LayeredImage& band);

  private:
    void open(const std::vector<std::filesystem::path>& paths, const LayeredReadOptions& reading,
              bool composites_wanted, Reporter& reporter);
    void checkCommon(Reporter& reporter);
    void joinProvenance();

    Parts parts_;
    Kind kind_ = Kind::kLayered;
    std::vector<PictureTile> tiles_;
    std::vector<Window> windows_;
    Window window_;
    Provenance provenance_;
    LayeredImage arrays_;               ///< names and types of the merged picture's arrays
    std::vector<LayeredImage> images_;  ///< the tiles' parts of the current band
};

}  // namespace peeler::cmd
