// SPDX-License-Identifier: Apache-2.0
// Reflectance of a thin film on a surface (Belcour & Barla, "A Practical Extension to Microfacet Theory for the
// Modeling of Varying Iridescence", 2017), as in KHR_materials_iridescence.

/// Returns the reflectance at normal incidence of an interface between two media with these indices
/// of refraction.
float normalReflectance(float inside, float outside) {
    float ratio = (inside - outside) / (inside + outside);
    return ratio * ratio;
}

/// Returns the eye's sensitivity, in linear Rec. 709, to a phase shift in Fourier space.
vec3 filmSensitivity(float path_difference, vec3 shift) {
    float phase = 2.0 * kPi * path_difference * 1e-9;
    const vec3 value = vec3(5.4856e-13, 4.4201e-13, 5.2481e-13);
    const vec3 position = vec3(1.6810e+06, 1.7953e+06, 2.2084e+06);
    const vec3 variance = vec3(4.3278e+09, 9.3046e+09, 6.6121e+09);
    vec3 xyz = value * sqrt(2.0 * kPi * variance) * cos(position * phase + shift) *
               exp(-phase * phase * variance);
    xyz.x += 9.7470e-14 * sqrt(2.0 * kPi * 4.5282e+09) * cos(2.2399e+06 * phase + shift.x) *
             exp(-4.5282e+09 * phase * phase);
    xyz /= 1.0685e-7;
    const mat3 kRec709FromXyz = mat3(3.2404542, -0.9692660, 0.0556434, -1.5371385, 1.8760108, -0.2040259,
                                     -0.4985314, 0.0415560, 1.0572252);
    return kRec709FromXyz * xyz;
}

/// Returns the reflectance of a film in air. The film has the refractive index `film_ior` and this
/// thickness (nm), and lies on a base with reflectance `f0`. `cosine`: cosine of the view angle.
vec3 filmReflectance(float film_ior, float cosine, float thickness, vec3 f0) {
    // A film much thinner than the wavelengths of light has no effect.
    float ior = mix(1.0, film_ior, smoothstep(0.0, 0.03, thickness));
    float sine2 = (1.0 - cosine * cosine) / (ior * ior);
    if (sine2 > 1.0) return vec3(1.0);  // total internal reflection
    float inner = sqrt(1.0 - sine2);

    float r0 = normalReflectance(ior, 1.0);
    float r12 = r0 + (1.0 - r0) * grazing(cosine), t121 = 1.0 - r12;
    float phase12 = ior < 1.0 ? kPi : 0.0;

    vec3 root = sqrt(clamp(f0, 0.0, 0.9999));
    vec3 base_ior = (1.0 + root) / (1.0 - root);
    vec3 ratio = (base_ior - ior) / (base_ior + ior), r1 = ratio * ratio;
    vec3 r23 = r1 + (1.0 - r1) * grazing(inner);
    vec3 phase23 = mix(vec3(0.0), vec3(kPi), lessThan(base_ior, vec3(ior)));

    float path_difference = 2.0 * ior * thickness * inner;
    vec3 phase = (kPi - phase12) + phase23;
    vec3 r123 = clamp(r12 * r23, 1e-5, 0.9999), amplitude = sqrt(r123);
    vec3 rs = t121 * t121 * r23 / (1.0 - r123);
    vec3 sum = r12 + rs, c = rs - t121;
    for (int m = 1; m <= 2; ++m) {
        c *= amplitude;
        sum += c * 2.0 * filmSensitivity(float(m) * path_difference, float(m) * phase);
    }
    return max(sum, 0.0);
}
