// SPDX-License-Identifier: Apache-2.0
// The .safetensors container: header and layout.
#include <algorithm>
#include <functional>
#include <nlohmann/json.hpp>

#include "formats/arrays/array_containers.h"
#include "formats/arrays/safetensors.h"
#include "formats/file/json_text.h"

namespace peeler {
namespace {

std::string littleEndian(std::int64_t number) {
    return {reinterpret_cast<const char*>(&number), sizeof number};
}

class SafetensorsContainer final : public ArrayContainer {
  public:
    SafetensorsContainer(std::vector<NamedArray> arrays, const ArrayTexts& texts) {
        for (NamedArray& array : arrays)
            arrays_.push_back({std::move(array), 0, {}});
        arrays_.push_back(
            {{"arrays_version", NumberType::kInt64, {}}, 0, littleEndian(kArraysVersion)});
        nlohmann::ordered_json header;
        if (!texts.empty()) header["__metadata__"] = texts;
        std::vector<PlacedArray*> order(arrays_.size());
        std::ranges::transform(arrays_, order.begin(), [](PlacedArray& array) { return &array; });
        std::ranges::stable_sort(order, std::greater(), [](const PlacedArray* placed) {
            return infoOf(placed->array.type).size;
        });
        std::uint64_t end = 0;
        for (PlacedArray* const placed : order) {
            const NamedArray& array = placed->array;
            placed->numbers = end;
            end += array.bytes();
            header[array.name] = {{"dtype", std::string(infoOf(array.type).safetensors)},
                                  {"shape", array.shape},
                                  {"data_offsets", {placed->numbers, end}}};
        }
        constexpr std::size_t kAlignment = 8;
        const std::string text = dumpJson(header);
        const std::uint64_t length = (text.size() + kAlignment - 1) / kAlignment * kAlignment;
        header_ = littleEndian(static_cast<std::int64_t>(length)) + text;
        header_.resize(sizeof length + length, ' ');
        for (PlacedArray& placed : arrays_)
            placed.numbers += header_.size();
        bytes_ = header_.size() + end;
    }

    std::uint64_t fileBytes() const override { return bytes_; }
    bool hasChecksums() const override { return false; }
    void finish(AtomicFile& file, std::span<const std::uint32_t>) const override {
        file.writeAt(0, asBytes(header_));
    }

  private:
    std::string header_;
    std::uint64_t bytes_ = 0;
};

}  // namespace

std::unique_ptr<ArrayContainer> makeSafetensors(std::vector<NamedArray> arrays,
                                                const ArrayTexts& texts) {
    return std::make_unique<SafetensorsContainer>(std::move(arrays), texts);
}

std::string safetensorsText(const std::string& path, const std::string& name) {
    const RegularFile file(path);
    return file.isOpen() ? readSafetensors(file, path).text(name) : "";
}

}  // namespace peeler
