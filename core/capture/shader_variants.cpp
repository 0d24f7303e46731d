// SPDX-License-Identifier: Apache-2.0
#include "core/capture/passes.h"

#include <iterator>
#include <sstream>
#include <utility>

#include <peeler/channels.h>
#include "core/shading/lighting.h"
#include "core/shading/materials.h"
#include "shaders/interface.glsl"

namespace peeler {
namespace {

// Bits of a variant; kDefinitions has their shader definitions (shaders/README.md, "Macros").
enum ShaderBit : unsigned {
    kVaryings = 1,
    kTextured = 2,
    kAlphaTest = 4,
    kUnlit = 8,
    kBounded = 16,
    kPunctual = 32,
    kShadowed = 64,
    kClipped = 128,
    kInstanced = 256,
    kEnvironment = 512,
    kOrthographic = 1024,
    kInFront = 2048,
    kMultisampled = 4096,
    kFirstFeature = 8192,  // first of materialFeatures()
};
constexpr std::pair<unsigned, const char*> kDefinitions[] = {
    {kVaryings, "VARYINGS"},         {kTextured, "TEXTURED"},
    {kAlphaTest, "ALPHA_TEST"},      {kUnlit, "UNLIT"},
    {kBounded, "BOUNDED"},           {kPunctual, "PUNCTUAL"},
    {kShadowed, "SHADOWED"},         {kClipped, "CLIPPED"},
    {kInstanced, "INSTANCED"},       {kEnvironment, "ENVIRONMENT"},
    {kOrthographic, "ORTHOGRAPHIC"}, {kInFront, "IN_FRONT"},
    {kMultisampled, "MULTISAMPLED"},
};

/// Returns the bits of the features that affect unlit surfaces, too.
unsigned alphaFeatures() {
    unsigned bits = 0;
    for (std::size_t i = 0; i < materialFeatures().size(); ++i)
        if (materialFeatures()[i].changes_alpha) bits |= 1U << i;
    return bits;
}

/// Returns the definition of the fragment storage (shaders/stored_fragments.glsl).
std::string_view storedAs(const CaptureSettings& settings) {
    if (settings.hit_mode == HitMode::kSloped) return "SLOPES";
    if (settings.hit_mode != HitMode::kNone) return "KEYS_ONLY";
    const bool floats = settings.color_type == PixelType::kFloat;
    if (settings.tinted) return floats ? "COLOR_FLOAT TINTED" : "TINTED";
    return floats ? "COLOR_FLOAT" : "";
}

}  // namespace

const gl::Program& ShaderVariants::program(const std::vector<std::string_view>& files,
                                           std::string_view definitions) {
    std::string key(definitions);
    key.append(" ").append(storedAs(pass_context_.settings));
    std::istringstream words(key);
    const std::vector<std::string> list{std::istream_iterator<std::string>(words), {}};
    for (const auto& file : files)
        key += " " + std::string(file);
    const auto found = programs_.find(key);
    if (found != programs_.end()) return found->second;
    return programs_.emplace(key, gl::Program(gl_, files, list)).first->second;
}

const gl::Program& ShaderVariants::variant(const GeometryPass& pass, const Draw& draw) {
    const Variant wanted = variantOf(pass, draw);
    const gl::Program*& cached = variants_[{pass.fragment_shader, pass.definitions, wanted}];
    if (!cached) {
        std::vector<std::string_view> files{pass.fragment_shader};
        if (!pass.fragment_shader.ends_with(".comp")) files.insert(files.begin(), "scene.vert");
        cached = &program(files, definitionsOf(pass, wanted));
    }
    return *cached;
}

unsigned ShaderVariants::lightBits() const {
    unsigned bits = 0;
    if (const Lighting* lighting = pass_context_.lighting) {
        if (lighting->punctual()) bits |= kPunctual;
        if (lighting->shadowed()) bits |= kShadowed;
        if (lighting->environment()) bits |= kEnvironment;
    }
    if (!pass_context_.view.projection.perspective) bits |= kOrthographic;
    return bits;
}

ShaderVariants::Variant ShaderVariants::variantOf(const GeometryPass& pass,
                                                  const Draw& draw) const {
    constexpr std::uint32_t kAlpha = PEELER_ALPHA_MASK | PEELER_ALPHA_BLEND;
    constexpr std::uint32_t kBaseColor = PEELER_FIRST_TEXTURE_BIT << PEELER_BASE_COLOR_UNIT;
    constexpr std::uint32_t kAll = ~std::uint32_t{0};
    const GpuMaterial& material = scene_.materials()[draw.material];
    const CaptureSettings& settings = pass_context_.settings;
    Variant v;
    v.stored = storedAs(settings);
    std::uint32_t looks_at = 0;  // flags of the material record that the pass uses
    if (pass.describes) {
        v.bits = kVaryings | material.features * kFirstFeature;
        looks_at = kAll;
        for (const Channel channel : settings.channels)
            v.channels |= 1U << static_cast<unsigned>(channel);
    } else if (pass.shades) {
        const bool unlit = settings.shading == Shading::kUnlit || material.unlit;
        const unsigned features = material.features & (unlit ? alphaFeatures() : ~0U);
        v.bits = kVaryings | (unlit ? kUnlit : lightBits()) | features * kFirstFeature;
        // An unlit surface shows only its base colour.
        looks_at = unlit && features == 0 ? kAlpha | kBaseColor : kAll;
    } else if (draw.alpha_tested && pass.draws != Draws::kClipMeshes) {
        v.bits = kVaryings | kAlphaTest;
        looks_at = kAlpha | kBaseColor;
    }
    v.material_flags = material.flags.x & looks_at;
    const std::uint32_t textures = v.material_flags / PEELER_FIRST_TEXTURE_BIT;
    v.transformed = material.flags.y & textures;
    v.second_uv = material.flags.z & textures;
    if (v.material_flags >= PEELER_FIRST_TEXTURE_BIT) v.bits |= kTextured;
    if (looks_at == kAll)
        v.draw_flags = draw.flags & ~PEELER_MIRRORED;  // PEELER_MIRRORED is a run-time flag
    else if (looks_at != 0)
        v.draw_flags = draw.flags & PEELER_HAS_COLORS;

    if (pass.bounded && settings.surfaces != Surfaces::kAll) v.bits |= kBounded;
    if (pass.in_front) v.bits |= kInFront;
    if (pass.multisampled) v.bits |= kMultisampled;
    if (settings.clip.active() && pass.draws != Draws::kClipMeshes) v.bits |= kClipped;
    if (draw.instances > 1) v.bits |= kInstanced;
    return v;
}

std::string ShaderVariants::definitionsOf(const GeometryPass& pass, const Variant& variant) const {
    std::string definitions(pass.definitions);
    const auto add = [&](std::string_view definition) {
        definitions.append(" ").append(definition);
    };
    if (pass.describes) {
        for (const Channel channel : pass_context_.settings.channels)
            add(infoOf(channel).definition);
    }
    for (const auto& [bit, definition] : kDefinitions)
        if (variant.bits & bit) add(definition);
    for (std::size_t i = 0; i < materialFeatures().size(); ++i)
        if (variant.bits & kFirstFeature << i) add(materialFeatures()[i].definition);
    add("MATERIAL_FLAGS=" + std::to_string(variant.material_flags) + "u");
    add("DRAW_FLAGS=" + std::to_string(variant.draw_flags) + "u");
    add("TRANSFORMED_TEXTURES=" + std::to_string(variant.transformed) + "u");
    add("SECOND_UV_TEXTURES=" + std::to_string(variant.second_uv) + "u");
    add("GEOMETRY");
    return definitions;
}

}  // namespace peeler
