// SPDX-License-Identifier: Apache-2.0
// What the ids of fragments stand for.
#pragma once

#include <string>
#include <vector>

#include "core/scene/scene.h"

namespace peeler {

/// Names by id − 1. An id is an index into the glTF file plus 1; 0 is that of no fragment.
struct IdNames {
    std::vector<std::string> objects;    ///< nodes
    std::vector<std::string> materials;  ///< the last is glTF's default material

    bool empty() const { return objects.empty() && materials.empty(); }
    bool operator==(const IdNames&) const = default;
};

/// Their own names, else nodeName(), "material 3", "default material". Names need not be unique.
IdNames idNames(const Scene& scene);

}  // namespace peeler
