// SPDX-License-Identifier: Apache-2.0
// List heads: the entry of each pixel's next fragment, or the pixel's fragment count. With
// FETCHED_LIST_HEADS, the list heads are the render target. The shader then reads the value that it
// overwrites (GL_EXT_shader_framebuffer_fetch). The fragments of a pixel run in order, so no atomic
// counter is needed.
#ifdef FETCHED_LIST_HEADS
layout(location = 0) inout uint fetched_head;

uint takeEntry() { return fetched_head++; }
#else
layout(std430, binding = PEELER_LIST_HEADS) buffer ListHeads { uint list_heads[]; };

uint takeEntry() { return atomicAdd(list_heads[pixelIndex()], 1u); }
#endif
