// SPDX-License-Identifier: Apache-2.0
// Storage format of a fragment's colour: four halfs or, with COLOR_FLOAT, four floats. With TINTED,
// four more numbers follow: the opacity of each channel, and an unused one.
#ifdef COLOR_FLOAT
#define PACKED_COLOR uvec4
PACKED_COLOR packColor(vec4 color) { return floatBitsToUint(color); }
vec4 unpackColor(PACKED_COLOR color) { return uintBitsToFloat(color); }
PACKED_COLOR packedTexel(uvec4 texel) { return texel; }
#else
#define PACKED_COLOR uvec2
// Packs the halfs in the shader, not by the render target's format, so that every method rounds in the same way.
PACKED_COLOR packColor(vec4 color) { return uvec2(packHalf2x16(color.rg), packHalf2x16(color.ba)); }
vec4 unpackColor(PACKED_COLOR color) { return vec4(unpackHalf2x16(color.r), unpackHalf2x16(color.g)); }
PACKED_COLOR packedTexel(uvec4 texel) { return texel.rg; }
#endif

struct StoredColor {
    PACKED_COLOR color;  // premultiplied, with alpha
#ifdef TINTED
    PACKED_COLOR opacity;  // opacity of each channel; alpha is the mean of the three
#endif
};
