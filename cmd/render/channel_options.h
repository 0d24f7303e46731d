// SPDX-License-Identifier: Apache-2.0
// Options for channels, Cryptomatte and id manifests.
#pragma once

#include <filesystem>
#include <optional>
#include <vector>

#include <peeler/channels.h>
#include <peeler/scene.h>
#include "cmd/options/output_options.h"

namespace peeler::cmd {

class VerbOptions;

/// The channels to store besides colour and Z, and the file for the names of ids.
struct ChannelOptions {
    /// Channels in the order of channelTable(), without duplicates.
    std::vector<Channel> channels{};
    bool cryptomatte = false;
    std::optional<std::filesystem::path> manifest{};

    bool wants(Channel channel) const;
};

/// Declares --channels, --cryptomatte and --manifest.
void addChannelOptions(VerbOptions& verb, ChannelOptions& options);

/// Returns the channels to capture: the requested ones, and the ids for Cryptomatte.
std::vector<Channel> capturedChannels(const ChannelOptions& options);

/// Throws Error (kUsage) if the output cannot hold the channels, if Cryptomatte has no composite,
/// or if a manifest has no ids.
void checkChannelOptions(const ChannelOptions& options, const OutputRequest& output);

/// Writes an id manifest: {"object": [{"id", "name", "cryptomatte"}], "material": [the same]}.
/// "cryptomatte" is the hash of the name in hexadecimal digits. Throws Error (kOutput) if writing
/// fails.
void writeIdManifest(const std::filesystem::path& path, const IdNames& names);

}  // namespace peeler::cmd
