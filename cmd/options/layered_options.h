// SPDX-License-Identifier: Apache-2.0
// Which picture of an OpenEXR file a verb reads, and its warnings.
#pragma once

#include <filesystem>
#include <memory>
#include <span>
#include <string>

#include "cmd/session/reporter.h"
#include "formats/layered/opened_picture.h"

namespace peeler::cmd {

class VerbOptions;

/// Declares --part and --view, and --strict unless the verb has it. `options` must outlive the
/// parse.
void addLayeredOptions(VerbOptions& verb, LayeredReadOptions& options);

/// Throws Error (kUsage) if a picture is chosen, of what is a scene.
void refusePictureChoice(const LayeredReadOptions& options);

/// Returns the options for reading a picture that becomes these files: only pixels count unless all
/// of them are OpenEXR's or .safetensors, which have a header and a data window. Skips empty paths.
LayeredReadOptions readingFor(const LayeredReadOptions& options,
                              std::span<const std::filesystem::path> outputs);

/// openLayered() with its warnings printed as they come. The reporter must outlive what it returns.
std::unique_ptr<LayeredInput> openInput(const std::string& path, const LayeredReadOptions& options,
                                        Reporter& reporter);
std::unique_ptr<LayeredInput> openInput(OpenedPicture opened, Reporter& reporter);

}  // namespace peeler::cmd
