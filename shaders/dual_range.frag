// SPDX-License-Identifier: Apache-2.0
// First pass of dual depth peeling: finds the nearest and farthest depth per pixel, by MAX blending of (depth, -depth).
#ifdef ALPHA_TEST
#include "surface.glsl"
#else
#include "fragment.glsl"
#endif

layout(location = 0) out vec2 range;

void main() {
#ifdef ALPHA_TEST
    if (!passesAlphaTest(baseColor(surfaceGradients()).a)) discard;
#endif
    Key key = fragmentKey();
    if (!inRange(key)) discard;
    range = vec2(key.depth, -key.depth);
}
