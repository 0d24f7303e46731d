// SPDX-License-Identifier: Apache-2.0
// Captures of small scenes in tests, without files.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "core/capture/gl_renderer.h"
#include "core/gl/context.h"

namespace peeler::test {

/// A scene under construction: meshes of triangles with unlit materials.
class SceneBuilder {
  public:
    SceneBuilder();
    /// Adds a material and returns its index. `rgba` is the base colour, not premultiplied.
    int material(const glm::vec4& rgba, AlphaMode mode = AlphaMode::kBlend,
                 bool double_sided = true);
    /// Adds a mesh of triangles (three positions each) in its own node. Returns the node.
    int triangles(const std::vector<glm::vec3>& positions, int material,
                  const glm::dmat4& placement = glm::dmat4(1));
    /// Adds a quad (two triangles) with these corners, in counter-clockwise order. Returns the
    /// node.
    int quad(const glm::vec3& a, const glm::vec3& b, const glm::vec3& c, const glm::vec3& d,
             int material, const glm::dmat4& placement = glm::dmat4(1));
    /// Adds a rectangle of half width `w` and half height `h` that faces +Z, at `z`. Returns the
    /// node.
    int rectangle(float w, float h, float z, int material);
    /// Adds a sphere with normals, tangents along the parallels, and texture coordinates. Returns
    /// the node.
    int sphere(const glm::vec3& center, float radius, int material);
    /// Adds a node that shows an existing mesh. Returns the node.
    int instance(int mesh, const glm::dmat4& placement);
    /// Adds a node with a light that shines along −Z of `placement`.
    void light(const Light& light, const glm::dmat4& placement);
    /// Makes a material lit, dielectric, and of roughness 1. Returns the material's index.
    int lit(int material);

    const Scene& scene() const { return scene_; }
    Scene& scene() { return scene_; }

  private:
    Scene scene_;
};

/// Returns the view of a perspective camera at the origin that looks along −Z. The tangent of half
/// its vertical field of view is 0.5, near is 0.1, and far is infinite.
View testView(int width, int height);

/// A sink that joins all bands into one image.
class CollectSink : public Sink {
  public:
    void begin(const Plan&) override {}
    void write(LayeredImage&& band) override;
    void finish() override {}
    LayeredImage image;
    std::vector<Window> bands;
};

struct Captured {
    Plan plan;
    CaptureReport report;
    LayeredImage image;
    std::vector<Window> bands;
};

/// Returns the context of testBackend(), which all tests of the process share. Driver messages
/// (KHR_debug) about errors or undefined behaviour, or of high severity, fail the current test.
/// Throws Error (kDevice) if there is no context.
gl::Context& sharedContext();

/// Runs `test` in a new thread and waits for it. Tests create all contexts other than the shared
/// one in new threads, because a context stays current in its thread.
void inOwnThread(const std::function<void()>& test);

Captured capture(const Scene& scene, const View& view, const CaptureSettings& settings = {},
                 gl::Context& context = sharedContext());

/// Returns the hit source for a value of --engine: "cpu", or "gl" on the shared context.
std::unique_ptr<HitSource> openHits(const std::string& engine, const PosedScene& posed);

/// Captures with an open source, to capture a scene several times. Only a GlRenderer gives more
/// than hits.
Captured capture(HitSource& source, const View& view, const CaptureSettings& settings = {});

/// Compares windows, offsets, depth, colour and extra arrays bit for bit. Returns a description of
/// the first difference; "" if there is none.
std::string difference(const LayeredImage& a, const LayeredImage& b);

glm::vec4 color(const LayeredImage& image, std::size_t fragment);

}  // namespace peeler::test
