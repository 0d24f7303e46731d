// SPDX-License-Identifier: Apache-2.0
#include <peeler/files.h>

#include <utility>

#include "formats/layered/opened_picture.h"
#include "formats/meshes/scene_reader.h"
#include "formats/writers.h"

namespace peeler::inline v0 {

std::shared_ptr<const Scene> readScene(const std::filesystem::path& path,
                                       const SceneReadOptions& options) {
    return std::make_shared<const Scene>(readSceneFile(path, options));
}

std::unique_ptr<Sink> openFile(const std::string& path, const OutputOptions& options) {
    return makeSink(path, options);
}

StoredLayers readLayers(const std::string& path, const LayeredReadOptions& options) {
    const std::unique_ptr<LayeredInput> input = openLayered(path, options);
    StoredLayers layers;
    layers.plan = input->info().plan;
    layers.provenance = input->info().provenance;
    input->read(layers.plan.view.crop, layers.image);
    layers.warnings = input->takeWarnings();
    return layers;
}

void writeLayers(const std::string& path, const StoredLayers& layers, OutputOptions options) {
    options.provenance = layers.provenance;
    const std::unique_ptr<Sink> sink = makeSink(path, options);
    sink->begin(layers.plan);
    sink->write(LayeredImage(layers.image));
    sink->finish();
}

}  // namespace peeler::inline v0
