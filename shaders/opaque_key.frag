// SPDX-License-Identifier: Apache-2.0
// The key of the nearest opaque triangle (OPAQUE and MASK, not transmissive) of every sample of a pixel. Among equal
// depths, the depth test keeps the triangle drawn first.
#ifdef ALPHA_TEST
#include "surface.glsl"
#else
#include "fragment.glsl"
#endif

layout(location = 0) out uint primitive;

void main() {
    Key key = fragmentKey();
#ifdef ALPHA_TEST
    if (!passesAlphaTest(baseColor(surfaceGradients()).a)) discard;
#endif
#ifdef CLIPPED
    if (!isKept(key.depth)) discard;
#endif
    primitive = key.primitive;
}
