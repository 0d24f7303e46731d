// SPDX-License-Identifier: Apache-2.0
// The names of ids as OpenEXR's idManifest, and back.
#include "formats/exr/exr_header.h"

#include <OpenEXR/ImfChannelList.h>
#include <OpenEXR/ImfIDManifest.h>
#include <OpenEXR/ImfStandardAttributes.h>

#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <exception>
#include <limits>
#include <set>

#include "core/base/error.h"
#include "formats/exr/exr_layout.h"

namespace peeler {
namespace {

constexpr const char *kObject = "id.object", *kMaterial = "id.material";
constexpr std::uint64_t kMostNameBytes = 1U << 30;  ///< more names than a scene has

/// Whether a channel of a part is this one, of whatever layer ("layer_000.id.object").
bool isOf(const std::string& channel, const std::string& name) {
    return channel == name || channel.ends_with("." + name);
}

void addGroup(Imf::IDManifest& manifest, const Imf::ChannelList& channels, const char* name,
              const std::vector<std::string>& names) {
    std::set<std::string> found;
    for (auto i = channels.begin(); i != channels.end(); ++i)
        if (isOf(i.name(), name)) found.insert(i.name());
    if (found.empty() || names.empty()) return;
    Imf::IDManifest::ChannelGroupManifest group;
    group.setChannels(found);
    group.setComponent("name");
    group.setLifetime(Imf::IDManifest::LIFETIME_STABLE);
    group.setHashScheme(Imf::IDManifest::NOTHASHED);
    group.setEncodingScheme(Imf::IDManifest::ID_SCHEME);
    for (std::size_t i = 0; i < names.size(); ++i)
        group.insert(i + 1, names[i]);
    manifest.add(group);
}

std::vector<std::string> namesOf(const Imf::IDManifest& manifest, const char* name) {
    std::vector<std::string> names;
    for (std::size_t g = 0; g < manifest.size() && names.empty(); ++g) {
        const auto& channels = manifest[g].getChannels();
        if (std::none_of(channels.begin(), channels.end(),
                         [name](const std::string& channel) { return isOf(channel, name); }))
            continue;
        for (auto i = manifest[g].begin(); i != manifest[g].end(); ++i) {
            // Our ids are 1, 2, 3, …; those of other programs may be any.
            if (i.id() != names.size() + 1 || i.text().empty()) return {};
            names.push_back(i.text().front());
        }
    }
    return names;
}

}  // namespace

void addIdManifest(Imf::Header& header, const IdNames& names) {
    Imf::IDManifest manifest;
    addGroup(manifest, header.channels(), kObject, names.objects);
    addGroup(manifest, header.channels(), kMaterial, names.materials);
    if (manifest.size() > 0) Imf::addIDManifest(header, Imf::CompressedIDManifest(manifest));
}

IdNames idNamesFromManifest(std::span<const std::byte> attribute) {
    // The attribute is the unpacked size (64 bits, little-endian), then what zlib has packed.
    std::uint64_t unpacked = 0;
    if (attribute.size() < sizeof unpacked || attribute.size() > std::numeric_limits<int>::max())
        throw Error(ErrorKind::kInput, "the manifest is cut off", "idManifest");
    std::memcpy(&unpacked, attribute.data(), sizeof unpacked);
    const auto packed = attribute.subspan(sizeof unpacked);
    if (unpacked > kMostNameBytes || unpacked > packed.size() * kMostZlibRatio)
        throw Error(ErrorKind::kInput, "the manifest has no plausible size", "idManifest");
    try {
        Imf::CompressedIDManifest compressed;
        compressed._uncompressedDataSize = unpacked;
        compressed._compressedDataSize = static_cast<int>(packed.size());
        compressed._data = static_cast<unsigned char*>(std::malloc(packed.size()));
        if (!compressed._data) throw std::bad_alloc();
        std::memcpy(compressed._data, packed.data(), packed.size());
        const Imf::IDManifest manifest(compressed);
        return {namesOf(manifest, kObject), namesOf(manifest, kMaterial)};
    } catch (const std::bad_alloc&) {
        throw;
    } catch (const std::exception& e) {
        throw Error(ErrorKind::kInput, std::string("the manifest is damaged: ") + e.what(),
                    "idManifest");
    }
}

}  // namespace peeler
