// SPDX-License-Identifier: Apache-2.0
#include "formats/layered_input.h"

#include <limits>
#include <utility>

#include "core/error.h"
#include "formats/exr_deep_reader.h"
#include "formats/exr_ldi_reader.h"
#include "formats/file_kind.h"

namespace peeler {

void LayeredInput::countsToOffsets(std::vector<std::uint32_t>& counts, const std::string& path) {
    std::uint64_t total = 0;
    for (std::uint32_t& count : counts) {
        total += count;
        if (total > std::numeric_limits<std::uint32_t>::max()) {
            throw Error(ErrorKind::kMemory, "over 2^32 fragments in one band", path,
                        "read fewer rows at once");
        }
        count = static_cast<std::uint32_t>(total);
    }
}

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
    return openLayered(OpenedExr(path));
}

std::unique_ptr<LayeredInput> openLayered(OpenedExr opened) {
    if (opened.info.deep.empty()) return std::make_unique<ExrLdiReader>(std::move(opened));
    return std::make_unique<ExrDeepReader>(std::move(opened));
}

}  // namespace peeler
