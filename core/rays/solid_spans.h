// SPDX-License-Identifier: Apache-2.0
// Where a ray is inside of solids.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "core/rays/solids.h"

namespace peeler {

/// A stretch of a ray, in t.
struct Stretch {
    double begin = 0, end = 0;

    double length() const { return end - begin; }
    bool operator==(const Stretch&) const = default;
};

/// A stretch inside one solid.
struct SolidSpan : Stretch {
    std::uint32_t solid = 0;  ///< index into Solids::all()
    std::uint32_t key = 0;    ///< of the hit that entered it
    std::uint32_t hit = 0;    ///< which of the ray's
};

/// How often a ray hits a solid.
struct SolidHits {
    std::uint32_t solid = 0, hits = 0;

    bool odd() const { return hits % 2 == 1; }
};

/// What the hits of a ray say of solids, by parity: the ray is inside of a solid from its 1st hit
/// to its 2nd, from its 3rd to its 4th, and so on; an odd last one opens nothing. Keeps its storage
/// from ray to ray: one for each thread.
class SolidSpans {
  public:
    /// `t` does not fall; `keys` as DrawList counts them, coincident hits in draw order.
    void find(std::span<const float> t, std::span<const std::uint32_t> keys, const Solids& solids);

    /// Those that have a length, by where they begin. Of several that begin together the longest is
    /// first, as if the others were inside of it.
    std::span<const SolidSpan> all() const { return spans_; }
    /// Of every solid that is hit; by index.
    std::span<const SolidHits> hits() const { return hits_; }

  private:
    struct Hit {
        std::uint32_t solid, index;
    };
    std::vector<Hit> order_;
    std::vector<SolidSpan> spans_;
    std::vector<SolidHits> hits_;
};

/// The stretches inside at least one of the solids that `keep(span)` is true for, in order,
/// without gaps of no length between them. `out` is overwritten.
template <class Keep>
void uniteSpans(std::span<const SolidSpan> spans, Keep&& keep, std::vector<Stretch>& out) {
    out.clear();
    for (const SolidSpan& span : spans) {
        if (!keep(span)) continue;
        if (out.empty() || span.begin > out.back().end) {
            out.push_back(span);
        } else if (span.end > out.back().end) {
            out.back().end = span.end;
        }
    }
}

}  // namespace peeler
