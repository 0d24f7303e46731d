// SPDX-License-Identifier: Apache-2.0
// Sums of a pixel's absorbance: its moments over depth (moments.glsl), and the opacity of all fragments.
#include "shade.glsl"
#include "moments.glsl"

layout(location = 0) out vec4 covered;
layout(location = 1) out vec4 moments;
layout(location = 2) out float absorbance;

void main() {
    Gradients gradients = surfaceGradients();
    vec4 base = baseColor(gradients);
    if (!passesAlphaTest(base.a)) discard;
    if (!inRange(fragmentKey())) discard;
    StoredColor stored = fragmentColor(base, gradients);
    float alpha = compositedColor(stored).a;
#ifdef TINTED
    covered = unpackColor(stored.opacity);
#else
    covered = vec4(alpha);
#endif
    float z = momentDepth(gl_FragCoord.z), z2 = z * z;
    absorbance = -log(1.0 - min(alpha, 0.9999));  // finite for opaque fragments
    moments = absorbance * vec4(z, z2, z2 * z, z2 * z2);
}
