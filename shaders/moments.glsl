// SPDX-License-Identifier: Apache-2.0
// Four power moments of absorbance over depth, and the transmittance that they give (Münstermann, Krumpen, Klein &
// Peters, "Moment-Based Order-Independent Transparency", I3D 2018, sections 3.1 to 3.3).

layout(location = 0) uniform ivec4 depth_range;  // bits of the nearest and the farthest distance

/// Returns a buffer depth on a logarithmic scale, -1 (nearest) to 1 (farthest).
float momentDepth(float depth) {
    vec2 range = intBitsToFloat(depth_range.xy);
    float z = clamp(viewDistance(depth), range.x, range.y);
    return 2.0 * log(z / range.x) / log(range.y / range.x) - 1.0;
}

/// Returns the transmittance in front of a depth. A quarter of the absorbance at the depth itself counts (the paper's
/// overestimation). `moments` has the sums of absorbance times depth to the powers 1 to 4; `absorbance` is the sum of
/// absorbance. The bias of 5e-6 is ten times the paper's, because the rounding of the sums depends on their order. A
/// single fragment must keep a weight.
float transmittanceAt(float z0, vec4 moments, float absorbance) {
    if (absorbance < 0.00100050033) return 1.0;
    vec4 b = mix(moments / absorbance, vec4(0.0, 0.375, 0.0, 0.375), 5e-6);
    // Cholesky factorisation of the Hankel matrix of the moments.
    float l21_d11 = b.z - b.x * b.y;
    float d11 = b.y - b.x * b.x;
    float l21 = l21_d11 / d11;
    float d22 = b.w - b.y * b.y - l21_d11 * l21;
    vec3 c = vec3(1.0, z0 - b.x, z0 * z0 - b.y);
    c.z -= l21 * c.y;
    c.y /= d11;
    c.z /= d22;
    c.y -= l21 * c.z;
    c.x -= dot(c.yz, b.xy);
    // The other two depths at which the moments may have their mass.
    float p = c.y / c.z, q = c.x / c.z;
    float root = sqrt(max(0.0, 0.25 * p * p - q));
    float z1 = -0.5 * p - root, z2 = -0.5 * p + root;
    // The quadratic through the step at the three depths, integrated against the moments.
    vec3 f = vec3(0.25, z1 < z0 ? 1.0 : 0.0, z2 < z0 ? 1.0 : 0.0);
    float f01 = (f.y - f.x) / (z1 - z0);
    float f12 = (f.z - f.y) / (z2 - z1);
    float f012 = (f12 - f01) / (z2 - z0);
    float linear = f01 - f012 * z1;
    vec3 polynomial = vec3(f.x - linear * z0, linear - f012 * z0, f012);
    float before = polynomial.x + dot(polynomial.yz, b.xy);
    return clamp(exp(-absorbance * before), 1e-6, 1.0);
}
