// SPDX-License-Identifier: Apache-2.0
// The tiles of one picture, in files of their own.
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

/// A file with a part of the picture, open for reading.
struct PictureTile {
    std::string path;
    std::unique_ptr<LayeredInput> input{};
    LayeredImage arrays{};  ///< the first row: names and types of its arrays
    /// What is added to its ids of objects and materials, so that no other element has them.
    std::uint32_t first_object = 0, first_material = 0;

    const ExrInfo& info() const { return input->info(); }
    const Window& window() const { return info().plan.view.crop; }
    bool hasLayers() const { return !info().plan.layers.empty(); }
};

/// The files that a picture is merged from.
class PictureTiles {
  public:
    /// What the files hold; composites are read as pixels (openComposite()).
    enum class Kind { kLayered, kDeep, kComposite };
    /// What they are to each other: parts of the picture's pixels, or of its fragments.
    enum class Parts { kTiles, kElements };

    /// Opens the files. Tiles without any fragment are composites or layers as the others are, or,
    /// if all are empty, as `composites_wanted` says. Throws Error (kInput) for what is no tile of
    /// peeler's, and for tiles that are not of one picture; warns of lesser differences. Elements
    /// may be of other scenes and settings, and of other programs, but not composites; they have
    /// size, precision, channels and, where it is known, the camera in common. Their ids are made
    /// those of provenance().
    PictureTiles(const std::vector<std::filesystem::path>& paths, Parts parts,
                 const LayeredReadOptions& reading, bool composites_wanted, Reporter& reporter);

    Kind kind() const { return kind_; }
    const std::vector<PictureTile>& all() const { return tiles_; }
    /// The headers of the first tile, which stand for those of all.
    const ExrInfo& info() const { return tiles_.front().info(); }
    /// Where the picture comes from: what all say, where they may differ, and all names of ids.
    const Provenance& provenance() const { return provenance_; }
    const Window& window() const { return window_; }  ///< the least that holds all tiles
    /// Whether opacity is coloured: of elements, if it is in any of them.
    bool tinted() const { return arrays_.tinted(); }
    /// Whether two tiles share a pixel.
    bool overlap() const;
    /// A rectangle of the window that no tile has; none if they cover it.
    std::optional<Window> gap() const;
    /// The first of the strips "--tile I/N" that is missing, if all tiles are strips of the same N;
    /// "" = none. (Where one is missing at the top or bottom, the window does not show it.) Throws
    /// Error (kInput) for an attribute peeler:tile that names no strip.
    std::string missingStrip() const;

    /// Rows to read at once within `bytes`, whether the tiles lie side by side or not.
    int rowsFor(std::uint64_t bytes) const;
    /// Reads the pixels of a window, with the arrays of the first tile that has layers. Returns a
    /// pixel on which tiles do not agree, if there is one; then `band` is of no use. Elements
    /// always agree: their fragments are sorted by Z. Throws Error (kInput) for a damaged file.
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
    LayeredImage arrays_;               ///< names and types, of tiles with layers
    std::vector<LayeredImage> images_;  ///< the tiles' parts of a band
};

}  // namespace peeler::cmd
