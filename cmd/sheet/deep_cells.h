// SPDX-License-Identifier: Apache-2.0
// Cells of a sheet that compare a thinned file with its original.
#pragma once

#include <string>
#include <vector>

#include "cmd/sheet/sheet_cells.h"
#include "cmd/sheet/sheet_sources.h"

namespace peeler::cmd {

/// Returns three cells: `composite`, of the file; the composite of `original`; and the
/// transmittance of the pixel that differs most over depth, the file's in orange over the
/// original's in grey. Throws Error (kInput) like compareDeep().
std::vector<SheetCell> deepCells(const SheetRequest& request, SheetCell composite,
                                 const std::string& original, Reporter& reporter);

}  // namespace peeler::cmd
