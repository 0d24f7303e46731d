// SPDX-License-Identifier: Apache-2.0
// What is found of a scene by the CPU alone: whether parts can be printed, and what surfaces see
// around them.
#include <nlohmann/json.hpp>

#include <peeler/error.h>
#include "cmd/bake/bake_options.h"
#include "cmd/check/check_parts.h"
#include "cmd/check/check_text.h"
#include "cmd/check/part_report.h"
#include "cmd/options/animation_options.h"
#include "cmd/options/capture_options.h"
#include "cmd/python/binding.h"
#include "core/raster/hit_rasterizer.h"

namespace peeler::python {

namespace {

py::object checkScene(const SceneHolder& scene, bool together, double unit,
                      const std::optional<double>& min_wall, const py::object& progress) {
    if (!(unit > 0)) throw Error(ErrorKind::kUsage, "expected metres, greater than 0", "unit");
    const Watch watch(progress);
    cmd::CheckSettings settings;
    settings.together = together;
    settings.metres = unit;
    if (min_wall) settings.least_wall = *min_wall / 1000 / unit;
    nlohmann::ordered_json found;
    unlocked([&] {
        const cmd::CheckReport report =
            cmd::checkParts(scene->posed({}, 0), settings, [&](double share) { watch(share); });
        found = cmd::toJson(report);
    });
    return toPython(found);
}

py::array vectors(std::vector<float>&& values, std::size_t count, std::size_t components) {
    return adopt(std::move(values),
                 {static_cast<py::ssize_t>(count), static_cast<py::ssize_t>(components)});
}

py::dict bakeScene(const SceneHolder& scene, const py::kwargs& keywords) {
    py::dict given = keywords.attr("copy")();
    const Watch watch(Keywords::take(given, "progress"));
    cmd::BakeOptions options;
    cmd::AnimationOptions animation;
    Keywords declared("bake_scene");
    addBakeOptions(declared.options(), options);
    addTimeOptions(declared.options(), animation);
    declared.options().option("--output").required(false);
    declared.parse(given);
    if (!options.output.empty())
        throw Error(ErrorKind::kUsage, "numbers are returned, not written", "output",
                    "peeler.bake() writes files");
    if (options.target == cmd::BakeTarget::kTexture || options.size || options.padding ||
        options.uv_set)
        throw Error(ErrorKind::kUsage, "only vertices are baked into arrays", "target",
                    "peeler.bake() writes textures");
    std::vector<float> values, positions, normals;
    std::vector<VertexRange> ranges;
    std::vector<int> nodes;
    unlocked([&] {
        cmd::checkAnimationOptions(animation);
        const std::vector<int> playing = cmd::chooseAnimations(*scene->scene, animation);
        const PosedScene posed = scene->posed(playing, animation.time.value_or(0));
        BakeSettings settings = options.settings;
        settings.bounces = options.bounces.value_or(settings.bounces);
        if (settings.quantity == BakeQuantity::kIrradiance) cmd::checkBakedLight(posed);
        const VertexReceivers receivers(posed);
        HitRasterizer source(posed);
        CaptureSettings capture;
        capture.faces = options.faces;
        const SurfaceLookup lookup = receivers.lookup();
        values = bake(source, receivers.receivers(), settings, capture, lookup,
                      [&](double share) { watch(share); });
        ranges = receivers.ranges();
        for (const VertexRange& range : ranges)
            nodes.push_back(posed.meshes()[range.instance].node);
        for (const glm::dvec3& p : receivers.receivers().positions)
            for (int c = 0; c < 3; ++c)
                positions.push_back(static_cast<float>(p[c]));
        for (const glm::vec3& n : receivers.receivers().normals)
            for (int c = 0; c < 3; ++c)
                normals.push_back(n[c]);
    });
    const std::size_t count = positions.size() / 3;
    const std::size_t components = componentsOf(options.settings.quantity);
    py::dict result;
    result["values"] = vectors(std::move(values), count, components);
    result["positions"] = vectors(std::move(positions), count, 3);
    result["normals"] = vectors(std::move(normals), count, 3);
    py::list list;
    for (std::size_t i = 0; i < ranges.size(); ++i) {
        py::dict entry;
        entry["node"] = nodes[i];
        entry["instance"] = ranges[i].instance;
        entry["primitive"] = ranges[i].primitive;
        entry["first"] = ranges[i].first;
        entry["count"] = ranges[i].count;
        list.append(entry);
    }
    result["ranges"] = list;
    return result;
}

}  // namespace

void defineFindings(py::module_& module) {
    module.def(
        "check_scene", &checkScene, py::arg("scene"), py::kw_only(), py::arg("together") = false,
        py::arg("unit") = 1.0, py::arg("min_wall") = py::none(), py::arg("progress") = py::none(),
        "check_scene(scene, *, together=False, unit=1.0, min_wall=None, progress=None) -> "
        "dict\n\nWhether parts can be made of it, as `peeler check --json` has it. unit: what "
        "a scene unit is, in metres;\nmin_wall: millimetres.");
    module.def("bake_scene", &bakeScene, py::arg("scene"),
               "bake_scene(scene, *, quantity='ao', directions=256, resolution=512, "
               "max_distance=None, bounces=None, faces='both', animation=None, time=None, "
               "progress=None) -> dict\n\n"
               "What every vertex sees around it, found by the CPU: values (n, 1 or 3) float32, "
               "positions and normals\n(n, 3) of the vertices, world space, and ranges: which of "
               "them are of which node, instance and\nprimitive (first, count). Quantities: ao, "
               "bent-normal, sky-visibility, thickness, irradiance.");
}

}  // namespace peeler::python
