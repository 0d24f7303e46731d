// SPDX-License-Identifier: Apache-2.0
// Rays of Python's Renderer: hits, maps, voxels, parity.
#include <algorithm>

#include "cmd/options/animation_options.h"
#include "cmd/options/capture_job.h"
#include "cmd/options/capture_options.h"
#include "cmd/python/renderer_object.h"
#include "cmd/rays/bundle_options.h"
#include "cmd/rays/ray_map_options.h"
#include "cmd/rays/rays_options.h"
#include "core/rays/ray_maps.h"
#include "core/rays/voxels.h"
#include "formats/rays/hit_columns.h"

namespace peeler::python {

namespace {

/// What all calls that trace rays are asked for.
struct TraceOptions {
    cmd::BundleOptions bundles;
    cmd::AnimationOptions animation;
    std::optional<Faces> faces;
    cmd::Engine engine = cmd::Engine::kAuto;
    bool refine = true;

    void declare(cmd::VerbOptions& verb) {
        addBundleOptions(verb, bundles);
        addTimeOptions(verb, animation);
        addRayFacesOption(verb, faces);
        addEngineOption(verb, engine);
        verb.addFlag("--refine,!--no-refine", refine,
                     "find t anew in double precision from the triangle (default)");
    }
};

/// The keywords of one call.
struct TraceCall {
    TraceCall(const char* name, const py::kwargs& keywords, bool has_camera = true)
        : given(keywords.attr("copy")()), watch(Keywords::take(given, "progress")), declared(name) {
        if (has_camera) takeCamera(given, options.bundles.camera);
        options.declare(declared.options());
    }

    py::dict given;  ///< besides those that are taken
    Watch watch;
    TraceOptions options;
    Keywords declared;
};

/// A scene as rays see it.
struct Traced {
    Traced(const SceneObject& of, const TraceOptions& options, bool inside)
        : animations(cmd::chooseAnimations(*of.scene, options.animation)),
          time(options.animation.time.value_or(0)),
          shown(shownOf(of, animations, time)),
          posed(of.posed(animations, time)) {
        cmd::checkAnimationOptions(options.animation);
        const std::optional<Bounds> found = posed.bounds();
        if (!found)
            throw Error(ErrorKind::kInput, "the scene shows nothing that a ray could hit", of.name);
        bounds = *found;
        const bool camera = options.bundles.usesCamera() || options.bundles.camera.intrinsics;
        capture.faces = options.faces.value_or(camera && !inside ? Faces::kGltf : Faces::kBoth);
        capture.hit_mode = options.refine ? HitMode::kRefined : HitMode::kRaw;
        capture.color_type = PixelType::kFloat;
        capture.depth_clamp = !camera;
        engine = options.engine == cmd::Engine::kCpu  ? RayEngine::kCpu
                 : options.engine == cmd::Engine::kGl ? RayEngine::kGl
                                                      : RayEngine::kAuto;
    }

    std::vector<Bundle> bundles(const SceneObject& of, const TraceOptions& options) const {
        const cmd::BundleOptions& asked = options.bundles;
        const bool camera = asked.usesCamera() || asked.camera.intrinsics;
        if (!asked.camera.intrinsics) cmd::checkBundleOptions(asked);
        if (!camera) return cmd::parallelBundles(asked, bounds);
        checkCamera(asked.camera);
        return {{"camera", of.view(posed, animations, asked.camera)}};
    }

    std::vector<int> animations;
    double time;
    Shown shown;
    PosedScene posed;
    Bounds bounds;
    CaptureSettings capture = raySettings();
    RayEngine engine = RayEngine::kAuto;
};

/// A share of several bundles.
Progress shareOf(const Watch& watch, std::size_t index, std::size_t count) {
    return [&watch, index, count](double share) {
        watch(std::min(1.0, (static_cast<double>(index) + share) / static_cast<double>(count)));
    };
}

std::vector<std::string> columnNames(const std::string& list) {
    std::vector<std::string_view> names;
    for (const HitColumn& column : hitColumns())
        names.push_back(column.name);
    if (list == "all") return {};
    const auto chosen = cmd::listedNames("column", list, names);
    return {chosen.begin(), chosen.end()};
}

std::shared_ptr<HitsObject> traceRays(RendererObject& self, const SceneHolder& scene,
                                      const py::kwargs& keywords) {
    TraceCall call("rays", keywords);
    const TraceOptions& options = call.options;
    auto hits = std::make_shared<HitsObject>();
    std::vector<std::string>& columns = hits->columns;
    addValue(call.declared.options(), "--columns", "LIST|all", columns, columnNames,
             "what every hit has (default: all)");
    call.declared.parse(call.given);
    hits->scene = scene;
    self.use([&](Renderer& renderer) {
        Traced traced(*scene, options, false);
        traced.capture.channels = channelsOf(chosenHitColumns(columns));
        hits->animations = traced.animations;
        hits->time = traced.time;
        hits->bundles = traced.bundles(*scene, options);
        hits->provenance = provenanceOf(*scene, traced.animations, traced.time, traced.capture, {});
        hits->provenance.method = "rays";
        for (std::size_t i = 0; i < hits->bundles.size(); ++i) {
            auto image = std::make_shared<ImageObject>();
            image->image =
                renderer.rays(traced.shown, hits->bundles[i], traced.capture, traced.engine,
                              shareOf(call.watch, i, hits->bundles.size()));
            image->plan.view = hits->bundles[i].view;
            image->plan.fragments_counted = image->plan.fragments_stored = image->image.fragments();
            image->provenance = hits->provenance;
            hits->images.push_back(std::move(image));
        }
    });
    return hits;
}

py::list traceMaps(RendererObject& self, const SceneHolder& scene, const py::kwargs& keywords) {
    TraceCall call("ray_maps", keywords);
    const TraceOptions& options = call.options;
    cmd::RayMapFlags flags;
    addRayMapOptions(call.declared.options(), flags);
    call.declared.parse(call.given);
    if (flags.maps.empty())
        throw Error(ErrorKind::kUsage, "no map is asked for", "map",
                    "map=['thickness'], or first, last, count, path-length, transmission, parity, "
                    "overlap");
    struct Map {
        std::string name;
        std::vector<float> values;
    };
    std::vector<std::pair<Window, std::vector<Map>>> found;
    self.use([&](Renderer& renderer) {
        cmd::checkRayMapFlags(flags);
        const bool inside = needsSolids(flags.maps);
        const Traced traced(*scene, options, inside);
        const RayMapOptions asked = cmd::rayMapOptions(flags, *scene->scene);
        std::optional<Solids> solids;
        if (inside) solids.emplace(traced.posed);
        const RayMaps maps(traced.posed, solids ? &*solids : nullptr, asked.settings);
        const std::vector<Bundle> bundles = traced.bundles(*scene, options);
        for (std::size_t i = 0; i < bundles.size(); ++i) {
            const LayeredImage hits =
                renderer.rays(traced.shown, bundles[i], traced.capture, traced.engine,
                              shareOf(call.watch, i, bundles.size()));
            std::vector<float> planes;
            maps.evaluateRows(bundles[i], hits, hits.window.y0, hits.window.y1, planes);
            auto& [window, of_bundle] = found.emplace_back();
            window = hits.window;
            const auto rays = static_cast<std::ptrdiff_t>(window.pixels());
            for (std::size_t c = 0; c < maps.channels().size(); ++c) {
                const auto first = planes.begin() + static_cast<std::ptrdiff_t>(c) * rays;
                of_bundle.push_back({maps.channels()[c].name, {first, first + rays}});
            }
        }
    });
    py::list list;
    for (auto& [window, maps] : found) {
        py::dict named;
        for (Map& map : maps)
            named[map.name.c_str()] =
                adopt(std::move(map.values), {window.height(), window.width()});
        list.append(named);
    }
    return list;
}

py::dict traceVoxels(RendererObject& self, const SceneHolder& scene, const py::object& voxels,
                     const py::kwargs& keywords) {
    TraceCall call("voxels", keywords, false);
    const TraceOptions& options = call.options;
    call.declared.parse(call.given);
    RayGrid grid;
    grid.resolution = voxels.cast<int>();
    if (grid.resolution < 1 || grid.resolution > 4096)
        throw Error(ErrorKind::kUsage, "expected 1 to 4096 cells along the longest side", "voxels");
    AxisBundles lattice;
    std::vector<std::uint8_t> inside, votes;
    std::uint64_t occupied = 0, disputed = 0;
    self.use([&](Renderer& renderer) {
        const Traced traced(*scene, options, true);
        lattice = axisBundles(options.bundles.bounds.value_or(traced.bounds), traced.bounds, grid);
        const Solids solids(traced.posed);
        VoxelVotes found(lattice, solids);
        for (std::size_t axis = 0; axis < 3; ++axis)
            found.add(axis, lattice.bundles[axis],
                      renderer.rays(traced.shown, lattice.bundles[axis], traced.capture,
                                    traced.engine, shareOf(call.watch, axis, 3)));
        found.finish();
        const std::size_t plane =
            static_cast<std::size_t>(lattice.cells.y) * static_cast<std::size_t>(lattice.cells.z);
        inside.resize(plane * static_cast<std::size_t>(lattice.cells.x));
        votes.resize(inside.size());
        for (int x = 0; x < lattice.cells.x; ++x) {
            const std::size_t first = plane * static_cast<std::size_t>(x);
            found.insideAt(x, std::span(inside).subspan(first, plane));
            found.votesAt(x, std::span(votes).subspan(first, plane));
        }
        occupied = found.occupied();
        disputed = found.disputed();
    });
    const std::vector<py::ssize_t> shape{lattice.cells.x, lattice.cells.y, lattice.cells.z};
    py::dict result;
    result["occupancy"] = adopt(std::move(inside), shape);
    result["votes"] = adopt(std::move(votes), shape);
    result["corner"] =
        adopt(std::vector<double>{lattice.corner.x, lattice.corner.y, lattice.corner.z}, {3});
    result["spacing"] = lattice.spacing;
    result["occupied"] = occupied;
    result["disputed"] = disputed;
    result["volume"] =
        static_cast<double>(occupied) * lattice.spacing * lattice.spacing * lattice.spacing;
    return result;
}

py::dict traceParity(RendererObject& self, const SceneHolder& scene, const py::kwargs& keywords) {
    TraceCall call("parity", keywords);
    const TraceOptions& options = call.options;
    call.declared.parse(call.given);
    py::dict result;
    py::list entries;
    std::optional<Traced> traced;
    std::optional<Solids> solids;
    std::optional<Parity> parity;
    std::uint64_t rays = 0;
    self.use([&](Renderer& renderer) {
        traced.emplace(*scene, options, true);
        solids.emplace(traced->posed);
        parity.emplace(*solids);
        const std::vector<Bundle> bundles = traced->bundles(*scene, options);
        for (std::size_t i = 0; i < bundles.size(); ++i) {
            rays += bundles[i].rays();
            parity->add(i, renderer.rays(traced->shown, bundles[i], traced->capture, traced->engine,
                                         shareOf(call.watch, i, bundles.size())));
        }
    });
    for (const auto& [index, found] : parity->solids()) {
        const Solid& solid = solids->all()[index];
        py::dict entry;
        entry["node"] = nodeName(*scene->scene, static_cast<std::size_t>(solid.node));
        entry["node_index"] = solid.node;
        entry["instance"] = solid.instance;
        entry["triangles"] = solid.triangles;
        entry["open_edges"] = solid.open_edges;
        entry["rays"] = found.rays;
        entry["odd_rays"] = found.odd;
        entries.append(entry);
    }
    result["holds"] = parity->holds();
    result["rays"] = rays;
    result["odd_rays"] = parity->oddRays();
    result["solids"] = entries;
    return result;
}

}  // namespace

void defineTracing(py::class_<RendererObject, std::shared_ptr<RendererObject>>& type,
                   const std::string& camera) {
    const std::string rays =
        "rays(scene, **keywords) -> Hits\n\nAll hits of bundles of rays: direction=(x, y, z) or "
        "several of them, directions=N (over the sphere),\nhemisphere, directions_file, axes=True, "
        "or a camera's pixels. resolution (rays along the longer side),\nspacing, bounds; refine, "
        "faces, engine ('auto', 'cpu', 'gl'), columns (names of Hits, or 'all').\n\n" +
        camera;
    type.def("rays", &traceRays, py::arg("scene"), rays.c_str())
        .def(
            "ray_maps", &traceMaps, py::arg("scene"),
            "ray_maps(scene, *, map, attenuation=None, part=None, **rays) -> list of dict\n\n"
            "Maps of each bundle by name, (height, width) float32: first, last (inf without hits), "
            "count,\nthickness, path-length (path.MATERIAL), transmission (attenuation={'steel': "
            "mu}), parity, overlap\n(part=['A*', 'B*']). Lengths in scene units. The rays are "
            "those "
            "of rays().")
        .def(
            "voxels", &traceVoxels, py::arg("scene"), py::arg("voxels"),
            "voxels(scene, voxels, *, bounds=None, ...) -> dict\n\n"
            "Which cells of a lattice, `voxels` along its longest side, are inside: occupancy and "
            "votes (uint8,\n(nx, ny, nz)), corner (3,), spacing, occupied, disputed, volume; scene "
            "units.")
        .def("parity", &traceParity, py::arg("scene"),
             "parity(scene, **rays) -> dict\n\n"
             "Whether what rays enter they leave: holds, rays, odd_rays, and the solids with node, "
             "open_edges,\nodd_rays and so on.");
}

}  // namespace peeler::python
