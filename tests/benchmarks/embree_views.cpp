// SPDX-License-Identifier: Apache-2.0
// Writes the depth files of `peeler render --as lari` with Embree, without shading: for each camera
// the depths of all layers as half floats (height, width, 15); −1 means no layer.
//
//     embree_views SCENE CAMERAS FOLDER
//
// Reads the scene like peeler, builds a hierarchy, and finds and sorts all hits of all pixels of
// each view, 16 rays at once. Writes FOLDER/NAME.npy for each view, without fsync. Prints the
// numbers of views, triangles and hits as JSON.
#include <algorithm>
#include <array>
#include <bit>
#include <filesystem>
#include <fstream>
#include <glm/gtc/packing.hpp>
#include <span>
#include <string>
#include <vector>

#include <peeler/error.h>
#include "benchmarks/embree_layers.h"
#include "benchmarks/measured_scene.h"
#include "core/scene/framing.h"
#include "formats/arrays/table_writers.h"
#include "formats/cameras/camera_file.h"

namespace peeler::benchmark {
namespace {

constexpr std::size_t kPlanes = 15;

/// The depths of a picture in the file's format: halves, −1 for a missing layer.
class DepthPlanes {
  public:
    explicit DepthPlanes(const View& view)
        : shape_{static_cast<std::size_t>(view.height), static_cast<std::size_t>(view.width),
                 kPlanes},
          halves_(shape_[0] * shape_[1] * shape_[2], glm::packHalf1x16(-1)) {}

    void take(int x, int y, std::span<const EmbreeHit> hits) {
        const std::size_t pixel =
            static_cast<std::size_t>(y) * shape_[1] + static_cast<std::size_t>(x);
        std::uint16_t* half = &halves_[pixel * kPlanes];
        for (const EmbreeHit hit : hits.first(std::min(hits.size(), kPlanes)))
            *half++ = glm::packHalf1x16(
                std::bit_cast<float>(static_cast<std::uint32_t>(hit >> std::uint64_t{32})));
    }

    void write(const std::filesystem::path& path) const {
        std::ofstream file(path, std::ios::binary);
        file << npyHeader({"", NumberType::kHalf, {shape_.begin(), shape_.end()}});
        const auto bytes = asBytes(halves_);
        file.write(reinterpret_cast<const char*>(bytes.data()),
                   static_cast<std::streamsize>(bytes.size()));
        if (!file.flush()) throw Error(ErrorKind::kOutput, "cannot be written", path.string());
    }

  private:
    std::array<std::size_t, 3> shape_;
    std::vector<std::uint16_t> halves_;
};

nlohmann::json work(const Options& options, const std::filesystem::path& cameras) {
    const MeasuredScene scene(options);
    const SceneExtent extent(scene.posed);
    EmbreeLayers embree(scene.posed, Faces::kBoth);
    embree.build();
    std::size_t views = 0;
    std::uint64_t hits = 0;
    ReadWarnings warnings(false, cameras.string());
    for (const FileCamera& camera : readCameras(cameras, {}, warnings)) {
        const View view = makeView(scene.posed, extent, cameraChoice(camera));
        DepthPlanes planes(view);
        hits += embree.trace(view, Packet::k16, [&](int x, int y, std::span<const EmbreeHit> of) {
            planes.take(x, y, of);
        });
        planes.write(std::filesystem::path(options.folder) / (camera.name + ".npy"));
        ++views;
    }
    return {{"views", views}, {"triangles", embree.triangles()}, {"hits", hits}};
}

}  // namespace
}  // namespace peeler::benchmark

int main(int count, char** arguments) {
    using namespace peeler::benchmark;
    if (count != 4) {
        std::fprintf(stderr, "usage: embree_views SCENE CAMERAS FOLDER\n");
        return 2;
    }
    std::string name = "--folder";
    char* own[] = {arguments[0], arguments[1], name.data(), arguments[3]};
    return run(4, own, [&](const Options& options) { return work(options, arguments[2]); });
}
