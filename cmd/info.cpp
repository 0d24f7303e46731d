// SPDX-License-Identifier: Apache-2.0
// peeler info: what is in a file. The kind is told by the content, not by the name.
#include <filesystem>
#include <memory>

#include "cmd/cli/arguments.h"
#include "cmd/info/info_kinds.h"
#include "cmd/options/scene_options.h"
#include "cmd/verbs.h"
#include "core/base/error.h"
#include "formats/file/file_name.h"

namespace peeler::cmd {

namespace {

namespace fs = std::filesystem;

struct Printer {
    FileKind kind;
    void (*print)(const InfoOptions&, Console&);
};

constexpr Printer kPrinters[] = {
    {FileKind::kExr, printImageInfo},
    {FileKind::kGltf, printSceneInfo},
};

int printInfo(const InfoOptions& options, Console& console) {
    const FileKind kind = fileKind(options.file.string());
    for (const Printer& printer : kPrinters) {
        if (printer.kind != kind) continue;
        printer.print(options, console);
        return 0;
    }
    // What should be a scene and does not begin like one: its reader knows best what it is instead.
    const std::string extension = lowerExtension(options.file);
    if (extension == ".gltf" || extension == ".glb") printSceneInfo(options, console);
    throw Error(ErrorKind::kInput, "neither a glTF scene nor an OpenEXR image",
                options.file.string(),
                "info reads .gltf, .glb and the .exr files that peeler writes");
}

}  // namespace

VerbAction declareInfo(VerbOptions& verb) {
    const auto options = std::make_shared<InfoOptions>();
    addFile(verb, "FILE", "", options->file,
            "a scene (.gltf, .glb) or a layered or deep image (.exr)")
        .files(".gltf .glb .exr")
        .required();
    addSandboxOption(verb, options->allow_outside);
    verb.addFlag("--json", options->json, "print JSON");
    return [options](Console& console) { return printInfo(*options, console); };
}

}  // namespace peeler::cmd
