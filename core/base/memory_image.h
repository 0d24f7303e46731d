// SPDX-License-Identifier: Apache-2.0
// Memory images: files that the build's generators write and the assembler includes in peeler.
#pragma once

#include <filesystem>
#include <fstream>
#include <ios>
#include <string>
#include <type_traits>

namespace peeler {

/// Writes the memory image of `data`. Writes to a temporary name first, because the build would
/// consider an unfinished file up to date. Throws std::ios::failure or
/// std::filesystem::filesystem_error if the file cannot be written.
template <class Data>
void writeMemoryImage(const Data& data, const std::string& path) {
    static_assert(std::is_trivially_copyable_v<Data>);
    const std::string unfinished = path + ".tmp";
    std::ofstream file;
    file.exceptions(std::ios::failbit | std::ios::badbit);
    file.open(unfinished, std::ios::binary);
    file.write(reinterpret_cast<const char*>(&data), sizeof data);
    file.close();
    std::filesystem::rename(unfinished, path);
}

}  // namespace peeler
