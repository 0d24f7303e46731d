// SPDX-License-Identifier: Apache-2.0
// Hits of Python: the columns of `peeler rays`, made of what was captured when they are asked for.
#include <numeric>

#include <peeler/error.h>
#include "cmd/options/output_checks.h"
#include "cmd/options/output_options.h"
#include "cmd/python/binding.h"
#include "core/base/parallel.h"
#include "core/image/layers.h"
#include "core/rays/point_hits.h"
#include "formats/rays/hit_columns.h"
#include "formats/rays/ray_output.h"

namespace peeler::python {

namespace {

using HitsHolder = std::shared_ptr<HitsObject>;

std::uint64_t hitsOf(const HitsObject& hits) {
    std::uint64_t sum = 0;
    for (const ImageHolder& image : hits.images)
        sum += image->image.fragments();
    return sum;
}

py::dtype dtypeOfColumn(const HitColumn& column) {
    return py::dtype(std::string(infoOf(column.type).numpy));
}

const HitColumn& columnNamed(const HitsObject& hits, const std::string& name) {
    std::string there;
    for (const HitColumn& column : hitColumns()) {
        const bool chosen = hits.columns.empty() ||
                            std::ranges::find(hits.columns, column.name) != hits.columns.end();
        if (chosen && column.name == name) return column;
        if (chosen) there += (there.empty() ? "" : ", ") + std::string(column.name);
    }
    throw py::key_error("no column '" + name + "'; there are " + there);
}

/// A column of all hits, bundle after bundle, as a .npz of `peeler rays` has it.
py::object columnOf(const HitsObject& hits, const std::string& name) {
    const HitColumn& column = columnNamed(hits, name);
    std::vector<py::ssize_t> shape{static_cast<py::ssize_t>(hitsOf(hits))};
    if (column.components() > 1) shape.push_back(static_cast<py::ssize_t>(column.components()));
    py::array values = py::module_::import("numpy").attr("empty")(shape, dtypeOfColumn(column));
    auto* const out = static_cast<std::byte*>(values.mutable_data());
    unlocked([&] {
        const HitReader reader(hits.scene->posed(hits.animations, hits.time));
        std::size_t before = 0;
        for (std::size_t i = 0; i < hits.bundles.size(); ++i) {
            const LayeredImage& image = hits.images[i]->image;
            reader.read(hits.bundles[i], image, [&](const HitBatch& batch) {
                column.put(batch, out + (before + batch.first) * column.bytes(), column.bytes());
            });
            before += image.fragments();
        }
    });
    return values;
}

/// Of a lone bundle the capture's own, else of all rays one after the other.
py::object splitsOfHits(const py::object& self) {
    const HitsHolder hits = self.cast<HitsHolder>();
    if (hits->images.size() == 1) return py::cast(hits->images.front()).attr("splits");
    std::vector<std::int64_t> splits{0};
    for (const ImageHolder& image : hits->images) {
        const std::int64_t before = splits.back();
        const std::vector<std::uint32_t>& offsets = image->image.offsets;
        for (std::size_t r = 1; r < offsets.size(); ++r)
            splits.push_back(before + offsets[r]);
    }
    const auto count = static_cast<py::ssize_t>(splits.size());
    return adopt(std::move(splits), {count});
}

py::object zOfHits(const py::object& self) {
    const HitsHolder hits = self.cast<HitsHolder>();
    if (hits->images.size() == 1) return py::cast(hits->images.front()).attr("z");
    std::vector<float> z;
    for (const ImageHolder& image : hits->images)
        z.insert(z.end(), image->image.z.begin(), image->image.z.end());
    const auto count = static_cast<py::ssize_t>(z.size());
    return adopt(std::move(z), {count});
}

py::object vectorArray(const glm::dvec3& v) {
    return adopt(std::vector<double>{v.x, v.y, v.z}, {3});
}

py::list bundlesOf(const HitsObject& hits) {
    py::list list;
    for (const Bundle& bundle : hits.bundles) {
        py::dict entry;
        entry["name"] = bundle.name;
        entry["parallel"] = bundle.parallel();
        entry["origin"] = vectorArray(bundle.origin());
        entry["direction"] = vectorArray(bundle.direction());
        entry["right"] = vectorArray(bundle.right());
        entry["up"] = vectorArray(bundle.up());
        entry["size"] = py::make_tuple(bundle.size().x, bundle.size().y);
        entry["shape"] = py::make_tuple(bundle.view.crop.height(), bundle.view.crop.width());
        list.append(entry);
    }
    return list;
}

void saveHits(const HitsObject& hits, const py::object& path, bool double_) {
    const std::string file = pathOf(path);
    unlocked([&] {
        checkHitFormat(file);
        cmd::OutputRequest request;
        request.path = file;
        cmd::checkTarget(request, {});
        const std::unique_ptr<RayOutput> output =
            makeHitOutput(file, {.posed = hits.scene->posed(hits.animations, hits.time),
                                 .provenance = hits.provenance,
                                 .comment = "hits in world space, +Y up, by peeler " PEELER_VERSION,
                                 .double_positions = double_,
                                 .columns = hits.columns});
        std::vector<std::uint64_t> counts;
        for (const ImageHolder& image : hits.images)
            counts.push_back(image->image.fragments());
        output->begin(hits.bundles, counts);
        for (std::size_t i = 0; i < hits.images.size(); ++i)
            output->take(i, hits.images[i]->image);
        output->finish();
    });
}

/// The hits next to points, before and after each along every parallel bundle.
py::dict nextTo(const HitsObject& hits,
                const py::array_t<double, py::array::c_style | py::array::forcecast>& points) {
    if (points.ndim() != 2 || points.shape(1) != 3)
        throw Error(ErrorKind::kUsage, "expected an array of shape (n, 3)", "points");
    const auto count = static_cast<std::size_t>(points.shape(0));
    std::vector<glm::dvec3> at(count);
    for (std::size_t i = 0; i < count; ++i)
        at[i] = {points.data()[3 * i], points.data()[3 * i + 1], points.data()[3 * i + 2]};
    std::vector<double> before, after;
    unlocked([&] {
        const PosedScene posed = hits.scene->posed(hits.animations, hits.time);
        for (std::size_t i = 0; i < hits.bundles.size(); ++i) {
            if (!hits.bundles[i].parallel())
                throw Error(ErrorKind::kUsage, "points have hits next to them along parallel rays",
                            "camera", "trace along a direction");
            std::vector<PointHits> found(count);
            findPointHits(posed, hits.bundles[i], hits.images[i]->image, at, found);
            for (const PointHits& hit : found) {
                before.push_back(hit.before.distance);
                after.push_back(hit.after.distance);
            }
        }
    });
    const std::vector<py::ssize_t> shape{static_cast<py::ssize_t>(hits.bundles.size()),
                                         points.shape(0)};
    py::dict result;
    result["t_before"] = adopt(std::move(before), shape);
    result["t_after"] = adopt(std::move(after), shape);
    return result;
}

}  // namespace

void defineHits(py::module_& module) {
    py::class_<HitsObject, HitsHolder>(
        module, "Hits",
        "All hits of bundles of rays in CSR form: ray r has the hits splits[r] up to splits[r + "
        "1], "
        "nearest\nfirst, bundle after bundle, the rays of each row by row. Columns, by hits[name], "
        "have the names and\nnumbers of `peeler rays -o hits.npz`: t_hit (from where the ray "
        "starts), geometry_ids, primitive_ids,\nprimitive_uvs, facing, normals, primitive_normals, "
        "node_ids, mesh_ids, instance_ids, material_ids.")
        .def_property_readonly("splits", &splitsOfHits,
                               "(rays + 1,): uint32 of one bundle, no copy; int64 of several")
        .def_property_readonly(
            "z", &zOfHits,
            "(n,) float32: depth along the bundle's direction, scene units; of one "
            "bundle no copy")
        .def_property_readonly(
            "t", [](const HitsObject& hits) { return columnOf(hits, "t_hit"); },
            "(n,) float32: distance from where the ray starts, scene units")
        .def_property_readonly(
            "columns",
            [](const HitsObject& hits) {
                if (!hits.columns.empty()) return hits.columns;
                std::vector<std::string> names;
                for (const HitColumn& column : hitColumns())
                    names.emplace_back(column.name);
                return names;
            },
            "Names of the columns")
        .def_property_readonly(
            "bundles", &bundlesOf,
            "A dict of each bundle: name, parallel, origin, direction, right, up, "
            "size (scene units), shape (rows, columns of rays)")
        .def_property_readonly(
            "images", [](const HitsObject& hits) { return hits.images; },
            "The hits of each bundle as an Image: dense(), counts and so on")
        .def("__len__", &hitsOf)
        .def("__getitem__", &columnOf, py::arg("column"))
        .def("next_to", &nextTo, py::arg("points"),
             "next_to(points) -> dict\n\nHow far from each point (n, 3; world space) the next hits "
             "before and after it are along every\nparallel bundle: t_before, t_after (bundles, n) "
             "float64, inf = none.")
        .def("save", &saveHits, py::arg("path"), py::kw_only(), py::arg("double") = false,
             "save(path, *, double=False): .npz, .ply or .exr, as `peeler rays` writes them.")
        .def("__repr__", [](const HitsObject& hits) {
            std::uint64_t rays = 0;
            for (const Bundle& bundle : hits.bundles)
                rays += bundle.rays();
            return "<peeler.Hits of " + std::to_string(rays) + " rays in " +
                   std::to_string(hits.bundles.size()) +
                   (hits.bundles.size() == 1 ? " bundle: " : " bundles: ") +
                   std::to_string(hitsOf(hits)) + " hits>";
        });
}

}  // namespace peeler::python
