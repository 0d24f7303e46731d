// SPDX-License-Identifier: Apache-2.0
// Counted A-buffer: every fragment goes to the next free slot of its pixel's list (Carpenter 1984; the
// exact allocation from a count pass after Vasilakis & Fudos' S-buffer 2012).
#include "shade.glsl"
#include "stored_fragments.glsl"
#include "slots.glsl"

void main() {
    Gradients gradients = surfaceGradients();
    vec4 base = baseColor(gradients);
    if (!passesAlphaTest(base.a)) discard;
    Key key = fragmentKey();
    if (!inRange(key)) discard;

    uint slot = takeSlot();
#ifdef SLOTS_AS_KEYS
    // Fetched slots are taken in draw order (GL_EXT_shader_framebuffer_fetch), so that they order coincident fragments as
    // primitives do. And llvmpipe, to number the triangles of a draw, copies the vertices that they share.
    key.primitive = slot;
#endif
    if (hasSlot(slot)) storeFragment(slot, key.depth, key.primitive, fragmentColor(base, gradients));
}
