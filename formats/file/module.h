// SPDX-License-Identifier: Apache-2.0
// Locator for installed modules: our shared libraries, opened on first use since their dependencies
// would take longer to load than most commands run, and helper programs.
#pragma once

#include <filesystem>
#include <string>

namespace peeler {

/// Returns the file of this name in the module folder: PEELER_MODULES ("lib/peeler") in the folder
/// of the executable or shared library that holds this function, or in the folder above it; or
/// "peeler" in its own folder. Throws Error (kInternal) listing the searched folders.
std::filesystem::path moduleFile(const std::string& name);

/// Returns the function exported by the module under this name. Modules are never closed. Throws
/// like moduleFile(). May be called from several threads.
void* moduleFunction(const char* module, const char* function);

}  // namespace peeler
