// SPDX-License-Identifier: Apache-2.0
// The hits of rays: like a_buffer.frag, but without shading.
#ifdef ALPHA_TEST
#include "surface.glsl"
#else
#include "fragment.glsl"
#endif
#include "stored_fragments.glsl"
#include "list_heads.glsl"

#ifdef SLOPES
layout(location = PEELER_CLIP_DEPTH) noperspective in float clip_depth;
#endif

void main() {
#ifdef SLOPES
    vec2 slopes = vec2(dFdx(clip_depth), dFdy(clip_depth));  // change of depth per pixel to the right and upwards
#endif
#ifdef ALPHA_TEST
    if (!passesAlphaTest(baseColor(surfaceGradients()).a)) discard;
#endif
    Key key = fragmentKey();
    if (!inRange(key)) discard;
    uint entry = takeEntry();
    if (!hasEntry(entry)) return;
#ifdef SLOPES
    storeFragment(entry, key.depth, key.primitive, slopes);
#else
    storeFragment(entry, key.depth, key.primitive);
#endif
}
