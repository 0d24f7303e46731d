// SPDX-License-Identifier: Apache-2.0
#include "support/capture.h"

#include <gtest/gtest.h>

#include <Imath/half.h>

#include <cmath>
#include <cstring>
#include <stdexcept>
#include <thread>

#include "core/gl/functions.h"
#include "core/raster/hit_rasterizer.h"
#include "support/test_support.h"

namespace peeler::test {

SceneBuilder::SceneBuilder() {
    scene_.scenes.push_back({"test", {}});
    scene_.materials.emplace_back();
}

int SceneBuilder::material(const glm::vec4& rgba, AlphaMode mode, bool double_sided) {
    Material m;
    m.base_color = rgba;
    m.alpha_mode = mode;
    m.double_sided = double_sided;
    m.unlit = true;
    scene_.materials.push_back(m);
    return static_cast<int>(scene_.materials.size()) - 1;
}

int SceneBuilder::triangles(const std::vector<glm::vec3>& positions, int material,
                            const glm::dmat4& placement) {
    Primitive p;
    p.positions = positions;
    p.material = material;
    scene_.meshes.push_back({"mesh", {p}});
    return instance(static_cast<int>(scene_.meshes.size()) - 1, placement);
}

int SceneBuilder::quad(const glm::vec3& a, const glm::vec3& b, const glm::vec3& c,
                       const glm::vec3& d, int material, const glm::dmat4& placement) {
    return triangles({a, b, c, a, c, d}, material, placement);
}

int SceneBuilder::rectangle(float w, float h, float z, int material) {
    return quad({-w, -h, z}, {w, -h, z}, {w, h, z}, {-w, h, z}, material);
}

int SceneBuilder::sphere(const glm::vec3& center, float radius, int material) {
    constexpr std::uint32_t kRows = 24, kColumns = 48;
    Primitive p;
    p.material = material;
    for (std::uint32_t row = 0; row <= kRows; ++row) {
        for (std::uint32_t column = 0; column <= kColumns; ++column) {
            const float u = static_cast<float>(column) / kColumns;
            const float v = static_cast<float>(row) / kRows;
            const float longitude = u * 6.2831853F, polar = v * 3.1415927F;
            const glm::vec3 n(std::sin(longitude) * std::sin(polar), std::cos(polar),
                              std::cos(longitude) * std::sin(polar));
            p.positions.push_back(center + radius * n);
            p.normals.push_back(n);
            p.tangents.emplace_back(std::cos(longitude), 0, -std::sin(longitude), 1);
            p.texcoords[0].emplace_back(u, v);
            if (row == kRows || column == kColumns) continue;
            const std::uint32_t a = row * (kColumns + 1) + column, b = a + kColumns + 1;
            p.indices.insert(p.indices.end(), {a, b, a + 1, a + 1, b, b + 1});
        }
    }
    scene_.meshes.push_back({"sphere", {p}});
    return instance(static_cast<int>(scene_.meshes.size()) - 1, glm::dmat4(1));
}

int SceneBuilder::instance(int mesh, const glm::dmat4& placement) {
    Node node;
    node.local = placement;
    node.mesh = mesh;
    scene_.nodes.push_back(node);
    const int index = static_cast<int>(scene_.nodes.size()) - 1;
    scene_.scenes[0].roots.push_back(index);
    return index;
}

void SceneBuilder::light(const Light& light, const glm::dmat4& placement) {
    Node node;
    node.local = placement;
    node.light = static_cast<int>(scene_.lights.size());
    scene_.lights.push_back(light);
    scene_.scenes[0].roots.push_back(static_cast<int>(scene_.nodes.size()));
    scene_.nodes.push_back(node);
}

int SceneBuilder::lit(int material) {
    Material& m = scene_.materials[static_cast<std::size_t>(material)];
    m.unlit = false;
    m.metallic = 0;
    return material;
}

View testView(int width, int height) {
    View view;
    view.width = width;
    view.height = height;
    view.crop = {0, 0, width, height};
    view.projection.half_height = 0.5;
    view.projection.half_width = 0.5 * width / height;
    view.projection.near = 0.1;
    return view;
}

void CollectSink::write(LayeredImage&& band) {
    bands.push_back(band.window);
    if (image.offsets.empty()) {
        image = std::move(band);
        return;
    }
    if (band.color.channels != image.color.channels || band.color.type != image.color.type ||
        band.extra.size() != image.extra.size())
        throw std::logic_error("the bands of a picture have different channels");
    image.window = unite(image.window, band.window);
    const std::uint32_t base = image.offsets.back();
    for (std::size_t p = 1; p < band.offsets.size(); ++p)
        image.offsets.push_back(base + band.offsets[p]);
    image.z.insert(image.z.end(), band.z.begin(), band.z.end());
    image.color.data.insert(image.color.data.end(), band.color.data.begin(), band.color.data.end());
    for (std::size_t i = 0; i < band.extra.size(); ++i) {
        const auto& data = band.extra[i].data;
        image.extra[i].data.insert(image.extra[i].data.end(), data.begin(), data.end());
    }
}

namespace {

void APIENTRY failByMessage(GLenum, GLenum type, GLuint, GLenum severity, GLsizei,
                            const GLchar* message, const void*) {
    if (severity == GL_DEBUG_SEVERITY_HIGH || type == GL_DEBUG_TYPE_ERROR ||
        type == GL_DEBUG_TYPE_UNDEFINED_BEHAVIOR)
        ADD_FAILURE() << "GL: " << message;
}

gl::Context* openStrictly() {
    gl::Context* const context = gl::createContext({.backend = testBackend()}).release();
    const gl::Functions& gl = context->functions();
    gl.Enable(GL_DEBUG_OUTPUT);
    gl.Enable(GL_DEBUG_OUTPUT_SYNCHRONOUS);
    gl.DebugMessageCallback(failByMessage, nullptr);
    return context;
}

}  // namespace

gl::Context& sharedContext() {
    // Never destroyed, because GL libraries have their own exit handlers.
    static gl::Context* context = openStrictly();
    return *context;
}

void inOwnThread(const std::function<void()>& test) {
    std::thread(test).join();
}

Captured capture(const Scene& scene, const View& view, const CaptureSettings& settings,
                 gl::Context& context) {
    const PosedScene shown(scene);
    GlRenderer renderer(context, shown);
    return capture(renderer, view, settings);
}

std::unique_ptr<HitSource> openHits(const std::string& engine, const PosedScene& posed) {
    if (engine == "gl") return std::make_unique<GlRenderer>(sharedContext(), posed);
    return std::make_unique<HitRasterizer>(posed);
}

Captured capture(HitSource& source, const View& view, const CaptureSettings& settings) {
    Captured result;
    const CapturePlan plan = source.plan(view, settings);
    result.plan = plan;
    CollectSink collect;
    result.report = source.capture(plan, collect);
    result.image = std::move(collect.image);
    result.bands = std::move(collect.bands);
    return result;
}

namespace {
template <class T>
std::string firstDifference(const std::string& what, const std::vector<T>& a,
                            const std::vector<T>& b) {
    if (a.size() != b.size())
        return what + ": " + std::to_string(a.size()) + " and " + std::to_string(b.size());
    for (std::size_t i = 0; i < a.size(); ++i)
        if (std::memcmp(&a[i], &b[i], sizeof(T)) != 0) return what + (" " + std::to_string(i));
    return {};
}
}  // namespace

std::string difference(const LayeredImage& a, const LayeredImage& b) {
    if (a.window != b.window) return "window";
    std::string text = firstDifference("offset", a.offsets, b.offsets);
    if (text.empty()) text = firstDifference("z", a.z, b.z);
    if (text.empty()) text = firstDifference("colour byte", a.color.data, b.color.data);
    if (text.empty() && a.extra.size() != b.extra.size()) return "number of extra arrays";
    for (std::size_t i = 0; text.empty() && i < a.extra.size(); ++i) {
        if (a.extra[i].channels != b.extra[i].channels) return "names of extra channels";
        text = firstDifference("byte of " + a.extra[i].channels.front(), a.extra[i].data,
                               b.extra[i].data);
    }
    return text;
}

glm::vec4 color(const LayeredImage& image, std::size_t fragment) {
    glm::vec4 value;
    for (int c = 0; c < 4; ++c) {
        const std::size_t at = fragment * 4 + static_cast<std::size_t>(c);
        value[c] = image.color.type == PixelType::kHalf
                       ? static_cast<float>(image.color.as<Imath::half>()[at])
                       : image.color.as<float>()[at];
    }
    return value;
}

}  // namespace peeler::test
