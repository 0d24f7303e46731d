// SPDX-License-Identifier: Apache-2.0
// First of two passes: finds the key of the next fragment behind the previous layer. Does not
// compute the fragment's colour.
#ifdef ALPHA_TEST
#include "surface.glsl"
#else
#include "fragment.glsl"
#endif

layout(binding = PEELER_PREVIOUS_DEPTH_UNIT) uniform sampler2D previous_depth;
layout(binding = PEELER_PREVIOUS_PRIMITIVE_UNIT) uniform usampler2D previous_primitive;

layout(location = 0) out uint primitive;

void main() {
#ifdef ALPHA_TEST
    if (!passesAlphaTest(baseColor(surfaceGradients()).a)) discard;
#endif
    Key key = fragmentKey();
    if (!inRange(key)) discard;
    ivec2 at = ivec2(gl_FragCoord.xy);
    Key previous = Key(texelFetch(previous_depth, at, 0).r, texelFetch(previous_primitive, at, 0).r);
    if (!precedes(previous, key)) discard;
    primitive = key.primitive;
    gl_FragDepth = key.depth;
}
