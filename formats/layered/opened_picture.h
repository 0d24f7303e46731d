// SPDX-License-Identifier: Apache-2.0
// Choice of a picture's reader by file content: OpenEXR or arrays.
#pragma once

#include <memory>
#include <string>

#include "formats/arrays/picture_arrays.h"
#include "formats/exr/exr_files.h"
#include "formats/exr/layered_input.h"

namespace peeler {

/// Whether a file's content is a picture: OpenEXR, or arrays that are not a scene. Throws Error
/// (kInput) if it cannot be read.
bool isPictureFile(const std::string& path);

/// An open picture with its metadata, which decides how to read it.
class OpenedPicture {
  public:
    /// Throws like OpenedExr and PictureArrays.
    explicit OpenedPicture(const std::string& path, const LayeredReadOptions& options = {});

    const ExrInfo& info() const { return exr_ ? exr_->info : arrays_->info(); }
    bool isOfArrays() const { return arrays_ != nullptr; }

  private:
    friend std::unique_ptr<LayeredInput> openLayered(OpenedPicture opened);
    friend std::unique_ptr<LayeredInput> openComposite(OpenedPicture opened);

    std::unique_ptr<OpenedExr> exr_;
    std::unique_ptr<PictureArrays> arrays_;  ///< if exr_ is null
};

/// Opens layered files in any layout, deep files, layers in arrays, and flat pictures of other
/// programs as one layer. Throws Error (kInput) if there are no fragments to read (also for our own
/// composites), with path and part as `where`, and (kUsage) for a missing part or view.
std::unique_ptr<LayeredInput> openLayered(const std::string& path,
                                          const LayeredReadOptions& options = {});
std::unique_ptr<LayeredInput> openLayered(OpenedPicture opened);
/// Opens our composite as pixels: one entry per pixel, with Z = +inf where there is no fragment.
/// The plan has only the number of its layers. Throws Error (kInput) if it is not one.
std::unique_ptr<LayeredInput> openComposite(OpenedPicture opened);

}  // namespace peeler
