// SPDX-License-Identifier: Apache-2.0
// Dual depth peeling (Bavoil & Myers 2008), composited on the fly. Each pass peels the fragments at
// the front and back depths that the previous pass has found. There are two variants. In the first,
// every target has its own blending: front fragments go under the composite, back fragments over
// it. In the second, all targets use MAX_BLENDING, as in the paper. Then each pass reads the front
// composite of the previous pass, and a separate pass blends the back.
//
// If two fragments coincide at a peeled depth, their order would be lost. Stamps detect such
// fragments. The pixel's list head then gets an invalid value, and the pixel is peeled again by
// another method.
#include "shade.glsl"

layout(location = 0) uniform ivec4 pass;  // x: number of this peeling pass, counted from 1

layout(binding = PEELER_PREVIOUS_DEPTH_UNIT) uniform sampler2D previous_range;
#ifdef MAX_BLENDING
layout(binding = PEELER_PREVIOUS_COLOR_UNIT) uniform sampler2D previous_front;
#endif

layout(std430, binding = PEELER_LIST_HEADS) buffer ListHeads { uint list_heads[]; };
layout(std430, binding = PEELER_DEPTHS) writeonly buffer Depths { float depths[]; };
layout(std430, binding = PEELER_STAMPS) buffer Stamps { uint stamps[]; };
layout(std430, binding = PEELER_COUNTS) readonly buffer Counts { uint counts[]; };

layout(location = 0) out vec2 range;
layout(location = 1) out vec4 front_color;
layout(location = 2) out vec4 back_color;
#ifdef TAIL
layout(location = 3) out vec4 tail_sum;
layout(location = 4) out float tail_count;
#endif

void main() {
    Gradients gradients = surfaceGradients();
    vec4 base = baseColor(gradients);
    if (!passesAlphaTest(base.a)) discard;
    Key key = fragmentKey();
    if (!inRange(key)) discard;

    ivec2 at = ivec2(gl_FragCoord.xy);
    range = vec2(-1.0, -2.0);
    front_color = back_color = vec4(0.0);
#ifdef MAX_BLENDING
    front_color = texelFetch(previous_front, at, 0);
    float through = 1.0 - front_color.a;
#endif
#ifdef TAIL
    tail_sum = vec4(0.0);
    tail_count = 0.0;
#endif
    vec2 previous = texelFetch(previous_range, at, 0).rg;
    float nearest = previous.x, farthest = -previous.y;
    if (key.depth > nearest || key.depth < farthest) return;  // already peeled
    if (key.depth < nearest && key.depth > farthest) {
        range = vec2(key.depth, -key.depth);
        return;
    }
    uint pixel = pixelIndex();
    bool is_front = key.depth == nearest;
    uint index = is_front ? uint(pass.x) - 1u : counts[pixel] - uint(pass.x);
    vec4 color = compositedColor(base, gradients);
    if (index >= frame.limits.x) {
#ifdef TAIL
        tail_sum = color;
        tail_count = 1.0;
#endif
        return;
    }
    uint stamp = uint(pass.x);
    if (atomicExchange(stamps[2u * pixel + (is_front ? 0u : 1u)], stamp) == stamp)
        atomicOr(list_heads[pixel], 0x80000000u);  // marks that several fragments have this depth
    else
        atomicAdd(list_heads[pixel], 1u);
    if (index == 0u) depths[pixel] = key.depth;
#ifdef MAX_BLENDING
    if (is_front) front_color += through * color;
#else
    if (is_front) front_color = color;
#endif
    if (!is_front) back_color = color;
}
