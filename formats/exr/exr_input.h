// SPDX-License-Identifier: Apache-2.0
// Reads OpenEXR files as they are: parts, attributes as text, chunks of pixels.
#pragma once

#include <array>
#include <charconv>
#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <peeler/layered_image.h>
#include <peeler/sink.h>
#include <peeler/window.h>
#include "formats/file/byte_buffer.h"
#include "formats/file/regular_file.h"

struct _priv_exr_context_t;  // OpenEXRCore's; NOLINT(bugprone-reserved-identifier)

namespace peeler {

/// Limits of windows that are read, in pixels. The side is larger than any GPU renders, and the sum
/// of two coordinates fits an int.
inline constexpr int kMostImageSide = 1 << 17, kMostCoordinate = 1 << 28;

struct ExrInputChannel {
    std::string name;
    PixelType type = PixelType::kHalf;
};

/// The arrays for the channels of a fragment beside colour and Z: channels (sorted by name) that
/// agree in type and in their names up to the last dot (N.X, N.Y, N.Z) are one array. Without data.
std::vector<FragmentArray> fragmentArrays(std::span<const ExrInputChannel> channels);

/// The types of what stands for a part of a file that is none of OpenEXR's: arrays of all
/// fragments, and of the pixels of a composite (formats/arrays/picture_arrays.h).
inline constexpr const char* kListArrays = "lists in arrays";
inline constexpr const char* kPlaneArrays = "planes in arrays";

struct ExrInputPart {
    std::string name;  ///< "" in a single-part file without one
    /// "scanlineimage", "tiledimage", "deepscanline" or "deeptile"; of a .safetensors kListArrays
    /// or kPlaneArrays.
    std::string type;
    std::string compression;                ///< "none", "zip", …
    int tile_width = 0, tile_height = 0;    ///< of tiled parts
    Window data_window, display_window;     ///< from the corner of the file's display window on
    std::vector<ExrInputChannel> channels;  ///< sorted by name
    /// The text of those of type string, int, float, double and rational, by name.
    std::map<std::string, std::string> attributes;
    std::vector<std::byte> id_manifest{};  ///< the attribute idManifest as it is stored
    std::vector<std::string> views{};      ///< of multiView: the default one first
    /// x and y of red, green, blue and white; nothing if the file does not say.
    std::optional<std::array<float, 8>> chromaticities{};

    const ExrInputChannel* channel(const std::string& wanted) const;
    /// The text of an attribute, "" if there is none.
    std::string attribute(const std::string& wanted) const;
    /// Whether a pixel has a list of samples.
    bool deep() const {
        return type == "deepscanline" || type == "deeptile" || type == kListArrays;
    }
};

/// The number that the text of an attribute begins with, 0 if it begins with none.
template <class T>
T numberIn(const std::string& text) {
    T number{};
    std::from_chars(text.data(), text.data() + text.size(), number);
    return number;
}

/// The shortest text of a number that reads as the same one.
template <class T>
std::string numberText(T number) {
    std::array<char, 32> text;
    const auto end = std::to_chars(text.data(), text.data() + text.size(), number).ptr;
    return {text.data(), end};
}

/// Where decoded values of a channel go, converted to `type`: pixel (x, y) to
/// first + (x − window.x0)·size + (y − window.y0)·stride.
struct ExrTarget {
    std::string name;
    PixelType type = PixelType::kFloat;
    std::byte* first = nullptr;
    std::size_t stride = 0;  ///< bytes from row to row
};

/// A block of a deep part: a row, or a tile of full resolution.
struct ExrDeepBlock {
    Window window;
    std::vector<std::uint32_t> counts;  ///< samples of each pixel, row-major
    /// Row after row; in a row, channel after channel (by name); in a channel, pixel after pixel.
    ByteBuffer samples;
};

class ExrClasses;

/// An open file. Nothing in it is trusted: sizes are checked against limits and against the size of
/// the file before anything is allocated by them.
class ExrInput {
  public:
    /// Throws Error (kInput), `where` being the path.
    explicit ExrInput(std::string path);
    ~ExrInput();
    ExrInput(const ExrInput&) = delete;
    ExrInput& operator=(const ExrInput&) = delete;

    const std::string& path() const { return path_; }
    std::uint64_t bytes() const { return bytes_; }  ///< of the file
    const std::vector<ExrInputPart>& parts() const { return parts_; }
    /// Where the display window of the first part begins in the file; here it begins at (0, 0).
    int originX() const { return origin_x_; }
    int originY() const { return origin_y_; }
    /// The header of a part, attribute by attribute. Throws Error (kInput).
    std::vector<StoredAttribute> attributes(std::size_t part) const;

    /// Rows of a flat part that are compressed together, or of a tile; chunks begin at the top of
    /// the data window.
    int rowsPerChunk(std::size_t part) const;
    /// Decodes the chunk, or the row of tiles, that holds row `y` of a flat part and stores what
    /// lies in `window` (inside the data window). Safe to call from several threads. Throws Error
    /// (kInput), `where` being path and part.
    void readChunk(std::size_t part, int y, const Window& window,
                   std::span<const ExrTarget> targets) const;
    /// Decodes every chunk of a part, of tiles all levels but of deep ones the first, and keeps
    /// nothing. Throws Error (kInput) at the first that is damaged.
    void decodeAll(std::size_t part) const;

    /// Throws Error (kInput) unless every chunk of a part of scan lines lies inside the file. Reads
    /// where they are and decodes none.
    void checkChunks(std::size_t part) const;

    /// Blocks of a deep part, row-major.
    std::size_t deepBlocks(std::size_t part) const;
    /// The pixels of a block.
    Window deepBlockWindow(std::size_t part, std::size_t block) const;
    /// Reads how many samples the pixels of a block have, and the samples unless `counts_only`.
    /// Reuses the storage of `out`. Safe to call from several threads. Throws Error (kInput),
    /// `where` being path and part.
    void readDeepBlock(std::size_t part, std::size_t block, bool counts_only,
                       ExrDeepBlock& out) const;

  private:
    void readHeaders();
    void readHeader(int index, ExrInputPart& part);
    void readAttributes(int index, ExrInputPart& part);
    void moveToOrigin();
    void checkSizes() const;
    void decodeDwa(std::size_t part) const;
    void checkBlock(const ExrInputPart& part, int width, int rows) const;
    using Planes = std::vector<std::vector<std::byte>>;
    Window decodeChunk(std::size_t part, int y, std::span<const ExrTarget> targets,
                       Planes& planes) const;
    Window decodeByClasses(std::size_t part, int y, std::span<const ExrTarget> targets,
                           Planes& planes) const;
    [[noreturn]] void refuse(const std::string& what, const ExrInputPart& part) const;
    void check(int result, const std::string& part = {}) const;

    std::string path_;
    RegularFile file_;
    std::uint64_t bytes_ = 0;
    _priv_exr_context_t* context_ = nullptr;
    std::vector<ExrInputPart> parts_;
    int origin_x_ = 0, origin_y_ = 0;
    std::unique_ptr<ExrClasses> classes_;  ///< if a part has to be read by them
};

}  // namespace peeler
