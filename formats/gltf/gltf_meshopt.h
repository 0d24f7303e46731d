// SPDX-License-Identifier: Apache-2.0
// The meshopt-compressed buffer views of a glTF file.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <vector>

#include "core/base/error.h"
#include "formats/gltf/gltf_document.h"

namespace peeler {

/// Does the buffer say that it is only a place for decompressed data? Then it is not loaded, even
/// if it has a URI, unless the compressed data turns out to be damaged.
bool isMeshoptFallback(const nlohmann::json& buffer);

/// A buffer view that could not be decoded, and why; `error` points to its extension object.
struct MeshoptProblem {
    std::size_t view;
    Error error;
};

/// Decodes all compressed ones of `buffer_views` (which have passed checkGltfSchema) into
/// `decoded_views` of the document, in parallel. All sizes together are checked against
/// max_geometry_bytes before anything is allocated. The result lists the failures by view.
std::vector<MeshoptProblem> decodeMeshoptViews(const nlohmann::json& buffer_views,
                                               GltfDocument& document, const GltfOptions& options);

}  // namespace peeler
