// SPDX-License-Identifier: Apache-2.0
// What files of arrays say of a picture: the texts that an OpenEXR header has as attributes, and,
// as JSON, what has types of its own there.
#pragma once

#include <map>
#include <string>
#include <utility>
#include <vector>

#include <peeler/sink.h>

namespace peeler {

using Texts = std::map<std::string, std::string>;
/// The arrays of channels by name, and the channels of each.
using ArrayChannels = std::vector<std::pair<std::string, std::vector<std::string>>>;

/// The text that says what the file is, and its values.
inline constexpr const char* kPictureKind = "peeler:arrays";
inline constexpr const char* kLayersKind = "layers";
inline constexpr const char* kCompositeKind = "composite";

/// The texts of a picture: kPictureKind; `displayWindow` [w, h] and `dataWindow` [x, y, w, h] (the
/// crop); pictureAttributes(); `peeler:ids`, `peeler:carried`; and `peeler:channels`, those of
/// every array by its name.
Texts pictureTexts(const char* kind, const Plan& plan, const Provenance& provenance,
                   const ArrayChannels& channels);

// Their inverses. Throw Error (kInput), naming `where` and the text.

/// Display window and data window.
std::pair<Window, Window> windowsIn(const Texts& texts, const std::string& where);
/// The channels of an array; none if nothing is said of it and its name is none of the table.
std::vector<std::string> channelsIn(const Texts& texts, const std::string& array,
                                    const std::string& where);
IdNames idsIn(const Texts& texts, const std::string& where);
std::vector<StoredAttribute> carriedIn(const Texts& texts, bool camera_known,
                                       const std::string& where);
/// What is left: the attributes as ExrInputPart has them.
Texts attributesIn(const Texts& texts);

}  // namespace peeler
