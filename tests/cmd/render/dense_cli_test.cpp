// SPDX-License-Identifier: Apache-2.0
// Tests that arrays and depth planes of render, extract and rays agree, and that files for LaRI and
// X-Ray can be read as the loaders of those projects read them.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "cmd/tiny_gltf.h"
#include "support/npz_file.h"
#include "support/python.h"
#include "support/test_support.h"

namespace peeler::test {
namespace {

namespace fs = std::filesystem;

/// Compares planes with lists, for every array that has a row per hit. The fill value depends on
/// the array.
constexpr const char* kPlanesOfLists = R"(
import sys, numpy as np
dense, lists = (np.load(path, allow_pickle=False) for path in sys.argv[1:3])
fill, half = sys.argv[3], sys.argv[4] == 'half'
splits = lists['ray_splits']
counts = np.diff(splits)
n = len(lists['ray_splits']) and int(splits[-1])
assert (dense['count'].reshape(-1) == counts).all()
pixels = dense['count'].shape
compared = []
for name in lists.files:
    rows = lists[name]
    if name in ('ray_splits', 'layer') or rows.shape[:1] != (n,): continue
    planes = dense[name]
    depth = planes.shape[len(pixels)]
    assert planes.shape == pixels + (depth,) + rows.shape[1:], (name, planes.shape)
    floating = rows.dtype.kind == 'f'
    kind = (np.float16 if half else np.float32) if floating else rows.dtype
    assert planes.dtype == kind, (name, planes.dtype)
    nothing = (float('nan') if fill == 'last' else float(fill)) if floating else 0 if name == 'facing' else 0xFFFFFFFF
    flat = np.full((len(counts), depth) + rows.shape[1:], nothing, dtype=kind)
    for k in range(depth):
        there = counts > k
        flat[there, k] = rows[splits[:-1][there] + k].astype(kind)
        if fill == 'last' and floating:
            again = (counts > 0) & ~there
            flat[again, k] = rows[splits[1:][again] - 1].astype(kind)
    assert np.array_equal(planes.reshape(flat.shape), flat, equal_nan=floating), name
    compared.append(name)
print(len(compared))
assert 'z' in compared or 't_hit' in compared
assert (counts > depth).any() and (counts < depth).any() and (counts == 0).any()
)";

/// Reads a sample like LaRI's src/datasets/objaverse.py, ldi_render_per_object.py and gso.py.
/// Points computed from its depths must match the picture's positions, and masks from all sources
/// must agree.
constexpr const char* kReadLari = R"(
import sys, numpy as np
from PIL import Image
png, ldi_file, npy, planes = sys.argv[1:5]
stored = np.array(Image.open(png))
image = np.array(Image.open(png).convert('RGB'))
ldi = np.load(ldi_file)['ldi'][:, :, :5]
assert ldi.dtype == np.float16 and np.load(ldi_file)['ldi'].shape == image.shape[:2] + (15,)
pose = np.load(npy)
assert pose.shape == (3, 4) and pose.dtype == np.float64
there = ldi != -1
# Their sanity check of colour and depth, with its threshold and with none.
for mask in (stored.sum(axis=-1) > 100, stored.sum(axis=-1) > 0, image.sum(axis=-1) > 0, stored[..., 3] > 127):
    assert (mask == there[:, :, 0]).all()
dense = np.load(planes)
assert (there[:, :, 0] == (dense['count'] > 0)).all() and 100 < there[:, :, 0].sum() < there[:, :, 0].size
assert (ldi[there] > 0).all() and (np.diff(np.where(there, ldi, np.inf).astype(float), axis=2)[there[:, :, 1:]] >= 0).all()
# Blender's world to its camera, and that to computer vision's, as load_camera_params_obj() has it.
to_blender = np.array([[1, 0, 0, 0], [0, 0, -1, 0], [0, 1, 0, 0], [0, 0, 0, 1.0]])
world_to_camera = np.diag([1, -1, -1, 1.0]) @ np.vstack([pose, [0, 0, 0, 1]]) @ to_blender
height, width = ldi.shape[:2]
size = dense['bundle_size'][0]
x, y = np.meshgrid((np.arange(width) + 0.5) / width - 0.5, (np.arange(height) + 0.5) / height - 0.5)
z = ldi.astype(float)
seen = np.stack([x[..., None] * size[0] * z, y[..., None] * size[1] * z, z], axis=-1)[there]
world = dense['positions'][:, :, :5][there].astype(float)
camera = world @ world_to_camera[:3, :3].T + world_to_camera[:3, 3]
off = np.abs(camera - seen).max()
print(off)
assert off < 2e-3 * z[there].max(), off
)";

/// Reads a sample like load_xrays() of X-Ray's src/dataset.py, and uses it as X-Ray does.
constexpr const char* kReadXray = R"(
import sys, numpy as np
from scipy.sparse import csr_matrix
loaded_data = np.load(sys.argv[1])
planes = np.load(sys.argv[2])
height, width = planes['count'].shape
loaded_sparse_matrix = csr_matrix((loaded_data['data'], loaded_data['indices'], loaded_data['indptr']), shape=loaded_data['shape'])
original_shape = (16, 1+3+3, height, width)
xrays = loaded_sparse_matrix.toarray().reshape(original_shape)
loaded_sparse_matrix.check_format(full_check=True)
assert loaded_sparse_matrix.has_canonical_format
assert xrays.dtype == np.float32
depth = planes['t_hit'].shape[2]
hit = xrays[:, 0] > 0
counts = planes['count']
assert (hit == (np.arange(16)[:, None, None] < counts)).all() and counts.max() >= 3
front = lambda name: np.moveaxis(planes[name], 2, 0)
there = hit[:depth]
assert (xrays[:depth, 0][there] == front('t_hit')[there]).all()
normals = np.moveaxis(xrays[:depth, 1:4], 1, -1)[there]
axes = np.stack([planes['bundle_right'][0], planes['bundle_up'][0], -planes['bundle_direction'][0]])
assert np.abs(normals - front('primitive_normals')[there] @ axes.T).max() < 1e-6
assert np.abs(np.linalg.norm(normals, axis=1) - 1).max() < 2e-3
colors = np.moveaxis(xrays[:depth, 4:7], 1, -1)[there]
linear = np.clip(front('base_color')[there], 0, 1)
encoded = np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)
assert np.abs(colors - encoded).max() < 1e-6 and colors.max() > 0.3 and colors.min() >= 0
assert (xrays[:, 1:][np.repeat(~hit[:, None], 6, axis=1)] == 0).all()
)";

class Dense : public testing::Test {
  protected:
    std::string path(const std::string& name) const { return (scratch_ / name).string(); }
    static Outcome run(std::vector<std::string> line) {
        line.emplace_back("--quiet");
        const Outcome result = runPeeler(line);
        EXPECT_EQ(result.exit_code, 0) << line[0] << ' ' << line[1] << ": " << result.err;
        return result;
    }
    static Json resultOf(std::vector<std::string> line) {
        line.emplace_back("--json");
        return Json::parse(run(line).out);
    }
    static void python(const char* program, const std::vector<std::string>& arguments) {
        const Outcome read = runPython(program, arguments);
        EXPECT_EQ(read.exit_code, 0) << read.err;
    }
    static void refused(std::vector<std::string> line, const std::vector<std::string>& parts) {
        line.emplace_back("--quiet");
        const Outcome result = runPeeler(line);
        EXPECT_EQ(result.exit_code, 2) << line[0] << ' ' << line.back();
        for (const std::string& part : parts)
            EXPECT_TRUE(contains(result.err, part)) << part << " is not in " << result.err;
    }
    std::string tinted() const { return writeScene(scratch_.path(), tintedPanes()).string(); }

    ScratchDir scratch_;
    fs::path scenes_ = sourceDir() / "examples" / "scenes";
    std::string glasses_ = scenes_ / "glasses.glb";
    std::string engine_ = scenes_ / "engine.glb";
};

TEST_F(Dense, ArraysOfRenderAreThoseOfExtract) {
    const std::vector<std::vector<std::string>> cases{
        {glasses_, "--channels", "all"},
        {engine_, "--channels", "normal,id", "--layers", "3", "--crop", "20,10,33,17"},
        {tinted(), "--precision", "float", "--camera", "front"},
        {glasses_, "--samples", "3"},
    };
    for (std::vector<std::string> line : cases) {
        line.insert(line.end(), {"--size", "64x36", "-o"});
        line.insert(line.begin(), "render");
        const auto with = [&](const std::string& name, std::vector<std::string> more = {}) {
            std::vector<std::string> all = line;
            all.push_back(path(name));
            all.insert(all.end(), more.begin(), more.end());
            return all;
        };
        run(with("in.exr"));
        run({"extract", path("in.exr"), "--npz", path("extract.npz")});
        const Json told = resultOf(with("render.npz"));
        EXPECT_EQ(told.at("bytes"), fs::file_size(path("render.npz")));
        EXPECT_EQ(told.at("forecastBytes"), told.at("bytes"));
        // The files are identical up to the last array, `output_hash`, which only `render` writes.
        const auto arrays = readNpz(path("extract.npz")), more = readNpz(path("render.npz"));
        EXPECT_EQ(more.size(), arrays.size() + 1);
        EXPECT_EQ(more.at("output_hash").numbers.size(), 16U);
        const std::size_t same = arrays.at("arrays_version").offset;
        EXPECT_EQ(same, more.at("output_hash").offset);
        EXPECT_TRUE(bytesOf(path("extract.npz")).substr(0, same) ==
                    bytesOf(path("render.npz")).substr(0, same))
            << line[1];
        // With --dense, too, the files are identical up to the hash.
        run(with("render.npz", {"--dense", "2", "--fill", "-1"}));
        run({"extract", path("in.exr"), "--npz", path("extract.npz"), "--dense", "2", "--fill",
             "-1"});
        const std::size_t planes = readNpz(path("extract.npz")).at("arrays_version").offset;
        EXPECT_TRUE(bytesOf(path("extract.npz")).substr(0, planes) ==
                    bytesOf(path("render.npz")).substr(0, planes))
            << line[1];
    }
}

TEST_F(Dense, PlanesHaveTheNumbersOfLists) {
    PEELER_REQUIRE_PYTHON("numpy");
    const std::vector<std::string> scene{"render",     engine_, "--size", "64x36",
                                         "--channels", "all",   "-o"};
    const auto render = [&](const std::string& name, std::vector<std::string> more) {
        std::vector<std::string> line = scene;
        line.push_back(path(name));
        line.insert(line.end(), more.begin(), more.end());
        run(line);
    };
    render("lists.npz", {});
    for (const char* fill : {"nan", "inf", "-1", "last", "1e3"}) {
        render("dense.npz", {"--dense", "3", "--fill", fill});
        python(kPlanesOfLists, {path("dense.npz"), path("lists.npz"), fill, "float"});
    }
    render("dense.npz", {"--as", "dense", "--dense", "2", "--dense-type", "half"});
    python(kPlanesOfLists, {path("dense.npz"), path("lists.npz"), "nan", "half"});
    // Without --dense, the number of planes is the number of layers.
    render("all.npz", {"--as", "dense"});
    const Json told = resultOf({"render", engine_, "--size", "64x36", "-o", path("a.exr")});
    EXPECT_EQ(readNpz(path("all.npz")).at("z").shape,
              "(36, 64, " + std::to_string(told.at("layers").get<int>()) + ")");
    // --layers also limits the counts; with --layer, layers keep their numbers.
    render("three.npz", {"--dense", "3", "--layers", "2"});
    for (const std::uint32_t count : readNpz(path("three.npz")).at("count").as<std::uint32_t>())
        ASSERT_LE(count, 2U);
    run({"extract", path("a.exr"), "--npz", path("some.npz"), "--layer", "1,3", "--dense", "2"});
    for (const std::uint32_t layer : readNpz(path("some.npz")).at("layer").as<std::uint32_t>())
        ASSERT_TRUE(layer == 1 || layer == 3 || layer == 0xFFFFFFFF) << layer;
}

TEST_F(Dense, PlanesOfRaysNeedNoGl) {
    PEELER_REQUIRE_PYTHON("numpy");
    const std::vector<std::vector<std::string>> bundles{
        {"--camera", "main", "--size", "64x36"},
        {"--direction", "1,2,3", "--direction", "-1,-2,-3", "--resolution", "48", "--columns",
         "t_hit,normals,facing,node_ids"}};
    for (const std::vector<std::string>& rays : bundles) {
        const auto trace = [&](const std::string& name, std::vector<std::string> more) {
            std::vector<std::string> line{"rays", engine_, "--engine", "cpu", "-o", path(name)};
            line.insert(line.end(), rays.begin(), rays.end());
            line.insert(line.end(), more.begin(), more.end());
            return resultOf(line);
        };
        const Json lists = trace("lists.npz", {});
        for (const char* fill : {"nan", "last", "-1"}) {
            const Json dense = trace("dense.npz", {"--dense", "3", "--fill", fill});
            EXPECT_EQ(dense.at("hits"), lists.at("hits"));
            EXPECT_EQ(dense.at("bytes"), fs::file_size(path("dense.npz")));
            EXPECT_EQ(dense.at("forecastBytes"), dense.at("bytes"));
            EXPECT_NE(dense.at("settingsHash"), lists.at("settingsHash"));
            python(kPlanesOfLists, {path("dense.npz"), path("lists.npz"), fill, "float"});
        }
    }
    refused({"rays", engine_, "-o", path("a.npz"), "--axes", "--resolution", "16", "--dense", "2"},
            {"bundles of different sizes", "axis_x: ", "axis_y: ", "--dense"});
    EXPECT_FALSE(fs::exists(path("a.npz")));
}

TEST_F(Dense, WhatIsThereIsLeftAlone) {
    const std::vector<std::string> line{"render", glasses_,          "--size",
                                        "32x18",  "--skip-existing", "-o"};
    const auto render = [&](const std::string& name, std::vector<std::string> more) {
        std::vector<std::string> all = line;
        all.push_back(path(name));
        all.insert(all.end(), more.begin(), more.end());
        return resultOf(all);
    };
    const auto isSkipped = [](const Json& result) { return result.value("skipped", false); };
    EXPECT_FALSE(isSkipped(render("a.npz", {})));
    EXPECT_TRUE(isSkipped(render("a.npz", {})));
    EXPECT_FALSE(isSkipped(render("a.npz", {"--channels", "id"})));
    EXPECT_FALSE(isSkipped(render("a.npz", {"--dense", "2"})));
    EXPECT_TRUE(isSkipped(render("a.npz", {"--dense", "2"})));
    EXPECT_FALSE(isSkipped(render("a.npz", {"--dense", "3"})));
    EXPECT_FALSE(isSkipped(render("a.npz", {"--dense", "3", "--fill", "inf"})));
    EXPECT_FALSE(isSkipped(render("a.npz", {"--dense", "3", "--fill", "last"})));
    EXPECT_FALSE(isSkipped(render("a.npz", {"--dense", "3", "--dense-type", "half"})));
    EXPECT_FALSE(isSkipped(render("a.npz", {"--as", "xray"})));
    EXPECT_TRUE(isSkipped(render("a.npz", {"--as", "xray"})));
    const Json plan = Json::parse(run({"render", glasses_, "--size", "32x18", "-o", path("a.npz"),
                                       "--as", "xray", "--dry-run"})
                                      .out);
    EXPECT_EQ(plan.at("pictures").at(0).at("upToDate"), true);
    // A file that is truncated is rendered again.
    fs::resize_file(path("a.npz"), fs::file_size(path("a.npz")) - 1);
    EXPECT_FALSE(isSkipped(render("a.npz", {"--as", "xray"})));

    const Json sample = render("003.png", {"--as", "lari"});
    EXPECT_FALSE(isSkipped(sample));
    EXPECT_EQ(sample.at("bytes"), fs::file_size(path("003.png")) +
                                      fs::file_size(path("003_ldi.npz")) +
                                      fs::file_size(path("003.npy")));
    EXPECT_TRUE(isSkipped(render("003.png", {"--as", "lari"})));
    for (const char* beside : {"003_ldi.npz", "003.npy"}) {
        fs::remove(path(beside));
        EXPECT_FALSE(isSkipped(render("003.png", {"--as", "lari"}))) << beside;
        EXPECT_TRUE(fs::exists(path(beside)));
    }
    EXPECT_FALSE(isSkipped(render("003.png", {})));
    fs::remove(path("003.png"));
    const Outcome clobbers = runPeeler({"render", glasses_, "--size", "32x18", "--as", "lari", "-o",
                                        path("003.png"), "--no-clobber"});
    EXPECT_EQ(clobbers.exit_code, 4);
    EXPECT_TRUE(contains(clobbers.err, "003_ldi.npz")) << clobbers.err;
}

TEST_F(Dense, TilesAreMergedToTheSameArrays) {
    for (const char* tile : {"1/2", "2/2"})
        run({"render", glasses_, "--size", "40x30", "--channels", "id,normal", "--tile", tile, "-o",
             path(std::string("t") + tile[0] + ".exr")});
    for (const std::vector<std::string>& kind :
         std::vector<std::vector<std::string>>{{}, {"--dense", "3", "--fill", "last"}}) {
        std::vector<std::string> merge{"merge", path("t1.exr"), path("t2.exr"), "-o",
                                       path("m.npz")};
        std::vector<std::string> render{"render",     glasses_,    "--size", "40x30",
                                        "--channels", "id,normal", "-o",     path("r.npz")};
        merge.insert(merge.end(), kind.begin(), kind.end());
        render.insert(render.end(), kind.begin(), kind.end());
        run(merge);
        run(render);
        EXPECT_TRUE(bytesOf(path("m.npz")) == bytesOf(path("r.npz")));
    }
}

TEST_F(Dense, TheLoaderOfLariReadsItsSample) {
    PEELER_REQUIRE_PYTHON("PIL");
    const std::vector<std::string> scenes{scenes_ / "coincident.glb", engine_};
    for (const std::string& scene : scenes) {
        const std::vector<std::string> camera{"--size", "96x96", "--faces", "both"};
        std::vector<std::string> line{"render", scene, "--as", "lari", "-o", path("003.png")};
        line.insert(line.end(), camera.begin(), camera.end());
        run(line);
        line = {"render", scene, "--dense", "5", "--channels", "position", "-o", path("d.npz")};
        line.insert(line.end(), camera.begin(), camera.end());
        run(line);
        python(kReadLari, {path("003.png"), path("003_ldi.npz"), path("003.npy"), path("d.npz")});
    }
}

TEST_F(Dense, TheLoaderOfXRayReadsItsMatrix) {
    PEELER_REQUIRE_PYTHON("scipy");
    const std::vector<std::string> picture{"--size", "80x60",       "--faces",
                                           "both",   "--precision", "float"};
    std::vector<std::string> line{"render", glasses_, "--as", "xray", "-o", path("x.npz")};
    line.insert(line.end(), picture.begin(), picture.end());
    const Json told = resultOf(line);
    EXPECT_EQ(told.at("bytes"), told.at("forecastBytes"));
    line = {"render", glasses_,     "--dense",
            "9",      "--channels", "distance,geometric-normal,facing,base-color",
            "-o",     path("d.npz")};
    line.insert(line.end(), picture.begin(), picture.end());
    run(line);
    python(kReadXray, {path("x.npz"), path("d.npz")});
}

TEST_F(Dense, WhatDoesNotGoTogetherIsRefused) {
    const auto render = [&](const std::string& name, std::vector<std::string> more,
                            const std::vector<std::string>& parts) {
        std::vector<std::string> line{"render", glasses_, "-o", path(name)};
        line.insert(line.end(), more.begin(), more.end());
        refused(line, parts);
    };
    for (const char* n : {"0", "-3", "4097", "many"})
        render("a.npz", {"--dense", n}, {"--dense", "from 1 to 4096"});
    render("a.npz", {"--dense", "2", "--fill", "zero"}, {"--fill", "nan, inf, last or a number"});
    render("a.npz", {"--dense", "2", "--dense-type", "double"}, {"--dense-type", "float, half"});
    render("a.npz", {"--fill", "-1"}, {"there are no planes", "--fill", "add --dense N"});
    render("a.npz", {"--dense-type", "half"}, {"there are no planes", "--dense-type"});
    render("a.npz", {"--as", "arrays", "--dense", "2"}, {"--dense"});
    render("a.exr", {"--dense", "2"}, {".exr cannot hold --as dense"});
    render("a.png", {"--as", "lari", "--dense", "2"}, {"--dense"});
    render("a.png", {"--as", "xray"}, {".png cannot hold --as xray"});
    render("a.npz", {"--as", "lari"}, {".npz cannot hold --as lari"});
    render("a.png", {"--as", "lari", "--samples", "4"}, {"one ray", "--samples"});
    render("a.npz", {"--as", "xray", "--samples", "4"}, {"one ray", "--samples"});
    render("a.npz", {"--as", "xray", "--channels", "id"}, {"fixed set of channels"});
    render("a.png", {"--as", "lari", "--background", "1,1,1"},
           {"black background", "--background"});
    render("a.png", {"--as", "lari", "--fxaa"}, {"--fxaa"});
    render("a.npz", {"--background", "1,1,1"}, {"--background"});
    render("a.npz", {"--exposure", "1"}, {"--exposure"});
    render("a.npz", {"--no-composite"}, {"--no-composite"});
    refused({"render", glasses_, "-o", "-.png", "--as", "lari"}, {"several files"});
    refused({"rays", glasses_, "-o", path("a.ply"), "--axes", "--dense", "2"}, {"--dense", ".npz"});
    refused({"rays", glasses_, "-o", path("a.npz"), "--voxels", "8", "--dense", "2"}, {"--dense"});
    refused({"rays", glasses_, "-o", path("a.npz"), "--axes", "--fill", "0"}, {"--fill"});
    run({"render", glasses_, "--size", "16x9", "-o", path("in.exr")});
    refused({"extract", path("in.exr"), "--points", path("a.ply"), "--dense", "2"}, {"--dense"});
    refused({"extract", path("in.exr"), "--npz", path("a.npz"), "--fill", "0"}, {"--fill"});
    refused({"extract", path("in.exr"), "-o", path("a.##.ply")}, {".ply"});
    refused({"extract", path("in.exr"), "--depth-complexity", path("a.npz")}, {"--dense"});
    refused({"convert", path("in.exr"), "-o", path("a.npz")}, {"peeler extract --npz"});
    refused({"flatten", path("in.exr"), "-o", path("a.ply")}, {".ply"});
    refused({"view", path("in.exr"), "-o", path("a.ply")}, {".ply"});
    EXPECT_EQ(scratch_.files(), std::vector<std::string>{"in.exr"});
}

}  // namespace
}  // namespace peeler::test
