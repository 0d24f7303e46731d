// SPDX-License-Identifier: Apache-2.0
// Shades hits of traced rays, whose surface attributes and derivatives the CPU calculates.
#define TRACED
#include "shade.glsl"

layout(local_size_x = 64) in;

layout(location = 0) uniform ivec4 hits_of_draw;  // x: first hit, y: number of hits
#ifdef SEVERAL_SAMPLES
layout(location = 1) uniform ivec4 sample_positions;  // of each sample: 16 x + 256 · 16 y in the pixel, y up
#endif

layout(std430, binding = PEELER_HITS) readonly buffer Hits { HitRecord hits[]; };
layout(std430, binding = PEELER_HIT_COLORS) writeonly buffer HitColors { PACKED_COLOR hit_colors[]; };

void main() {
    if (gl_GlobalInvocationID.x >= uint(hits_of_draw.y)) return;
    uint index = uint(hits_of_draw.x) + gl_GlobalInvocationID.x;
    HitRecord hit = hits[index];
    surface = Surface(hit.position.xyz, hit.normal.xyz, hit.tangent, hit.texcoords, hit.color);
    on_front = hit.position.w > 0.0;
    toward_eye = hit.toward.xyz;
#ifdef SEVERAL_SAMPLES
    uint samples = uint(hit.normal.w);
    vec2 center = vec2(0.0);
    for (int i = 0; i < 4; ++i) {
        sample_weight[i] = float(samples >> i & 1u) / float(bitCount(samples));
        sample_offset[i] = vec2(sample_positions[i] & 255, sample_positions[i] >> 8) / 16.0;
        center += sample_weight[i] * sample_offset[i];
    }
    for (int i = 0; i < 4; ++i) sample_offset[i] -= center;
#endif
#ifdef TRANSMISSION
    mesh_scale = hit.toward.w;
#endif
    Gradients gradients = Gradients(hit.texcoords_dx, hit.texcoords_dy, hit.position_dx.xyz, hit.position_dy.xyz);
    StoredColor stored = fragmentColor(baseColor(gradients), gradients);
#ifdef TINTED
    hit_colors[2u * index] = stored.color;
    hit_colors[2u * index + 1u] = stored.opacity;
#else
    hit_colors[index] = stored.color;
#endif
}
