// SPDX-License-Identifier: Apache-2.0
// From a scene or a layered file to the cells of a contact sheet.
#pragma once

#include <filesystem>
#include <optional>
#include <vector>

#include "cmd/cli/console.h"
#include "cmd/cli/report.h"
#include "cmd/options/camera_options.h"
#include "cmd/options/capture_job.h"
#include "cmd/options/capture_options.h"
#include "cmd/sheet/sheet_cells.h"

namespace peeler::cmd {

/// Which composites of methods the sheet of a scene shows.
enum class SheetMethods {
    kUnsorted,  ///< blending in draw order, beside the composite; where there is one of all layers
    kAll,       ///< every method's, and nothing else
    kNone
};

/// What is asked for. Of a layered file only the name in `scene`, `capture.max_layers` and `cells`
/// count; of a scene all of it. The clip volume is in `clip`, not in `capture`.
struct SheetRequest : CaptureJobOptions {
    CameraOptions camera;
    ClipOptions clip;
    SheetSettings cells;
    SheetMethods methods = SheetMethods::kUnsorted;
    std::filesystem::path output{};  ///< the sheet, which may not replace a file of the scene
};

struct SheetContent {
    std::vector<SheetCell> cells;
    std::size_t omitted = 0;        ///< cells over the limit
    std::optional<float> exposure;  ///< stops; none = it was not to be found
    PictureResult result;           ///< what the cells were made of, and with
};

/// Opens and captures the scene of `job`. Throws like CaptureJob and GlRenderer::capture().
SheetContent sheetOfScene(const SheetRequest& request, CaptureJob& job, Console& console);
/// Reads a layered file; `job` keeps the times. Throws Error (kInput) like openLayered().
SheetContent sheetOfFile(const SheetRequest& request, CaptureJob& job, Console& console);

}  // namespace peeler::cmd
