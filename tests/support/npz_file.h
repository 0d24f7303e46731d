// SPDX-License-Identifier: Apache-2.0
// A reader of uncompressed .npz files, without Python.
#pragma once

#include <cstdint>
#include <cstring>
#include <map>
#include <stdexcept>
#include <string>
#include <vector>

#include "support/test_support.h"

namespace peeler::test {

struct StoredArray {
    std::string type;
    std::string shape;
    std::string numbers;
    std::size_t offset = 0;

    template <class T>
    std::vector<T> as() const {
        std::vector<T> values(numbers.size() / sizeof(T));
        std::memcpy(values.data(), numbers.data(), values.size() * sizeof(T));
        return values;
    }
};

/// Returns the arrays of a file by name. Reads the local headers (APPNOTE.TXT, section 4.3.7), not
/// the directory.
inline std::map<std::string, StoredArray> readNpz(const std::filesystem::path& path) {
    const std::string bytes = bytesOf(path);
    const auto number = [&](std::size_t at, std::size_t size) {
        std::uint64_t value = 0;
        std::memcpy(&value, bytes.substr(at, size).data(), size);
        return value;
    };
    std::map<std::string, StoredArray> arrays;
    for (std::size_t at = 0; bytes.compare(at, 4, "PK\x03\x04") == 0;) {
        const std::size_t name_size = number(at + 26, 2), extra = number(at + 28, 2);
        const std::string name = bytes.substr(at + 30, name_size);
        const std::size_t size = number(at + 30 + name_size + 4, 8);  // the size in the ZIP64 field
        const std::string npy = bytes.substr(at + 30 + name_size + extra, size);
        const std::size_t header = 10 + number(at + 30 + name_size + extra + 8, 2);
        const std::string text = npy.substr(10, header - 10);
        const auto after = [&](const std::string& key, char end) {
            const std::size_t begin = text.find(key) + key.size();
            return text.substr(begin, text.find(end, begin) - begin);
        };
        StoredArray array;
        array.type = after("'descr': '", '\'');
        array.shape = after("'shape': ", ')') + ')';
        array.numbers = npy.substr(header);
        array.offset = at;
        arrays[name.substr(0, name.size() - 4)] = array;
        at += 30 + name_size + extra + size;
    }
    if (arrays.empty()) throw std::runtime_error("no arrays: " + path.string());
    return arrays;
}

}  // namespace peeler::test
