// SPDX-License-Identifier: Apache-2.0
// Reading and writing of scene, layer and picture files.
#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include <peeler/layered_image.h>
#include <peeler/layered_read_options.h>
#include <peeler/output_options.h>
#include <peeler/scene.h>
#include <peeler/scene_read_options.h>
#include <peeler/sink.h>

#pragma GCC visibility push(default)

namespace peeler::inline v0 {

/// Reads a scene file for Shown::scene: glTF, PLY, STL, OBJ or 3MF, recognised by content. Throws
/// Error (kInput) if the file is unreadable or invalid.
std::shared_ptr<const Scene> readScene(const std::filesystem::path& path,
                                       const SceneReadOptions& options = {});

/// Returns a sink that writes a file. The extension and `options.as` select the format: layers as
/// .exr (plain, or `options.layout`), "deep" .exr, composites as .exr, .png, .jpg, .tif, pages as
/// .html. The file appears under its name when finish() returns; if the sink is destroyed earlier,
/// no file is left. Throws Error (kUsage), with the list of choices, if the extension or a name in
/// the options is unknown. begin() and write() throw Error (kOutput) if writing fails.
std::unique_ptr<Sink> openFile(const std::string& path, const OutputOptions& options = {});

struct StoredLayers {
    Plan plan;
    LayeredImage image;
    Provenance provenance;
    std::vector<Text> warnings{};  ///< about the file's header and data
};

/// Reads layered files in any layout, deep files, and flat pictures as one layer. Throws Error
/// (kInput) if the file is invalid, Error (kUsage) if the file lacks the requested part or view.
StoredLayers readLayers(const std::string& path, const LayeredReadOptions& options = {});

/// Writes layers to a file in any format of openFile().
void writeLayers(const std::string& path, const StoredLayers& layers, OutputOptions options = {});

}  // namespace peeler::inline v0

#pragma GCC visibility pop
