// SPDX-License-Identifier: Apache-2.0
// Reader of the points of a PLY file.
#include <algorithm>
#include <string_view>

#include <peeler/error.h>
#include "formats/arrays/ply_file.h"
#include "formats/arrays/point_reader.h"

namespace peeler {
namespace {

/// Returns the axis, 0 to 2, of a property x, y or z, or −1 for any other property.
int axisOf(const PlyField& property) {
    if (property.count || property.name.size() != 1) return -1;
    const int axis = property.name[0] - 'x';
    return axis >= 0 && axis < 3 ? axis : -1;
}

void readRow(const PlyElement& element, PlyNumbers& numbers, glm::dvec3& point) {
    for (const PlyField& property : element.properties) {
        if (const int axis = axisOf(property); axis >= 0)
            point[axis] = numbers.next(*property.type);
        else
            numbers.skip(property);
    }
}

void checkCoordinates(const PlyElement& vertex, const std::string& where) {
    for (int axis = 0; axis < 3; ++axis) {
        if (std::ranges::count(vertex.properties, axis, axisOf) != 1)
            throw Error(ErrorKind::kInput, "every vertex needs one x, y and z", where);
    }
}

}  // namespace

std::vector<glm::dvec3> plyPoints(std::span<const std::uint8_t> file, const std::string& where,
                                  const AllowBytes& allow) {
    const PlyFile ply(file, where);
    const std::unique_ptr<PlyNumbers> numbers = ply.numbers();
    std::vector<glm::dvec3> points;
    for (const PlyElement& element : ply.elements()) {
        const bool is_vertex = element.name == "vertex";
        if (is_vertex) checkCoordinates(element, where);
        if (element.properties.empty()) continue;
        std::uint64_t row = 0;
        try {
            // Check before allocating anything.
            if (element.rows > numbers->most(element)) failPlyEndsEarly();
            if (is_vertex && element.rows > kMostPoints)
                throw Error(ErrorKind::kInput, kTooManyPoints, "", kFewerPoints);
            if (is_vertex) {
                allow(element.rows * sizeof(glm::dvec3));
                points.resize(element.rows);
            }
            glm::dvec3 none;
            for (; row < element.rows; ++row)
                readRow(element, *numbers, is_vertex ? points[row] : none);
        } catch (const Error& error) {
            throw error.at(where + ", " + element.name + " " + std::to_string(row));
        }
        if (is_vertex) return points;
    }
    throw Error(ErrorKind::kInput, "the file has no vertices", where);
}

}  // namespace peeler
