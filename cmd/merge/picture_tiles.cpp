// SPDX-License-Identifier: Apache-2.0
#include "cmd/merge/picture_tiles.h"

#include <algorithm>
#include <nlohmann/json.hpp>
#include <set>
#include <span>

#include <peeler/error.h>
#include "cmd/cli/parse.h"
#include "cmd/options/differences.h"
#include "cmd/options/layered_options.h"
#include "core/image/composite.h"
#include "core/image/merge.h"
#include "formats/file/json_text.h"

namespace peeler::cmd {

namespace {

namespace fs = std::filesystem;

std::string channelsText(const LayeredImage& image) {
    std::string text;
    for (const FragmentArray& array : image.extra) {
        for (const std::string& channel : array.channels) {
            constexpr const char* kNames[] = {"half", "float", "uint"};
            text += channel + ' ' + kNames[static_cast<std::size_t>(array.type)] + ", ";
        }
    }
    return text.empty() ? "none" : text.substr(0, text.size() - 2);
}

/// Adds a file to the list of elements. If the file is itself a merge, adds the file's elements
/// instead.
void addElement(const PictureTile& tile, nlohmann::json& elements) {
    const Provenance& own = tile.info().provenance;
    const nlohmann::json merged = parseJsonOrNull(own.elements);
    if (merged.is_array()) {
        elements.insert(elements.end(), merged.begin(), merged.end());
        return;
    }
    nlohmann::json element = {{"file", fs::path(tile.path).filename().string()},
                              {"scene", own.scene},
                              {"sceneHash", own.scene_hash},
                              {"settingsHash", own.settings_hash}};
    const nlohmann::json settings = settingsJson(own);
    for (const char* const key : {"include", "exclude"})
        if (settings.contains(key)) element[key] = settings[key];
    elements.push_back(std::move(element));
}

/// A property in the header, as text. Scene, settings and camera are compared separately.
struct CommonAttribute {
    const char* name;
    std::string (*text)(const ExrInfo& info);
};

constexpr CommonAttribute kFrame{
    "the frame", [](const ExrInfo& i) { return std::to_string(i.provenance.frame); }};
constexpr CommonAttribute kTime{
    "the time", [](const ExrInfo& i) { return std::to_string(i.provenance.time) + " s"; }};
constexpr CommonAttribute kSamples{"--samples",
                                   [](const ExrInfo& i) { return std::to_string(i.plan.samples); }};
constexpr CommonAttribute kPrecision{
    "--precision", [](const ExrInfo& i) {
        return std::string(i.plan.color_type == PixelType::kHalf ? "half" : "float");
    }};

/// The properties that all tiles of a picture must share.
constexpr CommonAttribute kOfTiles[] = {
    kFrame,
    kTime,
    {"--surfaces", [](const ExrInfo& i) { return i.provenance.surfaces; }},
    kSamples,
    kPrecision,
    {"--transmission",
     [](const ExrInfo& i) { return std::string(i.plan.tinted ? "color" : "alpha"); }},
    {"--deep-merge", [](const ExrInfo& i) { return i.provenance.deep_merge; }},
};

/// The properties that all elements of a picture must share.
constexpr CommonAttribute kOfElements[] = {kPrecision};

/// The properties in which tiles may differ. A difference causes a warning, and the first tile's
/// value is kept.
constexpr CommonAttribute kLesserOfTiles[] = {
    {"method", [](const ExrInfo& i) { return i.provenance.method; }},
    {"renderer", [](const ExrInfo& i) { return i.provenance.renderer; }},
    {"version", [](const ExrInfo& i) { return i.provenance.version; }},
};

/// The properties in which elements may differ. A difference causes a warning, because the elements
/// of a picture usually agree.
constexpr CommonAttribute kLesserOfElements[] = {kFrame, kTime, kSamples};

/// Returns the differences between two headers in the given properties.
std::vector<Difference> attributeDifferences(std::span<const CommonAttribute> attributes,
                                             const ExrInfo& here, const ExrInfo& there) {
    const auto orNone = [](const std::string& text) { return text.empty() ? "none" : text; };
    std::vector<Difference> found;
    for (const CommonAttribute& attribute : attributes) {
        const std::string a = attribute.text(here), b = attribute.text(there);
        if (a != b) found.push_back({attribute.name, orNone(a), orNone(b)});
    }
    return found;
}

/// Returns the differences between the headers of two tiles, without duplicates.
std::vector<Difference> pictureDifferences(const ExrInfo& here, const ExrInfo& there) {
    std::vector<Difference> found = sceneDifferences(here.provenance, there.provenance);
    const auto add = [&](const std::vector<Difference>& more) {
        for (const Difference& difference : more) {
            const auto known = [&](const Difference& d) { return d.what == difference.what; };
            if (std::ranges::none_of(found, known)) found.push_back(difference);
        }
    };
    add(attributeDifferences(kOfTiles, here, there));
    add(sizeDifferences(here.plan.view, there.plan.view));
    add(cameraDifferences(here.plan.view, there.plan.view));
    add(settingsDifferences(here.provenance, there.provenance));
    return found;
}

/// Returns the differences between two elements that prevent a merge.
std::vector<Difference> elementDifferences(const ExrInfo& here, const ExrInfo& there) {
    const View &a = here.plan.view, &b = there.plan.view;
    std::vector<Difference> found = sizeDifferences(a, b);
    if (found.empty() && a.known && b.known) found = cameraDifferences(a, b);
    const std::vector<Difference> others = attributeDifferences(kOfElements, here, there);
    found.insert(found.end(), others.begin(), others.end());
    return found;
}

/// Returns the names of the differences as text: "the frame", "the frame and --channels", "a, b and
/// c".
std::string namesText(const std::vector<Difference>& differences) {
    std::string text;
    for (std::size_t i = 0; i < differences.size(); ++i)
        text += (i == 0 ? "" : i + 1 < differences.size() ? ", " : " and ") + differences[i].what;
    return text;
}

/// Adds `first` to the ids in a channel. Id 0 (none) stays 0.
void addToIds(LayeredImage& image, const std::string& channel, std::uint32_t first) {
    if (first == 0) return;
    for (FragmentArray& array : image.extra) {
        if (array.type != PixelType::kUint) continue;
        const auto found = std::ranges::find(array.channels, channel);
        if (found == array.channels.end()) continue;
        const auto ids = array.as<std::uint32_t>();
        for (auto i = static_cast<std::size_t>(found - array.channels.begin()); i < ids.size();
             i += array.components())
            if (ids[i] != 0) ids[i] += first;
    }
}

/// Adds the opacities AR, AG and AB, all equal to A.
void addOpacities(LayeredImage& image) {
    FragmentArray colors{colorNames(true), image.color.type, {}};
    colors.data.resize(image.fragments() * colors.stride());
    for (std::size_t f = 0; f < image.fragments(); ++f)
        storeColor(tintedColorOf(image, f), colors, f);
    image.color = std::move(colors);
}

/// Whether to merge the tiles as composites: every tile has a composite, and no tile has layers. If
/// all tiles are layered files without fragments, `wanted` decides.
bool areComposites(const std::vector<OpenedPicture>& opened, bool wanted) {
    const auto flat = [](const OpenedPicture& tile) {
        return tile.info().composite >= 0 && tile.info().layers.empty() && tile.info().deep.empty();
    };
    const auto empty = [](const OpenedPicture& tile) { return isLayered(tile.info()); };
    return std::ranges::all_of(opened, flat) && (wanted || !std::ranges::all_of(opened, empty));
}

}  // namespace

PictureTiles::PictureTiles(const std::vector<fs::path>& paths, Parts parts,
                           const LayeredReadOptions& reading, bool composites_wanted,
                           Reporter& reporter)
    : parts_(parts) {
    open(paths, reading, composites_wanted, reporter);
    checkCommon(reporter);
    joinProvenance();
}

void PictureTiles::open(const std::vector<fs::path>& paths, const LayeredReadOptions& reading,
                        bool composites_wanted, Reporter& reporter) {
    std::vector<OpenedPicture> opened;
    for (const fs::path& path : paths)
        opened.emplace_back(path.string(), reading);
    // Layers stored as arrays are not deep samples.
    const auto deep = [](const OpenedPicture& tile) {
        return !tile.info().deep.empty() && !tile.isOfArrays();
    };
    const bool tiles = parts_ == Parts::kTiles;
    if (tiles && !reading.choosesPicture() && areComposites(opened, composites_wanted))
        kind_ = Kind::kComposite;
    else if (std::ranges::all_of(opened, deep))
        kind_ = Kind::kDeep;
    for (std::size_t i = 0; i < opened.size(); ++i) {
        PictureTile tile{.path = paths[i].string()};
        tile.input = kind_ == Kind::kComposite ? openComposite(std::move(opened[i]))
                                               : openInput(std::move(opened[i]), reporter);
        if (tiles && !tile.info().is_peeler) {
            throw Error(ErrorKind::kInput, "the file does not say which picture it is a tile of",
                        tile.path, "merge files that peeler render --tile or --crop wrote");
        }
        const Window& window = tile.window();
        if (kind_ == Kind::kComposite || tile.hasLayers())
            tile.input->read({window.x0, window.y0, window.x1, window.y0 + 1}, tile.arrays);
        windows_.push_back(window);
        window_ = unite(window_, window);
        tiles_.push_back(std::move(tile));
    }
}

void PictureTiles::checkCommon(Reporter& reporter) {
    const bool tiles = parts_ == Parts::kTiles;
    const auto differ = [&](const PictureTile& a, const PictureTile& b,
                            const std::vector<Difference>& differences) {
        std::string in_a, in_b;
        for (const Difference& difference : differences) {
            if (difference.here.empty() && difference.there.empty()) continue;
            in_a += (in_a.empty() ? "" : ", ") + difference.what + ' ' + difference.there;
            in_b += (in_b.empty() ? "" : ", ") + difference.what + ' ' + difference.here;
        }
        throw Error(ErrorKind::kInput,
                    std::string("the ") + (tiles ? "tiles" : "elements") +
                        " belong to different pictures: they differ in " + namesText(differences),
                    a.path + " and " + b.path,
                    in_a.empty() ? "render both again with the same settings"
                                 : "the first has " + in_a + "\nthe other has " + in_b);
    };
    const PictureTile& first = tiles_.front();
    for (const PictureTile& tile : tiles_) {
        const auto differences = tiles ? pictureDifferences(tile.info(), first.info())
                                       : elementDifferences(tile.info(), first.info());
        if (!differences.empty()) differ(first, tile, differences);
    }
    for (const CommonAttribute& attribute :
         tiles ? std::span(kLesserOfTiles) : std::span<const CommonAttribute>(kLesserOfElements)) {
        for (const PictureTile& tile : tiles_) {
            const std::string a = attribute.text(first.info()), b = attribute.text(tile.info());
            if (a == b) continue;
            std::string text = first.path + " and " + tile.path;
            text.append(" differ in ").append(attribute.name).append(": ").append(a);
            text.append(" and ").append(b).append("; the merged file gets the first.");
            reporter.warning(text);
            break;
        }
    }
    const PictureTile* with_layers = nullptr;
    for (const PictureTile& tile : tiles_) {
        if (kind_ != Kind::kComposite && !tile.hasLayers()) continue;
        if (!with_layers) with_layers = &tile;
        const std::string a = channelsText(with_layers->arrays), b = channelsText(tile.arrays);
        if (a != b) differ(*with_layers, tile, {{"channels", b, a}});
    }
    arrays_ = with_layers ? with_layers->arrays : LayeredImage();
    // Elements with and without coloured opacity may be combined.
    const bool tinted = std::ranges::any_of(
        tiles_, [](const PictureTile& tile) { return tile.info().plan.tinted; });
    arrays_.color.channels = colorNames(tinted);
    arrays_.color.type = first.info().plan.color_type;
}

/// Sets provenance_. For elements, joins the id names of all files (equal lists only once), and
/// sets each file's id offsets.
void PictureTiles::joinProvenance() {
    provenance_ = info().provenance;
    if (parts_ == Parts::kTiles) return;
    struct Known {
        const IdNames* names;
        std::uint32_t first_object, first_material;
    };
    std::vector<Known> known;
    IdNames& all = provenance_.ids;
    all = {};
    bool parents_known = true;
    nlohmann::json elements = nlohmann::json::array();
    for (PictureTile& tile : tiles_) {
        const Provenance& own = tile.info().provenance;
        addElement(tile, elements);
        if (own.scene_hash != provenance_.scene_hash)
            provenance_.scene = provenance_.scene_hash = "";
        if (own.settings_hash != provenance_.settings_hash)
            provenance_.settings = provenance_.settings_hash = "";
        const auto same = std::ranges::find_if(
            known, [&](const Known& other) { return *other.names == own.ids; });
        if (same != known.end()) {
            tile.first_object = same->first_object;
            tile.first_material = same->first_material;
            continue;
        }
        tile.first_object = static_cast<std::uint32_t>(all.objects.size());
        tile.first_material = static_cast<std::uint32_t>(all.materials.size());
        known.push_back({&own.ids, tile.first_object, tile.first_material});
        const auto add = [](const std::vector<std::string>& from, std::vector<std::string>& to) {
            to.insert(to.end(), from.begin(), from.end());
        };
        add(own.ids.objects, all.objects);
        add(own.ids.materials, all.materials);
        for (const std::uint32_t parent : own.ids.parents)
            all.parents.push_back(parent == 0 ? 0 : parent + tile.first_object);
        parents_known = parents_known && own.ids.parents.size() == own.ids.objects.size();
    }
    if (!parents_known) all.parents.clear();
    provenance_.elements = dumpJson(elements);
}

bool PictureTiles::overlap() const {
    return peeler::overlap(windows_);
}

std::optional<Window> PictureTiles::gap() const {
    return findGap(windows_, window_);
}

std::string PictureTiles::missingStrip() const {
    std::set<int> there;
    int count = 0;
    for (const PictureTile& tile : tiles_) {
        const std::string& text = tile.info().provenance.tile;
        if (text.empty()) return "";
        Shard shard;
        try {
            shard = parseShard(text);
        } catch (const Error&) {
            throw Error(ErrorKind::kInput, "invalid attribute peeler:tile: " + text, tile.path,
                        "render the tile again");
        }
        if (count != 0 && shard.count != count) return "";
        count = shard.count;
        there.insert(shard.index);
    }
    for (int i = 1; i <= count; ++i)
        if (!there.contains(i)) return Shard{i, count}.text();
    return "";
}

int PictureTiles::rowsFor(std::uint64_t bytes) const {
    std::uint64_t across = 1;
    for (const Window& window : windows_) {
        const auto beside = std::ranges::count_if(windows_, [&](const Window& other) {
            return other.y0 < window.y1 && window.y0 < other.y1;
        });
        across = std::max(across, static_cast<std::uint64_t>(beside));
    }
    int rows = window_.height();
    for (const PictureTile& tile : tiles_) {
        // If a whole tile fits, rowsFor() returns the tile's height. This height must not limit
        // taller tiles beside it.
        constexpr int kUsualRows = 128;
        const int fitting = tile.input->rowsFor(bytes / across);
        const bool all_of_it = fitting >= tile.window().height();
        rows = std::min(rows, all_of_it ? std::max(fitting, kUsualRows) : fitting);
    }
    return rows;
}

std::optional<Window> PictureTiles::read(const Window& window, LayeredImage& band) {
    images_.clear();
    for (const PictureTile& tile : tiles_) {
        const Window part = intersect(window, tile.window());
        if (part.empty()) continue;
        tile.input->read(part, images_.emplace_back());
        if (arrays_.tinted() && !images_.back().tinted()) addOpacities(images_.back());
        addToIds(images_.back(), "id.object", tile.first_object);
        addToIds(images_.back(), "id.material", tile.first_material);
    }
    if (parts_ == Parts::kTiles) return joinTiles(images_, window, arrays_, band);
    mergeByDepth(images_, window, arrays_, band);
    return std::nullopt;
}

}  // namespace peeler::cmd
