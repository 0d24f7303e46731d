// SPDX-License-Identifier: Apache-2.0
#include "cmd/options/empty_picture.h"

#include <algorithm>
#include <cmath>

#include <peeler/error.h>
#include "core/scene/framing.h"
#include "core/scene/frustum.h"

namespace peeler::cmd {

namespace {

/// Whether the alpha test or blending removes all shown surfaces, even if textures are opaque
/// white.
bool isAllTransparent(const PosedScene& posed) {
    return std::ranges::all_of(posed.meshes(), [&](const MeshInstance& instance) {
        return std::ranges::all_of(posed.primitives(instance), [&](const Primitive& primitive) {
            const Material& material =
                posed.scene().materials[static_cast<std::size_t>(primitive.material)];
            const float alpha = material.base_color.a;
            return (material.alpha_mode == AlphaMode::kBlend && alpha <= 0) ||
                   (material.alpha_mode == AlphaMode::kMask && alpha < material.alpha_cutoff);
        });
    });
}

std::string beyondText(FrustumSide side, const View& view) {
    const std::string offer = "; --camera auto shows all of it";
    if (side == FrustumSide::kFar) return "the scene lies behind the far plane (--far)";
    if (side == FrustumSide::kNear)
        return "the scene lies behind the camera or in front of its near plane" + offer;
    const bool whole = view.crop == Window{0, 0, view.width, view.height};
    return whole ? "the scene lies outside the camera's field of view" + offer
                 : "the scene lies outside the crop";
}

}  // namespace

std::string emptyReason(const PosedScene& posed, const View& view, const CaptureSettings& capture,
                        const SceneOptions& options) {
    if (posed.meshes().empty()) {
        const bool chosen = !options.include.empty() || !options.exclude.empty();
        return chosen ? "--include and --exclude leave no meshes" : "the scene has no meshes";
    }
    if (const auto side = sideBeyondWhich(view, SceneExtent(posed))) return beyondText(*side, view);
    if (isAllTransparent(posed)) return "all its surfaces are fully transparent";
    if (capture.clip.active()) return "nothing is left inside the clip volume (--clip)";
    return "no surface covers a sample of a pixel; they may be transparent, face away (see "
           "--faces) or be too small";
}

void reportEmpty(const std::filesystem::path& file, const std::string& reason, bool strict,
                 Reporter& reporter) {
    if (strict)
        throw Error(ErrorKind::kIncomplete, "the picture is empty: " + reason, file.string(),
                    "leave --strict out to keep the empty picture");
    reporter.warning(file.string() + " is empty: " + reason + '.');
}

}  // namespace peeler::cmd
