// SPDX-License-Identifier: Apache-2.0
#include "core/capture/scene_rasterizer.h"

#include <algorithm>
#include <array>
#include <cstring>
#include <span>

#include <peeler/error.h>
#include "core/gl/program.h"
#include "core/scene/framing.h"
#include "core/shading/lighting.h"
#include "shaders/interface.glsl"

namespace peeler {
namespace {

constexpr std::size_t kDrawStride = (sizeof(shader::DrawRecord) + 255) / 256 * 256;

struct Culling {
    bool front, back;
};

Culling culling(Faces faces, bool double_sided) {
    constexpr Culling kTable[] = {{false, true}, {false, true}, {true, false}, {false, false}};
    if (faces == Faces::kGltf && double_sided) return {false, false};
    return kTable[static_cast<std::size_t>(faces)];
}

void use(const gl::Program& program, const ShaderArgument& argument,
         const ShaderArgument& second = {}) {
    program.use();
    if (argument) program.set(0, (*argument)[0], (*argument)[1], (*argument)[2], (*argument)[3]);
    if (second) program.set(1, (*second)[0], (*second)[1], (*second)[2], (*second)[3]);
}

shader::Placement placementOf(const glm::dmat4& clip_from_model,
                              const glm::dmat4& view_from_model) {
    shader::Placement result{};
    result.clip_from_model = glm::mat4(clip_from_model);
    result.view_from_model = glm::mat4(view_from_model);
    const glm::dmat3 linear(view_from_model);
    if (glm::determinant(linear) != 0)
        result.normal_from_model = glm::mat4(glm::transpose(glm::inverse(linear)));
    return result;
}

}  // namespace

SceneRasterizer::SceneRasterizer(const gl::Context& context, const GpuScene& scene,
                                 const PassContext& pass_context)
    : context_(context),
      scene_(scene),
      pass_context_(pass_context),
      frame_record_(context.functions(), sizeof(shader::FrameRecord)),
      shaders_(context.functions(), scene, pass_context) {
    const auto& gl = functions();
    GLuint name = 0;
    gl.CreateSamplers(1, &name);
    nearest_ = gl::SamplerObject(gl, name);
    gl.SamplerParameteri(name, GL_TEXTURE_MIN_FILTER, GL_NEAREST);
    gl.SamplerParameteri(name, GL_TEXTURE_MAG_FILTER, GL_NEAREST);
    gl.CreateVertexArrays(1, &name);
    no_vertices_ = gl::VertexArray(gl, name);
}

void SceneRasterizer::begin() {
    boundary_nodes_ = pass_context_.settings.clip.nodes;
    std::sort(boundary_nodes_.begin(), boundary_nodes_.end());
    tile_ = band_ = {};
    frame_dirty_ = true;
    const int size = pass_context_.settings.point_size, most = context_.device().limits.point_size;
    if (size <= most) return;
    throw Error(ErrorKind::kUsage, "the driver cannot draw points of this size",
                Parameter::kPointSize + " " + std::to_string(size),
                "give at most " + std::to_string(most));
}

std::vector<Window> SceneRasterizer::tilesOf(const Window& area) const {
    std::vector<Window> tiles;
    const Window picture{0, 0, pass_context_.view.width, pass_context_.view.height};
    for (int y = area.y0 / kTileSize * kTileSize; y < area.y1; y += kTileSize)
        for (int x = area.x0 / kTileSize * kTileSize; x < area.x1; x += kTileSize)
            tiles.push_back(intersect({x, y, x + kTileSize, y + kTileSize}, picture));
    return tiles;
}

void SceneRasterizer::setTile(const Window& tile) {
    if (tile == tile_) return;
    tile_ = tile;
    frame_dirty_ = true;
    uploadDrawRecords();
    bound_missing_ = bounded();
}

void SceneRasterizer::setBand(const Window& band, std::uint32_t layers) {
    if (band == band_ && layers == layers_) return;
    // With clip meshes, the opaque bound depends on the meshes' boundary, which is known only for
    // the current band. So each band needs a new bound.
    if (band != band_ && !pass_context_.settings.clip.nodes.empty()) bound_missing_ = bounded();
    band_ = band;
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
    const double width = pass_context_.view.width, height = pass_context_.view.height;
    // GL samples at pixel centres, so the projection shifts the picture to put the sample position
    // there.
    const glm::dvec2 shift = pass_context_.view.sample - glm::dvec2(0.5);
    return pass_context_.view.projection.matrix(
        (tile_.x0 + shift.x) / width, (tile_.y0 + shift.y) / height, (tile_.x1 + shift.x) / width,
        (tile_.y1 + shift.y) / height);
}

void SceneRasterizer::fillClip(shader::FrameRecord& record) const {
    const ClipVolume& clip = pass_context_.settings.clip;
    const auto count = static_cast<int>(clip.half_spaces.size());
    record.clip = {count, clip.keep_inside ? 1 : 0, clip.nodes.empty() ? 0 : 1, 0};
    for (int i = 0; i < count; ++i) {
        // A plane transforms like a row vector, (n, −offset) · world_from_view.
        const ClipVolume::HalfSpace& half = clip.half_spaces[static_cast<std::size_t>(i)];
        const glm::dvec4 plane =
            glm::dvec4(half.normal, -half.offset) * pass_context_.view.camera_to_world;
        record.half_spaces[i] = glm::vec4(plane.x, plane.y, plane.z, -plane.w);
    }
}

void SceneRasterizer::uploadDrawRecords() {
    const DrawList& list = scene_.posed().drawList();
    const auto& draws = list.draws();
    screen_bounds_.assign(draws.size(), {});
    if (draws.empty()) return;
    std::size_t instances = 0;
    for (const Draw& draw : draws)
        instances += draw.instances > 1 ? draw.instances : 0;
    gl::reserve(functions(), draw_records_, draws.size() * kDrawStride);
    gl::reserve(functions(), instance_records_,
                std::max<std::size_t>(instances, 1) * sizeof(shader::Placement));
    const auto draw_memory = draw_records_.overwrite(draws.size() * kDrawStride);
    const auto instance_memory = instance_records_.overwrite(instance_records_.size());
    auto* const placements = instance_memory.as<shader::Placement>();
    std::uint32_t next_instance = 0;
    const glm::dmat4 clip_from_view = clipFromView();
    const glm::dmat4 view_from_world = glm::inverse(pass_context_.view.camera_to_world);
    for (std::size_t i = 0; i < draws.size(); ++i) {
        const Draw& draw = draws[i];
        shader::DrawRecord record{};
        record.ids = {draw.first_primitive, draw.instance_keys, draw.flags, next_instance};
        for (const glm::dmat4& world : list.worlds(draw)) {
            // Multiplies in double precision, so that large world coordinates cost no precision
            // near the camera.
            const glm::dmat4 view_from_model = view_from_world * world;
            const glm::dmat4 clip_from_model = clip_from_view * view_from_model;
            const Window bounds = screenBounds(scene_.geometry().box(draw), clip_from_model,
                                               tile_.width(), tile_.height());
            screen_bounds_[i] = unite(screen_bounds_[i], grown(bounds, draw));
            auto& target = draw.instances > 1 ? placements[next_instance++] : record.placement;
            target = placementOf(clip_from_model, view_from_model);
        }
        std::memcpy(draw_memory.as<std::byte>() + i * kDrawStride, &record, sizeof record);
    }
}

Window SceneRasterizer::drawnWindow() const {
    const DrawList& list = scene_.posed().drawList();
    const int width = pass_context_.view.width, height = pass_context_.view.height;
    const glm::dmat4 clip_from_world = pass_context_.view.projection.matrix(0, 0, 1, 1) *
                                       glm::inverse(pass_context_.view.camera_to_world);
    Window drawn;
    for (const Draw& draw : list.draws()) {
        for (const glm::dmat4& world : list.worlds(draw)) {
            // screenBounds() has y up, the picture y down.
            const Window bounds =
                screenBounds(scene_.geometry().box(draw), clip_from_world * world, width, height);
            drawn = unite(
                drawn, grown({bounds.x0, height - bounds.y1, bounds.x1, height - bounds.y0}, draw));
        }
    }
    return drawn;
}

/// Returns the bounds of a draw, enlarged by the point size for points and lines (conservative).
Window SceneRasterizer::grown(const Window& bounds, const Draw& draw) const {
    const int size = pass_context_.settings.point_size;
    if (bounds.empty() || size <= 1 || (draw.flags & PEELER_IS_TRIANGLES) != 0) return bounds;
    return {bounds.x0 - size, bounds.y0 - size, bounds.x1 + size, bounds.y1 + size};
}

void SceneRasterizer::bindFrame() {
    if (frame_dirty_) {
        shader::FrameRecord record{};
        record.world_from_view =
            glm::mat4(glm::dmat4(glm::dmat3(pass_context_.view.camera_to_world)));
        record.tile = {tile_.x0, tile_.y0, tile_.width(), tile_.height()};
        record.band = {band_.x0, band_.y0, band_.width(), band_.height()};
        record.limits = {layers_, 0, 0, 0};
        record.view_from_ndc = glm::mat4(glm::inverse(clipFromView()));
        fillClip(record);
        const auto mapping = frame_record_.overwrite(sizeof record);
        std::memcpy(mapping.as<std::byte>(), &record, sizeof record);
        frame_dirty_ = false;
    }
    frame_record_.bindUniform(PEELER_FRAME_BLOCK, 0, sizeof(shader::FrameRecord));
    if (pass_context_.lighting) pass_context_.lighting->bind();
    // Integer textures are incomplete with the default linear filters, so they need the nearest
    // sampler.
    for (GLuint unit = PEELER_MATERIAL_UNITS; unit <= PEELER_SHADOW_UNIT; ++unit)
        functions().BindSampler(unit, nearest_.name());
}

std::array<float, 2> SceneRasterizer::depthRange() const {
    const View& view = pass_context_.view;
    const std::optional<Bounds> bounds = scene_.posed().bounds();
    if (!bounds) return {1, 2};
    const DepthRange range = peeler::depthRange(*bounds, view.camera_to_world);
    const double farthest = std::max(std::min(range.farthest, view.projection.far), 1e-6);
    const double nearest = std::max({range.nearest, view.projection.near, 1e-4 * farthest});
    return {static_cast<float>(nearest), static_cast<float>(std::max(farthest, 1.001 * nearest))};
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
    if (pass_context_.settings.hit_mode != HitMode::kNone &&
        (draw.flags & PEELER_IS_TRIANGLES) == 0)
        return false;
    // The pass that renders the opaque bound is not `bounded`, so it always draws opaque surfaces.
    const bool hidden =
        pass.bounded && pass_context_.settings.surfaces == Surfaces::kTransparent && draw.opaque;
    const bool boundary =
        std::binary_search(boundary_nodes_.begin(), boundary_nodes_.end(), draw.node);
    if (boundary && (draw.flags & PEELER_IS_TRIANGLES) == 0) return false;
    if (boundary || pass.draws == Draws::kClipMeshes)
        return boundary && pass.draws == Draws::kClipMeshes;
    if (hidden || (pass_context_.settings.opaque_only && !draw.opaque)) return false;
    return pass.draws == Draws::kAll || (pass.draws == Draws::kOpaque) == draw.opaque;
}

void SceneRasterizer::drawFullScreen(const FullScreenPass& pass, const Window& area) {
    const auto& gl = functions();
    gl::PassState state = passState(pass.framebuffer, area);
    state.depth_test = pass.depth_test;
    state.blend = pass.blend;
    gl::apply(gl, state);
    gl.Disable(GL_CULL_FACE);
    bindFrame();
    use(shaders_.program({"full_screen.vert", pass.fragment_shader}, pass.definitions),
        pass.argument);
    gl.BindVertexArray(no_vertices_.name());
    gl.DrawArrays(GL_TRIANGLES, 0, 3);
}

void SceneRasterizer::compute(std::string_view shader, std::string_view definitions,
                              const Window& area, const ShaderArgument& second) {
    constexpr int kGroup = 16;  // local_size_x and local_size_y of every compute shader
    const Window inside = inTile(area);
    bindFrame();
    use(shaders_.program({shader}, definitions), {{inside.x0, inside.y0, inside.x1, inside.y1}},
        second);
    functions().DispatchCompute(static_cast<GLuint>((inside.width() + kGroup - 1) / kGroup),
                                static_cast<GLuint>((inside.height() + kGroup - 1) / kGroup), 1);
    functions().MemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT);
}

void SceneRasterizer::draw(const GeometryPass& pass, const Window& area) {
    const auto& gl = functions();
    if (pass.bounded && bound_missing_) renderOpaqueBound();
    gl::PassState state = passState(pass.framebuffer, area);
    state.depth_test = pass.depth_test;
    state.depth_clamp = pass.draws == Draws::kClipMeshes || pass_context_.settings.depth_clamp;
    state.multisampled = pass.multisampled;
    // Lists, clipping and alpha tests have the accuracy of samples.
    const bool lists_or_clips = pass.in_front || pass_context_.settings.clip.active();
    state.blend = pass.blend;
    gl::apply(gl, state);
    gl.PointSize(static_cast<GLfloat>(pass_context_.settings.point_size));
    bindFrame();
    if (pass.bounded && bounded()) {
        gl.BindTextureUnit(PEELER_OPAQUE_DEPTH_UNIT, bound_depth_.name());
        gl.BindTextureUnit(PEELER_OPAQUE_PRIMITIVE_UNIT, bound_primitive_.name());
    }
    const gl::Program* current = nullptr;
    std::size_t material = static_cast<std::size_t>(-1);
    // The buffer does not exist if there are no draws.
    if (instance_records_) instance_records_.bindStorage(PEELER_INSTANCES);
    const auto& draws = scene_.posed().drawList().draws();
    const Window scissor = inTile(area);
    for (std::size_t i = 0; i < draws.size(); ++i) {
        const Draw& draw = draws[i];
        if (intersect(screen_bounds_[i], scissor).empty() || !shown(pass, draw)) continue;

        const gl::Program& wanted = shaders_.variant(pass, draw);
        if (&wanted != current) use(wanted, pass.argument);
        current = &wanted;
        if (draw.material != material) {
            material = draw.material;
            bindMaterial(material);
        }
        const Faces faces =
            pass.draws == Draws::kClipMeshes ? Faces::kBoth : pass_context_.settings.faces;
        const Culling cull = culling(faces, scene_.materials()[material].double_sided);
        if (cull.front || cull.back) {
            gl.Enable(GL_CULL_FACE);
            gl.CullFace(cull.front ? GL_FRONT : GL_BACK);
        } else {
            gl.Disable(GL_CULL_FACE);
        }
        gl.FrontFace(draw.mirrored ? GL_CW : GL_CCW);
        if (pass.multisampled)
            gl::setEnabled(gl, GL_SAMPLE_SHADING, lists_or_clips || draw.alpha_tested);
        draw_records_.bindUniform(PEELER_DRAW_BLOCK, i * kDrawStride, sizeof(shader::DrawRecord));
        submit(draw);
    }
}

void SceneRasterizer::bindMaterial(std::size_t material) const {
    const auto& gl = functions();
    scene_.bindMaterialRecord(material);
    const GpuMaterial& gpu = scene_.materials()[material];
    for (GLuint unit = 0; unit < PEELER_MATERIAL_UNITS; ++unit) {
        if (!gpu.bindings[unit].texture) continue;
        gl.BindTextureUnit(unit, gpu.bindings[unit].texture);
        gl.BindSampler(unit, gpu.bindings[unit].sampler);
    }
}

void SceneRasterizer::shadeHits(std::span<const HitGroup> groups,
                                const std::array<glm::dvec2, kPixelSamples>* positions) {
    constexpr std::uint32_t kGroup = 64;  // local_size_x of shade_hits.comp
    const GeometryPass pass{.fragment_shader = "shade_hits.comp",
                            .definitions = positions ? "SEVERAL_SAMPLES" : "",
                            .shades = true,
                            .bounded = false};
    ShaderArgument packed_positions;
    if (positions) {
        packed_positions.emplace();
        for (std::size_t i = 0; i < kPixelSamples; ++i) {
            const glm::ivec2 at = glm::round(16.0 * (*positions)[i]);
            (*packed_positions)[i] = at.x + 256 * (16 - at.y);
        }
    }
    bindFrame();
    const auto& draws = scene_.posed().drawList().draws();
    std::uint32_t first = 0;
    for (const auto& [index, hits] : groups) {
        const Draw& draw = draws[index];
        use(shaders_.variant(pass, draw), {{static_cast<int>(first), static_cast<int>(hits), 0, 0}},
            packed_positions);
        bindMaterial(draw.material);
        functions().DispatchCompute((hits + kGroup - 1) / kGroup, 1, 1);
        // Groups have no hits in common, but their shaders access the same buffer.
        functions().MemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT);
        first += hits;
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
    const Window area = pass_context_.settings.clip.nodes.empty() ? tile_ : intersect(tile_, band_);
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
    gl::clear(gl, passState(framebuffer, area), 0xFFFFFFFFU);
    draw({.fragment_shader = "opaque_depth.frag",
          .draws = Draws::kOpaque,
          .bounded = false,
          .framebuffer = framebuffer,
          .depth_test = gl::DepthTest::kNearest},
         area);
}

}  // namespace peeler
