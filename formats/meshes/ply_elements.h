// SPDX-License-Identifier: Apache-2.0
// Reader of the elements of a PLY file in order, for meshes and for splats.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <span>

#include "formats/arrays/ply_file.h"
#include "formats/meshes/mesh_parts.h"

namespace peeler {

class PlyElements {
  public:
    /// Parses the header of the file, which must outlive the object.
    explicit PlyElements(MeshFile& file);

    const PlyFile& header() const { return ply_; }
    PlyNumbers& numbers() { return *numbers_; }

    /// Calls read(element) for each element, which reads all rows by numbers() and returns true, or
    /// returns false; the element is then skipped, with a warning. Adds the element, its current
    /// row and the place in the file to errors that have no place. Warns about bytes after the last
    /// element. Throws Error (kInput) if there is no element `vertex`, or if the file cannot hold
    /// the rows that an element has.
    void read(const std::function<bool(const PlyElement&)>& read);

    std::uint64_t row = 0;  ///< the row that is being read, for messages

  private:
    [[noreturn]] void failNoVertices() const;
    void readElement(const PlyElement& element, const std::function<bool(const PlyElement&)>& read);
    void checkEnd();

    MeshFile& file_;
    PlyFile ply_;
    std::unique_ptr<PlyNumbers> numbers_;
};

/// Returns the element's property of this name, or null.
const PlyField* propertyNamed(const PlyElement& element, std::string_view name);

/// Whether the file begins as a PLY does.
bool isPly(std::string_view begin);

}  // namespace peeler
