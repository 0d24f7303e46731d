// SPDX-License-Identifier: Apache-2.0
// Reader of PLY meshes: the faces in order or, without faces, the vertices as points.
#include <algorithm>
#include <bit>
#include <map>
#include <memory>
#include <optional>

#include <peeler/error.h>
#include "formats/file/text_words.h"
#include "formats/meshes/ply_elements.h"

namespace peeler {
namespace {

/// The meaning of a vertex property.
enum class Meaning : std::uint8_t { kPosition, kNormal, kTexcoord, kColor };

/// A name of a vertex property, as written by some programs. If a file has several names for a
/// meaning, the first name in the table is used.
struct VertexName {
    std::string_view name;
    Meaning meaning;
    int component;
};
constexpr VertexName kVertexNames[] = {
    {"x", Meaning::kPosition, 0},
    {"y", Meaning::kPosition, 1},
    {"z", Meaning::kPosition, 2},
    {"nx", Meaning::kNormal, 0},
    {"ny", Meaning::kNormal, 1},
    {"nz", Meaning::kNormal, 2},
    {"s", Meaning::kTexcoord, 0},
    {"t", Meaning::kTexcoord, 1},
    {"u", Meaning::kTexcoord, 0},
    {"v", Meaning::kTexcoord, 1},
    {"texture_u", Meaning::kTexcoord, 0},
    {"texture_v", Meaning::kTexcoord, 1},
    {"texture_s", Meaning::kTexcoord, 0},
    {"texture_t", Meaning::kTexcoord, 1},
    {"red", Meaning::kColor, 0},
    {"green", Meaning::kColor, 1},
    {"blue", Meaning::kColor, 2},
    {"alpha", Meaning::kColor, 3},
    {"r", Meaning::kColor, 0},
    {"g", Meaning::kColor, 1},
    {"b", Meaning::kColor, 2},
    {"a", Meaning::kColor, 3},
    {"diffuse_red", Meaning::kColor, 0},
    {"diffuse_green", Meaning::kColor, 1},
    {"diffuse_blue", Meaning::kColor, 2},
    {"diffuse_alpha", Meaning::kColor, 3},
};

/// A meaning's property names for messages, and the number of components that it requires.
struct MeaningRow {
    const char* names;
    std::size_t components;
};
constexpr MeaningRow kMeanings[] = {
    {"x, y and z", 3}, {"nx, ny and nz", 3}, {"s and t (u and v)", 2}, {"red, green and blue", 3}};

/// The properties of an element by meaning and component; null for missing ones.
using Meant = std::array<std::array<const PlyField*, 4>, std::size(kMeanings)>;

Meant meantBy(const PlyElement& element) {
    Meant meant{};
    for (const PlyField& property : element.properties) {
        const auto* const name = std::ranges::find(kVertexNames, property.name, &VertexName::name);
        if (property.count || name == std::end(kVertexNames)) continue;
        auto*& place = meant[static_cast<std::size_t>(name->meaning)]
                            [static_cast<std::size_t>(name->component)];
        if (!place) place = &property;
    }
    return meant;
}

bool isWhole(const Meant& meant, Meaning meaning) {
    const auto i = static_cast<std::size_t>(meaning);
    return std::all_of(meant[i].begin(),
                       meant[i].begin() + static_cast<std::ptrdiff_t>(kMeanings[i].components),
                       [](const PlyField* property) { return property; });
}

ColorTypes colorTypesOf(const Meant& meant) {
    const auto& color = meant[static_cast<std::size_t>(Meaning::kColor)];
    return {color[0]->type->greatest, color[3] ? color[3]->type->greatest : 1};
}

bool isFaces(const PlyElement& element) {
    return element.name == "face" || element.name == "tristrips";
}

constexpr std::string_view kTextureComment = "TextureFile", kTextureNumber = "texnumber";

class PlyReader {
  public:
    PlyReader(const std::filesystem::path& path, const SceneReadOptions& options)
        : file_(path, options), textures_(file_), elements_(file_), uv_numbers_(cornerIndex()) {}

    Scene read() {
        listTextures();
        elements_.read([&](const PlyElement& element) { return readElement(element); });
        warnOf(odd_faces_, "Faces with fewer than three corners are invisible");
        warnOf(bare_faces_, "Some faces have no texture coordinates");
        warnOf(odd_numbers_, "Numbers of faces that are infinite or NaN are taken as 0");
        finishMesh();
        return file_.finish();
    }

  private:
    void warnOf(std::uint64_t count, const std::string& what) {
        if (count > 0) file_.warn(what + " (" + std::to_string(count) + ").");
    }

    /// Lists the textures in MeshLab's comments, and determines whether faces choose among them.
    void listTextures() {
        for (std::string_view comment : elements_.header().comments()) {
            if (!comment.starts_with(kTextureComment)) continue;
            MeshMap& map = texture_maps_.emplace_back();
            map.file = trimmed(comment.substr(kTextureComment.size()));
            map.where = file_.name();
        }
        bool choose = false;
        for (const PlyElement& element : elements_.header().elements()) {
            if (!isFaces(element)) continue;
            const bool has_number = propertyNamed(element, kTextureNumber);
            choose = choose || has_number;
            has_corner_uvs_ = has_corner_uvs_ || propertyNamed(element, "texcoord");
            if (has_number || has_corner_uvs_ || isWhole(meantBy(element), Meaning::kColor))
                split_.emplace(cornerIndex());
        }
        if (texture_maps_.size() > 1 && !choose)
            file_.warn(
                "The file names several textures, and faces do not say which one "
                "(texnumber): all use the first one.");
    }

    bool readElement(const PlyElement& element) {
        if (element.name == "vertex" && !vertices_read_) {
            readVertices(element);
            return true;
        }
        if (isFaces(element)) readFaces(element);
        return isFaces(element);
    }

    // Reading of vertices.

    /// A property, and the destination of its values.
    struct Column {
        const PlyField* property;
        float* to = nullptr;  ///< destination for the next vertex; null if the property is skipped
        std::size_t step = 0;
        Meaning meaning{};
    };

    void readVertices(const PlyElement& element) {
        const Meant meant = meantBy(element);
        if (!isWhole(meant, Meaning::kPosition))
            throw Error(ErrorKind::kInput, "vertices have no x, y and z", file_.name());
        checkMeanings(element, meant);
        const auto rows = static_cast<std::size_t>(element.rows);
        const auto make = [&](Meaning meaning, auto& values, auto initial) {
            if (!isWhole(meant, meaning)) return;
            file_.allowGeometry(rows * sizeof initial);
            values.assign(rows, initial);
        };
        make(Meaning::kPosition, mesh_.positions, glm::vec3(0));
        make(Meaning::kNormal, mesh_.normals, glm::vec3(0));
        make(Meaning::kTexcoord, mesh_.texcoords[0], glm::vec2(0));
        make(Meaning::kColor, mesh_.colors, glm::vec4(1));

        std::vector<Column> columns;
        for (const PlyField& property : element.properties)
            columns.push_back(columnOf(property, meant));
        std::array<std::uint64_t, std::size(kMeanings)> odd{};
        for (; elements_.row < element.rows; ++elements_.row) {
            for (Column& column : columns) {
                if (!column.to) {
                    elements_.numbers().skip(*column.property);
                    continue;
                }
                const double value = elements_.numbers().next(*column.property->type);
                if (column.meaning == Meaning::kPosition) {
                    *column.to = finite(value);
                } else {
                    const auto found = coordinate(value);
                    if (!found) ++odd[static_cast<std::size_t>(column.meaning)];
                    *column.to = found.value_or(0);
                }
                column.to += column.step;
            }
        }
        finishVertices(meant, odd);
    }

    /// Warns about properties that cannot be used as intended.
    void checkMeanings(const PlyElement& element, const Meant& meant) {
        for (std::size_t i = 0; i < std::size(kMeanings); ++i)
            if (!isWhole(meant, static_cast<Meaning>(i)))
                for (const PlyField* const property : meant[i])
                    if (property)
                        file_.warn("Vertices have " + property->name + ", but not all of " +
                                   kMeanings[i].names + ": " + property->name + " is left out.");
        std::string splats;
        for (const char* name : {"f_dc_0", "opacity", "scale_0", "rot_0"})
            if (propertyNamed(element, name))
                splats += (splats.empty() ? "" : ", ") + std::string(name);
        if (propertyNamed(element, "f_dc_0") ||
            (propertyNamed(element, "scale_0") && propertyNamed(element, "rot_0")))
            file_.warn("The points have some properties of Gaussian splats (" + splats +
                       "), but not all of them: they are shown as plain points.");
    }

    void finishVertices(const Meant& meant,
                        const std::array<std::uint64_t, std::size(kMeanings)>& odd) {
        for (std::size_t i = 0; i < odd.size(); ++i) {
            if (odd[i] == 0) continue;
            const bool normals = i == static_cast<std::size_t>(Meaning::kNormal);
            if (normals) mesh_.normals.clear();
            file_.warn("Numbers of " + std::string(kMeanings[i].names) + " are infinite or NaN (" +
                       std::to_string(odd[i]) +
                       "): " + (normals ? "the normals are left out." : "they are taken as 0."));
        }
        if (!mesh_.colors.empty()) makeColorsLinear(mesh_.colors, colorTypesOf(meant));
        for (glm::vec2& uv : mesh_.texcoords[0])
            uv.y = 1 - uv.y;  // V increases upwards in PLY, and downwards in glTF
        vertices_read_ = true;
    }

    void makeColorsLinear(std::vector<glm::vec4>& colors, const ColorTypes& types) {
        if (!makeLinear(colors, types))
            file_.warn("Colours outside the range of their type are clamped.");
        translucent_ = translucent_ || std::ranges::any_of(colors, [](const glm::vec4& color) {
                           return color.a < 1;
                       });
    }

    Column columnOf(const PlyField& property, const Meant& meant) {
        for (std::size_t i = 0; i < meant.size(); ++i) {
            const auto place = std::ranges::find(meant[i], &property);
            if (place == meant[i].end()) continue;
            const auto meaning = static_cast<Meaning>(i);
            const auto column = [&](auto& values) -> Column {
                if (values.empty()) return {&property};
                return {&property, &values[0][static_cast<int>(place - meant[i].begin())],
                        sizeof values[0] / sizeof(float), meaning};
            };
            switch (meaning) {
                case Meaning::kPosition:
                    return column(mesh_.positions);
                case Meaning::kNormal:
                    return column(mesh_.normals);
                case Meaning::kTexcoord:
                    return column(mesh_.texcoords[0]);
                case Meaning::kColor:
                    return column(mesh_.colors);
            }
        }
        return {&property};
    }

    static float finite(double value) {
        const auto number = coordinate(value);
        if (!number)
            throw Error(ErrorKind::kInput, "a number is infinite, NaN or too large", "",
                        "leave such vertices out");
        return *number;
    }

    /// Converts a value of a face to float; values that are not finite become 0.
    float finiteOrZero(double value) {
        const auto number = coordinate(value);
        if (!number) ++odd_numbers_;
        return number.value_or(0);
    }

    // Reading of faces.

    /// The meaning of a face property.
    struct FaceColumn {
        enum Role : std::uint8_t { kCorners, kTexcoords, kTexture, kColor, kSkipped } role;
        const PlyField* property;
        int component = 0;  ///< component of a colour
    };

    void readFaces(const PlyElement& element) {
        if (!vertices_read_) throw Error(ErrorKind::kInput, "the faces come before the vertices");
        const bool strips = element.name == "tristrips";
        const Meant meant = meantBy(element);
        const bool has_colors = hasColors(meant);
        std::vector<FaceColumn> columns;
        for (const PlyField& property : element.properties)
            columns.push_back(faceColumnOf(property, meant, has_colors));
        if (std::ranges::find(columns, FaceColumn::kCorners, &FaceColumn::role) == columns.end())
            throw Error(ErrorKind::kInput, "faces have no list vertex_indices");
        const bool has_uvs =
            std::ranges::find(columns, FaceColumn::kTexcoords, &FaceColumn::role) != columns.end();
        color_ = kNoColor;
        for (; elements_.row < element.rows; ++elements_.row) {
            face_.clear();
            uvs_.clear();
            texture_ = 0;
            glm::vec4 color(0, 0, 0, 1);
            for (const FaceColumn& column : columns)
                readColumn(column, strips, color);
            if (has_uvs && uvs_.empty() && !face_.empty())
                ++bare_faces_;
            else if (has_uvs && uvs_.size() != face_.size())
                throw Error(ErrorKind::kInput,
                            "a face has more or fewer texture coordinates than corners");
            if (has_colors) addFaceColor(color);
            openRun();
            if (strips)
                addStrips();
            else
                addFace();
        }
    }

    /// Whether to use the colours of faces. Vertex colours take precedence over them.
    bool hasColors(const Meant& meant) {
        if (!isWhole(meant, Meaning::kColor)) return false;
        if (!mesh_.colors.empty())
            file_.warn("Colours of faces are left out, since vertices have colours, too.");
        else
            face_color_types_ = colorTypesOf(meant);
        return mesh_.colors.empty();
    }

    static FaceColumn faceColumnOf(const PlyField& property, const Meant& meant, bool has_colors) {
        if (property.name == "vertex_indices" || property.name == "vertex_index")
            return {property.count ? FaceColumn::kCorners : FaceColumn::kSkipped, &property};
        if (property.name == "texcoord" && property.count)
            return {FaceColumn::kTexcoords, &property};
        if (property.name == kTextureNumber && !property.count)
            return {FaceColumn::kTexture, &property};
        const auto& color = meant[static_cast<std::size_t>(Meaning::kColor)];
        const auto place = std::ranges::find(color, &property);
        if (has_colors && place != color.end())
            return {FaceColumn::kColor, &property, static_cast<int>(place - color.begin())};
        return {FaceColumn::kSkipped, &property};
    }

    void readColumn(const FaceColumn& column, bool strips, glm::vec4& color) {
        switch (column.role) {
            case FaceColumn::kCorners:
                return readCorners(*column.property, strips);
            case FaceColumn::kTexcoords:
                return readUvs(*column.property);
            case FaceColumn::kTexture:
                texture_ = textureOf(elements_.numbers().next(*column.property->type));
                return;
            case FaceColumn::kColor:
                color[column.component] =
                    finiteOrZero(elements_.numbers().next(*column.property->type));
                return;
            case FaceColumn::kSkipped:
                elements_.numbers().skip(*column.property);
        }
    }

    /// Returns the index of a face's texture; −1 for none.
    int textureOf(double number) {
        if (number >= 0 && number < static_cast<double>(texture_maps_.size()))
            return static_cast<int>(number);
        if (number >= 0 && !texture_maps_.empty())
            file_.warn("Faces use a missing texture (texnumber " + numberText(number) + " of " +
                       std::to_string(texture_maps_.size()) + ").");
        return -1;
    }

    void addFaceColor(const glm::vec4& color) {
        if (!face_colors_.empty() && color_ != kNoColor && face_colors_.back() == color) return;
        if (face_colors_.size() % kOnce == 0) file_.allowGeometry(kOnce * sizeof color);
        color_ = static_cast<std::uint32_t>(face_colors_.size());
        face_colors_.push_back(color);
    }

    void readCorners(const PlyField& list, bool strips) {
        const std::uint64_t count = elements_.numbers().length(list);
        const double vertices = static_cast<double>(mesh_.positions.size());
        face_.reserve(count);
        for (std::uint64_t i = 0; i < count; ++i) {
            const double index = elements_.numbers().next(*list.type);
            if (strips && index == -1) {
                face_.push_back(kEndOfStrip);
                continue;
            }
            if (!(index >= 0 && index < vertices))
                throw Error(ErrorKind::kInput,
                            "vertex " + numberText(index) + " is out of range; there are " +
                                std::to_string(mesh_.positions.size()) + " vertices");
            face_.push_back(static_cast<std::uint32_t>(index));
        }
    }

    static std::string numberText(double number) {
        std::string text = std::to_string(number);
        return text.substr(0, text.find(".000000"));
    }

    void readUvs(const PlyField& list) {
        const std::uint64_t count = elements_.numbers().length(list);
        for (std::uint64_t i = 0; i + 1 < count; i += 2) {
            const float u = finiteOrZero(elements_.numbers().next(*list.type));
            uvs_.emplace_back(u, 1 - finiteOrZero(elements_.numbers().next(*list.type)));
        }
        if (count % 2 == 1) elements_.numbers().skip(*list.type, 1);
    }

    void addFace() {
        if (face_.size() < 3) ++odd_faces_;
        if (face_.size() == 3) {
            addTriangle(0, 1, 2);
            return;
        }
        outline_.clear();
        for (const std::uint32_t corner : face_)
            outline_.push_back(mesh_.positions[corner]);
        for (const auto& [a, b, c] : cutter_.cut(outline_))
            addTriangle(a, b, c);
    }

    /// Adds the triangles of the strips in face_: one for each corner after a strip's first two.
    /// Reverses every second triangle.
    void addStrips() {
        std::size_t first = 0;
        for (std::size_t i = 0; i < face_.size(); ++i) {
            if (face_[i] == kEndOfStrip) {
                first = i + 1;
            } else if (i >= first + 2) {
                const bool turned = (i - first) % 2 == 1;
                addTriangle(turned ? i - 1 : i - 2, turned ? i - 2 : i - 1, i);
            }
        }
    }

    /// Adds a triangle; its corners are given as indices into face_.
    void addTriangle(std::size_t a, std::size_t b, std::size_t c) {
        if (triangles_made_++ % kOnce == 0) file_.allowGeometry(3 * kOnce * sizeof(std::uint32_t));
        for (const std::size_t corner : {a, b, c})
            runs_.back().mesh.indices.push_back(split_ ? splitCorner(corner) : face_[corner]);
    }

    std::uint32_t splitCorner(std::size_t corner) {
        const glm::vec2 uv = uvs_.empty() ? glm::vec2(0, 1) : uvs_[corner];
        const auto bits = std::bit_cast<std::array<std::uint32_t, 2>>(uv);
        return split_->indexOf({face_[corner], uv_numbers_.indexOf({bits[0], bits[1], 0}), color_});
    }

    // Building the mesh.

    /// Consecutive triangles with the same texture, which become a primitive.
    struct Run {
        int texture = 0;
        Primitive mesh{};
        std::vector<std::uint32_t> colors{};  ///< index in face_colors_ of each vertex's colour
    };

    /// Starts a new run if the texture of the face differs from that of the previous face.
    void openRun() {
        if (!runs_.empty() && runs_.back().texture == texture_) return;
        closeRun();
        // The bytes that an unfinished run takes in addition to its data in the scene.
        constexpr std::size_t kRunBytes = 4096;
        file_.allow(sizeof(Run) + kRunBytes);
        runs_.push_back({texture_});
    }

    /// Gives the run its vertices: all vertices of the file or, if split_, the run's distinct
    /// corners.
    void closeRun() {
        if (runs_.empty()) return;
        Run& run = runs_.back();
        if (run.mesh.indices.empty()) {
            runs_.pop_back();
            return;
        }
        if (!split_) {
            mesh_.indices = std::move(run.mesh.indices);
            run.mesh = std::move(mesh_);
            return;
        }
        const std::vector<CornerIndex::Key>& keys = split_->keys();
        const auto gather = [&](const auto& from, auto& to) {
            if (from.empty()) return;
            file_.allowGeometry(keys.size() * sizeof from[0]);
            to.reserve(keys.size());
            for (const CornerIndex::Key& key : keys)
                to.push_back(from[key[0]]);
        };
        gather(mesh_.positions, run.mesh.positions);
        gather(mesh_.normals, run.mesh.normals);
        gather(mesh_.colors, run.mesh.colors);
        if (has_corner_uvs_) {
            file_.allowGeometry(keys.size() * sizeof(glm::vec2));
            for (const CornerIndex::Key& key : keys) {
                const CornerIndex::Key& uv = uv_numbers_.keys()[key[1]];
                run.mesh.texcoords[0].push_back(
                    std::bit_cast<glm::vec2>(std::array<std::uint32_t, 2>{uv[0], uv[1]}));
            }
        } else {
            gather(mesh_.texcoords[0], run.mesh.texcoords[0]);
        }
        if (!face_colors_.empty()) {
            file_.allowGeometry(keys.size() * (sizeof(glm::vec4) + sizeof(std::uint32_t)));
            for (const CornerIndex::Key& key : keys)
                run.colors.push_back(key[2]);
        }
        split_.emplace(cornerIndex());
    }

    int material(const Primitive& mesh, int texture) {
        TextureRef image;
        if (texture >= 0 && !mesh.texcoords[0].empty() && !texture_maps_.empty())
            image = textures_.texture(texture_maps_[static_cast<std::size_t>(texture)]);
        if (!image && mesh.colors.empty()) return file_.neutralMaterial();
        std::vector<Material>& materials = file_.scene().materials;
        int number = 0;
        if (!image) {
            number = file_.colorMaterial();
        } else if (const auto known = materials_.find(image.image); known != materials_.end()) {
            number = known->second;
        } else {
            number = materials_[image.image] = static_cast<int>(materials.size());
            materials.push_back(plainMaterial("texture", glm::vec4(1)));
            materials.back().base_color_texture = image;
        }
        if (translucent_)
            materials[static_cast<std::size_t>(number)].alpha_mode = AlphaMode::kBlend;
        return number;
    }

    void finishMesh() {
        closeRun();
        if (!face_colors_.empty()) makeColorsLinear(face_colors_, face_color_types_);
        if (runs_.empty() && !mesh_.positions.empty()) {
            mesh_.topology = Topology::kPoints;
            runs_.push_back({0, std::move(mesh_)});
        }
        if (!texture_maps_.empty() &&
            std::ranges::all_of(runs_, [](const Run& r) { return r.mesh.texcoords[0].empty(); }))
            file_.warn(
                "The textures of the file are not shown, since there are no texture coordinates.");
        Mesh mesh;
        for (Run& run : runs_) {
            for (const std::uint32_t color : run.colors)
                run.mesh.colors.push_back(color == kNoColor ? glm::vec4(1) : face_colors_[color]);
            run.mesh.material = material(run.mesh, run.texture);
            mesh.primitives.push_back(std::move(run.mesh));
        }
        file_.addNode(file_.stem(), std::move(mesh));
    }

    CornerIndex cornerIndex() {
        return CornerIndex([this](std::uint64_t bytes) { file_.allow(bytes); });
    }

    static constexpr std::uint32_t kNoColor = 0xFFFFFFFF;
    static constexpr std::uint32_t kEndOfStrip = 0xFFFFFFFF;
    static constexpr std::size_t kOnce = 4096;  ///< number of triangles per memory request

    MeshFile file_;
    MeshTextures textures_;
    PlyElements elements_;
    Primitive mesh_;  ///< the file's vertices; without split_, the only run takes them
    bool vertices_read_ = false, translucent_ = false;
    std::uint64_t triangles_made_ = 0;
    std::uint64_t odd_faces_ = 0, bare_faces_ = 0, odd_numbers_ = 0;
    PolygonCutter cutter_;
    /// The distinct corners of the current run. Has a value if the corners at a vertex may differ,
    /// or if faces have texture numbers.
    std::optional<CornerIndex> split_;
    CornerIndex uv_numbers_;
    bool has_corner_uvs_ = false;
    /// Colours of faces. Consecutive faces with the same colour share an entry.
    std::vector<glm::vec4> face_colors_;
    ColorTypes face_color_types_;
    std::vector<MeshMap> texture_maps_;
    std::map<int, int> materials_;  ///< material of each image
    std::vector<Run> runs_;
    // Data of the current face.
    int texture_ = 0;
    std::uint32_t color_ = kNoColor;
    std::vector<std::uint32_t> face_;
    std::vector<glm::vec2> uvs_;
    std::vector<glm::vec3> outline_;
};

}  // namespace

Scene readPlyScene(const std::filesystem::path& path, const SceneReadOptions& options) {
    return PlyReader(path, options).read();
}

}  // namespace peeler
