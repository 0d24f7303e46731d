// SPDX-License-Identifier: Apache-2.0
// Reading of all fragments of a layered file.
#pragma once

#include <filesystem>

#include "formats/layered/opened_picture.h"

namespace peeler::test {

inline LayeredImage readAll(const std::filesystem::path& path) {
    const auto reader = openLayered(path);
    LayeredImage image;
    reader->read(reader->info().plan.view.crop, image);
    return image;
}

}  // namespace peeler::test
