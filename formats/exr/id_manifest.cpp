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
#include <utility>

#include "core/base/error.h"
#include "formats/exr/exr_input.h"
#include "formats/exr/exr_layout.h"

namespace peeler {
namespace {

constexpr const char *kObject = "id.object", *kMaterial = "id.material";
constexpr const char* kParent = "parent";  ///< the component of the manifest, beside "name"
constexpr std::uint64_t kMostNameBytes = 1U << 28;  ///< more names than a scene has

/// Whether a channel of a part is this one, of whatever layer ("layer_000.id.object").
bool isOf(const std::string& channel, const std::string& name) {
    return channel == name || channel.ends_with("." + name);
}

/// `parents`: the ids of the parents, a second component; empty = there is none.
void addGroup(Imf::IDManifest& manifest, const Imf::ChannelList& channels, const char* name,
              const std::vector<std::string>& names, const std::vector<std::uint32_t>& parents) {
    std::set<std::string> found;
    for (auto i = channels.begin(); i != channels.end(); ++i)
        if (isOf(i.name(), name)) found.insert(i.name());
    if (found.empty() || names.empty()) return;
    const bool tree = parents.size() == names.size();
    Imf::IDManifest::ChannelGroupManifest group;
    group.setChannels(found);
    group.setComponents(tree ? std::vector<std::string>{"name", kParent}
                             : std::vector<std::string>{"name"});
    group.setLifetime(Imf::IDManifest::LIFETIME_STABLE);
    group.setHashScheme(Imf::IDManifest::NOTHASHED);
    group.setEncodingScheme(Imf::IDManifest::ID_SCHEME);
    for (std::size_t i = 0; i < names.size(); ++i) {
        std::vector<std::string> text{names[i]};
        if (tree) text.push_back(std::to_string(parents[i]));
        group.insert(i + 1, text);
    }
    manifest.add(group);
}

struct ManifestNames {
    std::vector<std::string> names;
    std::vector<std::uint32_t> parents;  ///< as many, or none
};

ManifestNames namesOf(const Imf::IDManifest& manifest, const char* name) {
    ManifestNames found;
    for (std::size_t g = 0; g < manifest.size() && found.names.empty(); ++g) {
        const auto& channels = manifest[g].getChannels();
        if (std::none_of(channels.begin(), channels.end(),
                         [name](const std::string& channel) { return isOf(channel, name); }))
            continue;
        const auto& components = manifest[g].getComponents();
        const bool tree = components.size() == 2 && components[1] == kParent;
        for (auto i = manifest[g].begin(); i != manifest[g].end(); ++i) {
            // Our ids are 1, 2, 3, …; those of other programs may be any.
            if (i.id() != found.names.size() + 1 || i.text().empty()) return {};
            found.names.push_back(i.text().front());
            if (tree && i.text().size() == 2)
                found.parents.push_back(numberIn<std::uint32_t>(i.text()[1]));
        }
    }
    if (found.parents.size() != found.names.size()) found.parents.clear();
    return found;
}

}  // namespace

void addIdManifest(Imf::Header& header, const IdNames& names) {
    Imf::IDManifest manifest;
    addGroup(manifest, header.channels(), kObject, names.objects, names.parents);
    addGroup(manifest, header.channels(), kMaterial, names.materials, {});
    if (manifest.size() > 0) Imf::addIDManifest(header, Imf::CompressedIDManifest(manifest));
}

IdNames idNamesFromManifest(std::span<const std::byte> attribute) {
    // The attribute is the unpacked size (64 bits, little-endian), then what zlib has packed.
    std::uint64_t unpacked = 0;
    if (attribute.size() < sizeof unpacked || attribute.size() > std::numeric_limits<int>::max())
        throw Error(ErrorKind::kInput, "the manifest is cut off", "idManifest");
    std::memcpy(&unpacked, attribute.data(), sizeof unpacked);
    const auto packed = attribute.subspan(sizeof unpacked);
    // OpenEXR before 3.4.15 reads the version, four bytes, without looking whether they are there.
    if (unpacked < sizeof(std::uint32_t) || unpacked > kMostNameBytes ||
        unpacked > packed.size() * kMostZlibRatio)
        throw Error(ErrorKind::kInput, "the manifest has no plausible size", "idManifest");
    try {
        Imf::CompressedIDManifest compressed;
        compressed._uncompressedDataSize = unpacked;
        compressed._compressedDataSize = static_cast<int>(packed.size());
        compressed._data = static_cast<unsigned char*>(std::malloc(packed.size()));
        if (!compressed._data) throw std::bad_alloc();
        std::memcpy(compressed._data, packed.data(), packed.size());
        const Imf::IDManifest manifest(compressed);
        ManifestNames objects = namesOf(manifest, kObject);
        return {std::move(objects.names), namesOf(manifest, kMaterial).names,
                std::move(objects.parents)};
    } catch (const std::bad_alloc&) {
        throw;
    } catch (const std::exception& e) {
        throw Error(ErrorKind::kInput, std::string("the manifest is damaged: ") + e.what(),
                    "idManifest");
    }
}

}  // namespace peeler
