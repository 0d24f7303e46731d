// SPDX-License-Identifier: Apache-2.0
// The interface of readers that return fragment lists, for any file format.
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

/// The cost of reading a band.
struct BandRead {
    std::uint64_t fragments = 0;  ///< in its lists
    std::uint64_t bytes = 0;      ///< besides the lists, until they are read
    bool counted = false;         ///< the fragment count is exact
};

/// An open layered file. Memory grows with the window being read, not with the file.
class LayeredInput {
  public:
    virtual ~LayeredInput() = default;

    virtual const ExrInfo& info() const = 0;

    /// Reads the fragments of a window inside `info().plan.view.crop`: all of it, or a band for a
    /// Sink. Colours are half if they are half in every layer, else float. Other channels follow:
    /// those of the first layer, names that agree up to the last dot (N.X, N.Y, N.Z) in one array,
    /// sorted by name; 0 for a layer that lacks one. Overwrites `out`, reusing its storage. Throws
    /// Error (kInput) if a chunk is damaged, (kMemory) if there are over 2^32 fragments.
    virtual void read(const Window& window, LayeredImage& out) = 0;

    /// Reads the part `composite` as stored. Throws Error (kInput) if it is missing.
    virtual void readComposite(const Window& window, CompositeImage& out) = 0;

    /// Returns the warnings since the last call: about headers, and about data read so far.
    virtual std::vector<Text> takeWarnings() { return {}; }

    /// Returns the number of full-width rows for which read() takes about `bytes`, at least one
    /// chunk's.
    virtual int rowsFor(std::uint64_t bytes) const = 0;

    /// Returns the maximum cost of read() for any band of `rows` full-width rows: as far as the
    /// headers show, or the counts of a deep file.
    virtual BandRead mostOf(int rows) const = 0;

  protected:
    /// Turns the counts of the pixels, after a leading 0, into LayeredImage::offsets. Throws Error
    /// (kMemory) if they do not fit 32 bits.
    static void countsToOffsets(std::vector<std::uint32_t>& counts, const std::string& path);
};

/// Whether the headers describe fragments that openLayered() can read, even those of an empty
/// picture.
bool isLayered(const ExrInfo& info);
/// Whether it is our composite without any layers stored.
bool isLoneComposite(const ExrInfo& info);
/// Whether the headers describe several pictures: hits of ray bundles, one deep part each.
bool holdsBundles(const ExrInfo& info);

// For OpenEXR files; formats/layered/opened_picture.h has the contract, and opens other files too.

std::unique_ptr<LayeredInput> openLayeredExr(OpenedExr opened);
std::unique_ptr<LayeredInput> openCompositeExr(OpenedExr opened);

}  // namespace peeler
