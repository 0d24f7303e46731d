// SPDX-License-Identifier: Apache-2.0
#include "formats/file/tar_shards.h"

#include <algorithm>
#include <array>
#include <cstdlib>
#include <nlohmann/json.hpp>
#include <optional>
#include <utility>

#include <peeler/error.h>
#include "formats/file/file_name.h"
#include "formats/file/json_text.h"
#include "formats/file/regular_file.h"

namespace peeler {
namespace {

namespace fs = std::filesystem;

constexpr std::uint64_t kTarBlock = 512, kTarEnd = 2 * kTarBlock;
// The largest size that fits into 11 octal digits.
constexpr std::uint64_t kMostTarBytes = (std::uint64_t{1} << 33) - 1;
constexpr std::size_t kMostAbout = std::size_t{1} << 20;
constexpr std::string_view kAbout = "json";

using TarBlock = std::array<char, kTarBlock>;

/// The offset and size of a header field, in bytes.
struct TarField {
    std::size_t at, size;
};
constexpr TarField kTarName{0, 100}, kTarMode{100, 8}, kTarOwner{108, 8}, kTarGroup{116, 8},
    kTarSize{124, 12}, kTarDate{136, 12}, kTarChecksum{148, 8}, kTarType{156, 1}, kTarMagic{257, 8},
    kTarMajor{329, 8}, kTarMinor{337, 8}, kTarPrefix{345, 155};
/// "ustar" with a terminating zero, then the version "00".
constexpr std::string_view kUstar{
    "ustar\0"
    "00",
    8};

std::string_view fieldText(const TarBlock& block, TarField field) {
    return {block.data() + field.at, field.size};
}

/// Fills a field with octal digits and a terminating zero.
void putOctal(TarBlock& block, TarField field, std::uint64_t value) {
    for (std::size_t i = field.size - 1; i-- > 0; value /= 8)
        block[field.at + i] = static_cast<char>('0' + value % 8);
    block[field.at + field.size - 1] = '\0';
}

std::optional<std::uint64_t> octalOf(std::string_view text) {
    text = text.substr(0, text.find_first_of(std::string_view("\0 ", 2)));
    std::uint64_t value = 0;
    for (const char c : text) {
        if (c < '0' || c > '7') return {};
        value = 8 * value + static_cast<std::uint64_t>(c - '0');
    }
    return text.empty() ? std::optional<std::uint64_t>() : value;
}

/// Returns the sum of all bytes of the block, with the checksum field counted as spaces.
std::uint64_t checksumOf(const TarBlock& block) {
    std::uint64_t sum = kTarChecksum.size * ' ';
    for (std::size_t i = 0; i < block.size(); ++i)
        if (i < kTarChecksum.at || i >= kTarChecksum.at + kTarChecksum.size)
            sum += static_cast<unsigned char>(block[i]);
    return sum;
}

TarBlock headerOf(const std::string& name, std::uint64_t size, std::time_t date) {
    TarBlock block{};
    std::ranges::copy(name, block.begin());
    putOctal(block, kTarMode, 0644);
    putOctal(block, kTarOwner, 0);
    putOctal(block, kTarGroup, 0);
    putOctal(block, kTarSize, size);
    putOctal(block, kTarDate, static_cast<std::uint64_t>(date));
    block[kTarType.at] = '0';
    std::ranges::copy(kUstar, block.begin() + kTarMagic.at);
    putOctal(block, kTarMajor, 0);
    putOctal(block, kTarMinor, 0);
    // As in all tar programs, the field has six digits, a zero and a space.
    putOctal(block, {kTarChecksum.at, kTarChecksum.size - 1}, checksumOf(block));
    block[kTarChecksum.at + kTarChecksum.size - 1] = ' ';
    return block;
}

struct TarMember {
    std::string key, extension;
    std::uint64_t size = 0;
};

/// Returns the member whose header is this block, or nothing if headerOf() would not write this
/// block.
std::optional<TarMember> memberOf(const TarBlock& block) {
    const std::string_view field = fieldText(block, kTarName);
    const std::string_view name = field.substr(0, field.find('\0'));
    const std::size_t dot = name.find('.');
    const std::optional<std::uint64_t> size = octalOf(fieldText(block, kTarSize));
    if (fieldText(block, kTarMagic) != kUstar || block[kTarType.at] != '0' ||
        block[kTarPrefix.at] != '\0' ||
        octalOf(fieldText(block, kTarChecksum)) != checksumOf(block) || !size || dot == 0 ||
        dot == std::string_view::npos || name.find('/') != std::string_view::npos)
        return {};
    return TarMember{std::string(name.substr(0, dot)), std::string(name.substr(dot + 1)), *size};
}

/// Returns the bytes of a member of this size in the tar file: the header, and the data padded to a
/// whole block.
std::uint64_t tarBytes(std::uint64_t size) {
    return kTarBlock + (size + kTarBlock - 1) / kTarBlock * kTarBlock;
}

void checkTarMember(const std::string& name, std::uint64_t size) {
    if (name.size() > kTarName.size)
        throw Error(ErrorKind::kOutput, "the name of a file in a shard is longer than 100 bytes",
                    name, "give the scene a shorter name");
    if (size > kMostTarBytes)
        throw Error(ErrorKind::kOutput, "a file in a shard would be larger than 8 GiB", name,
                    "choose a smaller size, or fewer layers or channels");
}

/// Returns the members' date (reproducible-builds.org/specs/source-date-epoch).
std::time_t tarDate() {
    const char* const variable = std::getenv("SOURCE_DATE_EPOCH");
    if (!variable || !*variable) return 0;
    char* end = nullptr;
    const long long seconds = std::strtoll(variable, &end, 10);
    if (*end != '\0' || seconds < 0 || static_cast<std::uint64_t>(seconds) > kMostTarBytes)
        throw Error(ErrorKind::kUsage, "SOURCE_DATE_EPOCH is not a number of seconds", variable,
                    "unset it, or give seconds since 1970");
    return static_cast<std::time_t>(seconds);
}

/// Appends bytes [begin, end) of `from`. Returns false if `from` is shorter. Throws Error (kInput)
/// if `from` cannot be read.
bool appendPart(const RegularFile& from, std::uint64_t begin, std::uint64_t end, AtomicFile& to) {
    std::vector<char> bytes(std::min<std::uint64_t>(end - begin, std::uint64_t{1} << 20));
    while (begin < end) {
        const std::span<char> part =
            std::span(bytes).first(std::min<std::uint64_t>(bytes.size(), end - begin));
        if (from.readSome(begin, part) < part.size()) return false;
        to.append(std::as_bytes(part));
        begin += part.size();
    }
    return true;
}

}  // namespace

/// A shard of an earlier run.
struct TarShards::OldShard {
    std::string path;
    RegularFile::Identity identity{};
    std::uint64_t samples = 0;
    std::uint64_t size = 0;               ///< total bytes of the shard's samples
    std::uint64_t left = 0;               ///< number of samples not yet kept
    std::unique_ptr<RegularFile> file{};  ///< null while it is closed
    /// Whether a new shard has taken this shard's name. The old file then exists only as long as
    /// `file` is open.
    bool replaced = false;
};

TarShards::TarShards(std::string pattern, const ShardSettings& settings)
    : pattern_(std::move(pattern)), settings_(settings), date_(tarDate()) {}

TarShards::~TarShards() = default;

std::string TarShards::nameOf(int number) const {
    if (number > 0 && !hasFrameToken(pattern_))
        throw Error(ErrorKind::kUsage,
                    "the shard is full, and its name has no place for the number of the next one",
                    Parameter::kPath + " " + pattern_, "put %06d or ###### into the file's name");
    return framePath(pattern_, number);
}

std::vector<std::string> TarShards::findExisting() {
    std::vector<std::string> bad;
    for (const int number : framesThere(pattern_)) {
        const std::string path = nameOf(number);
        std::vector<std::pair<std::string, OldSample>> samples;
        std::unique_ptr<OldShard> shard = read(path, samples);
        if (!shard) {
            bad.push_back(path);
            continue;
        }
        for (auto& [key, sample] : samples) {
            sample.shard = shard.get();
            samples_.emplace(key, std::move(sample));
        }
        shard->left = shard->samples = samples.size();
        old_[number] = std::move(shard);
    }
    return bad;
}

/// Reads the samples of a shard. Returns null if the shard is incomplete or has a layout other than
/// that of add().
std::unique_ptr<TarShards::OldShard> TarShards::read(
    const std::string& path, std::vector<std::pair<std::string, OldSample>>& samples) {
    const RegularFile file(path);
    if (!file.isOpen() || file.size() < kTarEnd) return {};
    const std::uint64_t end = file.size() - kTarEnd;
    TarBlock block{};
    OldSample sample;
    std::string key;  // key of an incomplete sample; empty between samples
    std::uint64_t at = 0;
    while (at < end) {
        if (!file.read(at, block)) return {};
        const std::optional<TarMember> member = memberOf(block);
        if (!member || (!key.empty() && member->key != key)) return {};
        // No overflow, because sizes have at most 36 bits.
        const std::uint64_t next = at + tarBytes(member->size);
        if (next > end) return {};
        key = member->key;
        if (member->extension != kAbout) {
            sample.bytes += member->size;
        } else {
            std::string text(std::min<std::uint64_t>(member->size, kMostAbout), '\0');
            if (text.size() < member->size || !file.read(at + kTarBlock, text)) return {};
            try {
                const nlohmann::json about = parseJson(text, path);
                if (!about.is_object() || !about.contains("outputHash") ||
                    !about["outputHash"].is_string())
                    return {};
                sample.hash = about["outputHash"].get<std::string>();
            } catch (const Error&) {
                return {};
            }
            sample.end = next;
            samples.emplace_back(std::exchange(key, {}), std::exchange(sample, {}));
            sample.begin = next;
        }
        at = next;
    }
    std::array<char, kTarEnd> last{};
    if (!key.empty() || !file.read(end, last) ||
        std::ranges::any_of(last, [](char c) { return c != '\0'; }))
        return {};
    auto shard = std::make_unique<OldShard>();
    shard->path = path;
    shard->identity = file.identity();
    shard->size = end;
    return shard;
}

bool TarShards::contains(const std::string& key) const {
    const auto found = samples_.find(key);
    if (found == samples_.end()) return false;
    const OldShard& shard = *found->second.shard;
    return !shard.replaced || shard.file;
}

bool TarShards::contains(const std::string& key, std::string_view hash) const {
    return contains(key) && !hash.empty() && samples_.at(key).hash == hash;
}

TarShards::OldShard* TarShards::oldShard() const {
    const auto found = old_.find(number_);
    return found == old_.end() ? nullptr : found->second.get();
}

void TarShards::checkUnbroken() const {
    if (broken_)
        throw Error(ErrorKind::kOutput, "an earlier sample could not be written into the shard",
                    file_->path(), "run the same command again");
}

TarShards::Stored TarShards::keep(const std::string& key) {
    checkUnbroken();
    const OldSample& sample = samples_.at(key);
    makeRoom(sample.end - sample.begin);
    Stored stored{nameOf(number_), sample.bytes};
    const bool stays = !file_ && sample.shard == oldShard() && sample.begin == size_;
    if (!stays) {
        if (!file_) startFile();
        copy(*sample.shard, sample.begin, sample.end);
    }
    ++count_;
    size_ += sample.end - sample.begin;
    if (--sample.shard->left == 0 && sample.shard->replaced) close(*sample.shard);
    samples_.erase(key);  // each key may be stored only once
    return stored;
}

TarShards::Stored TarShards::add(const std::string& key, const nlohmann::ordered_json& about,
                                 std::span<const SampleFile> files) {
    checkUnbroken();
    const std::string text = dumpJson(about) + '\n';
    struct Input {
        Input(std::string called, const SampleFile& from)
            : name(std::move(called)), file(from.file) {}
        std::string name;
        RegularFile file;
    };
    std::deque<Input> inputs;  // a deque, because Input cannot be moved
    Stored stored;
    std::uint64_t bytes = tarBytes(text.size());
    const std::string about_name = key + '.' + std::string(kAbout);
    checkTarMember(about_name, text.size());
    for (const SampleFile& file : files) {
        const Input& input = inputs.emplace_back(key + '.' + file.extension, file);
        try {
            input.file.check();
        } catch (const Error& problem) {
            throw Error(problem.kind() == ErrorKind::kMemory ? problem.kind() : ErrorKind::kOutput,
                        "a file of the sample is lost: " + problem.whatText(), problem.whereText(),
                        "something else may have removed it");
        }
        checkTarMember(input.name, input.file.size());
        stored.bytes += input.file.size();
        bytes += tarBytes(input.file.size());
    }
    makeRoom(bytes);
    stored.shard = nameOf(number_);
    if (!file_) startFile();
    broken_ = true;
    const auto pad = [&] {
        constexpr TarBlock kZeros{};
        const std::uint64_t over = file_->size() % kTarBlock;
        if (over > 0) file_->append(std::as_bytes(std::span(kZeros).first(kTarBlock - over)));
    };
    for (const Input& input : inputs) {
        append(input.name, input.file.size());
        if (!appendPart(input.file, 0, input.file.size(), *file_))
            throw Error(ErrorKind::kOutput, "a file of the sample has been cut off", input.name,
                        "something else may have written to it");
        pad();
    }
    append(about_name, text.size());
    file_->append(std::as_bytes(std::span(text)));
    pad();
    broken_ = false;
    ++count_;
    size_ += bytes;
    return stored;
}

/// Ends the current shard if it has no room for a sample of this size.
void TarShards::makeRoom(std::uint64_t bytes) {
    const bool full = count_ >= settings_.samples || size_ + bytes + kTarEnd > settings_.bytes;
    if (count_ == 0 || !full) return;
    nameOf(number_ + 1);
    endShard(true);
}

void TarShards::append(const std::string& name, std::uint64_t size) {
    const TarBlock header = headerOf(name, size, date_);
    file_->append(std::as_bytes(std::span(header)));
}

/// Begins the current shard's file, and copies the samples kept so far into it.
void TarShards::startFile() {
    const std::string name = nameOf(number_);
    if (!settings_.replaces && isTaken(name))
        throw Error(ErrorKind::kOutput, "the file already exists", name,
                    "remove it, or choose another name");
    file_ = std::make_unique<AtomicFile>(name);
    if (size_ > 0) copy(*oldShard(), 0, size_);
}

void TarShards::endShard(bool all) {
    OldShard* const old = oldShard();
    if (!file_ && old && old->size != size_ && (all || count_ >= old->samples)) startFile();
    if (file_ && (all || !old || count_ >= old->samples)) {
        broken_ = true;  // stays true if finishing the file fails
        constexpr std::array<std::byte, kTarEnd> kZeros{};
        file_->append(kZeros);
        // Later shards may keep samples of the old shard, so open it before it is replaced.
        if (old && old->left > 0) opened(*old);
        file_->commit();
        broken_ = false;
        if (old) {
            old->replaced = true;
            if (old->left == 0) close(*old);
        }
    }
    file_.reset();
    ++number_;
    count_ = size_ = 0;
}

void TarShards::finish(bool all) {
    if (broken_)
        file_.reset();  // discards the file, which has a partial sample
    else if (count_ > 0)
        endShard(all);
    broken_ = false;
}

std::string TarShards::surplus() const {
    std::vector<int> there;
    try {
        there = framesThere(pattern_);
    } catch (const Error&) {
        return "";  // not an error, since all shards have been written
    }
    std::erase_if(there, [&](int number) { return number < number_; });
    return there.empty() ? "" : nameOf(there.front());
}

void TarShards::copy(OldShard& from, std::uint64_t begin, std::uint64_t end) {
    broken_ = true;
    if (!appendPart(opened(from), begin, end, *file_))
        throw Error(ErrorKind::kInput, "the shard can no longer be read", from.path,
                    "check the disk");
    broken_ = false;
}

/// Returns the shard's open file; opens it if needed. Only a few shards are open at a time.
RegularFile& TarShards::opened(OldShard& shard) {
    if (shard.file) return *shard.file;
    constexpr std::size_t kMostOpen = 16;
    auto file = std::make_unique<RegularFile>(shard.path);
    if (shard.replaced || !file->isOpen() || file->identity() != shard.identity)
        throw Error(ErrorKind::kInput, "the shard has changed while it was in use", shard.path,
                    "let one process write to it at a time");
    shard.file = std::move(file);
    open_.push_back(&shard);
    if (open_.size() > kMostOpen) close(*open_.front());
    return *shard.file;
}

void TarShards::close(OldShard& shard) {
    shard.file.reset();
    std::erase(open_, &shard);
}

}  // namespace peeler
