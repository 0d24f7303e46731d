// SPDX-License-Identifier: Apache-2.0
#include "core/peel/composite_targets.h"

#include <bit>
#include <string>

#include "shaders/interface.glsl"

namespace peeler {
namespace {

using gl::Blend;

struct Attachment {
    unsigned part;
    Blend blend;
    std::uint64_t bytes;  // per pixel
};
// The attachments, in framebuffer order.
constexpr Attachment kAttachments[] = {{CompositeTargets::kFront, Blend::kUnder, 16},
                                       {CompositeTargets::kBack, Blend::kOver, 16},
                                       {CompositeTargets::kTail, Blend::kAdd, 16},
                                       {CompositeTargets::kTail, Blend::kAdd, 4},
                                       {CompositeTargets::kBackOpacity, Blend::kOverByItself, 16},
                                       {CompositeTargets::kTailOpacity, Blend::kAdd, 16},
                                       {CompositeTargets::kCoverage, Blend::kOverByItself, 16},
                                       {CompositeTargets::kMoments, Blend::kAdd, 16},
                                       {CompositeTargets::kMoments, Blend::kAdd, 4}};

}  // namespace

std::uint64_t CompositeTargets::bytes(unsigned parts, std::uint64_t tile_pixels) {
    std::uint64_t bytes = 0;
    for (const Attachment& attachment : kAttachments)
        if (parts & attachment.part) bytes += attachment.bytes * tile_pixels;
    return bytes;
}

unsigned CompositeTargets::withOpacity(unsigned parts, bool tinted) {
    if (!tinted) return parts;
    return parts | ((parts & kBack) ? kBackOpacity : 0U) | ((parts & kTail) ? kTailOpacity : 0U);
}

void CompositeTargets::begin(SceneRasterizer& rasterizer, const Window& area, unsigned parts) {
    const auto& gl = rasterizer.functions();
    const Window size{0, 0, rasterizer.tile().width(), rasterizer.tile().height()};
    if (size != size_) {
        *this = {};
        size_ = size;
    }
    const auto make = [&](gl::Texture& texture, unsigned part, GLenum format) {
        if ((parts & part) && !texture) texture = gl::makeTexture2D(gl, format, size.x1, size.y1);
    };
    make(front_, kFront, GL_RGBA32F);
    make(back_, kBack, GL_RGBA32F);
    make(tail_sum_, kTail, GL_RGBA32F);
    make(tail_count_, kTail, GL_R32F);
    make(back_opacity_, kBackOpacity, GL_RGBA32F);
    make(tail_opacity_, kTailOpacity, GL_RGBA32F);
    make(coverage_, kCoverage, GL_RGBA32F);
    make(moments_, kMoments, GL_RGBA32F);
    make(absorbance_, kMoments, GL_R32F);
    parts_ = parts;

    const GLuint all = framebuffer(rasterizer, parts);
    gl::apply(gl, rasterizer.passState(all, area));
    constexpr std::array<float, 4> kEmpty = {};
    for (GLint i = 0; i < static_cast<GLint>(textures(parts).size()); ++i)
        gl.ClearNamedFramebufferfv(all, GL_COLOR, i, kEmpty.data());
}

std::vector<GLuint> CompositeTargets::textures(unsigned parts) const {
    std::vector<GLuint> names;
    if (parts & kFront) names.push_back(front_.name());
    if (parts & kBack) names.push_back(back_.name());
    if (parts & kTail) names.insert(names.end(), {tail_sum_.name(), tail_count_.name()});
    if (parts & kBackOpacity) names.push_back(back_opacity_.name());
    if (parts & kTailOpacity) names.push_back(tail_opacity_.name());
    if (parts & kCoverage) names.push_back(coverage_.name());
    if (parts & kMoments) names.insert(names.end(), {moments_.name(), absorbance_.name()});
    return names;
}

GLuint CompositeTargets::framebuffer(const SceneRasterizer& rasterizer, unsigned parts) {
    gl::Framebuffer& framebuffer = framebuffers_[parts];
    if (!framebuffer) framebuffer = gl::makeFramebuffer(rasterizer.functions(), textures(parts), 0);
    return framebuffer.name();
}

std::array<Blend, gl::kMaxAttachments> CompositeTargets::blending(unsigned parts,
                                                                  std::size_t first) {
    std::array<Blend, gl::kMaxAttachments> blend{};
    for (const Attachment& attachment : kAttachments)
        if (parts & attachment.part) blend[first++] = attachment.blend;
    return blend;
}

int CompositeTargets::addTail(SceneRasterizer& rasterizer, const Window& area,
                              const LayerTargets& layers, std::uint32_t last) {
    layers.bindForReading(rasterizer.functions(), LayerTargets::sideOf(last));
    rasterizer.draw({.fragment_shader = "accumulate.frag",
                     .definitions = "BEHIND",
                     .shades = true,
                     .framebuffer = framebuffer(rasterizer, kTail),
                     .blend = blending(kTail)},
                    area);
    return 1;
}

/// Draws all fragments, or those in front of the opaque bound, into these parts.
int CompositeTargets::addWith(SceneRasterizer& rasterizer, const Window& area, GeometryPass pass,
                              unsigned parts) {
    parts = withOpacity(parts, rasterizer.tinted());
    pass.shades = true;
    pass.draws = rasterizer.bounded() ? Draws::kBlended : Draws::kAll;
    pass.framebuffer = framebuffer(rasterizer, parts);
    pass.blend = blending(parts);
    rasterizer.draw(pass, area);
    // Makes the depths visible to later passes.
    rasterizer.functions().MemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT);
    return 1;
}

int CompositeTargets::addFragments(SceneRasterizer& rasterizer, const Window& area) {
    return addWith(rasterizer, area, {.fragment_shader = "accumulate.frag"}, kTail);
}

int CompositeTargets::addDepthWeighted(SceneRasterizer& rasterizer, const Window& area) {
    return addWith(rasterizer, area,
                   {.fragment_shader = "accumulate.frag", .definitions = "DEPTH_WEIGHTS"},
                   kTail | kCoverage);
}

int CompositeTargets::addMomentWeighted(SceneRasterizer& rasterizer, const Window& area) {
    const auto& gl = rasterizer.functions();
    const auto [nearest, farthest] = rasterizer.depthRange();
    const ShaderArgument range{{std::bit_cast<int>(nearest), std::bit_cast<int>(farthest), 0, 0}};
    const int passes =
        addWith(rasterizer, area, {.fragment_shader = "moments.frag", .argument = range},
                kCoverage | kMoments);
    gl.BindTextureUnit(PEELER_MOMENTS_UNIT, moments_.name());
    gl.BindTextureUnit(PEELER_ABSORBANCE_UNIT, absorbance_.name());
    return passes + addWith(rasterizer, area,
                            {.fragment_shader = "accumulate.frag",
                             .definitions = "MOMENT_WEIGHTS",
                             .argument = range},
                            kTail);
}

/// Draws fragments into the back: blended over its contents if `blended`, otherwise overwriting
/// them. If opacity is coloured, blending colours takes two shader outputs for one target, so
/// opacities need a second pass.
int CompositeTargets::drawUnsorted(SceneRasterizer& rasterizer, const Window& area, Draws draws,
                                   bool blended) {
    const bool tinted = rasterizer.tinted();
    const auto draw = [&](unsigned part, const char* definitions, Blend blend) {
        rasterizer.draw({.fragment_shader = "unsorted.frag",
                         .definitions = definitions,
                         .shades = true,
                         .draws = draws,
                         .framebuffer = framebuffer(rasterizer, part),
                         .blend = {blended ? blend : Blend::kOff}},
                        area);
        rasterizer.functions().MemoryBarrier(
            GL_SHADER_STORAGE_BARRIER_BIT);  // makes list heads and depths visible to later passes
    };
    draw(kBack, "", tinted ? Blend::kOverByOpacity : Blend::kOver);
    if (tinted) draw(kBackOpacity, "OPACITY", Blend::kOverByItself);
    return tinted ? 2 : 1;
}

int CompositeTargets::blendUnsorted(SceneRasterizer& rasterizer, const Window& area) {
    return drawUnsorted(rasterizer, area, rasterizer.bounded() ? Draws::kBlended : Draws::kAll,
                        true);
}

int CompositeTargets::addOpaque(SceneRasterizer& rasterizer, const Window& area) {
    if (!rasterizer.bounded()) return 0;
    // Draws only the opaque bound, since all other opaque fragments lie behind it.
    return drawUnsorted(rasterizer, area, Draws::kOpaque, false);
}

void CompositeTargets::blendOverBack(SceneRasterizer& rasterizer, const Window& area,
                                     GLuint texture) {
    rasterizer.functions().BindTextureUnit(PEELER_FRONT_UNIT, texture);
    rasterizer.drawFullScreen({.fragment_shader = "blend_texture.frag",
                               .framebuffer = framebuffer(rasterizer, kBack),
                               .blend = blending(kBack)},
                              area);
}

void CompositeTargets::resolve(SceneRasterizer& rasterizer, const Window& area,
                               const char* definitions) {
    const auto& gl = rasterizer.functions();
    std::string all = definitions;
    if (parts_ & kFront) all += " FRONT";
    if (parts_ & kBack) all += " BACK";
    if (parts_ & kTail) all += " TAIL";
    if (parts_ & kCoverage) all += " COVERAGE";
    gl.BindTextureUnit(PEELER_FRONT_UNIT, (parts_ & kCoverage) ? coverage_.name() : front_.name());
    gl.BindTextureUnit(PEELER_BACK_UNIT, back_.name());
    gl.BindTextureUnit(PEELER_TAIL_SUM_UNIT, tail_sum_.name());
    gl.BindTextureUnit(PEELER_TAIL_COUNT_UNIT, tail_count_.name());
    if (back_opacity_) gl.BindTextureUnit(PEELER_BACK_OPACITY_UNIT, back_opacity_.name());
    if (tail_opacity_) gl.BindTextureUnit(PEELER_TAIL_OPACITY_UNIT, tail_opacity_.name());
    rasterizer.compute("resolve.comp", all, area);
}

int compositeNearestFirst(SceneRasterizer& rasterizer, const CompositeArea& area,
                          LayerTargets& layers, CompositeTargets& targets) {
    constexpr auto kFront = CompositeTargets::kFront;
    int passes =
        layers.peel(rasterizer, area.window, area.layers, kNearestFirst, [&](int layer, int side) {
            layers.blend(rasterizer, area.window, side,
                         {.framebuffer = targets.framebuffer(rasterizer, kFront),
                          .blend = CompositeTargets::blending(kFront),
                          .argument = {{layer, 0, 0, 0}}});
        });
    if (area.tail) passes += targets.addTail(rasterizer, area.window, layers, area.layers);
    return passes;
}

}  // namespace peeler
