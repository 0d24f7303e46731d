// SPDX-License-Identifier: Apache-2.0
// Barrier check: passes that share storage buffers must have the barriers that OpenGL requires.
#pragma once

#include "core/gl/functions.h"

namespace peeler::gl {

/// If the environment variable PEELER_CHECK_BARRIERS is set, makes these functions throw Error
/// (kInternal) when a pass uses a storage buffer that an earlier pass wrote, writes one that an
/// earlier pass read, or the CPU accesses it, without the barrier that OpenGL 4.5 requires in
/// between (core, 7.13.2, "Shader Memory Access Synchronization"). Software renderers forgive a
/// missing barrier, GPUs may not. A pass begins where a framebuffer is bound or work is dispatched;
/// within a pass, shaders use atomics. Call it once for the functions of a context, on its thread;
/// with several contexts on a thread only the last may be used. Does nothing otherwise, at no cost.
void checkBarriers(Functions& functions, const ProcAddress& lookup);

}  // namespace peeler::gl
