// SPDX-License-Identifier: Apache-2.0
// Resolves a composite. FRONT (peeled from the front) and BACK (peeled from behind), both premultiplied, and TAIL
// (unordered sums) become one premultiplied colour per pixel of the band.
#include "interface.glsl"

layout(local_size_x = 16, local_size_y = 16) in;

layout(std140, binding = PEELER_FRAME_BLOCK) uniform FrameBlock { FrameRecord frame; };
layout(location = 0) uniform ivec4 area;  // x0, y0, x1, y1 inside the tile, y up

layout(binding = PEELER_FRONT_UNIT) uniform sampler2D front_color;
layout(binding = PEELER_BACK_UNIT) uniform sampler2D back_color;
layout(binding = PEELER_TAIL_SUM_UNIT) uniform sampler2D tail_sum;
layout(binding = PEELER_TAIL_COUNT_UNIT) uniform sampler2D tail_count;

#ifdef COVERAGE
layout(binding = PEELER_COVERAGE_UNIT) uniform sampler2D coverage;
#endif

layout(std430, binding = PEELER_LIST_HEADS) buffer ListHeads { uint list_heads[]; };
layout(std430, binding = PEELER_COLORS) writeonly buffer Colors { vec4 colors[]; };

#ifdef TINTED
// Opacity per channel. Only unordered methods need it: for ordered methods, the CPU composites
// layers with coloured opacity.
layout(binding = PEELER_BACK_OPACITY_UNIT) uniform sampler2D back_opacity;
layout(binding = PEELER_TAIL_OPACITY_UNIT) uniform sampler2D tail_opacity;

void writeTinted(uint pixel, ivec2 at, vec4 back, vec4 tail, float n) {
    vec3 color = vec3(0.0), opacity = vec3(0.0);
#ifdef TAIL
    color = tail.rgb;
    opacity = texelFetch(tail_opacity, at, 0).rgb;
#ifndef WEIGHTED_SUM
    for (int c = 0; c < 3; ++c) {
#ifdef COVERAGE
        float covered = texelFetch(coverage, at, 0)[c];
#else
        float covered = opacity[c] > 0.0 ? 1.0 - pow(max(0.0, 1.0 - opacity[c] / n), n) : 0.0;
#endif
        if (opacity[c] > 0.0) color[c] = color[c] / opacity[c] * covered;
        opacity[c] = covered;
    }
#endif
#endif
    colors[2u * pixel] = vec4(color + (1.0 - opacity) * back.rgb, 0.0);
    colors[2u * pixel + 1u] = vec4(opacity + (1.0 - opacity) * texelFetch(back_opacity, at, 0).rgb, 0.0);
}
#endif

vec4 over(vec4 a, vec4 b) { return a + (1.0 - a.a) * b; }

/// Returns the weighted average of n fragments (Bavoil & Myers 2008, section 4). Each fragment gets
/// the mean colour and the mean opacity. With COVERAGE, the opacity of all is known exactly.
vec4 average(vec4 sum, float n, ivec2 at) {
    if (sum.a <= 0.0) return vec4(sum.rgb, 0.0);  // no opacity, as for reflections on glass
#ifdef COVERAGE
    float covered = texelFetch(coverage, at, 0).r;
#else
    float covered = 1.0 - pow(max(0.0, 1.0 - sum.a / n), n);
#endif
    return vec4(sum.rgb / sum.a * covered, covered);
}

void main() {
    ivec2 at = area.xy + ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(at, area.zw))) return;
    int x = frame.tile.x + at.x - frame.band.x;
    int y = frame.tile.y + frame.tile.w - 1 - at.y - frame.band.y;
    uint pixel = uint(y * frame.band.z + x);

    vec4 front = vec4(0.0), back = vec4(0.0), tail = vec4(0.0);
#ifdef FRONT
    front = texelFetch(front_color, at, 0);
#endif
#ifdef BACK
    back = texelFetch(back_color, at, 0);
#endif
#ifdef TAIL
    float n = texelFetch(tail_count, at, 0).r;
    tail = texelFetch(tail_sum, at, 0);
#if !defined(WEIGHTED_SUM) && !defined(TINTED)
    tail = average(tail, n, at);
#endif
    list_heads[pixel] += uint(n);
#endif
#ifdef TINTED
#ifndef TAIL
    float n = 0.0;
#endif
    writeTinted(pixel, at, back, tail, n);
#elif defined(TAIL_FIRST)
    colors[pixel] = over(tail, back);
#else
    colors[pixel] = over(front, over(back, tail));
#endif
}
