// SPDX-License-Identifier: Apache-2.0
// Lookup of a picture's arrays in the header of an array file.
#include "formats/arrays/picture_arrays.h"

#include <algorithm>
#include <cstdlib>
#include <set>
#include <tuple>
#include <utility>

#include <peeler/channels.h>
#include <peeler/error.h>
#include "core/base/printable.h"
#include "formats/arrays/array_reader.h"
#include "formats/arrays/picture_texts.h"

namespace peeler {
namespace {

constexpr const char* kNoPicture = "the file holds arrays, but no picture";

PixelType pixelTypeOf(const SafetensorsArray& array) {
    return array.type == "F16"   ? PixelType::kHalf
           : array.type == "F32" ? PixelType::kFloat
                                 : PixelType::kUint;
}

}  // namespace

PictureArrays::PictureArrays(const std::string& path, const LayeredReadOptions& read)
    : options(read),
      warnings(read.strict, path),
      path_(path),
      file_(path),
      header_(readSafetensors(file_, path)) {
    const std::string kind = header_.text(kPictureKind);
    composite_ = kind == kCompositeKind;
    if (!composite_ && kind != kLayersKind && !header_.find("splits"))
        throw Error(ErrorKind::kInput, kNoPicture, path,
                    "write layers with " + Parameter::kAs + " layers, which sets " +
                        std::string(kPictureKind));
    std::tie(display_, data_) = windowsIn(header_.metadata, path);
    if (data_.empty() || data_.width() > kMostImageSide || data_.height() > kMostImageSide ||
        display_.empty() ||
        std::max({std::abs(data_.x0), std::abs(data_.y0), std::abs(data_.x1), std::abs(data_.y1),
                  display_.x1, display_.y1}) > kMostCoordinate)
        fail("the display or data window is implausible");
    if (composite_)
        takeComposite();
    else
        takeFragments();
    describePart();
}

void PictureArrays::fail(const std::string& what, const std::string& array) const {
    throw Error(ErrorKind::kInput, what, array.empty() ? path_ : path_ + ": " + printable(array),
                "formats/README.md, \"Pictures as arrays\", has names, shapes and types");
}

const SafetensorsArray* PictureArrays::take(const char* name,
                                            const std::vector<std::uint64_t>& shape,
                                            const std::vector<std::string>& types,
                                            bool required) const {
    const SafetensorsArray* const array = header_.find(name);
    if (!array && !required) return nullptr;
    if (!array) fail("an array is missing", name);
    if (array->shape != shape)
        fail("the array has the shape " + shapeText(array->shape) + ", not " + shapeText(shape),
             name);
    if (std::ranges::find(types, array->type) == types.end())
        fail("the array is of the type " + printable(array->type) + ", not " + types.front(), name);
    return array;
}

void PictureArrays::takeFragments() {
    splits = take("splits", {data_.pixels() + 1}, {"I64", "I32", "U32", "U64"});
    const SafetensorsArray* const depths = header_.find("z");
    const std::uint64_t n = depths && !depths->shape.empty() ? depths->shape.front() : 0;
    z = take("z", {n}, {"F32"});
    rgba = take("rgba", {n, kPlainComponents}, {"F16", "F32"});
    opacity = take("opacity", {n, kTintedComponents - kPlainComponents}, {rgba->type}, false);
    for (const SafetensorsArray& array : header_.arrays) {
        const bool known = &array == splits || &array == z || &array == rgba || &array == opacity ||
                           array.name == "arrays_version";
        if (!known) takeExtra(array);
    }
    std::ranges::sort(extra, {}, [](const ExtraArray& array) { return array.like.channels; });
    std::set<std::string> names{"Z"};
    names.insert(kColorNames.begin(), kColorNames.end());
    for (const ExtraArray& array : extra)
        for (const std::string& channel : array.like.channels)
            if (!names.insert(channel).second) fail("two arrays have the same channel", channel);
}

/// Records a channel array other than colour and Z.
void PictureArrays::takeExtra(const SafetensorsArray& array) {
    const std::uint64_t n = z->shape.front();
    const bool fits = (array.shape.size() == 1 || array.shape.size() == 2) &&
                      array.shape.front() == n &&
                      (array.type == "F16" || array.type == "F32" || array.type == "U32");
    if (!fits)
        return warnings.warn(
            "The array \"" + array.name +
            "\" is ignored: it must hold floats of 16 or 32 bits, or unsigned integers "
            "of 32 bits, for every fragment.");
    const std::size_t components = array.shape.size() == 1 ? 1 : array.shape[1];
    std::vector<std::string> channels = channelsIn(header_.metadata, array.name, path_);
    if (channels.empty() && components == 1) channels = {array.name};
    if (channels.size() != components || components == 0)
        fail("peeler:channels does not name the " + std::to_string(components) +
                 " channels of the array",
             array.name);
    extra.push_back({{std::move(channels), pixelTypeOf(array), {}}, &array});
}

void PictureArrays::takeComposite() {
    const auto h = static_cast<std::uint64_t>(data_.height()),
               w = static_cast<std::uint64_t>(data_.width());
    z = take("z", {h, w}, {"F32"});
    rgba = take("rgba", {h, w, kPlainComponents}, {"F32"});
    opacity = take("opacity", {h, w, kTintedComponents - kPlainComponents}, {"F32"}, false);
}

/// Describes the arrays as one part, for code that reads OpenEXR headers.
void PictureArrays::describePart() {
    ExrInputPart part;
    part.name = composite_ ? "composite" : "";
    part.type = composite_ ? kPlaneArrays : kListArrays;
    part.compression = "none";
    part.data_window = data_;
    part.display_window = display_;
    part.attributes = attributesIn(header_.metadata);
    // With 0 layers, a composite would look like an empty layered picture.
    if (const auto layers = part.attributes.find("peeler:layers");
        composite_ && layers != part.attributes.end() && layers->second == "0")
        part.attributes.erase(layers);
    part.channels.push_back({"Z", PixelType::kFloat});
    for (const std::string& name : colorNames(opacity != nullptr))
        part.channels.push_back({name, pixelTypeOf(*rgba)});
    for (const ExtraArray& array : extra)
        for (const std::string& name : array.like.channels)
            part.channels.push_back({name, array.like.type});
    std::ranges::sort(part.channels, {}, &ExrInputChannel::name);
    info_ = describe({std::move(part)}, file_.size(), path_);
    info_.provenance.ids = idsIn(header_.metadata, path_);
    info_.provenance.carried = carriedIn(header_.metadata, info_.plan.view.known, path_);
}

}  // namespace peeler
