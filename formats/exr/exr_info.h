// SPDX-License-Identifier: Apache-2.0
// What the headers of an OpenEXR file say about a picture: layers, camera, where it comes from.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "core/image/sink.h"
#include "formats/exr/exr_files.h"

namespace peeler {

/// What the headers of an OpenEXR picture say, layered, deep or flat.
struct ExrInfo {
    std::vector<ExrInputPart> parts;  ///< in the order of the file, then of the files of a set
    /// Of each layer, front to back, the part it is in; empty for deep and flat files. How many
    /// layers a picture has, whatever holds them, an open LayeredInput tells: plan.layers.size().
    std::vector<std::size_t> layers;
    std::vector<std::string> prefixes;  ///< of each layer's channels in its part: "", "layer_000."
    int composite = -1;                 ///< the part with the composite, −1 = none
    std::vector<std::size_t> deep;      ///< parts with deep samples
    std::uint64_t bytes = 0;            ///< of the file, or of all files of a set

    /// The plan that wrote the file, as far as it is known: windows always; the camera if there is
    /// a `peeler:cameraJson`, else the default one; `fragments_counted` and `fragments_stored` 0 if
    /// not written; `LayerPlan::pixels` never; the layers of a deep file only if a LayeredInput
    /// has it open. `view.crop` holds all parts.
    Plan plan;
    Provenance provenance;         ///< empty where unknown
    bool has_cryptomatte = false;  ///< in its composite
    bool is_peeler = false;        ///< has `peeler:version`
    /// The first part's `peeler:` attributes, software and the like, as text.
    const std::map<std::string, std::string>& attributes() const {
        return parts.front().attributes;
    }
};

/// Throws Error (kInput) if the picture has no plausible parts.
ExrInfo describe(const ExrFiles& files);

/// An open picture with what its headers say, for whoever decides by them how to read it.
struct OpenedExr {
    /// Throws like ExrFiles and describe(), and Error (kInput) with what to do if it is a scene.
    explicit OpenedExr(const std::string& path);

    ExrFiles files;
    ExrInfo info;
};

/// Reads headers only. Throws Error (kInput).
ExrInfo readExrInfo(const std::string& path);

}  // namespace peeler
