// SPDX-License-Identifier: Apache-2.0
// Finds installed modules: helper programs, and our shared libraries. The libraries are opened on
// first use, because loading their dependencies takes longer than most commands run.
#pragma once

#include <filesystem>
#include <string>

namespace peeler {

/// Returns the path of the file with this name in the module folder, which is PEELER_MODULES
/// ("lib/peeler") in the folder of the executable or shared library that holds this function, or in
/// the folder above; or "peeler" in the same folder. Throws Error (kInternal) listing the searched
/// folders.
std::filesystem::path moduleFile(const std::string& name);

/// Returns the function that the module exports under this name. Modules are never closed. Throws
/// like moduleFile(). May be called from several threads.
void* moduleFunction(const char* module, const char* function);

}  // namespace peeler
