// SPDX-License-Identifier: Apache-2.0
// Reader of 3MF (3MF Consortium, "3D Manufacturing Format", Core Specification 1.3, Materials and
// Properties Extension 1.2). lib3mf reads the package in a separate process, peeler_3mf, because
// lib3mf and libzip may fail on hostile packages. The build items become root nodes, and components
// nodes below them; each object is one mesh, whose triangle k is triangle k in the file.
#include <algorithm>
#include <bit>
#include <cmath>
#include <utility>

#include <peeler/error.h>
#include "core/base/printable.h"
#include "formats/arrays/array_reader.h"
#include "formats/file/helper_process.h"
#include "formats/file/module.h"
#include "formats/meshes/mesh_parts.h"
#include "formats/meshes/threemf_model.h"

namespace peeler {
namespace {

constexpr char kThreeMfHint[] = "export the file again, or as STL";

/// The units of a 3MF, in metres: micron, millimeter, centimeter, inch, foot, meter.
constexpr double kThreeMfUnits[] = {1e-6, 1e-3, 1e-2, 0.0254, 0.3048, 1};

struct LostContent {
    ThreeMfLost what;
    const char* message;  ///< follows the object's name
    bool hides;           ///< whether the object is not shown at all
};
constexpr LostContent kLostContents[] = {
    {kThreeMfSupport, "is a support, and is not shown", true},
    {kThreeMfOther, "is of type \"other\", and is not shown", true},
    {kThreeMfTextures, "has textures, which are not read", false},
    {kThreeMfBeams, "has a beam lattice, which is not shown", false},
    {kThreeMfSlices, "has slices, which are not read", false},
    {kThreeMfUnknownProperties, "has properties that the file does not define", false},
};

/// The content of an object, and its mesh in the scene.
struct StoredObject {
    ThreeMfObject record;
    std::string name;
    std::vector<ThreeMfVertex> vertices;
    std::vector<ThreeMfTriangle> triangles;
    std::vector<std::uint32_t> properties;
    std::vector<ThreeMfColor> colors;  ///< three per triangle, or none
    std::vector<ThreeMfPlacement> components;
    int mesh = -1;          ///< index of the mesh in the scene
    bool is_known = false;  ///< whether the mesh has been added, and lost content reported
    bool is_hidden = false;
};

class ThreeMfReader {
  public:
    ThreeMfReader(const std::filesystem::path& path, const SceneReadOptions& options)
        : file_(path, options) {}

    Scene read() {
        try {
            SharedFile model = unpack();
            const auto unit = model.takeOne<std::uint32_t>();
            check(unit < std::size(kThreeMfUnits));
            for (const std::string& warning : takeTexts(model))
                file_.warn(warning);
            takeMaterials(model);
            takeObjects(model);
            const glm::dmat4 place = placeOf(Axis::kZ, kThreeMfUnits[unit]);
            const auto items = model.takeOne<std::uint32_t>();
            for (const ThreeMfPlacement& item : takePlacements(model, items, objects_.size()))
                addNode(item, place, -1, 1);
        } catch (const Error& error) {
            if (!error.where().empty()) throw;
            throw Error(error.kind(), error.whatText(), file_.name(),
                        error.hintText().empty() ? Text(kThreeMfHint) : error.hintText());
        }
        if (file_.scene().nodes.empty()) file_.addNode(file_.stem(), {});
        return file_.finish();
    }

  private:
    /// Throws Error (kInput) if the process returned what lib3mf never returns.
    static void check(bool holds) {
        if (!holds) throw Error(ErrorKind::kInput, "the model is damaged");
    }

    /// Checks the package's directory, and returns its unpacked size in bytes.
    std::uint64_t unpackedSize() const {
        // Models have 5 to 20 times the size of their package.
        constexpr std::uint64_t kMostRatio = 200, kLeast = std::uint64_t{1} << 20;
        const NpzArchive package(file_.bytes(), file_.name(), ".3mf");
        const std::uint64_t most =
            std::min(file_.options().max_file_bytes, kLeast + kMostRatio * file_.bytes().size());
        std::uint64_t size = 0;
        bool has_model = false;
        for (const NpzArchive::Member& member : package.members()) {
            if (member.name.ends_with("keystore.xml") || (member.flags & 1U) != 0)
                throw Error(ErrorKind::kInput, "the file is encrypted (3MF secure content)", "",
                            "export it without encryption");
            has_model = has_model || member.name.ends_with(".model");
            if (member.size > most - size)
                throw Error(ErrorKind::kInput,
                            "the file unpacks to more than " + std::to_string(most) + " bytes");
            size += member.size;
        }
        if (!has_model)
            throw Error(ErrorKind::kInput, "this ZIP archive is not a 3MF: it holds no .model file",
                        "", "unpack it, and give a file in it");
        return size;
    }

    SharedFile unpack() {
        // lib3mf 1.8 parses a large mesh at 100 MB per second, and takes less than a byte per byte.
        // Each object takes 10 kB more, and time in proportion to the number of objects: 5,000
        // objects take 4 s.
        constexpr std::uint64_t kBytesASecond = 10'000'000, kLeastSeconds = 5, kOfByte = 8;
        const std::uint64_t size = unpackedSize();
        ThreeMfLimits limits;
        limits.needed = (std::uint64_t{256} << 20) + kOfByte * (size + file_.bytes().size());
        limits.bytes = std::min(limits.needed, file_.memoryLeft());
        SharedFile request;
        request.putOne(limits);
        request.put(file_.bytes());
        request.seek(0);
        const HelperRun run{moduleFile("peeler_3mf"),
                            static_cast<int>(kLeastSeconds + size / kBytesASecond), kThreeMfHint,
                            nullptr, "install " PEELER_LIB3MF};
        return runHelper(run, request);
    }

    static std::string takeText(SharedFile& model) {
        constexpr std::uint64_t kMostOfText = 1'000'000;
        const auto text = model.take<char>(kMostOfText);
        return {text.begin(), text.end()};
    }

    static std::vector<std::string> takeTexts(SharedFile& model) {
        std::vector<std::string> texts;
        for (auto count = model.takeOne<std::uint32_t>(); count > 0; --count)
            texts.push_back(takeText(model));
        return texts;
    }

    /// Takes an array of this length.
    template <class T>
    std::vector<T> takeArray(SharedFile& model, std::uint64_t length) {
        file_.allow(length * sizeof(T));
        std::vector<T> values = model.take<T>(length);
        check(values.size() == length);
        return values;
    }

    /// Takes places of objects with indices below `objects`.
    std::vector<ThreeMfPlacement> takePlacements(SharedFile& model, std::uint64_t count,
                                                 std::size_t objects) {
        std::vector<ThreeMfPlacement> placements = takeArray<ThreeMfPlacement>(model, count);
        for (const ThreeMfPlacement& placement : placements)
            check(placement.object < objects);
        return placements;
    }

    void takeMaterials(SharedFile& model) {
        const std::vector<std::string> names = takeTexts(model);
        const auto colors = takeArray<ThreeMfColor>(model, names.size());
        first_material_ = static_cast<int>(file_.scene().materials.size());
        materials_ = names.size();
        for (std::size_t i = 0; i < names.size(); ++i) {
            Material material = plainMaterial(names[i], linearColor(colors[i]));
            if (colors[i][3] < 255) material.alpha_mode = AlphaMode::kBlend;
            file_.scene().materials.push_back(std::move(material));
        }
    }

    void takeObjects(SharedFile& model) {
        for (auto count = model.takeOne<std::uint32_t>(); count > 0; --count) {
            StoredObject object;
            object.record = model.takeOne<ThreeMfObject>();
            object.name = takeText(model);
            const ThreeMfObject& record = object.record;
            if (object.name.empty()) object.name = "object " + std::to_string(record.id);
            object.vertices = takeArray<ThreeMfVertex>(model, record.vertices);
            object.triangles = takeArray<ThreeMfTriangle>(model, record.triangles);
            object.properties = takeArray<std::uint32_t>(model, record.triangles);
            object.colors = takeArray<ThreeMfColor>(
                model, record.has_colors ? std::uint64_t{3} * record.triangles : 0);
            object.components = takePlacements(model, record.components, objects_.size());
            for (const ThreeMfTriangle& triangle : object.triangles)
                check(std::ranges::max(triangle) < record.vertices);
            objects_.push_back(std::move(object));
        }
    }

    static glm::vec4 linearColor(const ThreeMfColor& color) {
        std::vector<glm::vec4> one{{color[0], color[1], color[2], color[3]}};
        makeLinear(one, {255, 255});
        return one.front();
    }

    static glm::dmat4 matrixOf(const ThreeMfPlacement& placement, const StoredObject& object) {
        glm::dmat4 matrix(1);
        for (int row = 0; row < 3; ++row)
            for (int column = 0; column < 4; ++column) {
                const float value =
                    placement.rows[static_cast<std::size_t>(row)][static_cast<std::size_t>(column)];
                if (!std::isfinite(value))
                    throw Error(ErrorKind::kInput, "a transform of the object \"" +
                                                       printable(object.name) +
                                                       "\" is infinite or NaN");
                matrix[column][row] = value;
            }
        return matrix;
    }

    /// Adds an object's node and those of its components, unless the object is not shown.
    void addNode(const ThreeMfPlacement& placement, const glm::dmat4& place, int parent,
                 int level) {
        StoredObject& object = objects_[placement.object];
        learn(object);
        if (object.is_hidden) return;
        std::vector<Node>& nodes = file_.scene().nodes;
        limit("levels of components", static_cast<std::size_t>(level), kMostLevels);
        limit("placed objects", nodes.size() + 1, kMostNodes);
        file_.allow(2 * sizeof(Node) + object.name.size());
        const int index = file_.addNode(object.name, {});
        Node& node = nodes[static_cast<std::size_t>(index)];
        node.local = place * matrixOf(placement, object);
        node.mesh = object.mesh;
        if (parent >= 0) nodes[static_cast<std::size_t>(parent)].children.push_back(index);
        for (const ThreeMfPlacement& component : object.components)
            addNode(component, glm::dmat4(1), index, level + 1);
    }

    static void limit(const char* what, std::size_t number, std::size_t most) {
        if (number > most)
            throw Error(ErrorKind::kInput,
                        "the file has more than " + std::to_string(most) + ' ' + what);
    }

    /// Adds the mesh of an object that is placed for the first time, and warns of lost content.
    void learn(StoredObject& object) {
        if (std::exchange(object.is_known, true)) return;
        for (const LostContent& lost : kLostContents) {
            if ((object.record.lost & lost.what) == 0) continue;
            file_.warn("The object \"" + object.name + "\" " + lost.message + '.');
            object.is_hidden = object.is_hidden || lost.hides;
        }
        if (object.is_hidden || object.triangles.empty()) return;
        Mesh mesh;
        for (std::size_t i = 0; i < object.triangles.size();) {
            const std::size_t first = i;
            while (i < object.triangles.size() && object.properties[i] == object.properties[first])
                ++i;
            mesh.primitives.push_back(primitiveOf(object, first, i));
        }
        object.mesh = file_.addMesh(object.name, std::move(mesh));
    }

    /// Returns consecutive triangles of one property. Corners share a vertex if they have the same
    /// vertex in the file and the same colour.
    Primitive primitiveOf(const StoredObject& object, std::size_t first, std::size_t end) {
        constexpr std::uint64_t kOfRun = 4096;  // besides the arrays
        const bool colored =
            object.properties[first] == kThreeMfCornerColors && object.record.has_colors;
        file_.allowGeometry(kOfRun + (end - first) * 3 * sizeof(std::uint32_t));
        CornerIndex corners([&](std::uint64_t bytes) { file_.allow(bytes); });
        Primitive primitive;
        primitive.indices.reserve((end - first) * 3);
        for (std::size_t i = 3 * first; i < 3 * end; ++i)
            primitive.indices.push_back(
                corners.indexOf({object.triangles[i / 3][i % 3],
                                 colored ? std::bit_cast<std::uint32_t>(object.colors[i]) : 0, 0}));
        const std::size_t count = corners.keys().size();
        file_.allowGeometry(count * (sizeof(glm::vec3) + (colored ? sizeof(glm::vec4) : 0)));
        primitive.positions.reserve(count);
        for (const CornerIndex::Key& key : corners.keys()) {
            const ThreeMfVertex& vertex = object.vertices[key[0]];
            for (const float number : vertex)
                check(std::isfinite(number));
            primitive.positions.emplace_back(vertex[0], vertex[1], vertex[2]);
            const auto color = std::bit_cast<ThreeMfColor>(key[1]);
            if (colored) primitive.colors.emplace_back(color[0], color[1], color[2], color[3]);
        }
        if (colored) makeLinear(primitive.colors, {255, 255});
        primitive.material = materialOf(object.properties[first], primitive.colors);
        return primitive;
    }

    int materialOf(std::uint32_t property, const std::vector<glm::vec4>& colors) {
        if (property < materials_) return first_material_ + static_cast<int>(property);
        if (colors.empty()) return file_.neutralMaterial();
        const int index = file_.colorMaterial();
        if (std::ranges::any_of(colors, [](const glm::vec4& color) { return color.a < 1; }))
            file_.scene().materials[static_cast<std::size_t>(index)].alpha_mode = AlphaMode::kBlend;
        return index;
    }

    static constexpr std::size_t kMostLevels = 1000, kMostNodes = std::size_t{1} << 17;

    MeshFile file_;
    std::vector<StoredObject> objects_;
    int first_material_ = 0;  ///< index in the scene of the file's first material
    std::size_t materials_ = 0;
};

}  // namespace

bool isThreeMf(std::string_view begin, std::uint64_t) {
    return begin.starts_with("PK\x03\x04");
}

Scene readThreeMfScene(const std::filesystem::path& path, const SceneReadOptions& options) {
    return ThreeMfReader(path, options).read();
}

}  // namespace peeler
