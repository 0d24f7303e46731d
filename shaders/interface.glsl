// SPDX-License-Identifier: Apache-2.0
// The interface shared by C++ and GLSL: bindings, locations, and the records of uniform blocks (std140).
#ifdef __cplusplus
#pragma once
#include <cstdint>
#include <glm/glm.hpp>
namespace peeler::shader {
using glm::ivec4;
using glm::mat4;
using glm::uvec4;
using glm::vec3;
using glm::vec4;
#endif

// Vertex attributes.
#define PEELER_POSITION 0
#define PEELER_NORMAL 1
#define PEELER_TANGENT 2
#define PEELER_TEXCOORD0 3
#define PEELER_TEXCOORD1 4
#define PEELER_COLOR 5

// Varyings. Their locations are explicit, since drivers may assign different locations in
// separately compiled stages.
#define PEELER_FIRST_KEY 0
#define PEELER_CLIP_DEPTH 1
#define PEELER_SURFACE 2          // a block of five varyings
#define PEELER_WORLD_FROM_VIEW 7  // a matrix of three columns
#define PEELER_MATERIAL_COLOR 10
#define PEELER_MATERIAL_EMISSIVE 11
#define PEELER_MATERIAL_FACTORS 12
#define PEELER_MESH_SCALE 13

// Uniform blocks.
#define PEELER_FRAME_BLOCK 0
#define PEELER_DRAW_BLOCK 1
#define PEELER_MATERIAL_BLOCK 2

// Storage blocks of a band.
#define PEELER_LIST_HEADS 0       // uint per pixel: entry of the pixel's next fragment; in the count pass, its fragment count
#define PEELER_FRAGMENTS 1   // layout: see stored_fragments.glsl
// Blocks of a composite, which replace PEELER_FRAGMENTS. Per pixel:
#define PEELER_DEPTHS 1      // float: buffer depth (reversed Z) of the nearest fragment
#define PEELER_STAMPS 2      // two uints: the last passes that composited a front and a back fragment
#define PEELER_COLORS 3      // four floats (eight with TINTED): colour
#define PEELER_COUNTS 4      // uint: number of fragments, from the count pass
// Blocks of layers that stay on the GPU. PEELER_LIST_HEADS and PEELER_FRAGMENTS are used with them; here the list heads
// are the start of each pixel's list, and one more entry after the last pixel is the end of the last list. Below, each
// pixel's fragments are in order from front to back.
#define PEELER_LAYER_OFFSETS 2  // uint per pixel: index of its first fragment; one more entry: number of all fragments
#define PEELER_LAYER_COUNTS 3   // uint per pixel: number of fragments
#define PEELER_LAYER_DEPTHS 4   // float per fragment: camera Z
#define PEELER_LAYER_COLORS 5   // colour per fragment, as in stored_fragments.glsl
// The boundary of a clip mesh: pixel p has the depths [clip_first[p], clip_first[p + 1]).
#define PEELER_CLIP_FIRST 5
#define PEELER_CLIP_DEPTHS 6  // float: buffer depth; the sign bit is set on back faces
#define PEELER_LIGHTS 7      // a LightCount, then a LightRecord for each light
#define PEELER_INSTANCES 8   // Placements of all draws with several instances
#define PEELER_CHANNELS 9    // channel values of each fragment (floats), from channels.frag
// Blocks of shaded hits, which replace PEELER_LIST_HEADS and PEELER_FRAGMENTS.
#define PEELER_HITS 0        // a HitRecord per hit
#define PEELER_HIT_COLORS 1  // colour per hit, as in packed_color.glsl
// The samples of pixels, row by row, y down (sample_keys.comp).
#define PEELER_SAMPLE_KEYS 0    // four keys of triangles per pixel; 0 = none
#define PEELER_SAMPLE_DEPTHS 1  // float per pixel: the greatest buffer depth of the samples

// Texture units. GL guarantees 16 per shader. A material may use 17, and lights and peeling need
// others. So a program declares only the samplers that its variant reads, and GpuScene counts a
// material's textures.
#define PEELER_BASE_COLOR_UNIT 0
#define PEELER_METALLIC_ROUGHNESS_UNIT 1  // or the texture of specular and glossiness
#define PEELER_NORMAL_UNIT 2
#define PEELER_OCCLUSION_UNIT 3
#define PEELER_EMISSIVE_UNIT 4
#define PEELER_SPECULAR_UNIT 5
#define PEELER_SPECULAR_COLOR_UNIT 6
#define PEELER_CLEARCOAT_UNIT 7
#define PEELER_CLEARCOAT_ROUGHNESS_UNIT 8
#define PEELER_CLEARCOAT_NORMAL_UNIT 9
#define PEELER_SHEEN_COLOR_UNIT 10
#define PEELER_SHEEN_ROUGHNESS_UNIT 11
#define PEELER_ANISOTROPY_UNIT 12
#define PEELER_IRIDESCENCE_UNIT 13
#define PEELER_IRIDESCENCE_THICKNESS_UNIT 14
#define PEELER_TRANSMISSION_UNIT 15
#define PEELER_THICKNESS_UNIT 16
#define PEELER_MATERIAL_UNITS 17
#define PEELER_OPAQUE_DEPTH_UNIT 17
#define PEELER_OPAQUE_FRAGMENT_UNIT 17
#define PEELER_OPAQUE_PRIMITIVE_UNIT 18
#define PEELER_PREVIOUS_DEPTH_UNIT 19
#define PEELER_PREVIOUS_PRIMITIVE_UNIT 20
#define PEELER_PREVIOUS_COLOR_UNIT 21
#define PEELER_SHADOW_UNIT 22
#define PEELER_ENVIRONMENT_UNIT 23  // this and later units are filtered linearly, with mipmaps
#define PEELER_IRRADIANCE_UNIT 24
#define PEELER_ALBEDO_UNIT 25
#define PEELER_LOBE_UNIT 26
// Units of full-screen passes over composites, which draw no geometry:
#define PEELER_FRONT_UNIT 17
#define PEELER_BACK_UNIT 18
#define PEELER_TAIL_SUM_UNIT 19
#define PEELER_TAIL_COUNT_UNIT 20
#define PEELER_BACK_OPACITY_UNIT 21
#define PEELER_TAIL_OPACITY_UNIT 22
#define PEELER_LAYER_OPACITY_UNIT 22
#define PEELER_COVERAGE_UNIT 17
#define PEELER_MOMENTS_UNIT 19
#define PEELER_ABSORBANCE_UNIT 20

#define PEELER_MAX_HALF_SPACES 32

// Bits of DrawRecord.ids.z.
#define PEELER_HAS_NORMALS 1u
#define PEELER_HAS_TANGENTS 2u
#define PEELER_HAS_COLORS 4u
#define PEELER_IS_TRIANGLES 8u
#define PEELER_MIRRORED 16u

// Bits of MaterialRecord.flags.x. Bit PEELER_FIRST_TEXTURE_BIT << unit means that a texture is bound at that unit.
#define PEELER_ALPHA_MASK 1u
#define PEELER_ALPHA_BLEND 2u
#define PEELER_UNLIT 4u
#define PEELER_FIRST_TEXTURE_BIT 16u

// The direction of the built-in key light: unit vector toward the light, world space.
#define PEELER_KEY_DIRECTION vec3(-0.4364358, 0.7637626, 0.4755910)

/// The uniforms of one raster tile of one band.
struct FrameRecord {
    mat4 world_from_view;  // rotation only
    ivec4 tile;            // x0, y0, width and height of the tile in the picture; y down
    ivec4 band;            // x0, y0, width and height of the band in the picture; y down
    uvec4 limits; // x: number of nearest layers that a composite orders; w: always 0, which compilers cannot know
    mat4 view_from_ndc;    // from NDC of the tile to homogeneous view space
    ivec4 clip;            // x: number of half-spaces; y: 1 = keep the inside; z: 1 = a clip mesh exists
    vec4 half_spaces[PEELER_MAX_HALF_SPACES];  // view space; a point p is inside if dot(xyz, p) >= w
};

/// The transforms of one instance of a primitive.
struct Placement {
    mat4 clip_from_model;
    mat4 view_from_model;
    mat4 normal_from_model;  // inverse transpose of view_from_model's linear part
};

/// One primitive of a mesh, in one or more instances.
struct DrawRecord {
    Placement placement;  // used if there is only one instance
    uvec4 ids;  // x: key of the first primitive, y: key stride between instances, z: the bits above,
                // w: index of the first instance in PEELER_INSTANCES
};

struct MaterialRecord {
    vec4 base_color;
    vec4 emissive;                // w: alpha cutoff
    vec4 factors;                 // metallic and roughness factors, normal scale, occlusion strength
    vec4 specular;       // rgb and a: colour and factor of KHR_materials_specular; or specular, glossiness
    vec4 clearcoat;      // factor, roughness, normal scale
    vec4 sheen;          // rgb: colour; a: roughness
    vec4 anisotropy;     // strength, cosine and sine of the rotation
    vec4 iridescence;    // factor, index of refraction, minimum and maximum thickness (nm)
    vec4 transmission;   // factor, thickness, 1 / attenuation distance; w: F0 of a dielectric
    vec4 attenuation;    // rgb: attenuation colour
    vec4 texture_transform[2 * PEELER_MATERIAL_UNITS];  // two rows of a 3x3 matrix
    uvec4 flags;         // x: the bits above; y, z (a bit per texture unit): has a transform, uses the second UV set
};

/// A hit of a traced ray (std430), in view space. Derivatives are along the surface, per pixel to the right (dx) and
/// upwards (dy).
struct HitRecord {
    vec4 position;  // w: 1 on a front face, -1 on a back face
    vec4 toward;    // xyz: unit vector against the ray; w: length of a mesh unit
    vec4 normal;    // interpolated, not normalised; w: bits of the samples that show the surface
    vec4 tangent;   // w: handedness
    vec4 texcoords;
    vec4 color;
    vec4 texcoords_dx, texcoords_dy;
    vec4 position_dx, position_dy;
};

struct LightCount {
    uvec4 lights;  // x: number of lights
};

/// One light (std430), in view space.
struct LightRecord {
    vec4 position;  // position, w = 1; for a directional light, the unit vector toward the light, w = 0
    vec4 axis;      // unit vector opposite to the light's direction; w: 1 / range, 0 = infinite
    vec4 color;     // colour times intensity (lux for a directional light, candela for others)
    vec4 cone;      // x: scale, y: offset, applied to the cosine of the angle to the axis
    // To the light's shadow map: x and y from -1 to 1, y up (for perspective, times z); z is the depth along the
    // light's axis.
    mat4 map_from_view;
    vec4 map;  // x: layer of the map, -1 = no map; y: 1 = perspective
};

#ifdef __cplusplus
}  // namespace peeler::shader
#endif
