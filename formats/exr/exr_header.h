// SPDX-License-Identifier: Apache-2.0
// OpenEXR headers: the camera, the colour space, where the picture comes from, and the names of ids
// as OpenEXR 3 stores them.
#pragma once

#include <OpenEXR/ImfHeader.h>
#include <OpenEXR/ImfRational.h>

#include <cstddef>
#include <span>
#include <string>
#include <variant>
#include <vector>

#include <peeler/scene.h>
#include <peeler/sink.h>
#include "formats/exr/exr_files.h"

namespace peeler {

/// An attribute that says where a picture comes from, or how much of it is stored.
struct PictureAttribute {
    std::string name;
    std::variant<std::string, int, double, Imf::Rational> value;

    /// The value as ExrInputPart::attributes has it.
    std::string text() const;
};

/// The `peeler:` attributes, software and framesPerSecond, as exrHeader() has them.
std::vector<PictureAttribute> pictureAttributes(const Plan& plan, const Provenance& provenance,
                                                bool layers_known = true);

/// A scan-line, ZIP-compressed header with every attribute (formats/README.md, "Attributes") that
/// is the same in all parts of a file; no channels, name or layer number yet.
///
/// - displayWindow is the full picture, dataWindow is `data_window`.
/// - worldToCamera and worldToNDC as ImfStandardAttributes.h defines them: row vectors (p' = p·M),
///   camera space left-handed with +z forward, NDC (0,0)–(1,1) = corners of the display window, y
///   down, after the division by w. NDC z is free by that definition; it is chosen to keep the
///   matrix invertible and finite: f(z − n)/(f − n) before the division by w = z for a perspective
///   camera, its limit z − n for an infinite far plane, and (z − n)/(f − n) for an orthographic
///   one.
/// - `near`, `far` (inf where there is none), `orthographicWidth`, `orthographicHeight` in scene
///   units; `fieldOfViewHorizontal`, `fieldOfViewVertical` full angles in degrees. These names are
///   not OpenEXR's.
/// - screenWindowCenter (0,0); screenWindowWidth is the width of the picture at distance 1
///   (perspective) or in scene units (orthographic).
/// - `peeler:fragmentsCounted` and `peeler:fragmentsStored` are strings of decimal digits, since
///   they may exceed 32 bits; `peeler:layers`, `peeler:complete` and `peeler:frame` int;
///   `peeler:time` double; the rest strings, left out where empty.
/// - `peeler:cameraJson`: see cameraJson().
/// - Nothing of the camera if it is not known (View::known), nor of how many layers and fragments
///   there are unless `layers_known`. What is in a header stays: OpenEXR 3.1's Header::erase()
///   never frees the attribute.
/// - capDate (UTC) only if SOURCE_DATE_EPOCH is set.
Imf::Header exrHeader(const Plan& plan, const Provenance& provenance, const Window& data_window,
                      bool layers_known = true);

/// Adds the names of those channels of the header that are an id.object or id.material of some
/// layer (scheme "id", not hashed, stable as long as the scene file is); nothing if there are none.
/// Where parents are known objects have a second component, "parent": that one's id as a number.
void addIdManifest(Imf::Header& header, const IdNames& names);

/// The inverse of addIdManifest(), from the bytes of the attribute. No names for channels that are
/// not there. Throws Error (kInput) if the bytes are damaged or implausible.
IdNames idNamesFromManifest(std::span<const std::byte> attribute);

}  // namespace peeler
