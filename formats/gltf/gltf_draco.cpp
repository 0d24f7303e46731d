// SPDX-License-Identifier: Apache-2.0
// Decoding of Draco-compressed primitives of a glTF file (KHR_draco_mesh_compression).
#include "formats/gltf/gltf_parts.h"

#include <algorithm>
#include <atomic>
#include <limits>
#include <map>
#include <optional>
#include <tuple>

#include <peeler/error.h>
#include "core/base/memory_budget.h"
#include "core/base/parallel.h"
#include "formats/gltf/gltf_accessor.h"
#include "formats/gltf/gltf_decoders.h"
#include "formats/gltf/gltf_schema.h"

namespace peeler {
namespace {

constexpr const char* kDracoExtension = "KHR_draco_mesh_compression";
constexpr int kTriangles = 4, kTriangleStrip = 5;

/// A compressed attribute: its name, its id in the Draco data, and the accessor that describes it.
struct Attribute {
    std::string name;
    std::uint32_t unique_id = 0;
    int accessor = -1;
    bool operator<(const Attribute& other) const {
        return std::tie(name, unique_id, accessor) <
               std::tie(other.name, other.unique_id, other.accessor);
    }
};

/// The inputs of a decoding. Primitives with equal requests share the decoded mesh.
struct Request {
    int buffer_view = -1;
    std::vector<Attribute> attributes;
    int indices = -1;   ///< accessor of the indices; −1 without indices
    int position = -1;  ///< accessor of the positions
    int mode = kTriangles;
    bool operator<(const Request& other) const {
        return std::tie(buffer_view, attributes, indices, position, mode) <
               std::tie(other.buffer_view, other.attributes, other.indices, other.position,
                        other.mode);
    }
};

struct DracoJob {
    Request request;
    std::string where;  ///< JSON pointer of the extension object in the job's first primitive
    DracoMesh mesh;
    std::optional<Error> problem;
    std::map<std::string, int> accessors;  ///< new accessor of each attribute
    int indices = -1;                      ///< new accessor of the indices
};

class DracoReader {
  public:
    DracoReader(GltfDocument& document, const GltfOptions& options)
        : document_(document), options_(options) {}

    void read() {
        listJobs();
        if (jobs_.empty()) return;
        const std::uint64_t decoded = checkSizes();
        decodeAll(decoded);
        for (DracoJob& job : jobs_)
            if (!job.problem) addAccessors(job);
        for (const auto& [primitive, job] : primitives_)
            replace(*primitive, jobs_[job]);
    }

  private:
    const tinygltf::Accessor& accessor(int index) const {
        return document_.model.accessors[static_cast<std::size_t>(index)];
    }

    void listJobs() {
        std::map<Request, std::size_t> known;
        for (std::size_t i = 0; i < document_.model.meshes.size(); ++i) {
            std::vector<tinygltf::Primitive>& primitives = document_.model.meshes[i].primitives;
            for (std::size_t j = 0; j < primitives.size(); ++j) {
                const auto extension = primitives[j].extensions.find(kDracoExtension);
                // A later step skips primitives without positions.
                if (extension == primitives[j].extensions.end() ||
                    !primitives[j].attributes.contains("POSITION"))
                    continue;
                const std::string where =
                    childPointer(childPointer("/meshes", i) + "/primitives", j);
                Request request = requestOf(primitives[j], extension->second, where);
                const auto [place, is_new] = known.try_emplace(request, jobs_.size());
                if (is_new) {
                    DracoJob& job = jobs_.emplace_back();
                    job.request = std::move(request);
                    job.where = where + "/extensions/" + kDracoExtension;
                }
                primitives_.emplace_back(&primitives[j], place->second);
            }
        }
    }

    static Request requestOf(const tinygltf::Primitive& primitive, const tinygltf::Value& extension,
                             const std::string& where) {
        if (primitive.mode != kTriangles && primitive.mode != kTriangleStrip)
            throw Error(ErrorKind::kInput,
                        "Draco compresses triangles and triangle strips only, but the mode is " +
                            std::to_string(primitive.mode),
                        where + "/mode", "export the file again");
        Request request;
        request.buffer_view = extension.Get("bufferView").GetNumberAsInt();
        request.indices = primitive.indices;
        request.position = primitive.attributes.at("POSITION");
        request.mode = primitive.mode;
        const tinygltf::Value& ids = extension.Get("attributes");
        // Compressed attributes that the primitive does not list have no accessor, so nothing can
        // use them.
        for (const auto& [name, index] : primitive.attributes)
            if (ids.Has(name))
                request.attributes.push_back(
                    {name, static_cast<std::uint32_t>(ids.Get(name).GetNumberAsInt()), index});
        return request;
    }

    DracoLimits limitsOf(const Request& request) const {
        const std::uint64_t points = accessor(request.position).count;
        const std::uint64_t corners =
            request.indices >= 0 ? accessor(request.indices).count : points;
        const std::uint64_t strip = corners < 2 ? 0 : corners - 2;
        const std::uint64_t faces = request.mode == kTriangles ? corners / 3 : strip;
        // Allow as many vertices as triangle corners if this is more than the declared count.
        // Encoders drop degenerate triangles, and some declare a wrong number of vertices (Khronos'
        // own 2CylinderEngine: 2012 in an accessor, 2019 in the data).
        return {faces, std::max(points, 3 * faces), dracoSeconds(faces)};
    }

    /// Checks the total size of all results against the limits. Returns this size in bytes.
    std::uint64_t checkSizes() const {
        SizeLimit limit("the decompressed geometry needs", options_.max_geometry_bytes);
        for (const DracoJob& job : jobs_) {
            const DracoLimits limits = limitsOf(job.request);
            std::uint64_t point_bytes = 0;
            for (const Attribute& attribute : job.request.attributes) {
                const tinygltf::Accessor& info = accessor(attribute.accessor);
                point_bytes += static_cast<std::uint64_t>(tinygltf::GetComponentSizeInBytes(
                                   static_cast<std::uint32_t>(info.componentType))) *
                               static_cast<std::uint64_t>(tinygltf::GetNumComponentsInType(
                                   static_cast<std::uint32_t>(info.type)));
            }
            // Computed in double: the product of counts up to 2^53 (schema) could overflow.
            const double needed =
                12.0 * static_cast<double>(limits.faces) +
                static_cast<double>(point_bytes) * static_cast<double>(limits.points);
            const auto bytes = static_cast<std::uint64_t>(std::min(needed, 0x1p63));
            limit.take(bytes, job.where);
            document_.memory.allow(bytes, job.where);
        }
        return limit.taken();
    }

    /// Returns the limit on the total CPU time, in microseconds: four times the time that the most
    /// expensive meshes take, given the size of the compressed data. Data that several primitives
    /// share counts only once. Limits per mesh would not be enough, since many primitives may share
    /// data.
    std::uint64_t mostTime() const {
        constexpr std::uint64_t kFirst = 500'000, kEach = 20'000, kByte = 64;
        // The size of each compressed view. The key is the address of its first byte.
        std::map<const std::uint8_t*, std::size_t> sizes;
        for (const DracoJob& job : jobs_) {
            const tinygltf::BufferView& view =
                document_.model.bufferViews[static_cast<std::size_t>(job.request.buffer_view)];
            const auto buffer = document_.buffers[static_cast<std::size_t>(view.buffer)];
            const std::size_t begin = std::min(view.byteOffset, buffer.size());
            std::size_t& size = sizes[buffer.data() + begin];
            size = std::max(size, std::min(view.byteLength, buffer.size() - begin));
        }
        std::uint64_t microseconds = kFirst + kEach * jobs_.size();
        for (const auto& [begin, size] : sizes)
            microseconds += kByte * size;
        return microseconds;
    }

    /// Returns the memory limit, in bytes, of each decoder. `decoded` bytes of the budget are
    /// reserved for results.
    std::uint64_t mostMemory(std::uint64_t decoded) const {
        // Enough to start the decoder and to report a failure.
        constexpr std::uint64_t kLeast = 32U << 20U;
        if (document_.memory.budget() == 0) return std::numeric_limits<std::uint64_t>::max();
        std::uint64_t left = document_.memory.left();
        left -= std::min(left, decoded);
        const std::size_t at_once = std::min(jobs_.size(), static_cast<std::size_t>(threadCount()));
        return std::max(left / at_once, kLeast);
    }

    /// Decodes all jobs. If jobs fail without a fallback, throws the problem of the first such job
    /// in the order of jobs. Skips the jobs after it, because each of thousands of hostile
    /// primitives could take its full time limit.
    void decodeAll(std::uint64_t decoded) {
        const AccessorReader accessors(document_);
        most_microseconds_ = mostTime();
        most_bytes_ = mostMemory(decoded);
        std::atomic<std::size_t> first_fatal = jobs_.size();
        parallelFor(jobs_.size(), [&](std::size_t i) {
            if (i > first_fatal) return;
            decode(jobs_[i], accessors);
            if (!isFatal(jobs_[i])) return;
            for (std::size_t before = first_fatal;
                 i < before && !first_fatal.compare_exchange_weak(before, i);) {
            }
        });
        if (first_fatal < jobs_.size()) throw Error(*jobs_[first_fatal].problem);
    }

    bool isFatal(const DracoJob& job) const {
        return job.problem && (options_.strict || job.problem->kind() != ErrorKind::kInput ||
                               !hasFallback(job.request));
    }

    void decode(DracoJob& job, const AccessorReader& accessors) {
        try {
            if (microseconds_ > most_microseconds_)
                throw Error(ErrorKind::kInput, "decoding the Draco data takes too long", "",
                            kDracoHint);
            std::vector<DracoAttribute> attributes;
            for (const Attribute& attribute : job.request.attributes)
                attributes.push_back({attribute.unique_id,
                                      accessor(attribute.accessor).componentType,
                                      accessors.components(attribute.accessor)});
            DracoLimits limits = limitsOf(job.request);
            limits.bytes = most_bytes_;
            job.mesh = decodeDracoMesh(accessors.bufferView(job.request.buffer_view), attributes,
                                       limits, &microseconds_);
        } catch (const Error& error) {
            if (error.kind() == ErrorKind::kMemory && document_.memory.budget() != 0) {
                const MemoryBudget& budget = document_.memory.budget();
                job.problem = Error(error.kind(),
                                    "the memory budget is " + mebibytesText(budget) + ": " +
                                        error.what() + ", at " + job.where,
                                    budget.where(), budget.hint(2 * budget));
                return;
            }
            job.problem = error.at(error.where().empty() ? job.where : error.whereText());
        }
    }

    /// Adds an accessor to these bytes, and keeps them in the document. Returns the accessor's
    /// index.
    int addAccessor(std::vector<std::uint8_t> bytes, tinygltf::Accessor info) {
        document_.decoded_views.resize(document_.model.bufferViews.size());
        tinygltf::BufferView view;
        view.buffer = 0;
        view.byteLength = bytes.size();
        document_.model.bufferViews.push_back(view);
        document_.decoded_views.emplace_back(document_.storage.emplace_back(std::move(bytes)));
        info.bufferView = static_cast<int>(document_.model.bufferViews.size()) - 1;
        info.byteOffset = 0;
        info.sparse.isSparse = false;
        document_.model.accessors.push_back(std::move(info));
        return static_cast<int>(document_.model.accessors.size()) - 1;
    }

    void addAccessors(DracoJob& job) {
        for (std::size_t i = 0; i < job.request.attributes.size(); ++i) {
            tinygltf::Accessor info = accessor(job.request.attributes[i].accessor);
            info.count = job.mesh.points;
            job.accessors[job.request.attributes[i].name] =
                addAccessor(std::move(job.mesh.attributes[i]), std::move(info));
        }
        tinygltf::Accessor info;
        info.sparse = {};  // tinygltf leaves this member uninitialised
        info.componentType = TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT;
        info.type = TINYGLTF_TYPE_SCALAR;
        info.count = job.mesh.indices.size();
        const auto* first = reinterpret_cast<const std::uint8_t*>(job.mesh.indices.data());
        job.indices = addAccessor({first, first + job.mesh.indices.size() * sizeof(std::uint32_t)},
                                  std::move(info));
        job.mesh = {};
    }

    bool hasFallback(const Request& request) const {
        const auto has_data = [&](int index) { return accessor(index).bufferView >= 0; };
        for (const Attribute& attribute : request.attributes)
            if (!has_data(attribute.accessor)) return false;
        return has_data(request.position) && (request.indices < 0 || has_data(request.indices));
    }

    void replace(tinygltf::Primitive& primitive, const DracoJob& job) {
        if (job.problem) {
            std::string why = job.problem->what();
            if (why.ends_with('.')) why.pop_back();  // libdraco's messages may end in a full stop
            document_.warn("The uncompressed fallback is used because of an error at " + job.where +
                           ": " + why + ".");
            return;
        }
        for (const auto& [name, index] : job.accessors)
            primitive.attributes[name] = index;
        primitive.indices = job.indices;
        primitive.mode = kTriangles;
    }

    GltfDocument& document_;
    const GltfOptions& options_;
    std::uint64_t most_microseconds_ = 0, most_bytes_ = 0;
    std::atomic<std::uint64_t> microseconds_ = 0;  ///< CPU time used so far
    std::vector<DracoJob> jobs_;
    /// The primitives, each with the index of its job.
    std::vector<std::pair<tinygltf::Primitive*, std::size_t>> primitives_;
};

}  // namespace

void decodeDracoPrimitives(GltfDocument& document, const GltfOptions& options) {
    DracoReader(document, options).read();
}

}  // namespace peeler
