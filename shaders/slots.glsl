// SPDX-License-Identifier: Apache-2.0
// Where the next fragment of a pixel goes, or how many it has. With FETCHED_SLOTS the slots are the render target, and
// the shader reads what it overwrites (GL_EXT_shader_framebuffer_fetch): fragments of a pixel come one after the other
// there, and no atomic counter is needed.
#ifdef FETCHED_SLOTS
layout(location = 0) inout uint fetched_slot;

uint takeSlot() { return fetched_slot++; }
#else
layout(std430, binding = PEELER_SLOTS) buffer Slots { uint slots[]; };

uint takeSlot() { return atomicAdd(slots[pixelIndex()], 1u); }
#endif
