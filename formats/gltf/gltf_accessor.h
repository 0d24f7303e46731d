// SPDX-License-Identifier: Apache-2.0
// Reader of glTF accessors, with checks of ranges, strides, types, `normalized` and sparse values.
#pragma once

#include <cstdint>
#include <initializer_list>
#include <span>
#include <string>
#include <vector>

#include "formats/gltf/gltf_document.h"

namespace peeler {

/// A component type that an attribute may have, such as 5123 (UNSIGNED_SHORT), normalised.
struct ComponentFormat {
    int type;  ///< number of the type in glTF and OpenGL: 5120 BYTE … 5126 FLOAT
    bool normalized = false;
    bool operator==(const ComponentFormat&) const = default;
};

/// The required format of an accessor for a certain use.
struct AccessorFormat {
    /// Allowed numbers of components: {3, 4} for VEC3 or VEC4.
    std::initializer_list<int> components;
    std::initializer_list<ComponentFormat> allowed;
    /// The Khronos validator's code for a wrong `normalized`.
    const char* issue = "MESH_PRIMITIVE_ATTRIBUTES_ACCESSOR_INVALID_FORMAT";
};

/// The elements first … first + count − 1, which must be within the accessor.
struct ElementRange {
    std::size_t first = 0, count = 0;
};

class AccessorReader {
  public:
    explicit AccessorReader(GltfDocument& document) : document_(document) {}

    std::size_t count(int accessor) const;
    int components(int accessor) const;

    /// Returns a range of elements as floats, element by element. Converts normalised integers
    /// (glTF 2.0 §3.6.2.2; KHR_mesh_quantization). If `normalized` of an integer accessor
    /// contradicts the allowed formats, uses the allowed value, with a warning. `use` is the JSON
    /// pointer of the reference to the accessor. Checks all sizes before any allocation. Throws
    /// Error (kInput) if the format is not allowed (`where` is `use`) or if the accessor is damaged
    /// (`where` is the accessor's own pointer).
    std::vector<float> floats(int accessor, const AccessorFormat& format, ElementRange range,
                              const std::string& use) const;

    /// Returns the first `count` matrices of a float MAT4 accessor, column-major.
    std::vector<float> matrices(int accessor, std::size_t count, const std::string& use) const;

    /// Returns the values of a SCALAR accessor of unsigned integers. Sets `max_value` to the
    /// maximum of the component type.
    std::vector<std::uint32_t> indices(int accessor, const std::string& use,
                                       std::uint32_t& max_value) const;

    /// Returns the bytes of a buffer view. Throws Error (kInput) if the view exceeds its buffer.
    std::span<const std::uint8_t> bufferView(int buffer_view) const;

  private:
    struct Elements;
    Elements elements(int accessor) const;
    bool isNormalized(int accessor, const AccessorFormat& format, const std::string& use) const;
    template <typename Out>
    void applySparse(int accessor, ElementRange range, bool normalize,
                     std::vector<Out>& values) const;

    GltfDocument& document_;
};

}  // namespace peeler
