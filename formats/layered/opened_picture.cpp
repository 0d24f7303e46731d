// SPDX-License-Identifier: Apache-2.0
#include "formats/layered/opened_picture.h"

#include <utility>

#include "formats/arrays/safetensors.h"
#include "formats/file/file_name.h"
#include "formats/file/regular_file.h"

namespace peeler {

bool isPictureFile(const std::string& path) {
    const FileKind kind = fileKind(path);
    if (kind != FileKind::kSafetensors) return kind == FileKind::kExr;
    return !readSafetensors(RegularFile(path), path).find("vertices");
}

OpenedPicture::OpenedPicture(const std::string& path, const LayeredReadOptions& options) {
    if (fileKind(path) == FileKind::kSafetensors)
        arrays_ = std::make_unique<PictureArrays>(path, options);
    else
        exr_ = std::make_unique<OpenedExr>(path, options);
}

std::unique_ptr<LayeredInput> openLayered(const std::string& path,
                                          const LayeredReadOptions& options) {
    return openLayered(OpenedPicture(path, options));
}

std::unique_ptr<LayeredInput> openLayered(OpenedPicture opened) {
    if (opened.arrays_) return openArrays(std::move(opened.arrays_));
    return openLayeredExr(std::move(*opened.exr_));
}

std::unique_ptr<LayeredInput> openComposite(OpenedPicture opened) {
    if (opened.arrays_) return openArrays(std::move(opened.arrays_), true);
    return openCompositeExr(std::move(*opened.exr_));
}

}  // namespace peeler
