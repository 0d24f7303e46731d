// SPDX-License-Identifier: Apache-2.0
#include "cmd/merge/picture_tiles.h"

#include <algorithm>
#include <nlohmann/json.hpp>
#include <set>

#include "cmd/cli/parse.h"
#include "core/base/error.h"
#include "core/image/merge.h"

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

/// The camera as the header has it, but for its crop; "" if there is none.
std::string wholeCamera(const ExrInfo& info) {
    const auto text = info.attributes().find("peeler:cameraJson");
    if (text == info.attributes().end()) return "";
    nlohmann::json json = nlohmann::json::parse(text->second);  // valid: OpenedExr has parsed it
    json.erase("crop");
    return json.dump();
}

/// What the tiles of one picture have in common.
struct CommonAttribute {
    const char* name;
    std::string (*text)(const ExrInfo& info);
    bool required;  ///< else they may differ: the first tile's is kept, with a warning
};

constexpr CommonAttribute kCommon[] = {
    {"peeler:sceneHash", [](const ExrInfo& i) { return i.provenance.scene_hash; }, true},
    {"peeler:frame", [](const ExrInfo& i) { return std::to_string(i.provenance.frame); }, true},
    {"peeler:time", [](const ExrInfo& i) { return std::to_string(i.provenance.time); }, true},
    {"peeler:cameraJson", wholeCamera, true},
    {"peeler:surfaces", [](const ExrInfo& i) { return i.provenance.surfaces; }, true},
    {"peeler:samples", [](const ExrInfo& i) { return std::to_string(i.plan.samples); }, true},
    {"precision",
     [](const ExrInfo& i) {
         return std::string(i.plan.color_type == PixelType::kHalf ? "half" : "float");
     },
     true},
    {"opacity", [](const ExrInfo& i) { return std::string(i.plan.tinted ? "A, AR, AG, AB" : "A"); },
     true},
    {"peeler:settingsHash", [](const ExrInfo& i) { return i.provenance.settings_hash; }, true},
    {"peeler:deepMerge", [](const ExrInfo& i) { return i.provenance.deep_merge; }, true},
    {"peeler:method", [](const ExrInfo& i) { return i.provenance.method; }, false},
    {"peeler:renderer", [](const ExrInfo& i) { return i.provenance.renderer; }, false},
    {"peeler:version", [](const ExrInfo& i) { return i.provenance.version; }, false},
};

/// Whether the tiles are merged as composites: all have one and none has layers, and not all of
/// them are empty layered files, unless composites are wanted.
bool areComposites(const std::vector<OpenedExr>& opened, bool wanted) {
    const auto flat = [](const OpenedExr& tile) {
        return tile.info.composite >= 0 && tile.info.layers.empty() && tile.info.deep.empty();
    };
    const auto empty = [](const OpenedExr& tile) { return isLayered(tile.info); };
    return std::ranges::all_of(opened, flat) && (wanted || !std::ranges::all_of(opened, empty));
}

}  // namespace

PictureTiles::PictureTiles(const std::vector<fs::path>& paths, bool composites_wanted,
                           Console& console) {
    open(paths, composites_wanted);
    checkCommon(console);
}

void PictureTiles::open(const std::vector<fs::path>& paths, bool composites_wanted) {
    std::vector<OpenedExr> opened;
    for (const fs::path& path : paths)
        opened.emplace_back(path.string());
    const auto deep = [](const OpenedExr& tile) { return !tile.info.deep.empty(); };
    if (areComposites(opened, composites_wanted))
        kind_ = Kind::kComposite;
    else if (std::ranges::all_of(opened, deep))
        kind_ = Kind::kDeep;
    for (std::size_t i = 0; i < opened.size(); ++i) {
        PictureTile tile{.path = paths[i].string()};
        tile.input = kind_ == Kind::kComposite ? openComposite(std::move(opened[i]))
                                               : openLayered(std::move(opened[i]));
        if (!tile.info().is_peeler) {
            throw Error(ErrorKind::kInput, "nothing in it says which picture it is a tile of",
                        tile.path, "tiles are files of peeler render --tile or --crop");
        }
        const Window& window = tile.window();
        if (kind_ == Kind::kComposite || tile.hasLayers())
            tile.input->read({window.x0, window.y0, window.x1, window.y0 + 1}, tile.arrays);
        windows_.push_back(window);
        window_ = unite(window_, window);
        tiles_.push_back(std::move(tile));
    }
}

void PictureTiles::checkCommon(Console& console) {
    const auto differ = [&](const PictureTile& a, const PictureTile& b,
                            const std::string& attribute, const std::string& in_a,
                            const std::string& in_b) {
        throw Error(ErrorKind::kInput,
                    "the tiles are not of one picture: they differ in " + attribute,
                    a.path + " and " + b.path, "the first has " + in_a + "\nthe other has " + in_b);
    };
    const PictureTile& first = tiles_.front();
    for (const CommonAttribute& attribute : kCommon) {
        for (const PictureTile& tile : tiles_) {
            const std::string a = attribute.text(first.info()), b = attribute.text(tile.info());
            if (a == b) continue;
            if (attribute.required) differ(first, tile, attribute.name, a, b);
            std::string text = first.path + " and " + tile.path;
            text.append(" differ in ").append(attribute.name).append(": ").append(a);
            text.append(" and ").append(b).append("; the file will say the first");
            console.warning(text);
            break;
        }
    }
    const PictureTile* with_layers = nullptr;
    for (const PictureTile& tile : tiles_) {
        if (kind_ != Kind::kComposite && !tile.hasLayers()) continue;
        if (!with_layers) with_layers = &tile;
        const std::string a = channelsText(with_layers->arrays), b = channelsText(tile.arrays);
        if (a != b) differ(*with_layers, tile, "channels", a, b);
    }
    arrays_ = with_layers ? with_layers->arrays : LayeredImage();
    arrays_.color.channels = colorNames(first.info().plan.tinted);
    arrays_.color.type = first.info().plan.color_type;
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
            throw Error(ErrorKind::kInput, "its peeler:tile is none: " + text, tile.path,
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
        // A tile that fits as a whole says its height, which is no limit for higher ones beside it.
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
        if (!part.empty()) tile.input->read(part, images_.emplace_back());
    }
    return joinTiles(images_, window, arrays_, band);
}

}  // namespace peeler::cmd
