// SPDX-License-Identifier: Apache-2.0
// The verb table.
#include "cmd/verbs.h"

namespace peeler::cmd {

std::span<const Verb> verbs() {
    static constexpr Verb kVerbs[] = {
        {"render", "Render every layer of a glTF scene into one file",
         "peeler render scene.glb -o scene.png\n"
         "peeler render scene.glb -o layers.exr --size 1920x1080 --channels normal,id\n"
         "peeler render scene.glb -o deep.####.exr --as deep --frames 1-24",
         declareRender},
        {"rays", "Trace bundles of rays: all hits, thickness, X-rays, what is inside",
         "peeler rays part.glb -o hits.npz --directions 6\n"
         "peeler rays part.glb -o thickness.png --map thickness --direction 0,0,-1\n"
         "peeler rays part.glb --axes --parity report",
         declareRays},
        {"check", "Tell whether parts can be printed: closed, oriented, crossing, wall thickness",
         "peeler check part.glb\n"
         "peeler check part.glb --json\n"
         "peeler check part.glb -o places.png",
         declareCheck},
        {"bake", "Bake what surfaces see, occlusion, thickness or light, into a scene or textures",
         "peeler bake scene.glb -o occlusion.glb\n"
         "peeler bake plant.glb -o occlusion.exr --target texture --size 2048\n"
         "peeler bake part.glb -o thickness.glb --quantity thickness --values-alone",
         declareBake},
        {"flatten", "Composite the layers of a file into one picture",
         "peeler flatten layers.exr -o flat.png\n"
         "peeler flatten deep.exr -o flat.exr\n"
         "peeler flatten layers.exr -o nearest.png --layers 1 --background 1,1,1",
         declareFlatten},
        {"extract", "Take layers, points, arrays or fragment counts out of a layered file",
         "peeler extract layers.exr -o layer.####.png\n"
         "peeler extract layers.exr --points points.ply\n"
         "peeler extract deep.exr --npz arrays.npz --depth-complexity counts.png",
         declareExtract},
        {"merge", "Put tiles of one picture together",
         "peeler merge tile.1.exr tile.2.exr -o whole.exr\n"
         "peeler merge tile.*.exr -o whole.png\n"
         "peeler merge tile.1.exr -o part.exr --allow-gaps",
         declareMerge},
        {"convert", "Turn layered into deep files and back, losslessly",
         "peeler convert deep.exr -o layers.exr --as ldi\n"
         "peeler convert layers.exr -o deep.exr --as deep\n"
         "peeler convert layers.exr -o nuke.exr --as ldi --layout nuke",
         declareConvert},
        {"view", "Show the layers of a file from another camera, or on a web page",
         "peeler view layers.exr -o right.png --orbit 20,0\n"
         "peeler view layers.exr -o close.png --fov 20 --layers 4\n"
         "peeler view layers.exr -o layers.html",
         declareView},
        {"sheet", "Show the composite and the layers side by side",
         "peeler sheet layers.exr -o sheet.png\n"
         "peeler sheet scene.glb -o methods.png --methods all\n"
         "peeler sheet scene.glb -o progression.png --progression",
         declareSheet},
        {"masks", "Make masks of objects, seen and hidden: as BOP and COCO have them, ids by layer",
         "peeler masks scene.glb -o masks\n"
         "peeler masks scene.glb -o masks --views 8 --as bop --canvas 3\n"
         "peeler masks scene.glb -o masks --by 'glob:rose*,amber*' --see-through 0.5",
         declareMasks},
        {"batch", "Run the jobs of a file, several at a time, and resume",
         "peeler batch jobs.jsonl --dry-run\n"
         "peeler batch jobs.jsonl --jobs 2 --report results.jsonl\n"
         "echo '{\"verb\": \"render\", \"args\": [\"scene.glb\", \"-o\", \"x.png\"]}' | peeler "
         "batch -",
         declareBatch},
        {"worker", "Take jobs as lines, answer with lines, and keep scenes and devices open",
         "peeler worker < jobs.jsonl\n"
         "peeler worker --jobs 2 --keep 4G\n"
         "echo '{\"id\": 1, \"verb\": \"info\", \"args\": [\"scene.glb\"]}' | peeler worker",
         declareWorker},
        {"compare", "Tell how far two pictures are apart, layer by layer",
         "peeler compare a.exr b.exr\n"
         "peeler compare a.png b.png --max-rmse 0.01\n"
         "peeler compare a.exr b.exr --composites --heatmap difference.png",
         declareCompare},
        {"info", "Tell what is in a scene or in a layered file",
         "peeler info scene.glb\n"
         "peeler info layers.exr\n"
         "peeler info scene.glb --json",
         declareInfo},
        {"verify", "Tell whether files are whole and belong together",
         "peeler verify layers.exr\n"
         "peeler verify frame.*.exr\n"
         "peeler verify layers.exr deep.exr --any-settings --json",
         declareVerify},
        {"devices", "List every GL backend and device, and why one cannot be used",
         "peeler devices\n"
         "peeler devices --json\n"
         "peeler devices --json | grep usable",
         declareDevices},
    };
    return kVerbs;
}

}  // namespace peeler::cmd
