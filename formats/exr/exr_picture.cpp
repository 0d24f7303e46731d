// SPDX-License-Identifier: Apache-2.0
#include "formats/exr/exr_picture.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <map>
#include <set>
#include <vector>

#include <peeler/error.h>
#include "core/base/names.h"

namespace peeler {
namespace {

/// The maximum number of pixels in a display window is the larger of kMostDisplay (7680 x 4320,
/// rounded up) and kMostOfStored times the number of stored pixels. Limits the size of pictures
/// made from the file.
constexpr std::uint64_t kMostDisplay = std::uint64_t{1} << 25, kMostOfStored = 256;

/// OpenEXR's name of a channel, and another program's name for it. Names are compared without case
/// (as in OpenImageIO's exrinput.cpp).
struct Spelling {
    std::string_view name, other;
};
constexpr Spelling kSpellings[] = {{"R", "red"},   {"G", "green"}, {"B", "blue"},
                                   {"A", "alpha"}, {"Z", "depth"}, {"AR", "ra"},
                                   {"AG", "ga"},   {"AB", "ba"},   {"ZBack", "zback"}};

/// The channels of a part whose names are the same up to the last dot.
struct ChannelGroup {
    const ExrInputPart& part;
    std::string prefix;              ///< text up to the last dot, with the dot
    std::vector<std::string> names;  ///< names of the channels without the prefix

    bool has(std::string_view name) const { return std::ranges::find(names, name) != names.end(); }
    /// Returns the full name of the channel, looked up by any of its spellings, or "" if the
    /// channel is missing.
    std::string find(std::string_view name) const;
    std::string findExactly(std::string_view name) const {
        return has(name) ? prefix + std::string(name) : std::string();
    }
    bool isUint(const std::string& channel) const {
        const ExrInputChannel* found = part.channel(channel);
        return found && found->type == PixelType::kUint;
    }
};

bool isSpelt(std::string_view text, std::string_view name) {
    const auto lower = [](char c) {
        return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
    };
    return std::ranges::equal(text, name, {}, lower, lower);
}

std::string ChannelGroup::find(std::string_view name) const {
    if (has(name)) return findExactly(name);
    const auto* const spelling = std::ranges::find(kSpellings, name, &Spelling::name);
    // In a group with X, Z is a component of a vector, not depth.
    if (name == "Z" && (has("x") || has("X"))) return {};
    for (const std::string& candidate : names) {
        if (isSpelt(candidate, name) || isSpelt(candidate, spelling->other))
            return prefix + candidate;
    }
    return {};
}

ExrColors colorsOf(const ChannelGroup& group) {
    ExrColors colors;
    colors.rgb = {group.find("R"), group.find("G"), group.find("B")};
    colors.alpha = group.find("A");
    colors.opacity = {group.find("AR"), group.find("AG"), group.find("AB")};
    if (std::ranges::count(colors.opacity, std::string()) != 0) colors.opacity = {};
    colors.depth = group.find("Z");
    if (group.isUint(colors.depth)) colors.depth.clear();
    colors.depth_back = group.find("ZBack");
    // In a group with X, Y is a component of a vector, not luminance.
    if (colors.colored() || group.has("X")) return colors;
    colors.luminance = group.findExactly("Y");
    if (group.isUint(colors.luminance)) colors.luminance.clear();
    colors.chroma = {group.findExactly("RY"), group.findExactly("BY")};
    if (colors.luminance.empty() || colors.chroma[0].empty() || colors.chroma[1].empty())
        colors.chroma = {};
    return colors;
}

/// Fills in the missing opacity and depth of a layer from the plain channels of the part.
void inherit(const ExrColors& whole, ExrColors& layer) {
    if (layer.alpha.empty() && !layer.tinted()) {
        layer.alpha = whole.alpha;
        layer.opacity = whole.opacity;
    }
    if (layer.depth.empty()) {
        layer.depth = whole.depth;
        layer.depth_back = whole.depth_back;
    }
}

std::vector<ChannelGroup> groupsOf(const ExrInputPart& part) {
    std::map<std::string, std::vector<std::string>> names;
    names[""];
    for (const ExrInputChannel& channel : part.channels) {
        const std::size_t dot = channel.name.rfind('.') + 1;
        names[channel.name.substr(0, dot)].push_back(channel.name.substr(dot));
    }
    std::vector<ChannelGroup> groups;
    for (auto& [prefix, of_prefix] : names)
        groups.push_back({part, prefix, std::move(of_prefix)});
    return groups;
}

/// If a prefix like "beauty.right." names a view of the part, splits it into the layer and the view
/// (openexr.com/en/latest/MultiViewOpenEXR.html).
void nameLayer(const ChannelGroup& group, ExrPicture& picture) {
    const ExrInputPart& part = group.part;
    picture.layer = group.prefix.substr(0, group.prefix.empty() ? 0 : group.prefix.size() - 1);
    picture.view = part.attribute("view");
    if (part.views.empty()) return;
    const std::size_t dot = picture.layer.rfind('.') + 1;
    const std::string last = picture.layer.substr(dot);
    if (std::ranges::find(part.views, last) != part.views.end()) {
        picture.view = last;
        picture.layer.resize(dot == 0 ? 0 : dot - 1);
    } else if (picture.layer.empty()) {
        picture.view = part.views.front();
    }
}

/// Returns the pictures in a part. In a deep part, pictures without depth are left out; if no
/// picture has colours, the part itself is the picture.
std::vector<ExrPicture> picturesOf(const ExrInputPart& part, std::size_t index) {
    std::vector<ExrPicture> pictures;
    const std::vector<ChannelGroup> groups = groupsOf(part);
    const ExrColors whole = colorsOf(groups.front());
    for (const ChannelGroup& group : groups) {
        ExrPicture picture{.part = index, .colors = colorsOf(group)};
        if (!(part.deep() ? picture.colors.colored() : picture.colors.complete())) continue;
        inherit(whole, picture.colors);
        if (part.deep() && picture.colors.depth.empty()) continue;
        nameLayer(group, picture);
        pictures.push_back(std::move(picture));
    }
    if (pictures.empty() && part.deep() && !whole.depth.empty()) {
        pictures.push_back({.part = index, .colors = whole});
        nameLayer(groups.front(), pictures.back());
    }
    return pictures;
}

/// Returns a list of at most a dozen names: "a", "b" and so on.
template <class Names>
std::string listed(const Names& names) {
    constexpr std::size_t kMost = 12;
    std::string text;
    std::size_t i = 0;
    for (const std::string& name : names) {
        if (i == kMost) return text + ", …";
        text += (i++ == 0 ? "\"" : ", \"") + name + '"';
    }
    return text;
}

/// Returns the set of name(picture) for all pictures, except "".
template <class Name>
std::set<std::string> namesOf(const std::vector<ExrPicture>& pictures, Name&& name) {
    std::set<std::string> names;
    for (const ExrPicture& picture : pictures)
        names.insert(name(picture));
    names.erase("");
    return names;
}

/// Keeps the pictures for which wanted(picture) is true. Throws Error (kUsage) if no picture is
/// left. The message says which name was asked for (`kind`, `asked`) and which names are valid
/// (`names`).
template <class Wanted>
void keepPictures(std::vector<ExrPicture>& pictures, const std::string& kind,
                  const std::string& asked, const std::string& path,
                  const std::set<std::string>& names, Wanted&& wanted) {
    std::erase_if(pictures, [&](const ExrPicture& picture) { return !wanted(picture); });
    if (!pictures.empty()) return;
    const std::vector<std::string_view> choices(names.begin(), names.end());
    throw Error(ErrorKind::kUsage, "the file has no " + kind + " \"" + asked + '"', path,
                names.empty() ? "it names no " + pluralOf(kind)
                              : choiceHint(asked, pluralOf(kind), choices));
}

/// Returns the picture to read from a part: the part itself, or else its only layer. Throws Error
/// (kInput) if the part has several layers.
const ExrPicture& pictureOfPart(const std::vector<ExrPicture>& pictures, const std::string& where) {
    const auto itself = std::ranges::find(pictures, std::string(), &ExrPicture::layer);
    if (itself != pictures.end()) return *itself;
    if (pictures.size() == 1) return pictures.front();
    throw Error(ErrorKind::kInput, "several layers hold colours", where,
                "choose one with " + Parameter::kPart + ": " +
                    listed(namesOf(pictures, [](const ExrPicture& p) { return p.layer; })));
}

/// Removes peeler's metadata about layers, so that the file is read like another program's.
void forgetLayers(ExrInfo& info) {
    info.layers.clear();
    info.prefixes.clear();
    info.composite = -1;
    info.has_cryptomatte = info.is_peeler = false;
    info.plan.layers.clear();
    info.plan.fragments_counted = info.plan.fragments_stored = info.plan.fragments_blended = 0;
    for (const char* name : {"peeler:outputHash", "peeler:layers", "peeler:complete",
                             "peeler:fragmentsCounted", "peeler:fragmentsStored"})
        info.parts.front().attributes.erase(name);
    info.deep.clear();
    for (std::size_t i = 0; i < info.parts.size(); ++i)
        if (info.parts[i].deep()) info.deep.push_back(i);
}

}  // namespace

bool ExrColors::complete() const {
    return !luminance.empty() || std::ranges::count(rgb, std::string()) == 0;
}

const std::string& ExrColors::named(std::string_view component) const {
    static const std::string none;
    const std::string* const channels[] = {&rgb[0],     &rgb[1],     &rgb[2],     &alpha,
                                           &opacity[0], &opacity[1], &opacity[2], &depth};
    constexpr std::string_view kNames[] = {"R", "G", "B", "A", "AR", "AG", "AB", "Z"};
    for (std::size_t i = 0; i < std::size(kNames); ++i)
        if (kNames[i] == component) return *channels[i];
    return none;
}

ExrPicture choosePicture(OpenedExr& opened) {
    ExrInfo& info = opened.info;
    const LayeredReadOptions& options = opened.options;
    const std::string& path = opened.files.path();
    // A program that flattens one of peeler's files may keep the attributes that describe layers.
    const bool flattened = info.is_peeler && info.layers.empty() && info.deep.empty();
    if (options.choosesPicture() || flattened) forgetLayers(info);
    std::vector<ExrPicture> pictures;
    for (std::size_t i = 0; i < info.parts.size(); ++i) {
        if (info.parts[i].deep() && std::ranges::find(info.deep, i) == info.deep.end()) continue;
        std::ranges::move(picturesOf(info.parts[i], i), std::back_inserter(pictures));
    }
    const auto partOf = [&](const ExrPicture& p) { return info.parts[p.part].name; };
    const auto viewOf = [](const ExrPicture& p) { return p.view; };
    const auto layerOf = [](const ExrPicture& p) { return p.layer; };
    const auto views = namesOf(pictures, viewOf);
    if (!options.view.empty())
        keepPictures(pictures, "view", options.view, path, views,
                     [&](const ExrPicture& p) { return p.view == options.view; });
    if (!options.part.empty()) {
        auto names = namesOf(pictures, partOf);
        const bool names_part = names.contains(options.part);
        names.merge(namesOf(pictures, layerOf));
        keepPictures(pictures, "part", options.part, path, names, [&](const ExrPicture& p) {
            return (names_part ? partOf(p) : p.layer) == options.part;
        });
    }
    const auto isDeep = [&](const ExrPicture& p) { return info.parts[p.part].deep(); };
    const auto isColored = [](const ExrPicture& p) { return p.colors.colored(); };
    if (options.part.empty() && !info.deep.empty())
        std::erase_if(pictures, [&](const ExrPicture& p) { return !isDeep(p); });
    if (std::ranges::any_of(pictures, isColored))
        std::erase_if(pictures, [&](const ExrPicture& p) { return !isColored(p); });
    if (pictures.empty() && !info.deep.empty())
        throw Error(ErrorKind::kInput, "no deep part has a half or float channel Z", path,
                    "write the depth of each sample into a channel Z");
    if (pictures.empty())
        throw Error(ErrorKind::kInput,
                    "the file has neither layers nor a picture: no part has R, G, B or Y", path,
                    Parameter::kReadExrInfo + " lists its parts");
    const std::size_t part = pictures.front().part;
    std::erase_if(pictures, [&](const ExrPicture& p) { return p.part != part; });
    const std::vector<std::string>& of_part = info.parts[part].views;
    const auto isDefault = [&](const ExrPicture& p) { return p.view == of_part.front(); };
    if (!of_part.empty() && std::ranges::any_of(pictures, isDefault))
        std::erase_if(pictures, [&](const ExrPicture& p) { return !isDefault(p); });
    ExrPicture chosen = pictureOfPart(pictures, opened.files.where(part));
    if (!isDeep(chosen)) info.deep.clear();
    if (!options.choosesPicture() && !info.is_peeler) {
        for (const std::string& view : views)
            if (view != chosen.view)
                opened.warnings.warn("The view \"" + view + "\" is not read; " + Parameter::kView +
                                     " selects it.");
    }
    return chosen;
}

void warnOfUnread(OpenedExr& opened, std::span<const std::size_t> read) {
    const ExrInfo& info = opened.info;
    if (info.is_peeler || !opened.options.part.empty()) return;
    std::vector<std::string> names;
    const std::string view =
        read.empty() ? std::string() : info.parts[read.front()].attribute("view");
    for (std::size_t i = 0; i < info.parts.size(); ++i) {
        // Parts of other views need no warning here: if no view was chosen, choosePicture() has
        // warned about them.
        if (std::ranges::find(read, i) == read.end() && info.parts[i].attribute("view") == view)
            names.push_back(info.parts[i].name);
    }
    if (names.empty()) return;
    opened.warnings.warn((names.size() == 1 ? "The part " + listed(names) + " is"
                                            : "The parts " + listed(names) + " are") +
                         " not read; " + Parameter::kPart + " selects a part.");
}

void makeDepthsFinite(std::span<float> depths, ReadWarnings& warnings) {
    constexpr float kMost = std::numeric_limits<float>::max();
    bool odd = false;
    for (float& z : depths) {
        if (std::isfinite(z)) continue;
        odd = odd || !(z > 0);
        z = z < 0 ? -kMost : kMost;
    }
    if (odd) warnings.warn("A depth is NaN or -inf; it is taken as the largest or least number.");
}

void placePixels(View& view, const Window& data, bool pixels_only, const std::string& path) {
    const Window display{0, 0, view.width, view.height};
    const auto holds = [](const Window& outer, const Window& inner) {
        return intersect(outer, inner) == inner;
    };
    if (view.known && holds(display, view.crop) && holds(view.crop, data)) return;
    if (display.pixels() > std::max(kMostDisplay, kMostOfStored * data.pixels())) {
        throw Error(ErrorKind::kInput,
                    "the display window of " + std::to_string(view.width) + " x " +
                        std::to_string(view.height) + " pixels is too large for the stored pixels",
                    path, "write the file again with a smaller display window");
    }
    view.crop = pixels_only ? display : unite(display, data);
}

}  // namespace peeler
