// SPDX-License-Identifier: Apache-2.0
// Counts the parts and attributes of an OpenEXR file before the library reads them: what it does
// for each grows with their number (OpenEXRCore 3.1 takes a minute for a million attributes).
#include <algorithm>
#include <array>
#include <cstring>
#include <string>

#include "core/base/error.h"
#include "formats/exr/exr_input.h"

namespace peeler {
namespace {

constexpr std::uint32_t kMultiPart = 0x1000;  ///< of the version field
constexpr int kMaxParts = 1 << 15, kMaxAttributes = 1 << 13;

/// The bytes of a file from its beginning on; zeros behind its end.
class HeaderBytes {
  public:
    explicit HeaderBytes(const RegularFile& file) : file_(file) {}

    bool atEnd() const { return at_ >= file_.size(); }
    void skip(std::uint64_t bytes) { at_ = std::min(file_.size(), at_ + bytes); }

    char next() {
        if (at_ < begin_ || at_ - begin_ >= got_) {
            begin_ = at_;
            got_ = file_.readSome(at_, block_);
        }
        return at_ - begin_ < got_ ? block_[static_cast<std::size_t>(at_++ - begin_)] : '\0';
    }
    std::uint32_t number() {
        std::uint32_t value = 0;
        for (unsigned byte = 0; byte < 4; ++byte)
            value |= std::uint32_t{static_cast<unsigned char>(next())} << 8U * byte;
        return value;
    }
    /// Skips a name; false if it is empty, or longer than names are.
    bool name() {
        constexpr int kLongest = 255;
        for (int length = 0; length <= kLongest; ++length)
            if (next() == '\0') return length > 0;
        return false;
    }

  private:
    const RegularFile& file_;
    std::uint64_t at_ = 0, begin_ = 0;
    std::size_t got_ = 0;
    std::array<char, 1 << 16> block_{};
};

/// Skips a header; how many attributes it has.
int skipHeader(HeaderBytes& bytes, const std::string& path) {
    int attributes = 0;
    for (; bytes.name(); ++attributes) {
        if (attributes == kMaxAttributes)
            throw Error(ErrorKind::kInput,
                        "a part has more than " + std::to_string(kMaxAttributes) + " attributes",
                        path, "no program writes so many");
        bytes.name();  // of the type
        bytes.skip(bytes.number());
    }
    return attributes;
}

}  // namespace

void checkExrHeaders(const RegularFile& file, const std::string& path) {
    HeaderBytes bytes(file);
    bytes.skip(4);  // what it begins with, which the library checks, as it does all else
    const bool several = (bytes.number() & kMultiPart) != 0;
    for (int parts = 0; skipHeader(bytes, path) > 0 && several && !bytes.atEnd(); ++parts) {
        if (parts < kMaxParts) continue;
        throw Error(ErrorKind::kInput, "it has more than " + std::to_string(kMaxParts) + " parts",
                    path, "leave some layers out");
    }
}

}  // namespace peeler
