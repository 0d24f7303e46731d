// SPDX-License-Identifier: Apache-2.0
#include "cmd/render/channel_options.h"

#include <algorithm>
#include <nlohmann/json.hpp>
#include <string>

#include <peeler/error.h>
#include "cmd/cli/arguments.h"
#include "cmd/cli/errors.h"
#include "cmd/cli/report.h"
#include "cmd/session/choices.h"
#include "formats/exr/cryptomatte.h"

namespace peeler::cmd {

namespace {

/// Parses a list such as "normal,id", or "all". Returns the channels in the order of the table.
std::vector<Channel> parseChannels(const std::string& text) {
    std::vector<std::string_view> names;
    for (const ChannelInfo& info : channelTable())
        names.push_back(info.name);
    constexpr std::string_view kAlways[] = {"depth", "Z",    "z",    "color", "colour",
                                            "rgb",   "rgba", "RGBA", "alpha"};
    for (const std::string_view name : kAlways) {
        if ((',' + text + ',').find(',' + std::string(name) + ',') == std::string::npos) continue;
        refuse("every fragment has R, G, B, A and Z (depth) already: '" + std::string(name) + "'",
               "", "leave it out");
    }
    const std::vector<std::string_view> wanted =
        text == "all" ? names : listedNames("channel", text, names);
    std::vector<Channel> channels;
    for (const ChannelInfo& info : channelTable())
        if (std::ranges::find(wanted, info.name) != wanted.end()) channels.push_back(info.channel);
    return channels;
}

std::vector<ChoiceDescription> channelChoices() {
    std::vector<ChoiceDescription> choices;
    for (const ChannelInfo& info : channelTable()) {
        std::string components;
        for (const std::string_view component : info.components)
            components += (components.empty() ? "" : " ") + std::string(component);
        choices.push_back(
            {std::string(info.name), std::string(info.summary) + " (" + components + ')'});
    }
    return choices;
}

nlohmann::ordered_json namedIds(const std::vector<std::string>& names) {
    nlohmann::ordered_json list = nlohmann::ordered_json::array();
    for (std::size_t i = 0; i < names.size(); ++i) {
        list.push_back({{"id", i + 1},
                        {"name", names[i]},
                        {"cryptomatte", cryptomatteHex(cryptomatteHash(names[i]))}});
    }
    return list;
}

}  // namespace

bool ChannelOptions::wants(Channel channel) const {
    return std::find(channels.begin(), channels.end(), channel) != channels.end();
}

void addChannelOptions(VerbOptions& verb, ChannelOptions& options) {
    constexpr const char* kGroup = "Channels";
    addValue(verb, "--channels", "LIST|all", options.channels, parseChannels,
             "channels of every fragment besides R, G, B, A and Z, separated by commas, or all:")
        .someOf(channelChoices())
        .group(kGroup);
    verb.addFlag(
            "--cryptomatte", options.cryptomatte,
            "write Cryptomatte 1.4 (objects and materials) to the composite part or, for a deep "
            "image, to OUT.cryptomatte.exr; implies --channels id")
        .group(kGroup);
    addFile(verb, "--manifest", "FILE", options.manifest, "write the names of the ids as JSON")
        .files(".json")
        .group(kGroup);
}

std::vector<Channel> capturedChannels(const ChannelOptions& options) {
    std::vector<Channel> channels = options.channels;
    if (options.cryptomatte && !options.wants(Channel::kId))
        channels.insert(std::upper_bound(channels.begin(), channels.end(), Channel::kId),
                        Channel::kId);
    return channels;
}

void checkChannelOptions(const ChannelOptions& options, const OutputRequest& output) {
    const OutputFormat& format = findOutputFormat(output.path.string(), output.options.as);
    if ((!options.channels.empty() || options.cryptomatte) && format.needs) {
        throw Error(ErrorKind::kUsage, "this output has a fixed set of channels",
                    "--as " + std::string(format.kind),
                    "leave --channels and --cryptomatte out, or write --as arrays");
    }
    if ((!options.channels.empty() || options.cryptomatte) && !format.channels) {
        throw Error(ErrorKind::kUsage, "this output cannot store channels", output.path.string(),
                    "write layers or a composite as .exr, or arrays as .npz, or leave --channels "
                    "and --cryptomatte out");
    }
    if (options.cryptomatte && (!format.takesCryptomatte() || output.options.no_composite)) {
        throw Error(ErrorKind::kUsage, "Cryptomatte needs a composite", "--cryptomatte",
                    output.options.no_composite ? "leave --no-composite out"
                                                : "write --as ldi, deep or composite");
    }
    if (options.manifest && !options.cryptomatte && !options.wants(Channel::kId)) {
        throw Error(ErrorKind::kUsage, "there are no ids to name", "--manifest",
                    "add --channels id, or --cryptomatte");
    }
}

void writeIdManifest(const std::filesystem::path& path, const IdNames& names) {
    nlohmann::ordered_json json;
    json["object"] = namedIds(names.objects);
    json["material"] = namedIds(names.materials);
    writeReport(path, json);
}

}  // namespace peeler::cmd
