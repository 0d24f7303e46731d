// SPDX-License-Identifier: Apache-2.0
// Reader of Wavefront OBJ (Alias|Wavefront, "Object Files (.obj)", 1995): faces, lines and points;
// objects and groups become nodes. Debian's tinyobjloader is not used because of these faults: it
// adds up decimal digits, so the last bits of numbers are wrong; it reads malformed numbers as 0;
// it only warns, without a line, about an index out of range; and it drops faces, which shifts the
// indices of later faces.
#include <algorithm>
#include <charconv>
#include <cmath>
#include <limits>
#include <map>
#include <optional>
#include <utility>

#include <peeler/error.h>
#include "formats/file/text_words.h"
#include "formats/meshes/mesh_parts.h"

namespace peeler {
namespace {

/// Statements about curves and surfaces and their display, which are ignored with a warning.
constexpr std::string_view kFreeForm[] = {
    "vp",   "cstype", "deg", "bmat", "step",  "curv",  "curv2", "surf", "parm", "trim", "hole",
    "scrv", "sp",     "end", "con",  "ctech", "stech", "bsp",   "bzp",  "cdc",  "cdp",  "res"};
/// Other statements that are ignored with a warning, unless their argument is "off".
constexpr std::string_view kLost[] = {"bevel",      "c_interp",  "d_interp", "usemap", "maplib",
                                      "shadow_obj", "trace_obj", "call",     "csh"};
/// Statements about curves, surfaces or previews that are ignored without a warning.
constexpr std::string_view kHarmless[] = {"mg", "lod"};

bool isAmong(std::string_view word, std::span<const std::string_view> words) {
    return std::ranges::find(words, word) != words.end();
}

/// Returns the line up to a comment. Do not use it for statements with names, which may contain
/// '#'.
std::string_view withoutComment(std::string_view line) {
    return line.substr(0, line.find('#'));
}

/// A reader of the lines of a text. It joins a line that ends in a backslash with the next line.
class ObjLines {
  public:
    explicit ObjLines(std::string_view text) : rest_(text) {}

    /// Reads the next line, without blanks at its ends. The line is valid until the next call.
    /// Returns false at the end.
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
    /// Returns the number of the line, from 1; for joined lines, the number of the first.
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
    /// A corner of an element: indices from 0, −1 for missing ones.
    struct Corner {
        std::int64_t position = -1, uv = -1, normal = -1;
    };
    /// The properties shared by all elements of a primitive.
    struct Run {
        std::size_t place = 0;  ///< index into places_
        int material = -1;
        Topology topology = Topology::kTriangles;
        bool has_uvs = false, has_normals = false;
        bool operator==(const Run&) const = default;
    };
    /// An object, or a group in an object.
    struct Place {
        std::string object;
        std::optional<std::string> group;
        Mesh mesh{};
    };

    // The first pass reads only vertices, because an element may refer to later vertices.

    void readVertices() {
        std::string_view line;
        for (lines_ = ObjLines(text_); lines_.next(line);) {
            if (line.starts_with(kPaint)) {
                readPaint(line.substr(kPaint.size()));
                continue;
            }
            finishPaint();
            if (!line.starts_with('v')) continue;
            line = withoutComment(line);
            const std::string_view word = takeWord(line);
            if (word == "v")
                readPosition(line);
            else if (word == "vt")
                add(uvs_, glm::vec2(0, 1) + glm::vec2(1, -1) * glm::vec2(finite(line, 1)));
            else if (word == "vn")
                add(normals_, finite(line, 3));
        }
        finishPaint();
        if (odd_numbers_ > 0)
            file_.warn("Normals and texture coordinates that are infinite or NaN are left out (" +
                       std::to_string(odd_numbers_) + ").");
        if (!makeLinear(colors_, {}))
            file_.warn("Colours of vertices that are above 1 are clamped.");
    }

    void readPosition(std::string_view line) {
        std::array<float, 8> found{};
        std::size_t count = 0;
        for (std::string_view word = takeWord(line); !word.empty() && count < found.size();
             word = takeWord(line))
            found[count++] = number(word);
        if (count < 3) fail("a vertex has fewer than three coordinates");
        add(positions_, glm::vec3(found[0], found[1], found[2]));
        if (count == 5 || count > 6)
            file_.warn(
                "A vertex has " + std::to_string(count) +
                    " numbers instead of 3 (x y z), 4 (x y z w) or 6 (x y z r g b); the surplus "
                    "numbers are ignored.",
                where());
        if (count < 6) return;  // a fourth number is a weight for curves
        const glm::vec4 color(found[3], found[4], found[5], 1);
        addColors(positions_.size() - 1, {&color, 1});
    }

    /// Sets the colours of vertices from index `first` on.
    void addColors(std::size_t first, std::span<const glm::vec4> colors) {
        const std::size_t end = first + colors.size();
        if (end > colors_.size()) file_.allowGeometry((end - colors_.size()) * sizeof(glm::vec4));
        colors_.resize(std::max(colors_.size(), end), kNoColor);
        std::ranges::copy(colors, colors_.begin() + static_cast<std::ptrdiff_t>(first));
    }

    /// Reads ZBrush's colours, MMRRGGBB in hexadecimal digits, where MM is a mask. The colours
    /// follow the vertices to which they belong.
    void readPaint(std::string_view line) {
        constexpr std::size_t kDigits = 8;
        for (line = trimmed(line); line.size() >= kDigits; line.remove_prefix(kDigits)) {
            std::uint32_t mrgb = 0;
            const auto [end, failure] =
                std::from_chars(line.data(), line.data() + kDigits, mrgb, 16);
            if (failure != std::errc() || end != line.data() + kDigits)
                fail("expected eight hexadecimal digits per vertex");
            add(paint_,
                glm::vec4(mrgb >> 16U & 255U, mrgb >> 8U & 255U, mrgb & 255U, 255) / 255.0F);
        }
    }

    void finishPaint() {
        if (paint_.empty()) return;
        if (paint_.size() > positions_.size()) fail("there are more colours than vertices");
        addColors(positions_.size() - paint_.size(), paint_);
        paint_.clear();
    }

    template <class Vector>
    void add(std::vector<Vector>& values, const Vector& value) {
        if (values.size() % kOnce == 0) file_.allow(kOnce * sizeof(Vector));
        values.push_back(value);
    }

    /// Reads at least `least` and at most three numbers. Missing numbers are 0. If any number is
    /// not finite, all three become NaN.
    glm::vec3 finite(std::string_view line, int least) {
        glm::vec3 found(0);
        for (int i = 0; i < 3; ++i) {
            const std::string_view word = takeWord(line);
            if (word.empty() && i >= least) break;
            const auto value = coordinate(real(word));
            if (!value) {
                ++odd_numbers_;
                return glm::vec3(std::numeric_limits<float>::quiet_NaN());
            }
            found[i] = *value;
        }
        return found;
    }

    double real(std::string_view word) const {
        const auto value = numberIn<double>(word);
        if (!value) fail("expected a number, not \"" + std::string(word.substr(0, 32)) + "\"");
        return *value;
    }

    float number(std::string_view word) const {
        const auto found = coordinate(real(word));
        if (!found) fail("a number is infinite, NaN or too large");
        return *found;
    }

    // Second pass: reading of elements.

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
                readFace(withoutComment(rest));
            else if (word == "l" || word == "p")
                readLineOrPoints(withoutComment(rest), word == "l");
            else if (!readState(word, objName(rest))) {
                if (unknown_++ == 0) first_unknown_ = where();
                continue;
            }
            is_obj_ = true;
        }
    }

    /// Reads a statement that changes the state. Returns false if `word` is not the keyword of such
    /// a statement.
    bool readState(std::string_view word, std::string_view rest) {
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
        } else if (word == "s") {
            rest = withoutComment(rest);
            const std::string_view group = takeWord(rest);
            in_smooth_group_ = !group.empty() && group != "off" && group != "0";
        } else {
            return passOver(word, rest);
        }
        return true;
    }

    bool passOver(std::string_view word, std::string_view rest) {
        if (isAmong(word, kFreeForm))
            file_.warn("Curves and surfaces of the file are not read.", where());
        else if (isAmong(word, kLost) && rest != "off")
            file_.warn("The statement " + std::string(word) + " is ignored.", where());
        return isAmong(word, kFreeForm) || isAmong(word, kLost) || isAmong(word, kHarmless);
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
        if (in_smooth_group_ && face_[0].normal < 0 && !file_.options().smooth_normals &&
            !std::exchange(warned_of_groups_, true))
            file_.warn("Faces without normals are flat, though they are in smoothing groups (s); " +
                           Parameter::kSmoothNormals + " makes them smooth.",
                       where());
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
            throw problem.at(where());
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
            if (second > 0)
                corner.uv = finiteOne(index(word.substr(0, second), uvs_.size(), uvs_seen_), uvs_);
            word.remove_prefix(std::min(second + 1, word.size()));
            if (!word.empty())
                corner.normal = finiteOne(index(word, normals_.size(), normals_seen_), normals_);
            face_.push_back(corner);
        }
        for (auto member : {&Corner::uv, &Corner::normal}) {
            const auto none = std::ranges::count(face_, -1, member);
            if (none == 0 || none == static_cast<std::ptrdiff_t>(face_.size())) continue;
            file_.warn(
                "Some corners of a face have normals or texture coordinates that others "
                "lack; the face is read without them.");
            for (Corner& corner : face_)
                corner.*member = -1;
        }
    }

    /// Returns the index if the value there is finite, else −1.
    template <class Vector>
    static std::int64_t finiteOne(std::int64_t index, const std::vector<Vector>& values) {
        return std::isnan(values[static_cast<std::size_t>(index)].x) ? -1 : index;
    }

    /// Parses an index. Positive indices count from 1; negative indices count back from the last
    /// vertex before this line.
    std::int64_t index(std::string_view word, std::size_t count, std::size_t seen) const {
        const auto number = numberIn<std::int64_t>(word);
        if (!number) fail("expected an index, not \"" + std::string(word.substr(0, 32)) + "\"");
        const auto all = static_cast<std::int64_t>(count);
        const std::int64_t found =
            *number < 0 ? static_cast<std::int64_t>(seen) + std::max(*number, -all - 1)
                        : *number - 1;
        if (*number == 0 || found < 0 || found >= all)
            fail("index " + std::string(word.substr(0, 32)) + " is out of range; there are " +
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
        if (!run_->has_uvs && topology == Topology::kTriangles)
            materials_.useWithoutTexcoords(material_);
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
        if (!colors_.empty()) {
            const bool has_color = place < colors_.size() && colors_[place] != kNoColor;
            primitive_.colors.push_back(has_color ? colors_[place] : glm::vec4(1));
            run_has_colors_ = run_has_colors_ || has_color;
        }
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
        if (!std::exchange(run_has_colors_, false)) primitive_.colors.clear();
        if (!primitive_.indices.empty()) place.mesh.primitives.push_back(std::move(primitive_));
        primitive_ = {};
        corners_ = cornerIndex();
        run_.reset();
    }

    // Building the scene.

    void finishScene() {
        if (odd_faces_ > 0)
            file_.warn("Faces with fewer than three corners are invisible (" +
                       std::to_string(odd_faces_) + ").");
        if (unknown_ > 0 && !is_obj_)
            throw Error(ErrorKind::kInput, "this is not an OBJ file: it has no OBJ statements",
                        first_unknown_, "check that it is the right file");
        if (unknown_ > 0)
            file_.warn("Unknown lines are ignored (" + std::to_string(unknown_) +
                       "; the first: " + first_unknown_ + ").");
        materials_.finish();
        std::map<std::string, int> objects;
        for (Place& place : places_) {
            if (place.mesh.primitives.empty()) continue;
            for (Primitive& primitive : place.mesh.primitives)
                if (primitive.material < 0) primitive.material = plainMaterialOf(primitive);
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

    /// Returns the material for primitives without one: white for vertex colours, else neutral
    /// grey.
    int plainMaterialOf(const Primitive& primitive) {
        return primitive.colors.empty() ? file_.neutralMaterial() : file_.colorMaterial();
    }

    CornerIndex cornerIndex() {
        return CornerIndex([this](std::uint64_t bytes) { file_.allow(bytes); });
    }
    std::string where() const { return file_.name() + ":" + std::to_string(lines_.number()); }
    [[noreturn]] void fail(const std::string& what) const {
        throw Error(ErrorKind::kInput, what, where(), "export the file again");
    }

    static constexpr std::string_view kPaint = "#MRGB";
    static constexpr glm::vec4 kNoColor{-1};
    static constexpr std::size_t kOnce = 4096;  ///< number of elements per memory request
    /// The bytes that an unfinished run takes in addition to its data in the scene.
    static constexpr std::size_t kRunBytes = 4096;
    static constexpr std::size_t kVertexBytes =
        2 * sizeof(glm::vec3) + sizeof(glm::vec2) + sizeof(glm::vec4);

    MeshFile file_;
    std::string_view text_;
    ObjLines lines_{{}};
    ObjMaterials materials_;
    std::vector<glm::vec3> positions_, normals_;
    std::vector<glm::vec2> uvs_;
    /// Colours of the first vertices; kNoColor if a vertex has none.
    std::vector<glm::vec4> colors_;
    /// Colours of the current ZBrush block, which belong to the last vertices.
    std::vector<glm::vec4> paint_;
    std::size_t positions_seen_ = 0, uvs_seen_ = 0, normals_seen_ = 0;
    std::vector<Place> places_ = std::vector<Place>(1);
    std::map<std::pair<std::string, std::optional<std::string>>, std::size_t> place_numbers_{
        {{"", std::nullopt}, 0}};
    std::size_t place_ = 0;
    int material_ = -1;
    bool in_smooth_group_ = false, warned_of_groups_ = false;
    std::optional<Run> run_;
    bool run_has_colors_ = false;
    Primitive primitive_;  ///< primitive of the current run
    CornerIndex corners_;
    PolygonCutter cutter_;
    std::uint64_t vertices_made_ = 0, elements_made_ = 0, odd_faces_ = 0, unknown_ = 0;
    std::uint64_t odd_numbers_ = 0;
    bool is_obj_ = false;  ///< whether any line is valid OBJ
    std::string first_unknown_;
    // Data of the current element.
    std::vector<Corner> face_;
    std::vector<std::uint32_t> vertices_;
    std::vector<glm::vec3> outline_;
};

}  // namespace

/// Whether one of the first lines is certainly OBJ and there are no binary bytes.
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
