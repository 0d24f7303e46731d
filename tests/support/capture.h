// SPDX-License-Identifier: Apache-2.0
// Capture of small scenes in tests, without files.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "core/capture/gl_renderer.h"
#include "core/gl/context.h"

namespace peeler::test {

/// A scene under construction: meshes of plain triangles with unlit materials.
class SceneBuilder {
  public:
    SceneBuilder();
    /// Adds a material and returns its index. `rgba` is the base colour, straight alpha.
    int material(const glm::vec4& rgba, AlphaMode mode = AlphaMode::kBlend,
                 bool double_sided = true);
    /// Adds a mesh of triangles (three positions each) in its own node and returns the node.
    int triangles(const std::vector<glm::vec3>& positions, int material,
                  const glm::dmat4& placement = glm::dmat4(1));
    /// Adds a quad (two triangles) with these corners, counter-clockwise.
    int quad(const glm::vec3& a, const glm::vec3& b, const glm::vec3& c, const glm::vec3& d,
             int material, const glm::dmat4& placement = glm::dmat4(1));
    /// Adds a rectangle of half extents (w, h) facing +Z at z.
    int rectangle(float w, float h, float z, int material);
    /// Adds a sphere with normals, tangents (along the parallels) and texture coordinates.
    int sphere(const glm::vec3& center, float radius, int material);
    /// Adds a node with an existing mesh.
    int instance(int mesh, const glm::dmat4& placement);
    /// Adds a node with a light, which shines along −Z of `placement`.
    void light(const Light& light, const glm::dmat4& placement);
    /// Makes a material dielectric, with roughness 1, and lit instead of unlit. Returns its index.
    int lit(int material);

    const Scene& scene() const { return scene_; }
    Scene& scene() { return scene_; }

  private:
    Scene scene_;
};

/// Returns a view of the surroundings of the origin: a perspective camera at the origin looking
/// along -Z, with tan of half the vertical field of view 0.5, near 0.1 and no far plane.
View testView(int width, int height);

/// Collects all bands into one image.
class CollectSink : public Sink {
  public:
    void begin(const Plan&) override {}
    void write(LayeredImage&& band) override;
    void finish() override {}
    LayeredImage image;
    std::vector<Window> bands;
};

/// The results of a capture.
struct Captured {
    Plan plan;
    CaptureReport report;
    LayeredImage image;
    std::vector<Window> bands;
};

/// Returns the context of testBackend(), made once per process. Driver messages about errors,
/// undefined behaviour, and of high severity fail the current test (KHR_debug). Throws Error
/// (kDevice) if there is no context.
gl::Context& sharedContext();

/// Runs `test` in its own thread and waits for it: a context belongs to the thread that makes it,
/// so contexts other than the shared one are made there.
void inOwnThread(const std::function<void()>& test);

Captured capture(const Scene& scene, const View& view, const CaptureSettings& settings = {},
                 gl::Context& context = sharedContext());

/// Returns a hit source by its --engine name: cpu, or gl, on the shared context.
std::unique_ptr<HitSource> openHits(const std::string& engine, const PosedScene& posed);

/// Captures with an open source, for tests that capture a scene many times; sources other than a
/// GlRenderer give hits only.
Captured capture(HitSource& source, const View& view, const CaptureSettings& settings = {});

/// Compares bit for bit: windows, offsets, depth, colour, extra arrays. Returns "" or the first
/// difference.
std::string difference(const LayeredImage& a, const LayeredImage& b);

/// Returns the colour of a fragment as floats.
glm::vec4 color(const LayeredImage& image, std::size_t fragment);

}  // namespace peeler::test
