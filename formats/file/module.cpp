// SPDX-License-Identifier: Apache-2.0
// Finds modules by the place of the executable, and opens them.
#include "formats/file/module.h"

#include <dlfcn.h>

#include <filesystem>
#include <string>

#include "core/base/error.h"

namespace peeler {
namespace {

namespace fs = std::filesystem;

void* opened(const std::string& file) {
    std::error_code failure;
    const fs::path program = fs::read_symlink("/proc/self/exe", failure).parent_path();
    // The first is where they lie in a build folder or an unpacked archive, the second where they
    // are installed.
    const fs::path folders[] = {program / PEELER_MODULES, program.parent_path() / PEELER_MODULES};
    for (const fs::path& folder : folders) {
        if (!fs::exists(folder / file, failure)) continue;
        if (void* handle = dlopen((folder / file).c_str(), RTLD_LAZY | RTLD_LOCAL)) return handle;
        throw Error(ErrorKind::kInternal,
                    "a part of peeler cannot be loaded: " + std::string(dlerror()), folder / file,
                    "install the libraries that it is linked with");
    }
    throw Error(ErrorKind::kInternal, "a part of peeler is not installed", folders[1] / file,
                "copy the folder " PEELER_MODULES " with the program");
}

}  // namespace

void* moduleFunction(const char* module, const char* function) {
    void* const handle = opened(module + std::string(".so"));
    if (void* address = dlsym(handle, function)) return address;
    throw Error(ErrorKind::kInternal, "a part of peeler is of another version", module,
                "install all of it again");
}

}  // namespace peeler
