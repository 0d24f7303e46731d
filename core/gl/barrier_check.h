// SPDX-License-Identifier: Apache-2.0
// A check that passes that share storage buffers have the barriers between them that OpenGL wants.
#pragma once

#include "core/gl/functions.h"

namespace peeler::gl {

/// Where PEELER_CHECK_BARRIERS is in the environment, has these functions throw Error (kInternal)
/// when a pass uses what an earlier one has written to a storage buffer, or writes what one has
/// read, or the CPU gets at it, without the barrier that OpenGL 4.5 wants between (core, 7.13.2,
/// "Shader Memory Access Synchronization"). Software renderers forgive it, GPUs need not. A pass
/// begins where a framebuffer is bound or work dispatched: within one, shaders have atomics. Call
/// it once for the functions of a context, on its thread; of several contexts of a thread the last
/// is the one that may be used. Elsewhere it does nothing, and costs nothing.
void checkBarriers(Functions& functions, const ProcAddress& lookup);

}  // namespace peeler::gl
