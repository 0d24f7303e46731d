// SPDX-License-Identifier: Apache-2.0
// Decoding of meshopt-compressed buffer views of a glTF file.
#include "formats/gltf/gltf_parts.h"

#include <nlohmann/json.hpp>
#include <optional>

#include "core/base/parallel.h"
#include "formats/gltf/gltf_decoders.h"
#include "formats/gltf/gltf_schema.h"

namespace peeler {
namespace {

using nlohmann::json;

// The two extensions have the same JSON. A view must not have both. If a view has both, EXT, the
// older extension, is used, since it can always be decoded.
constexpr const char* kExtensions[] = {"EXT_meshopt_compression", "KHR_meshopt_compression"};

/// Returns the extension of `owner` with this name, or null.
const json* extensionOf(const json& owner, const char* name) {
    const auto extensions = owner.find("extensions");
    if (extensions == owner.end()) return nullptr;
    const auto found = extensions->find(name);
    return found == extensions->end() ? nullptr : &*found;
}

/// A compressed view and its result.
struct MeshoptJob {
    std::size_t view = 0;
    std::string where;
    MeshoptStream stream;
    std::span<std::uint8_t> out;
    std::optional<Error> problem;
};

/// Returns the error with `where` if the error names no place: the codec does not know the place.
Error placed(const Error& error, const std::string& where) {
    return error.at(error.where().empty() ? where : error.whereText());
}

MeshoptStream streamOf(const json& view, const json& extension, const GltfDocument& document,
                       const std::string& where) {
    MeshoptStream stream;
    stream.mode = extension["mode"].get<std::string>();
    stream.filter = extension.value("filter", "NONE");
    stream.stride = extension["byteStride"].get<std::uint64_t>();
    stream.count = extension["count"].get<std::uint64_t>();
    const auto offset = extension.value("byteOffset", std::uint64_t{0});
    const auto length = extension["byteLength"].get<std::uint64_t>();
    const std::span<const std::uint8_t> buffer =
        document.buffers[extension["buffer"].get<std::size_t>()];
    // The sum cannot overflow, since both numbers are at most 2^53 (schema).
    if (offset + length > buffer.size())
        failGltf("the compressed data ends at byte " + std::to_string(offset + length) +
                     ", but its buffer has " + std::to_string(buffer.size()) + " bytes",
                 where);
    stream.bytes = buffer.subspan(offset, length);
    if (view.value("byteStride", stream.stride) != stream.stride)
        failGltf("the stride of the view and of its compressed data differ", where + "/byteStride");
    // The product cannot overflow, since counts are at most 2^53 and strides at most 256 (schema).
    if (const auto bytes = view["byteLength"].get<std::uint64_t>();
        bytes != stream.count * stream.stride)
        failGltf("the view has " + std::to_string(bytes) +
                     " bytes, but its compressed data decodes to " +
                     std::to_string(stream.count * stream.stride),
                 where);
    checkMeshoptStream(stream);
    return stream;
}

std::vector<MeshoptJob> listJobs(const json& buffer_views, const GltfDocument& document) {
    std::vector<MeshoptJob> jobs;
    for (std::size_t i = 0; i < buffer_views.size(); ++i) {
        for (const char* name : kExtensions) {
            const json* extension = extensionOf(buffer_views[i], name);
            if (!extension) continue;
            MeshoptJob& job = jobs.emplace_back();
            job.view = i;
            job.where =
                childPointer(childPointer("/bufferViews", i) + "/extensions", std::string(name));
            try {
                job.stream = streamOf(buffer_views[i], *extension, document, job.where);
            } catch (const Error& error) {
                job.problem = placed(error, job.where);
            }
            break;
        }
    }
    return jobs;
}

}  // namespace

bool isMeshoptFallback(const json& buffer) {
    for (const char* name : kExtensions)
        if (const json* extension = extensionOf(buffer, name))
            if (extension->value("fallback", false)) return true;
    return false;
}

std::vector<MeshoptProblem> decodeMeshoptViews(const json& buffer_views, GltfDocument& document,
                                               const GltfOptions& options) {
    std::vector<MeshoptJob> jobs = listJobs(buffer_views, document);
    if (jobs.empty()) return {};
    SizeLimit limit("the decompressed data needs", options.max_geometry_bytes);
    for (const MeshoptJob& job : jobs) {
        if (job.problem) continue;
        // The product stays far below 2^64, since it is at most 64 times a file's size
        // (checkMeshoptStream()).
        limit.take(job.stream.count * job.stream.stride, job.where);
        document.memory.allow(job.stream.count * job.stream.stride, job.where);
    }
    document.decoded_views.resize(buffer_views.size());
    for (MeshoptJob& job : jobs)
        if (!job.problem)
            job.out = document.storage.emplace_back(job.stream.count * job.stream.stride);
    parallelFor(jobs.size(), [&](std::size_t i) {
        MeshoptJob& job = jobs[i];
        if (job.problem) return;
        try {
            decodeMeshoptStream(job.stream, job.out);
        } catch (const Error& error) {
            job.problem = placed(error, job.where);
        }
    });
    std::vector<MeshoptProblem> problems;
    for (const MeshoptJob& job : jobs) {
        if (job.problem)
            problems.push_back({job.view, *job.problem});
        else
            document.decoded_views[job.view] = job.out;
    }
    return problems;
}

}  // namespace peeler
