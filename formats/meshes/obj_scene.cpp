// SPDX-License-Identifier: Apache-2.0
// Reads Wavefront OBJ (Alias|Wavefront, "Object Files (.obj)", 1995): faces, lines and points; its
// objects and groups become nodes. Debian's tinyobjloader is not used: it sums up decimal digits,
// so that numbers differ from what they say in their last bits; takes a number that is none for 0,
// and an index that is out of range for a warning without a line; and leaves out faces, so that the
// ones behind them count otherwise.
#include <algorithm>
#include <map>
#include <optional>
#include <utility>

#include "core/base/error.h"
#include "formats/file/text_words.h"
#include "formats/meshes/mesh_parts.h"

namespace peeler {
namespace {

/// Curves and surfaces, and how they would be shown: the statements that are left out.
constexpr std::string_view kFreeForm[] = {"vp",    "cstype", "deg",  "bmat",  "step", "curv",
                                          "curv2", "surf",   "parm", "trim",  "hole", "scrv",
                                          "sp",    "end",    "con",  "ctech", "stech"};
constexpr std::string_view kWithoutEffect[] = {"s",        "mg",    "bevel",      "c_interp",
                                               "d_interp", "lod",   "shadow_obj", "trace_obj",
                                               "usemap",   "maplib"};

/// Lines of the text, one after the other; a backslash at an end goes on in the next line.
class ObjLines {
  public:
    explicit ObjLines(std::string_view text) : rest_(text) {}

    /// The next line without blanks at its ends, until the call after that; false if there is none.
    bool next(std::string_view& line) {
        if (rest_.empty()) return false;
        first_ = ++last_;
        line = takeLine(rest_);
        if (line.ends_with('\\')) {
            joined_.clear();
            while (line.ends_with('\\')) {
                joined_.append(line.substr(0, line.size() - 1)).append(1, ' ');
                line = takeLine(rest_);
                ++last_;
            }
            joined_.append(line);
            line = joined_;
        }
        line = trimmed(line);
        return true;
    }
    /// Its number, from 1; of several the first one's.
    std::size_t number() const { return first_; }

  private:
    std::string_view rest_;
    std::string joined_;
    std::size_t first_ = 0, last_ = 0;
};

class ObjReader {
  public:
    ObjReader(const std::filesystem::path& path, const SceneReadOptions& options)
        : file_(path, options),
          text_(withoutByteOrderMark(file_.text())),
          materials_(file_),
          corners_(cornerIndex()) {}

    Scene read() {
        readVertices();
        readElements();
        closeRun();
        finishScene();
        return file_.finish();
    }

  private:
    /// A corner as it stands in an element, from 0; −1 = it has none.
    struct Corner {
        std::int64_t position = -1, uv = -1, normal = -1;
    };
    /// What elements have in common that become one primitive.
    struct Run {
        std::size_t place = 0;  ///< index into places_
        int material = -1;
        Topology topology = Topology::kTriangles;
        bool has_uvs = false, has_normals = false;
        bool operator==(const Run&) const = default;
    };
    /// An object, or a group in one.
    struct Place {
        std::string object;
        std::optional<std::string> group;
        Mesh mesh{};
    };

    // Vertices come first, since an element may name those that stand below it.

    void readVertices() {
        std::string_view line;
        for (lines_ = ObjLines(text_); lines_.next(line);) {
            if (!line.starts_with('v')) continue;
            const std::string_view word = takeWord(line);
            if (word == "v")
                readPosition(line);
            else if (word == "vt")
                add(uvs_, glm::vec2(0, 1) + glm::vec2(1, -1) * glm::vec2(numbers(line, 1, 3)));
            else if (word == "vn")
                add(normals_, glm::vec3(numbers(line, 3, 3)));
        }
    }

    void readPosition(std::string_view line) {
        std::array<float, 8> found{};
        std::size_t count = 0;
        for (std::string_view word = takeWord(line); !word.empty() && count < found.size();
             word = takeWord(line))
            found[count++] = number(word);
        if (count < 3) fail("a vertex has fewer than three coordinates");
        add(positions_, glm::vec3(found[0], found[1], found[2]));
        if (count < 6) return;  // a fourth number is a weight of curves
        if (colors_.empty()) file_.allowGeometry(positions_.size() * sizeof(glm::vec4));
        colors_.resize(positions_.size() - 1, glm::vec4(1));
        add(colors_, linearColor({found[3], found[4], found[5], 1}));
    }

    template <class Vector>
    void add(std::vector<Vector>& values, const Vector& value) {
        if (values.size() % kOnce == 0) file_.allow(kOnce * sizeof(Vector));
        values.push_back(value);
    }

    /// So many numbers at least; those that are missing are 0.
    glm::vec4 numbers(std::string_view line, int least, int most) {
        glm::vec4 found(0);
        for (int i = 0; i < most; ++i) {
            const std::string_view word = takeWord(line);
            if (word.empty() && i >= least) break;
            found[i] = number(word);
        }
        return found;
    }

    float number(std::string_view word) const {
        const auto value = numberIn<double>(word);
        if (!value) fail("expected a number, not \"" + std::string(word.substr(0, 32)) + "\"");
        const auto found = coordinate(*value);
        if (!found) fail("a number is infinite, not a number, or too large");
        return *found;
    }

    // Elements.

    void readElements() {
        std::string_view line;
        for (lines_ = ObjLines(text_); lines_.next(line);) {
            std::string_view rest = line;
            const std::string_view word = takeWord(rest);
            if (word.empty() || word.front() == '#') continue;
            if (word == "v")
                ++positions_seen_;
            else if (word == "vt")
                ++uvs_seen_;
            else if (word == "vn")
                ++normals_seen_;
            else if (word == "f" || word == "fo")
                readFace(rest);
            else if (word == "l" || word == "p")
                readLineOrPoints(rest, word == "l");
            else
                readState(word, trimmed(rest));
        }
    }

    void readState(std::string_view word, std::string_view rest) {
        if (word == "o") {
            place_ = placeOf({std::string(rest), {}, {}});
        } else if (word == "g") {
            std::optional<std::string> group;
            if (!rest.empty()) group = rest;
            place_ = placeOf({places_[place_].object, std::move(group), {}});
        } else if (word == "usemtl") {
            material_ = materials_.use(std::string(rest), where());
        } else if (word == "mtllib") {
            materials_.load(rest, where());
        } else if (std::ranges::find(kFreeForm, word) != std::end(kFreeForm)) {
            file_.warn("Curves and surfaces of the file are not read.");
        } else if (std::ranges::find(kWithoutEffect, word) == std::end(kWithoutEffect)) {
            if (unknown_++ == 0) first_unknown_ = where();
        }
    }

    std::size_t placeOf(Place place) {
        const auto [found, is_new] =
            place_numbers_.try_emplace({place.object, place.group}, places_.size());
        if (is_new) {
            file_.allow(sizeof(Place) + 2 * place.object.size());
            places_.push_back(std::move(place));
        }
        return found->second;
    }

    void readFace(std::string_view line) {
        readCorners(line);
        if (face_.size() < 3) {
            ++odd_faces_;
            return;
        }
        openRun(Topology::kTriangles);
        vertices_.clear();
        for (const Corner& corner : face_)
            vertices_.push_back(vertexOf(corner));
        if (face_.size() == 3) {
            addElement({0, 1, 2}, 3);
            return;
        }
        outline_.clear();
        for (const Corner& corner : face_)
            outline_.push_back(positions_[static_cast<std::size_t>(corner.position)]);
        try {
            for (const PolygonCutter::Triangle& triangle : cutter_.cut(outline_))
                addElement(triangle, 3);
        } catch (const Error& problem) {
            throw Error(problem.kind(), problem.what(), where(), problem.hint());
        }
    }

    void readLineOrPoints(std::string_view line, bool is_line) {
        readCorners(line);
        if (face_.empty()) return;
        openRun(is_line ? Topology::kLines : Topology::kPoints);
        vertices_.clear();
        for (const Corner& corner : face_)
            vertices_.push_back(vertexOf(corner));
        const std::size_t each = is_line ? 2 : 1;
        for (std::uint32_t i = 0; i + each <= vertices_.size(); ++i)
            addElement({i, i + 1, 0}, each);
    }

    void readCorners(std::string_view line) {
        face_.clear();
        for (std::string_view word = takeWord(line); !word.empty(); word = takeWord(line)) {
            Corner corner;
            const std::size_t first = std::min(word.find('/'), word.size());
            corner.position = index(word.substr(0, first), positions_.size(), positions_seen_);
            word.remove_prefix(std::min(first + 1, word.size()));
            const std::size_t second = std::min(word.find('/'), word.size());
            if (second > 0) corner.uv = index(word.substr(0, second), uvs_.size(), uvs_seen_);
            word.remove_prefix(std::min(second + 1, word.size()));
            if (!word.empty()) corner.normal = index(word, normals_.size(), normals_seen_);
            face_.push_back(corner);
        }
        for (auto member : {&Corner::uv, &Corner::normal}) {
            const auto none = std::ranges::count(face_, -1, member);
            if (none == 0 || none == static_cast<std::ptrdiff_t>(face_.size())) continue;
            file_.warn(
                "Some corners of a face have normals or texture coordinates that others "
                "lack; it is taken to have none.");
            for (Corner& corner : face_)
                corner.*member = -1;
        }
    }

    /// From 1, or back from the last one before this line.
    std::int64_t index(std::string_view word, std::size_t count, std::size_t seen) const {
        const auto number = numberIn<std::int64_t>(word);
        if (!number) fail("expected an index, not \"" + std::string(word.substr(0, 32)) + "\"");
        const auto all = static_cast<std::int64_t>(count);
        const std::int64_t found =
            *number < 0 ? static_cast<std::int64_t>(seen) + std::max(*number, -all - 1)
                        : *number - 1;
        if (*number == 0 || found < 0 || found >= all)
            fail("it names number " + std::string(word.substr(0, 32)) + " of " +
                 std::to_string(count));
        return found;
    }

    void openRun(Topology topology) {
        const Run run{place_, material_, topology, face_[0].uv >= 0, face_[0].normal >= 0};
        if (run_ == run) return;
        closeRun();
        run_ = run;
        primitive_.topology = topology;
        primitive_.material = material_;
        file_.allow(sizeof(Primitive) + kRunBytes);
    }

    std::uint32_t vertexOf(const Corner& corner) {
        const std::size_t known = corners_.keys().size();
        const std::uint32_t vertex = corners_.indexOf({static_cast<std::uint32_t>(corner.position),
                                                       static_cast<std::uint32_t>(corner.uv),
                                                       static_cast<std::uint32_t>(corner.normal)});
        if (corners_.keys().size() == known) return vertex;
        const auto place = static_cast<std::size_t>(corner.position);
        if (vertices_made_++ % kOnce == 0) file_.allowGeometry(kOnce * kVertexBytes);
        primitive_.positions.push_back(positions_[place]);
        if (run_->has_uvs)
            primitive_.texcoords[0].push_back(uvs_[static_cast<std::size_t>(corner.uv)]);
        if (run_->has_normals)
            primitive_.normals.push_back(normals_[static_cast<std::size_t>(corner.normal)]);
        if (!colors_.empty())
            primitive_.colors.push_back(place < colors_.size() ? colors_[place] : glm::vec4(1));
        return vertex;
    }

    void addElement(const PolygonCutter::Triangle& corners, std::size_t count) {
        if (elements_made_++ % kOnce == 0) file_.allowGeometry(kOnce * sizeof corners);
        for (std::size_t i = 0; i < count; ++i)
            primitive_.indices.push_back(vertices_[corners[i]]);
    }

    void closeRun() {
        if (!run_) return;
        Place& place = places_[run_->place];
        if (!primitive_.indices.empty()) place.mesh.primitives.push_back(std::move(primitive_));
        primitive_ = {};
        corners_ = cornerIndex();
        run_.reset();
    }

    // The scene.

    void finishScene() {
        if (odd_faces_ > 0)
            file_.warn("Faces of fewer than three corners show nothing (" +
                       std::to_string(odd_faces_) + ").");
        if (unknown_ > 0)
            file_.warn("Lines that mean nothing are passed over (" + std::to_string(unknown_) +
                       "; the first: " + first_unknown_ + ").");
        materials_.finish();
        std::map<std::string, int> objects;
        for (Place& place : places_) {
            if (place.mesh.primitives.empty()) continue;
            for (Primitive& primitive : place.mesh.primitives)
                if (primitive.material < 0) primitive.material = file_.neutralMaterial();
            const bool has_object = !place.object.empty();
            const auto known = objects.find(place.object);
            if (place.group && has_object && known == objects.end())
                objects.emplace(place.object, file_.addNode(place.object, {}));
            const std::string& name = place.group ? *place.group : place.object;
            const int node =
                file_.addNode(name.empty() ? file_.stem() : name, std::move(place.mesh));
            if (!place.group && has_object) objects.emplace(place.object, node);
            if (place.group && has_object)
                file_.scene()
                    .nodes[static_cast<std::size_t>(objects.at(place.object))]
                    .children.push_back(node);
        }
        if (file_.scene().nodes.empty()) file_.addNode(file_.stem(), {});
    }

    CornerIndex cornerIndex() {
        return CornerIndex([this](std::uint64_t bytes) { file_.allow(bytes); });
    }
    std::string where() const { return file_.name() + ":" + std::to_string(lines_.number()); }
    [[noreturn]] void fail(const std::string& what) const {
        throw Error(ErrorKind::kInput, what, where(), "export the file again");
    }

    static constexpr std::size_t kOnce = 4096;  ///< numbers that are asked for together
    /// Beside what is in the scene, until it is drawn.
    static constexpr std::size_t kRunBytes = 4096;
    static constexpr std::size_t kVertexBytes =
        2 * sizeof(glm::vec3) + sizeof(glm::vec2) + sizeof(glm::vec4);

    MeshFile file_;
    std::string_view text_;
    ObjLines lines_{{}};
    ObjMaterials materials_;
    std::vector<glm::vec3> positions_, normals_;
    std::vector<glm::vec2> uvs_;
    std::vector<glm::vec4> colors_;  ///< of the first vertices; the others are white
    std::size_t positions_seen_ = 0, uvs_seen_ = 0, normals_seen_ = 0;
    std::vector<Place> places_ = std::vector<Place>(1);
    std::map<std::pair<std::string, std::optional<std::string>>, std::size_t> place_numbers_{
        {{"", std::nullopt}, 0}};
    std::size_t place_ = 0;
    int material_ = -1;
    std::optional<Run> run_;
    Primitive primitive_;  ///< of the run
    CornerIndex corners_;
    PolygonCutter cutter_;
    std::uint64_t vertices_made_ = 0, elements_made_ = 0, odd_faces_ = 0, unknown_ = 0;
    std::string first_unknown_;
    // Of the element that is read.
    std::vector<Corner> face_;
    std::vector<std::uint32_t> vertices_;
    std::vector<glm::vec3> outline_;
};

}  // namespace

/// A line that only an OBJ has, among the first ones, and no bytes that are no text.
bool isObj(std::string_view begin, std::uint64_t) {
    if (begin.find('\0') != std::string_view::npos) return false;
    constexpr std::string_view kWords[] = {"v", "vt", "vn", "f", "o", "g", "mtllib", "usemtl"};
    begin = withoutByteOrderMark(begin);
    while (!begin.empty()) {
        std::string_view line = takeLine(begin);
        const std::string_view word = takeWord(line);
        if (word.empty() || word.front() == '#') continue;
        return std::ranges::find(kWords, word) != std::end(kWords) && !takeWord(line).empty();
    }
    return false;
}

Scene readObjScene(const std::filesystem::path& path, const SceneReadOptions& options) {
    return ObjReader(path, options).read();
}

}  // namespace peeler
