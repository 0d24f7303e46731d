// SPDX-License-Identifier: Apache-2.0
// Reopens incomplete pixels, so that they can be peeled again. With KEY, resets the key of each
// such pixel to the key before the first layer. Otherwise clears the pixel's composite.
#include "fragment.glsl"

layout(std430, binding = PEELER_LIST_HEADS) buffer ListHeads { uint list_heads[]; };
layout(std430, binding = PEELER_COUNTS) readonly buffer Counts { uint counts[]; };

#ifdef KEY
layout(location = 0) out uint primitive;
#else
layout(location = 0) out vec4 front_color;
layout(location = 1) out vec4 back_color;
#ifdef TAIL
layout(location = 2) out vec4 tail_sum;
layout(location = 3) out float tail_count;
#endif
#endif

void main() {
    uint pixel = pixelIndex();
    if (list_heads[pixel] == min(counts[pixel], frame.limits.x)) discard;
#ifdef KEY
    list_heads[pixel] = 0u;
    primitive = 0u;
    gl_FragDepth = 1.0;
#else
    front_color = vec4(0.0);
    back_color = vec4(0.0);
#ifdef TAIL
    tail_sum = vec4(0.0);
    tail_count = 0.0;
#endif
#endif
}
