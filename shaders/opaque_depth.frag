// SPDX-License-Identifier: Apache-2.0
// The nearest opaque fragment (OPAQUE and MASK, not transmissive): the bound of --surfaces visible and transparent.
#ifdef ALPHA_TEST
#include "surface.glsl"
#else
#include "fragment.glsl"
#endif

layout(location = 0) out uint primitive;

void main() {
#ifdef ALPHA_TEST
    if (!passesAlphaTest(baseColor(surfaceGradients()).a)) discard;
#endif
    Key key = fragmentKey();
    if (!inRange(key)) discard;
    primitive = key.primitive;
    // Written explicitly, so that it equals gl_FragCoord.z bit for bit.
    gl_FragDepth = key.depth;
}
