// SPDX-License-Identifier: Apache-2.0
// Tests every file in the model collections: either all its layers can be captured, or it is
// rejected with one of the errors listed here.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>
#include <map>

#include <peeler/error.h>
#include "assets/model_files.h"
#include "cmd/options/camera_options.h"
#include "formats/gltf/gltf_reader.h"
#include "support/capture.h"
#include "support/test_support.h"

namespace peeler::test {
namespace {

namespace fs = std::filesystem;

struct Refusal {
    const char* file;
    const char* where;  ///< JSON pointer in the error
    const char* words;  ///< part of the error's message
};

/// Models that require a later glTF version or an extension that does not exist.
const Refusal kRefusals[] = {
    {"gltf-asset-generator/Compatibility/Compatibility_04.gltf", "/asset/minVersion", "2.1"},
    {"gltf-asset-generator/Compatibility/Compatibility_05.gltf", "/extensionsRequired/0",
     "FAKE_materials_quantumRendering"},
};

const Refusal* refusalOf(const std::string& file) {
    const auto found = std::find_if(std::begin(kRefusals), std::end(kRefusals),
                                    [&](const Refusal& row) { return file == row.file; });
    return found == std::end(kRefusals) ? nullptr : found;
}

void expectRefused(const fs::path& path, const Refusal& refusal) {
    try {
        readGltf(path);
        ADD_FAILURE() << "it was read";
    } catch (const Error& error) {
        EXPECT_EQ(error.kind(), ErrorKind::kInput);
        EXPECT_EQ(error.where(), refusal.where);
        EXPECT_NE(std::string(error.what()).find(refusal.words), std::string::npos) << error.what();
        EXPECT_FALSE(error.hint().empty());
    }
}

/// Captures the default scene in a small picture. Returns the number of fragments.
std::size_t captureAll(const fs::path& path) {
    GltfOptions options;
    options.strict = true;  // an error if a texture or compressed view cannot be decoded
    const Scene scene = readGltf(path, options);
    cmd::CameraOptions camera;
    camera.size = {80, 60};
    const PosedScene shown(scene);
    const View view = cmd::makeView(shown, SceneExtent(shown), camera);
    GlRenderer renderer(sharedContext(), shown);
    const Captured captured = capture(renderer, view, {});
    EXPECT_TRUE(captured.plan.complete());
    EXPECT_EQ(captured.plan.fragments_counted, captured.image.fragments());
    EXPECT_GT(captured.image.fragments(), 0U);
    return captured.image.fragments();
}

void captureFolder(const char* name, std::size_t files_expected) {
    PEELER_REQUIRE_ASSETS(assets);
    const std::vector<fs::path> files = modelFiles(assets / name);
    EXPECT_EQ(files.size(), files_expected);
    std::size_t fragments = 0, refused = 0;
    for (const fs::path& path : files) {
        const std::string file = path.lexically_relative(assets).string();
        SCOPED_TRACE(file);
        if (const Refusal* refusal = refusalOf(file)) {
            expectRefused(path, *refusal);
            ++refused;
            continue;
        }
        try {
            fragments += captureAll(path);
        } catch (const Error& error) {
            ADD_FAILURE() << error.what() << " at " << error.where();
        }
    }
    std::printf("%s: %zu files, %zu refused, %zu fragments\n", name, files.size(), refused,
                fragments);
}

TEST(EveryModel, OfTheSampleAssetsIsCapturedWhole) {
    captureFolder("gltf-sample-assets", 84);
}

TEST(EveryModel, OfTheAssetGeneratorIsCapturedWhole) {
    captureFolder("gltf-asset-generator", 53);
}

}  // namespace
}  // namespace peeler::test
