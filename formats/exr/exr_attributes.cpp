// SPDX-License-Identifier: Apache-2.0
#include "formats/exr/exr_attributes.h"

#include <OpenEXR/ImfIO.h>
#include <OpenEXR/ImfOpaqueAttribute.h>
#include <OpenEXR/ImfVersion.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <exception>
#include <memory>
#include <new>
#include <string_view>
#include <vector>

#include <peeler/error.h>

namespace peeler {
namespace {

/// Attributes that describe a part's storage, and attributes that peeler always sets. ("Standard
/// Attributes", openexr.com/en/latest/StandardAttributes.html.)
constexpr std::string_view kOfStorage[] = {"channels",
                                           "chunkCount",
                                           "compression",
                                           "dataWindow",
                                           "deepImageState",
                                           "displayWindow",
                                           "dwaCompressionLevel",
                                           "framesPerSecond",
                                           "idManifest",
                                           "lineOrder",
                                           "maxSamplesPerPixel",
                                           "multiView",
                                           "name",
                                           "preview",
                                           "Software",
                                           "software",
                                           "tiles",
                                           "type",
                                           "version",
                                           "view",
                                           "zipCompressionLevel"};
/// Attributes that are derived from the camera if the camera is known.
constexpr std::string_view kOfView[] = {"far",
                                        "fieldOfViewHorizontal",
                                        "fieldOfViewVertical",
                                        "near",
                                        "orthographicHeight",
                                        "orthographicWidth",
                                        "pixelAspectRatio",
                                        "screenWindowCenter",
                                        "screenWindowWidth",
                                        "worldToCamera",
                                        "worldToNDC"};
/// Attributes of the date: a file by peeler has its own date, or none.
constexpr std::string_view kOfOurs[] = {"capDate", "utcOffset"};

template <std::size_t n>
bool isOneOf(const std::string_view (&names)[n], std::string_view name) {
    return std::ranges::find(names, name) != std::end(names);
}

/// An input stream over an attribute's bytes, for OpenEXR's classes.
class ValueStream final : public Imf::IStream {
  public:
    explicit ValueStream(const std::vector<std::byte>& bytes)
        : IStream("an attribute"), bytes_(bytes) {}
    bool read(char* to, int count) override {
        const auto wanted = static_cast<std::size_t>(count);
        if (wanted > bytes_.size() - place_)
            throw Error(ErrorKind::kInput, "the attribute ends too early");
        if (wanted > 0) std::memcpy(to, bytes_.data() + place_, wanted);
        place_ += wanted;
        return place_ < bytes_.size();
    }
    std::uint64_t tellg() override { return place_; }
    void seekg(std::uint64_t place) override {
        place_ = std::min(place, std::uint64_t{bytes_.size()});
    }

  private:
    const std::vector<std::byte>& bytes_;
    std::size_t place_ = 0;
};

/// Returns the attribute as OpenEXR's class for its type, or as opaque bytes. Throws an exception
/// if the value is malformed.
std::unique_ptr<Imf::Attribute> attributeOf(const StoredAttribute& stored) {
    Imf::staticInitialize();  // registers OpenEXR's attribute types
    // OpenEXR's classes for these types trust the sizes in the data, so keep the values as opaque
    // bytes.
    const bool list = stored.type == "stringvector" || stored.type == "idmanifest" ||
                      stored.type == "preview" || stored.type == "chlist";
    std::unique_ptr<Imf::Attribute> attribute(
        !list && Imf::Attribute::knownType(stored.type.c_str())
            ? Imf::Attribute::newAttribute(stored.type.c_str())
            : new Imf::OpaqueAttribute(stored.type.c_str()));
    ValueStream stream(stored.value);
    attribute->readValueFrom(stream, static_cast<int>(stored.value.size()), Imf::EXR_VERSION);
    return attribute;
}

bool isValid(const StoredAttribute& stored) {
    // OpenEXR requires these types for attributes with these names.
    if (stored.name == "capDate" && stored.type != "string") return false;
    if (stored.name == "utcOffset" && stored.type != "float") return false;
    try {
        attributeOf(stored);
        return true;
    } catch (const std::bad_alloc&) {
        throw;
    } catch (const std::exception&) {
        return false;
    }
}

bool isWrittenByUs(const std::string& name, bool camera_known) {
    return isOneOf(kOfStorage, name) || name.starts_with("peeler:") ||
           (camera_known && isOneOf(kOfView, name));
}

/// Rec. 709, OpenEXR's default.
constexpr std::array<float, 8> kRec709{0.64F, 0.33F, 0.3F, 0.6F, 0.15F, 0.06F, 0.3127F, 0.329F};

bool isRec709(const std::array<float, 8>& chromaticities) {
    constexpr float kRounding = 1e-3F;
    for (std::size_t i = 0; i < kRec709.size(); ++i)
        if (!(std::abs(chromaticities[i] - kRec709[i]) <= kRounding)) return false;
    return true;
}

/// Warns about header contents that are lost if only the pixels are read.
void warnOfHeader(OpenedExr& opened, std::size_t part) {
    const ExrInputPart& header = opened.info.parts[part];
    ReadWarnings& warnings = opened.warnings;
    const ExrInput& head = opened.files.head();
    if (!opened.options.pixels_only) {
        if (head.originX() != 0 || head.originY() != 0)
            warnings.warn("The display window begins at (" + std::to_string(head.originX()) + ", " +
                          std::to_string(head.originY()) +
                          "); the picture is moved so that it begins at (0, 0).");
        return;
    }
    if (header.chromaticities && !isRec709(*header.chromaticities))
        warnings.warn(
            "The primaries of the picture are not those of Rec. 709 (chromaticities); colours are "
            "not converted.");
    const std::string aspect = header.attribute("pixelAspectRatio");
    if (!opened.info.plan.view.known && numberIn<float>(aspect) != 1)
        warnings.warn("The pixels of the picture are not square (pixelAspectRatio " + aspect +
                      "); they are not resampled.");
}

}  // namespace

bool canCarry(const StoredAttribute& stored, bool camera_known) {
    return !isWrittenByUs(stored.name, camera_known) && isValid(stored);
}

void readCarried(OpenedExr& opened, std::size_t part) {
    const ExrInfo& info = opened.info;
    const bool ours = info.attributes().contains("peeler:version");
    std::vector<StoredAttribute>& carried = opened.info.provenance.carried;
    std::size_t bytes = 0;
    for (StoredAttribute& attribute : opened.files.attributes(part)) {
        const std::string& name = attribute.name;
        const bool left =
            isWrittenByUs(name, info.plan.view.known) ||
            (name == "chromaticities" && info.parts[part].chromaticities == kRec709) ||
            (ours && (isOneOf(kOfOurs, name) || name.starts_with("cryptomatte/")));
        if (left) continue;
        bytes += attribute.value.size();
        if (bytes <= kMostCarried && isValid(attribute))
            carried.push_back(std::move(attribute));
        else if (!opened.options.pixels_only)
            opened.warnings.warn("The attribute \"" + name + "\" is not carried over.");
    }
    warnOfHeader(opened, part);
}

void addCarried(Imf::Header& header, const std::vector<StoredAttribute>& carried) {
    for (const StoredAttribute& stored : carried) {
        const auto own = header.find(stored.name);
        if (own == header.end() || stored.type == own.attribute().typeName())
            header.insert(stored.name, *attributeOf(stored));
    }
}

}  // namespace peeler
