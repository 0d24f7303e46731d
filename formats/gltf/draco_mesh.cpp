// SPDX-License-Identifier: Apache-2.0
// Draco mesh decoding through the peeler_decode process (formats/modules/draco_decoder.cpp).
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

#include <peeler/error.h>
#include "formats/file/helper_process.h"
#include "formats/file/module.h"
#include "formats/gltf/gltf_decoders.h"

namespace peeler {
namespace {

std::size_t bytesOfComponent(int component_type) {
    constexpr int kUnsignedByte = 5121, kUnsignedShort = 5123;
    if (component_type <= kUnsignedByte) return 1;
    return component_type <= kUnsignedShort ? 2 : 4;
}

}  // namespace

DracoMesh takeDracoMesh(SharedFile& result, std::span<const DracoAttribute> attributes,
                        const DracoLimits& limits) {
    const auto checked = [](bool holds) {
        if (!holds) throw Error(ErrorKind::kInput, "the Draco data is damaged", "", kDracoHint);
    };
    DracoMesh mesh;
    mesh.points = result.takeOne<std::uint64_t>();
    // No product overflows, because the limits derive from accessor counts, which are at most 2^53.
    checked(mesh.points > 0 && mesh.points <= limits.points);
    mesh.indices = result.take<std::uint32_t>(3 * limits.faces);
    checked(!mesh.indices.empty() && mesh.indices.size() % 3 == 0);
    checked(std::ranges::all_of(mesh.indices, [&](auto index) { return index < mesh.points; }));
    for (const DracoAttribute& attribute : attributes) {
        const std::uint64_t bytes = mesh.points * static_cast<std::uint64_t>(attribute.components) *
                                    bytesOfComponent(attribute.component_type);
        mesh.attributes.push_back(result.take<std::uint8_t>(bytes));
        checked(mesh.attributes.back().size() == bytes);
    }
    return mesh;
}

DracoMesh decodeDracoMesh(std::span<const std::uint8_t> bytes,
                          std::span<const DracoAttribute> attributes, const DracoLimits& limits,
                          std::atomic<std::uint64_t>* used) {
    SharedFile request;
    request.putOne(limits);
    request.put(attributes);
    request.put(bytes);
    request.seek(0);
    SharedFile result =
        runHelper({moduleFile("peeler_decode"), limits.cpu_seconds, kDracoHint, used}, request);
    return takeDracoMesh(result, attributes, limits);
}

}  // namespace peeler
