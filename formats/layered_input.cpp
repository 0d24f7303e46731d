// SPDX-License-Identifier: Apache-2.0
#include "formats/layered_input.h"

#include "formats/exr_ldi_reader.h"

namespace peeler {

std::unique_ptr<LayeredInput> openLayered(const std::string& path) {
    return std::make_unique<ExrLdiReader>(path);
}

}  // namespace peeler
