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
    // Fetched list heads (GL_EXT_shader_framebuffer_fetch) give out entries in draw order. So
    // entries order coincident fragments in the same way as primitive indices. Avoiding
    // gl_PrimitiveID saves time: with it, llvmpipe would duplicate the vertices that triangles
    // share. With first keys, depthSort() keeps the order of entries.
#ifdef ENTRIES_AS_KEYS
    key.primitive = entry;
#elif defined(FIRST_KEYS)
    key.primitive = first_key;
#endif
    if (hasEntry(entry)) storeFragment(entry, key.depth, key.primitive, fragmentColor(base, gradients));
}
