// SPDX-License-Identifier: Apache-2.0
// Reads the numbers of glTF accessors, checked: ranges, strides, types, normalised, sparse.
#pragma once

#include <cstdint>
#include <initializer_list>
#include <span>
#include <string>
#include <vector>

#include "formats/gltf/gltf_document.h"

namespace peeler {

/// A component type as an attribute may have it, e.g. 5123 normalised.
struct ComponentFormat {
    int type;  ///< glTF's (and OpenGL's) number, 5120 BYTE … 5126 FLOAT
    bool normalized = false;
    bool operator==(const ComponentFormat&) const = default;
};

/// What an accessor must look like where it is used.
struct AccessorFormat {
    std::initializer_list<int> components;  ///< e.g. {3, 4} for VEC3 or VEC4
    std::initializer_list<ComponentFormat> allowed;
    /// The code of Khronos' validator for other components.
    const char* issue = "MESH_PRIMITIVE_ATTRIBUTES_ACCESSOR_INVALID_FORMAT";
};

/// Elements first … first + count − 1, all of which the accessor has.
struct ElementRange {
    std::size_t first = 0, count = 0;
};

class AccessorReader {
  public:
    explicit AccessorReader(GltfDocument& document) : document_(document) {}

    /// How many elements the accessor has, and how many numbers each of them has.
    std::size_t count(int accessor) const;
    int components(int accessor) const;

    /// The numbers of a range of elements, element after element, as floats; integers normalised
    /// where the accessor says so (glTF 2.0 §3.6.2.2; KHR_mesh_quantization). An accessor that says
    /// so of integers that must not be, or does not where they must, is read as they must, with a
    /// warning. `use` is the JSON pointer of the reference: the `where` of the error if the format
    /// is not allowed there.
    /// Damage in the accessor itself is reported at its own pointer, before anything is allocated.
    std::vector<float> floats(int accessor, const AccessorFormat& format, ElementRange range,
                              const std::string& use) const;

    /// The first `count` matrices of a MAT4 accessor of floats, each column after column.
    std::vector<float> matrices(int accessor, std::size_t count, const std::string& use) const;

    /// A SCALAR accessor of unsigned integers. `max_value` becomes the largest number of its type.
    std::vector<std::uint32_t> indices(int accessor, const std::string& use,
                                       std::uint32_t& max_value) const;

    /// The bytes of a buffer view. Throws if they are not all in the buffer.
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
