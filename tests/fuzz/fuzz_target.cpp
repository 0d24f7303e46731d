// SPDX-License-Identifier: Apache-2.0
#include "fuzz/fuzz_target.h"

#include <stdlib.h>
#include <unistd.h>

#include <cstdlib>
#include <fstream>
#include <stdexcept>

namespace peeler::fuzz {
namespace {

namespace fs = std::filesystem;

/// Returns the parent of the scratch folder: in memory, if possible, because targets write and sync
/// many files.
fs::path placeOfFolder() {
    const bool chosen = std::getenv("TMPDIR") != nullptr;
    return !chosen && access("/dev/shm", W_OK) == 0 ? "/dev/shm" : fs::temp_directory_path();
}

class Folder {
  public:
    Folder() {
        std::string name = placeOfFolder() / "peeler_fuzz.XXXXXX";
        if (!mkdtemp(name.data())) throw std::runtime_error("no folder can be made: " + name);
        path_ = name;
    }
    ~Folder() {
        std::error_code failure;
        fs::remove_all(path_, failure);
    }
    Folder(const Folder&) = delete;
    Folder& operator=(const Folder&) = delete;
    const fs::path& path() const { return path_; }

  private:
    fs::path path_;
};

}  // namespace

std::vector<Target>& targets() {
    static std::vector<Target> all;
    return all;
}

fs::path scratchFolder() {
    static const Folder folder;
    return folder.path();
}

std::string fileOf(std::string_view name, Input bytes) {
    const fs::path path = scratchFolder() / name;
    std::ofstream file(path, std::ios::binary);
    file.write(reinterpret_cast<const char*>(bytes.data()),
               static_cast<std::streamsize>(bytes.size()));
    file.close();
    if (!file) throw std::runtime_error("cannot write " + path.string());
    return path;
}

}  // namespace peeler::fuzz
