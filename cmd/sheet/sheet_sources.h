// SPDX-License-Identifier: Apache-2.0
// From a scene or a layered file to the cells of a contact sheet.
#pragma once

#include <filesystem>
#include <vector>

#include "cmd/cli/choices.h"
#include "cmd/cli/console.h"
#include "cmd/cli/report.h"
#include "cmd/options/animation_options.h"
#include "cmd/options/camera_options.h"
#include "cmd/options/clip_options.h"
#include "cmd/options/look_options.h"
#include "cmd/options/scene_options.h"
#include "cmd/sheet/sheet_cells.h"
#include "core/capture/capture_settings.h"
#include "core/gl/context.h"

namespace peeler::cmd {

/// Which composites of methods the sheet of a scene shows.
enum class SheetMethods {
    kUnsorted,  ///< blending in draw order, beside the composite; where there is one of all layers
    kAll,       ///< every method's, and nothing else
    kNone
};

struct SheetRequest {
    SceneOptions input;          ///< of a file only its name
    AnimationOptions animation;  ///< of a scene
    CameraOptions camera;        ///< of a scene
    CaptureSettings capture;     ///< of a file only `max_layers`; the clip volume is in `clip`
    ClipOptions clip;
    LookOptions look;  ///< of a scene
    gl::ContextRequest device;
    SheetSettings cells;
    SheetMethods methods = SheetMethods::kUnsorted;
    std::vector<std::filesystem::path> outputs{};  ///< no file of the scene may be one of them
};

struct SheetContent {
    std::vector<SheetCell> cells;
    std::size_t omitted = 0;  ///< cells over the limit
    PictureResult result;     ///< all but the output, its bytes and size
};

SheetContent sheetOfScene(const SheetRequest& request, ProgressStyle progress, Console& console);
SheetContent sheetOfFile(const SheetRequest& request, ProgressStyle progress, Console& console);

}  // namespace peeler::cmd
