// SPDX-License-Identifier: Apache-2.0
// Locator of installed modules: helper programs, and peeler's shared libraries. The libraries are
// opened on first use, because loading their dependencies takes longer than most commands take to
// run.
#pragma once

#include <filesystem>
#include <string>

namespace peeler {

/// Returns the path of the file with this name in the module folder. The module folder is
/// PEELER_MODULES ("lib/peeler") in the folder of the running executable or shared library, or in
/// that folder's parent, or else "peeler" in the same folder. Throws Error (kInternal), with a list
/// of the searched folders, if none of them has the file.
std::filesystem::path moduleFile(const std::string& name);

/// Returns the path that starts this program once more: "/proc/self/exe", or the archive's launcher
/// (cmd/packages/launcher.cpp), which started the program by a dynamic linker.
std::filesystem::path programFile();

/// Returns the function that the module exports under this name. Never closes modules. Throws Error
/// (kInternal) if the module or the function is missing or cannot be loaded; its hint is to install
/// `library`, which the module needs. Thread-safe.
void* moduleFunction(const char* module, const char* function, const char* library);

}  // namespace peeler
