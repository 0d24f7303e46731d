// SPDX-License-Identifier: Apache-2.0
// Low-level OpenEXR reader: parts, attributes as text, chunks of pixels.
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

struct _priv_exr_context_t;  // OpenEXRCore's type; NOLINT(bugprone-reserved-identifier)

namespace peeler {

/// The maximum side of windows in input files, and the maximum absolute value of their coordinates,
/// in pixels. The side exceeds the limits of GPUs; the sum of two coordinates fits into an int.
inline constexpr int kMostImageSide = 1 << 17, kMostCoordinate = 1 << 28;

struct ExrInputChannel {
    std::string name;
    PixelType type = PixelType::kHalf;
};

/// Returns arrays, without data, for a fragment's channels other than colour and Z. `channels` must
/// be sorted by name. Channels of the same type and with the same name up to the last dot (N.X,
/// N.Y, N.Z) form one array.
std::vector<FragmentArray> fragmentArrays(std::span<const ExrInputChannel> channels);

/// Values of ExrInputPart::type for pictures in array files (formats/arrays/picture_arrays.h):
/// lists of all fragments, and the pixels of a composite.
inline constexpr const char* kListArrays = "lists in arrays";
inline constexpr const char* kPlaneArrays = "planes in arrays";

struct ExrInputPart {
    std::string name;  ///< may be "" in a single-part file
    /// "scanlineimage", "tiledimage", "deepscanline" or "deeptile"; kListArrays or kPlaneArrays for
    /// a .safetensors file.
    std::string type;
    std::string compression;              ///< "none", "zip", …
    int tile_width = 0, tile_height = 0;  ///< 0 if the part is not tiled
    /// Relative to the upper left corner of the file's first display window.
    Window data_window, display_window;
    std::vector<ExrInputChannel> channels;  ///< sorted by name
    /// The attributes of types string, int, float, double and rational: text by name.
    std::map<std::string, std::string> attributes;
    std::vector<std::byte> id_manifest{};  ///< the bytes of the attribute idManifest
    std::vector<std::string> views{};      ///< the attribute multiView, with the default view first
    /// x and y of red, green, blue and white, if the file has them.
    std::optional<std::array<float, 8>> chromaticities{};

    const ExrInputChannel* channel(const std::string& wanted) const;
    /// Returns the text of an attribute, or "" if the part lacks it.
    std::string attribute(const std::string& wanted) const;
    /// Whether every pixel has a list of samples.
    bool deep() const {
        return type == "deepscanline" || type == "deeptile" || type == kListArrays;
    }
};

/// Returns the number at the beginning of an attribute's text, or 0 if the text does not begin with
/// a number.
template <class T>
T numberIn(const std::string& text) {
    T number{};
    std::from_chars(text.data(), text.data() + text.size(), number);
    return number;
}

/// Returns the shortest text that reads back as the same number.
template <class T>
std::string numberText(T number) {
    std::array<char, 32> text;
    const auto end = std::to_chars(text.data(), text.data() + text.size(), number).ptr;
    return {text.data(), end};
}

/// The destination of a channel's decoded values, converted to `type`: pixel (x, y) goes to first +
/// (x − window.x0)·size + (y − window.y0)·stride.
struct ExrTarget {
    std::string name;
    PixelType type = PixelType::kFloat;
    std::byte* first = nullptr;
    std::size_t stride = 0;  ///< bytes from the start of a row to the next
};

/// A block of a deep part: a row, or a tile at full resolution.
struct ExrDeepBlock {
    Window window;
    std::vector<std::uint32_t> counts;  ///< number of samples in each pixel, row-major
    /// The samples, ordered by row, then by channel (sorted by name), then by pixel.
    ByteBuffer samples;
};

class ExrClasses;

/// An open file. Its content is not trusted: sizes are checked against limits and against the
/// file's size before any allocation.
class ExrInput {
  public:
    explicit ExrInput(std::string path);
    ~ExrInput();
    ExrInput(const ExrInput&) = delete;
    ExrInput& operator=(const ExrInput&) = delete;

    const std::string& path() const { return path_; }
    std::uint64_t bytes() const { return bytes_; }
    const std::vector<ExrInputPart>& parts() const { return parts_; }
    /// Return the upper left corner of the first part's display window in the file's coordinates.
    /// The windows of parts() are relative to this corner.
    int originX() const { return origin_x_; }
    int originY() const { return origin_y_; }
    /// Returns all attributes in a part's header. Throws Error (kInput).
    std::vector<StoredAttribute> attributes(std::size_t part) const;

    /// Returns the rows per chunk of a flat part, or the rows per tile. The first chunk begins at
    /// the top of the data window.
    int rowsPerChunk(std::size_t part) const;
    /// Decodes the chunk, or row of tiles, that holds row `y` of a flat part. Stores those of its
    /// pixels that are inside `window`, which must lie in the data window. Thread-safe. Throws
    /// Error (kInput) with path and part as `where`.
    void readChunk(std::size_t part, int y, const Window& window,
                   std::span<const ExrTarget> targets) const;
    /// Decodes every chunk of a part and discards the pixels: all levels of flat tiles, but only
    /// the first level of deep tiles. Throws Error (kInput) at the first damaged chunk.
    void decodeAll(std::size_t part) const;

    /// Throws Error (kInput) if a chunk of a scan-line part lies outside the file. Reads only the
    /// chunk offsets.
    void checkChunks(std::size_t part) const;

    /// Returns the number of blocks in a deep part. Blocks are numbered row by row.
    std::size_t deepBlocks(std::size_t part) const;
    Window deepBlockWindow(std::size_t part, std::size_t block) const;
    /// Reads the sample counts of a block and, unless `counts_only`, the samples. Reuses the
    /// storage of `out`. Thread-safe. Throws Error (kInput) with path and part as `where`.
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
    std::unique_ptr<ExrClasses> classes_;  ///< null if no part needs them
};

}  // namespace peeler
