// SPDX-License-Identifier: Apache-2.0
// Options for reading OpenEXR files, and the warnings of the readers.
#pragma once

#include <filesystem>
#include <memory>
#include <span>
#include <string>

#include "cmd/session/reporter.h"
#include "formats/layered/opened_picture.h"

namespace peeler::cmd {

class VerbOptions;

/// Declares --part, --view and, unless the verb already has an option of this name, --strict.
/// `options` must outlive the parse.
void addLayeredOptions(VerbOptions& verb, LayeredReadOptions& options);

/// Throws Error (kUsage) if a part or view is chosen although the input is a scene.
void refusePictureChoice(const LayeredReadOptions& options);

/// Returns the options for reading a picture that will be written to these files. Ignores empty
/// paths. Sets pixels_only unless all files are OpenEXR or .safetensors, because other formats have
/// no header and no data window.
LayeredReadOptions readingFor(const LayeredReadOptions& options,
                              std::span<const std::filesystem::path> outputs);

/// Calls openLayered(). Reports the input's warnings as they occur. The reporter must outlive the
/// returned input.
std::unique_ptr<LayeredInput> openInput(const std::string& path, const LayeredReadOptions& options,
                                        Reporter& reporter);
std::unique_ptr<LayeredInput> openInput(OpenedPicture opened, Reporter& reporter);

}  // namespace peeler::cmd
