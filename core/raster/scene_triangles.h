// SPDX-License-Identifier: Apache-2.0
// The triangles of a posed scene in draw order, and what each section of a picture sees of them.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <glm/glm.hpp>
#include <vector>

#include <peeler/capture_settings.h>
#include "core/raster/alpha_test.h"
#include "core/raster/corner_grid.h"
#include "core/raster/span_store.h"
#include "core/raster/triangle_rows.h"
#include "core/scene/posed_scene.h"

namespace peeler {

/// What the rays of a bundle take for a hit.
struct HitView {
    HitView(const View& shown, const CaptureSettings& settings)
        : view(shown), grid(shown), faces(settings.faces), cut(!settings.depth_clamp) {}

    View view;
    CornerGrid grid;
    Faces faces;
    bool cut;  ///< hits before the near and from the far plane on do not count
};

/// The triangles of a primitive where one instance of it is.
struct TrianglePiece {
    const Primitive* primitive = nullptr;
    const std::vector<glm::vec3>* positions = nullptr;
    glm::dmat4 world{1};
    bool mirrored = false, double_sided = false;
    const AlphaTest* alpha = nullptr;  ///< null: all pass
    std::uint32_t first_key = 0;
    std::uint64_t first = 0;  ///< number of its first triangle, by which the pieces go
    std::uint32_t triangles = 0;
    std::size_t first_corner = 0;  ///< of its vertices among those of its batch
};

/// All triangles that can be hit. They are gone through in batches of pieces, whose vertices are
/// snapped before the triangles are looked at.
class SceneTriangles {
  public:
    explicit SceneTriangles(const PosedScene& posed);

    /// How many blocks of numbers the triangles have (HitTriangles).
    std::size_t blocks() const { return blocks_; }
    /// Of what is needed besides the store.
    std::uint64_t bytes() const { return corners_.capacity() * sizeof(SnappedCorner); }
    std::uint64_t mostBytes() const { return most_corners_ * sizeof(SnappedCorner); }

    /// Writes the spans of the rows of a section, which is as wide as the crop or narrower, to the
    /// store, or as many as there is room for (SpanStore::overflowed()). Blocks are done in
    /// parallel; what is found does not depend on how.
    void findSpans(const HitView& seen, const Window& section, std::uint64_t limit,
                   SpanStore& store);

    void free() { corners_ = {}; }

  private:
    struct Batch {
        std::size_t first_piece = 0, pieces = 0, corners = 0;
        std::size_t first_block = 0, blocks = 0;
    };

    PosedScene posed_;
    std::vector<AlphaTest> alpha_tests_;
    std::vector<TrianglePiece> pieces_;
    std::vector<Batch> batches_;
    std::size_t blocks_ = 0, most_corners_ = 0;
    std::vector<SnappedCorner> corners_;  // of the batch at hand
};

}  // namespace peeler
