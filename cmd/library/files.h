// SPDX-License-Identifier: Apache-2.0
// Scenes and layers in files: the library's way to what `peeler` reads and writes.
#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "core/image/layered_image.h"
#include "core/image/sink.h"
#include "core/scene/scene.h"
#include "formats/exr/layered_read_options.h"
#include "formats/file/output_options.h"
#include "formats/meshes/scene_read_options.h"

#pragma GCC visibility push(default)

namespace peeler::inline v0 {

/// Reads the scene of a file (glTF, PLY, STL or OBJ, as its content says) for whoever shows it
/// (Shown::scene). Throws Error (kInput).
std::shared_ptr<const Scene> readScene(const std::filesystem::path& path,
                                       const SceneReadOptions& options = {});

/// A sink that writes a file, by its extension and `options.as`: layers as .exr (plain, or
/// `options.layout`), "deep" .exr, composites as .exr, .png, .jpg, .tif, pages as .html. The file
/// has its name when finish() returns, and there is none if the sink ends before. Throws Error
/// (kUsage) that lists what there is; begin() and write() throw Error (kOutput).
std::unique_ptr<Sink> openFile(const std::string& path, const OutputOptions& options = {});

/// A picture that is held in memory.
struct StoredLayers {
    Plan plan;  ///< view, layers, how many fragments there were
    LayeredImage image;
    Provenance provenance;
    std::vector<std::string> warnings{};  ///< of what was read and is not as the file says
};

/// Reads layered files in any layout, deep files, and flat pictures as one layer. Throws Error
/// (kInput), and (kUsage) for a part or view that is not there.
StoredLayers readLayers(const std::string& path, const LayeredReadOptions& options = {});

/// Writes them as openFile() does.
void writeLayers(const std::string& path, const StoredLayers& layers, OutputOptions options = {});

}  // namespace peeler::inline v0

#pragma GCC visibility pop
