// SPDX-License-Identifier: Apache-2.0
// Reader of the points in a .npz.
#include <algorithm>

#include <peeler/error.h>
#include "formats/arrays/array_reader.h"
#include "formats/arrays/point_reader.h"

namespace peeler {
namespace {

std::vector<glm::dvec3> positionsIn(const NumberArray& points, const std::string& where) {
    if (points.shape[0] > kMostPoints)
        throw Error(ErrorKind::kInput, kTooManyPoints, where, kFewerPoints);
    std::vector<glm::dvec3> positions(points.shape[0]);
    for (std::uint64_t i = 0; i < positions.size(); ++i)
        for (int axis = 0; axis < 3; ++axis)
            positions[i][axis] = points.at(i * 3 + static_cast<std::uint64_t>(axis));
    return positions;
}

}  // namespace

std::vector<glm::dvec3> npzPoints(std::span<const std::uint8_t> file, const std::string& where,
                                  const AllowBytes& allow) {
    constexpr const char* kHint = "numpy.savez(path, points=array), array of shape (n, 3)";
    constexpr std::uint64_t kMostMember = kMostPoints * 3 * sizeof(double) + kMostNpyHeader;
    const NpzArchive archive(file, where);
    // peeler's own files call the points "positions", if the picture had the channel `position`.
    const NpzArchive::Member* named = archive.find("points");
    if (!named) named = archive.find("positions");
    // In peeler's own files without positions, the arrays of shape (n, 3) are not points.
    if (!named && archive.find("ray_splits"))
        throw Error(
            ErrorKind::kInput, "the file has hits or fragments, but no array positions", where,
            "render with " + Parameter::kChannels +
                " position and extract the arrays again, or write the hits of rays to a .ply");
    const std::vector<NpzArchive::Member> members = named ? std::vector{*named} : archive.members();
    std::vector<glm::dvec3> found;
    std::string name;
    for (const NpzArchive::Member& member : members) {
        const std::string inside = archive.placeOf(member);
        if (member.size > kMostMember) {
            if (!named) continue;
            throw Error(ErrorKind::kInput, kTooManyPoints, inside, kFewerPoints);
        }
        // The member's bytes, and the points as doubles, which take at most twice as many bytes.
        allow(3 * member.size);
        std::vector<std::uint8_t> storage;
        const auto points = npyArray(archive.contents(member, storage), inside);
        if (!points || !points->number->floating || points->shape.size() != 2 ||
            points->shape[1] != 3) {
            if (!named) continue;
            throw Error(ErrorKind::kInput, "expected an array of n points of 32- or 64-bit floats",
                        inside, kHint);
        }
        if (!name.empty())
            throw Error(ErrorKind::kInput, "several arrays could be the points",
                        (where + ", ").append(name).append(" and ").append(member.name),
                        "name one of them \"points\"");
        found = positionsIn(*points, inside);
        name = member.name;
    }
    if (name.empty())
        throw Error(ErrorKind::kInput, "the file has no array of points", where, kHint);
    return found;
}

}  // namespace peeler
