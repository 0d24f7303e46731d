// SPDX-License-Identifier: Apache-2.0
// Has one Draco-compressed mesh decoded by peeler_decode (formats/modules/draco_decoder.cpp).
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

#include "core/base/error.h"
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

/// The helper is not trusted: it may be in the hands of the data.
bool isWhole(const DracoMesh& mesh, std::span<const DracoAttribute> attributes) {
    if (mesh.indices.size() % 3 != 0) return false;
    for (const std::uint32_t index : mesh.indices)
        if (index >= mesh.points) return false;
    for (std::size_t i = 0; i < attributes.size(); ++i)
        if (mesh.attributes[i].size() != mesh.points *
                                             static_cast<std::size_t>(attributes[i].components) *
                                             bytesOfComponent(attributes[i].component_type))
            return false;
    return true;
}

}  // namespace

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
    DracoMesh mesh;
    mesh.points = result.takeOne<std::uint64_t>();
    mesh.indices = result.take<std::uint32_t>();
    for (std::size_t i = 0; i < attributes.size(); ++i)
        mesh.attributes.push_back(result.take<std::uint8_t>());
    if (!isWhole(mesh, attributes))
        throw Error(ErrorKind::kInput, "the Draco data is damaged", "", kDracoHint);
    return mesh;
}

}  // namespace peeler
