// SPDX-License-Identifier: Apache-2.0
#include "formats/exr/exr_compression.h"

#include <OpenEXR/ImfCompression.h>

#include <string>

#include "core/base/error.h"

namespace peeler {
namespace {

constexpr ExrCompression kCompressions[] = {
    {"zip", "16 rows at once; layered files' default", 16, false, Imf::ZIP_COMPRESSION},
    {"zips", "row by row; deep images' default", 1, true, Imf::ZIPS_COMPRESSION},
    {"rle", "run lengths: quicker and larger", 1, true, Imf::RLE_COMPRESSION},
    {"none", "as they are", 1, true, Imf::NO_COMPRESSION},
};

}  // namespace

std::span<const ExrCompression> exrCompressions() {
    return kCompressions;
}

const ExrCompression& findExrCompression(std::string_view name, bool deep) {
    std::string names;
    for (const ExrCompression& row : kCompressions) {
        if (deep && !row.deep) continue;
        if (name.empty() || row.name == name) return row;
        names += (names.empty() ? "" : ", ") + std::string(row.name);
    }
    throw Error(ErrorKind::kUsage,
                (deep ? "deep images cannot be compressed as \"" : "there is no compression \"") +
                    std::string(name) + "\"",
                "--compression", "choose one of: " + names);
}

}  // namespace peeler
