// SPDX-License-Identifier: Apache-2.0
// Locator of installed modules: helper programs, and peeler's shared libraries. The libraries are
// opened on first use, because loading their dependencies takes longer than most commands take to
// run.
#pragma once

#include <filesystem>
#include <string>

namespace peeler {

/// Returns the path of the file with this name in the module folder. The module folder is
/// PEELER_MODULES ("lib/peeler") in the folder of the executable or shared library that holds this
/// function, or in the parent of that folder; or "peeler" in the same folder. Throws Error
/// (kInternal) listing the searched folders.
std::filesystem::path moduleFile(const std::string& name);

/// Returns the function that the module exports under this name. Modules are never closed. Throws
/// like moduleFile(). Thread-safe.
void* moduleFunction(const char* module, const char* function);

}  // namespace peeler
