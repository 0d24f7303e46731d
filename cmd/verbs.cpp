// SPDX-License-Identifier: Apache-2.0
// The rows of the table of verbs.
#include "cmd/verbs.h"

namespace peeler::cmd {

std::span<const Verb> verbs() {
    static constexpr Verb kVerbs[] = {
        {"render", "Render every layer of a glTF scene into one file", declareRender},
        {"rays", "Trace bundles of rays: all hits, thickness, X-rays, what is inside", declareRays},
        {"check", "Tell whether parts can be printed: closed, oriented, crossing, wall thickness",
         declareCheck},
        {"bake", "Bake what surfaces see, occlusion, thickness or light, into a scene or textures",
         declareBake},
        {"flatten", "Composite the layers of a file into one picture", declareFlatten},
        {"extract", "Take layers, points, arrays or fragment counts out of a layered file",
         declareExtract},
        {"merge", "Put tiles of one picture together", declareMerge},
        {"convert", "Turn layered into deep files and back, losslessly", declareConvert},
        {"view", "Show the layers of a file from another camera, or on a web page", declareView},
        {"sheet", "Show the composite and the layers side by side", declareSheet},
        {"batch", "Run the jobs of a file, several at a time, and resume", declareBatch},
        {"compare", "Tell how far two pictures are apart, layer by layer", declareCompare},
        {"info", "Tell what is in a scene or in a layered file", declareInfo},
        {"verify", "Tell whether files are whole and belong together", declareVerify},
        {"devices", "List every GL backend and device, and why one cannot be used", declareDevices},
    };
    return kVerbs;
}

}  // namespace peeler::cmd
