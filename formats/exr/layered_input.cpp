// SPDX-License-Identifier: Apache-2.0
// Choice of the reader for a file by its headers.
#include "formats/exr/layered_input.h"

#include <limits>
#include <optional>
#include <utility>

#include <peeler/error.h>
#include "formats/exr/exr_readers.h"

namespace peeler {

void LayeredInput::countsToOffsets(std::vector<std::uint32_t>& counts, const std::string& path) {
    std::uint64_t total = 0;
    for (std::uint32_t& count : counts) {
        total += count;
        if (total > std::numeric_limits<std::uint32_t>::max()) {
            throw Error(ErrorKind::kMemory, "a band has more than 2^32 fragments", path,
                        "read fewer rows at once");
        }
        count = static_cast<std::uint32_t>(total);
    }
}

bool holdsBundles(const ExrInfo& info) {
    return info.deep.size() > 1 &&
           info.parts[info.deep.front()].attributes.contains("peeler:bundle");
}

bool isLayered(const ExrInfo& info) {
    if (holdsBundles(info)) return false;
    const auto layers = info.attributes().find("peeler:layers");
    return !info.layers.empty() || !info.deep.empty() ||
           (layers != info.attributes().end() && layers->second == "0");
}

bool isLoneComposite(const ExrInfo& info) {
    return info.is_peeler && info.composite >= 0 && !isLayered(info);
}

std::unique_ptr<LayeredInput> openLayeredExr(OpenedExr opened) {
    const bool chooses = opened.options.choosesPicture();
    if (holdsBundles(opened.info) && !chooses) {
        throw Error(ErrorKind::kInput,
                    "the file holds the hits of " + std::to_string(opened.info.deep.size()) +
                        " bundles of rays, not one picture",
                    opened.files.path(), "trace one bundle into a file, or read it with OpenEXR");
    }
    const bool layers = isLayered(opened.info) && opened.info.deep.empty();
    if ((layers || isLoneComposite(opened.info)) && !chooses)
        return std::make_unique<ExrLdiReader>(std::move(opened));
    const ExrPicture picture = choosePicture(opened);
    if (opened.info.deep.empty()) return std::make_unique<ExrLdiReader>(std::move(opened), picture);
    return std::make_unique<ExrDeepReader>(std::move(opened), picture);
}

std::unique_ptr<LayeredInput> openCompositeExr(OpenedExr opened) {
    return std::make_unique<ExrLdiReader>(std::move(opened), std::nullopt, true);
}

}  // namespace peeler
