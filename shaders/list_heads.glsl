// SPDX-License-Identifier: Apache-2.0
// List heads: the entry of the next fragment of each pixel, or how many it has. With FETCHED_LIST_HEADS they are the
// render target, and the shader reads what it overwrites (GL_EXT_shader_framebuffer_fetch): fragments of a pixel come one
// after the other there, and no atomic counter is needed.
#ifdef FETCHED_LIST_HEADS
layout(location = 0) inout uint fetched_head;

uint takeEntry() { return fetched_head++; }
#else
layout(std430, binding = PEELER_LIST_HEADS) buffer ListHeads { uint list_heads[]; };

uint takeEntry() { return atomicAdd(list_heads[pixelIndex()], 1u); }
#endif
