// SPDX-License-Identifier: Apache-2.0
// Depth peeling (Everitt 2001): the next fragment beyond the previous layer, by the lexicographic key (depth,
// primitive), so that coincident fragments are peeled one by one. Among equal depths, the depth test keeps the fragment
// drawn first (front to back) or last (BACKWARD). The kept fragment is the next by primitive index.
#include "shade.glsl"

layout(binding = PEELER_PREVIOUS_DEPTH_UNIT) uniform sampler2D previous_depth;
layout(binding = PEELER_PREVIOUS_PRIMITIVE_UNIT) uniform usampler2D previous_primitive;

layout(location = 0) out uint primitive;
layout(location = 1) out PACKED_COLOR color;
#ifdef TINTED
layout(location = 2) out PACKED_COLOR opacity;
#endif

void main() {
    Gradients gradients = surfaceGradients();
    vec4 base = baseColor(gradients);
    if (!passesAlphaTest(base.a)) discard;
    Key key = fragmentKey();
    if (!inRange(key)) discard;
    ivec2 at = ivec2(gl_FragCoord.xy);
    Key previous = Key(texelFetch(previous_depth, at, 0).r, texelFetch(previous_primitive, at, 0).r);
#ifdef BACKWARD
    if (!precedes(key, previous)) discard;
#else
    if (!precedes(previous, key)) discard;
#endif
    primitive = key.primitive;
    StoredColor stored = fragmentColor(base, gradients);
    color = stored.color;
#ifdef TINTED
    opacity = stored.opacity;
#endif
    gl_FragDepth = key.depth;  // exactly the value that the next pass compares
}
