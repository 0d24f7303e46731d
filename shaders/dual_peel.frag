// SPDX-License-Identifier: Apache-2.0
// Dual depth peeling (Bavoil & Myers 2008). Peels the fragments at the front and back depths that
// the previous pass has found. Fragments between these depths set the range for the next pass.
// Peeled fragments are appended to their pixel's list. Coincident fragments are peeled together, so
// that no fragment is lost. The lists are sorted afterwards.
#include "shade.glsl"
#include "stored_fragments.glsl"
#include "list_heads.glsl"

layout(binding = PEELER_PREVIOUS_DEPTH_UNIT) uniform sampler2D previous_range;

layout(location = 0) out vec2 range;

void main() {
    Gradients gradients = surfaceGradients();
    vec4 base = baseColor(gradients);
    if (!passesAlphaTest(base.a)) discard;
    Key key = fragmentKey();
    if (!inRange(key)) discard;
    vec2 previous = texelFetch(previous_range, ivec2(gl_FragCoord.xy), 0).rg;
    float front = previous.x, back = -previous.y;
    if (key.depth > front || key.depth < back) discard;  // already peeled
    if (key.depth < front && key.depth > back) {
        range = vec2(key.depth, -key.depth);
        return;
    }
    uint entry = takeEntry();
    if (hasEntry(entry)) storeFragment(entry, key.depth, key.primitive, fragmentColor(base, gradients));
    discard;
}
