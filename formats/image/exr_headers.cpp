// SPDX-License-Identifier: Apache-2.0
#include "formats/image/exr_headers.h"

#include <OpenEXR/ImfCompression.h>
#include <OpenEXR/OpenEXRConfig.h>

#include <string_view>
#include <utility>

#include <peeler/error.h>
#include "core/base/printable.h"

namespace peeler {
namespace {

constexpr std::uint32_t kMultiPart = 0x1000;  ///< bit of the version field
constexpr int kMaxParts = 1 << 15, kMaxAttributes = 1 << 13;
constexpr std::size_t kLongestName = 255;

/// An attribute type whose values all have the same size.
struct FixedType {
    std::string_view name;
    std::uint64_t bytes;
};
constexpr FixedType kFixedTypes[] = {
    {"box2i", 16},      {"box2f", 16},   {"chromaticities", 32},
    {"compression", 1}, {"double", 8},   {"envmap", 1},
    {"float", 4},       {"int", 4},      {"keycode", 28},
    {"lineOrder", 1},   {"m33f", 36},    {"m33d", 72},
    {"m44f", 64},       {"m44d", 128},   {"rational", 8},
    {"tiledesc", 9},    {"timecode", 8}, {"v2i", 8},
    {"v2f", 8},         {"v2d", 16},     {"v3i", 12},
    {"v3f", 12},        {"v3d", 24},     {"deepImageState", 1},
};

}  // namespace

ExrHeaders::ExrHeaders(const RegularFile& file, std::string path)
    : file_(file), path_(std::move(path)) {
    multi_part_ = (number() & kMultiPart) != 0;
}

bool ExrHeaders::nextPart() {
    if (parts_ > 0 && !multi_part_) return false;
    // In a multi-part file, an empty header ends the list.
    if (parts_ > 0 && byteAt(place_) == '\0') {
        ++place_;
        return false;
    }
    if (parts_++ == kMaxParts)
        throw Error(ErrorKind::kInput,
                    "the file has more than " + std::to_string(kMaxParts) + " parts", path_,
                    "leave some layers out");
    attributes_ = 0;
    return true;
}

bool ExrHeaders::nextAttribute(Attribute& attribute) {
    attribute.name = name();
    if (attribute.name.empty()) return false;
    if (attributes_++ == kMaxAttributes)
        throw Error(ErrorKind::kInput,
                    "a part has more than " + std::to_string(kMaxAttributes) + " attributes", path_,
                    "write it again with fewer attributes");
    attribute.type = name();
    attribute.size = number();
    attribute.place = place_;
    if (attribute.size > file_.size() - place_)
        fail("\"" + printable(attribute.name) + "\" reaches beyond the end of the file");
    if (!fitsType(attribute))
        fail("\"" + printable(attribute.name) + "\" has the wrong length for its type");
    place_ = attribute.place + attribute.size;
    return true;
}

// OpenEXR's classes read a value by its content and ignore the declared size. If the size were
// wrong, they would read names and sizes that have not been checked.
bool ExrHeaders::fitsType(const Attribute& attribute) {
    for (const FixedType& type : kFixedTypes)
        if (type.name == attribute.type) return attribute.size == type.bytes;
    if (attribute.type == "chlist") return isChannelList(attribute);
    if (attribute.type == "preview") {
        if (attribute.size < 8) return false;
        const std::uint64_t width = number(), height = number();
        return height == 0 ? attribute.size == 8
                           : width <= attribute.size / 4 / height &&
                                 attribute.size == 8 + 4 * width * height;
    }
    return true;
}

bool ExrHeaders::isChannelList(const Attribute& attribute) {
    // The bytes per channel after the channel's name: type, linearity, sampling.
    constexpr std::uint64_t kNumbers = 16;
    const std::uint64_t end = attribute.place + attribute.size;
    while (place_ < end) {
        if (name().empty()) return place_ == end;
        place_ += kNumbers;
    }
    return false;
}

char ExrHeaders::byteAt(std::uint64_t place) {
    if (place < block_begin_ || place - block_begin_ >= block_size_) {
        block_begin_ = place;
        block_size_ = file_.readSome(place, block_);
        if (block_size_ == 0) fail("the file ends within it");
    }
    return block_[static_cast<std::size_t>(place - block_begin_)];
}

std::uint32_t ExrHeaders::number() {
    std::uint32_t value = 0;
    for (unsigned byte = 0; byte < 4; ++byte)
        value |= std::uint32_t{static_cast<unsigned char>(byteAt(place_++))} << 8U * byte;
    return value;
}

std::string ExrHeaders::name() {
    std::string result;
    while (const char next = byteAt(place_++)) {
        if (result.size() == kLongestName) fail("a name in it is too long");
        result += next;
    }
    return result;
}

void ExrHeaders::fail(const std::string& what) const {
    throw Error(ErrorKind::kInput, "the header is damaged: " + what, path_,
                "the file may be cut off; write it again");
}

void checkExrHeaders(const RegularFile& file, const std::string& path) {
    constexpr std::array<char, 4> kMagic{0x76, 0x2f, 0x31, 0x01};
    std::array<char, 4> first{};
    file.readSome(0, first);
    if (first != kMagic) return;
    ExrHeaders headers(file, path);
    ExrHeaders::Attribute attribute;
    while (headers.nextPart())
        while (headers.nextAttribute(attribute)) {
            if (attribute.type != "compression" || attribute.name != attribute.type) continue;
            char compression = 0;
            file.readSome(attribute.place, {&compression, 1});
            if (static_cast<unsigned char>(compression) < Imf::NUM_COMPRESSION_METHODS) continue;
            throw Error(ErrorKind::kInput,
                        "a part has the compression method " +
                            std::to_string(static_cast<unsigned char>(compression)) +
                            ", which OpenEXR " OPENEXR_VERSION_STRING " does not know",
                        path, "write it again with zip");
        }
}

}  // namespace peeler
