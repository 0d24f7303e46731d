// SPDX-License-Identifier: Apache-2.0
// The fragments of a band, those of a pixel in a row, in the order in which they were captured. Each is two words of
// key and what the band stores of it, side by side: to store one touches one place in memory, and llvmpipe, which
// stores lane by lane, makes one loop of it.
//   KEYS_ONLY: nothing else    SLOPES: two floats    COLOR_FLOAT: four floats    otherwise: four halfs
#include "packed_color.glsl"

#if defined(KEYS_ONLY)
#define FRAGMENT_WORDS uvec2
#elif defined(COLOR_FLOAT)
#define FRAGMENT_WORDS uvec2  // three of them: a uvec4 of six words has no layout without padding
#else
#define FRAGMENT_WORDS uvec4
#endif

layout(std430, binding = PEELER_FRAGMENTS) buffer Fragments { FRAGMENT_WORDS fragments[]; };

/// Whether the band has room for the fragment. Where it has not, there are more than were counted: the check after the
/// pass reports it.
bool hasSlot(uint slot) {
#if defined(COLOR_FLOAT) && !defined(KEYS_ONLY) && !defined(SLOPES)
    slot = 3u * slot + 2u;
#endif
    return slot < uint(fragments.length());
}

#if defined(KEYS_ONLY)
void storeFragment(uint slot, float depth, uint primitive) {
    fragments[slot] = uvec2(floatBitsToUint(depth), primitive);
}
#elif defined(SLOPES)
void storeFragment(uint slot, float depth, uint primitive, vec2 slopes) {
    fragments[slot] = uvec4(floatBitsToUint(depth), primitive, floatBitsToUint(slopes));
}
#elif defined(COLOR_FLOAT)
void storeFragment(uint slot, float depth, uint primitive, PACKED_COLOR color) {
    fragments[3u * slot] = uvec2(floatBitsToUint(depth), primitive);
    fragments[3u * slot + 1u] = color.xy;
    fragments[3u * slot + 2u] = color.zw;
}
#else
void storeFragment(uint slot, float depth, uint primitive, PACKED_COLOR color) {
    fragments[slot] = uvec4(floatBitsToUint(depth), primitive, color);
}
#endif

uint storedPrimitive(uint slot) {
#if defined(COLOR_FLOAT) && !defined(KEYS_ONLY) && !defined(SLOPES)
    return fragments[3u * slot].y;
#else
    return fragments[slot].y;
#endif
}
