// SPDX-License-Identifier: Apache-2.0
// Tests that modules are found relative to the code that looks for them, in a program or a library.
#include "formats/file/module.h"

#include <dlfcn.h>
#include <gtest/gtest.h>

#include <array>
#include <filesystem>
#include <fstream>

#include <peeler/error.h>
#include "support/test_support.h"

namespace peeler::test {
namespace {

namespace fs = std::filesystem;

/// Returns the path of the module "part" as found by a library in this folder.
std::string foundFrom(const fs::path& folder) {
    fs::create_directories(folder);
    const fs::path library = folder / "finder.so";
    fs::copy_file(moduleFinder(), library);
    void* const handle = dlopen(library.c_str(), RTLD_NOW | RTLD_LOCAL);
    if (!handle) return dlerror();
    using Find = void(const char*, char*, std::size_t);
    std::array<char, 4096> text{};
    reinterpret_cast<Find*>(dlsym(handle, "findModule"))("part", text.data(), text.size());
    dlclose(handle);
    return text.data();
}

TEST(Modules, ALibraryFindsItsOwn) {
    struct Case {
        const char* library;
        const char* modules;
    };
    for (const auto& [library, modules] :
         {Case{"site-packages/peeler", "site-packages/peeler/lib/peeler"},
          Case{"usr/lib", "usr/lib/peeler"},
          Case{"usr/lib/x86_64-linux-gnu", "usr/lib/x86_64-linux-gnu/peeler"},
          Case{"opt/bin", "opt/lib/peeler"}}) {
        const ScratchDir scratch;
        const fs::path part = scratch.path() / modules / "part";
        fs::create_directories(part.parent_path());
        std::ofstream(part) << "x";
        EXPECT_EQ(foundFrom(scratch.path() / library), fs::canonical(part).string());
    }
}

TEST(Modules, ThatAreMissingAreSaid) {
    const ScratchDir scratch;
    EXPECT_EQ(foundFrom(scratch / "bin"),
              "a part of peeler is not installed: " +
                  (fs::canonical(scratch.path()) / "lib/peeler/part").string());
}

TEST(Modules, AProgramFindsItsOwn) {
    EXPECT_TRUE(fs::equivalent(moduleFile("peeler_images.so"),
                               peelerBinary().parent_path() / "lib/peeler/peeler_images.so"));
    EXPECT_THROW(moduleFile("none"), Error);
}

}  // namespace
}  // namespace peeler::test
