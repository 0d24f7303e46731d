// SPDX-License-Identifier: Apache-2.0
// Counted A-buffer. The count pass gives the exact size of every pixel's list. One geometry pass
// then stores all fragments, in order of arrival.
#include "core/capture/method.h"
#include "core/capture/scene_rasterizer.h"

namespace peeler {
namespace {

// The definitions of passes that render to the list heads, by StoredKeys.
constexpr std::string_view kDefinitions[] = {kEntriesAsKeys, kFirstKeys, kFetchedListHeads};

class ABuffer final : public LayerMethod {
  public:
    bool takesAll() const override { return true; }
    std::uint64_t tileBytes(std::uint64_t, const CaptureSettings&) const override { return 0; }

    bool takesListHeadTarget() const override { return true; }
    bool takesOpaqueFirst() const override { return true; }

    int capture(SceneRasterizer& rasterizer, const LayerArea& area) override {
        const auto& gl = rasterizer.functions();
        const Window& tile = rasterizer.tile();
        const auto none = gl::makeEmptyFramebuffer(gl, tile.width(), tile.height());
        GeometryPass pass{.fragment_shader = "a_buffer.frag", .shades = true};
        if (rasterizer.hitMode() != HitMode::kNone) pass = {.fragment_shader = "hits.frag"};
        if (area.list_head_target)
            pass.definitions = kDefinitions[static_cast<std::size_t>(area.keys)];
        pass.framebuffer = area.framebuffer ? area.framebuffer : none.name();
        rasterizer.draw(area.in_front ? pass.inFront() : pass, area.window);
        return 1;
    }
};

}  // namespace

std::unique_ptr<LayerMethod> makeABuffer() {
    return std::make_unique<ABuffer>();
}

}  // namespace peeler
