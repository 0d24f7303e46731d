// SPDX-License-Identifier: Apache-2.0
// OpenEXR headers: camera, colour space, provenance, and the names of ids as stored by OpenEXR 3.
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

/// An attribute with the provenance of a picture, or its stored contents.
struct PictureAttribute {
    std::string name;
    std::variant<std::string, int, double, Imf::Rational> value;

    /// Returns the value as in ExrInputPart::attributes.
    std::string text() const;
};

/// Returns the `peeler:` attributes, software and framesPerSecond, as in exrHeader().
std::vector<PictureAttribute> pictureAttributes(const Plan& plan, const Provenance& provenance,
                                                bool layers_known = true);

/// Returns a scan-line, ZIP-compressed header with every attribute (formats/README.md,
/// "Attributes") that is the same in all parts of a file; without channels, name or layer number.
///
/// - displayWindow is the full picture, dataWindow is `data_window`.
/// - worldToCamera and worldToNDC as ImfStandardAttributes.h defines them: row vectors (p' = p·M),
///   camera space left-handed with +z forward, NDC (0,0)–(1,1) = corners of the display window, y
///   down, after the division by w. NDC z is free by that definition; it is chosen to keep the
///   matrix invertible and finite: f(z − n)/(f − n) before the division by w = z for a perspective
///   camera, its limit z − n for an infinite far plane, and (z − n)/(f − n) for an orthographic
///   one.
/// - `near`, `far` (inf if unbounded), `orthographicWidth`, `orthographicHeight` in scene units;
///   `fieldOfViewHorizontal`, `fieldOfViewVertical` full angles in degrees. These names are not
///   OpenEXR's.
/// - screenWindowCenter (0,0); screenWindowWidth is the width of the picture at distance 1
///   (perspective) or in scene units (orthographic).
/// - `peeler:fragmentsCounted` and `peeler:fragmentsStored` are strings of decimal digits, since
///   they may exceed 32 bits; `peeler:layers`, `peeler:complete` and `peeler:frame` int;
///   `peeler:time` double; the rest strings, left out where empty.
/// - `peeler:cameraJson`: see cameraJson().
/// - No camera attributes if the camera is unknown (View::known), and no layer and fragment counts
///   unless `layers_known`. Nothing is erased later, since OpenEXR 3.1's Header::erase() never
///   frees the attribute.
/// - capDate (UTC) only if SOURCE_DATE_EPOCH is set.
Imf::Header exrHeader(const Plan& plan, const Provenance& provenance, const Window& data_window,
                      bool layers_known = true);

/// Adds the names for all id.object and id.material channels of any layer in the header (scheme
/// "id", not hashed, stable as long as the scene file is). Adds nothing without such channels. If
/// parents are known, objects have a second component, "parent": the parent's id as a number.
void addIdManifest(Imf::Header& header, const IdNames& names);

/// The inverse of addIdManifest(), from the attribute's bytes. Returns no names for missing
/// channels. Throws Error (kInput) if the bytes are damaged or implausible.
IdNames idNamesFromManifest(std::span<const std::byte> attribute);

}  // namespace peeler
