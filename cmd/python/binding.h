// SPDX-License-Identifier: Apache-2.0
// What the parts of the Python module share: scenes, pictures and hits as Python holds them, errors
// and interrupts on their way through, and keywords, which are the command line's options.
#pragma once

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include <chrono>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include <peeler/bundle.h>
#include <peeler/composite.h>
#include <peeler/layered_image.h>
#include <peeler/sink.h>
#include "cmd/cli/arguments.h"
#include "cmd/options/camera_options.h"
#include "cmd/options/scene_options.h"
#include "core/scene/framing.h"
#include "core/scene/posed_scene.h"

// Everything here is the module's own: pybind11's types are hidden, too.
#pragma GCC visibility push(hidden)

namespace peeler::python {

namespace py = pybind11;

// module.cpp: errors, interrupts, results.

/// What is done without Python's lock, which it must not need. What it throws is passed on as
/// Python's peeler.Error, whose texts say keywords where the command line says options.
template <class Work>
auto unlocked(Work&& work) {
    const py::gil_scoped_release release;
    return work();
}

/// Looks, on the thread that it is called on, at what a person or a program has to say while work
/// goes on without Python's lock: signals (Ctrl-C), and a callback for progress, called with the
/// share that is done, 0 to 1. What either raises is thrown, and ends the work.
class Watch {
  public:
    /// `progress`: a callable or None.
    explicit Watch(py::object progress);

    /// At most every few hundredths of a second; the last share, 1, always.
    void operator()(double share) const;

  private:
    /// Dropped with Python's lock held.
    std::shared_ptr<py::object> progress_;
    std::shared_ptr<std::chrono::steady_clock::time_point> last_;
};

/// JSON as dicts, lists, strings and numbers.
py::object toPython(const std::string& json);
py::object toPython(const nlohmann::ordered_json& json);

/// A warning of Python for each sentence. Throws where warnings are errors.
void warn(const std::vector<std::string>& sentences);

void defineVerbs(py::module_& module);

// keywords.cpp

/// The keywords of a call. They are declared as the options of a verb, so that names, defaults,
/// what they take and what is refused are the command line's: "--ortho-height" is ortho_height.
/// True and False are flags and their opposites, None is left out, sequences are joined by commas
/// ("x" for a size), and numbers keep all their digits.
class Keywords {
  public:
    /// `call` is the function's name, for messages.
    explicit Keywords(const std::string& call);

    cmd::VerbOptions& options() { return options_; }

    /// Takes a keyword that is no option out of `given`; None if it is not there.
    static py::object take(py::dict& given, const char* name);

    /// Sets the targets of all options. Throws TypeError for a keyword that is none, with the
    /// nearest name; Error (kUsage) for a value that cannot be.
    void parse(const py::dict& given, const std::vector<std::string>& files = {});

    /// What the options are, for help.
    cmd::CommandDescription describe() const { return parser_.describe(); }

  private:
    std::string call_;
    cmd::ArgumentParser parser_;
    cmd::VerbOptions options_;
};

/// Options as arguments of a command line: "--size=640x480", …; `files` come first.
std::vector<std::string> asArguments(const std::string& call,
                                     const std::vector<cmd::OptionDescription>& options,
                                     const py::dict& given, const std::vector<std::string>& files);

/// A path of any kind that Python has (str, bytes, PathLike).
std::string pathOf(const py::object& path);

/// A text of the command line in the words of Python: "--ortho-height" as ortho_height.
std::string inKeywords(const std::string& text);

/// The keywords that describe an option: "ortho_height".
std::string keywordOf(const std::string& option);

// scenes.cpp

/// A scene as Python holds it: never changed, shared with whoever renders it.
struct SceneObject {
    std::shared_ptr<const Scene> scene;
    int index = 0;
    std::string name;            ///< of its file, without the folder; "" of arrays
    std::filesystem::path path;  ///< "" of arrays
    cmd::SceneOptions shown;     ///< what was chosen of it
    cmd::AppearanceOptions appearance;

    /// The scene at a time of these animations. It refers to the scene.
    PosedScene posed(const std::vector<int>& animations, double time) const;
    /// The view, framed once for all times of what moves; what that takes is kept.
    View view(const PosedScene& posed, const std::vector<int>& animations,
              const cmd::CameraOptions& camera) const;

  private:
    mutable std::mutex mutex_;
    mutable std::map<std::vector<int>, SceneExtent> extents_;
};
using SceneHolder = std::shared_ptr<SceneObject>;

/// What keywords that are no options say of a camera: K, world_to_camera, gltf, pixel_center.
void takeCamera(py::dict& given, cmd::CameraOptions& camera);

void defineScenes(py::module_& module);

// images.cpp

/// A picture as Python holds it; its arrays are views of this.
struct ImageObject {
    LayeredImage image;
    Plan plan;
    Provenance provenance;
};
using ImageHolder = std::shared_ptr<ImageObject>;

struct CompositeObject {
    CompositeImage image;
    Plan plan;
    Provenance provenance;
};
using CompositeHolder = std::shared_ptr<CompositeObject>;

/// A view of numbers that `base`, a Python object, holds: no copy is made. It can be written, which
/// changes what is held: DLPack knows no other arrays.
py::array arrayView(const py::dtype& type, const void* data, std::vector<py::ssize_t> shape,
                    std::vector<py::ssize_t> strides, const py::object& base);
/// An array that owns `values`.
template <class T>
py::array adopt(std::vector<T>&& values, std::vector<py::ssize_t> shape) {
    auto* const kept = new std::vector<T>(std::move(values));
    const py::capsule owner(kept, [](void* p) { delete static_cast<std::vector<T>*>(p); });
    return py::array(py::dtype::of<T>(), std::move(shape), {}, kept->data(), owner);
}
py::dtype dtypeOf(PixelType type);

/// Writes to a file by its ending, with the keywords of `peeler render` that say how. `bands` is
/// called with the writer.
void saveTo(const std::string& call, const py::object& path, const py::dict& given,
            const Plan& plan, const Provenance& provenance, bool composited,
            const std::function<void(Sink&)>& bands);
/// The pictures of Jupyter: PNG, at most some 1000 pixels wide, for eyes.
py::bytes pngOf(const CompositeImage& picture);

void defineImages(py::module_& module);

// image_files.cpp

/// A picture made of another one: its view and its provenance, with these fragments.
ImageHolder selected(const ImageObject& from, LayeredImage&& image);
void saveImage(const ImageObject& object, const py::object& path, const py::kwargs& keywords);
void saveComposite(const CompositeObject& object, const py::object& path,
                   const py::kwargs& keywords);
ImageHolder readImage(const py::object& path, const py::kwargs& keywords);
/// Elements by depth, or tiles side by side.
ImageHolder mergeImages(const std::vector<ImageHolder>& images, bool elements);
/// How far two pictures are apart, as `peeler compare --json` says it.
py::object compareImages(const ImageObject& a, const ImageObject& b);

// rays.cpp

/// All hits of bundles of rays of a scene.
struct HitsObject {
    SceneHolder scene;
    std::vector<int> animations;
    double time = 0;
    std::vector<Bundle> bundles;
    std::vector<ImageHolder> images;  ///< of each bundle: z, keys, channels
    std::vector<std::string> columns;
    Provenance provenance;
};

void defineHits(py::module_& module);

// renderer.cpp

void defineRenderer(py::module_& module);

// findings.cpp: what is found of a scene without a Renderer.

void defineFindings(py::module_& module);

}  // namespace peeler::python

#pragma GCC visibility pop
