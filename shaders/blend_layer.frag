// SPDX-License-Identifier: Apache-2.0
// Adds a peeled layer, held in textures of a raster tile, to the composite. Fixed-function blending
// puts the layer under the previous layers (front to back) or over them (BACKWARD). With PING_PONG,
// the previous layers are read from a texture, without blending. When layers are peeled from
// behind, the number of fragments gives the layer's index from the front. Layers beyond the limit
// are added to the tail's sums (TAIL), or dropped.
#include "fragment.glsl"
#include "packed_color.glsl"

layout(location = 0) uniform ivec4 layer;  // x: index of the layer, counted from the end where peeling began

layout(binding = PEELER_PREVIOUS_DEPTH_UNIT) uniform sampler2D layer_depth;
layout(binding = PEELER_PREVIOUS_PRIMITIVE_UNIT) uniform usampler2D layer_primitive;
layout(binding = PEELER_PREVIOUS_COLOR_UNIT) uniform usampler2D layer_color;
#ifdef PING_PONG
layout(binding = PEELER_FRONT_UNIT) uniform sampler2D composite;
#endif

layout(std430, binding = PEELER_LIST_HEADS) buffer ListHeads { uint list_heads[]; };
layout(std430, binding = PEELER_DEPTHS) writeonly buffer Depths { float depths[]; };
layout(std430, binding = PEELER_COUNTS) readonly buffer Counts { uint counts[]; };

layout(location = 0) out vec4 color;
#ifdef TAIL
layout(location = 1) out vec4 tail_sum;
layout(location = 2) out float tail_count;
#endif

void main() {
    ivec2 at = ivec2(gl_FragCoord.xy);
    uint pixel = pixelIndex();
    bool present = texelFetch(layer_primitive, at, 0).r != 0u;
    vec4 own = unpackColor(packedTexel(texelFetch(layer_color, at, 0)));
#ifdef PING_PONG
    vec4 before = texelFetch(composite, at, 0);
    color = present ? before + (1.0 - before.a) * own : before;
#else
    if (!present) discard;
    color = own;
#endif
    if (!present) return;
#ifdef BACKWARD
    bool kept = counts[pixel] - 1u - uint(layer.x) < frame.limits.x;
    if (!kept) color = vec4(0.0);
#ifdef TAIL
    tail_sum = kept ? vec4(0.0) : own;
    tail_count = kept ? 0.0 : 1.0;
#endif
    if (!kept) return;
    depths[pixel] = texelFetch(layer_depth, at, 0).r;  // the last layer is the nearest
#else
    if (layer.x == 0) depths[pixel] = texelFetch(layer_depth, at, 0).r;
#endif
    list_heads[pixel] = list_heads[pixel] + 1u;
}
