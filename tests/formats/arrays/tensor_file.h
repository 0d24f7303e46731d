// SPDX-License-Identifier: Apache-2.0
// A writer of .safetensors files as other programs write them: arrays sorted by name, without
// padding.
#pragma once

#include <cstdint>
#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace peeler::test {

struct TensorFile {
    struct Tensor {
        std::string type;
        std::vector<std::uint64_t> shape;
        std::string numbers;
    };
    std::map<std::string, Tensor> arrays;
    std::map<std::string, std::string> texts;

    template <class T>
    void set(const std::string& name, const char* type, std::vector<std::uint64_t> shape,
             const std::vector<T>& numbers) {
        std::string bytes(reinterpret_cast<const char*>(numbers.data()),
                          numbers.size() * sizeof(T));
        arrays[name] = {type, std::move(shape), std::move(bytes)};
    }

    std::string bytes() const {
        nlohmann::json header;
        if (!texts.empty()) header["__metadata__"] = texts;
        std::string data;
        for (const auto& [name, array] : arrays) {
            const std::size_t first = data.size();
            data += array.numbers;
            header[name] = {{"dtype", array.type},
                            {"shape", array.shape},
                            {"data_offsets", {first, data.size()}}};
        }
        const std::string text = header.dump();
        const std::uint64_t length = text.size();
        return std::string(reinterpret_cast<const char*>(&length), sizeof length) + text + data;
    }
};

}  // namespace peeler::test
