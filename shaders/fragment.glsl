// SPDX-License-Identifier: Apache-2.0
// Fragment definition: position, key (depth, primitive), and tests for rejection (core/README.md, "What a fragment
// is"). Every pass of every method includes this file, so that all passes find the same fragments.
#include "interface.glsl"

layout(std140, binding = PEELER_FRAME_BLOCK) uniform FrameBlock { FrameRecord frame; };
#ifdef BOUNDED
layout(binding = PEELER_OPAQUE_DEPTH_UNIT) uniform sampler2D opaque_depth;
layout(binding = PEELER_OPAQUE_PRIMITIVE_UNIT) uniform usampler2D opaque_primitive;
#endif
#ifdef IN_FRONT
// Runs the depth test before anything is stored. The test writes no depth, so a fragment that is
// discarded later hides no other fragment.
layout(early_fragment_tests) in;
#ifdef MULTISAMPLED
layout(binding = PEELER_OPAQUE_DEPTH_UNIT) uniform sampler2DMS opaque_depths;
layout(binding = PEELER_OPAQUE_PRIMITIVE_UNIT) uniform usampler2DMS opaque_keys;  // see opaque_key.frag
#else
layout(binding = PEELER_OPAQUE_FRAGMENT_UNIT) uniform usampler2D opaque_fragment;  // see opaque.frag
#endif
#endif

struct Key {
    float depth;     // reversed Z: larger is nearer
    uint primitive;  // draw order: among equal depths, smaller comes first
};

/// Whether `a` comes before `b`, front to back.
bool precedes(Key a, Key b) {
    return a.depth > b.depth || (a.depth == b.depth && a.primitive < b.primitive);
}

/// Returns the distance along the viewing axis of a buffer depth, in scene units.
float viewDistance(float depth) {
    vec4 point = frame.view_from_ndc * vec4(0.0, 0.0, depth, 1.0);
    return -point.z / point.w;
}

#ifndef TRACED  // traced hits are accepted before they are shaded, and know their pixel
#ifdef GEOMETRY  // defined except in full-screen passes
layout(location = PEELER_FIRST_KEY) flat in uint first_key;

Key fragmentKey() { return Key(gl_FragCoord.z, first_key + uint(gl_PrimitiveID)); }
#endif

ivec2 placeInBand() {
    return ivec2(frame.tile.x + int(gl_FragCoord.x), frame.tile.y + frame.tile.w - 1 - int(gl_FragCoord.y)) - frame.band.xy;
}

/// Returns the index into the band's per-pixel arrays. In multisampled passes, every sample has an array.
uint pixelIndex() {
    ivec2 at = placeInBand();
#if defined(MULTISAMPLED) && defined(IN_FRONT)
    at.y += gl_SampleID * frame.band.w;
#endif
    return uint(at.y * frame.band.z + at.x);
}

#ifdef CLIPPED
layout(std430, binding = PEELER_CLIP_FIRST) readonly buffer ClipFirst { uint clip_first[]; };
layout(std430, binding = PEELER_CLIP_DEPTHS) readonly buffer ClipDepths { float clip_depths[]; };

/// Whether the boundary encloses this depth. A point is inside a closed mesh if the numbers of back faces and front
/// faces behind the point differ. Faces in front of the point are not counted, since the near plane may clip them.
/// Points on the boundary are inside.
bool insideMesh(float depth) {
    // GPUs also run the shader for helper pixels beside the drawn pixels. For helper pixels outside
    // the band, the loop bounds would be arbitrary, and such a loop makes an H100 reset.
    if (any(greaterThanEqual(uvec2(placeInBand()), uvec2(frame.band.zw)))) return false;
    uint pixel = pixelIndex();
    int winding = 0;
    for (uint i = clip_first[pixel]; i < clip_first[pixel + 1u]; ++i) {
        bool back = floatBitsToInt(clip_depths[i]) < 0;
        float boundary = abs(clip_depths[i]);
        if (back && boundary <= depth) ++winding;
        if (!back && boundary < depth) --winding;
    }
    return winding != 0;
}

bool insideHalfSpaces(float depth) {
    precise vec2 at = gl_FragCoord.xy / vec2(frame.tile.zw) * 2.0 - 1.0;
    precise vec4 h = frame.view_from_ndc * vec4(at, depth, 1.0);
    for (int i = 0; i < frame.clip.x; ++i) {
        vec4 plane = frame.half_spaces[i];
        precise float distance = dot(plane.xyz, h.xyz) - plane.w * h.w;  // the distance times h.w, which is positive
        if (distance < 0.0) return false;
    }
    return true;
}

bool isKept(float depth) {
    bool inside = insideHalfSpaces(depth) && (frame.clip.z == 0 || insideMesh(depth));
    return inside == (frame.clip.y != 0);
}
#endif

/// Whether a fragment is accepted: in front of the far plane, inside the clip volume (CLIPPED), and not behind the
/// nearest opaque fragment (BOUNDED). The nearest opaque fragment itself is accepted.
bool inRange(Key key) {
    if (!(key.depth > 0.0)) return false;  // the far plane is exclusive
#ifdef CLIPPED
    if (!isKept(key.depth)) return false;
#endif
#ifdef BOUNDED
    ivec2 at = ivec2(gl_FragCoord.xy);
    Key nearest_opaque = Key(texelFetch(opaque_depth, at, 0).r, texelFetch(opaque_primitive, at, 0).r);
    if (precedes(nearest_opaque, key)) return false;
#endif
#ifdef IN_FRONT
    // All primitives of a draw have the same material. So first keys of draws are enough to order
    // an opaque and a transparent fragment at the same depth.
#ifdef MULTISAMPLED
    // llvmpipe (Mesa 22.3) also rasterises samples beside the scissor rectangle.
    if (any(greaterThanEqual(uvec2(placeInBand()), uvec2(frame.band.zw)))) return false;
    uvec2 opaque = uvec2(floatBitsToUint(texelFetch(opaque_depths, ivec2(gl_FragCoord.xy), gl_SampleID).r),
                         texelFetch(opaque_keys, ivec2(gl_FragCoord.xy), gl_SampleID).r);
#else
    uvec2 opaque = texelFetch(opaque_fragment, ivec2(gl_FragCoord.xy), 0).rg;
#endif
    if (precedes(Key(uintBitsToFloat(opaque.r), opaque.g), Key(key.depth, first_key))) return false;
#endif
    return true;
}
#endif
