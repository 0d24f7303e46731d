// SPDX-License-Identifier: Apache-2.0
// The Draco-compressed primitives of a glTF file (KHR_draco_mesh_compression).
#pragma once

#include "formats/gltf/gltf_document.h"
#include "formats/gltf/gltf_reader.h"

namespace peeler {

/// Decodes all of them, in parallel, and lets their attributes and indices name new accessors with
/// the decoded numbers, so that whoever reads a primitive afterwards need not know. Primitives that
/// share data are decoded once. The compressed data goes before an uncompressed fallback, as the
/// extension asks of those who support it ("must process KHR_draco_mesh_compression first"); the
/// fallback is read, with a warning, where the compressed data is damaged and options.strict is
/// off. Decoded indices are of triangles even where the primitive was a strip.
/// Throws Error(kInput) that points to the extension object. What would come out is checked against
/// the accessors' counts and max_geometry_bytes before anything is decoded.
void decodeDracoPrimitives(GltfDocument& document, const GltfOptions& options);

}  // namespace peeler
