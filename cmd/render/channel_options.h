// SPDX-License-Identifier: Apache-2.0
// The options of channels, Cryptomatte and the manifest of ids.
#pragma once

#include <filesystem>
#include <optional>
#include <vector>

#include <peeler/channels.h>
#include <peeler/scene.h>
#include "cmd/options/output_options.h"

namespace peeler::cmd {

class VerbOptions;

/// What is stored of every fragment besides colour and Z, and how its ids are named.
struct ChannelOptions {
    std::vector<Channel> channels{};  ///< in the order of the table, each once
    bool cryptomatte = false;
    std::optional<std::filesystem::path> manifest{};

    bool wants(Channel channel) const;
};

/// Declares --channels, --cryptomatte and --manifest.
void addChannelOptions(VerbOptions& verb, ChannelOptions& options);

/// The channels that have to be captured: those that are asked for, and ids for Cryptomatte.
std::vector<Channel> capturedChannels(const ChannelOptions& options);

/// Throws Error (kUsage) if the output holds no channels, or no composite for Cryptomatte, or if a
/// manifest would name ids that nothing asks for.
void checkChannelOptions(const ChannelOptions& options, const OutputRequest& output);

/// Writes the manifest: {"object": [{"id", "name", "cryptomatte"}], "material": [likewise]};
/// "cryptomatte" is the hash in hexadecimal digits. Throws Error (kOutput).
void writeIdManifest(const std::filesystem::path& path, const IdNames& names);

}  // namespace peeler::cmd
