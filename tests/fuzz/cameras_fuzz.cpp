// SPDX-License-Identifier: Apache-2.0
// Fuzz target for camera files of every format. The input has the format, the convention, and the
// format's files, separated by kBetween.
#include <array>
#include <iterator>

#include "core/lens/lens_rays.h"
#include "core/scene/framing.h"
#include "core/scene/posed_scene.h"
#include "formats/cameras/camera_file.h"
#include "fuzz/fuzz_scene.h"
#include "fuzz/fuzz_target.h"

namespace peeler::fuzz {
namespace {

constexpr std::string_view kBetween = "%%%%";

/// The file names of a format, and the name passed to the reader ("": the folder).
struct CameraFiles {
    std::array<std::string_view, 3> files;
    std::string_view named;
};
constexpr CameraFiles kCameraFiles[] = {
    {{"transforms.json", "", ""}, "transforms.json"},
    {{"scene_camera.json", "camera.json", "scene_gt.json"}, "scene_camera.json"},
    {{"cameras.txt", "images.txt", ""}, ""},
    {{"cameras.bin", "images.bin", ""}, "images.bin"},
    {{"poses.npy", "", ""}, "poses.npy"},
    {{"poses.npz", "", ""}, "poses.npz"},
    {{"views.jsonl", "", ""}, "views.jsonl"},
};

/// Removes the bytes up to the next kBetween, and kBetween, from the input. Returns the bytes
/// before kBetween.
Input takePart(Input& bytes) {
    const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
    const std::size_t end = std::min(text.find(kBetween), text.size());
    const Input part = bytes.first(end);
    bytes = bytes.subspan(std::min(end + kBetween.size(), bytes.size()));
    return part;
}

void takeCameras(Input input) {
    namespace fs = std::filesystem;
    Taker taker(input);
    const CameraFiles& format = kCameraFiles[taker.below(std::size(kCameraFiles))];
    CameraFileOptions options;
    if (const std::size_t convention = taker.below(4); convention > 0)
        options.convention = static_cast<CameraConvention>(convention - 1);
    if (taker.flip()) options.size = {640, 480};
    options.lenses = options.size.width > 0;

    fs::remove_all(scratchFolder() / "cameras");
    fs::create_directory(scratchFolder() / "cameras");
    Input rest = taker.rest();
    for (const std::string_view file : format.files)
        if (!file.empty()) fileOf("cameras/" + std::string(file), takePart(rest));
    ReadWarnings warnings(false, "");
    const std::vector<FileCamera> cameras =
        readCameras(scratchFolder() / "cameras" / format.named, options, warnings);
    static const Scene scene = tinyScene();
    static const PosedScene posed(scene);
    for (std::size_t i = 0; i < std::min<std::size_t>(cameras.size(), 4); ++i)
        attempt([&] {
            CameraChoice choice = cameraChoice(cameras[i]);
            checkCamera(choice);
            if (choice.lens) {
                const LensRays rays(*choice.lens, choice.intrinsics.value_or(Intrinsics()),
                                    choice.size);
                if (const auto ray = rays.ray({1, 1})) rays.pixel(ray->direction);
            }
            const View view = makeView(posed, SceneExtent(posed), choice);
            fileCamera(view, cameras[i].name);
        });
    for (const char* name : {"written.json", "scene_camera_written.json", "written/"})
        attempt([&] { writeCameras((scratchFolder() / "cameras" / name).string(), cameras); });
}

}  // namespace
}  // namespace peeler::fuzz

PEELER_FUZZ_TARGET(cameras, peeler::fuzz::takeCameras)
