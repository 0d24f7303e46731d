// SPDX-License-Identifier: Apache-2.0
// Surface properties for lighting, and the surface's reflection of lights and environment.
// Directions are in world space. Each material extension has its own shader variants, so the code
// of unused extensions is not compiled.
#include "normal.glsl"
#include "lobes.glsl"
#ifdef IRIDESCENCE
#include "iridescence.glsl"
#endif

#ifdef TEXTURED
#ifdef SPECULAR
layout(binding = PEELER_SPECULAR_UNIT) uniform sampler2D specular_texture;
layout(binding = PEELER_SPECULAR_COLOR_UNIT) uniform sampler2D specular_color_texture;
#endif
#ifdef CLEARCOAT
layout(binding = PEELER_CLEARCOAT_UNIT) uniform sampler2D clearcoat_texture;
layout(binding = PEELER_CLEARCOAT_ROUGHNESS_UNIT) uniform sampler2D clearcoat_roughness_texture;
#endif
#ifdef SHEEN
layout(binding = PEELER_SHEEN_COLOR_UNIT) uniform sampler2D sheen_color_texture;
layout(binding = PEELER_SHEEN_ROUGHNESS_UNIT) uniform sampler2D sheen_roughness_texture;
#endif
#ifdef ANISOTROPY
layout(binding = PEELER_ANISOTROPY_UNIT) uniform sampler2D anisotropy_texture;
#endif
#ifdef IRIDESCENCE
layout(binding = PEELER_IRIDESCENCE_UNIT) uniform sampler2D iridescence_texture;
layout(binding = PEELER_IRIDESCENCE_THICKNESS_UNIT) uniform sampler2D iridescence_thickness_texture;
#endif
#endif

// Lower limits of alpha. With alpha 0, a mirror would show lights only as infinitely small
// highlights, and the exponents of sheen would be infinite.
const float kLeastAlpha = 0.002, kLeastSheenAlpha = 0.005;

// A mix, by `metallic`, of a dielectric and a metal (glTF 2.0, appendix B.3.5). The dielectric
// (metallic 0) has diffuse light below a specular layer with f0 and f90. The metal (metallic 1) has
// the F0 `metal`, an F90 of 1 and no diffuse light.
struct Reflector {
    vec3 diffuse, f0, metal;
    float f90, metallic;
    float roughness, alpha, n_dot_v;
    vec3 n, v;
#ifdef ANISOTROPY
    vec3 tangent, bitangent;
    float strength;
#endif
#ifdef SHEEN
    vec3 sheen;
    float sheen_roughness;
#endif
#ifdef CLEARCOAT
    vec3 coat_n;
    float coat, coat_roughness, coat_n_dot_v;  // coat: clearcoat factor times Fresnel term
#endif
};

float largest(vec3 v) { return max(max(v.r, v.g), v.b); }

/// Returns the fraction of light that reaches the diffuse surface below a layer that reflects `reflected`. If
/// reflections may be tinted (SPECULAR), the fraction is the same for all channels, because a tinted reflection must
/// not tint the transmitted light.
vec3 beneath(vec3 reflected) {
#ifdef SPECULAR
    return vec3(1.0 - largest(reflected));
#else
    return 1.0 - reflected;
#endif
}

#ifdef ANISOTROPY
void setAnisotropy(inout Reflector s, Gradients g) {
    vec3 texel = TEXEL(anisotropy_texture, PEELER_ANISOTROPY_UNIT).rgb;
    vec2 direction = vec2(1.0, 0.0);
#ifdef TEXTURED
    if (hasTexture(PEELER_ANISOTROPY_UNIT)) direction = texel.rg * 2.0 - 1.0;
    int unit = hasTexture(PEELER_NORMAL_UNIT) ? PEELER_NORMAL_UNIT : PEELER_ANISOTROPY_UNIT;
#else
    const int unit = PEELER_NORMAL_UNIT;
#endif
    vec2 turn = material.anisotropy.yz;
    direction = vec2(turn.x * direction.x - turn.y * direction.y, turn.y * direction.x + turn.x * direction.y);
    vec3 tangent, bitangent;
    tangentFrame(geometricNormal(g), unit, g, tangent, bitangent);
    vec3 along = world_from_view * (tangent * direction.x + bitangent * direction.y);
    along -= s.n * dot(s.n, along);  // a mapped normal may not be perpendicular to the tangents
    s.strength = clamp(material.anisotropy.x * texel.b, 0.0, 1.0);
    float size = dot(along, along);
    if (!(size > 1e-12)) {  // without texture coordinates, highlights cannot be stretched
        s.strength = 0.0;
        along = cross(s.n, abs(s.n.x) < 0.9 ? vec3(1.0, 0.0, 0.0) : vec3(0.0, 1.0, 0.0));
        size = dot(along, along);
    }
    s.tangent = along * inversesqrt(size);
    s.bitangent = cross(s.n, s.tangent);
}
#endif

#ifdef IRIDESCENCE
/// Returns an F0 for a film on a base with reflectance `f0`. At this view angle, Schlick's term
/// with this F0 gives the film's reflectance.
vec3 filmed(vec3 f0, float film, float thickness, float n_dot_v) {
    vec3 seen = filmReflectance(material.iridescence.y, n_dot_v, thickness, f0);
    float x = min(grazing(n_dot_v), 0.9999);
    return mix(f0, clamp((seen - x) / (1.0 - x), 0.0, 1.0), film);
}
#endif

/// Mixes dielectric and metal. Pure materials keep their exact bits.
vec3 mixed(Reflector s, vec3 dielectric, vec3 metal) { return dielectric * (1.0 - s.metallic) + metal * s.metallic; }

/// Returns the surface properties for the base colour `base` (linear, without alpha).
Reflector reflectorOf(vec3 base, Gradients g) {
    Reflector s;
#if defined(TRACED)
    vec3 view = toward_eye;
#elif defined(ORTHOGRAPHIC)
    vec3 view = vec3(0.0, 0.0, 1.0);
#else
    vec3 view = normalize(-surface.position);
#endif
    s.v = world_from_view * view;
    s.n = world_from_view * shadingNormal(g);
    s.n_dot_v = clamp(dot(s.n, s.v), 1e-4, 1.0);

    vec2 rough_metal = roughnessMetallic(g);
    s.roughness = rough_metal.x;
    s.f90 = 1.0;
    s.metal = base;
    s.diffuse = base;
#ifdef SPECULAR_GLOSSINESS
    s.metallic = 0.0;
    s.f0 = material.specular.rgb * TEXEL(metallic_roughness_texture, PEELER_METALLIC_ROUGHNESS_UNIT).rgb;
    s.diffuse = base * (1.0 - largest(s.f0));
#else
    s.metallic = rough_metal.y;
    // The result is always 0.04. The min() keeps compilers from folding the constant with other constants, since the
    // folded value would be rounded differently from a texture's value.
    s.f0 = vec3(min(material.transmission.w, 0.04));
#ifdef SPECULAR
    float share = material.specular.a * TEXEL(specular_texture, PEELER_SPECULAR_UNIT).a;
    vec3 tint = material.specular.rgb * TEXEL(specular_color_texture, PEELER_SPECULAR_COLOR_UNIT).rgb;
    s.f0 = min(material.transmission.w * tint, 1.0) * share;
    s.f90 = share;
#endif
#endif
    s.alpha = max(s.roughness * s.roughness, kLeastAlpha);

#ifdef ANISOTROPY
    setAnisotropy(s, g);
#endif
#ifdef IRIDESCENCE
    float film = material.iridescence.x * TEXEL(iridescence_texture, PEELER_IRIDESCENCE_UNIT).r;
    float thickness = mix(material.iridescence.z, material.iridescence.w,
                          TEXEL(iridescence_thickness_texture, PEELER_IRIDESCENCE_THICKNESS_UNIT).g);
    s.f0 = filmed(s.f0, film, thickness, s.n_dot_v);
    s.metal = filmed(s.metal, film, thickness, s.n_dot_v);
#endif
#ifdef SHEEN
    s.sheen = material.sheen.rgb * TEXEL(sheen_color_texture, PEELER_SHEEN_COLOR_UNIT).rgb;
    s.sheen_roughness = clamp(material.sheen.a * TEXEL(sheen_roughness_texture, PEELER_SHEEN_ROUGHNESS_UNIT).a, 0.0, 1.0);
#endif
#ifdef CLEARCOAT
    s.coat_n = world_from_view * clearcoatNormal(g);
    s.coat_n_dot_v = clamp(dot(s.coat_n, s.v), 1e-4, 1.0);
    s.coat = clamp(material.clearcoat.x * TEXEL(clearcoat_texture, PEELER_CLEARCOAT_UNIT).r, 0.0, 1.0) *
             (0.04 + 0.96 * grazing(s.coat_n_dot_v));
    s.coat_roughness = clamp(
        material.clearcoat.y * TEXEL(clearcoat_roughness_texture, PEELER_CLEARCOAT_ROUGHNESS_UNIT).g, 0.0, 1.0);
#endif
    return s;
}

/// Returns the cosine between the normal and the unit direction `l`; 0 from behind.
float facing(Reflector s, vec3 l) { return clamp(dot(s.n, l), 0.0, 1.0); }

/// Whether light from `l` reaches the surface or its clearcoat.
bool isLit(Reflector s, vec3 l) {
#ifdef CLEARCOAT
    if (dot(s.coat_n, l) > 0.0) return true;
#endif
    return facing(s, l) > 0.0;
}

/// Returns the radiance toward the viewer for light from `l` with irradiance 1 at normal incidence. Excludes the
/// surface cosine and the clearcoat.
vec3 reflectance(Reflector s, vec3 l) {
    vec3 h = normalize(s.v + l);
    float n_dot_l = facing(s, l);
    float n_dot_h = clamp(dot(s.n, h), 0.0, 1.0), v_dot_h = clamp(dot(s.v, h), 0.0, 1.0);
#ifdef ANISOTROPY
    vec3 own_l = vec3(dot(s.tangent, l), dot(s.bitangent, l), n_dot_l);
    vec3 own_v = vec3(dot(s.tangent, s.v), dot(s.bitangent, s.v), s.n_dot_v);
    vec3 own_h = vec3(dot(s.tangent, h), dot(s.bitangent, h), n_dot_h);
    float lobe = anisotropicGgx(vec2(mix(s.alpha, 1.0, s.strength * s.strength), s.alpha), own_l, own_v, own_h);
#else
    float lobe = ggx(s.alpha, n_dot_l, s.n_dot_v, n_dot_h);
#endif
    float schlick = grazing(v_dot_h);
    vec3 fresnel = s.f0 + (s.f90 - s.f0) * schlick;
    vec3 share = mixed(s, beneath(fresnel) * s.diffuse / kPi + fresnel * lobe,
                       (s.metal + (1.0 - s.metal) * schlick) * lobe);
#ifdef SHEEN
    float alpha = max(s.sheen_roughness * s.sheen_roughness, kLeastSheenAlpha);
    float taken = max(tabledAlbedo(s.n_dot_v, s.sheen_roughness).z, tabledAlbedo(n_dot_l, s.sheen_roughness).z);
    share = (1.0 - largest(s.sheen) * taken) * share + s.sheen * charlie(alpha, n_dot_l, s.n_dot_v, n_dot_h);
#endif
    return share;
}

#ifdef CLEARCOAT
/// Returns the clearcoat's reflectance, including the cosine.
float coatReflectance(Reflector s, vec3 l) {
    vec3 h = normalize(s.v + l);
    float n_dot_l = clamp(dot(s.coat_n, l), 0.0, 1.0);
    float alpha = max(s.coat_roughness * s.coat_roughness, kLeastAlpha);
    return s.coat * n_dot_l * ggx(alpha, n_dot_l, s.coat_n_dot_v, clamp(dot(s.coat_n, h), 0.0, 1.0));
}
#endif

#ifdef ENVIRONMENT
/// Returns the prefiltered radiance for the F0 or the F90 term of a lobe. `part` is the half of
/// tabledLobe() for this term.
vec3 radianceAlong(vec3 n, vec3 mirrored, float roughness, vec2 part) {
    return environmentRadiance(mix(n, mirrored, part.x), min(roughness * part.y, 1.0));
}

/// Fractions of light that microfacets reflect (Fdez-Agüera, "A Multiple-Scattering Microfacet Model for Real-Time
/// Image Based Lighting", 2019). `once`: single scattering, applied to light from the mirror direction. `again`:
/// multiple scattering, applied to light from the whole hemisphere.
struct Reflected {
    vec3 once, again;
};
Reflected reflected(vec3 f0, float f90, vec2 scale_bias) {
    Reflected r;
    r.once = f0 * scale_bias.x + f90 * scale_bias.y;
    float missing = 1.0 - scale_bias.x - scale_bias.y;
    vec3 mean = f0 + (f90 - f0) / 21.0;
    r.again = r.once * mean * missing / (1.0 - mean * missing);
    return r;
}

#ifdef ANISOTROPY
/// Returns the radiance reflected by anisotropic microfacets. Samples normals along the tangent, by their distribution
/// and their visibility from `v`. Each sample looks up a round lobe, as wide as the microfacets' lobe across the
/// tangent, or wider if necessary to reach the next sample.
vec3 stretchedRadiance(Reflector s) {
    const int kNormals = 12;
    const float kReach = 0.6;  // width of a lobe, in gaps between samples; narrower lobes would leave stripes
    float along = mix(s.alpha, 1.0, s.strength * s.strength);
    vec3 sum = vec3(0.0);
    float weights = 0.0;
    for (int i = 0; i < kNormals; ++i) {
        float u = (2.0 * float(i) + 1.0) / float(kNormals) - 1.0, rest = 1.0 - u * u;
        vec3 h = normalize(s.n + s.tangent * (along * u * inversesqrt(rest)));
        float v_dot_h = dot(s.v, h);
        vec3 l = reflect(-s.v, h);
        float n_dot_l = dot(s.n, l);
        if (v_dot_h <= 0.0 || n_dot_l <= 0.0) continue;
        float across = dot(s.tangent, l) * along;
        float weight = v_dot_h / dot(s.n, h) * 2.0 * n_dot_l / (n_dot_l + sqrt(n_dot_l * n_dot_l + across * across));
        float gap = 2.0 / float(kNormals) * along * inversesqrt(rest) / (rest + along * along * u * u);
        float roughness = sqrt(clamp(kReach * gap, s.alpha, 1.0));
        // Turns rough lobes towards the normal. The power was fitted to numerical integrals.
        sum += weight * environmentRadiance(mix(l, s.n, roughness * roughness * roughness), roughness);
        weights += weight;
    }
    return weights > 0.0 ? sum / weights : environmentRadiance(s.n, s.roughness);
}
#endif

#ifdef SHEEN
/// Returns the radiance reflected by fibres, divided by their albedo. This is the mean radiance
/// over all directions, weighted by the lobe. Directions where the lobe is far below its maximum
/// are left out. The other directions are divided into cells, with one lookup for each cell, as
/// wide as the cell (Krivanek & Colbert, "Real-time Shading with Filtered Importance Sampling",
/// 2008). Cells form rings around the normal, symmetric about the plane of the view and evenly
/// spaced in azimuth.
vec3 fibresRadiance(Reflector s) {
    const int kRings = 3, kMost = 9;  // each ring nearer to the normal has one cell fewer
    // Directions are left out if the lobe is below this fraction of its maximum, in the plane of
    // the view or in a ring.
    const float kLeast = 0.16;
    // The alpha of a GGX lobe as wide as a cell is this factor times the square root of the cell's
    // solid angle.
    const float kReach = 0.3;
    float alpha = max(s.sheen_roughness * s.sheen_roughness, kLeastSheenAlpha);
    float v_sine = sqrt(1.0 - s.n_dot_v * s.n_dot_v);
    vec3 toward = s.v - s.n * dot(s.n, s.v);
    if (dot(toward, toward) < 1e-8) toward = cross(s.n, abs(s.n.x) < 0.9 ? vec3(1.0, 0.0, 0.0) : vec3(0.0, 1.0, 0.0));
    toward = normalize(toward);
    vec3 aside = cross(s.n, toward);

    // The distribution is a power of the sine of the half vector's angle to the normal. In the plane of the view, this
    // angle is the mean of the light's and the view's angles. The half vector's angle is largest for light from the
    // horizon.
    float v_angle = acos(s.n_dot_v), root = pow(kLeast, alpha);
    float least_angle = 2.0 * asin(root * sin(0.5 * (0.5 * kPi + v_angle))) - v_angle;
    float top = cos(max(least_angle, 0.0));
    vec3 sum = vec3(0.0);
    float weights = 0.0;
    for (int ring = 0; ring < kRings; ++ring) {
        // Rings are closer together near the horizon.
        vec3 edges = pow((vec3(0.0, 0.5, 1.0) + float(ring)) / float(kRings), vec3(1.3));
        float n_dot_l = top * edges.y, sine = sqrt(1.0 - n_dot_l * n_dot_l);
        float cosines = n_dot_l * s.n_dot_v, sines = max(sine * v_sine, 1e-6);
        float across = (n_dot_l + s.n_dot_v) * (n_dot_l + s.n_dot_v);
        // `widest` is the azimuth at which the lobe falls to the threshold in this ring. The
        // squared cosine of the half vector's angle is across / (2 + 2 l.v), and the lobe is a
        // power of the sine.
        float greatest = 1.0 - across / (2.0 + 2.0 * (cosines + sines));
        float widest = acos(clamp((across / (1.0 - greatest * root * root) - 2.0 - 2.0 * cosines) / (2.0 * sines),
                                  -1.0, 1.0));
        int cells = kMost - ring;
        float cell = top * (edges.z - edges.x) * 2.0 * widest / float(cells);
        float roughness = sqrt(min(kReach * sqrt(cell), 1.0));
        float of_ring = cell * n_dot_l * sheenVisibility(alpha, n_dot_l, s.n_dot_v);
        for (int i = cells % 2 == 1 ? 0 : 1; i < cells; i += 2) {
            float azimuth = widest * float(i) / float(cells);
            float cosine = cosines + sines * cos(azimuth);
            float weight = of_ring * sheenDistribution(alpha, sqrt(across / (2.0 + 2.0 * cosine)));
            vec3 middle = s.n * n_dot_l + toward * (sine * cos(azimuth)), off = aside * (sine * sin(azimuth));
            vec3 radiance = environmentRadiance(middle + off, roughness);
            if (i > 0) {
                radiance += environmentRadiance(middle - off, roughness);
                weights += weight;
            }
            sum += weight * radiance;
            weights += weight;
        }
    }
    return weights > 0.0 ? sum / weights : environmentDiffuse(s.n);
}
#endif

/// Returns the surface's reflection of the environment, without the clearcoat. `occlusion`: the fraction of the
/// environment's light that arrives.
vec3 reflectedEnvironment(Reflector s, float occlusion) {
    vec2 scale_bias = environmentBrdf(s.roughness, s.n_dot_v);
#ifdef ANISOTROPY
    // The mean of two values: for the roughness along the direction of anisotropy, and for the
    // roughness across it.
    float along = mix(s.alpha, 1.0, s.strength * s.strength);
    scale_bias = 0.5 * (scale_bias + environmentBrdf(sqrt(along), s.n_dot_v));
#endif
    Reflected dielectric = reflected(s.f0, s.f90, scale_bias), metal = reflected(s.metal, 1.0, scale_bias);
    vec3 around = environmentDiffuse(s.n);
#ifdef ANISOTROPY
    vec3 once = mixed(s, dielectric.once, metal.once) * stretchedRadiance(s);
#else
    vec4 lobe = tabledLobe(s.n_dot_v, s.roughness);
    vec3 mirrored = reflect(-s.v, s.n);
    vec3 once = scale_bias.x * mixed(s, s.f0, s.metal) * radianceAlong(s.n, mirrored, s.roughness, lobe.xy) +
                scale_bias.y * mixed(s, vec3(s.f90), vec3(1.0)) * radianceAlong(s.n, mirrored, s.roughness, lobe.zw);
#endif
    vec3 below = s.diffuse * beneath(dielectric.once + dielectric.again);
    vec3 radiance = once + mixed(s, dielectric.again + below, metal.again) * around;
#ifdef SHEEN
    float albedo = tabledAlbedo(s.n_dot_v, s.sheen_roughness).z;
    radiance = (1.0 - largest(s.sheen) * albedo) * radiance + s.sheen * albedo * fibresRadiance(s);
#endif
    return occlusion * radiance;
}

#ifdef CLEARCOAT
/// Returns the clearcoat's reflection of the environment.
vec3 coatEnvironment(Reflector s) {
    vec2 scale_bias = environmentBrdf(s.coat_roughness, s.coat_n_dot_v);
    vec2 part = tabledLobe(s.coat_n_dot_v, s.coat_roughness).xy;
    vec3 once = radianceAlong(s.coat_n, reflect(-s.v, s.coat_n), s.coat_roughness, part);
    return s.coat * mix(environmentDiffuse(s.coat_n), once, scale_bias.x + scale_bias.y);
}
#endif

#else
/// Returns the surface's reflection of the built-in environment.
vec3 reflectedEnvironment(Reflector s, float occlusion) {
    vec2 scale_bias = environmentBrdf(s.roughness, s.n_dot_v);
    vec3 bent = s.n;
#ifdef ANISOTROPY
    // As in the Khronos sample renderer, after McAuley, "Rendering the World of Far Cry 4", 2015.
    vec3 across = cross(cross(s.bitangent, s.v), s.bitangent);
    float bend = 1.0 - s.strength * (1.0 - s.roughness);
    vec3 toward = mix(across, s.n, bend * bend * bend * bend);
    if (dot(toward, toward) > 1e-12) bent = normalize(toward);
#endif
    vec3 mirrored = environmentRadiance(reflect(-s.v, bent), s.roughness);
    vec3 specular = s.f0 * scale_bias.x + s.f90 * scale_bias.y;
    vec3 radiance = mixed(s, s.diffuse * beneath(specular) * environmentDiffuse(s.n) + specular * mirrored,
                          (s.metal * scale_bias.x + scale_bias.y) * mirrored);
#ifdef SHEEN
    float albedo = tabledAlbedo(s.n_dot_v, s.sheen_roughness).z;
    radiance = (1.0 - largest(s.sheen) * albedo) * radiance +
               s.sheen * albedo * environmentRadiance(reflect(-s.v, s.n), s.sheen_roughness);
#endif
    return occlusion * radiance;
}

#ifdef CLEARCOAT
vec3 coatEnvironment(Reflector s) {
    return s.coat * environmentRadiance(reflect(-s.v, s.coat_n), s.coat_roughness);
}
#endif
#endif
