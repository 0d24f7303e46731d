// SPDX-License-Identifier: Apache-2.0
// What is asked for of an output file, from the command line to whoever writes it.
#pragma once

#include <array>
#include <cstdint>
#include <string>

#include "core/image/merge.h"
#include "core/image/sink.h"

namespace peeler {

/// Fields that a format has no use for are ignored.
struct OutputOptions {
    std::string as{};                         ///< kind; "" = the extension's first row in the table
    bool no_composite = false;                ///< ldi: leave the part `composite` out
    bool cryptomatte = false;                 ///< ldi, composite: in the composite; needs id.*
    bool composited = false;                  ///< composite: bands are a composite, as it is stored
    std::string layout{};                     ///< ldi: a name in exrLayouts(), "" = plain
    DeepMergeSettings deep_merge{};           ///< deep
    std::string compression{};                ///< ldi, deep: one of exrCompressions(), "" = default
    std::array<float, 4> background{};        ///< premultiplied linear RGBA; composite, page
    float exposure = 0;                       ///< stops; PNG, JPEG, TIFF, page
    std::string tone_map = "none";            ///< PNG, JPEG, TIFF, page
    std::uint64_t max_fragments = 4'000'000;  ///< page: more than these it does not hold
    Provenance provenance{};
};

}  // namespace peeler
