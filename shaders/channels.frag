// SPDX-License-Identifier: Apache-2.0
// Additional channels of captured fragments (core/image/channels.h), for every method. The shader
// finds a fragment's entry in the pixel's list by the fragment's primitive, which is unique within
// a pixel. Vectors are in world space.
#include "normal.glsl"
#include "stored_fragments.glsl"

layout(location = 0) uniform ivec4 argument;  // x: number of floats per fragment

layout(std430, binding = PEELER_LIST_HEADS) readonly buffer ListHeads { uint list_heads[]; };  // end of each pixel's list
layout(std430, binding = PEELER_CHANNELS) writeonly buffer Channels { float channels[]; };

void put(inout uint at, vec3 v) {
    channels[at++] = v.x;
    channels[at++] = v.y;
    channels[at++] = v.z;
}

#ifdef CHANNEL_TANGENT
/// Returns the direction of increasing U, and the sign with which cross(normal, tangent) points up
/// the image. `normal` is on the viewer's side.
vec4 surfaceTangent(vec3 normal, Gradients g) {
    vec3 tangent, bitangent;
    tangentFrame(normal, PEELER_NORMAL_UNIT, g, tangent, bitangent);
    float size = dot(tangent, tangent);
    if (!(size > 0.0)) return vec4(0.0);
    float side = on_front ? 1.0 : -1.0;  // reverts the flip of tangentFrame() on back faces
    return vec4(side * tangent * inversesqrt(size), side * sign(dot(cross(normal, side * tangent), bitangent)));
}
#endif

void main() {
    Gradients g = surfaceGradients();
    uint key = fragmentKey().primitive, pixel = pixelIndex();
    uint entry = pixel == 0u ? 0u : list_heads[pixel - 1u], end = list_heads[pixel];
    while (entry < end && storedPrimitive(entry) != key) ++entry;
    if (entry == end) return;  // the fragment was rejected, or is beyond the stored layers
    uint at = entry * uint(argument.x);

#ifdef CHANNEL_NORMAL
    put(at, world_from_view * shadingNormal(g));
#endif
#ifdef CHANNEL_UV
    channels[at++] = surface.texcoords.x;
    channels[at++] = surface.texcoords.y;
#endif
#ifdef CHANNEL_TANGENT
    vec4 tangent = surfaceTangent(geometricNormal(g), g);
    put(at, world_from_view * tangent.xyz);
    channels[at++] = tangent.w;
#endif
#ifdef CHANNEL_BASE_COLOR
    put(at, baseColor(g).rgb);
#endif
#ifdef CHANNEL_EMISSIVE
    put(at, emissiveColor(g));
#endif
#ifdef CHANNEL_ROUGHNESS_METALLIC
    vec2 rough_metal = roughnessMetallic(g);
    channels[at++] = rough_metal.x;
    channels[at++] = rough_metal.y;
#endif
}
