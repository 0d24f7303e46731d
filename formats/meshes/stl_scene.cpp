// SPDX-License-Identifier: Apache-2.0
// Reader of text and binary STL (M. Burns, "Automated Fabrication", 1993, section 6.5). The scene
// has a single mesh, whose triangle k is triangle k in the file. Facet normals are ignored, since
// they follow from the corners. In text, white space and line ends are free.
#include <algorithm>
#include <bit>
#include <cstring>

#include <peeler/error.h>
#include "formats/file/text_words.h"
#include "formats/meshes/mesh_parts.h"

namespace peeler {
namespace {

constexpr std::uint64_t kHeader = 84, kFacet = 50;
constexpr std::size_t kFirstCorner = 12, kAttribute = 48;  // byte offsets in a facet

std::uint32_t facetsOf(std::string_view begin) {
    std::uint32_t facets = 0;
    if (begin.size() >= kHeader) std::memcpy(&facets, begin.data() + kHeader - sizeof facets, 4);
    return facets;
}

std::uint64_t binarySize(std::string_view begin) {
    return kHeader + kFacet * facetsOf(begin);
}

/// Whether a word is this keyword, in lower case or, as in files of old programs, in capitals.
bool is(std::string_view word, std::string_view keyword) {
    return std::ranges::equal(word, keyword, [](char a, char b) {
        return a == b || (a >= 'A' && a <= 'Z' && a - 'A' + 'a' == b);
    });
}

/// Whether the file is text. Some programs begin a binary header like text, but binary triangles
/// always contain zero bytes.
bool isText(std::string_view begin) {
    constexpr std::size_t kLooked = 4096;
    if (begin.substr(0, kLooked).find('\0') != std::string_view::npos) return false;
    std::string_view rest = withoutByteOrderMark(begin);
    return is(takeWord(rest), "solid");
}

/// Removes a solid's name from the text and returns it: the rest of the line, up to a facet or
/// another solid.
std::string_view takeName(std::string_view& text) {
    const std::string_view line = text.substr(0, text.find_first_of("\r\n"));
    std::size_t end = line.size(), solid = line.size();
    std::string_view rest = line, after;
    for (std::string_view word = takeWord(rest); !word.empty(); word = takeWord(rest)) {
        const std::size_t place = line.size() - rest.size() - word.size();
        if (is(word, "solid")) solid = std::min(solid, place);
        if (!is(word, "facet") || !is(takeWord(after = rest), "normal")) continue;
        end = std::min(solid, place);
        break;
    }
    text.remove_prefix(end);
    return trimmed(line.substr(0, end));
}

class StlReader {
  public:
    StlReader(const std::filesystem::path& path, const SceneReadOptions& options)
        : file_(path, options),
          corners_([&](std::uint64_t bytes) { file_.allow(bytes); }),
          text_(file_.text()) {}

    Scene read() {
        std::string name;
        const bool is_binary = text_.size() >= kHeader && binarySize(text_) == text_.size();
        if (!is_binary && isText(text_))
            name = readText();
        else
            readBinary();
        primitive_.positions.reserve(corners_.keys().size());
        for (const CornerIndex::Key& key : corners_.keys())
            primitive_.positions.push_back(std::bit_cast<glm::vec3>(key));
        Mesh mesh;
        if (!primitive_.indices.empty()) {
            primitive_.material = file_.neutralMaterial();
            mesh.primitives.push_back(std::move(primitive_));
        }
        file_.addNode(name.empty() ? file_.stem() : name, std::move(mesh));
        return file_.finish();
    }

  private:
    void readBinary() {
        if (text_.size() < kHeader)
            throw Error(ErrorKind::kInput, "this is not an STL file: it is shorter than a header",
                        file_.name(), "check that it is complete");
        const std::uint64_t facets = facetsOf(text_), size = binarySize(text_);
        if (size > text_.size())
            throw Error(ErrorKind::kInput,
                        "the file ends before its " + std::to_string(facets) + " triangles do",
                        file_.atByte(text_.size()), "copy or export the file again");
        if (size < text_.size())
            file_.warn("Bytes after the last triangle are ignored (" +
                       std::to_string(text_.size() - size) + ").");
        file_.allowGeometry(facets * 3 * sizeof(std::uint32_t));
        primitive_.indices.reserve(facets * 3);
        corners_.reserve(facets / 2);  // a closed surface has about half as many corners as facets
        bool has_attributes = text_.substr(0, kHeader).find("COLOR=") != std::string_view::npos;
        for (std::uint64_t facet = 0; facet < facets; ++facet) {
            const std::size_t at = kHeader + kFacet * facet;
            std::array<CornerIndex::Key, 3> corners;
            std::memcpy(corners.data(), text_.data() + at + kFirstCorner, sizeof corners);
            std::uint16_t attribute = 0;
            std::memcpy(&attribute, text_.data() + at + kAttribute, sizeof attribute);
            has_attributes = has_attributes || attribute != 0;
            for (const CornerIndex::Key& corner : corners) {
                if (!isFinite(corner))
                    throw Error(
                        ErrorKind::kInput,
                        "a corner of triangle " + std::to_string(facet) + " is infinite or NaN",
                        file_.atByte(at + kFirstCorner), "export the file again");
                addCorner(corner);
            }
        }
        if (has_attributes) file_.warn("The colours in triangle attributes are not read.");
    }

    /// Reads text. All solids become one mesh with the name of the first.
    std::string readText() {
        std::string name;
        std::string_view rest = withoutByteOrderMark(text_);
        bool in_solid = false, named = false, in_normal = false;
        int corners = -1;  // number of corners in the open facet; −1 if no facet is open
        while (true) {
            const std::string_view before = rest;
            const std::string_view word = takeWord(rest);
            const std::size_t place = text_.size() - rest.size();
            if (word.empty()) break;
            if (in_normal && !is(word, "outer") && !is(word, "vertex") && !is(word, "endfacet"))
                continue;  // skip the normal, since programs format normals in different ways
            in_normal = false;
            if (is(word, "vertex") && corners >= 0) {
                if (++corners > 3) fail("a facet has more than three corners", place);
                readCorner(rest, place);
            } else if (is(word, "facet") && corners < 0) {
                in_normal = true;
                corners = 0;
            } else if (is(word, "endfacet") && corners >= 0) {
                if (corners < 3) fail("a facet has fewer than three corners", place);
                corners = -1;
            } else if (is(word, "solid") && corners < 0) {
                const std::string_view next = takeName(rest);
                if (named && next != name)
                    file_.warn("The solids of the file become one mesh, named after the first.",
                               file_.atLine(place));
                if (!named) name = next;
                in_solid = named = true;
            } else if (is(word, "endsolid") && corners < 0) {
                takeName(rest);
                in_solid = false;
            } else if (is(word, "color")) {
                for (int i = 0; i < 3; ++i)
                    takeWord(rest);
                file_.warn("Colours of triangles are not read.");
            } else if (is(word, "outer") || is(word, "loop") || is(word, "endloop")) {
                continue;
            } else {
                const std::string_view shown = takeWord(rest = before);
                fail("\"" + std::string(shown.substr(0, 32)) + "\" does not belong here", place);
            }
        }
        if (corners >= 0) fail("the file ends before its solid does", text_.size());
        if (in_solid)
            file_.warn("The file has no endsolid: it may be cut off.", file_.atLine(text_.size()));
        return name;
    }

    void readCorner(std::string_view& rest, std::size_t place) {
        glm::vec3 corner;
        for (int axis = 0; axis < 3; ++axis) {
            const std::string_view word = takeWord(rest);
            const auto number = numberIn<double>(word);
            const auto value = number ? coordinate(*number) : std::nullopt;
            if (!value)
                fail("expected a number, not \"" + std::string(word.substr(0, 32)) + "\"", place);
            corner[axis] = *value;
        }
        if (primitive_.indices.size() % kOnce == 0) {
            file_.allowGeometry(kOnce * sizeof(std::uint32_t));
        }
        addCorner(std::bit_cast<CornerIndex::Key>(corner));
    }

    void addCorner(const CornerIndex::Key& corner) {
        const std::size_t known = corners_.keys().size();
        primitive_.indices.push_back(corners_.indexOf(corner));
        if (known % kOnce == 0 && corners_.keys().size() > known)
            file_.allowGeometry(kOnce * sizeof(glm::vec3));
    }

    static bool isFinite(const CornerIndex::Key& corner) {
        constexpr std::uint32_t kExponent = 0x7F800000;
        return (corner[0] & kExponent) != kExponent && (corner[1] & kExponent) != kExponent &&
               (corner[2] & kExponent) != kExponent;
    }

    [[noreturn]] void fail(const std::string& what, std::size_t place) const {
        throw Error(ErrorKind::kInput, what, file_.atLine(place),
                    "export the file again, or as binary STL");
    }

    static constexpr std::size_t kOnce = 4096;  ///< number of elements per memory request

    MeshFile file_;
    CornerIndex corners_;
    std::string_view text_;
    Primitive primitive_;
};

}  // namespace

bool isStl(std::string_view begin, std::uint64_t size) {
    return (begin.size() >= kHeader && binarySize(begin) == size) || isText(begin);
}

Scene readStlScene(const std::filesystem::path& path, const SceneReadOptions& options) {
    return StlReader(path, options).read();
}

}  // namespace peeler
