// SPDX-License-Identifier: Apache-2.0
#include "formats/layered_input.h"

#include <algorithm>

#include "formats/exr_ldi_reader.h"

namespace peeler {

bool isLayered(const ExrInfo& info) {
    const auto layers = info.attributes().find("peeler:layers");
    return !info.layers.empty() || (layers != info.attributes().end() && layers->second == "0") ||
           std::ranges::any_of(
               info.parts, [](const ExrInputPart& part) { return part.type.starts_with("deep"); });
}

std::unique_ptr<LayeredInput> openLayered(const std::string& path) {
    return std::make_unique<ExrLdiReader>(path);
}

}  // namespace peeler
