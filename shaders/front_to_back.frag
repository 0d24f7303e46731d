// SPDX-License-Identifier: Apache-2.0
// Front-to-back peeling (Everitt 2001): the nearest fragment behind the previous layer. "Behind" is the lexicographic
// key (depth, primitive), so coincident fragments are peeled one after the other; among equal depths the
// depth test (greater) keeps the first drawn, which has the smallest primitive index.
#include "shade.glsl"

layout(binding = PEELER_PREVIOUS_DEPTH_UNIT) uniform sampler2D previous_depth;
layout(binding = PEELER_PREVIOUS_PRIMITIVE_UNIT) uniform usampler2D previous_primitive;

layout(location = 0) out uint primitive;
layout(location = 1) out PACKED_COLOR color;

void main() {
    Gradients gradients = surfaceGradients();
    vec4 base = baseColor(gradients);
    if (!passesAlphaTest(base.a)) discard;
    Key key = fragmentKey();
    if (!inRange(key)) discard;
    ivec2 at = ivec2(gl_FragCoord.xy);
    Key previous = Key(texelFetch(previous_depth, at, 0).r, texelFetch(previous_primitive, at, 0).r);
    if (!precedes(previous, key)) discard;

    primitive = key.primitive;
    color = fragmentColor(base, gradients);
    gl_FragDepth = key.depth;  // exactly what the next pass will compare with
}
