// SPDX-License-Identifier: Apache-2.0
// The count pass: fragments per pixel.
#ifdef ALPHA_TEST
#include "surface.glsl"
#else
#include "fragment.glsl"
#endif
#include "list_heads.glsl"

void main() {
#ifdef ALPHA_TEST
    if (!passesAlphaTest(baseColor(surfaceGradients()).a)) discard;
#endif
    if (!inRange(fragmentKey())) discard;
    takeEntry();
}
