// SPDX-License-Identifier: Apache-2.0
// The triangles of a posed scene in draw order, and their spans in sections of a picture.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <glm/glm.hpp>
#include <map>
#include <vector>

#include <peeler/capture_settings.h>
#include "core/raster/alpha_ranges.h"
#include "core/raster/alpha_test.h"
#include "core/raster/corner_grid.h"
#include "core/raster/span_store.h"
#include "core/raster/triangle_rows.h"
#include "core/scene/posed_scene.h"

namespace peeler {

/// A view, with the settings that decide which intersections are hits.
struct HitView {
    HitView(const View& shown, const CaptureSettings& settings)
        : view(shown), grid(shown), faces(settings.faces), cut(!settings.depth_clamp) {}

    View view;
    CornerGrid grid;
    Faces faces;
    /// Whether to ignore hits nearer than the near plane, and hits on or beyond the far plane.
    bool cut;
};

/// The triangles of one instance of a primitive.
struct TrianglePiece {
    const Primitive* primitive = nullptr;
    const std::vector<glm::vec3>* positions = nullptr;
    glm::dmat4 world{1};
    bool mirrored = false, double_sided = false;
    const AlphaTest* alpha = nullptr;     ///< null if there is no alpha test
    const AlphaRanges* ranges = nullptr;  ///< of the alpha test's image
    std::uint32_t first_key = 0;
    /// Index of the piece's first triangle. Pieces are sorted by this index.
    std::uint64_t first = 0;
    std::uint32_t triangles = 0;
    std::size_t first_corner = 0;  ///< index of the piece's first vertex in the batch
};

/// All triangles that can be hit, processed in batches of pieces. A batch's vertices are snapped
/// before its triangles are processed.
class SceneTriangles {
  public:
    explicit SceneTriangles(const PosedScene& posed);

    /// Returns the number of index blocks of the triangles (HitTriangles).
    std::size_t blocks() const { return blocks_; }
    /// Returns the bytes in use, not counting the SpanStore.
    std::uint64_t bytes() const { return corners_.capacity() * sizeof(SnappedCorner); }
    std::uint64_t mostBytes() const { return most_corners_ * sizeof(SnappedCorner); }

    /// Writes the spans of a section's rows to the store, which may grow to `limit` bytes. Stops
    /// early if the spans do not fit (SpanStore::overflowed()). The section must not be wider than
    /// the crop. Blocks run in parallel; the result does not depend on their order.
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
    std::map<const Image*, AlphaRanges> alpha_ranges_;
    std::vector<TrianglePiece> pieces_;
    std::vector<Batch> batches_;
    std::size_t blocks_ = 0, most_corners_ = 0;
    std::vector<SnappedCorner> corners_;  // snapped vertices of the current batch
};

}  // namespace peeler
