// SPDX-License-Identifier: Apache-2.0
#include "formats/file/mapped_file.h"

#include <sys/mman.h>

#include <cstring>

#include <peeler/error.h>

namespace peeler {

MappedFile::MappedFile(const std::filesystem::path& path) : file_(path) {
    file_.check();
    const std::size_t size = file_.size();
    if (size == 0) return;
    void* const data = mmap(nullptr, size, PROT_READ, MAP_PRIVATE, file_.descriptor(), 0);
    if (data == MAP_FAILED)
        throw Error(ErrorKind::kInput, std::string("the file cannot be read: ") + strerror(errno),
                    path.string());
    bytes_ = {static_cast<const std::uint8_t*>(data), size};
}

MappedFile::~MappedFile() {
    if (bytes_.empty()) return;
    munmap(const_cast<std::uint8_t*>(bytes_.data()), bytes_.size());
}

}  // namespace peeler
