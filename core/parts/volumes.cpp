// SPDX-License-Identifier: Apache-2.0
// Nesting of the shells of a mesh, and enclosed volumes.
#include "core/parts/volumes.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include "core/base/parallel.h"
#include "core/parts/crossings.h"
#include "core/parts/free_area.h"
#include "core/parts/step_limit.h"

namespace peeler {
namespace {

/// Returns the number of closed shells around a shell: the shells that a ray from the shell crosses
/// an odd number of times.
std::size_t depthOf(const PartTree& tree, const PartTopology& topology, std::uint32_t shell) {
    const PartMesh& mesh = tree.mesh();
    const std::uint32_t first = topology.shells[shell].first;
    const glm::dvec3 from = mesh.middle(first);
    constexpr double kEnd = std::numeric_limits<double>::infinity();
    std::map<std::uint32_t, bool> odd;
    // Retries with another direction if the ray hits an edge.
    for (int attempt = 0; attempt < 4; ++attempt) {
        const glm::dvec3 direction =
            glm::normalize(glm::dvec3(0.41283 + 0.11 * attempt, 0.63127, 0.65648 - 0.23 * attempt));
        const CheckedLine line(from, direction);
        bool sure = true;
        odd.clear();
        tree.visit([&](const Bounds& box) { return line.meets(box, 0, kEnd); },
                   [&](std::uint32_t t) {
                       const std::uint32_t other = topology.shell_of[t];
                       if (other == shell || topology.shells[other].open_edges > 0) return;
                       const auto hit = line.meets(mesh.corners(t));
                       if (!hit || hit->t <= 0) return;
                       odd[other] = !odd[other];
                       sure = sure && !hit->on_edge;
                   });
        if (sure) break;
    }
    return static_cast<std::size_t>(
        std::ranges::count_if(odd, [](const auto& entry) { return entry.second; }));
}

}  // namespace

std::vector<ShellSide> findSides(const PartTree& tree, const PartTopology& topology) {
    std::vector<ShellSide> sides(topology.shells.size(), ShellSide::kOpen);
    const double near = kTouching * tree.mesh().size();
    parallelFor(sides.size(), [&](std::size_t i) {
        const PartShell& shell = topology.shells[i];
        if (shell.open_edges > 0 || !shell.orientable) return;
        // A flat shell has half of its area on each side. If the two sides touch, `near * area / 2`
        // is its maximum volume.
        if (std::abs(shell.volume) <= near * shell.area / 2) {
            sides[i] = ShellSide::kFlat;
            return;
        }
        const bool enclosed = depthOf(tree, topology, static_cast<std::uint32_t>(i)) % 2 == 1;
        if (shell.volume < 0)
            sides[i] = enclosed ? ShellSide::kCavity : ShellSide::kInsideOut;
        else
            sides[i] = enclosed ? ShellSide::kInside : ShellSide::kOutside;
    });
    return sides;
}

PartMesh turnedBack(const PartMesh& mesh, const PartTopology& topology,
                    const std::vector<ShellSide>& sides) {
    PartMesh back = mesh;
    for (const std::uint32_t t : topology.turned)
        std::swap(back.triangles[t][1], back.triangles[t][2]);
    for (std::size_t t = 0; t < back.triangles.size(); ++t)
        if (sides[topology.shell_of[t]] == ShellSide::kInsideOut)
            std::swap(back.triangles[t][1], back.triangles[t][2]);
    return back;
}

double areaOf(const PartMesh& mesh) {
    double area = 0;
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
        area += glm::length(mesh.normal(t)) / 2;
    return area;
}

double volumeOf(const PartMesh& mesh) {
    const Bounds box = mesh.bounds();
    const glm::dvec3 origin = (box.min + box.max) / 2.0;
    double six = 0;
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
        const auto [a, b, c] = mesh.corners(t);
        six += glm::dot(a - origin, glm::cross(b - origin, c - origin));
    }
    return six / 6;
}

namespace {

/// The step limits of unionVolume(), in steps of FreeArea. They allow for a few seconds.
constexpr std::uint64_t kUnionSteps = 30'000'000, kUnionStepsPerTriangle = 1000;

/// Groups untouched triangles into connected patches. All triangles of a patch have the same bodies
/// in front of them, so one test per patch is enough.
std::vector<std::vector<std::uint32_t>> patchesOf(const PartTopology& topology,
                                                  const std::vector<char>& touched) {
    std::vector<std::vector<std::uint32_t>> patches;
    std::vector<char> seen = touched;
    for (std::uint32_t seed = 0; seed < seen.size(); ++seed) {
        if (seen[seed]) continue;
        seen[seed] = 1;
        std::vector<std::uint32_t>& patch = patches.emplace_back(1, seed);
        for (std::size_t i = 0; i < patch.size(); ++i) {
            for (const std::uint32_t other : topology.beyond[patch[i]]) {
                if (other == kNoTriangle || seen[other]) continue;
                seen[other] = 1;
                patch.push_back(other);
            }
        }
    }
    return patches;
}

}  // namespace

std::optional<double> unionVolume(const PartTree& tree, const PartTopology& topology,
                                  const Crossings& crossings, const Progress& progress) {
    if (crossings.more) return std::nullopt;
    const PartMesh& mesh = tree.mesh();
    const Bounds box = mesh.bounds();
    const glm::dvec3 origin = (box.min + box.max) / 2.0;
    const double near = kTouching * mesh.size();
    const auto patches = patchesOf(topology, crossings.touched);
    std::vector<std::uint32_t> touched;
    for (std::uint32_t t = 0; t < crossings.touched.size(); ++t)
        if (crossings.touched[t]) touched.push_back(t);
    std::vector<double> shares(patches.size() + touched.size());
    StepLimit limit(kUnionSteps + kUnionStepsPerTriangle * mesh.triangles.size());
    const bool done = parallelFor(shares.size(), limit, progress, [&](std::size_t i) {
        // Adds the volume of the pyramid between the origin and a face: a third of the face's area
        // times the distance of the face's plane from the origin.
        if (i >= patches.size()) {
            const std::uint32_t t = touched[i - patches.size()];
            const glm::dvec3 normal = unitOrZero(mesh.normal(t));
            const double area = FreeArea(tree, near, limit).of(t);
            shares[i] = area * glm::dot(normal, mesh.middle(t) - origin) / 3;
            return;
        }
        const auto& patch = patches[i];
        const auto size = [&](std::uint32_t t) { return glm::length(mesh.normal(t)); };
        const std::uint32_t asked = std::ranges::max(patch, {}, size);
        if (size(asked) == 0) return;
        if (tree.windingInFront(mesh.middle(asked), mesh.normal(asked), near) != 0) return;
        for (const std::uint32_t t : patch)
            shares[i] += glm::dot(mesh.normal(t), mesh.middle(t) - origin) / 6;
    });
    if (!done) return std::nullopt;
    double sum = 0;
    for (const double share : shares)
        sum += share;
    return sum;
}

}  // namespace peeler
