// SPDX-License-Identifier: Apache-2.0
// Scenes of Python: from files as the command line shows them, and from arrays.
#include <algorithm>
#include <cmath>
#include <cstring>
#include <glm/gtc/matrix_inverse.hpp>
#include <string_view>
#include <type_traits>

#include <peeler/error.h>
#include "cmd/cli/errors.h"
#include "cmd/options/appearance_options.h"
#include "cmd/options/capture_options.h"
#include "cmd/python/binding.h"
#include "core/scene/elements.h"
#include "core/scene/view.h"
#include "formats/file/content_hash.h"

namespace peeler::python {

namespace {

std::string shapeText(const py::array& array) {
    std::string text = "(";
    for (py::ssize_t i = 0; i < array.ndim(); ++i)
        text += (i == 0 ? "" : ", ") + std::to_string(array.shape(i));
    return text + (array.ndim() == 1 ? ",)" : ")");
}

[[noreturn]] void refuseShape(const char* name, const std::string& expected,
                              const py::array& array) {
    throw Error(ErrorKind::kUsage,
                "expected an array of shape " + expected + ", not " + shapeText(array), name);
}

/// The kinds of numbers (NumPy's dtype.kind) that are taken as numbers of T.
template <class T>
constexpr std::string_view kNumberKinds = std::is_floating_point_v<T> ? "fiu" : "iu";

[[noreturn]] void refuseType(const char* name, const std::string& expected, const py::array& array,
                             const std::string& hint = "") {
    throw Error(ErrorKind::kUsage,
                "expected " + expected + ", not " + std::string(py::str(array.dtype())), name,
                hint);
}

/// The array as numbers of T, row-major; a copy only where it is something else. Throws
/// Error (kUsage) for a kind of number that T does not have.
template <class T>
py::array_t<T> arrayOf(const char* name, const py::object& value) {
    const auto given = py::array::ensure(value);
    if (given && given.size() > 0 &&
        kNumberKinds<T>.find(given.dtype().kind()) == std::string_view::npos)
        refuseType(name, std::is_floating_point_v<T> ? "numbers" : "whole numbers", given);
    auto array = py::array_t<T, py::array::c_style | py::array::forcecast>::ensure(value);
    if (!array) {
        PyErr_Clear();
        throw Error(ErrorKind::kUsage, "expected an array of numbers", name);
    }
    return array;
}

/// Rows of `components` numbers as vectors; `rows` < 0: any number of them.
template <class Vector>
std::vector<Vector> vectorsOf(const char* name, const py::object& value, py::ssize_t rows) {
    constexpr py::ssize_t kComponents = Vector::length();
    const py::array_t<float> array = arrayOf<float>(name, value);
    if (array.ndim() != 2 || array.shape(1) != kComponents ||
        (rows >= 0 && array.shape(0) != rows)) {
        refuseShape(name,
                    '(' + (rows < 0 ? std::string("n") : std::to_string(rows)) + ", " +
                        std::to_string(kComponents) + ')',
                    array);
    }
    std::vector<Vector> vectors(static_cast<std::size_t>(array.shape(0)));
    std::memcpy(static_cast<void*>(vectors.data()), array.data(),
                static_cast<std::size_t>(array.nbytes()));
    return vectors;
}

template <class Vector>
void checkFinite(const char* name, const std::vector<Vector>& vectors) {
    for (const Vector& v : vectors) {
        for (int i = 0; i < Vector::length(); ++i) {
            if (!std::isfinite(v[i]))
                throw Error(ErrorKind::kUsage, "expected finite numbers", name);
        }
    }
}

std::vector<std::uint32_t> indicesOf(const py::object& faces, std::size_t vertices,
                                     py::ssize_t corners) {
    const py::array_t<std::int64_t> array = arrayOf<std::int64_t>("faces", faces);
    if (array.ndim() != 2 || array.shape(1) != corners)
        refuseShape("faces", "(m, " + std::to_string(corners) + ')', array);
    std::vector<std::uint32_t> indices(static_cast<std::size_t>(array.size()));
    for (std::size_t i = 0; i < indices.size(); ++i) {
        const std::int64_t index = array.data()[i];
        if (index < 0 || static_cast<std::uint64_t>(index) >= vertices) {
            throw Error(ErrorKind::kUsage,
                        "there is no vertex " + std::to_string(index) + ", only " +
                            std::to_string(vertices),
                        "faces");
        }
        indices[i] = static_cast<std::uint32_t>(index);
    }
    return indices;
}

bool isUnsigned(const py::array& array, py::ssize_t bytes) {
    return array.dtype().kind() == 'u' && array.itemsize() == bytes;
}

/// Linear colours, 0 to 1. Throws Error (kUsage) for integers but uint8 and uint16: their white may
/// be 1, 255 or more.
std::vector<glm::vec4> colorsOf(const py::object& colors, py::ssize_t vertices) {
    const auto any = arrayOf<float>("colors", colors);
    const auto given = py::array::ensure(colors);
    const float white = isUnsigned(given, 1) ? 255 : isUnsigned(given, 2) ? 65535 : 1;
    if (white == 1 && given.dtype().kind() != 'f' && given.size() > 0)
        refuseType("colors", "floats from 0 to 1, uint8 or uint16", given,
                   "give them as numpy.uint8 or numpy.float32");
    std::vector<glm::vec4> result;
    if (any.ndim() == 2 && any.shape(1) == 3) {
        for (const glm::vec3& c : vectorsOf<glm::vec3>("colors", any, vertices))
            result.emplace_back(c, white);
    } else {
        result = vectorsOf<glm::vec4>("colors", any, vertices);
    }
    constexpr float kRounding = 1e-3F;
    for (glm::vec4& color : result) {
        color /= white;
        for (int i = 0; i < 4; ++i)
            if (!(color[i] >= -kRounding && color[i] <= 1 + kRounding))
                throw Error(ErrorKind::kUsage, "expected numbers from 0 to 1", "colors",
                            "give colours of 0 to 255 as numpy.uint8");
        color = glm::clamp(color, 0.0F, 1.0F);
    }
    return result;
}

Image imageOf(const py::object& texture) {
    const auto given = py::array::ensure(texture);
    if (given && !isUnsigned(given, 1))
        refuseType("texture", "uint8", given,
                   "numpy.uint8(numpy.round(255 * texture)) of floats from 0 to 1");
    const py::array_t<std::uint8_t> array = arrayOf<std::uint8_t>("texture", texture);
    if (array.ndim() != 3 || (array.shape(2) != 3 && array.shape(2) != 4) || array.size() == 0)
        refuseShape("texture", "(height, width, 3 or 4)", array);
    Image image;
    image.height = static_cast<int>(array.shape(0));
    image.width = static_cast<int>(array.shape(1));
    const auto channels = static_cast<std::size_t>(array.shape(2));
    const std::size_t pixels = static_cast<std::size_t>(array.size()) / channels;
    image.rgba.resize(4 * pixels, 255);
    for (std::size_t p = 0; p < pixels; ++p)
        std::memcpy(image.rgba.data() + 4 * p, array.data() + channels * p, channels);
    return image;
}

constexpr cmd::Choice<Topology> kTopologies[] = {
    {"triangles", Topology::kTriangles, ""},
    {"lines", Topology::kLines, ""},
    {"points", Topology::kPoints, ""},
};
constexpr cmd::Choice<AlphaMode> kAlphaModes[] = {
    {"OPAQUE", AlphaMode::kOpaque, ""},
    {"MASK", AlphaMode::kMask, ""},
    {"BLEND", AlphaMode::kBlend, ""},
};

SceneHolder fromArrays(const py::object& vertices, const py::object& faces,
                       const py::object& normals, const py::object& uv, const py::object& texture,
                       const py::object& colors, const std::array<float, 4>& base_color,
                       float metallic, float roughness, const std::string& alpha_mode,
                       bool double_sided, const std::string& mode, const std::string& name) {
    Scene scene;
    Primitive primitive;
    primitive.topology = cmd::choose<Topology>("mode", kTopologies, mode);
    primitive.positions = vectorsOf<glm::vec3>("vertices", vertices, -1);
    checkFinite("vertices", primitive.positions);
    const auto count = static_cast<py::ssize_t>(primitive.positions.size());
    const py::ssize_t corners = primitive.topology == Topology::kTriangles ? 3
                                : primitive.topology == Topology::kLines   ? 2
                                                                           : 1;
    if (!faces.is_none()) primitive.indices = indicesOf(faces, primitive.positions.size(), corners);
    if (!normals.is_none()) primitive.normals = vectorsOf<glm::vec3>("normals", normals, count);
    if (!uv.is_none()) primitive.texcoords[0] = vectorsOf<glm::vec2>("uv", uv, count);
    if (!colors.is_none()) primitive.colors = colorsOf(colors, count);
    // Without indices a primitive would show all vertices in order.
    const bool is_empty = !faces.is_none() && primitive.indices.empty();
    if (is_empty) primitive = Primitive();
    Material material;
    material.base_color = {base_color[0], base_color[1], base_color[2], base_color[3]};
    material.metallic = metallic;
    material.roughness = roughness;
    material.double_sided = double_sided;
    material.alpha_mode = cmd::choose<AlphaMode>("alpha_mode", kAlphaModes, alpha_mode);
    if (!texture.is_none()) {
        if (uv.is_none())
            throw Error(ErrorKind::kUsage, "a texture needs texture coordinates", "texture",
                        "give uv, an array of shape (n, 2)");
        scene.images.push_back(imageOf(texture));
        material.base_color_texture.image = 0;
    }
    std::uint64_t hash = 0;
    const auto add = [&](const auto& values) {
        hash = contentHash(std::as_bytes(std::span(values)), hash);
    };
    add(primitive.positions);
    add(primitive.indices);
    add(primitive.normals);
    add(primitive.texcoords[0]);
    add(primitive.colors);
    for (const Image& image : scene.images)
        add(image.rgba);
    add(std::vector<float>{base_color[0], base_color[1], base_color[2], base_color[3], metallic,
                           roughness, double_sided ? 1.0F : 0.0F,
                           static_cast<float>(material.alpha_mode),
                           static_cast<float>(primitive.topology)});
    scene.content_hash = hash;
    scene.scenes = {{"", {0}}};
    scene.nodes.resize(1);
    scene.nodes[0].name = name;
    scene.nodes[0].mesh = 0;
    scene.meshes.push_back({name, {}});
    if (!is_empty) scene.meshes[0].primitives.push_back(std::move(primitive));
    scene.materials = {std::move(material), Material{}};
    auto object = std::make_shared<SceneObject>();
    object->scene = std::make_shared<const Scene>(std::move(scene));
    return object;
}

SceneHolder fromFile(const py::object& path, const py::dict& given) {
    auto object = std::make_shared<SceneObject>();
    cmd::SceneOptions& shown = object->shown;
    Keywords keywords("Scene");
    addSceneOptions(keywords.options(), shown);
    addUpOption(keywords.options(), shown.reading);
    addAppearanceOptions(keywords.options(), object->appearance);
    keywords.parse(given);
    checkAppearanceOptions(object->appearance);
    shown.file = pathOf(path);
    object->path = shown.file;
    object->name = shown.file.filename().string();
    unlocked([&] {
        Scene scene =
            cmd::loadScene({.scene = shown, .appearance = object->appearance, .animation = {}});
        object->index = cmd::chooseScene(scene, shown);
        cmd::selectNodes(scene, shown);
        object->scene = std::make_shared<const Scene>(std::move(scene));
    });
    warn(object->scene->warnings);
    return object;
}

glm::dmat4 matrixOf(const char* name, const py::object& value, bool affine) {
    const py::array_t<double> array = arrayOf<double>(name, value);
    const bool square = array.ndim() == 2 && array.shape(0) == 4 && array.shape(1) == 4;
    if (!square && !(affine && array.ndim() == 2 && array.shape(0) == 3 && array.shape(1) == 4))
        refuseShape(name, affine ? "(4, 4) or (3, 4)" : "(4, 4)", array);
    glm::dmat4 matrix(1);
    for (int row = 0; row < static_cast<int>(array.shape(0)); ++row) {
        for (int column = 0; column < 4; ++column) {
            matrix[column][row] = array.data()[4 * row + column];
            if (!std::isfinite(matrix[column][row]))
                throw Error(ErrorKind::kUsage, "expected finite numbers", name);
        }
    }
    if (matrix[0][3] != 0 || matrix[1][3] != 0 || matrix[2][3] != 0 || matrix[3][3] != 1)
        throw Error(ErrorKind::kUsage, "expected a last row of 0, 0, 0, 1", name);
    return matrix;
}

/// A camera shows no scale, mirror or shear, so a matrix that has some is none of a camera.
void checkRigid(const char* name, const glm::dmat4& matrix) {
    if (!(distanceFromRigid(matrix) < 1e-4))
        throw Error(ErrorKind::kUsage, "expected a rotation and a translation", name,
                    "scale the scene instead; a mirrored axis is another convention");
}

py::object boundsArray(const SceneObject& object) {
    const auto bounds = unlocked([&] { return object.posed({}, 0).bounds(); });
    if (!bounds) return py::none();
    std::vector<double> numbers;
    for (const glm::dvec3& corner : {bounds->min, bounds->max})
        for (int i = 0; i < 3; ++i)
            numbers.push_back(corner[i]);
    return adopt(std::move(numbers), {2, 3});
}

std::string sceneText(const SceneObject& object) {
    std::uint64_t triangles = 0;
    const PosedScene posed = object.posed({}, 0);
    for (const MeshInstance& instance : posed.meshes())
        for (const Primitive& primitive : posed.primitives(instance))
            if (primitive.topology >= Topology::kTriangles) triangles += elementsOf(primitive);
    const Scene& scene = *object.scene;
    std::string text = "<peeler.Scene ";
    text += object.name.empty() ? "from arrays" : '\'' + object.name + '\'';
    text += ": " + std::to_string(triangles) + " triangles, " + std::to_string(scene.nodes.size()) +
            " nodes, " + std::to_string(scene.materials.size() - 1) + " materials, " +
            std::to_string(posed.cameras().size()) + " cameras";
    if (!scene.animations.empty())
        text += ", " + std::to_string(scene.animations.size()) + " animations";
    return text + '>';
}

template <class Things>
std::vector<std::string> namesOf(const Things& things) {
    std::vector<std::string> names;
    for (const auto& thing : things)
        names.push_back(thing.name);
    return names;
}

}  // namespace

PosedScene SceneObject::posed(const std::vector<int>& animations, double time) const {
    if (animations.empty()) return {*scene, index};
    return {*scene, index, poseAt(*scene, animations, time)};
}

View SceneObject::view(const PosedScene& posed, const std::vector<int>& animations,
                       const cmd::CameraOptions& camera) const {
    const std::lock_guard lock(mutex_);
    auto found = extents_.find(animations);
    if (found == extents_.end()) {
        found =
            extents_
                .emplace(animations, animations.empty() ? SceneExtent(posed)
                                                        : SceneExtent(*scene, index, animations))
                .first;
    }
    return cmd::makeView(posed, found->second, camera);
}

void takeCamera(py::dict& given, cmd::CameraOptions& camera) {
    const py::object k = Keywords::take(given, "K");
    const py::object world_to_camera = Keywords::take(given, "world_to_camera");
    const py::object gltf = Keywords::take(given, "gltf");
    const py::object pixel_center = Keywords::take(given, "pixel_center");
    if (!world_to_camera.is_none() && !gltf.is_none())
        throw Error(ErrorKind::kUsage, "a camera has one place", "world_to_camera, gltf",
                    "leave one of them out");
    if (!world_to_camera.is_none()) {
        const glm::dmat4 matrix = matrixOf("world_to_camera", world_to_camera, true);
        checkRigid("world_to_camera", matrix);
        // Of OpenCV x is right, y down, z forward; of glTF x right, y up, −z forward.
        const glm::dmat4 turned(glm::dvec4(1, 0, 0, 0), glm::dvec4(0, -1, 0, 0),
                                glm::dvec4(0, 0, -1, 0), glm::dvec4(0, 0, 0, 1));
        camera.pose = glm::affineInverse(matrix) * turned;
    }
    if (!gltf.is_none()) {
        camera.pose = matrixOf("gltf", gltf, false);
        checkRigid("gltf", *camera.pose);
    }
    if (k.is_none()) {
        if (!pixel_center.is_none())
            throw Error(ErrorKind::kUsage, "there is no K whose pixels have a centre",
                        "pixel_center", "add K");
        return;
    }
    const py::array_t<double> array = arrayOf<double>("K", k);
    if (array.ndim() != 2 || array.shape(0) != 3 || array.shape(1) != 3)
        refuseShape("K", "(3, 3)", array);
    const double* const m = array.data();
    if (m[1] != 0 || m[3] != 0 || m[6] != 0 || m[7] != 0 || m[8] != 1)
        throw Error(ErrorKind::kUsage, "expected [[fx, 0, cx], [0, fy, cy], [0, 0, 1]]", "K",
                    "skew and lens distortion are not rendered");
    const double centre = pixel_center.is_none() ? 0 : pixel_center.cast<double>();
    camera.intrinsics = Intrinsics{m[0], m[4], m[2] - centre, m[5] - centre};
}

void defineScenes(py::module_& module) {
    py::class_<SceneObject, SceneHolder>(
        module, "Scene",
        "Scene(path, **keywords)\n\n"
        "What a file (glTF, PLY, STL, OBJ) shows. It never changes, and may be rendered by any "
        "number "
        "of\nRenderers. Space: right-handed, +Y up, the file's units (metres, if it keeps to "
        "glTF).\n\n"
        "Keywords are those of `peeler render`: scene, include, exclude, allow_outside,\n"
        "ignore_extension, smooth_normals, unit, up, variant, transmission, environment,\n"
        "environment_rotation, strict.\n"
        "What readers warn of becomes a UserWarning. Raises peeler.Error of kind 'input'.")
        .def(py::init([](const py::object& path, const py::kwargs& keywords) {
            return fromFile(path, py::dict(keywords.attr("copy")()));
        }))
        .def_static(
            "from_arrays", &fromArrays, py::arg("vertices"), py::arg("faces") = py::none(),
            py::kw_only(), py::arg("normals") = py::none(), py::arg("uv") = py::none(),
            py::arg("texture") = py::none(), py::arg("colors") = py::none(),
            py::arg("base_color") = std::array<float, 4>{1, 1, 1, 1}, py::arg("metallic") = 0.0F,
            py::arg("roughness") = 1.0F, py::arg("alpha_mode") = "OPAQUE",
            py::arg("double_sided") = false, py::arg("mode") = "triangles",
            py::arg("name") = "mesh",
            "from_arrays(vertices, faces=None, *, normals=None, uv=None, texture=None, "
            "colors=None, ...)\n\n"
            "A scene of one mesh. The arrays are copied, as 32-bit floats.\n\n"
            "vertices: (n, 3), world space\n"
            "faces: (m, 3) indices, counter-clockwise seen from the front; None = the vertices in "
            "order,\n    m = 0: there is nothing. Of mode='lines' (m, 2), of mode='points' (m, 1)\n"
            "normals: (n, 3), unit; None = every triangle is flat\n"
            "uv: (n, 2), V down, (0, 0) is the upper left corner of the texture\n"
            "texture: (height, width, 3 or 4), uint8, sRGB and straight alpha\n"
            "colors: (n, 3 or 4), linear: floats from 0 to 1, uint8 or uint16; multiplied with the "
            "texture and "
            "base_color\n"
            "base_color: linear RGBA; alpha_mode: 'OPAQUE', 'MASK' or 'BLEND'\n\n"
            "Raises peeler.Error of kind 'usage' for an array of another shape or type.")
        .def_property_readonly(
            "bounds", &boundsArray,
            "(2, 3) float64: the least and the greatest corner of what is shown, "
            "world space; None if that is nothing")
        .def_property_readonly(
            "cameras", [](const SceneObject& s) { return cameraNames(s.posed({}, 0)); },
            "Names of the cameras, in draw order: what `camera` takes")
        .def_property_readonly(
            "nodes", [](const SceneObject& s) { return idNames(*s.scene).objects; },
            "Names of the nodes; the id of a node is its index + 1")
        .def_property_readonly(
            "materials", [](const SceneObject& s) { return idNames(*s.scene).materials; },
            "Names of the materials; the id of a material is its index + 1. The last is glTF's "
            "default one")
        .def_property_readonly(
            "animations", [](const SceneObject& s) { return namesOf(s.scene->animations); },
            "Names of the animations: what `animation` takes")
        .def_property_readonly(
            "variants", [](const SceneObject& s) { return s.scene->variants; },
            "Names of the variants of materials")
        .def_property_readonly(
            "warnings", [](const SceneObject& s) { return s.scene->warnings; },
            "What the reader had to leave aside, in sentences")
        .def_readonly("name", &SceneObject::name, "Name of the file; '' of arrays")
        .def("__repr__", &sceneText);
}

}  // namespace peeler::python
