// SPDX-License-Identifier: Apache-2.0
// Module search relative to the running code, and loading.
#include "formats/file/module.h"

#include <dlfcn.h>
#include <link.h>

#include <array>
#include <filesystem>
#include <string>

#include <peeler/error.h>
#include "formats/file/regular_file.h"

namespace peeler {
namespace {

namespace fs = std::filesystem;

/// Returns the file that this process runs: the program, or a dynamic linker that the archive's
/// launcher started with the program (cmd/packages/launcher.cpp).
fs::path runningFile() {
    std::error_code failure;
    return fs::read_symlink("/proc/self/exe", failure);
}

bool isDynamicLinker(const fs::path& file) {
    return file.filename().string().starts_with("ld-");
}

/// Returns the folder of the executable or shared library that holds this function.
fs::path codeFolder() {
    std::error_code failure;
    Dl_info info{};
    void* extra = nullptr;
    if (dladdr1(reinterpret_cast<void*>(&codeFolder), &info, &extra, RTLD_DL_LINKMAP) != 0) {
        // For the executable, `l_name` is empty, and `dli_fname` is the name by which it was
        // called: a path if the launcher called a dynamic linker.
        const char* library = static_cast<const link_map*>(extra)->l_name;
        if (isDynamicLinker(runningFile())) library = info.dli_fname;
        if (library && *library != '\0') return fs::canonical(library, failure).parent_path();
    }
    return runningFile().parent_path();
}

}  // namespace

fs::path moduleFile(const std::string& name) {
    const fs::path code = codeFolder();
    // The first layout is that of build folders, unpacked archives and Python packages; the second,
    // of an installed program; the third, of a library in the folder of its architecture.
    const std::array<fs::path, 3> folders = {code / PEELER_MODULES,
                                             code.parent_path() / PEELER_MODULES, code / "peeler"};
    for (const fs::path& folder : folders)
        if (isSeen(folder / name)) return folder / name;
    throw Error(
        ErrorKind::kInternal, "a part of peeler is not installed", (folders[1] / name).string(),
        "copy the folder " PEELER_MODULES " along with the program; peeler also looked in " +
            folders[0].string() + " and " + folders[2].string());
}

fs::path programFile() {
    if (isDynamicLinker(runningFile())) return codeFolder().parent_path() / "bin" / "peeler";
    return "/proc/self/exe";
}

void* moduleFunction(const char* module, const char* function, const char* library) {
    const std::string file = moduleFile(module + std::string(".so"));
    void* const handle = dlopen(file.c_str(), RTLD_LAZY | RTLD_LOCAL);
    if (!handle)
        throw Error(ErrorKind::kInternal,
                    "a part of peeler cannot be loaded: " + std::string(dlerror()), file,
                    std::string("install ") + library);
    if (void* address = dlsym(handle, function)) return address;
    throw Error(ErrorKind::kInternal, "a part of peeler has another version", module,
                "install all of peeler again");
}

}  // namespace peeler
