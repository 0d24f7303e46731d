// SPDX-License-Identifier: Apache-2.0
// Renderer of Python: pictures by the library's Renderer, with the command line's options as
// keywords.
#include <algorithm>

#include <peeler/error.h>
#include <peeler/image_sink.h>
#include "cmd/machine/resources.h"
#include "cmd/options/animation_options.h"
#include "cmd/options/capture_job.h"
#include "cmd/options/capture_options.h"
#include "cmd/options/clip_options.h"
#include "cmd/python/renderer_object.h"
#include "cmd/render/channel_options.h"
#include "cmd/render/render_request.h"
#include "core/gl/context.h"
#include "formats/file/content_hash.h"

namespace peeler::python {

namespace {

std::shared_ptr<RendererObject> makeRenderer(const py::dict& given) {
    gl::ContextRequest request;
    CaptureSettings capture;
    int threads = 0;
    // "auto" is what the command line means by leaving it out.
    if (given.contains("device") && py::str("auto").equal(given["device"]))
        given["device"] = py::none();
    Keywords keywords("Renderer");
    addMachineOptions(keywords.options(), request, threads, capture,
                      "a picture is rendered in bands that fit, if it does not go into one; of "
                      "what a call takes beyond what the process holds");
    keywords.parse(given);
    RendererOptions options;
    options.backend = request.backend;
    options.device = request.device.text();
    options.require_gpu = request.require_gpu;
    options.memory = capture.memory;
    if (threads != 0) cmd::setThreads(threads);
    return std::make_shared<RendererObject>(options);
}

/// What a picture is asked for, as `peeler render` has it.
struct PictureOptions {
    cmd::AnimationOptions animation;
    cmd::CameraOptions camera;
    CaptureSettings capture;
    cmd::ClipOptions clip;
    cmd::ChannelOptions channels;
    std::optional<int> shadow_size;
    bool strict = false;
};

struct AskedPicture {
    Shown shown;
    View view;
    CaptureSettings capture;
    Provenance provenance;
    bool strict = false;
};

void checkComplete(const AskedPicture& asked, const Plan& plan) {
    if (!asked.strict || plan.complete()) return;
    throw Error(ErrorKind::kIncomplete,
                "the layer limit leaves out " +
                    std::to_string(plan.fragments_counted - plan.fragments_stored) +
                    " fragments of " + std::to_string(plan.fragments_counted),
                "strict", "leave `max_layers` and `occlusion_ratio` out");
}

/// Reads the keywords, and makes of them what is to be captured.
AskedPicture askedPicture(const char* call, const SceneObject& scene, py::dict given,
                          bool composite) {
    PictureOptions options;
    takeCamera(given, options.camera);
    Keywords keywords(call);
    cmd::VerbOptions& declared = keywords.options();
    addCameraOptions(declared, options.camera);
    addTimeOptions(declared, options.animation);
    addLayerOptions(declared, options.capture);
    addClipOptions(declared, options.clip);
    addLightOptions(declared, options.capture, options.shadow_size);
    if (!composite) addChannelOptions(declared, options.channels);
    declared.addFlag("--strict", options.strict, "fail rather than leave fragments out");
    keywords.parse(given);
    if (options.channels.manifest)
        throw Error(ErrorKind::kUsage, "names are in Image.objects and Image.materials", "manifest",
                    "leave it out");

    return unlocked([&] {
        cmd::checkAnimationOptions(options.animation);
        checkCamera(options.camera);
        cmd::checkClipOptions(options.clip);
        AskedPicture asked;
        asked.capture = options.capture;
        asked.capture.composite = composite;
        asked.capture.channels = cmd::capturedChannels(options.channels);
        cmd::setShadowSize(asked.capture, options.shadow_size);
        const std::vector<int> playing = cmd::chooseAnimations(*scene.scene, options.animation);
        const double time = options.animation.time.value_or(0);
        asked.shown = shownOf(scene, playing, time);
        const PosedScene posed = scene.posed(playing, time);
        asked.view = scene.view(posed, playing, options.camera);
        asked.capture.clip = cmd::clipVolume(options.clip, posed);
        asked.capture.tinted = cmd::wantsTint(scene.appearance, posed);
        double motion_rate = 0;
        if (options.channels.wants(Channel::kMotion)) {
            if (!playing.empty())
                throw Error(ErrorKind::kUsage, "motion is measured from frame to frame",
                            "channels motion", "peeler.render() with frames does that");
            motion_rate = cmd::momentsOf(options.animation).front().motion_rate;
        }
        asked.provenance =
            provenanceOf(scene, playing, time, asked.capture, asked.view.crop, motion_rate);
        if (options.camera.tile) asked.provenance.tile = options.camera.tile->text();
        asked.strict = options.strict;
        return asked;
    });
}

ImageHolder renderLayers(RendererObject& self, const SceneHolder& scene,
                         const py::kwargs& keywords) {
    py::dict given = keywords.attr("copy")();
    const Watch watch(Keywords::take(given, "progress"));
    AskedPicture asked = askedPicture("layers", *scene, std::move(given), false);
    auto object = std::make_shared<ImageObject>();
    self.use([&](Renderer& renderer) {
        ImageSink sink;
        object->plan = renderer.capture(asked.shown, asked.view, asked.capture, sink, watch);
        checkComplete(asked, object->plan);
        asked.provenance.renderer = renderer.device();
        object->image = std::move(sink.image);
    });
    object->provenance = std::move(asked.provenance);
    return object;
}

CompositeHolder renderComposite(RendererObject& self, const SceneHolder& scene,
                                const py::kwargs& keywords) {
    py::dict given = keywords.attr("copy")();
    const Watch watch(Keywords::take(given, "progress"));
    AskedPicture asked = askedPicture("composite", *scene, std::move(given), true);
    auto object = std::make_shared<CompositeObject>();
    self.use([&](Renderer& renderer) {
        ImageSink sink;
        object->plan = renderer.capture(asked.shown, asked.view, asked.capture, sink, watch);
        checkComplete(asked, object->plan);
        compositeOver(sink.image, {}, object->image);
        asked.provenance.renderer = renderer.device();
    });
    object->provenance = std::move(asked.provenance);
    return object;
}

std::string rendererText(const RendererObject& self) {
    return self.closed() ? "<peeler.Renderer, closed>" : "<peeler.Renderer>";
}

}  // namespace

/// The scene as it is seen. The scene lives as long as the result.
Shown shownOf(const SceneObject& scene, const std::vector<int>& animations, double time) {
    Shown shown;
    shown.scene = scene.scene;
    shown.index = scene.index;
    shown.animations = animations;
    shown.time = time;
    shown.colored_glass = scene.appearance.transmission == cmd::Transmitted::kColor;
    return shown;
}

/// Where it comes from, as the files of `peeler render` say it.
Provenance provenanceOf(const SceneObject& scene, const std::vector<int>& animations, double time,
                        const CaptureSettings& capture, const Window& crop, double motion_rate) {
    Provenance provenance;
    provenance.version = PEELER_VERSION;
    provenance.method = capture.method;
    provenance.surfaces = cmd::nameOf<Surfaces>(cmd::kSurfaces, capture.surfaces);
    provenance.scene = scene.name;
    provenance.scene_hash = hexText(scene.scene->content_hash);
    nlohmann::json more = cmd::appearanceSettings(scene.appearance, *scene.scene);
    if (const auto& ignored = scene.shown.reading.ignored_extensions; !ignored.empty())
        more["ignoredExtensions"] = ignored;
    const bool points = std::ranges::any_of(scene.scene->meshes, [](const Mesh& mesh) {
        return std::ranges::any_of(mesh.primitives, [](const Primitive& primitive) {
            return primitive.topology == Topology::kPoints;
        });
    });
    if (capture.point_size != 1 && points) more["pointSize"] = capture.point_size;
    provenance.settings = cmd::settingsText(
        {scene.index, animations, scene.shown.include, scene.shown.exclude, motion_rate, crop},
        capture, more);
    provenance.settings_hash = hashText(provenance.settings);
    provenance.time = time;
    if (std::ranges::find(capture.channels, Channel::kId) != capture.channels.end())
        provenance.ids = idNames(*scene.scene);
    return provenance;
}

void defineRenderer(py::module_& module) {
    constexpr const char* kCamera =
        "Camera: camera (name or index), or eye, target, up, fov (degrees) or ortho_height; or\n"
        "K=(3, 3) in pixels (OpenCV: x right, y down, (0, 0) the centre of the first pixel; "
        "pixel_center=0.5\nif that is at (0.5, 0.5), as of pyrender and COLMAP) and "
        "world_to_camera=(4, 4) (OpenCV: z forward),\nor gltf=(4, 4), camera to world as glTF and "
        "pyrender have it (-Z forward, +Y up). near, far, size=(width,\nheight), crop=(x, y, "
        "width, "
        "height), tile='1/4'.\n"
        "Time: animation, time (seconds).\n"
        "progress: called with the share that is done, 0 to 1; what it raises ends the work.\n";
    const std::string camera = kCamera;
    const std::string layers =
        "layers(scene, **keywords) -> Image\n\nAll fragments of every pixel, sorted by depth. "
        "Keywords are those of `peeler render`.\n\n" +
        camera +
        "Layers: method, layers (nearest ones), occlusion_ratio, samples, surfaces, faces, "
        "shading,\n"
        "point_size, precision ('half', 'float'); clip_box, clip_plane, clip_mesh, clip; shadows, "
        "shadow_size;\nchannels: a list of normal, geometric-normal, position, uv, tangent, "
        "base-color, emissive,\nroughness-metallic, facing, motion, id, barycentric, distance; or "
        "'all'.\n\nRaises peeler.Error: 'usage', 'device', 'memory'. After an error it can be used "
        "on.";
    const std::string composite =
        "composite(scene, **keywords) -> Composite\n\nWhat layers() and flatten() come to, without "
        "the layers being kept; by method='dual' and so on,\nalso by approximations "
        "('weighted-average', 'weighted-sum', 'unsorted').\n\n" +
        camera +
        "The other keywords are those of layers(), tail ('drop', 'blend') and no channels.";
    py::class_<RendererObject, std::shared_ptr<RendererObject>> type(
        module, "Renderer",
        "Renderer(*, device='auto', backend='auto', memory=None, require_gpu=False, "
        "threads=None)\n\n"
        "Renders any number of pictures of any number of scenes; the scene that was rendered last "
        "stays\nuploaded. Use it in a `with` block, or close() it. It has a thread and a GL "
        "context "
        "of its own: yours\nare never touched, and calls from several threads wait for each other. "
        "Python runs on while it\nrenders. Ctrl-C ends a render, and leaves it usable.\n\n"
        "device: 'auto', or as peeler.devices() lists them: 3, 'cuda:1', 'uuid:8932f937'\n"
        "memory: most bytes that a call takes beyond what the process holds: '2G', 512_000_000\n"
        "threads: of all Renderers of this process together");
    type.def(py::init([](const py::kwargs& keywords) {
            return makeRenderer(py::dict(keywords.attr("copy")()));
        }))
        .def("layers", &renderLayers, py::arg("scene"), layers.c_str())
        .def("composite", &renderComposite, py::arg("scene"), composite.c_str())
        .def_property_readonly(
            "device",
            [](RendererObject& self) {
                return self.use([](Renderer& renderer) { return renderer.device(); });
            },
            "GL_RENDERER of the device. Raises peeler.Error of kind 'device' if there is none")
        .def("close", &RendererObject::close, "Gives the GL context back.")
        .def("__enter__", [](const py::object& self) { return self; })
        .def("__exit__", [](RendererObject& self, const py::args&) { self.close(); })
        .def("__repr__", &rendererText);
    defineTracing(type, camera);
}

}  // namespace peeler::python
