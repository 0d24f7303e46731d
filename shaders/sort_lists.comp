// SPDX-License-Identifier: Apache-2.0
// Sorts each pixel's list in place and unpacks its nearest fragments into the arrays of a layered image.
#include "interface.glsl"
#include "stored_fragments.glsl"

layout(local_size_x = 16, local_size_y = 16) in;

layout(std140, binding = PEELER_FRAME_BLOCK) uniform FrameBlock { FrameRecord frame; };
layout(location = 0) uniform ivec4 area;    // x0, y0, x1, y1 inside the tile, y up
layout(location = 1) uniform ivec4 planes;  // distances of the near and far planes, as doubles

layout(std430, binding = PEELER_LIST_HEADS) readonly buffer ListStarts { uint list_starts[]; };
layout(std430, binding = PEELER_LAYER_OFFSETS) readonly buffer Offsets { uint offsets[]; };
layout(std430, binding = PEELER_LAYER_COUNTS) writeonly buffer Counts { uint counts[]; };
layout(std430, binding = PEELER_LAYER_DEPTHS) writeonly buffer Depths { float depths[]; };
layout(std430, binding = PEELER_LAYER_COLORS) writeonly buffer Colors { uvec2 colors[]; };

/// Whether a fragment comes before another (core/README.md, "Order"). The bits of depths, which are
/// not negative, order as the depths do.
bool isBefore(FRAGMENT_WORDS a, FRAGMENT_WORDS b) { return a.x != b.x ? a.x > b.x : a.y < b.y; }

/// Shell sort with Knuth's gaps (The Art of Computer Programming 3, section 5.2.1). Short lists, which most pixels
/// have, are sorted by insertion; long lists do not take quadratic time.
void sortList(uint first, uint count) {
    uint gap = 1u;
    while (gap < count / 3u) gap = 3u * gap + 1u;
    for (; gap > 0u; gap /= 3u) {
        for (uint i = gap; i < count; ++i) {
            FRAGMENT_WORDS moved[kWords];
            for (uint w = 0u; w < kWords; ++w) moved[w] = fragments[kWords * (first + i) + w];
            uint to = i;
            for (; to >= gap && isBefore(moved[0], fragments[kWords * (first + to - gap)]); to -= gap) {
                for (uint w = 0u; w < kWords; ++w)
                    fragments[kWords * (first + to) + w] = fragments[kWords * (first + to - gap) + w];
            }
            for (uint w = 0u; w < kWords; ++w) fragments[kWords * (first + to) + w] = moved[w];
        }
    }
}

/// Returns the camera Z of a buffer depth, computed as Projection::linearZ() does.
float linearZ(float depth) {
    precise double d = double(depth), n = packDouble2x32(uvec2(planes.xy)), f = packDouble2x32(uvec2(planes.zw));
#ifdef ORTHOGRAPHIC
    precise double z = f - d * (f - n);
#else
    precise double z = isinf(f) ? n / d : n * f / (d * (f - n) + n);
#endif
    return float(z);
}

void main() {
    ivec2 at = area.xy + ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(at, area.zw))) return;
    int x = frame.tile.x + at.x - frame.band.x;
    int y = frame.tile.y + frame.tile.w - 1 - at.y - frame.band.y;
    uint pixel = uint(y * frame.band.z + x);
    uint start = list_starts[pixel], first = offsets[pixel], count = offsets[pixel + 1u] - first;
    sortList(start, list_starts[pixel + 1u] - start);
    counts[pixel] = count;
    for (uint i = 0u; i < count; ++i) {
        depths[first + i] = linearZ(uintBitsToFloat(fragments[kWords * (start + i)].x));
        for (uint part = 0u; part < kColorParts; ++part)
            colors[kColorParts * (first + i) + part] = storedColor(start + i, part);
    }
}
