// SPDX-License-Identifier: Apache-2.0
#include "formats/layered_input.h"

#include "core/error.h"
#include "formats/exr_deep_reader.h"
#include "formats/exr_ldi_reader.h"
#include "formats/file_kind.h"

namespace peeler {

bool isLayered(const ExrInfo& info) {
    const auto layers = info.attributes().find("peeler:layers");
    return !info.layers.empty() || !info.deep.empty() ||
           (layers != info.attributes().end() && layers->second == "0");
}

std::unique_ptr<LayeredInput> openLayered(const std::string& path) {
    if (fileKind(path) == FileKind::kGltf) {
        throw Error(ErrorKind::kInput, "it is a scene, not an image", path,
                    "render it first: peeler render SCENE -o out.exr");
    }
    if (readExrInfo(path).deep.empty()) return std::make_unique<ExrLdiReader>(path);
    return std::make_unique<ExrDeepReader>(path);
}

}  // namespace peeler
