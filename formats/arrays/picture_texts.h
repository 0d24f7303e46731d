// SPDX-License-Identifier: Apache-2.0
// The metadata of pictures in array files: the attributes of an OpenEXR header. Attributes that are
// not strings are stored as JSON.
#pragma once

#include <map>
#include <string>
#include <utility>
#include <vector>

#include <peeler/sink.h>

namespace peeler {

using Texts = std::map<std::string, std::string>;
/// The names of the channel arrays, each with the names of its channels.
using ArrayChannels = std::vector<std::pair<std::string, std::vector<std::string>>>;

/// The name of the text that gives the picture's kind, and the two kinds.
inline constexpr const char* kPictureKind = "peeler:arrays";
inline constexpr const char* kLayersKind = "layers";
inline constexpr const char* kCompositeKind = "composite";

/// Returns the texts of a picture: kPictureKind; `displayWindow` [w, h] and `dataWindow` [x, y, w,
/// h] (the crop); pictureAttributes(); `peeler:ids` and `peeler:carried`; and `peeler:channels`,
/// which lists the channels of each array.
Texts pictureTexts(const char* kind, const Plan& plan, const Provenance& provenance,
                   const ArrayChannels& channels);

// The functions below parse the texts. They throw Error (kInput), naming `where` and the malformed
// text.

/// Returns the display window and the data window.
std::pair<Window, Window> windowsIn(const Texts& texts, const std::string& where);
/// Returns the channels of an array; empty if neither the file nor our table of array names lists
/// it.
std::vector<std::string> channelsIn(const Texts& texts, const std::string& array,
                                    const std::string& where);
IdNames idsIn(const Texts& texts, const std::string& where);
std::vector<StoredAttribute> carriedIn(const Texts& texts, bool camera_known,
                                       const std::string& where);
/// Returns the remaining texts: the attributes, as in ExrInputPart.
Texts attributesIn(const Texts& texts);

}  // namespace peeler
