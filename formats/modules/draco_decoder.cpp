// SPDX-License-Identifier: Apache-2.0
// The program peeler_decode, which decodes one Draco-compressed mesh (formats/gltf/draco_mesh.cpp).
#include <draco/attributes/attribute_octahedron_transform.h>
#include <draco/attributes/attribute_quantization_transform.h>
#include <draco/compression/attributes/normal_compression_utils.h>
#include <draco/compression/decode.h>
#include <draco/compression/point_cloud/point_cloud_decoder.h>
#include <draco/core/varint_decoding.h>
#include <draco/mesh/mesh.h>
#include <draco/metadata/metadata_decoder.h>

#include <algorithm>
#include <cstring>
#include <memory>
#include <new>
#include <string>
#include <type_traits>
#include <utility>

#include <peeler/error.h>
#include "formats/gltf/gltf_decoders.h"
#include "formats/modules/helper_main.h"

namespace peeler {
namespace {

[[noreturn]] void failDraco(const std::string& what) {
    throw Error(ErrorKind::kInput, what, "", kDracoHint);
}

draco::DecoderBuffer bufferOf(std::span<const std::uint8_t> bytes) {
    draco::DecoderBuffer buffer;
    buffer.Init(reinterpret_cast<const char*>(bytes.data()), bytes.size());
    return buffer;
}

// The maximum number of declared triangles per byte of data. Without this limit, a few bytes could
// make peeler allocate endlessly, since entropy coding sets no limit. A flat regular grid of 8
// million triangles has 13 triangles per byte at the slowest setting, which gives the smallest
// files.
constexpr std::uint64_t kMostFacesPerByte = 32;

/// The sizes that the data declares at its start.
struct Promise {
    std::uint32_t faces = 0, points = 0;
};

/// Reads a number in the connectivity header. Old versions of the format store the number with a
/// fixed size, others as a varint.
std::uint32_t number(draco::DecoderBuffer& buffer, bool fixed) {
    std::uint32_t value = 0;
    if (!(fixed ? buffer.Decode(&value) : draco::DecodeVarint(&value, &buffer)))
        failDraco("the Draco data is truncated");
    return value;
}

/// Reads the headers (Draco bitstream specification, §2 to §4). libdraco 1.5.5 allocates memory for
/// the number of faces in an Edgebreaker header, so that number must be checked first.
Promise promiseOf(std::span<const std::uint8_t> bytes) {
    draco::DecoderBuffer buffer = bufferOf(bytes);
    draco::DracoHeader header;
    if (const draco::Status status = draco::PointCloudDecoder::DecodeHeader(&buffer, &header);
        !status.ok())
        failDraco("this is not Draco data: " + status.error_msg_string());
    if (header.encoder_type != draco::TRIANGULAR_MESH)
        failDraco("the Draco data is not a triangle mesh");
    const int version = header.version_major << 8 | header.version_minor;
    buffer.set_bitstream_version(static_cast<std::uint16_t>(version));
    if ((header.flags & METADATA_FLAG_MASK) != 0) {
        draco::GeometryMetadata ignored;
        if (!draco::MetadataDecoder().DecodeGeometryMetadata(&buffer, &ignored))
            failDraco("the metadata of the Draco data is damaged");
    }
    Promise promise;
    if (header.encoder_method == draco::MESH_SEQUENTIAL_ENCODING) {
        promise.faces = number(buffer, version < 0x202);
        promise.points = number(buffer, version < 0x202);
        return promise;
    }
    std::uint8_t traversal = 0, attribute_data = 0;
    if (!buffer.Decode(&traversal)) failDraco("the Draco data is truncated");
    const bool fixed = version < 0x200;
    if (version < 0x202) number(buffer, fixed);  // skips the number of vertices added by splits
    // The number of vertices in the connectivity, which only estimates the number of points: some
    // encoders count vertices without faces, and seams split other vertices into several points.
    const std::uint64_t vertices = number(buffer, fixed);
    promise.faces = number(buffer, fixed);
    if (!buffer.Decode(&attribute_data)) failDraco("the Draco data is truncated");
    const std::uint32_t symbols = number(buffer, fixed), splits = number(buffer, fixed);
    if (vertices > std::uint64_t{3} * promise.faces || symbols > promise.faces || splits > symbols)
        failDraco("the Draco data contradicts itself");
    return promise;
}

void checkPromise(const Promise& promise, const DracoLimits& limits) {
    if (promise.faces > limits.faces)
        failDraco("the Draco data has " + std::to_string(promise.faces) +
                  " triangles, but the accessors have room for " + std::to_string(limits.faces));
    if (promise.points > limits.points)
        failDraco("the Draco data has " + std::to_string(promise.points) +
                  " vertices, but at most " + std::to_string(limits.points) + " can be used");
}

/// A mesh whose floats stay quantized. libdraco may compute them with fused multiply-adds, and so
/// give other bits on other processors (see CMakeLists.txt).
class QuantizedMesh : public draco::Mesh {
  public:
    explicit QuantizedMesh(draco::Decoder& decoder) : decoder_(decoder) {}
    void SetAttribute(int id, std::unique_ptr<draco::PointAttribute> attribute) override {
        if (attribute->data_type() == draco::DT_FLOAT32)
            decoder_.SetSkipAttributeTransform(attribute->attribute_type());
        draco::Mesh::SetAttribute(id, std::move(attribute));
    }

  private:
    draco::Decoder& decoder_;
};

/// Computes an attribute's floats as libdraco does without fused multiply-adds.
class Dequantization {
  public:
    explicit Dequantization(const draco::PointAttribute& attribute) {
        const draco::AttributeTransformData* const data = attribute.GetAttributeTransformData();
        if (!data) return;
        draco::AttributeOctahedronTransform octahedron;
        if (data->transform_type() == draco::ATTRIBUTE_OCTAHEDRON_TRANSFORM &&
            octahedron.InitFromAttribute(attribute) && attribute.num_components() == 2) {
            components_ = 3;
            if (!directions_.SetQuantizationBits(octahedron.quantization_bits()))
                failDraco("a normal of the Draco data is damaged");
        } else if (data->transform_type() == draco::ATTRIBUTE_QUANTIZATION_TRANSFORM &&
                   scale_.InitFromAttribute(attribute)) {
            components_ = attribute.num_components();
            delta_ = scale_.range() /
                     static_cast<float>((std::uint32_t{1} << scale_.quantization_bits()) - 1);
        }
    }
    /// The number of floats for each point; 0 if the attribute is not quantized.
    int components() const { return components_; }
    void operator()(const std::int32_t* quantized, float* values) const {
        if (directions_.IsInitialized()) {
            directions_.QuantizedOctahedralCoordsToUnitVector(quantized[0], quantized[1], values);
            return;
        }
        for (int i = 0; i < components_; ++i)
            values[i] = static_cast<float>(quantized[i]) * delta_ + scale_.min_value(i);
    }

  private:
    int components_ = 0;
    draco::OctahedronToolBox directions_;
    draco::AttributeQuantizationTransform scale_;
    float delta_ = 0;
};

template <typename Number>
bool readValue(const draco::PointAttribute& attribute, const Dequantization& dequantized,
               draco::AttributeValueIndex place, int components, Number* values) {
    if (dequantized.components() == 0)
        return attribute.ConvertValue<Number>(place, static_cast<std::int8_t>(components), values);
    if constexpr (std::is_same_v<Number, float>) {
        std::int32_t quantized[4] = {};
        if (!attribute.ConvertValue<std::int32_t>(
                place, static_cast<std::int8_t>(attribute.num_components()), quantized))
            return false;
        dequantized(quantized, values);
        return true;
    }
    return false;
}

template <typename Number>
std::vector<std::uint8_t> valuesAs(const draco::PointAttribute& attribute,
                                   const Dequantization& dequantized, std::size_t points,
                                   int components) {
    std::vector<std::uint8_t> result(points * static_cast<std::size_t>(components) *
                                     sizeof(Number));
    Number values[4] = {};
    const std::size_t bytes = static_cast<std::size_t>(components) * sizeof(Number);
    for (std::size_t i = 0; i < points; ++i) {
        const draco::AttributeValueIndex place =
            attribute.mapped_index(draco::PointIndex(static_cast<std::uint32_t>(i)));
        if (place.value() >= attribute.size() ||
            !readValue(attribute, dequantized, place, components, values))
            failDraco("an attribute of the Draco data does not fit its accessor");
        std::memcpy(result.data() + i * bytes, values, bytes);
    }
    return result;
}

using ValuesAs = std::vector<std::uint8_t> (*)(const draco::PointAttribute&, const Dequantization&,
                                               std::size_t, int);

struct ComponentRow {
    int type;
    ValuesAs values;
};
constexpr ComponentRow kComponents[] = {
    {5120, valuesAs<std::int8_t>},   {5121, valuesAs<std::uint8_t>},
    {5122, valuesAs<std::int16_t>},  {5123, valuesAs<std::uint16_t>},
    {5125, valuesAs<std::uint32_t>}, {5126, valuesAs<float>},
};

std::vector<std::uint8_t> valuesOf(const draco::Mesh& mesh, const DracoAttribute& wanted) {
    const draco::PointAttribute* attribute = mesh.GetAttributeByUniqueId(wanted.unique_id);
    if (!attribute)
        failDraco("the Draco data has no attribute with the id " +
                  std::to_string(wanted.unique_id));
    const Dequantization dequantized(*attribute);
    const int components =
        dequantized.components() > 0 ? dequantized.components() : attribute->num_components();
    if (components != wanted.components || wanted.components > 4)
        failDraco("the attribute " + std::to_string(wanted.unique_id) + " of the Draco data has " +
                  std::to_string(components) + " components, but its accessor has " +
                  std::to_string(wanted.components));
    // Reject bools: glTF has no such accessors, and Draco accepts any stored byte as a bool.
    if (attribute->data_type() == draco::DT_BOOL)
        failDraco("the attribute " + std::to_string(wanted.unique_id) +
                  " of the Draco data holds booleans");
    const std::size_t points = mesh.num_points();
    if (!attribute->is_mapping_identity() && attribute->indices_map_size() < points)
        failDraco("the Draco data is damaged");
    for (const ComponentRow& row : kComponents)
        if (row.type == wanted.component_type)
            return row.values(*attribute, dequantized, points, wanted.components);
    failDraco("the component type " + std::to_string(wanted.component_type) +
              " is unknown to Draco");
}

std::unique_ptr<draco::Mesh> decodeMesh(std::span<const std::uint8_t> bytes) {
    draco::DecoderBuffer buffer = bufferOf(bytes);
    draco::Decoder decoder;
    auto mesh = std::make_unique<QuantizedMesh>(decoder);
    const draco::Status status = decoder.DecodeBufferToGeometry(&buffer, mesh.get());
    if (!status.ok()) failDraco("the Draco data is damaged: " + status.error_msg_string());
    return mesh;
}

std::vector<std::uint32_t> indicesOf(const draco::Mesh& mesh) {
    std::vector<std::uint32_t> indices;
    indices.reserve(std::size_t{3} * mesh.num_faces());
    for (std::uint32_t i = 0; i < mesh.num_faces(); ++i)
        for (const draco::PointIndex& point : mesh.face(draco::FaceIndex(i))) {
            if (point.value() >= mesh.num_points()) failDraco("the Draco data is damaged");
            indices.push_back(point.value());
        }
    return indices;
}

void decode(std::span<const std::uint8_t> bytes, std::span<const DracoAttribute> attributes,
            const DracoLimits& limits, SharedFile& result) {
    const std::unique_ptr<draco::Mesh> mesh = decodeMesh(bytes);
    if (mesh->num_faces() == 0) failDraco("the Draco data holds no triangle");
    // The number of points in an Edgebreaker mesh is known only after decoding.
    checkPromise({mesh->num_faces(), mesh->num_points()}, limits);
    result.putOne(std::uint64_t{mesh->num_points()});
    result.put(indicesOf(*mesh));
    for (const DracoAttribute& attribute : attributes)
        result.put(valuesOf(*mesh, attribute));
}

void decodeRequest(SharedFile& request, SharedFile& result) {
    const auto limits = request.takeOne<DracoLimits>();
    const auto attributes = request.take<DracoAttribute>();
    const auto bytes = request.take<std::uint8_t>();
    const Promise promise = promiseOf(bytes);
    checkPromise(promise, limits);
    if (promise.faces > kMostFacesPerByte * bytes.size())
        failDraco("the Draco data declares " + std::to_string(promise.faces) + " triangles in " +
                  std::to_string(bytes.size()) + " bytes");
    limitSeconds(dracoSeconds(promise.faces));
    const std::uint64_t needed = dracoBytes(promise.faces, attributes.size());
    limitMemory(std::min(needed, limits.bytes));
    try {
        decode(bytes, attributes, limits, result);
    } catch (const std::bad_alloc&) {
        if (limits.bytes < needed)
            throw Error(ErrorKind::kMemory, "not enough memory to decode the Draco data");
        failDraco("decoding the Draco data needs too much memory: it is damaged");
    }
}

}  // namespace
}  // namespace peeler

int main(int count, char** arguments) {
    peeler::helperMain(count, arguments, peeler::decodeRequest);
}
