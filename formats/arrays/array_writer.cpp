// SPDX-License-Identifier: Apache-2.0
// Writer of array files.
#include "formats/arrays/array_writer.h"

#include <libdeflate.h>
#include <zlib.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <iterator>
#include <set>
#include <utility>

#include <peeler/error.h>
#include "formats/arrays/array_containers.h"
#include "formats/file/file_name.h"

namespace peeler {
namespace {

constexpr ArrayContainerRow kArrayContainers[] = {
    {".npz", makeNpz, npzText},
    {".safetensors", makeSafetensors, safetensorsText},
};

const ArrayContainerRow* containerRow(const std::string& path) {
    const auto* const row =
        std::ranges::find(kArrayContainers, lowerExtension(path), &ArrayContainerRow::extension);
    return row == std::end(kArrayContainers) ? nullptr : row;
}

constexpr std::size_t kMaxArrays = 65535;

std::unique_ptr<ArrayContainer> makeContainer(const std::string& path,
                                              std::vector<NamedArray> arrays, ArrayTexts texts) {
    const ArrayContainerRow* const row = containerRow(path);
    if (!row)
        throw Error(ErrorKind::kUsage, "unknown extension for an array file", path,
                    "end the name in .npz or .safetensors");
    std::set<std::string_view> names{"arrays_version"};
    for (const NamedArray& array : arrays) {
        if (!names.insert(array.name).second || names.size() > kMaxArrays)
            throw Error(ErrorKind::kInternal,
                        "two arrays have the same name, or there are too many",
                        path + ": " + array.name);
    }
    for (const auto& [name, text] : texts)
        if (!text.empty() && !names.insert(name).second)
            throw Error(ErrorKind::kInternal, "an array and a text have the same name",
                        std::string(path).append(": ").append(name));
    std::erase_if(texts, [](const auto& text) { return text.second.empty(); });
    return row->make(std::move(arrays), texts);
}

}  // namespace

std::uint64_t NamedArray::bytes() const {
    std::uint64_t count = infoOf(type).size;
    for (const std::uint64_t n : shape)
        count *= n;
    return count;
}

ArrayWriter::ArrayWriter(const std::string& path, std::vector<NamedArray> arrays, ArrayTexts texts,
                         bool compress)
    : container_(makeContainer(path, std::move(arrays), std::move(texts))),
      file_(path),
      progress_(container_->arrays().size()) {
    if (compress) {
        if (!container_->canCompress())
            throw Error(ErrorKind::kUsage, "this container cannot be compressed", path,
                        "write a .npz");
        for (const PlacedArray& placed : container_->arrays())
            values_.emplace_back().resize(placed.array.bytes());
    }
    for (std::size_t i = 0; i < progress_.size(); ++i)
        append(i, asBytes(container_->arrays()[i].value));
}

ArrayWriter::~ArrayWriter() = default;

std::uint64_t ArrayWriter::fileBytes(const std::string& path, std::vector<NamedArray> arrays,
                                     ArrayTexts texts) {
    return makeContainer(path, std::move(arrays), std::move(texts))->fileBytes();
}

SizeForecast ArrayWriter::forecast(const std::string& path, std::vector<NamedArray> arrays,
                                   ArrayTexts texts, bool compress) {
    return {fileBytes(path, std::move(arrays), std::move(texts)),
            compress ? Certainty::kAtMost : Certainty::kExact};
}

std::uint64_t ArrayWriter::compressionBytes(const SizeForecast& forecast) {
    return 2 * forecast.bytes + forecast.bytes / 64;
}

void ArrayWriter::fail(const char* what, std::size_t array) const {
    throw Error(ErrorKind::kInternal, what,
                file_.path() + ": " + container_->arrays()[array].array.name);
}

void ArrayWriter::append(std::size_t array, std::span<const std::byte> numbers) {
    const std::uint64_t first = progress_[array].appended;
    progress_[array].appended += numbers.size();
    writeAt(array, first, numbers);
}

void ArrayWriter::writeAt(std::size_t array, std::uint64_t first,
                          std::span<const std::byte> numbers) {
    const PlacedArray& placed = container_->arrays()[array];
    const std::uint64_t all = placed.array.bytes();
    if (first > all || numbers.size() > all - first)
        fail("more numbers than the array holds", array);
    if (numbers.empty()) return;
    // The checksum is computed before locking, so that threads wait only for the file.
    Piece piece{first + numbers.size()};
    if (container_->hasChecksums()) piece.crc = libdeflate_crc32(0, numbers.data(), numbers.size());
    if (!values_.empty())
        std::memcpy(values_[array].data() + first, numbers.data(), numbers.size());
    const std::lock_guard lock(mutex_);
    add(array, first, piece);
    if (values_.empty()) file_.writeAt(placed.numbers + first, numbers);
}

void ArrayWriter::add(std::size_t array, std::uint64_t first, Piece piece) {
    std::map<std::uint64_t, Piece>& pieces = progress_[array].pieces;
    auto after = pieces.upper_bound(first);
    const auto before = after == pieces.begin() ? pieces.end() : std::prev(after);
    if ((before != pieces.end() && before->second.end > first) ||
        (after != pieces.end() && after->first < piece.end))
        fail("numbers are written twice", array);
    const auto joined = [](const Piece& a, const Piece& b, std::uint64_t begin_of_b) {
        const auto size = static_cast<z_off_t>(b.end - begin_of_b);
        return Piece{b.end, static_cast<std::uint32_t>(crc32_combine(a.crc, b.crc, size))};
    };
    if (after != pieces.end() && after->first == piece.end) {
        piece = joined(piece, after->second, after->first);
        after = pieces.erase(after);
    }
    if (before != pieces.end() && before->second.end == first)
        before->second = joined(before->second, piece, first);
    else
        pieces.emplace_hint(after, first, piece);
}

AtomicFile& ArrayWriter::close() {
    std::vector<std::uint32_t> crcs;
    for (std::size_t i = 0; i < progress_.size(); ++i) {
        // An empty array has no pieces.
        const auto piece = progress_[i].pieces.extract(0);
        const Piece whole = piece ? piece.mapped() : Piece{};
        if (whole.end != container_->arrays()[i].array.bytes()) fail("numbers are missing", i);
        crcs.push_back(whole.crc);
    }
    if (values_.empty())
        container_->finish(file_, crcs);
    else
        container_->compress(file_, crcs, values_);
    values_.clear();
    return file_;
}

std::span<const std::string_view> arrayExtensions() {
    static const auto extensions = [] {
        std::array<std::string_view, std::size(kArrayContainers)> all;
        std::ranges::transform(kArrayContainers, all.begin(), &ArrayContainerRow::extension);
        return all;
    }();
    return extensions;
}

bool isArrayName(const std::string& path) {
    return containerRow(path) != nullptr;
}

std::string arrayText(const std::string& path, const std::string& name) {
    const ArrayContainerRow* const row = containerRow(path);
    return row ? row->text(path, name) : "";
}

}  // namespace peeler
