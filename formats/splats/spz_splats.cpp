// SPDX-License-Identifier: Apache-2.0
// Reader of SPZ 2 and 3 (https://github.com/nianticlabs/spz): a gzip stream of a header, then one
// array of all splats per property.
#include <libdeflate.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <memory>
#include <numbers>

#include <peeler/error.h>
#include "formats/splats/splat_scene.h"

namespace peeler {
namespace {

constexpr std::string_view kGzipMagic = "\x1f\x8b", kSpzMagic = "NGSP";

struct SpzHeader {
    char magic[4];
    std::uint32_t version, splats;
    std::uint8_t degree, fraction_bits, flags, reserved;
};
static_assert(sizeof(SpzHeader) == 16);
constexpr int kSpzAntialiased = 1, kSpzExtended = 2;  // bits of `flags`
constexpr std::uint32_t kOldestSpz = 2, kNewestSpz = 3;
constexpr int kMostSpzDegree = 3, kMostFractionBits = 24;

/// The limit of the unpacked size: real files unpack to less than three times their size.
constexpr std::uint64_t kMostSpzRatio = 200, kAlwaysUnpacked = 1U << 20U;

[[noreturn]] void failSpz(const MeshFile& file, const std::string& what,
                          const char* hint = "copy or export the file again") {
    throw Error(ErrorKind::kInput, what, file.name(), hint);
}

std::vector<std::uint8_t> unpackedSpz(MeshFile& file) {
    const std::span<const std::uint8_t> packed = file.bytes();
    std::uint32_t size = 0;  // gzip's last field: the unpacked size modulo 2^32
    if (packed.size() >= sizeof size)
        std::memcpy(&size, packed.data() + packed.size() - sizeof size, sizeof size);
    if (size > kMostSpzRatio * packed.size() + kAlwaysUnpacked)
        failSpz(file, "the file unpacks to more than " + std::to_string(kMostSpzRatio) +
                          " times its size, or its end is damaged");
    file.allow(size);
    std::vector<std::uint8_t> bytes(size);
    const std::unique_ptr<libdeflate_decompressor, void (*)(libdeflate_decompressor*)> inflate(
        libdeflate_alloc_decompressor(), libdeflate_free_decompressor);
    if (libdeflate_gzip_decompress(inflate.get(), packed.data(), packed.size(), bytes.data(),
                                   bytes.size(), nullptr) != LIBDEFLATE_SUCCESS)
        failSpz(file, "the gzip data are damaged");
    return bytes;
}

/// Returns a fixed-point number of 24 bits, without its scale.
double fixedPoint(const std::uint8_t* bytes) {
    const auto number = static_cast<std::uint32_t>(bytes[0]) << 8U |
                        static_cast<std::uint32_t>(bytes[1]) << 16U |
                        static_cast<std::uint32_t>(bytes[2]) << 24U;
    return static_cast<double>(static_cast<std::int32_t>(number)) / 256;
}

glm::dvec4 rotationOfThree(const std::uint8_t* bytes) {
    glm::dvec3 axis;
    for (int i = 0; i < 3; ++i)
        axis[i] = bytes[i] / 127.5 - 1;
    return {axis, std::sqrt(std::max(0.0, 1 - glm::dot(axis, axis)))};
}

glm::dvec4 rotationOfFour(const std::uint8_t* bytes) {
    std::uint32_t packed = 0;
    std::memcpy(&packed, bytes, sizeof packed);
    const auto component = [&](std::uint32_t shift) {
        constexpr std::uint32_t kSize = 511, kSign = 512;
        const double size = (packed >> shift & kSize) / (kSize * std::numbers::sqrt2);
        return packed >> shift & kSign ? -size : size;
    };
    const auto [x, y, z, w] =
        withLargest(packed >> 30U, {component(20), component(10), component(0)});
    return {x, y, z, w};
}

class SpzReader {
  public:
    SpzReader(const std::filesystem::path& path, const SceneReadOptions& options)
        : file_(path, options) {}

    Scene read() {
        if (file_.text().starts_with(kGzipMagic)) {
            unpacked_ = unpackedSpz(file_);
            left_ = unpacked_;
        } else {
            left_ = file_.bytes();
        }
        readHeader();
        const std::uint64_t count = header_.splats;
        const std::size_t higher =
            static_cast<std::size_t>((header_.degree + 1) * (header_.degree + 1)) - 1;
        const std::size_t turn = header_.version == kOldestSpz ? 3 : 4;
        const std::uint64_t size = count * (9 + 1 + 3 + 3 + turn + 3 * higher);
        if (size > left_.size())
            failSpz(file_, "the file ends before its " + std::to_string(count) + " splats do");
        means_ = take(9);
        opacities_ = take(1);
        colors_ = take(3);
        scales_ = take(3);
        rotations_ = take(turn);
        harmonics_ = take(3 * higher);
        if (!left_.empty())
            file_.warn("Bytes after the last splat are ignored (" + std::to_string(left_.size()) +
                       ").");
        SplatScene scene(file_, count, header_.degree);
        scene.properties().compensated = header_.flags & kSpzAntialiased;
        for (std::size_t i = 0; i < count; ++i)
            scene.add(splat(i, turn, higher));
        return scene.finish();
    }

  private:
    void readHeader() {
        if (left_.size() < sizeof header_) failSpz(file_, "the file is shorter than a header");
        std::memcpy(&header_, left_.data(), sizeof header_);
        left_ = left_.subspan(sizeof header_);
        if (std::string_view(header_.magic, sizeof header_.magic) != kSpzMagic)
            failSpz(file_, "this is gzip, but not an SPZ file",
                    "give a scene; unpack others with gunzip");
        if (header_.version < kOldestSpz || header_.version > kNewestSpz)
            failSpz(file_,
                    "SPZ version " + std::to_string(header_.version) +
                        " is not supported, only 2 and 3 are",
                    "convert it to SPZ 3, glTF or PLY");
        if (header_.degree > kMostSpzDegree)
            failSpz(file_,
                    "spherical harmonics of degree " + std::to_string(header_.degree) +
                        " are not supported",
                    "export degree 0 to 3");
        if (header_.fraction_bits > kMostFractionBits)
            failSpz(file_, "positions have " + std::to_string(header_.fraction_bits) +
                               " fractional bits, more than their 24 bits");
        if (header_.flags & kSpzExtended)
            failSpz(file_, "SPZ extensions are not supported", "export the file without them");
        if (header_.flags & ~(kSpzAntialiased | kSpzExtended))
            file_.warn("Unknown flags of the file are ignored (" + std::to_string(header_.flags) +
                       ").");
    }

    std::span<const std::uint8_t> take(std::size_t bytes_per_splat) {
        const std::span<const std::uint8_t> taken = left_.first(bytes_per_splat * header_.splats);
        left_ = left_.subspan(taken.size());
        return taken;
    }

    Splat splat(std::size_t i, std::size_t turn, std::size_t higher) const {
        Splat splat;
        for (std::size_t c = 0; c < 3; ++c) {
            const auto axis = static_cast<int>(c);
            splat.mean[axis] =
                std::ldexp(fixedPoint(&means_[9 * i + 3 * c]), -int{header_.fraction_bits});
            splat.scale[axis] = std::exp(scales_[3 * i + c] / 16.0 - 10);
            constexpr double kColorScale = 0.15;
            splat.harmonics[0][axis] = (colors_[3 * i + c] / 255.0 - 0.5) / kColorScale;
            for (std::size_t k = 0; k < higher; ++k)
                splat.harmonics[k + 1][axis] = (harmonics_[3 * (higher * i + k) + c] - 128) / 128.0;
        }
        const std::uint8_t* const rotation = &rotations_[turn * i];
        splat.rotation = turn == 3 ? rotationOfThree(rotation) : rotationOfFour(rotation);
        splat.opacity = opacities_[i] / 255.0;
        return splat;
    }

    MeshFile file_;
    std::vector<std::uint8_t> unpacked_;
    std::span<const std::uint8_t> left_;
    SpzHeader header_{};
    std::span<const std::uint8_t> means_, opacities_, colors_, scales_, rotations_, harmonics_;
};

}  // namespace

bool isSpz(std::string_view begin, std::uint64_t) {
    return begin.starts_with(kGzipMagic) || begin.starts_with(kSpzMagic);
}

Scene readSpz(const std::filesystem::path& path, const SceneReadOptions& options) {
    return SpzReader(path, options).read();
}

}  // namespace peeler
