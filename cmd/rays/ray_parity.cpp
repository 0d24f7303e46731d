// SPDX-License-Identifier: Apache-2.0
#include "cmd/rays/ray_parity.h"

#include <algorithm>
#include <nlohmann/json.hpp>
#include <sstream>

#include <peeler/error.h>
#include "cmd/cli/report.h"

namespace peeler::cmd {

namespace {

/// The maximum number of solids that messages name; JSON lists all.
constexpr std::size_t kNamed = 10;

/// Returns the direction of a ray, a unit vector in world space.
glm::dvec3 directionOf(const Bundle& bundle, const OddRay& ray) {
    if (bundle.parallel()) return bundle.direction();
    const glm::dvec2 at = glm::dvec2(ray.x, ray.y) + bundle.view.sample;
    return glm::normalize(worldPosition(bundle.view, at.x, at.y, 1) - bundle.origin());
}

/// Returns the world-space position of the ray's unmatched hit: an entry without an exit, or an
/// exit without an entry.
glm::dvec3 placeOf(const Bundle& bundle, const OddRay& ray) {
    const glm::dvec2 at = glm::dvec2(ray.x, ray.y) + bundle.view.sample;
    return worldPosition(bundle.view, at.x, at.y, ray.z);
}

}  // namespace

std::string solidName(const Scene& scene, const Solid& solid) {
    std::string text = nodeName(scene, static_cast<std::size_t>(solid.node));
    const int mesh = scene.nodes[static_cast<std::size_t>(solid.node)].mesh;
    if (mesh < 0 ||
        scene.meshes[static_cast<std::size_t>(mesh)].primitives.size() == solid.primitives.size())
        return text;
    text += solid.primitives.size() == 1 ? ", primitive" : ", primitives";
    for (std::size_t i = 0; i < solid.primitives.size(); ++i)
        text += (i == 0 ? " " : ", ") + std::to_string(solid.primitives[i]);
    return text;
}

void RayParity::begin(std::span<const Bundle> bundles, std::span<const std::uint64_t>) {
    bundles_.assign(bundles.begin(), bundles.end());
}

std::string RayParity::describe(const Solid& solid, const SolidParity& parity) const {
    const OddRay& ray = parity.first.front();
    const Bundle& bundle = bundles_[ray.bundle];
    const glm::dvec3 direction = directionOf(bundle, ray), place = placeOf(bundle, ray);
    std::ostringstream text;
    text << solidName(scene_, solid) << ": " << groupedText(parity.odd) << " of "
         << groupedText(parity.rays) << " rays hit it an odd number of times; "
         << (solid.closed() ? "no edge is open"
                            : countText(solid.open_edges, "edge") +
                                  (solid.open_edges == 1 ? " is open" : " are open"))
         << "; the first is in " << bundle.name << ", pixel (" << ray.x << ", " << ray.y
         << "), along (" << direction.x << ", " << direction.y << ", " << direction.z << "), at ("
         << place.x << ", " << place.y << ", " << place.z << ')';
    return text.str();
}

void RayParity::finish() {
    std::size_t odd = 0;
    for (const auto& [index, parity] : parity_.solids()) {
        if (parity.odd == 0) continue;
        if (++odd <= kNamed) reporter_.warning(describe(solids_.all()[index], parity));
    }
    if (odd > kNamed)
        reporter_.warning("and " + countText(odd - kNamed, "more solid") + " like that");
    reporter_.note(verdict(odd));
}

/// Returns a summary line: "closed: each of 437,760 rays enters as often as it leaves".
std::string RayParity::verdict(std::size_t odd_solids) const {
    std::uint64_t rays = 0;
    for (const Bundle& bundle : bundles_)
        rays += bundle.rays();
    if (parity_.solids().empty())
        return "no ray hits a surface, so it is unknown whether surfaces are closed";
    if (odd_solids == 0)
        return "closed: each of " + countText(rays, "ray") + " enters as often as it leaves";
    return "open: " + groupedText(parity_.oddRays()) + " of " + countText(rays, "ray") +
           (parity_.oddRays() == 1 ? " enters" : " enter") + " a surface that " +
           (parity_.oddRays() == 1 ? "it does" : "they do") + " not leave, at " +
           groupedText(odd_solids) + " of " + countText(parity_.solids().size(), "surface") +
           " that rays hit";
}

void RayParity::fail() const {
    std::size_t odd = 0;
    std::string first;
    for (const auto& [index, parity] : parity_.solids())
        if (parity.odd > 0 && ++odd == 1) first = solidName(scene_, solids_.all()[index]);
    throw Error(ErrorKind::kInput,
                countText(parity_.oddRays(), "ray") + (parity_.oddRays() == 1 ? " hits" : " hit") +
                    " a solid an odd number of times: not every mesh is closed",
                first + (odd > 1 ? " and " + countText(odd - 1, "other") : ""),
                "close the meshes, leave them out with --exclude, or use --parity report");
}

void RayParity::addTo(nlohmann::ordered_json& result) const {
    auto solids = nlohmann::ordered_json::array();
    for (const auto& [index, parity] : parity_.solids()) {
        const Solid& solid = solids_.all()[index];
        nlohmann::ordered_json entry{
            {"node", nodeName(scene_, static_cast<std::size_t>(solid.node))},
            {"nodeIndex", solid.node},
            {"instance", solid.instance},
            {"primitives",
             std::vector<std::size_t>(solid.primitives.begin(), solid.primitives.end())},
            {"triangles", solid.triangles},
            {"openEdges", solid.open_edges},
            {"rays", parity.rays},
            {"oddRays", parity.odd}};
        if (!parity.first.empty()) {
            auto& rays = entry["firstOddRays"] = nlohmann::ordered_json::array();
            for (const OddRay& ray : parity.first) {
                const Bundle& bundle = bundles_[ray.bundle];
                const glm::dvec3 direction = directionOf(bundle, ray), place = placeOf(bundle, ray);
                rays.push_back({{"bundle", bundle.name},
                                {"x", ray.x},
                                {"y", ray.y},
                                {"direction", {direction.x, direction.y, direction.z}},
                                {"position", {place.x, place.y, place.z}}});
            }
        }
        solids.push_back(std::move(entry));
    }
    result["parity"] = {
        {"holds", parity_.holds()}, {"oddRays", parity_.oddRays()}, {"solids", std::move(solids)}};
}

}  // namespace peeler::cmd
