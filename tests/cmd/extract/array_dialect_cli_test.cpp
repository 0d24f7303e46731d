// SPDX-License-Identifier: Apache-2.0
// Tests that arrays of the same name have the same meaning in extract and rays: the arrays for a
// camera's pixels agree. The example reader reads the files of both verbs and of earlier versions.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "cmd/tiny_gltf.h"
#include "support/python.h"
#include "support/test_support.h"

namespace peeler::test {
namespace {

namespace fs = std::filesystem;

constexpr const char* kCompare = R"(
import sys, numpy as np
e, r = (np.load(path, allow_pickle=False) for path in sys.argv[1:3])
same = sorted(set(e.files) & set(r.files))
assert same == sorted(set(r.files) - {'geometry_ids', 'mesh_ids'}), (same, r.files)
assert e['arrays_version'] == r['arrays_version'] == 2
for name in same:
    a, b = e[name], r[name]
    assert a.dtype == b.dtype and a.shape == b.shape, (name, a.dtype, b.dtype, a.shape, b.shape)
    assert (a == b).all(), (name, np.abs(a.astype(float) - b).max())
assert (e['facing'] == -1).any() and (e['facing'] == 1).any()
assert (e['material_ids'] != 0xFFFFFFFF).all() and e['node_ids'].min() >= 0
assert sorted(set(e.files) - set(r.files)) == ['far', 'layer', 'near', 'positions', 'rgba', 'z'], e.files
)";

constexpr const char* kCompareReaders = R"(
import importlib.util, sys, numpy as np
spec = importlib.util.spec_from_file_location('reader', sys.argv[1])
reader = importlib.util.module_from_spec(spec)
spec.loader.exec_module(reader)
e, r, many = (dict(np.load(path, allow_pickle=False)) for path in sys.argv[2:5])
points = reader.unproject(e)
assert np.abs(points - e['positions']).max() < 1e-4
assert np.abs(reader.unproject(r) - points).max() < 1e-4
# As extract wrote it before arrays_version 2.
right, up, direction, origin = (e['bundle_' + n][0] for n in ('right', 'up', 'direction', 'origin'))
camera = np.eye(4)
camera[:3, 0], camera[:3, 1], camera[:3, 2], camera[:3, 3] = right, up, -direction, origin
old = {'ray_splits': e['ray_splits'], 'z': e['z'], 'rgba': e['rgba'], 'layer': e['layer'],
       'window': e['bundle_window'][0], 'size': e['bundle_resolution'][0],
       'perspective': e['bundle_perspective'][0], 'camera_to_world': camera,
       'half_width': e['bundle_size'][0, 0] / 2, 'half_height': e['bundle_size'][0, 1] / 2}
assert np.abs(reader.unproject(old) - points).max() < 1e-12
# Several bundles, as rays wrote them before: numbers of pixels were floats.
now = reader.unproject(many)
for name in ('bundle_resolution', 'bundle_window'):
    assert many[name].dtype == np.int64
    many[name] = many[name].astype(float)
assert np.abs(reader.unproject(many) - now).max() < 1e-12 and len(now) > 1000
table = sys.argv[5]
body = open(table, 'rb').read()
count = int(body.split(b'element vertex ')[1].split()[0])
size = (len(body) - body.index(b'end_header\n') - 11) // count
xyz = np.frombuffer(body[-count * size:], dtype=np.uint8).reshape(count, size)[:, :24].copy().view('<f8')
assert np.abs(xyz - now).max() < 1e-5, np.abs(xyz - now).max()
)";

class ArrayDialect : public testing::Test {
  protected:
    std::string path(const std::string& name) const { return (scratch_ / name).string(); }
    static void run(std::vector<std::string> line) {
        line.emplace_back("--quiet");
        const Outcome result = runPeeler(line);
        ASSERT_EQ(result.exit_code, 0) << result.err;
    }
    /// Writes the pixels of a scene's camera with both verbs and their defaults, on the same
    /// device.
    void make(const std::string& scene, const std::string& camera) const {
        run({"render", scene, "-o", path("in.exr"), "--camera", camera, "--size", "96x54",
             "--precision", "float", "--channels",
             "normal,geometric-normal,facing,position,id,barycentric,distance"});
        run({"extract", path("in.exr"), "--npz", path("extract.npz")});
        // Without refinement, rays have the rasteriser's depths, like pictures.
        run({"rays", scene, "-o", path("rays.npz"), "--camera", camera, "--size", "96x54",
             "--no-refine", "--engine", "gl"});
    }

    ScratchDir scratch_;
    std::string scene_ = sourceDir() / "examples" / "scenes" / "glasses.glb";
};

TEST_F(ArrayDialect, BothVerbsSayTheSame) {
    PEELER_REQUIRE_PYTHON("numpy");
    make(scene_, "main");
    const Outcome same = runPython(kCompare, {path("extract.npz"), path("rays.npz")});
    EXPECT_EQ(same.exit_code, 0) << same.err;
}

TEST_F(ArrayDialect, TheDefaultMaterialIsNone) {
    PEELER_REQUIRE_PYTHON("numpy");
    Json scene = stackScene(3);
    Json& primitives = scene["meshes"][0]["primitives"];
    // The default material is one-sided, and the camera sees the front.
    primitives[0].erase("material");
    const std::string file = writeScene(scratch_.path(), scene);
    make(file, "front");
    const Outcome none = runPython(R"(
import sys, numpy as np
for path in sys.argv[1:]:
    a = np.load(path, allow_pickle=False)
    assert (a['material_ids'] == 0xFFFFFFFF).all() and len(a['material_ids']) == 3 * 96 * 54, path
    assert (a['node_ids'].reshape(-1, 3) == (0, 1, 2)).all() and (a['primitive_ids'] == 0).all()
)",
                                   {path("extract.npz"), path("rays.npz")});
    EXPECT_EQ(none.exit_code, 0) << none.err;
}

TEST_F(ArrayDialect, OurReaderTakesBothAndThoseOfBefore) {
    PEELER_REQUIRE_PYTHON("numpy");
    make(scene_, "main");
    for (const char* name : {"many.npz", "many.ply"}) {
        std::vector<std::string> line{"rays",         scene_, "-o",           path(name), "--axes",
                                      "--directions", "2",    "--resolution", "40"};
        if (std::string(name) == "many.ply") line.emplace_back("--double");
        run(line);
    }
    const std::string reader = sourceDir() / "examples" / "readers" / "layers_with_numpy.py";
    const Outcome read = runPython(kCompareReaders, {reader, path("extract.npz"), path("rays.npz"),
                                                     path("many.npz"), path("many.ply")});
    EXPECT_EQ(read.exit_code, 0) << read.err;
    const Outcome told = runCommand({python(), reader, path("many.npz")});
    EXPECT_EQ(told.exit_code, 0) << told.err;
    EXPECT_EQ(told.out.find("points: "), 0U) << told.out;
    // A file may lack arrays that the reader does not need.
    run({"rays", scene_, "-o", path("some.npz"), "--axes", "--resolution", "8", "--columns",
         "t_hit"});
    EXPECT_EQ(runCommand({python(), reader, path("some.npz")}).exit_code, 0);
    run({"rays", scene_, "-o", path("ids.npz"), "--axes", "--resolution", "8", "--columns",
         "node_ids"});
    const Outcome lacking = runCommand({python(), reader, path("ids.npz")});
    EXPECT_EQ(lacking.exit_code, 1);
    EXPECT_NE(lacking.err.find("no array t_hit"), std::string::npos) << lacking.err;
    // rays --points accepts the positions that extract wrote.
    run({"rays", scene_, "-o", path("next.npz"), "--points", path("extract.npz"), "--directions",
         "1", "--resolution", "32"});
}

TEST_F(ArrayDialect, FacesAreThoseOfPicturesForTheRaysOfACamera) {
    const auto hits = [&](const std::vector<std::string>& more) {
        std::vector<std::string> line{"rays", scene_, "--json", "-q", "-o", path("a.npz")};
        line.insert(line.end(), more.begin(), more.end());
        const Outcome result = runPeeler(line);
        EXPECT_EQ(result.exit_code, 0) << result.err;
        return Json::parse(result.out).at("hits").get<std::uint64_t>();
    };
    const std::vector<std::string> camera{"--camera", "main", "--size", "64x36"};
    const std::vector<std::string> direction{"--direction", "1,2,3", "--resolution", "64"};
    const auto with = [](std::vector<std::string> line, const std::string& faces) {
        line.insert(line.end(), {"--faces", faces});
        return line;
    };
    EXPECT_EQ(hits(camera), hits(with(camera, "gltf")));
    EXPECT_LT(hits(camera), hits(with(camera, "both")));
    EXPECT_EQ(hits(direction), hits(with(direction, "both")));
    EXPECT_LT(hits(with(direction, "gltf")), hits(direction));
    // Thickness needs both faces of one-sided surfaces, even for camera rays.
    const Outcome inside = runPeeler({"rays", scene_, "--camera", "main", "--size", "16x9", "--map",
                                      "thickness", "-o", path("t.exr"), "-q"});
    EXPECT_EQ(inside.exit_code, 0) << inside.err;
}

}  // namespace
}  // namespace peeler::test
