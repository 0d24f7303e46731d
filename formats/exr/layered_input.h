// SPDX-License-Identifier: Apache-2.0
// A file that is read back as fragment lists, whatever holds them.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include <peeler/composite.h>
#include <peeler/layered_image.h>
#include <peeler/text.h>
#include "formats/exr/exr_files.h"

namespace peeler {

/// What reading a band takes.
struct BandRead {
    std::uint64_t fragments = 0;  ///< in its lists
    std::uint64_t bytes = 0;      ///< besides the lists, until they are read
    bool counted = false;         ///< the fragments are those that are there
};

/// An open layered file. Memory grows with the window that is read, not with the file.
class LayeredInput {
  public:
    virtual ~LayeredInput() = default;

    virtual const ExrInfo& info() const = 0;

    /// The fragments of a window inside `info().plan.view.crop`, which may be all of it, or a band
    /// for a Sink. Colours are half if they are half in every layer, else float. Other channels
    /// come after them: those of the first layer, names that agree up to the last dot (N.X, N.Y,
    /// N.Z) in one array, sorted by name; a layer that lacks one has 0. Overwrites `out`, reuses
    /// its storage. Throws Error (kInput) if a chunk is damaged, (kMemory) if there are over 2^32
    /// fragments.
    virtual void read(const Window& window, LayeredImage& out) = 0;

    /// The part `composite` as it is stored. Throws Error (kInput) if there is none.
    virtual void readComposite(const Window& window, CompositeImage& out) = 0;

    /// The warnings that have come since it was last called: of headers, and of what has been read.
    virtual std::vector<Text> takeWarnings() { return {}; }

    /// Rows of full width whose read() takes about `bytes`, at least one chunk's.
    virtual int rowsFor(std::uint64_t bytes) const = 0;

    /// What read() of so many rows of full width comes to at most, wherever they are among rows
    /// that are read so many at a time: as far as the headers tell, or the counts of a deep file.
    virtual BandRead mostOf(int rows) const = 0;

  protected:
    /// Turns the counts of the pixels, after a leading 0, into LayeredImage::offsets. Throws Error
    /// (kMemory) if they do not fit 32 bits.
    static void countsToOffsets(std::vector<std::uint32_t>& counts, const std::string& path);
};

/// Whether the headers promise fragments that openLayered() can read, be it those of an empty
/// picture.
bool isLayered(const ExrInfo& info);
/// Whether it is a composite of ours whose layers are nowhere.
bool isLoneComposite(const ExrInfo& info);
/// Whether the headers promise several pictures: the hits of bundles of rays, a deep part each.
bool holdsBundles(const ExrInfo& info);

// Of OpenEXR files; formats/layered/opened_picture.h says of what, and opens other files, too.

std::unique_ptr<LayeredInput> openLayeredExr(OpenedExr opened);
std::unique_ptr<LayeredInput> openCompositeExr(OpenedExr opened);

}  // namespace peeler
