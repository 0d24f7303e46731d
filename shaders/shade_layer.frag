// SPDX-License-Identifier: Apache-2.0
// Second of two passes: shades the fragment whose key the first pass has found.
#include "shade.glsl"

layout(binding = PEELER_PREVIOUS_PRIMITIVE_UNIT) uniform usampler2D layer_primitive;

layout(location = 0) out PACKED_COLOR color;
#ifdef TINTED
layout(location = 1) out PACKED_COLOR opacity;
#endif

void main() {
    Gradients gradients = surfaceGradients();
    // A primitive has at most one fragment per pixel, so the primitive's index identifies the
    // fragment.
    if (fragmentKey().primitive != texelFetch(layer_primitive, ivec2(gl_FragCoord.xy), 0).r) discard;
    StoredColor stored = fragmentColor(baseColor(gradients), gradients);
    color = stored.color;
#ifdef TINTED
    opacity = stored.opacity;
#endif
}
