// SPDX-License-Identifier: Apache-2.0
// Opens shared libraries of ours when something of them is needed: what they are linked with would
// take longer to load than most commands take altogether.
#pragma once

namespace peeler {

/// The function that the module exports under this name. Modules lie in the folder PEELER_MODULES
/// ("lib/peeler") beside the executable or beside its folder; they are never closed. Throws Error
/// (kInternal) that says where the module was looked for. May be called from several threads.
void* moduleFunction(const char* module, const char* function);

}  // namespace peeler
