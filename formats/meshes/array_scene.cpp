// SPDX-License-Identifier: Apache-2.0
// Reader of scenes of one mesh, given as arrays of vertices and triangles.
#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include <peeler/error.h>
#include "core/base/color.h"
#include "core/base/printable.h"
#include "formats/arrays/array_file.h"
#include "formats/meshes/mesh_parts.h"

namespace peeler {
namespace {

template <class T>
struct NamedChoice {
    std::string_view name;
    T value;
};
constexpr NamedChoice<Topology> kTopologies[] = {{"triangles", Topology::kTriangles},
                                                 {"lines", Topology::kLines},
                                                 {"points", Topology::kPoints}};
constexpr NamedChoice<AlphaMode> kSceneAlphaModes[] = {
    {"OPAQUE", AlphaMode::kOpaque}, {"MASK", AlphaMode::kMask}, {"BLEND", AlphaMode::kBlend}};

class ArraySceneReader {
  public:
    ArraySceneReader(const std::filesystem::path& path, const SceneReadOptions& options)
        : file_(path, options),
          arrays_(file_.bytes(), file_.name(), [&](std::uint64_t bytes) { file_.allow(bytes); }) {}

    Scene read() {
        readGeometry();
        readMaterial();
        const std::string name = arrays_.text("name").value_or(file_.stem());
        arrays_.array("arrays_version");
        for (const std::string& unused : arrays_.unused())
            if (unused != "format")  // PyTorch and other libraries store their name there
                file_.warn("\"" + unused + "\" is ignored.", arrays_.placeOf(unused));
        Mesh mesh;
        // If all faces were dropped, leave the primitive out: without indices, it would draw all
        // vertices in order.
        if (!has_faces_ || !primitive_.indices.empty())
            mesh.primitives.push_back(std::move(primitive_));
        file_.addNode(name, std::move(mesh));
        return file_.finish();
    }

  private:
    void readGeometry() {
        if (const auto mode = arrays_.text("mode"))
            primitive_.topology = choose(kTopologies, *mode, "mode");
        const auto vertices = arrays_.array("vertices");
        if (!vertices)
            throw Error(ErrorKind::kInput,
                        "the file is not a scene: the array \"vertices\" is missing", file_.name(),
                        "give vertices of shape (n, 3), faces of shape (m, 3)");
        primitive_.positions = vectorsOf<glm::vec3>("vertices", *vertices, {});
        const std::uint64_t n = primitive_.positions.size();
        if (const auto faces = arrays_.array("faces")) readFaces(*faces);
        if (const auto normals = arrays_.array("normals"))
            primitive_.normals = vectorsOf<glm::vec3>("normals", *normals, n);
        if (const auto uv = arrays_.array("uv"))
            primitive_.texcoords[0] = vectorsOf<glm::vec2>("uv", *uv, n);
        if (const auto colors = arrays_.array("colors")) readColors(*colors);
    }

    void readFaces(const NumberArray& faces) {
        const std::size_t corners = primitive_.topology == Topology::kTriangles ? 3
                                    : primitive_.topology == Topology::kLines   ? 2
                                                                                : 1;
        if (faces.number->floating)
            fail("expected whole numbers, not " + std::string(faces.number->type), "faces");
        if (faces.shape.size() != 2 || faces.shape[1] != corners)
            failShape("(m, " + std::to_string(corners) + ')', faces, "faces");
        has_faces_ = true;
        file_.allowGeometry(faces.count() * sizeof(std::uint32_t));
        primitive_.indices.resize(faces.count());
        for (std::uint64_t i = 0; i < faces.count(); ++i) {
            const double index = faces.at(i);
            if (!(index >= 0 && index < static_cast<double>(primitive_.positions.size())))
                fail("there is no vertex " +
                         std::to_string(static_cast<std::int64_t>(std::clamp(index, -9e18, 9e18))) +
                         "; there are " + std::to_string(primitive_.positions.size()),
                     "faces");
            primitive_.indices[i] = static_cast<std::uint32_t>(index);
        }
    }

    /// Reads colours, which are linear, 0 to 1. Rejects integers other than uint8 and uint16,
    /// because their white could be 1, 255 or more.
    void readColors(const NumberArray& colors) {
        const std::string_view type = colors.number->type;
        const float white = type == "u1" ? 255 : type == "u2" ? 65535 : 1;
        if (white == 1 && !colors.number->floating && colors.count() > 0)
            fail("expected floats from 0 to 1, uint8 or uint16, not " + std::string(type), "colors",
                 "give them as numpy.uint8 or numpy.float32");
        const std::uint64_t n = primitive_.positions.size();
        if (colors.shape.size() == 2 && colors.shape[1] == 3) {
            for (const glm::vec3& color : vectorsOf<glm::vec3>("colors", colors, n))
                primitive_.colors.emplace_back(color, white);
        } else {
            primitive_.colors = vectorsOf<glm::vec4>("colors", colors, n);
        }
        constexpr float kRounding = 1e-3F;
        for (glm::vec4& color : primitive_.colors) {
            color /= white;
            for (int i = 0; i < 4; ++i)
                if (!(color[i] >= -kRounding && color[i] <= 1 + kRounding))
                    fail("expected numbers from 0 to 1", "colors",
                         "give colours of 0 to 255 as numpy.uint8");
            color = glm::clamp(color, 0.0F, 1.0F);
        }
    }

    void readMaterial() {
        Material material;
        material.base_color = glm::vec4(1);
        if (const auto color = arrays_.numbers("base_color", 4))
            for (int i = 0; i < 4; ++i)
                material.base_color[i] =
                    inUnit((*color)[static_cast<std::size_t>(i)], "base_color");
        material.metallic = inUnit(numberOf("metallic", 0), "metallic");
        material.roughness = inUnit(numberOf("roughness", 1), "roughness");
        material.double_sided = numberOf("double_sided", 0) != 0;
        if (const auto mode = arrays_.text("alpha_mode"))
            material.alpha_mode = choose(kSceneAlphaModes, *mode, "alpha_mode");
        if (const auto texture = arrays_.array("texture")) {
            if (primitive_.texcoords[0].empty() && !primitive_.positions.empty())
                fail("a texture needs texture coordinates", "texture",
                     "give uv, an array of shape (n, 2)");
            material.base_color_texture.image = 0;
            readTexture(*texture);
        }
        file_.scene().materials.push_back(std::move(material));
    }

    void readTexture(const NumberArray& texture) {
        constexpr std::uint64_t kMostSide = 1 << 15;
        if (texture.number->type != "u1")
            fail("expected uint8, not " + std::string(texture.number->type), "texture",
                 "numpy.uint8(numpy.round(255 * texture)) of floats from 0 to 1");
        const bool fits = texture.shape.size() == 3 && texture.count() > 0 &&
                          (texture.shape[2] == 3 || texture.shape[2] == 4) &&
                          texture.shape[0] <= kMostSide && texture.shape[1] <= kMostSide;
        if (!fits) failShape("(height, width, 3 or 4)", texture, "texture");
        Image image;
        image.height = static_cast<int>(texture.shape[0]);
        image.width = static_cast<int>(texture.shape[1]);
        const std::uint64_t channels = texture.shape[2], pixels = texture.count() / channels;
        file_.allow(4 * pixels);
        image.rgba.resize(4 * pixels, 255);
        for (std::uint64_t p = 0; p < pixels; ++p)
            for (std::uint64_t c = 0; c < channels; ++c)
                image.rgba[4 * p + c] = static_cast<std::uint8_t>(texture.at(channels * p + c));
        file_.scene().images.push_back(std::move(image));
    }

    /// Returns the rows of a 2D array as vectors. Throws Error (kInput) if the shape is not (rows,
    /// components); without `rows`, any number of rows is accepted.
    template <class Vector>
    std::vector<Vector> vectorsOf(const char* name, const NumberArray& array,
                                  std::optional<std::uint64_t> rows) {
        constexpr std::uint64_t kComponents = Vector::length();
        if (array.shape.size() != 2 || array.shape[1] != kComponents ||
            (rows && array.shape[0] != *rows))
            failShape('(' + (rows ? std::to_string(*rows) : std::string("n")) + ", " +
                          std::to_string(kComponents) + ')',
                      array, name);
        file_.allowGeometry(array.shape[0] * sizeof(Vector));
        std::vector<Vector> vectors(array.shape[0]);
        for (std::uint64_t i = 0; i < vectors.size(); ++i) {
            for (std::uint64_t c = 0; c < kComponents; ++c) {
                const auto value = coordinate(array.at(kComponents * i + c));
                if (!value) fail("expected finite numbers", name);
                vectors[i][static_cast<int>(c)] = *value;
            }
        }
        return vectors;
    }

    template <class T, std::size_t n>
    T choose(const NamedChoice<T> (&choices)[n], const std::string& text, const char* name) const {
        std::string names;
        for (const NamedChoice<T>& choice : choices) {
            if (choice.name == text) return choice.value;
            names += (names.empty() ? "" : ", ") + std::string(choice.name);
        }
        fail("expected one of " + names + ", not \"" + printable(text) + "\"", name);
    }

    double numberOf(const char* name, double otherwise) {
        const auto given = arrays_.numbers(name, 1);
        return given ? given->front() : otherwise;
    }
    float inUnit(double value, const char* name) const {
        if (!(value >= 0 && value <= 1)) fail("expected numbers from 0 to 1", name);
        return static_cast<float>(value);
    }

    [[noreturn]] void fail(const std::string& what, const char* name,
                           const std::string& hint = {}) const {
        throw Error(ErrorKind::kInput, what, arrays_.placeOf(name), hint);
    }
    [[noreturn]] void failShape(const std::string& expected, const NumberArray& array,
                                const char* name) const {
        fail("expected an array of shape " + expected + ", not " + shapeText(array.shape), name);
    }

    MeshFile file_;
    ArrayFile arrays_;
    Primitive primitive_;
    bool has_faces_ = false;
};

}  // namespace

bool isArrayScene(std::string_view begin, std::uint64_t size) {
    return ArrayFile::recognises(begin, size);
}

Scene readArrayScene(const std::filesystem::path& path, const SceneReadOptions& options) {
    return ArraySceneReader(path, options).read();
}

}  // namespace peeler
