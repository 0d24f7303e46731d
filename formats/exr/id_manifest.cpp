// SPDX-License-Identifier: Apache-2.0
// OpenEXR's idManifest: a writer based on OpenEXR's class, and a reader.
//
// OpenEXR's class trusts the sizes in the file, so it does not read here. The format is that of
// OpenEXR 3.1, src/lib/OpenEXR/ImfIDManifest.cpp.
#include "formats/exr/exr_header.h"

#include <OpenEXR/ImfChannelList.h>
#include <OpenEXR/ImfIDManifest.h>
#include <OpenEXR/ImfStandardAttributes.h>

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <numeric>
#include <set>
#include <span>
#include <string_view>
#include <utility>

#include <peeler/error.h>
#include "formats/exr/exr_chunks.h"
#include "formats/exr/exr_input.h"
#include "formats/exr/exr_layout.h"

namespace peeler {
namespace {

constexpr const char *kObject = "id.object", *kMaterial = "id.material";
/// The component that objects may have in addition to "name".
constexpr const char* kParent = "parent";
/// The maximum size of all names, in bytes. No scene has that many.
constexpr std::uint64_t kMostNameBytes = 1U << 27;

/// Whether a channel has this name in any layer (such as "layer_000.id.object").
bool isOf(const std::string& channel, const std::string& name) {
    return channel == name || channel.ends_with("." + name);
}

/// Adds a group for the channels called `name`. `parents` holds the parents' ids for a second
/// component; it may be empty.
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

/// A reader of a manifest's unpacked bytes, which are not trusted. Limits the memory that a few
/// bytes can demand through shared prefixes, overlapping runs, or a long name for many ids. Numbers
/// are little-endian.
class ManifestReader {
  public:
    explicit ManifestReader(std::span<const std::byte> bytes) : left_(bytes) {}

    IdNames read() {
        if (number<std::uint32_t>() != 0) fail("it has an unknown version");
        readTexts();
        readOrder();
        IdNames found;
        for (auto groups = number<std::uint32_t>(); groups > 0; --groups)
            readGroup(found);
        return found;
    }

  private:
    [[noreturn]] static void fail(const char* why) {
        throw Error(ErrorKind::kInput, std::string("the manifest is damaged: ") + why,
                    "idManifest");
    }

    std::span<const std::byte> take(std::uint64_t bytes) {
        if (bytes > left_.size()) fail("it ends too early");
        const auto taken = left_.first(bytes);
        left_ = left_.subspan(bytes);
        return taken;
    }

    template <class T>
    T number() {
        T value;
        std::memcpy(&value, take(sizeof value).data(), sizeof value);
        return value;
    }

    /// Reads a number stored with seven bits per byte, lowest first. All bytes except the last have
    /// the high bit set.
    std::uint64_t shortNumber() {
        std::uint64_t value = 0;
        for (unsigned shift = 0; shift < 64; shift += 7) {
            const auto byte = std::to_integer<std::uint64_t>(take(1).front());
            value |= (byte & 127U) << shift;
            if (byte < 128) return value;
        }
        fail("a number is too long");
    }

    /// Reads a list of texts: the lengths of all texts, then their bytes.
    std::vector<std::string_view> list() {
        const auto count = number<std::uint32_t>();
        if (count > left_.size()) fail("it ends too early");
        hold(count * (sizeof(std::uint64_t) + sizeof(std::string_view)));
        std::vector<std::uint64_t> lengths(count);
        for (std::uint64_t& length : lengths)
            length = shortNumber();
        std::vector<std::string_view> texts;
        texts.reserve(count);
        for (const std::uint64_t length : lengths) {
            const auto bytes = take(length);
            texts.emplace_back(reinterpret_cast<const char*>(bytes.data()), bytes.size());
        }
        return texts;
    }

    /// Adds `bytes` to the total before they are allocated. Throws Error (kInput) if the total
    /// exceeds the limit.
    void hold(std::uint64_t bytes) {
        held_ += bytes;
        if (held_ > 2 * kMostNameBytes) fail("its names are too many or too long");
    }

    /// Reads all texts, which are sorted. Every text but the first begins with the length of the
    /// prefix that it shares with the previous text. This length takes two bytes, the higher byte
    /// first, if the previous text has more than 255 bytes, else one byte.
    void readTexts() {
        for (std::string_view text : list()) {
            std::string whole;
            if (!texts_.empty()) {
                const std::string& before = texts_.back();
                const std::size_t digits = before.size() > 255 ? 2 : 1;
                if (text.size() < digits) fail("a text is too short");
                std::size_t common = 0;
                for (std::size_t i = 0; i < digits; ++i)
                    common = common << 8U | static_cast<std::uint8_t>(text[i]);
                if (common > before.size())
                    fail("a text's shared prefix is longer than the text before it");
                text.remove_prefix(digits);
                whole = before.substr(0, common);
            }
            whole += text;
            hold(sizeof(std::string) + whole.size());
            texts_.push_back(std::move(whole));
        }
    }

    /// Reads the order of the texts, stored as runs of consecutive texts. Entries refer to texts by
    /// their position in this order. If runs overlap, a text keeps its first position.
    void readOrder() {
        hold(2 * texts_.size() * sizeof(std::size_t));
        // For each text, the next text that may lack a position.
        std::vector<std::size_t> next(texts_.size() + 1);
        std::iota(next.begin(), next.end(), std::size_t{0});
        const auto free_from = [&](std::size_t text) {
            while (next[text] != text)
                text = next[text] = next[next[text]];
            return text;
        };
        for (auto runs = number<std::uint32_t>(); runs > 0; --runs) {
            const auto first = number<std::uint32_t>(), last = number<std::uint32_t>();
            if (first > last || last >= texts_.size()) fail("a run names missing texts");
            for (std::size_t text = free_from(first); text <= last; text = free_from(text)) {
                order_.push_back(text);
                next[text] = text + 1;
            }
        }
    }

    const std::string& entryText() {
        const std::uint64_t number = shortNumber();
        if (number >= order_.size()) fail("an entry names a missing text");
        return texts_[order_[number]];
    }

    std::uint64_t idStep(std::uint8_t storage) {
        if (storage == 0) return number<std::uint64_t>();
        return storage == 1 ? number<std::uint32_t>() : shortNumber();
    }

    /// Reads a group: channels, and ids with their texts. Of the groups whose ids are 1, 2, 3, …,
    /// as peeler writes them, keeps the first for objects and the first for materials.
    void readGroup(IdNames& found) {
        const auto channels = list(), components = list();
        take(1);                        // lifetime of the ids
        take(number<std::uint32_t>());  // hash scheme
        take(number<std::uint32_t>());  // encoding scheme
        const auto storage = number<std::uint8_t>();
        const auto of = [&](const char* name) {
            return std::ranges::any_of(channels, [name](std::string_view channel) {
                return isOf(std::string(channel), name);
            });
        };
        const bool objects = found.objects.empty() && of(kObject);
        const bool materials = found.materials.empty() && of(kMaterial);
        const bool tree = components.size() == 2 && components[1] == kParent;
        bool ours = (objects || materials) && !components.empty();
        std::vector<std::string> names;
        std::vector<std::uint32_t> parents;
        std::uint64_t id = 0;
        for (auto entries = number<std::uint32_t>(); entries > 0; --entries) {
            id += idStep(storage);
            ours &= id == names.size() + 1;
            for (std::size_t i = 0; i < components.size(); ++i) {
                const std::string& text = entryText();
                if (!ours || i > 1) continue;
                if (i == 0) {
                    hold(sizeof(std::string) + text.size());
                    names.push_back(text);
                } else if (tree) {
                    parents.push_back(numberIn<std::uint32_t>(text));
                }
            }
        }
        if (!ours) return;
        if (objects) found.parents = std::move(parents);
        if (objects) found.objects = names;
        if (materials) found.materials = std::move(names);
    }

    std::span<const std::byte> left_;
    std::vector<std::string> texts_;
    std::vector<std::size_t> order_;
    std::uint64_t held_ = 0;  ///< number of bytes that hold() has counted
};

}  // namespace

void addIdManifest(Imf::Header& header, const IdNames& names) {
    Imf::IDManifest manifest;
    addGroup(manifest, header.channels(), kObject, names.objects, names.parents);
    addGroup(manifest, header.channels(), kMaterial, names.materials, {});
    if (manifest.size() > 0) Imf::addIDManifest(header, Imf::CompressedIDManifest(manifest));
}

IdNames idNamesFromManifest(std::span<const std::byte> attribute) {
    // The attribute holds the unpacked size (64 bits, little-endian), then zlib data.
    std::uint64_t unpacked = 0;
    if (attribute.size() < sizeof unpacked)
        throw Error(ErrorKind::kInput, "the manifest is cut off", "idManifest");
    std::memcpy(&unpacked, attribute.data(), sizeof unpacked);
    const auto packed = attribute.subspan(sizeof unpacked);
    if (unpacked > kMostNameBytes || unpacked > packed.size() * kMostZlibRatio)
        throw Error(ErrorKind::kInput, "the manifest has an implausible size", "idManifest");
    std::vector<std::byte> bytes(unpacked);
    if (!exrInflate(packed, bytes))
        throw Error(ErrorKind::kInput, "the manifest is damaged: it does not unpack", "idManifest");
    return ManifestReader(bytes).read();
}

}  // namespace peeler
