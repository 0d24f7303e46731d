// SPDX-License-Identifier: Apache-2.0
// What the headers of an OpenEXR file say about a picture: layers, camera, where it comes from.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "core/sink.h"
#include "formats/exr_input.h"

namespace peeler {

/// What the headers of an OpenEXR file say, layered or not.
struct ExrInfo {
    std::vector<ExrInputPart> parts;  ///< in the order of the file
    std::vector<std::size_t> layers;  ///< parts `layer_*`, front to back
    int composite = -1;               ///< the part `composite`, −1 = none
    std::uint64_t bytes = 0;          ///< of the file

    /// The plan that wrote the file, as far as it is known: windows always; the camera if there is
    /// a `peeler:cameraJson`, else the default one; `fragments_counted` and `fragments_stored` 0 if
    /// not written; `LayerPlan::pixels` never. `view.crop` holds all parts.
    Plan plan;
    Provenance provenance;   ///< empty where unknown
    bool is_peeler = false;  ///< has `peeler:version`
    /// The first part's `peeler:` attributes, software and the like, as text.
    const std::map<std::string, std::string>& attributes() const {
        return parts.front().attributes;
    }
};

/// Throws Error (kInput) if the file has no plausible parts.
ExrInfo describe(const ExrInput& input);

/// Reads headers only. Throws Error (kInput).
ExrInfo readExrInfo(const std::string& path);

}  // namespace peeler
