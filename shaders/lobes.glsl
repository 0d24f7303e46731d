// SPDX-License-Identifier: Apache-2.0
// Microfacet lobes: the products of distribution and visibility (glTF 2.0, appendix B, and the KHR_materials
// extensions), and Schlick's Fresnel term.

const float kPi = 3.14159265358979;

/// Returns (1 - cosine)^5, the factor in Schlick's Fresnel term.
float grazing(float cosine) {
    float x = 1.0 - cosine, x2 = x * x;
    return x2 * x2 * x;
}

/// Evaluates GGX with height-correlated Smith visibility.
float ggx(float alpha, float n_dot_l, float n_dot_v, float n_dot_h) {
    float a2 = alpha * alpha;
    float d = n_dot_h * n_dot_h * (a2 - 1.0) + 1.0;
    float distribution = a2 / (kPi * d * d);
    float visibility = 0.5 / max(n_dot_l * sqrt(n_dot_v * n_dot_v * (1.0 - a2) + a2) +
                                     n_dot_v * sqrt(n_dot_l * n_dot_l * (1.0 - a2) + a2),
                                 1e-6);
    return distribution * visibility;
}

#ifdef ANISOTROPY
/// Evaluates GGX with separate roughnesses along and across the tangent (KHR_materials_anisotropy). Directions are in
/// tangent space: x along the tangent, y along the bitangent, z along the normal.
float anisotropicGgx(vec2 alpha, vec3 l, vec3 v, vec3 h) {
    float a2 = alpha.x * alpha.y;
    vec3 f = vec3(alpha.y * h.x, alpha.x * h.y, a2 * h.z);
    float w = a2 / dot(f, f);
    float distribution = a2 * w * w / kPi;
    float visibility =
        0.5 / max(l.z * length(vec3(alpha * v.xy, v.z)) + v.z * length(vec3(alpha * l.xy, l.z)), 1e-6);
    return distribution * visibility;
}
#endif

#ifdef SHEEN
// Sheen as in Estevez & Kulla, "Production Friendly Microfacet Sheen BRDF", 2017, with their fit of the shadowing
// terms. core/shading/albedo_table.cpp integrates the same functions.
float sheenLambdaFit(float x, float alpha) {
    float t = (1.0 - alpha) * (1.0 - alpha);
    float a = mix(21.5473, 25.3245, t), b = mix(3.82987, 3.32435, t), c = mix(0.19823, 0.16801, t);
    float d = mix(-1.97760, -1.27393, t), e = mix(-4.32054, -4.85967, t);
    return a / (1.0 + b * pow(x, c)) + d * x + e;
}

float sheenLambda(float cosine, float alpha) {
    return exp(cosine < 0.5 ? sheenLambdaFit(cosine, alpha)
                            : 2.0 * sheenLambdaFit(0.5, alpha) - sheenLambdaFit(1.0 - cosine, alpha));
}

float sheenDistribution(float alpha, float n_dot_h) {
    float sine = sqrt(max(1.0 - n_dot_h * n_dot_h, 0.0));
    return (2.0 + 1.0 / alpha) * pow(sine, 1.0 / alpha) / (2.0 * kPi);
}

float sheenVisibility(float alpha, float n_dot_l, float n_dot_v) {
    float visibility = 1.0 / ((1.0 + sheenLambda(n_dot_v, alpha) + sheenLambda(n_dot_l, alpha)) * 4.0 *
                              max(n_dot_l * n_dot_v, 1e-6));
    return min(visibility, 1.0);
}

float charlie(float alpha, float n_dot_l, float n_dot_v, float n_dot_h) {
    return sheenDistribution(alpha, n_dot_h) * sheenVisibility(alpha, n_dot_l, n_dot_v);
}
#endif
