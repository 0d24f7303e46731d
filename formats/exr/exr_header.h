// SPDX-License-Identifier: Apache-2.0
// OpenEXR headers: camera, colour space, provenance, and the names of ids in OpenEXR 3's
// idManifest.
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

/// An attribute that records a picture's provenance or content.
struct PictureAttribute {
    std::string name;
    std::variant<std::string, int, double, Imf::Rational> value;

    /// Returns the value as in ExrInputPart::attributes.
    std::string text() const;
};

/// Returns the `peeler:` attributes, software and framesPerSecond, as exrHeader() stores them.
std::vector<PictureAttribute> pictureAttributes(const Plan& plan, const Provenance& provenance,
                                                bool layers_known = true);

/// Returns a scan-line, ZIP-compressed header with every attribute (formats/README.md,
/// "Attributes") that is the same in all parts of a file. It has no channels, name or layer number.
///
/// - displayWindow is the full picture, dataWindow is `data_window`.
/// - worldToCamera and worldToNDC are as ImfStandardAttributes.h defines them: for row vectors
///   (p' = p·M), with a left-handed camera space (+z forward), and NDC from (0,0) to (1,1) at the
///   corners of the display window, y down, after the division by w. OpenEXR does not define NDC z.
///   Here it keeps the matrix invertible and finite: f(z − n)/(f − n) before the division by w = z
///   for a perspective camera, its limit z − n for an infinite far plane, and (z − n)/(f − n) for
///   an orthographic camera.
/// - `near`, `far` (inf if unbounded), `orthographicWidth` and `orthographicHeight` are in scene
///   units; `fieldOfViewHorizontal` and `fieldOfViewVertical` are full angles in degrees. These
///   names are peeler's, not OpenEXR's.
/// - screenWindowCenter is (0,0); screenWindowWidth is the width of the picture at distance 1
///   (perspective) or in scene units (orthographic).
/// - `peeler:fragmentsCounted` and `peeler:fragmentsStored` are strings of decimal digits, since
///   they may exceed 32 bits. `peeler:layers`, `peeler:complete`, `peeler:samples`, `peeler:frame`
///   and `peeler:view` are int, `peeler:time` is double. All other `peeler:` attributes are
///   strings, left out if empty.
/// - `peeler:cameraJson`: see cameraJson().
/// - A lens has neither worldToNDC nor field of view, and screenWindowWidth 1.
/// - There are no camera attributes if the camera is unknown (View::known), a moving one or a list
///   of rays (only `peeler:projection` and `peeler:depth`), and no layer and
///   fragment counts unless `layers_known`. (Header::erase() of OpenEXR 3.1 never frees an
///   attribute, so erasing them afterwards would leak memory.)
/// - capDate (UTC) is set only if SOURCE_DATE_EPOCH is.
Imf::Header exrHeader(const Plan& plan, const Provenance& provenance, const Window& data_window,
                      bool layers_known = true);

/// Adds an idManifest with the names of the ids in all channels id.object and id.material of the
/// header, in any layer. The scheme is "id", not hashed; the lifetime is "stable", since the ids
/// change only with the scene file. Adds nothing if there are no such channels. If parents are
/// known, objects have a second component, "parent": the parent's id as a number.
void addIdManifest(Imf::Header& header, const IdNames& names);

/// The inverse of addIdManifest(): reads the attribute's bytes. Returns no names for channels that
/// the manifest lacks. Throws Error (kInput) if the bytes are damaged or implausible.
IdNames idNamesFromManifest(std::span<const std::byte> attribute);

}  // namespace peeler
