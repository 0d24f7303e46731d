// SPDX-License-Identifier: Apache-2.0
// Shared libraries of ours that are opened when something of them is needed: what they are linked
// with would take longer to load than most commands take altogether.
#pragma once

namespace peeler {

/// The function that the module exports under this name. Modules stand in PEELER_MODULES
/// ("lib/peeler") in the folder of the executable or the one above it; they are never closed.
/// Throws Error (kInternal) that says where it was looked for. May be called from several threads.
void* moduleFunction(const char* module, const char* function);

}  // namespace peeler
