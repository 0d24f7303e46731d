// SPDX-License-Identifier: Apache-2.0
#include "cmd/options/object_options.h"

#include <algorithm>
#include <nlohmann/json.hpp>
#include <optional>
#include <utility>

#include <peeler/error.h>
#include "cmd/cli/arguments.h"
#include "cmd/cli/parse.h"
#include "cmd/options/differences.h"
#include "cmd/options/filtered_input.h"
#include "cmd/options/layered_options.h"
#include "cmd/options/scene_options.h"
#include "formats/file/content_hash.h"
#include "formats/file/json_text.h"

namespace peeler::cmd {

namespace {

/// The ids of objects or of materials: the channel, the names (index = id − 1), and nouns for
/// messages.
struct IdKind {
    const char* channel;
    const std::vector<std::string>& names;
    const char* one;
    const char* many;
};

std::optional<std::uint32_t> idIn(const std::string& text) {
    try {
        return static_cast<std::uint32_t>(parseInteger(text, 0, 0xFFFFFFFF));
    } catch (const Error&) {
        return std::nullopt;
    }
}

void sortUnique(std::vector<std::uint32_t>& ids) {
    std::ranges::sort(ids);
    ids.erase(std::unique(ids.begin(), ids.end()), ids.end());
}

/// Returns the ids whose names match the globs. A number that matches no name is an id.
std::vector<std::uint32_t> idsLike(const std::vector<std::string>& globs, const IdKind& kind,
                                   const char* option, const std::string& path) {
    std::vector<std::uint32_t> ids;
    for (const std::string& glob : globs) {
        const std::vector<char> marked = namesLike(kind.names, glob);
        const auto before = ids.size();
        for (std::size_t i = 0; i < marked.size(); ++i)
            if (marked[i]) ids.push_back(static_cast<std::uint32_t>(i + 1));
        if (ids.size() > before) continue;
        if (const auto id = idIn(glob)) {
            ids.push_back(*id);
            continue;
        }
        const std::string where = std::string(option) + ' ' + glob;
        if (kind.names.empty()) {
            throw Error(ErrorKind::kInput, "the ids of the file have no names", path,
                        "give " + std::string(option) + " an id from the channel " + kind.channel);
        }
        throw Error(
            ErrorKind::kUsage, std::string("no ") + kind.one + " matches this name", where,
            choiceHint(glob, kind.many,
                       std::vector<std::string_view>(kind.names.begin(), kind.names.end())));
    }
    sortUnique(ids);
    return ids;
}

/// Adds the ids of all descendants. `parents` is empty if the file lacks the parents.
void addBelow(const std::vector<std::uint32_t>& parents, std::vector<std::uint32_t>& ids) {
    std::vector<char> known(parents.size() + 1, 0), inside(parents.size() + 1, 0);
    known[0] = 1;
    for (const std::uint32_t id : ids)
        if (id < inside.size()) known[id] = inside[id] = 1;
    std::vector<std::uint32_t> way;
    for (std::uint32_t id = 1; id < known.size(); ++id) {
        // Walks up to the first ancestor that is known to be inside or outside. In damaged files,
        // the walk may end in a cycle; then the ids on the way are outside.
        for (std::uint32_t at = id; at < known.size() && !known[at]; at = parents[at - 1]) {
            known[at] = 1;
            way.push_back(at);
        }
        const std::uint32_t top = way.empty() ? 0 : parents[way.back() - 1];
        for (const std::uint32_t at : way)
            inside[at] = top < inside.size() ? inside[top] : 0;
        way.clear();
    }
    for (std::uint32_t id = 1; id < inside.size(); ++id)
        if (inside[id]) ids.push_back(id);
    sortUnique(ids);
}

void checkChannel(const ExrInfo& info, const std::string& channel, const char* option,
                  const std::string& path) {
    const auto is_there = [&](const ExrInputPart& part) {
        return std::ranges::any_of(part.channels, [&](const ExrInputChannel& c) {
            return c.type == PixelType::kUint &&
                   (c.name == channel || c.name.ends_with('.' + channel));
        });
    };
    if (std::ranges::any_of(info.parts, is_there)) return;
    throw Error(ErrorKind::kInput,
                std::string("the fragments have no ids, which ") + option + " needs", path,
                "render it with --channels id");
}

}  // namespace

void addObjectOptions(VerbOptions& verb, ObjectOptions& options) {
    const auto add = [&](const char* name, std::vector<std::string>& globs,
                         const std::string& help) {
        verb.addRepeated(
                name, "GLOB|ID", [&globs](const std::string& text) { globs.push_back(text); }, help)
            .group("Objects");
    };
    add("--include", options.include,
        "keep only fragments of objects with a matching name or id, and of their descendants; *, ? "
        "and [a-z] as in a shell; may be repeated; the file needs ids (peeler render --channels "
        "id)");
    add("--exclude", options.exclude, "leave out these objects and their descendants");
    add("--material", options.materials,
        "keep only fragments of materials with a matching name or id");
}

ObjectSelection selectionOf(const ObjectOptions& options, const ExrInfo& info,
                            const std::string& path) {
    const IdNames& names = info.provenance.ids;
    const IdKind objects{"id.object", names.objects, "object", "objects"};
    const IdKind materials{"id.material", names.materials, "material", "materials"};
    const auto idsOf = [&](const std::vector<std::string>& globs, const char* option) {
        if (!globs.empty()) checkChannel(info, objects.channel, option, path);
        std::vector<std::uint32_t> ids = idsLike(globs, objects, option, path);
        addBelow(names.parents, ids);
        return ids;
    };
    ObjectSelection selection;
    const std::vector<std::uint32_t> included = idsOf(options.include, "--include");
    const std::vector<std::uint32_t> excluded = idsOf(options.exclude, "--exclude");
    selection.objects.others = options.include.empty();
    if (options.include.empty())
        selection.objects.listed = excluded;
    else
        std::ranges::set_difference(included, excluded,
                                    std::back_inserter(selection.objects.listed));
    if (!options.materials.empty()) {
        checkChannel(info, materials.channel, "--material", path);
        selection.materials = {idsLike(options.materials, materials, "--material", path), false};
    }
    return selection;
}

void recordSetting(const std::string& key, const nlohmann::json& value, Provenance& provenance) {
    nlohmann::json settings = settingsJson(provenance);
    if (settings.is_null()) {
        provenance.settings_hash = hashText(provenance.settings_hash + dumpJson(value));
        return;
    }
    nlohmann::json& all = settings[key];
    if (!all.is_array()) all = nlohmann::json::array();  // in damaged files
    all.push_back(value);
    provenance.settings = dumpJson(settings);
    provenance.settings_hash = hashText(provenance.settings);
}

nlohmann::json toJson(const ObjectOptions& options) {
    return {{"include", options.include},
            {"exclude", options.exclude},
            {"material", options.materials}};
}

std::unique_ptr<LayeredInput> openChosen(const std::string& path, const LayeredReadOptions& reading,
                                         const ObjectOptions& options, Reporter& reporter) {
    std::unique_ptr<LayeredInput> input = openInput(path, reading, reporter);
    // An empty picture has no objects to choose.
    if (!options.any() || input->info().plan.layers.empty()) return input;
    const ObjectSelection selection = selectionOf(options, input->info(), path);
    auto chosen = std::make_unique<FilteredInput>(
        std::move(input), [selection](LayeredImage& band) { keepObjects(band, selection); });
    recordSetting("selected", toJson(options), chosen->provenance());
    return chosen;
}

}  // namespace peeler::cmd
