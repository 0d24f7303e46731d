// SPDX-License-Identifier: Apache-2.0
// Opened pictures, OpenEXR or arrays.
#pragma once

#include <memory>
#include <string>

#include "formats/arrays/picture_arrays.h"
#include "formats/exr/exr_files.h"
#include "formats/exr/layered_input.h"

namespace peeler {

/// Whether a file's content is a picture: OpenEXR, or arrays that are not a scene. Throws Error
/// (kInput) if the file cannot be read.
bool isPictureFile(const std::string& path);

/// An open picture with its metadata. The file's content determines the reader.
class OpenedPicture {
  public:
    /// Throws the errors of OpenedExr and PictureArrays.
    explicit OpenedPicture(const std::string& path, const LayeredReadOptions& options = {});

    const ExrInfo& info() const { return exr_ ? exr_->info : arrays_->info(); }
    bool isOfArrays() const { return arrays_ != nullptr; }

  private:
    friend std::unique_ptr<LayeredInput> openLayered(OpenedPicture opened);
    friend std::unique_ptr<LayeredInput> openComposite(OpenedPicture opened);

    std::unique_ptr<OpenedExr> exr_;
    std::unique_ptr<PictureArrays> arrays_;  ///< null if exr_ is set
};

/// Open layered files in any layout, deep files, layers in arrays, and flat pictures of other
/// programs as one layer. Throw Error (kInput), with path and part as `where`, if there are no
/// fragments to read (as in a composite by peeler), Error (kUsage) if the options choose a part or
/// view that does not exist.
std::unique_ptr<LayeredInput> openLayered(const std::string& path,
                                          const LayeredReadOptions& options = {});
std::unique_ptr<LayeredInput> openLayered(OpenedPicture opened);
/// Opens a composite by peeler as pixels: one entry per pixel, with Z = +inf where there is no
/// fragment. The plan has the number of layers, but not the layers' windows. Throws Error (kInput)
/// if the picture is not a composite by peeler.
std::unique_ptr<LayeredInput> openComposite(OpenedPicture opened);

}  // namespace peeler
