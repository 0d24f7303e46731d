// SPDX-License-Identifier: Apache-2.0
// The table of verbs.
#include "cmd/verbs.h"

#include "cmd/options/file_sequence.h"

namespace peeler::cmd {

namespace {

// Headings of `peeler --help`.
constexpr const char* kToRenderScenes = "Render scenes";
constexpr const char* kToMeasureGeometry = "Measure and bake geometry";
constexpr const char* kToUseFiles = "Use layered files";
constexpr const char* kToInspect = "Inspect";
constexpr const char* kToRunJobs = "Run many jobs";

}  // namespace

std::span<const Verb> verbs() {
    static constexpr Verb kVerbs[] = {
        {"render", kToRenderScenes, "Render every layer of a scene into one file",
         "peeler render scene.glb -o scene.png\n"
         "peeler render scene.glb -o layers.exr --size 1920x1080 --channels normal,id\n"
         "peeler render scene.glb -o deep.####.exr --as deep --frames 1-24",
         "output size as channels layers samples camera views frames background include "
         "environment",
         declareRender},
        {"masks", kToRenderScenes, "Write amodal and visible masks of objects, for BOP and COCO",
         "peeler masks scene.glb -o masks\n"
         "peeler masks scene.glb -o masks --views 8 --as bop --canvas 3\n"
         "peeler masks scene.glb -o masks --by 'glob:rose*,amber*' --see-through 0.5",
         "output as by see-through canvas size camera views cameras include", declareMasks},
        {"sheet", kToRenderScenes, "Show the composite and the layers side by side",
         "peeler sheet layers.exr -o sheet.png\n"
         "peeler sheet scene.glb -o methods.png --methods all\n"
         "peeler sheet scene.glb -o progression.png --progression",
         "output show methods progression cells columns cell-width size camera layers background",
         withSequences<declareSheet>},
        {"rays", kToMeasureGeometry, "Trace bundles of rays: all hits, thickness, X-rays, voxels",
         "peeler rays part.glb -o hits.npz --directions 6\n"
         "peeler rays part.glb -o thickness.png --map thickness --direction 0,0,-1\n"
         "peeler rays part.glb --axes --parity report",
         "output direction directions resolution camera size map attenuation voxels parity "
         "columns engine",
         declareRays},
        {"check", kToMeasureGeometry,
         "Check parts for 3D printing: holes, orientation, crossings, thin walls",
         "peeler check part.glb\n"
         "peeler check part.glb --json\n"
         "peeler check part.glb -o places.png",
         "output min-wall unit together include up json", declareCheck},
        {"bake", kToMeasureGeometry,
         "Bake occlusion, thickness or light into a scene or its textures",
         "peeler bake scene.glb -o occlusion.glb\n"
         "peeler bake plant.glb -o occlusion.exr --target texture --size 2048\n"
         "peeler bake part.glb -o thickness.glb --quantity thickness --values-alone",
         "output quantity target size directions resolution max-distance bounces values-alone "
         "include environment engine",
         declareBake},
        {"flatten", kToUseFiles, "Composite the layers of a file into one picture",
         "peeler flatten layers.exr -o flat.png\n"
         "peeler flatten deep.exr -o flat.exr\n"
         "peeler flatten layers.exr -o nearest.png --layers 1 --background 1,1,1",
         "output background layers include exclude material fxaa exposure tone-map part",
         withSequences<declareFlatten>},
        {"extract", kToUseFiles, "Extract layers, points, arrays or fragment counts",
         "peeler extract layers.exr -o layer.####.png\n"
         "peeler extract layers.exr --points points.ply\n"
         "peeler extract deep.exr --npz arrays.npz --depth-complexity counts.png",
         "output points npz depth-complexity dense layer layers include part",
         withSequences<declareExtract, SequenceUse::kLayers>},
        {"merge", kToUseFiles, "Merge the tiles of one picture, or elements by depth",
         "peeler merge tile.1.exr tile.2.exr -o whole.exr\n"
         "peeler merge tile.*.exr -o whole.png\n"
         "peeler merge tile.1.exr -o part.exr --allow-gaps",
         "output elements allow-gaps as layout compression background",
         withSequences<declareMerge>},
        {"holdout", kToUseFiles,
         "Hold a file out by another one, by a scene, or by its own objects",
         "peeler holdout layers.exr --by deep.exr -o held.exr\n"
         "peeler holdout layers.exr --by scene.glb -o held.png\n"
         "peeler holdout layers.exr --include rose -o held.exr",
         "output by include exclude same-depth as background part", withSequences<declareHoldout>},
        {"convert", kToUseFiles, "Convert between layered and deep files, losslessly",
         "peeler convert deep.exr -o layers.exr --as ldi\n"
         "peeler convert layers.exr -o deep.exr --as deep\n"
         "peeler convert layers.exr -o nuke.exr --as ldi --layout nuke",
         "output as layout compression deep-merge cryptomatte no-composite part",
         withSequences<declareConvert>},
        {"view", kToUseFiles, "Show the layers of a file from another camera, or on a web page",
         "peeler view layers.exr -o right.png --orbit 20,0\n"
         "peeler view layers.exr -o close.png --fov 20 --layers 4\n"
         "peeler view layers.exr -o layers.html",
         "output orbit eye target fov size layers include max-fragments background",
         withSequences<declareView>},
        {"compare", kToInspect, "Measure how far two pictures differ, layer by layer",
         "peeler compare a.exr b.exr\n"
         "peeler compare a.png b.png --max-rmse 0.01\n"
         "peeler compare a.exr b.exr --composites --heatmap difference.png",
         "max-rmse min-psnr max-color max-depth max-count composites heatmap json",
         withSequences<declareCompare>},
        {"info", kToInspect, "Describe a scene or a layered file",
         "peeler info scene.glb\n"
         "peeler info layers.exr\n"
         "peeler info scene.glb --json",
         "json scene include variant part", declareInfo},
        {"verify", kToInspect, "Verify that files are intact and belong together",
         "peeler verify layers.exr\n"
         "peeler verify frame.*.exr\n"
         "peeler verify deep.exr --against layers.exr --any-settings --json",
         "", withSequences<declareVerify, SequenceUse::kTogether>},
        {"devices", kToInspect,
         "List all GL backends and devices, with the reason if one cannot be used",
         "peeler devices\n"
         "peeler devices --json\n"
         "peeler devices --json | grep usable",
         "", declareDevices},
        {"batch", kToRunJobs, "Run the jobs of a file, several at a time, and resume",
         "peeler batch jobs.jsonl --dry-run\n"
         "peeler batch jobs.jsonl --jobs 2 --report results.jsonl\n"
         "echo '{\"verb\": \"render\", \"args\": [\"scene.glb\", \"-o\", \"x.png\"]}' | peeler "
         "batch -",
         "", declareBatch},
        {"worker", kToRunJobs, "Run jobs from standard input; scenes and devices stay open",
         "peeler worker < jobs.jsonl\n"
         "peeler worker --jobs 2 --keep 4G\n"
         "echo '{\"id\": 1, \"verb\": \"info\", \"args\": [\"scene.glb\"]}' | peeler worker",
         "", declareWorker},
    };
    return kVerbs;
}

}  // namespace peeler::cmd
