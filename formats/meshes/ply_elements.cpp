// SPDX-License-Identifier: Apache-2.0
#include "formats/meshes/ply_elements.h"

#include <algorithm>

#include <peeler/error.h>
#include "formats/file/text_words.h"

namespace peeler {
namespace {

std::span<const std::uint8_t> plyBytes(const MeshFile& file) {
    const std::string_view text = withoutByteOrderMark(file.text());
    return file.bytes().last(text.size());
}

}  // namespace

PlyElements::PlyElements(MeshFile& file)
    : file_(file), ply_(plyBytes(file_), file_.name()), numbers_(ply_.numbers()) {}

void PlyElements::failNoVertices() const {
    std::string names;
    for (const PlyElement& element : ply_.elements())
        names += (names.empty() ? "" : ", ") + element.name;
    throw Error(
        ErrorKind::kInput,
        "the file has no element vertex; its elements are: " + (names.empty() ? "none" : names),
        file_.name(), "rename the element of the vertices to vertex");
}

void PlyElements::read(const std::function<bool(const PlyElement&)>& read) {
    const auto& elements = ply_.elements();
    if (std::ranges::find(elements, "vertex", &PlyElement::name) == elements.end())
        failNoVertices();
    for (const PlyElement& element : elements) {
        row = 0;
        try {
            readElement(element, read);
        } catch (const Error& problem) {
            if (problem.kind() != ErrorKind::kInput || !problem.where().empty()) throw;
            const std::size_t place = file_.bytes().size() - numbers_->left();
            throw Error(ErrorKind::kInput,
                        element.name + " " + std::to_string(row) + ": " + problem.whatText(),
                        ply_.isText() ? file_.atLine(place) : file_.atByte(place),
                        problem.hint().empty() ? "export the file again" : problem.hintText());
        }
    }
    checkEnd();
}

void PlyElements::readElement(const PlyElement& element,
                              const std::function<bool(const PlyElement&)>& read) {
    if (element.properties.empty()) return;
    // Check the number of rows before allocating anything.
    if (element.rows > numbers_->most(element)) failPlyEndsEarly();
    if (read(element)) return;
    if (element.rows > 0) file_.warn("The element " + element.name + " of the file is not read.");
    for (; row < element.rows; ++row)
        for (const PlyField& property : element.properties)
            numbers_->skip(property);
}

void PlyElements::checkEnd() {
    const std::string_view left =
        trimmed(file_.text().substr(file_.text().size() - numbers_->left()));
    if (!left.empty())
        file_.warn("Bytes after the last element are ignored (" + std::to_string(left.size()) +
                   ").");
}

const PlyField* propertyNamed(const PlyElement& element, std::string_view name) {
    const auto found = std::ranges::find(element.properties, name, &PlyField::name);
    return found == element.properties.end() ? nullptr : &*found;
}

bool isPly(std::string_view begin) {
    begin = withoutByteOrderMark(begin);
    return begin.starts_with("ply\n") || begin.starts_with("ply\r");
}

}  // namespace peeler
