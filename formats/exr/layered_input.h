// SPDX-License-Identifier: Apache-2.0
// The interface of readers that return fragment lists, whatever the file format.
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
    std::uint64_t fragments = 0;  ///< number of fragments in the band's lists
    std::uint64_t bytes = 0;      ///< bytes needed for reading, in addition to the lists
    bool counted = false;         ///< whether `fragments` is exact, not a maximum
};

/// An open layered file. Its memory depends on the window being read, not on the size of the file.
class LayeredInput {
  public:
    virtual ~LayeredInput() = default;

    virtual const ExrInfo& info() const = 0;

    /// Reads the fragments of a window inside `info().plan.view.crop`: the whole crop, or a band
    /// for a Sink. Colours are half if they are half in every layer, else float. The extra channels
    /// are those of the first layer, sorted by name; channels with the same name up to the last dot
    /// (N.X, N.Y, N.Z) share an array. If a layer lacks a channel, its values are 0. Overwrites
    /// `out`, reusing its storage. Throws Error (kInput) if a chunk is damaged, Error (kMemory) if
    /// there are 2^32 fragments or more.
    virtual void read(const Window& window, LayeredImage& out) = 0;

    /// Reads the part `composite` as stored. Throws Error (kInput) if it is missing.
    virtual void readComposite(const Window& window, CompositeImage& out) = 0;

    /// Returns the warnings since the last call, about headers and about the data read so far.
    virtual std::vector<Text> takeWarnings() { return {}; }

    /// Returns the number of full-width rows for which read() needs about `bytes`, but at least the
    /// rows of one chunk.
    virtual int rowsFor(std::uint64_t bytes) const = 0;

    /// Returns the maximum cost of read() for any band of `rows` full-width rows, according to the
    /// headers or, for a deep file, to the sample counts.
    virtual BandRead mostOf(int rows) const = 0;

  protected:
    /// Converts the sample counts of all pixels, which follow a leading 0, to
    /// LayeredImage::offsets. Throws Error (kMemory) if the sum exceeds 32 bits.
    static void countsToOffsets(std::vector<std::uint32_t>& counts, const std::string& path);
};

/// Whether the headers describe a layered picture that openLayered() can read, with or without
/// fragments.
bool isLayered(const ExrInfo& info);
/// Whether the file is a composite by peeler, without its layers.
bool isLoneComposite(const ExrInfo& info);
/// Whether the headers describe ray bundles: several pictures, each a deep part with the bundle's
/// hits.
bool holdsBundles(const ExrInfo& info);

// Like openLayered() and openComposite() (formats/layered/opened_picture.h), but for OpenEXR files
// only.

std::unique_ptr<LayeredInput> openLayeredExr(OpenedExr opened);
std::unique_ptr<LayeredInput> openCompositeExr(OpenedExr opened);

}  // namespace peeler
