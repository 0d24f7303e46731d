// SPDX-License-Identifier: Apache-2.0
// The tiles of one picture, in files of their own.
#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "cmd/cli/console.h"
#include "core/image/layered_image.h"
#include "formats/exr/layered_input.h"

namespace peeler::cmd {

/// A file with a part of the picture.
struct PictureTile {
    std::string path;
    std::unique_ptr<LayeredInput> input{};
    LayeredImage arrays{};  ///< the names and types of its fragments' arrays

    const ExrInfo& info() const { return input->info(); }
    const Window& window() const { return info().plan.view.crop; }
    bool hasLayers() const { return !info().plan.layers.empty(); }
};

class PictureTiles {
  public:
    /// What the files hold; composites are read as pixels (openComposite()).
    enum class Kind { kLayered, kDeep, kComposite };

    /// Opens the files. Tiles without any fragment are composites or layers as the others are, or
    /// if all are empty, as `composites_wanted` says. Throws Error (kInput) for what is no tile of
    /// peeler's, and for tiles that are not of one picture; warns of lesser differences.
    PictureTiles(const std::vector<std::filesystem::path>& paths, bool composites_wanted,
                 Console& console);

    Kind kind() const { return kind_; }
    const std::vector<PictureTile>& all() const { return tiles_; }
    /// That of the first speaks for all.
    const ExrInfo& info() const { return tiles_.front().info(); }
    const Window& window() const { return window_; }  ///< that holds all of them
    bool overlap() const;
    /// A rectangle of the window that no tile has; none if they cover it.
    std::optional<Window> gap() const;
    /// One of "--tile I/N" that is not there although all others are of N, too: the window does not
    /// miss one at its top or bottom. "" = none.
    std::string missingStrip() const;

    /// Rows to read at once within `bytes`, whether the tiles lie side by side or not.
    int rowsFor(std::uint64_t bytes) const;
    /// The pixels of a window, with the arrays of the first tile that has layers. Returns a pixel
    /// on which tiles do not agree; then `band` is of no use.
    std::optional<Window> read(const Window& window, LayeredImage& band);

  private:
    void open(const std::vector<std::filesystem::path>& paths, bool composites_wanted);
    void checkCommon(Console& console);

    Kind kind_ = Kind::kLayered;
    std::vector<PictureTile> tiles_;
    std::vector<Window> windows_;
    Window window_;
    LayeredImage arrays_;               ///< of tiles with layers
    std::vector<LayeredImage> images_;  ///< that are being joined
};

}  // namespace peeler::cmd
