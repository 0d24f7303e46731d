// SPDX-License-Identifier: Apache-2.0
#include "core/scene/id_names.h"

namespace peeler {

IdNames idNames(const Scene& scene) {
    IdNames names;
    for (std::size_t i = 0; i < scene.nodes.size(); ++i) {
        names.objects.push_back(nodeName(scene, i));
    }
    for (std::size_t i = 0; i < scene.materials.size(); ++i) {
        const std::string& name = scene.materials[i].name;
        const bool is_default = i + 1 == scene.materials.size();
        names.materials.push_back(!name.empty() ? name
                                  : is_default  ? "default material"
                                                : "material " + std::to_string(i));
    }
    return names;
}

}  // namespace peeler
