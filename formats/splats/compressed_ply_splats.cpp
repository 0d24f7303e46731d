// SPDX-License-Identifier: Apache-2.0
// Reader of the compressed PLY of PlayCanvas and SuperSplat (compressed.ply): chunks of 256 splats,
// whose integers interpolate between the chunk's limits.
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include <peeler/error.h>
#include "formats/splats/splat_ply.h"

namespace peeler {
namespace {

constexpr std::uint64_t kChunkSplats = 256;  ///< number of splats

/// The names of a chunk's limits, from kMeanAt, kLogScaleAt and kRgbAt on. Files may leave out the
/// colours, whose limits are then 0 and 1.
const std::vector<std::string> kLimitNames = {
    "min_x",       "min_y",       "min_z",       "max_x",       "max_y",       "max_z",
    "min_scale_x", "min_scale_y", "min_scale_z", "max_scale_x", "max_scale_y", "max_scale_z",
    "min_r",       "min_g",       "min_b",       "max_r",       "max_g",       "max_b"};
constexpr std::size_t kMeanAt = 0, kLogScaleAt = 6, kRgbAt = 12;
using ChunkLimits = std::array<double, 18>;
constexpr ChunkLimits kNoLimits = {0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 1, 1, 1};

constexpr const char* kPackedNames[] = {"packed_position", "packed_rotation", "packed_scale",
                                        "packed_color"};
/// The integers of a splat, in the order of kPackedNames.
using PackedSplat = std::array<std::uint32_t, std::size(kPackedNames)>;

/// Converts a number of a property of this type, which text may exceed.
template <class Integer>
Integer packedNumber(double value) {
    if (!(value >= 0 && value <= double{std::numeric_limits<Integer>::max()}))
        throw Error(ErrorKind::kInput, "a packed number is out of range");
    return static_cast<Integer>(value);
}

/// Returns the lowest bits as a fractionOf from 0 to 1.
double fractionOf(std::uint32_t value, std::uint32_t bits) {
    const std::uint32_t most = (1U << bits) - 1;
    return static_cast<double>(value & most) / most;
}

/// Returns three fractions of 11, 10 and 11 bits, the first in the highest bits.
glm::dvec3 fractions(std::uint32_t value) {
    return {fractionOf(value >> 21U, 11), fractionOf(value >> 11U, 10), fractionOf(value, 11)};
}

/// Interpolates the limits from `first` on.
glm::dvec3 between(const ChunkLimits& limits, std::size_t first, const glm::dvec3& t) {
    const glm::dvec3 least(limits[first], limits[first + 1], limits[first + 2]);
    const glm::dvec3 most(limits[first + 3], limits[first + 4], limits[first + 5]);
    return least * (1.0 - t) + most * t;
}

glm::dvec4 rotationOf(std::uint32_t packed) {
    const auto component = [&](std::uint32_t shift) {
        return (fractionOf(packed >> shift, 10) - 0.5) * std::numbers::sqrt2;
    };
    const auto [w, x, y, z] =
        withLargest(packed >> 30U, {component(20), component(10), component(0)});
    return {x, y, z, w};
}

/// Returns the coefficient in a byte, from −4 to 4.
double harmonicIn(std::uint8_t byte) {
    const double t = byte == 0 ? 0 : byte == 255 ? 1 : (byte + 0.5) / 256;
    return (t - 0.5) * 8;
}

class CompressedPlyReader {
  public:
    CompressedPlyReader(const std::filesystem::path& path, const SceneReadOptions& options)
        : file_(path, options), elements_(file_) {}

    Scene read() {
        elements_.read([&](const PlyElement& element) {
            for (const auto& [name, read] : kReaders) {
                if (element.name != name) continue;
                (this->*read)(element);
                return true;
            }
            return false;
        });
        return unpack();
    }

  private:
    void readChunks(const PlyElement& element) {
        const bool colored = propertyNamed(element, kLimitNames[kRgbAt]);
        std::vector<std::string> names = kLimitNames;
        if (!colored) names.resize(kRgbAt);
        file_.allow(element.rows * sizeof(ChunkLimits));
        chunks_.reserve(element.rows);
        readRows(elements_, element, propertiesNamed(file_, element, names),
                 [&](const std::vector<double>& values) {
                     std::ranges::copy(values, chunks_.emplace_back(kNoLimits).begin());
                 });
    }

    void readSplats(const PlyElement& element) {
        const std::vector<std::string> names(std::begin(kPackedNames), std::end(kPackedNames));
        const auto fields = fieldsOf(element, names, "uint", 4294967295.0);
        file_.allow(element.rows * sizeof(PackedSplat));
        packed_.reserve(element.rows);
        readRows(elements_, element, fields, [&](const std::vector<double>& values) {
            PackedSplat& splat = packed_.emplace_back();
            for (std::size_t i = 0; i < splat.size(); ++i)
                splat[i] = packedNumber<std::uint32_t>(values[i]);
        });
    }

    void readHarmonics(const PlyElement& element) {
        degree_ = degreeIn(file_, element);
        higher_ = 3 * (Splats::coefficients(degree_) - 1);
        const auto fields = fieldsOf(element, numberedNames("f_rest_", higher_), "uchar", 255);
        file_.allow(element.rows * higher_);
        harmonics_.reserve(element.rows * higher_);
        harmonic_rows_ = element.rows;
        readRows(elements_, element, fields, [&](const std::vector<double>& values) {
            for (const double value : values)
                harmonics_.push_back(packedNumber<std::uint8_t>(value));
        });
    }

    /// Returns the properties that have these names, and checks that they have this unsigned type.
    std::vector<const PlyField*> fieldsOf(const PlyElement& element,
                                          const std::vector<std::string>& names, const char* type,
                                          double greatest) const {
        std::vector<const PlyField*> fields = propertiesNamed(file_, element, names);
        for (const PlyField* const property : fields)
            if (property->type->greatest != greatest)
                throw Error(ErrorKind::kInput, property->name + " must be " + type, file_.name(),
                            "export the file again");
        return fields;
    }

    Scene unpack() {
        const std::uint64_t chunks = (packed_.size() + kChunkSplats - 1) / kChunkSplats;
        if (chunks_.size() != chunks)
            throw Error(ErrorKind::kInput,
                        std::to_string(packed_.size()) + " splats need " + std::to_string(chunks) +
                            " chunks, but the file has " + std::to_string(chunks_.size()),
                        file_.name(), "export the file again");
        if (degree_ > 0 && harmonic_rows_ != packed_.size())
            throw Error(ErrorKind::kInput,
                        "the file has " + std::to_string(packed_.size()) + " splats, but " +
                            std::to_string(harmonic_rows_) + " rows of the element sh",
                        file_.name(), "export the file again");
        SplatScene scene(file_, packed_.size(), degree_);
        scene.properties().compensated = isCompensated(file_, elements_.header());
        for (std::size_t i = 0; i < packed_.size(); ++i)
            scene.add(splat(i));
        return scene.finish();
    }

    Splat splat(std::size_t i) const {
        const ChunkLimits& limits = chunks_[i / kChunkSplats];
        const auto [position, rotation, scale, color] = packed_[i];
        const glm::dvec3 rgb = between(
            limits, kRgbAt,
            {fractionOf(color >> 24U, 8), fractionOf(color >> 16U, 8), fractionOf(color >> 8U, 8)});
        Splat splat;
        splat.mean = between(limits, kMeanAt, fractions(position));
        splat.scale = glm::exp(between(limits, kLogScaleAt, fractions(scale)));
        splat.rotation = rotationOf(rotation);
        splat.opacity = fractionOf(color, 8);
        splat.harmonics[0] = {harmonicOf(rgb.r), harmonicOf(rgb.g), harmonicOf(rgb.b)};
        setHigherHarmonics(splat, degree_,
                           [&](std::size_t k) { return harmonicIn(harmonics_[i * higher_ + k]); });
        return splat;
    }

    struct ElementRow {
        const char* name;
        void (CompressedPlyReader::*read)(const PlyElement& element);
    };
    static constexpr ElementRow kReaders[] = {{"chunk", &CompressedPlyReader::readChunks},
                                              {"vertex", &CompressedPlyReader::readSplats},
                                              {"sh", &CompressedPlyReader::readHarmonics}};

    MeshFile file_;
    PlyElements elements_;
    std::vector<ChunkLimits> chunks_;
    std::vector<PackedSplat> packed_;
    int degree_ = 0;
    std::size_t higher_ = 0;  ///< number of coefficients per splat after the first three
    std::vector<std::uint8_t> harmonics_;
    std::uint64_t harmonic_rows_ = 0;
};

}  // namespace

bool isCompressedSplatPly(std::string_view begin, std::uint64_t) {
    return hasPlyProperties(begin, {"packed_position", "packed_rotation"});
}

Scene readCompressedSplatPly(const std::filesystem::path& path, const SceneReadOptions& options) {
    return CompressedPlyReader(path, options).read();
}

}  // namespace peeler
