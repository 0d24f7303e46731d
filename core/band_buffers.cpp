// SPDX-License-Identifier: Apache-2.0
#include "core/band_buffers.h"

#include "shaders/interface.glsl"

namespace peeler {

void BandBuffers::bind() const {
    if (slots_) slots_.bindStorage(PEELER_SLOTS);
    if (depths_) depths_.bindStorage(PEELER_DEPTHS);
    if (primitives_) primitives_.bindStorage(PEELER_PRIMITIVES);
    if (colors_) colors_.bindStorage(PEELER_COLORS);
}

}  // namespace peeler
