// SPDX-License-Identifier: Apache-2.0
#include "formats/splats/splat_ply.h"

#include <algorithm>

#include <peeler/error.h>
#include "formats/file/text_words.h"

namespace peeler {
namespace {

constexpr const char* kRestPrefix = "f_rest_";

/// What a comment says of the training: programs write "SplatRenderMode: mip" (Brush, gsplat,
/// splat-transform) or "antialiased 1" (Postshot).
struct TrainingComment {
    std::string_view key, compensated, flat;
};
constexpr TrainingComment kTrainingComments[] = {{"SplatRenderMode:", "mip", "2dgs"},
                                                 {"antialiased", "1", ""}};

}  // namespace

bool hasPlyProperties(std::string_view begin, std::initializer_list<std::string_view> names) {
    if (!isPly(begin)) return false;
    std::size_t found = 0;
    while (!begin.empty()) {
        std::string_view line = takeLine(begin);
        const std::string_view word = takeWord(line);
        if (word == "end_header") break;
        if (word != "property") continue;
        takeWord(line);
        if (std::ranges::find(names, takeWord(line)) != names.end()) ++found;
    }
    return found >= names.size();
}

std::vector<const PlyField*> propertiesNamed(const MeshFile& file, const PlyElement& element,
                                             const std::vector<std::string>& names) {
    std::vector<const PlyField*> found;
    std::string missing;
    for (const std::string& name : names) {
        found.push_back(propertyNamed(element, name));
        if (!found.back() || found.back()->count) missing += (missing.empty() ? "" : ", ") + name;
    }
    if (!missing.empty())
        throw Error(ErrorKind::kInput, "the splats have no " + missing, file.name(),
                    missing == "scale_2" ? "export ellipsoids; flat splats (2DGS) are not supported"
                                         : "export the file again");
    return found;
}

void readRows(PlyElements& elements, const PlyElement& element,
              const std::vector<const PlyField*>& fields,
              const std::function<void(const std::vector<double>& values)>& take) {
    std::vector<std::size_t> places;  // of each property in `fields`
    for (const PlyField& property : element.properties)
        places.push_back(
            static_cast<std::size_t>(std::ranges::find(fields, &property) - fields.begin()));
    std::vector<double> values(fields.size());
    for (; elements.row < element.rows; ++elements.row) {
        for (std::size_t i = 0; i < places.size(); ++i) {
            const PlyField& property = element.properties[i];
            if (places[i] < values.size())
                values[places[i]] = elements.numbers().next(*property.type);
            else
                elements.numbers().skip(property);
        }
        take(values);
    }
}

std::vector<std::string> numberedNames(const std::string& prefix, std::uint64_t count) {
    std::vector<std::string> names;
    for (std::uint64_t i = 0; i < count; ++i)
        names.push_back(prefix + std::to_string(i));
    return names;
}

int degreeIn(const MeshFile& file, const PlyElement& element) {
    const auto count = static_cast<std::uint64_t>(std::ranges::count_if(
        element.properties,
        [](const PlyField& property) { return property.name.starts_with(kRestPrefix); }));
    const std::optional<int> degree = count % 3 == 0 ? degreeOf(count / 3) : std::nullopt;
    if (!degree)
        throw Error(ErrorKind::kInput,
                    "the splats have " + std::to_string(count) + " properties f_rest_, which is " +
                        "no whole degree of spherical harmonics",
                    file.name(), "export 0, 9, 24 or 45 of them: degree 0 to 3");
    return *degree;
}

bool isCompensated(MeshFile& file, const PlyFile& header) {
    bool compensated = false;
    for (std::string_view comment : header.comments()) {
        const std::string_view key = takeWord(comment);
        const auto* const row = std::ranges::find(kTrainingComments, key, &TrainingComment::key);
        if (row == std::end(kTrainingComments)) continue;
        const std::string_view value = takeWord(comment);
        compensated = value == row->compensated;
        if (!value.empty() && value == row->flat)
            file.warn(
                "The file says that its splats are flat (2DGS); they are drawn as "
                "ellipsoids.");
    }
    return compensated;
}

}  // namespace peeler
