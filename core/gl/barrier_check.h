// SPDX-License-Identifier: Apache-2.0
// Barrier check: passes that share storage buffers must have the barriers that OpenGL requires.
#pragma once

#include "core/gl/functions.h"

namespace peeler::gl {

/// If the environment variable PEELER_CHECK_BARRIERS is set, makes these functions throw Error
/// (kInternal) if a barrier that OpenGL requires (4.5 core, 7.13.2, "Shader Memory Access
/// Synchronization") is missing: before a pass uses a storage buffer that an earlier pass wrote,
/// before a pass writes a storage buffer that an earlier pass read, or before a command or the CPU
/// accesses a storage buffer that a pass wrote. Software renderers forgive a missing barrier, GPUs
/// may not. A pass begins where a framebuffer is bound or work is dispatched; accesses within a
/// pass are not checked, as shaders use atomics there. Call this once for the functions of a
/// context, on its thread; of several contexts on a thread, only the last may be used. If the
/// variable is not set, does nothing, at no cost.
void checkBarriers(Functions& functions, const ProcAddress& lookup);

}  // namespace peeler::gl
