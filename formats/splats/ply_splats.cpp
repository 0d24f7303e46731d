// SPDX-License-Identifier: Apache-2.0
// Reader of Gaussian splats as training programs write them: a PLY with a vertex per splat (Kerbl
// et al., 2023), also with the 3D filter of Mip-Splatting (Yu et al., 2024).
#include <algorithm>
#include <cmath>

#include <peeler/error.h>
#include "formats/splats/splat_ply.h"

namespace peeler {
namespace {

/// The first values of a row, in this order.
constexpr const char* kSplatNames[] = {"x",       "y",      "z",      "scale_0", "scale_1",
                                       "scale_2", "rot_0",  "rot_1",  "rot_2",   "rot_3",
                                       "opacity", "f_dc_0", "f_dc_1", "f_dc_2"};
constexpr std::size_t kScaleAt = 3, kRotationAt = 6, kOpacityAt = 10, kColorAt = 11, kRestAt = 14;
constexpr const char* kFilterName = "filter_3D";
/// The dilation of Mip-Splatting's own code, in square pixels.
constexpr double kMipDilation = 0.1;

glm::dvec3 vectorIn(const std::vector<double>& values, std::size_t i) {
    return {values[i], values[i + 1], values[i + 2]};
}

/// Widens a splat to the resolution of the training pictures.
void applyFilter(Splat& splat, double filter) {
    const glm::dvec3 squared = splat.scale * splat.scale, wide = squared + filter * filter;
    const glm::dvec3 share = squared / wide;
    splat.scale = glm::sqrt(wide);
    if (filter != 0) splat.opacity *= std::sqrt(share.x * share.y * share.z);
}

class SplatPlyReader {
  public:
    SplatPlyReader(const std::filesystem::path& path, const SceneReadOptions& options)
        : file_(path, options), elements_(file_) {}

    Scene read() {
        elements_.read([&](const PlyElement& element) {
            if (element.name != "vertex" || scene_) return false;
            readSplats(element);
            return true;
        });
        if (!scene_)
            throw Error(ErrorKind::kInput, "the element vertex has no properties", file_.name(),
                        "export the file again");
        return scene_->finish();
    }

  private:
    void readSplats(const PlyElement& element) {
        const int degree = degreeIn(file_, element);
        std::vector<std::string> names(std::begin(kSplatNames), std::end(kSplatNames));
        const auto higher = std::uint64_t{3} * (Splats::coefficients(degree) - 1);
        std::ranges::copy(numberedNames("f_rest_", higher), std::back_inserter(names));
        const bool filtered = propertyNamed(element, kFilterName);
        if (filtered) names.emplace_back(kFilterName);

        const std::vector<const PlyField*> fields = propertiesNamed(file_, element, names);
        scene_.emplace(file_, element.rows, degree);
        Splats& properties = scene_->properties();
        properties.compensated = filtered || isCompensated(file_, elements_.header());
        if (filtered) properties.dilation = kMipDilation;

        readRows(elements_, element, fields,
                 [&](const std::vector<double>& values) { addSplat(values, degree, filtered); });
    }

    void addSplat(const std::vector<double>& values, int degree, bool filtered) {
        Splat splat;
        splat.mean = vectorIn(values, 0);
        splat.scale = glm::exp(vectorIn(values, kScaleAt));
        splat.rotation = {vectorIn(values, kRotationAt + 1), values[kRotationAt]};
        splat.opacity = sigmoid(values[kOpacityAt]);
        splat.harmonics[0] = vectorIn(values, kColorAt);
        setHigherHarmonics(splat, degree, [&](std::size_t i) { return values[kRestAt + i]; });
        if (filtered) applyFilter(splat, values.back());
        scene_->add(splat);
    }

    MeshFile file_;
    PlyElements elements_;
    std::optional<SplatScene> scene_;
};

}  // namespace

bool isSplatPly(std::string_view begin, std::uint64_t) {
    return hasPlyProperties(begin, {"f_dc_0", "opacity", "scale_0", "rot_0"});
}

Scene readSplatPly(const std::filesystem::path& path, const SceneReadOptions& options) {
    return SplatPlyReader(path, options).read();
}

}  // namespace peeler
