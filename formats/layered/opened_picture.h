// SPDX-License-Identifier: Apache-2.0
// The choice of the reader of a picture by the content of its file: OpenEXR or arrays.
#pragma once

#include <memory>
#include <string>

#include "formats/arrays/picture_arrays.h"
#include "formats/exr/exr_files.h"
#include "formats/exr/layered_input.h"

namespace peeler {

/// Whether a file is a picture by its content: OpenEXR, or arrays that are no scene. Throws Error
/// (kInput) if it cannot be read.
bool isPictureFile(const std::string& path);

/// An open picture with what its headers say, by which it is decided how to read it.
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
    std::unique_ptr<PictureArrays> arrays_;  ///< else
};

/// Opens layered files in any layout, deep files, layers in arrays, and flat pictures of other
/// programs as one layer. Throws Error (kInput) for what has no fragments to read (our own
/// composites, too), `where` naming path and part, and (kUsage) for a part or view that is not
/// there.
std::unique_ptr<LayeredInput> openLayered(const std::string& path,
                                          const LayeredReadOptions& options = {});
std::unique_ptr<LayeredInput> openLayered(OpenedPicture opened);
/// Opens a composite of ours as pixels: one entry in each, of Z = +inf where there is no fragment.
/// Of its layers the plan says their number alone. Throws Error (kInput) if it is none.
std::unique_ptr<LayeredInput> openComposite(OpenedPicture opened);

}  // namespace peeler
