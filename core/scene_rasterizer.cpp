// SPDX-License-Identifier: Apache-2.0
#include "core/scene_rasterizer.h"

#include <algorithm>
#include <cstring>
#include <iterator>
#include <span>
#include <sstream>
#include <string>

#include "core/error.h"
#include "core/material_record.h"
#include "shaders/interface.glsl"

namespace peeler {
namespace {

constexpr std::size_t kDrawStride = (sizeof(shader::DrawRecord) + 255) / 256 * 256;

// The shader variants: a bit and the definition it stands for.
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
    kFirstFeature = 2048,  // of a material, see materialFeatures()
};
constexpr std::pair<unsigned, const char*> kDefinitions[] = {
    {kVaryings, "VARYINGS"},         {kTextured, "TEXTURED"},
    {kAlphaTest, "ALPHA_TEST"},      {kUnlit, "UNLIT"},
    {kBounded, "BOUNDED"},           {kPunctual, "PUNCTUAL"},
    {kShadowed, "SHADOWED"},         {kClipped, "CLIPPED"},
    {kInstanced, "INSTANCED"},       {kEnvironment, "ENVIRONMENT"},
    {kOrthographic, "ORTHOGRAPHIC"},
};

/// Those that an unlit surface has, too.
unsigned alphaFeatures() {
    unsigned bits = 0;
    for (std::size_t i = 0; i < materialFeatures().size(); ++i)
        if (materialFeatures()[i].changes_alpha) bits |= 1U << i;
    return bits;
}

/// See fragments.glsl.
std::string_view storedAs(const CaptureSettings& settings) {
    if (settings.hits == Hits::kSloped) return "SLOPES";
    if (settings.hits != Hits::kNone) return "KEYS_ONLY";
    return settings.color_type == PixelType::kFloat ? "COLOR_FLOAT" : "";
}

struct Culling {
    bool front, back;
};

Culling culling(Faces faces, bool double_sided) {
    constexpr Culling kTable[] = {{false, true}, {false, true}, {true, false}, {false, false}};
    if (faces == Faces::kGltf && double_sided) return {false, false};
    return kTable[static_cast<std::size_t>(faces)];
}

void use(const gl::Program& program, const ShaderArgument& argument) {
    program.use();
    if (argument) program.set(0, (*argument)[0], (*argument)[1], (*argument)[2], (*argument)[3]);
}

}  // namespace

SceneRasterizer::SceneRasterizer(const gl::Context& context, const GpuScene& scene)
    : context_(context),
      scene_(scene),
      frame_record_(context.functions(), sizeof(shader::FrameRecord)) {
    const auto& gl = functions();
    GLuint name = 0;
    gl.CreateSamplers(1, &name);
    nearest_ = gl::SamplerObject(gl, name);
    gl.SamplerParameteri(name, GL_TEXTURE_MIN_FILTER, GL_NEAREST);
    gl.SamplerParameteri(name, GL_TEXTURE_MAG_FILTER, GL_NEAREST);
    gl.CreateVertexArrays(1, &name);
    no_vertices_ = gl::VertexArray(gl, name);
}

void SceneRasterizer::setView(const View& view, const CaptureSettings& settings) {
    // They are made for these.
    if (settings.channels != settings_.channels || storedAs(settings) != storedAs(settings_))
        variants_.clear();
    view_ = view;
    settings_ = settings;
    boundary_nodes_ = settings.clip.nodes;
    std::sort(boundary_nodes_.begin(), boundary_nodes_.end());
    tile_ = band_ = {};
}

std::vector<Window> SceneRasterizer::tilesOf(const Window& area) const {
    std::vector<Window> tiles;
    const Window picture{0, 0, view_.width, view_.height};
    for (int y = area.y0 / kTileSize * kTileSize; y < area.y1; y += kTileSize)
        for (int x = area.x0 / kTileSize * kTileSize; x < area.x1; x += kTileSize)
            tiles.push_back(intersect({x, y, x + kTileSize, y + kTileSize}, picture));
    return tiles;
}

void SceneRasterizer::setTile(const Window& tile) {
    if (tile == tile_) return;
    tile_ = tile;
    frame_dirty_ = true;
    functions().Finish();  // the records are about to be overwritten
    uploadDrawRecords();
    bound_missing_ = bounded();
}

void SceneRasterizer::setBand(const Window& band, std::uint32_t capacity, std::uint32_t layers) {
    if (band == band_ && capacity == capacity_ && layers == layers_) return;
    // The boundary of a clip mesh is known in one band at a time.
    if (band != band_ && !settings_.clip.nodes.empty()) bound_missing_ = bounded();
    band_ = band;
    capacity_ = capacity;
    layers_ = layers;
    frame_dirty_ = true;
}

Window SceneRasterizer::inTile(const Window& area) const {
    return {area.x0 - tile_.x0, tile_.y1 - area.y1, area.x1 - tile_.x0, tile_.y1 - area.y0};
}

std::uint64_t SceneRasterizer::boundBytes(std::uint64_t tile_pixels) const {
    return bounded() ? tile_pixels * 8 : 0;
}

void SceneRasterizer::freeBound() {
    bound_framebuffer_ = {};
    bound_depth_ = {};
    bound_primitive_ = {};
    bound_missing_ = bounded();
}

glm::dmat4 SceneRasterizer::clipFromView() const {
    const double width = view_.width, height = view_.height;
    // GL samples at pixel centres: the picture is shifted until the wanted place is there.
    const glm::dvec2 shift = view_.sample - glm::dvec2(0.5);
    return view_.projection.matrix((tile_.x0 + shift.x) / width, (tile_.y0 + shift.y) / height,
                                   (tile_.x1 + shift.x) / width, (tile_.y1 + shift.y) / height);
}

void SceneRasterizer::fillClip(shader::FrameRecord& record) const {
    const ClipVolume& clip = settings_.clip;
    const auto count = static_cast<int>(clip.half_spaces.size());
    record.clip = {count, clip.keep_inside ? 1 : 0, clip.nodes.empty() ? 0 : 1, 0};
    for (int i = 0; i < count; ++i) {
        // A plane transforms like a row vector, (n, −offset) · world_from_view.
        const ClipVolume::HalfSpace& half = clip.half_spaces[static_cast<std::size_t>(i)];
        const glm::dvec4 plane = glm::dvec4(half.normal, -half.offset) * view_.camera_to_world;
        record.half_spaces[i] = glm::vec4(plane.x, plane.y, plane.z, -plane.w);
    }
}

void SceneRasterizer::uploadDrawRecords() {
    const glm::dmat4 clip_from_view = clipFromView();
    const glm::dmat4 view_from_world = glm::inverse(view_.camera_to_world);
    const auto placement = [&](const glm::dmat4& world) {
        // All products in double, so that large world coordinates cost no precision near the
        // camera.
        const glm::dmat4 view_from_model = view_from_world * world;
        shader::Placement result{};
        result.clip_from_model = glm::mat4(clip_from_view * view_from_model);
        result.view_from_model = glm::mat4(view_from_model);
        const glm::dmat3 linear(view_from_model);
        if (glm::determinant(linear) != 0)
            result.normal_from_model = glm::mat4(glm::transpose(glm::inverse(linear)));
        return result;
    };
    const DrawList& list = scene_.list();
    const auto& draws = list.draws();
    screen_bounds_.assign(draws.size(), {});
    if (draws.empty()) return;
    std::size_t instances = 0;
    for (const Draw& draw : draws)
        instances += draw.instances > 1 ? draw.instances : 0;
    reserve(draw_records_, draws.size() * kDrawStride);
    reserve(instance_records_, std::max<std::size_t>(instances, 1) * sizeof(shader::Placement));
    const auto draw_memory = draw_records_.overwrite(draws.size() * kDrawStride);
    const auto instance_memory = instance_records_.overwrite(instance_records_.size());
    auto* next_instance = instance_memory.as<shader::Placement>();
    std::uint32_t first_instance = 0;
    for (std::size_t i = 0; i < draws.size(); ++i) {
        const std::span<const glm::dmat4> worlds = list.worlds(draws[i]);
        const Box& box = scene_.geometry().box(draws[i]);
        for (const glm::dmat4& world : worlds) {
            screen_bounds_[i] =
                unite(screen_bounds_[i], screenBounds(box, clip_from_view * view_from_world * world,
                                                      tile_.width(), tile_.height()));
        }
        shader::DrawRecord record{};
        record.ids = {draws[i].first_primitive, draws[i].instance_keys, draws[i].flags,
                      first_instance};
        if (worlds.size() == 1) {
            record.placement = placement(worlds.front());
        } else {
            next_instance = std::transform(worlds.begin(), worlds.end(), next_instance, placement);
            first_instance += static_cast<std::uint32_t>(worlds.size());
        }
        std::memcpy(draw_memory.as<std::byte>() + i * kDrawStride, &record, sizeof record);
    }
}

void SceneRasterizer::reserve(gl::Buffer& buffer, std::size_t bytes) const {
    if (buffer.size() < bytes) buffer = gl::Buffer(functions(), bytes);
}

void SceneRasterizer::bindFrame() {
    if (frame_dirty_) {
        functions().Finish();
        shader::FrameRecord record{};
        record.world_from_view = glm::mat4(glm::dmat4(glm::dmat3(view_.camera_to_world)));
        record.tile = {tile_.x0, tile_.y0, tile_.width(), tile_.height()};
        record.band = {band_.x0, band_.y0, band_.width(), 0};
        record.limits = {capacity_, layers_, 0, 0};
        record.view_from_ndc = glm::mat4(glm::inverse(clipFromView()));
        fillClip(record);
        const auto mapping = frame_record_.overwrite(sizeof record);
        std::memcpy(mapping.as<std::byte>(), &record, sizeof record);
        frame_dirty_ = false;
    }
    frame_record_.bindUniform(PEELER_FRAME_BLOCK, 0, sizeof(shader::FrameRecord));
    if (lighting_) lighting_->bind();
    // Without it an integer texture is incomplete: filters are linear unless told.
    for (GLuint unit = PEELER_MATERIAL_UNITS; unit <= PEELER_SHADOW_UNIT; ++unit)
        functions().BindSampler(unit, nearest_.name());
}

const gl::Program& SceneRasterizer::program(const std::vector<std::string_view>& files,
                                            std::string_view definitions) {
    std::string key(definitions);
    key.append(" ").append(storedAs(settings_));
    std::istringstream words(key);
    const std::vector<std::string> list{std::istream_iterator<std::string>(words), {}};
    for (const auto& file : files)
        key += " " + std::string(file);
    const auto found = programs_.find(key);
    if (found != programs_.end()) return found->second;
    return programs_.emplace(key, gl::Program(functions(), files, list)).first->second;
}

SceneRasterizer::Variant SceneRasterizer::variantOf(const GeometryPass& pass,
                                                    const Draw& draw) const {
    constexpr std::uint32_t kAlpha = PEELER_ALPHA_MASK | PEELER_ALPHA_BLEND;
    constexpr std::uint32_t kBaseColor = PEELER_FIRST_TEXTURE_BIT << PEELER_BASE_COLOR_UNIT;
    constexpr std::uint32_t kAll = ~std::uint32_t{0};
    const GpuMaterial& material = scene_.materials()[draw.material];
    Variant v;
    std::uint32_t looks_at = 0;  // which of the material's flags
    if (pass.describes) {
        v.bits = kVaryings | material.features * kFirstFeature;
        looks_at = kAll;
    } else if (pass.shades) {
        v.bits = kVaryings;
        const bool unlit = settings_.shading == Shading::kUnlit || material.unlit;
        if (unlit) v.bits |= kUnlit;
        if (!unlit && lighting_ && lighting_->punctual()) v.bits |= kPunctual;
        if (!unlit && lighting_ && lighting_->shadowed()) v.bits |= kShadowed;
        if (!unlit && lighting_ && lighting_->environment()) v.bits |= kEnvironment;
        if (!unlit && !view_.projection.perspective) v.bits |= kOrthographic;
        const unsigned features = material.features & (unlit ? alphaFeatures() : ~0U);
        v.bits |= features * kFirstFeature;
        // An unlit surface shows its base colour alone.
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
        v.draw_flags = draw.flags & ~PEELER_MIRRORED;  // which the vertex shader reads
    else if (looks_at != 0)
        v.draw_flags = draw.flags & PEELER_HAS_COLORS;

    if (pass.bounded && bounded()) v.bits |= kBounded;
    if (settings_.clip.active() && pass.draws != Draws::kClipMeshes) v.bits |= kClipped;
    if (draw.instances > 1) v.bits |= kInstanced;
    return v;
}

const gl::Program& SceneRasterizer::variant(const GeometryPass& pass, const Draw& draw) {
    const Variant wanted = variantOf(pass, draw);
    const gl::Program*& cached = variants_[{pass.fragment_shader, pass.definitions, wanted}];
    if (!cached) {
        std::string definitions(pass.definitions);
        const auto add = [&](std::string_view definition) {
            definitions.append(" ").append(definition);
        };
        if (pass.describes) {
            for (const Channel channel : settings_.channels)
                add(infoOf(channel).definition);
        }
        for (const auto& [bit, definition] : kDefinitions)
            if (wanted.bits & bit) add(definition);
        for (std::size_t i = 0; i < materialFeatures().size(); ++i)
            if (wanted.bits & kFirstFeature << i) add(materialFeatures()[i].definition);
        add("MATERIAL_FLAGS=" + std::to_string(wanted.material_flags) + "u");
        add("DRAW_FLAGS=" + std::to_string(wanted.draw_flags) + "u");
        add("TRANSFORMED_TEXTURES=" + std::to_string(wanted.transformed) + "u");
        add("SECOND_UV_TEXTURES=" + std::to_string(wanted.second_uv) + "u");
        add("GEOMETRY");
        cached = &program({"scene.vert", pass.fragment_shader}, definitions);
    }
    return *cached;
}

gl::PassState SceneRasterizer::passState(GLuint framebuffer, const Window& area) const {
    const Window scissor = inTile(area);
    return {.framebuffer = framebuffer,
            .viewport_width = tile_.width(),
            .viewport_height = tile_.height(),
            .scissor_x = scissor.x0,
            .scissor_y = scissor.y0,
            .scissor_width = scissor.width(),
            .scissor_height = scissor.height()};
}

bool SceneRasterizer::shown(const GeometryPass& pass, const Draw& draw) const {
    if (settings_.hits != Hits::kNone && (draw.flags & PEELER_IS_TRIANGLES) == 0) return false;
    // The pass that finds the bound is the one for which opaque surfaces are always there.
    const bool hidden = pass.bounded && settings_.surfaces == Surfaces::kTransparent && draw.opaque;
    const bool boundary =
        std::binary_search(boundary_nodes_.begin(), boundary_nodes_.end(), draw.node);
    if (boundary && (draw.flags & PEELER_IS_TRIANGLES) == 0) return false;
    if (boundary || pass.draws == Draws::kClipMeshes)
        return boundary && pass.draws == Draws::kClipMeshes;
    if (hidden || (settings_.opaque_only && !draw.opaque)) return false;
    return pass.draws == Draws::kAll || (pass.draws == Draws::kOpaque) == draw.opaque;
}

void SceneRasterizer::cover(const CoverPass& pass, const Window& area) {
    const auto& gl = functions();
    gl::PassState state = passState(pass.framebuffer, area);
    state.depth_test = pass.depth_test;
    state.blend = pass.blend;
    gl::apply(gl, state);
    gl.Disable(GL_CULL_FACE);
    bindFrame();
    use(program({"cover.vert", pass.fragment_shader}, pass.definitions), pass.argument);
    gl.BindVertexArray(no_vertices_.name());
    gl.DrawArrays(GL_TRIANGLES, 0, 3);
}

void SceneRasterizer::compute(std::string_view shader, std::string_view definitions,
                              const Window& area) {
    constexpr int kGroup = 16;  // local_size_x and _y of every compute shader
    const Window inside = inTile(area);
    bindFrame();
    use(program({shader}, definitions), {{inside.x0, inside.y0, inside.x1, inside.y1}});
    functions().DispatchCompute(static_cast<GLuint>((inside.width() + kGroup - 1) / kGroup),
                                static_cast<GLuint>((inside.height() + kGroup - 1) / kGroup), 1);
    functions().MemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT);
}

void SceneRasterizer::draw(const GeometryPass& pass, const Window& area) {
    const auto& gl = functions();
    if (pass.bounded && bound_missing_) renderOpaqueBound();
    gl::PassState state = passState(pass.framebuffer, area);
    state.depth_test = pass.depth_test;
    state.depth_clamp = pass.draws == Draws::kClipMeshes || settings_.depth_clamp;
    state.blend = pass.blend;
    gl::apply(gl, state);
    bindFrame();
    if (pass.bounded && bounded()) {
        gl.BindTextureUnit(PEELER_OPAQUE_DEPTH_UNIT, bound_depth_.name());
        gl.BindTextureUnit(PEELER_OPAQUE_PRIMITIVE_UNIT, bound_primitive_.name());
    }
    const gl::Program* current = nullptr;
    std::size_t material = static_cast<std::size_t>(-1);
    if (instance_records_) instance_records_.bindStorage(PEELER_INSTANCES);  // none: no draws
    const auto& draws = scene_.list().draws();
    const Window scissor = inTile(area);
    for (std::size_t i = 0; i < draws.size(); ++i) {
        const Draw& draw = draws[i];
        if (intersect(screen_bounds_[i], scissor).empty() || !shown(pass, draw)) continue;

        const gl::Program& wanted = variant(pass, draw);
        if (&wanted != current) use(wanted, pass.argument);
        current = &wanted;
        if (draw.material != material) {
            material = draw.material;
            scene_.bindMaterialRecord(material);
            const GpuMaterial& gpu = scene_.materials()[material];
            for (GLuint unit = 0; unit < PEELER_MATERIAL_UNITS; ++unit) {
                if (!gpu.bindings[unit].texture) continue;
                gl.BindTextureUnit(unit, gpu.bindings[unit].texture);
                gl.BindSampler(unit, gpu.bindings[unit].sampler);
            }
        }
        const Faces faces = pass.draws == Draws::kClipMeshes ? Faces::kBoth : settings_.faces;
        const Culling cull = culling(faces, scene_.materials()[material].double_sided);
        if (cull.front || cull.back) {
            gl.Enable(GL_CULL_FACE);
            gl.CullFace(cull.front ? GL_FRONT : GL_BACK);
        } else {
            gl.Disable(GL_CULL_FACE);
        }
        gl.FrontFace(draw.mirrored ? GL_CW : GL_CCW);
        draw_records_.bindUniform(PEELER_DRAW_BLOCK, i * kDrawStride, sizeof(shader::DrawRecord));
        submit(draw);
    }
}

void SceneRasterizer::submit(const Draw& draw) const {
    const auto& gl = functions();
    gl.BindVertexArray(scene_.geometry().vertexArray(draw));
    const auto mode = static_cast<GLenum>(draw.topology);
    const auto instances = static_cast<GLsizei>(draw.instances);
    const auto* indices = reinterpret_cast<const void*>(scene_.geometry().indexOffset(draw));
    if (draw.indexed)
        gl.DrawElementsInstanced(mode, draw.count, GL_UNSIGNED_INT, indices, instances);
    else
        gl.DrawArraysInstanced(mode, 0, draw.count, instances);
}

void SceneRasterizer::renderOpaqueBound() {
    const auto& gl = functions();
    const Window area = settings_.clip.nodes.empty() ? tile_ : intersect(tile_, band_);
    const Window size{0, 0, tile_.width(), tile_.height()};
    if (!bound_framebuffer_ || size != bound_size_) {
        freeBound();
        bound_depth_ = gl::makeTexture2D(gl, GL_DEPTH_COMPONENT32F, size.x1, size.y1);
        bound_primitive_ = gl::makeTexture2D(gl, GL_R32UI, size.x1, size.y1);
        bound_framebuffer_ =
            gl::makeFramebuffer(gl, {bound_primitive_.name()}, bound_depth_.name());
        bound_size_ = size;
    }
    bound_missing_ = false;
    const GLuint framebuffer = bound_framebuffer_.name();
    gl::PassState clearing = passState(framebuffer, area);
    clearing.depth_test = gl::DepthTest::kNearest;  // a clear heeds the depth mask
    gl::apply(gl, clearing);
    const float far = 0;
    const GLuint none[4] = {0xFFFFFFFFU, 0, 0, 0};
    gl.ClearNamedFramebufferfv(framebuffer, GL_DEPTH, 0, &far);
    gl.ClearNamedFramebufferuiv(framebuffer, GL_COLOR, 0, none);
    draw({.fragment_shader = "opaque_depth.frag",
          .draws = Draws::kOpaque,
          .bounded = false,
          .framebuffer = framebuffer,
          .depth_test = gl::DepthTest::kNearest},
         area);
}

}  // namespace peeler
