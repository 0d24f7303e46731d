// SPDX-License-Identifier: Apache-2.0
// Barrier check: verifies that passes which share storage buffers have the barriers that OpenGL
// requires.
#pragma once

#include "core/gl/functions.h"

namespace peeler::gl {

/// If the environment variable PEELER_CHECK_BARRIERS is set, makes these functions throw Error
/// (kInternal) if a barrier that OpenGL requires is missing (4.5 core, 7.13.2, "Shader Memory
/// Access Synchronization"): before a pass uses a storage buffer that an earlier pass wrote, before
/// a pass writes a storage buffer that an earlier pass read, or before a command or the CPU
/// accesses a storage buffer that a pass wrote. Software renderers often tolerate a missing
/// barrier; GPUs may not. A pass begins when a framebuffer is bound or work is dispatched. Accesses
/// within a pass are not checked, since shaders use atomics there. Must be called once for the
/// functions of a context, on the context's thread. If a thread has several contexts, only the last
/// checked context may be used. If the variable is not set, does nothing.
void checkBarriers(Functions& functions, const ProcAddress& lookup);

}  // namespace peeler::gl
