// SPDX-License-Identifier: Apache-2.0
// The only vertex shader. All passes use it, since every pass must rasterise exactly the same
// positions.
#include "interface.glsl"

layout(std140, binding = PEELER_DRAW_BLOCK) uniform DrawBlock { DrawRecord draw; };

#ifdef INSTANCED
layout(std430, binding = PEELER_INSTANCES) readonly buffer Instances { Placement instances[]; };
#endif

// Values that are constant over a draw are flat varyings. llvmpipe's fragment shaders need one
// instruction to read a flat varying, but about twenty to read a uniform.
layout(location = PEELER_FIRST_KEY) flat out uint first_key;  // key of the instance's first primitive

layout(location = PEELER_POSITION) in vec3 position;
invariant gl_Position;

#ifdef SLOPES
// This depth is not clamped, unlike gl_FragCoord.z, because derivatives may evaluate it beyond the
// triangle.
layout(location = PEELER_CLIP_DEPTH) noperspective out float clip_depth;
#endif

#ifdef VARYINGS  // defined in every pass that needs surface attributes besides the position
layout(location = PEELER_NORMAL) in vec3 normal;
layout(location = PEELER_TANGENT) in vec4 tangent;
layout(location = PEELER_TEXCOORD0) in vec2 texcoord0;
layout(location = PEELER_TEXCOORD1) in vec2 texcoord1;
layout(location = PEELER_COLOR) in vec4 color;

layout(location = PEELER_SURFACE) out Surface {
    vec3 position;  // view space
    vec3 normal;    // view space
    vec4 tangent;   // view space, w = handedness
    vec4 texcoords;
    vec4 color;
} surface;

layout(std140, binding = PEELER_FRAME_BLOCK) uniform FrameBlock { FrameRecord frame; };
layout(std140, binding = PEELER_MATERIAL_BLOCK) uniform MaterialBlock { MaterialRecord material; };

layout(location = PEELER_WORLD_FROM_VIEW) flat out mat3 world_from_view;
layout(location = PEELER_MATERIAL_COLOR) flat out vec4 material_color;
layout(location = PEELER_MATERIAL_EMISSIVE) flat out vec4 material_emissive;
layout(location = PEELER_MATERIAL_FACTORS) flat out vec4 material_factors;

#ifdef TRANSMISSION
layout(location = PEELER_MESH_SCALE) flat out float mesh_scale;  // length of a mesh unit in view space
#endif
#endif

void main() {
#ifdef INSTANCED
    uint instance = uint(gl_InstanceID);
    Placement placement = instances[draw.ids.w + instance];
    first_key = draw.ids.x + instance * draw.ids.y;
#else
    Placement placement = draw.placement;
    first_key = draw.ids.x;
#endif
    gl_Position = placement.clip_from_model * vec4(position, 1.0);
#ifdef SLOPES
    clip_depth = gl_Position.z / gl_Position.w;
#endif
#ifdef VARYINGS
    surface.position = (placement.view_from_model * vec4(position, 1.0)).xyz;
    surface.normal = mat3(placement.normal_from_model) * normal;
    // In a mirrored mesh, the bitangent is mirrored, but the cross product that computes it is not.
    // So the handedness changes its sign.
    float handedness = (draw.ids.z & PEELER_MIRRORED) != 0u ? -tangent.w : tangent.w;
    surface.tangent = vec4(mat3(placement.view_from_model) * tangent.xyz, handedness);
    surface.texcoords = vec4(texcoord0, texcoord1);
    surface.color = color;
    world_from_view = mat3(frame.world_from_view);
    material_color = material.base_color;
    material_emissive = material.emissive;
    material_factors = material.factors;
#ifdef TRANSMISSION
    mesh_scale = pow(abs(determinant(mat3(placement.view_from_model))), 1.0 / 3.0);
#endif
#endif
}
