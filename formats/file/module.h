// SPDX-License-Identifier: Apache-2.0
// Finds what is installed with the code: shared libraries of ours that are opened when something of
// them is needed, since what they are linked with would take longer to load than most commands take
// altogether, and programs that run beside it.
#pragma once

#include <filesystem>
#include <string>

namespace peeler {

/// The file of this name in the folder of modules. That is PEELER_MODULES ("lib/peeler") in the
/// folder of the executable or shared library that holds this function, or in the folder above it;
/// or "peeler" in its own folder. Throws Error (kInternal) that says where it was looked for.
std::filesystem::path moduleFile(const std::string& name);

/// The function that the module exports under this name. Modules are never closed. Throws as
/// moduleFile() does. May be called from several threads.
void* moduleFunction(const char* module, const char* function);

}  // namespace peeler
