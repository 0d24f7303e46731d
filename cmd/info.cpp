// SPDX-License-Identifier: Apache-2.0
// peeler info: lists the content of a file. The kind of file is detected by content, not by name.
#include <filesystem>
#include <memory>

#include <peeler/error.h>
#include "cmd/cli/arguments.h"
#include "cmd/info/info_image.h"
#include "cmd/info/info_options.h"
#include "cmd/info/info_scene.h"
#include "cmd/options/appearance_options.h"
#include "cmd/options/scene_options.h"
#include "cmd/session/session.h"
#include "cmd/verbs.h"
#include "formats/file/file_name.h"
#include "formats/layered/opened_picture.h"

namespace peeler::cmd {

namespace {

namespace fs = std::filesystem;

int printInfo(const InfoOptions& options, Reporter& reporter) {
    if (isPictureFile(options.file.string())) {
        printImageInfo(options, reporter);
        return 0;
    }
    refusePictureChoice(options.image);
    // A file with a scene's extension but without a scene's signature goes to the scene reader,
    // which gives the best error message.
    if (!sceneFormatOf(options.file) && !isSceneName(options.file))
        throw Error(ErrorKind::kInput, "neither a scene nor an OpenEXR image",
                    options.file.string(),
                    "give a glTF, PLY, STL, OBJ, 3MF, SPZ, .splat, array or .exr file");
    printSceneInfo(options, reporter);
    return 0;
}

}  // namespace

VerbAction declareInfo(VerbOptions& verb) {
    const auto options = std::make_shared<InfoOptions>();
    addFile(
        verb, "FILE", "", options->file,
        "a scene (glTF, PLY, STL, OBJ, 3MF, SPZ, .splat, or arrays in .npz or .safetensors) or a "
        "layered or deep image (.exr, .safetensors)")
        .files(sceneExtensions() + " .exr")
        .required();
    addSceneOptions(verb, options->scene);
    addNormalizeOption(verb, options->scene);
    addUpOption(verb, options->scene.reading);
    addAppearanceOptions(verb, options->appearance);
    addLayeredOptions(verb, options->image);
    verb.addFlag("--json", options->json, "print JSON");
    return [options](Session& session) { return printInfo(*options, session.reporter()); };
}

}  // namespace peeler::cmd
