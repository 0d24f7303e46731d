// SPDX-License-Identifier: Apache-2.0
#include <peeler/scene.h>

namespace peeler::inline v0 {
glm::dmat4 Trs::matrix() const {
    glm::dmat4 result(1);
    // Rotations in files are rounded to a few digits. Without normalisation, such rotations would
    // scale a little.
    if (glm::length(rotation) > 0) result = glm::mat4_cast(glm::normalize(rotation));
    for (int axis = 0; axis < 3; ++axis)
        result[axis] *= scale[axis];
    result[3] = glm::dvec4(translation, 1);
    return result;
}

std::string nodeName(const Scene& scene, std::size_t node) {
    const std::string& name = scene.nodes[node].name;
    return name.empty() ? "node " + std::to_string(node) : name;
}

std::vector<int> rootsOf(const std::vector<Node>& nodes) {
    std::vector<char> is_child(nodes.size(), 0);
    for (const Node& node : nodes)
        for (const int child : node.children)
            is_child[static_cast<std::size_t>(child)] = 1;
    std::vector<int> roots;
    for (std::size_t i = 0; i < nodes.size(); ++i)
        if (!is_child[i]) roots.push_back(static_cast<int>(i));
    return roots;
}

void chooseVariant(Scene& scene, std::size_t variant) {
    for (Mesh& mesh : scene.meshes)
        for (Primitive& primitive : mesh.primitives)
            if (variant < primitive.variants.size() && primitive.variants[variant] >= 0)
                primitive.material = primitive.variants[variant];
}

IdNames idNames(const Scene& scene) {
    IdNames names;
    for (std::size_t i = 0; i < scene.nodes.size(); ++i) {
        names.objects.push_back(nodeName(scene, i));
    }
    names.parents.resize(scene.nodes.size());
    for (std::size_t i = 0; i < scene.nodes.size(); ++i)
        for (const int child : scene.nodes[i].children)
            names.parents[static_cast<std::size_t>(child)] = static_cast<std::uint32_t>(i + 1);
    for (std::size_t i = 0; i < scene.materials.size(); ++i) {
        const std::string& name = scene.materials[i].name;
        const bool is_default = i + 1 == scene.materials.size();
        names.materials.push_back(!name.empty() ? name
                                  : is_default  ? "default material"
                                                : "material " + std::to_string(i));
    }
    return names;
}

}  // namespace peeler::inline v0
