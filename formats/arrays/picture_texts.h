// SPDX-License-Identifier: Apache-2.0
// The metadata of pictures in array files: an OpenEXR header's text attributes, and its typed
// attributes as JSON.
#pragma once

#include <map>
#include <string>
#include <utility>
#include <vector>

#include <peeler/sink.h>

namespace peeler {

using Texts = std::map<std::string, std::string>;
/// Channel arrays by name, and the channels of each.
using ArrayChannels = std::vector<std::pair<std::string, std::vector<std::string>>>;

/// The key of the file's kind, and its values.
inline constexpr const char* kPictureKind = "peeler:arrays";
inline constexpr const char* kLayersKind = "layers";
inline constexpr const char* kCompositeKind = "composite";

/// Returns the texts of a picture: kPictureKind; `displayWindow` [w, h] and `dataWindow` [x, y, w,
/// h] (the crop); pictureAttributes(); `peeler:ids`, `peeler:carried`; and `peeler:channels`, the
/// channels of every array by name.
Texts pictureTexts(const char* kind, const Plan& plan, const Provenance& provenance,
                   const ArrayChannels& channels);

// The inverses. They throw Error (kInput), naming `where` and the text, if it is malformed.

/// Returns the display window and the data window.
std::pair<Window, Window> windowsIn(const Texts& texts, const std::string& where);
/// Returns the channels of an array; empty if the file does not list them and the array's name is
/// not in the table.
std::vector<std::string> channelsIn(const Texts& texts, const std::string& array,
                                    const std::string& where);
IdNames idsIn(const Texts& texts, const std::string& where);
std::vector<StoredAttribute> carriedIn(const Texts& texts, bool camera_known,
                                       const std::string& where);
/// Returns the remaining texts: the attributes as in ExrInputPart.
Texts attributesIn(const Texts& texts);

}  // namespace peeler
