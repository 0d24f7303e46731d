// SPDX-License-Identifier: Apache-2.0
// A texture of premultiplied colours, for fixed-function "over" blending.
#include "interface.glsl"

layout(binding = PEELER_FRONT_UNIT) uniform sampler2D source;

layout(location = 0) out vec4 color;

void main() { color = texelFetch(source, ivec2(gl_FragCoord.xy), 0); }
