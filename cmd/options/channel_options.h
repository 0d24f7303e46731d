// SPDX-License-Identifier: Apache-2.0
// What is stored of every fragment besides colour and Z, and how its ids are named.
#pragma once

#include <filesystem>
#include <optional>
#include <vector>

#include "cmd/options/output_options.h"
#include "core/image/channels.h"
#include "core/scene/scene.h"

namespace peeler::cmd {

class VerbOptions;

struct ChannelOptions {
    std::vector<Channel> channels{};  ///< in the order of the table, each once
    bool cryptomatte = false;
    std::optional<std::filesystem::path> manifest{};

    bool wants(Channel channel) const;
};

/// Declares --channels, --cryptomatte and --manifest.
void addChannelOptions(VerbOptions& verb, ChannelOptions& options);

/// What has to be captured: the channels, and ids for what needs them.
std::vector<Channel> capturedChannels(const ChannelOptions& options);

/// Throws Error (kUsage) if the output holds no channels, or no composite for Cryptomatte, or if a
/// manifest would name ids that it has not.
void checkChannelOptions(const ChannelOptions& options, const OutputFlags& output);

/// Writes the manifest: {"object": [{"id", "name", "cryptomatte"}], "material": [likewise]}, the
/// last being the hash in hexadecimal. Throws Error (kOutput).
void writeIdManifest(const std::filesystem::path& path, const IdNames& names);

}  // namespace peeler::cmd
