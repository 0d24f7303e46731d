// SPDX-License-Identifier: Apache-2.0
// Counted A-buffer: each fragment gets the next free entry of its pixel's list (Carpenter 1984; exact allocation by a
// count pass as in Vasilakis & Fudos' S-buffer, 2012).
#include "shade.glsl"
#include "stored_fragments.glsl"
#include "list_heads.glsl"

void main() {
    Gradients gradients = surfaceGradients();
    vec4 base = baseColor(gradients);
    if (!passesAlphaTest(base.a)) discard;
    Key key = fragmentKey();
    if (!inRange(key)) discard;

    uint entry = takeEntry();
#ifdef ENTRIES_AS_KEYS
    // With fetched list heads, entries are taken in draw order (GL_EXT_shader_framebuffer_fetch), so entries order
    // coincident fragments as primitive indices do. Using entries avoids gl_PrimitiveID, for which llvmpipe duplicates
    // vertices that triangles share.
    key.primitive = entry;
#endif
    if (hasEntry(entry)) storeFragment(entry, key.depth, key.primitive, fragmentColor(base, gradients));
}
