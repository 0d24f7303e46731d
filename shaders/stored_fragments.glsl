// SPDX-License-Identifier: Apache-2.0
// The fragments of a band, grouped by pixel, in capture order. Each has a two-word key and, after it, its stored values:
//   KEYS_ONLY: nothing else    SLOPES: two floats    otherwise: a colour (packed_color.glsl)
// Key and values are adjacent, so that a store touches one place in memory. llvmpipe stores lane by lane, and then
// needs only one loop.
#include "packed_color.glsl"

// Fragments of six or ten words would need padding if they were stored as uvec4. So they are stored
// as kWords elements of uvec2.
#if defined(KEYS_ONLY)
#define FRAGMENT_WORDS uvec2
const uint kWords = 1u;
#elif defined(SLOPES) || !(defined(COLOR_FLOAT) || defined(TINTED))
#define FRAGMENT_WORDS uvec4
const uint kWords = 1u;
#elif defined(COLOR_FLOAT) && defined(TINTED)
#define FRAGMENT_WORDS uvec2
const uint kWords = 5u;
#else
#define FRAGMENT_WORDS uvec2
const uint kWords = 3u;
#endif

layout(std430, binding = PEELER_FRAGMENTS) buffer Fragments { FRAGMENT_WORDS fragments[]; };

/// Whether the band has room for the entry. If it does not, there are more fragments than were
/// counted. The check after the pass reports this.
bool hasEntry(uint entry) { return kWords * entry + kWords - 1u < uint(fragments.length()); }

#if defined(KEYS_ONLY)
void storeFragment(uint entry, float depth, uint primitive) {
    fragments[entry] = uvec2(floatBitsToUint(depth), primitive);
}
#elif defined(SLOPES)
void storeFragment(uint entry, float depth, uint primitive, vec2 slopes) {
    fragments[entry] = uvec4(floatBitsToUint(depth), primitive, floatBitsToUint(slopes));
}
#elif defined(COLOR_FLOAT)
void storeFragment(uint entry, float depth, uint primitive, StoredColor color) {
    fragments[kWords * entry] = uvec2(floatBitsToUint(depth), primitive);
    fragments[kWords * entry + 1u] = color.color.xy;
    fragments[kWords * entry + 2u] = color.color.zw;
#ifdef TINTED
    fragments[kWords * entry + 3u] = color.opacity.xy;
    fragments[kWords * entry + 4u] = color.opacity.zw;
#endif
}
#elif defined(TINTED)
void storeFragment(uint entry, float depth, uint primitive, StoredColor color) {
    fragments[kWords * entry] = uvec2(floatBitsToUint(depth), primitive);
    fragments[kWords * entry + 1u] = color.color;
    fragments[kWords * entry + 2u] = color.opacity;
}
#else
void storeFragment(uint entry, float depth, uint primitive, StoredColor color) {
    fragments[entry] = uvec4(floatBitsToUint(depth), primitive, color.color);
}
#endif

/// Returns words 2 * part and 2 * part + 1 of the fragment's colour.
#if defined(KEYS_ONLY) || defined(COLOR_FLOAT) || defined(TINTED)
const uint kColorParts = kWords - 1u;
uvec2 storedColor(uint entry, uint part) { return fragments[kWords * entry + 1u + part].xy; }
#else
const uint kColorParts = 1u;
uvec2 storedColor(uint entry, uint part) { return fragments[entry].zw; }
#endif

uint storedPrimitive(uint entry) { return fragments[kWords * entry].y; }
