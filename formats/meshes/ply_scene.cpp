// SPDX-License-Identifier: Apache-2.0
// Reads a PLY file as a mesh: its faces in order, or without any its vertices as points.
#include <algorithm>
#include <bit>
#include <memory>
#include <optional>

#include "core/base/error.h"
#include "formats/arrays/ply_file.h"
#include "formats/meshes/mesh_parts.h"

namespace peeler {
namespace {

/// What a number of a vertex is.
enum class Meaning : std::uint8_t { kPosition, kNormal, kTexcoord, kColor };

/// The names of the numbers of vertices, as programs write them; the first one of a set counts.
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

constexpr std::string_view kTextureComment = "TextureFile";

class PlyReader {
  public:
    PlyReader(const std::filesystem::path& path, const SceneReadOptions& options)
        : file_(path, options), textures_(file_), ply_(bytesOf(file_), file_.name()) {}

    Scene read() {
        numbers_ = ply_.numbers();
        for (const PlyElement& element : ply_.elements()) {
            row_ = 0;
            try {
                readElement(element);
            } catch (const Error& problem) {
                if (problem.kind() != ErrorKind::kInput || !problem.where().empty()) throw;
                const std::size_t place = file_.bytes().size() - numbers_->left();
                throw Error(ErrorKind::kInput,
                            element.name + " " + std::to_string(row_) + ": " + problem.what(),
                            ply_.isText() ? file_.atLine(place) : file_.atByte(place),
                            problem.hint().empty() ? "export the file again" : problem.hint());
            }
        }
        if (!vertices_read_)
            throw Error(ErrorKind::kInput, "there are no vertices in it", file_.name());
        if (odd_faces_ > 0)
            file_.warn("Faces of fewer than three corners show nothing (" +
                       std::to_string(odd_faces_) + ").");
        finishMesh();
        return file_.finish();
    }

  private:
    static std::span<const std::uint8_t> bytesOf(const MeshFile& file) {
        const std::string_view text = withoutByteOrderMark(file.text());
        return file.bytes().last(text.size());
    }

    void readElement(const PlyElement& element) {
        if (element.properties.empty()) return;
        // Before anything is allocated.
        if (element.rows > numbers_->most(element)) failPlyEndsEarly();
        if (element.name == "vertex" && !vertices_read_) return readVertices(element);
        if (element.name == "face" || element.name == "tristrips") return readFaces(element);
        if (element.rows > 0)
            file_.warn("The element " + element.name + " of the file is not read.");
        for (; row_ < element.rows; ++row_)
            for (const PlyField& property : element.properties)
                numbers_->skip(property);
    }

    // Vertices.

    /// A property, and where its numbers go.
    struct Column {
        const PlyField* property;
        float* to = nullptr;  ///< of the next vertex; null: nowhere
        std::size_t step = 0;
        float greatest = 1;  ///< what stands for 1
    };

    void readVertices(const PlyElement& element) {
        std::array<std::array<const PlyField*, 4>, 4> meant{};
        for (const PlyField& property : element.properties) {
            const auto* const name =
                std::ranges::find(kVertexNames, property.name, &VertexName::name);
            if (property.count || name == std::end(kVertexNames)) continue;
            auto*& place = meant[static_cast<std::size_t>(name->meaning)]
                                [static_cast<std::size_t>(name->component)];
            if (!place) place = &property;
        }
        const auto isWhole = [&](Meaning meaning, std::size_t components) {
            const auto& of = meant[static_cast<std::size_t>(meaning)];
            return std::all_of(of.begin(), of.begin() + static_cast<std::ptrdiff_t>(components),
                               [](const PlyField* property) { return property; });
        };
        if (!isWhole(Meaning::kPosition, 3))
            throw Error(ErrorKind::kInput, "vertices have no x, y and z", file_.name());
        const auto rows = static_cast<std::size_t>(element.rows);
        const auto make = [&](auto& values, auto initial) {
            file_.allowGeometry(rows * sizeof initial);
            values.assign(rows, initial);
        };
        make(mesh_.positions, glm::vec3(0));
        if (isWhole(Meaning::kNormal, 3)) make(mesh_.normals, glm::vec3(0));
        if (isWhole(Meaning::kTexcoord, 2)) make(mesh_.texcoords[0], glm::vec2(0));
        if (isWhole(Meaning::kColor, 3)) make(mesh_.colors, glm::vec4(1));

        std::vector<Column> columns;
        for (const PlyField& property : element.properties)
            columns.push_back(columnOf(property, meant));
        for (; row_ < element.rows; ++row_) {
            for (Column& column : columns) {
                if (!column.to) {
                    numbers_->skip(*column.property);
                    continue;
                }
                *column.to = finite(numbers_->next(*column.property->type)) / column.greatest;
                column.to += column.step;
            }
        }
        for (glm::vec4& color : mesh_.colors) {
            color = linearColor(color);
            translucent_ = translucent_ || color.a < 1;
        }
        for (glm::vec2& uv : mesh_.texcoords[0])
            uv.y = 1 - uv.y;  // it counts from below, glTF's from above
        vertices_read_ = true;
    }

    Column columnOf(const PlyField& property,
                    const std::array<std::array<const PlyField*, 4>, 4>& meant) {
        for (std::size_t meaning = 0; meaning < meant.size(); ++meaning) {
            for (std::size_t i = 0; i < meant[meaning].size(); ++i) {
                if (meant[meaning][i] != &property) continue;
                const auto column = [&](auto& values) -> Column {
                    if (values.empty()) return {&property};
                    const bool is_color = meaning == static_cast<std::size_t>(Meaning::kColor);
                    return {&property, &values[0][static_cast<int>(i)],
                            sizeof values[0] / sizeof(float),
                            is_color ? static_cast<float>(property.type->greatest) : 1};
                };
                switch (static_cast<Meaning>(meaning)) {
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
        }
        return {&property};
    }

    static float finite(double value) {
        const auto number = coordinate(value);
        if (!number)
            throw Error(ErrorKind::kInput, "a number is infinite, not a number, or too large", "",
                        "leave such vertices out");
        return *number;
    }

    // Faces.

    void readFaces(const PlyElement& element) {
        if (!vertices_read_) throw Error(ErrorKind::kInput, "the faces stand before the vertices");
        const bool strips = element.name == "tristrips";
        const PlyField* corners = nullptr;
        const PlyField* uvs = nullptr;
        for (const PlyField& property : element.properties) {
            if (!property.count) continue;
            if (property.name == "vertex_indices" || property.name == "vertex_index")
                corners = &property;
            else if (property.name == "texcoord" && !strips)
                uvs = &property;
        }
        if (!corners) throw Error(ErrorKind::kInput, "faces have no list vertex_indices");
        if (std::ranges::any_of(element.properties,
                                [](const PlyField& p) { return p.name == "red"; }))
            file_.warn("Colours of faces are not read.");
        if (uvs && !split_) split_.emplace([this](std::uint64_t bytes) { file_.allow(bytes); });
        for (; row_ < element.rows; ++row_) {
            face_.clear();
            uvs_.clear();
            for (const PlyField& property : element.properties) {
                if (&property == corners)
                    readCorners(property, strips);
                else if (&property == uvs)
                    readUvs(property);
                else
                    numbers_->skip(property);
            }
            if (uvs && uvs_.size() != face_.size())
                throw Error(ErrorKind::kInput, "a face has another number of texture coordinates");
            if (strips)
                addStrips();
            else
                addFace();
        }
    }

    void readCorners(const PlyField& list, bool strips) {
        const std::uint64_t count = numbers_->length(list);
        const double vertices = static_cast<double>(mesh_.positions.size());
        face_.reserve(count);
        for (std::uint64_t i = 0; i < count; ++i) {
            const double index = numbers_->next(*list.type);
            if (strips && index == -1) {
                face_.push_back(kEndOfStrip);
                continue;
            }
            if (!(index >= 0 && index < vertices))
                throw Error(ErrorKind::kInput, "it names vertex " + numberText(index) + " of " +
                                                   std::to_string(mesh_.positions.size()));
            face_.push_back(static_cast<std::uint32_t>(index));
        }
    }

    static std::string numberText(double number) {
        std::string text = std::to_string(number);
        return text.substr(0, text.find(".000000"));
    }

    void readUvs(const PlyField& list) {
        const std::uint64_t count = numbers_->length(list);
        for (std::uint64_t i = 0; i + 1 < count; i += 2) {
            const float u = finite(numbers_->next(*list.type));
            uvs_.emplace_back(u, 1 - finite(numbers_->next(*list.type)));
        }
        if (count % 2 == 1) numbers_->skip(*list.type, 1);
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

    /// Every corner of a strip but its first two is a triangle; every second one is turned.
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

    /// Of corners of the face by their places in it.
    void addTriangle(std::size_t a, std::size_t b, std::size_t c) {
        if (mesh_.indices.size() % (3 * kOnce) == 0)
            file_.allowGeometry(3 * kOnce * sizeof(std::uint32_t));
        for (const std::size_t corner : {a, b, c})
            mesh_.indices.push_back(split_ ? splitCorner(corner) : face_[corner]);
    }

    std::uint32_t splitCorner(std::size_t corner) {
        const glm::vec2 uv = uvs_.empty() ? glm::vec2(0, 1) : uvs_[corner];
        const auto bits = std::bit_cast<std::array<std::uint32_t, 2>>(uv);
        return split_->indexOf({face_[corner], bits[0], bits[1]});
    }

    // The mesh.

    /// The vertices of corners that have texture coordinates of their own.
    void splitVertices() {
        const std::vector<CornerIndex::Key>& keys = split_->keys();
        const auto gather = [&](auto& values) {
            if (values.empty()) return;
            file_.allowGeometry(keys.size() * sizeof values[0]);
            std::remove_reference_t<decltype(values)> gathered;
            gathered.reserve(keys.size());
            for (const CornerIndex::Key& key : keys)
                gathered.push_back(values[key[0]]);
            values.swap(gathered);
        };
        gather(mesh_.positions);
        gather(mesh_.normals);
        gather(mesh_.colors);
        file_.allowGeometry(keys.size() * sizeof(glm::vec2));
        mesh_.texcoords[0].clear();
        for (const CornerIndex::Key& key : keys)
            mesh_.texcoords[0].push_back(
                std::bit_cast<glm::vec2>(std::array<std::uint32_t, 2>{key[1], key[2]}));
    }

    /// The texture that a comment names, as MeshLab writes it.
    TextureRef texture() {
        for (std::string_view comment : ply_.comments()) {
            if (!comment.starts_with(kTextureComment)) continue;
            MeshMap map;
            map.file = comment.substr(std::min(kTextureComment.size() + 1, comment.size()));
            map.where = file_.name();
            return textures_.texture(map);
        }
        return {};
    }

    void finishMesh() {
        if (split_) splitVertices();
        const bool has_faces = !mesh_.indices.empty();
        mesh_.topology = has_faces ? Topology::kTriangles : Topology::kPoints;
        const TextureRef image = mesh_.texcoords[0].empty() ? TextureRef{} : texture();
        if (mesh_.colors.empty() && !image) {
            mesh_.material = file_.neutralMaterial();
        } else {
            Material material = plainMaterial(image ? "texture" : "colours", glm::vec4(1));
            material.base_color_texture = image;
            if (translucent_) material.alpha_mode = AlphaMode::kBlend;
            mesh_.material = static_cast<int>(file_.scene().materials.size());
            file_.scene().materials.push_back(material);
        }
        Mesh mesh;
        if (!mesh_.positions.empty()) mesh.primitives.push_back(std::move(mesh_));
        file_.addNode(file_.stem(), std::move(mesh));
    }

    static constexpr std::uint32_t kEndOfStrip = 0xFFFFFFFF;
    static constexpr std::size_t kOnce = 4096;  ///< triangles that are asked for together

    MeshFile file_;
    MeshTextures textures_;
    PlyFile ply_;
    std::unique_ptr<PlyNumbers> numbers_;
    std::uint64_t row_ = 0;
    Primitive mesh_;
    bool vertices_read_ = false, translucent_ = false;
    std::uint64_t odd_faces_ = 0;
    PolygonCutter cutter_;
    std::optional<CornerIndex> split_;  ///< if corners have texture coordinates
    // Of the face that is read.
    std::vector<std::uint32_t> face_;
    std::vector<glm::vec2> uvs_;
    std::vector<glm::vec3> outline_;
};

}  // namespace

Scene readPlyScene(const std::filesystem::path& path, const SceneReadOptions& options) {
    return PlyReader(path, options).read();
}

}  // namespace peeler
