// SPDX-License-Identifier: Apache-2.0
// The keys of every sample of a pixel, and the depth of the nearest sample, row by row, y down.
#include "interface.glsl"

layout(local_size_x = 16, local_size_y = 16) in;

layout(location = 0) uniform ivec4 area;  // x0, y0, x1, y1 inside the tile, y up

layout(binding = PEELER_OPAQUE_DEPTH_UNIT) uniform sampler2DMS depths;
layout(binding = PEELER_OPAQUE_PRIMITIVE_UNIT) uniform usampler2DMS keys;

layout(std430, binding = PEELER_SAMPLE_KEYS) writeonly buffer SampleKeys { uvec4 sample_keys[]; };
layout(std430, binding = PEELER_SAMPLE_DEPTHS) writeonly buffer SampleDepths { float sample_depths[]; };

void main() {
    ivec2 at = area.xy + ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(at, area.zw))) return;
    uvec4 found;
    float nearest = 0.0;  // reversed Z
    for (int i = 0; i < 4; ++i) {
        found[i] = texelFetch(keys, at, i).r;
        nearest = max(nearest, texelFetch(depths, at, i).r);
    }
    int pixel = (area.w - 1 - at.y) * (area.z - area.x) + at.x - area.x;
    sample_keys[pixel] = found;
    sample_depths[pixel] = nearest;
}
