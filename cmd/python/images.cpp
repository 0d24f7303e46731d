// SPDX-License-Identifier: Apache-2.0
// Pictures of Python: layers and composites as arrays, and what is made of them.

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

#include <peeler/channels.h>
#include <peeler/error.h>
#include "cmd/cli/errors.h"
#include "cmd/options/capture_options.h"
#include "cmd/python/binding.h"
#include "core/image/composite.h"
#include "core/image/layers.h"

namespace peeler::python {

namespace {

using Shape = std::vector<py::ssize_t>;

py::ssize_t signedOf(std::uint64_t n) {
    return static_cast<py::ssize_t>(n);
}

const ImageObject& imageIn(const py::object& self) {
    return *self.cast<ImageHolder>();
}

py::object zOf(const py::object& self) {
    const LayeredImage& image = imageIn(self).image;
    return arrayView(py::dtype::of<float>(), image.z.data(), {signedOf(image.z.size())},
                     {sizeof(float)}, self);
}

py::object splitsOf(const py::object& self) {
    const LayeredImage& image = imageIn(self).image;
    return arrayView(py::dtype::of<std::uint32_t>(), image.offsets.data(),
                     {signedOf(image.offsets.size())}, {sizeof(std::uint32_t)}, self);
}

/// Some components of an array, from `first` on; of a single one the last axis falls away.
py::object componentsOf(const py::object& self, const FragmentArray& array, std::size_t first,
                        std::size_t count, bool flat) {
    const std::size_t number = pixelTypeSize(array.type), stride = array.stride();
    const std::size_t fragments = stride == 0 ? 0 : array.data.size() / stride;
    Shape shape{signedOf(fragments)}, strides{signedOf(stride)};
    if (!flat) {
        shape.push_back(signedOf(count));
        strides.push_back(signedOf(number));
    }
    return arrayView(dtypeOf(array.type), array.data.data() + first * number, shape, strides, self);
}

py::object rgbaOf(const py::object& self) {
    const FragmentArray& color = imageIn(self).image.color;
    if (color.components() < kPlainComponents) return py::none();
    return componentsOf(self, color, 0, kPlainComponents, false);
}

py::object opacityOf(const py::object& self) {
    const FragmentArray& color = imageIn(self).image.color;
    if (color.components() < kTintedComponents) return py::none();
    return componentsOf(self, color, kPlainComponents, kTintedComponents - kPlainComponents, false);
}

/// What an array is called: as `channels` has it, else what its components have in common.
std::string channelName(const FragmentArray& array) {
    for (const ChannelInfo& info : channelTable())
        if (std::ranges::equal(array.channels, info.components)) return std::string(info.name);
    const std::string& first = array.channels.front();
    const std::size_t dot = first.rfind('.');
    return array.components() == 1 || dot == std::string::npos ? first : first.substr(0, dot);
}

std::vector<std::string> channelNames(const ImageObject& object) {
    std::vector<std::string> names;
    for (const FragmentArray& array : object.image.extra)
        names.push_back(channelName(array));
    return names;
}

py::object channelOf(const py::object& self, const std::string& name) {
    const LayeredImage& image = imageIn(self).image;
    if (name == "z") return zOf(self);
    if (name == "rgba" && image.color.components() >= kPlainComponents) return rgbaOf(self);
    if (name == "opacity" && image.tinted()) return opacityOf(self);
    for (const FragmentArray& array : image.extra) {
        if (channelName(array) == name)
            return componentsOf(self, array, 0, array.components(), array.components() == 1);
        for (std::size_t c = 0; c < array.components(); ++c)
            if (array.channels[c] == name) return componentsOf(self, array, c, 1, true);
    }
    std::string there = "z, rgba";
    for (const std::string& channel : channelNames(imageIn(self)))
        there += ", " + channel;
    throw py::key_error("no channel '" + name + "'; there are " + there);
}

std::uint32_t mostFragments(const LayeredImage& image) {
    std::uint32_t most = 0;
    for (std::size_t p = 0; p + 1 < image.offsets.size(); ++p)
        most = std::max(most, image.count(p));
    return most;
}

py::object countsOf(const ImageObject& object) {
    const LayeredImage& image = object.image;
    std::vector<std::uint32_t> counts(image.window.pixels());
    for (std::size_t p = 0; p < counts.size(); ++p)
        counts[p] = image.count(p);
    return adopt(std::move(counts), {image.window.height(), image.window.width()});
}

/// The k-th fragment of every pixel at [..., k], for k below `layers`.
py::object denseOf(const py::object& self, const py::object& layers, const std::string& channel,
                   const py::object& fill) {
    const LayeredImage& image = imageIn(self).image;
    py::array values = channelOf(self, channel);
    const auto depth =
        layers.is_none() ? py::ssize_t{mostFragments(image)} : layers.cast<py::ssize_t>();
    if (depth < 0) throw Error(ErrorKind::kUsage, "expected a number of layers", "layers");
    Shape shape{image.window.height(), image.window.width(), depth};
    if (values.ndim() == 2) shape.push_back(values.shape(1));
    const bool is_float = values.dtype().kind() == 'f';
    const py::object nothing =
        !fill.is_none() ? fill
        : is_float && channel == "z"
            ? py::object(py::float_(std::numeric_limits<double>::quiet_NaN()))
            : py::object(py::int_(0));
    py::array dense = py::module_::import("numpy").attr("full")(shape, nothing, values.dtype());
    const auto bytes = static_cast<std::size_t>(values.itemsize()) *
                       static_cast<std::size_t>(values.ndim() == 2 ? values.shape(1) : 1);
    const auto stride = static_cast<std::size_t>(values.strides(0));
    const auto* const from = static_cast<const std::byte*>(values.data());
    auto* const to = static_cast<std::byte*>(dense.mutable_data());
    unlocked([&] {
        for (std::size_t p = 0; p + 1 < image.offsets.size(); ++p) {
            const auto count =
                std::min<std::size_t>(image.count(p), static_cast<std::size_t>(depth));
            for (std::size_t k = 0; k < count; ++k)
                std::memcpy(to + (p * static_cast<std::size_t>(depth) + k) * bytes,
                            from + (image.offsets[p] + k) * stride, bytes);
        }
    });
    return dense;
}

CompositeHolder flattened(const ImageObject& object, const py::object& layers,
                          const std::string& tail) {
    const Tail behind = cmd::choose<Tail>("choice of tail", cmd::kTails, tail);
    const auto most = layers.is_none() ? 0U : layers.cast<std::uint32_t>();
    auto composite = std::make_shared<CompositeObject>();
    composite->plan = object.plan;
    composite->plan.view.crop = object.image.window;
    composite->provenance = object.provenance;
    unlocked([&] {
        if (most == 0 && behind == Tail::kDrop)
            compositeOver(object.image, {}, composite->image);
        else
            compositeNearest(object.image, most, behind, composite->image);
    });
    return composite;
}

// What both kinds of pictures have.

/// fx, fy, cx, cy as Intrinsics has them, of the crop.
py::object intrinsicsOf(const View& view, const Window& crop) {
    if (!view.known || !view.projection.perspective) return py::none();
    const double fx = view.width / (2 * view.projection.half_width);
    const double fy = view.height / (2 * view.projection.half_height);
    return adopt(std::vector<double>{fx, 0, view.width / 2.0 - view.sample.x - crop.x0, 0, fy,
                                     view.height / 2.0 - view.sample.y - crop.y0, 0, 0, 1},
                 {3, 3});
}

py::object matrixArray(const glm::dmat4& m) {
    std::vector<double> numbers;
    for (int row = 0; row < 4; ++row)
        for (int column = 0; column < 4; ++column)
            numbers.push_back(m[column][row]);
    return adopt(std::move(numbers), {4, 4});
}

py::object worldToCamera(const View& view) {
    if (!view.known) return py::none();
    glm::dmat4 world_to_camera = glm::inverse(view.camera_to_world);
    for (int column = 0; column < 4; ++column)
        for (const int row : {1, 2})
            world_to_camera[column][row] = -world_to_camera[column][row] + 0.0;
    return matrixArray(world_to_camera);
}

py::object positionsOf(const ImageObject& object) {
    if (!object.plan.view.known)
        throw Error(ErrorKind::kInput, "nothing in it says where its camera was", "positions");
    const LayeredImage& image = object.image;
    const View& view = object.plan.view;
    std::vector<float> points(3 * image.fragments());
    unlocked([&] {
        std::size_t p = 0;
        for (int y = image.window.y0; y < image.window.y1; ++y) {
            for (int x = image.window.x0; x < image.window.x1; ++x, ++p) {
                for (std::uint32_t f = image.offsets[p]; f < image.offsets[p + 1]; ++f) {
                    const glm::dvec3 at = worldPosition(view, x + view.sample.x, y + view.sample.y,
                                                        static_cast<double>(image.z[f]));
                    const glm::vec3 rounded(at);
                    std::memcpy(&points[std::size_t{3} * f], &rounded, sizeof rounded);
                }
            }
        }
    });
    return adopt(std::move(points), {signedOf(image.fragments()), 3});
}

std::string sourceText(const Provenance& from) {
    return from.scene.empty() ? "" : " of '" + from.scene + '\'';
}
template <class Object, class... Options>
void defineShared(py::class_<Object, Options...>& type) {
    type.def_property_readonly(
            "shape",
            [](const Object& o) {
                return py::make_tuple(o.image.window.height(), o.image.window.width());
            },
            "(height, width) in pixels")
        .def_property_readonly(
            "size",
            [](const Object& o) {
                return py::make_tuple(o.image.window.width(), o.image.window.height());
            },
            "(width, height) in pixels")
        .def_property_readonly(
            "window",
            [](const Object& o) {
                const Window& w = o.image.window;
                return py::make_tuple(w.x0, w.y0, w.x1, w.y1);
            },
            "(x0, y0, x1, y1): which pixels of the display window these are")
        .def_property_readonly(
            "display",
            [](const Object& o) { return py::make_tuple(o.plan.view.width, o.plan.view.height); },
            "(width, height) of the display window, whose middle is on the camera's axis")
        .def_property_readonly(
            "K", [](const Object& o) { return intrinsicsOf(o.plan.view, o.image.window); },
            "(3, 3) float64, pixels: x right, y down, (0, 0) the centre of the first pixel "
            "(OpenCV);\nNone of an orthographic or unknown camera")
        .def_property_readonly(
            "world_to_camera", [](const Object& o) { return worldToCamera(o.plan.view); },
            "(4, 4) float64: to x right, y down, z forward (OpenCV); None if unknown")
        .def_property_readonly(
            "gltf",
            [](const Object& o) -> py::object {
                if (!o.plan.view.known) return py::none();
                return matrixArray(o.plan.view.camera_to_world);
            },
            "(4, 4) float64: the camera's place as glTF and pyrender have it, camera to world, "
            "looking along -Z with +Y up; None if unknown")
        .def_property_readonly(
            "near", [](const Object& o) { return o.plan.view.projection.near; }, "scene units")
        .def_property_readonly(
            "far", [](const Object& o) { return o.plan.view.projection.far; }, "scene units")
        .def_property_readonly(
            "camera", [](const Object& o) { return o.plan.view.camera_name; },
            "Name of the scene's camera; '' if it is none of them")
        .def_property_readonly(
            "renderer", [](const Object& o) { return o.provenance.renderer; },
            "GL_RENDERER of the device");
}

}  // namespace

py::array arrayView(const py::dtype& type, const void* data, Shape shape, Shape strides,
                    const py::object& base) {
    return py::array(type, std::move(shape), std::move(strides), data, base);
}

py::dtype dtypeOf(PixelType type) {
    switch (type) {
        case PixelType::kHalf:
            return py::dtype("float16");
        case PixelType::kFloat:
            return py::dtype::of<float>();
        case PixelType::kUint:
            break;
    }
    return py::dtype::of<std::uint32_t>();
}

void defineImages(py::module_& module) {
    py::class_<CompositeObject, CompositeHolder> composite(
        module, "Composite",
        "A flat picture: premultiplied linear RGBA over nothing, and the depth of what is "
        "nearest.");
    defineShared(composite);
    const auto rgba = [](const py::object& self) -> py::array {
        const CompositeImage& image = self.cast<CompositeHolder>()->image;
        const py::ssize_t h = image.window.height(), w = image.window.width();
        return arrayView(py::dtype::of<float>(), image.rgba.data(), {h, w, 4}, {16 * w, 16, 4},
                         self);
    };
    composite
        .def_property_readonly(
            "rgba", rgba, "(height, width, 4) float32: linear Rec. 709, premultiplied; no copy")
        .def_property_readonly(
            "z",
            [](const py::object& self) -> py::array {
                const CompositeImage& image = self.cast<CompositeHolder>()->image;
                const py::ssize_t h = image.window.height(), w = image.window.width();
                return arrayView(py::dtype::of<float>(), image.z.data(), {h, w}, {4 * w, 4}, self);
            },
            "(height, width) float32: camera Z of the nearest fragment, scene units; inf = "
            "nothing; "
            "no copy")
        .def(
            "__array__",
            [rgba](const py::object& self, const py::object& dtype) -> py::object {
                const py::array array = rgba(self);
                return dtype.is_none() ? py::object(array) : array.attr("astype")(dtype);
            },
            py::arg("dtype") = py::none())
        .def(
            "save", &saveComposite,
            "save(path, *, background=, exposure=, tone_map=, ...)\n\n"
            "Writes .exr, .png, .jpg or .tif, with the keywords of `peeler flatten`. A picture for "
            "eyes gets an exposure that suits it, and the neutral tone map, unless told otherwise.")
        .def("_repr_png_", [](const CompositeObject& o) { return pngOf(o.image); })
        .def("__repr__", [](const CompositeObject& o) {
            return "<peeler.Composite " + std::to_string(o.image.window.width()) + " x " +
                   std::to_string(o.image.window.height()) + sourceText(o.provenance) + '>';
        });

    py::class_<ImageObject, ImageHolder> image(
        module, "Image",
        "Layers: all fragments of every pixel, front to back, in CSR form. Pixel p (row-major) has "
        "the\nfragments splits[p] up to splits[p + 1]. Arrays are views of the picture, never "
        "copies; what is\nwritten to them is in the picture.");
    defineShared(image);
    image
        .def_property_readonly("z", &zOf,
                               "(n,) float32: camera Z, positive in front, scene units; no copy")
        .def_property_readonly(
            "rgba", &rgbaOf,
            "(n, 4) float16, or float32 of precision='float': linear Rec. 709, premultiplied; no "
            "copy. None of rays")
        .def_property_readonly("opacity", &opacityOf,
                               "(n, 3): of coloured glass, the opacity of each channel, else None; "
                               "no copy")
        .def_property_readonly(
            "splits", &splitsOf,
            "(height * width + 1,) uint32: where each pixel's fragments begin; no "
            "copy")
        .def_property_readonly("channels", &channelNames, "Names of the channels that it has")
        .def_property_readonly(
            "layers", [](const ImageObject& o) { return mostFragments(o.image); },
            "The most fragments that a pixel has")
        .def_property_readonly(
            "complete", [](const ImageObject& o) { return o.plan.complete(); },
            "Whether every fragment is there")
        .def_property_readonly("counts", &countsOf,
                               "(height, width) uint32: fragments of every pixel (made anew)")
        .def_property_readonly(
            "objects", [](const ImageObject& o) { return o.provenance.ids.objects; },
            "Names of the nodes by id - 1, if there are ids")
        .def_property_readonly(
            "materials", [](const ImageObject& o) { return o.provenance.ids.materials; },
            "Names of the materials by id - 1, if there are ids")
        .def("__len__", [](const ImageObject& o) { return o.image.fragments(); })
        .def("__getitem__", &channelOf, py::arg("channel"),
             "A channel by its name ('normal', 'id'): (n, components), or (n,) of one; or a "
             "component of\nit by its name in files ('N.X', 'id.object'). float16 or float32, ids "
             "uint32 (index + 1). No copy")
        .def("__contains__",
             [](const py::object& self, const std::string& name) {
                 try {
                     channelOf(self, name);
                     return true;
                 } catch (const py::key_error&) {
                     return false;
                 }
             })
        .def(
            "dense", &denseOf, py::arg("layers") = py::none(), py::arg("channel") = "z",
            py::arg("fill") = py::none(),
            "dense(layers=None, channel='z', fill=None)\n\n"
            "(height, width, layers), or (height, width, layers, components): the k-th fragment of "
            "every\npixel at [..., k], `fill` where there is none (default: NaN of z, else 0). "
            "layers=None: all")
        .def("positions", &positionsOf,
             "(n, 3) float32: every fragment's place in world space (made anew)")
        .def(
            "layer",
            [](const ImageObject& o, std::uint32_t k) {
                LayeredImage one;
                unlocked([&] { singleLayer(o.image, k, one); });
                return selected(o, std::move(one));
            },
            py::arg("k"), "layer(k): the k-th fragment of every pixel that has one, as an Image")
        .def(
            "nearest",
            [](const ImageObject& o, std::uint32_t layers) {
                LayeredImage kept = o.image;
                unlocked([&] { keepLayers(kept, {.nearest = layers, .listed = {}}); });
                return selected(o, std::move(kept));
            },
            py::arg("layers"), "nearest(layers): the nearest fragments of every pixel, as an Image")
        .def(
            "flatten", &flattened, py::arg("layers") = py::none(), py::arg("tail") = "drop",
            "flatten(layers=None, tail='drop')\n\n"
            "The composite, front to back, in 32-bit float: of all layers, or of the nearest ones; "
            "what is\nbehind those is left out, or with tail='blend' blended as a weighted "
            "average.")
        .def(
            "save", &saveImage,
            "save(path, *, as_=, layout=, compression=, deep_merge=, ...)\n\n"
            "Writes .exr (layers, as_='deep' or as_='composite'), .html, .png, .jpg, .tif with the "
            "keywords\nof `peeler render`, .npz (dense=, fill=) and .ply as `peeler extract` does.")
        .def("_repr_png_",
             [](const ImageObject& o) -> py::object {
                 if (o.image.color.components() < kPlainComponents) return py::none();
                 CompositeImage flat;
                 unlocked([&] { compositeOver(o.image, {}, flat); });
                 return pngOf(flat);
             })
        .def("__repr__", [](const ImageObject& o) {
            std::string text = "<peeler.Image " + std::to_string(o.image.window.width()) + " x " +
                               std::to_string(o.image.window.height()) + sourceText(o.provenance) +
                               ": " + std::to_string(mostFragments(o.image)) + " layers, " +
                               std::to_string(o.image.fragments()) + " fragments";
            for (const std::string& channel : channelNames(o))
                text += ", " + channel;
            return text + (o.plan.complete() ? ">" : ", incomplete>");
        });

    module.def(
        "read", &readImage, py::arg("path"),
        "read(path, *, part=None, view=None, strict=False)\n\n"
        "The layers of an .exr of peeler, in any layout, a deep .exr of any program, or a "
        "flat one as one\nlayer, as an Image. Of other programs' files part names a part, or "
        "a layer of channels, and view a\nview; with strict a warning is an error. Raises "
        "peeler.Error of kind 'input'.");
    module.def(
        "merge_images", &mergeImages, py::arg("images"), py::arg("elements") = false,
        "merge_images(images, elements=False)\n\n"
        "Tiles of one picture side by side, or, with elements=True, the fragments of pictures "
        "of one\ncamera merged by depth.");
    module.def("compare_images", &compareImages, py::arg("a"), py::arg("b"),
               "compare_images(a, b): how far two Images are apart, as `peeler compare --json` has "
               "it.");
}

}  // namespace peeler::python
