// SPDX-License-Identifier: Apache-2.0
// Tests clips for World Tracing: shapes and conventions of its loader, and the points of planes.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "support/python.h"
#include "support/test_support.h"

namespace peeler::test {
namespace {

using Words = std::vector<std::string>;

/// Reads a clip like load_video_clip() of World Tracing's wt/data.py, checks shapes and types, and
/// unprojects the depths like _depth_to_xyz() of its wt/inference.py, with pixel coordinates from
/// 0.
constexpr const char* kReadClip = R"(
import pathlib, sys, numpy as np
from PIL import Image
folder, frames, size = pathlib.Path(sys.argv[1]), int(sys.argv[2]), int(sys.argv[3])
pictures = sorted(c for c in folder.iterdir() if c.suffix.lower() in {'.png', '.jpg', '.jpeg', '.webp'})
assert len(pictures) == frames, pictures
rgba = [np.array(Image.open(p)) for p in pictures]
arrays = [np.load(p.with_name(p.stem + '_xyz.npz'), allow_pickle=False) for p in pictures]
xyz, mask = (np.stack([a[name] for a in arrays]) for name in ('xyz', 'mask'))
assert (xyz.shape, xyz.dtype) == ((frames, 6, size, size, 3), np.float32)
assert (mask.shape, mask.dtype) == ((frames, 6, size, size), np.uint8)
mask = mask.astype(bool)
assert (xyz[~mask] == 0).all() and mask.any()
for k in range(1, 6):  # a layer has points only where the one before it has
    assert not (mask[:, k] & ~mask[:, k - 1]).any()
    assert (xyz[:, k, ..., 2] >= xyz[:, k - 1, ..., 2])[mask[:, k]].all()
for picture, alpha in zip(mask, rgba):
    assert alpha.shape == (size, size, 4) and ((alpha[..., 3] > 127) == picture[0]).all()
v, u = np.meshgrid(np.arange(size), np.arange(size), indexing='ij')
for a, points, there in zip(arrays, xyz, mask):
    K, depth = a['K'], points[..., 2].astype(float)
    expected = np.stack([(u - K[0, 2]) * depth / K[0, 0], (v - K[1, 2]) * depth / K[1, 1], depth], axis=-1)
    assert np.abs(points - expected)[there].max() < 1e-5 * depth.max()
    if len(sys.argv) > 4:
        np.testing.assert_allclose(K, [[500 / 512 * size, 0, size / 2], [0, 500 / 512 * size, size / 2], [0, 0, 1]])
poses = np.stack([a['world_to_camera'] for a in arrays])
assert poses.shape == (frames, 4, 4)
moved = [np.abs(poses[0] - pose).max() > 1e-3 for pose in poses[1:]]
changed = [(xyz[0] != points).any() for points in xyz[1:]]
print(all(moved), any(moved), all(changed))
)";

class WorldTracing : public testing::Test {
  protected:
    std::string path(const std::string& name) const { return (scratch_ / name).string(); }
    static std::string scene(const std::string& name) {
        return (sourceDir() / "examples/scenes" / (name + ".glb")).string();
    }
    Json render(const std::string& name, const std::string& output, const Words& more) const {
        Words line{"render",   scene(name),     "-o",     path(output),
                   "--preset", "world-tracing", "--json", "--quiet"};
        line.insert(line.end(), more.begin(), more.end());
        const Outcome result = runPeeler(line);
        EXPECT_EQ(result.exit_code, 0) << result.err;
        return result.exit_code == 0 ? Json::parse(result.out) : Json();
    }
    std::string read(const Words& arguments) const {
        const Outcome result = runPython(kReadClip, arguments);
        EXPECT_EQ(result.exit_code, 0) << result.err;
        return result.out;
    }

    ScratchDir scratch_;
};

TEST_F(WorldTracing, ClipsOfAnAnimatedSceneHaveTheLoadersShapes) {
    PEELER_REQUIRE_PYTHON("numpy");
    PEELER_REQUIRE_PYTHON("PIL");
    const Json clip = render("jellyfish", "clip/####.png", {"--size", "48x48"});
    EXPECT_EQ(clip.at("frames").size(), 16U);
    EXPECT_EQ(clip.at("frames")[3].at("K")[0].size(), 3U);
    EXPECT_EQ(read({path("clip"), "16", "48"}), "False False True\n");
}

TEST_F(WorldTracing, ClipsOfAMovingCameraSurroundTheScene) {
    PEELER_REQUIRE_PYTHON("numpy");
    PEELER_REQUIRE_PYTHON("PIL");
    const Json clip = render("engine", "clip/@@@@.png", {"--size", "48x48"});
    ASSERT_EQ(clip.at("views").size(), 16U);
    EXPECT_EQ(read({path("clip"), "16", "48", "preset's K"}), "True True True\n");
    // --views overrides the preset's number of views.
    EXPECT_EQ(render("engine", "two/@@@@.png", {"--size", "48x48", "--views", "2"})["views"].size(),
              2U);
}

TEST_F(WorldTracing, PointsAreThoseOfPlanes) {
    PEELER_REQUIRE_PYTHON("numpy");
    const Words camera{"--size", "64x48", "--camera", "main", "--faces", "both"};
    render("engine", "a.png", camera);
    Words line{"render",      scene("engine"), "-o",         path("a.npz"), "--dense", "6",
               "--normalize", "unit-cube",     "--channels", "position",    "--quiet"};
    line.insert(line.end(), camera.begin(), camera.end());
    ASSERT_EQ(runPeeler(line).exit_code, 0);
    const Outcome same = runPython(R"(
import sys, numpy as np
sample, planes = (np.load(path) for path in sys.argv[1:])
mask = sample['mask'].astype(bool)
assert (mask == (np.arange(6)[:, None, None] < planes['count'])).all() and mask[5].any()
xyz = sample['xyz'][mask].astype(float)
assert (xyz[:, 2] == np.moveaxis(planes['z'], 2, 0)[mask]).all()
world = np.moveaxis(planes['positions'], 2, 0)[mask].astype(float)
pose = sample['world_to_camera']
assert np.abs(world @ pose[:3, :3].T + pose[:3, 3] - xyz).max() < 1e-5
)",
                                   {path("a_xyz.npz"), path("a.npz")});
    EXPECT_EQ(same.exit_code, 0) << same.err;
}

TEST_F(WorldTracing, ShardsTakeThemAsSamples) {
    PEELER_REQUIRE_PYTHON("numpy");
    render("engine", "clips-%06d.tar", {"--size", "16x16", "--views", "2"});
    const Outcome members =
        runPython("import sys, tarfile\nprint(tarfile.open(sys.argv[1]).getnames())",
                  {path("clips-000000.tar")});
    EXPECT_EQ(members.out,
              "['engine_0000.png', 'engine_0000.xyz.npz', 'engine_0000.json', 'engine_0001.png', "
              "'engine_0001.xyz.npz', 'engine_0001.json']\n");
}

}  // namespace
}  // namespace peeler::test
