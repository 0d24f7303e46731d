// SPDX-License-Identifier: Apache-2.0
// Channel, Cryptomatte and id manifest options.
#pragma once

#include <filesystem>
#include <optional>
#include <vector>

#include <peeler/channels.h>
#include <peeler/scene.h>
#include "cmd/options/output_options.h"

namespace peeler::cmd {

class VerbOptions;

/// The stored channels besides colour and Z, and the naming of ids.
struct ChannelOptions {
    std::vector<Channel> channels{};  ///< in the order of the table, each once
    bool cryptomatte = false;
    std::optional<std::filesystem::path> manifest{};

    bool wants(Channel channel) const;
};

/// Declares --channels, --cryptomatte and --manifest.
void addChannelOptions(VerbOptions& verb, ChannelOptions& options);

/// Returns the channels to capture: the requested ones, and ids for Cryptomatte.
std::vector<Channel> capturedChannels(const ChannelOptions& options);

/// Throws Error (kUsage) if the output cannot hold channels, has no composite for Cryptomatte, or a
/// manifest is given without ids.
void checkChannelOptions(const ChannelOptions& options, const OutputRequest& output);

/// Writes the manifest: {"object": [{"id", "name", "cryptomatte"}], "material": [the same]};
/// "cryptomatte" is the hash in hexadecimal digits. Throws Error (kOutput) if writing fails.
void writeIdManifest(const std::filesystem::path& path, const IdNames& names);

}  // namespace peeler::cmd
