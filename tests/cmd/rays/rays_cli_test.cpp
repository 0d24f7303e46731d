// SPDX-License-Identifier: Apache-2.0
// Tests peeler rays: the files of hits, which other programs read, and errors.
#include <OpenEXR/ImfChannelList.h>
#include <OpenEXR/ImfDeepFrameBuffer.h>
#include <OpenEXR/ImfDeepScanLineInputPart.h>
#include <OpenEXR/ImfHeader.h>
#include <OpenEXR/ImfMultiPartInputFile.h>
#include <OpenEXR/ImfPartType.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <sstream>

#include "cmd/tiny_gltf.h"
#include "support/closed_meshes.h"
#include "support/python.h"
#include "support/test_support.h"

namespace peeler::test {
namespace {

namespace fs = std::filesystem;

/// Instantiated for each engine (--engine).
class RaysCli : public testing::TestWithParam<const char*> {
  protected:
    void SetUp() override { scene_ = writeScene(scratch_ / "."); }
    Outcome rays(std::vector<std::string> arguments) const {
        arguments.insert(arguments.begin(),
                         {"rays", scene_.string(), "--quiet", "--engine", GetParam()});
        return runPeeler(arguments);
    }
    /// Expects an error with this exit code and these words, and no output.
    void expectRefused(const std::vector<std::string>& arguments, int exit_code,
                       const std::string& words) const {
        std::vector<std::string> all = arguments;
        all.insert(all.end(), {"-o", out()});
        const Outcome run = rays(all);
        EXPECT_EQ(run.exit_code, exit_code) << run.err;
        EXPECT_NE(run.err.find(words), std::string::npos) << run.err;
        EXPECT_FALSE(fs::exists(out()));
    }
    std::string out(const std::string& name = "out.npz") const { return scratch_ / name; }

    const ScratchDir scratch_;
    fs::path scene_;
};
INSTANTIATE_TEST_SUITE_P(By, RaysCli, testing::Values("cpu", "gl"),
                         [](const auto& row) { return std::string(row.param); });

// Checks the arrays of hits on the triangle (−1,−1,0), (1,−1,0), (0,1,0), which faces +Z.
constexpr const char* kCheckArrays = R"(
import sys, numpy as np
a = np.load(sys.argv[1], allow_pickle=False)
n = int(a['ray_splits'][-1])
shapes = {'t_hit': ('float32', (n,)), 'geometry_ids': ('uint32', (n,)),
          'primitive_ids': ('uint32', (n,)), 'primitive_uvs': ('float32', (n, 2)),
          'facing': ('int32', (n,)), 'normals': ('float32', (n, 3)),
          'primitive_normals': ('float32', (n, 3)), 'node_ids': ('uint32', (n,)),
          'mesh_ids': ('uint32', (n,)), 'instance_ids': ('uint32', (n,)),
          'material_ids': ('uint32', (n,)), 'bundle_origin': ('float64', (2, 3)),
          'bundle_direction': ('float64', (2, 3)), 'bundle_right': ('float64', (2, 3)),
          'bundle_up': ('float64', (2, 3)), 'bundle_size': ('float64', (2, 2)),
          'bundle_resolution': ('int64', (2, 2)), 'bundle_window': ('int64', (2, 4)),
          'bundle_perspective': ('uint8', (2,)), 'arrays_version': ('int64', ())}
assert set(a.files) == set(shapes) | {'ray_splits'}, a.files
for name, (dtype, shape) in shapes.items():
    assert a[name].dtype == dtype and a[name].shape == shape, (name, a[name].dtype, a[name].shape)
rays = a['bundle_resolution'].prod(axis=1).astype(int)
window = a['bundle_window']
assert (window[:, :2] == 0).all() and (window[:, 2:] == a['bundle_resolution']).all()
assert a['ray_splits'].dtype == 'int64' and len(a['ray_splits']) == rays.sum() + 1
ray = np.repeat(np.arange(rays.sum()), np.diff(a['ray_splits']))
bundle = (ray >= rays[0]).astype(int)
pixel = ray - bundle * rays[0]
w, h = a['bundle_resolution'][bundle].T
i, j = pixel % w, pixel // w
b = lambda name: a['bundle_' + name][bundle]
start = (b('origin') + (((i + 0.5) / w - 0.5) * b('size')[:, 0])[:, None] * b('right')
         - (((j + 0.5) / h - 0.5) * b('size')[:, 1])[:, None] * b('up'))
at = start + a['t_hit'][:, None] * b('direction')
assert np.abs(at[:, 2]).max() < 1e-6
u, v = a['primitive_uvs'].T.astype(float)
corners = np.array([(-1, -1, 0), (1, -1, 0), (0, 1, 0)], float)
weighted = (1 - u - v)[:, None] * corners[0] + u[:, None] * corners[1] + v[:, None] * corners[2]
error = np.abs(weighted - at).max(axis=1)
assert np.percentile(error, 90) < 1e-6 and error.max() < 2e-3, error.max()  # snapped corners
assert (a['facing'] == np.where(bundle == 0, 1, -1)).all()
assert np.abs(a['normals'] - (0, 0, 1)).max() < 1e-5  # from a shader
assert np.abs(a['primitive_normals'] - (0, 0, 1)).max() < 1e-6
for name in ('geometry_ids', 'primitive_ids', 'node_ids', 'mesh_ids', 'instance_ids', 'material_ids'):
    assert (a[name] == 0).all(), name
area = [(bundle == k).sum() * a['bundle_size'][k].prod() / rays[k] for k in (0, 1)]
assert np.abs(np.array(area) - 2 * np.array((1, 0.8))).max() < 0.01, area  # seen from the side
print(n)
)";

TEST_P(RaysCli, NumpyReadsArraysWithTheNamesOfOpen3D) {
    PEELER_REQUIRE_PYTHON("numpy");
    const Outcome run = rays({"--direction", "0,0,-1", "--direction", "3,0,4", "--resolution",
                              "200", "-o", out(), "--json"});
    ASSERT_EQ(run.exit_code, 0) << run.err;
    const Json json = Json::parse(run.out);
    EXPECT_EQ(json.at("bundles"), 2);
    EXPECT_LT(json.at("largestCorrection").get<double>(), 1e-3);
    const Outcome read = runPython(kCheckArrays, {out()});
    ASSERT_EQ(read.exit_code, 0) << read.err;
    EXPECT_EQ(std::stoull(read.out), json.at("hits").get<std::uint64_t>());
}

// Checks that each file has only the requested columns, equal to those in the file with all
// columns.
constexpr const char* kCompareColumns = R"(
import sys, zipfile, numpy as np
whole = np.load(sys.argv[1], allow_pickle=False)
assert len(whole['t_hit']) > 40000
always = {'ray_splits', 'arrays_version', *(n for n in whole.files if n.startswith('bundle_'))}
for path, names in zip(sys.argv[2::2], sys.argv[3::2]):
    assert zipfile.ZipFile(path).testzip() is None
    some = np.load(path, allow_pickle=False)
    assert some.files == [n for n in whole.files if n in always or n in names.split(',')], some.files
    for name in some.files:
        assert some[name].dtype == whole[name].dtype and (some[name] == whole[name]).all(), name
)";

TEST_P(RaysCli, ChosenColumnsAreThoseOfTheWholeFile) {
    PEELER_REQUIRE_PYTHON("numpy");
    const std::vector<std::string> bundles = {"--direction", "0,0,1",        "--direction",
                                              "1,2,3",       "--resolution", "300"};
    std::vector<std::string> files = {out("whole.npz")};
    const auto write = [&](const std::string& name, const std::string& columns) {
        std::vector<std::string> line = bundles;
        line.insert(line.end(), {"-o", out(name)});
        if (!columns.empty()) line.insert(line.end(), {"--columns", columns});
        const Outcome run = rays(line);
        EXPECT_EQ(run.exit_code, 0) << columns << run.err;
    };
    write("whole.npz", "");
    for (const std::string columns :
         {"t_hit", "geometry_ids", "primitive_ids", "primitive_uvs", "facing", "normals",
          "primitive_normals", "node_ids", "mesh_ids", "instance_ids", "material_ids",
          "normals,t_hit", "mesh_ids,primitive_uvs,mesh_ids"}) {
        write(columns + ".npz", columns);
        files.insert(files.end(), {out(columns + ".npz"), columns});
    }
    const Outcome read = runPython(kCompareColumns, files);
    EXPECT_EQ(read.exit_code, 0) << read.err;
    // Naming all columns gives the same file as "all".
    write("all.npz", "all");
    write("named.npz",
          "material_ids,t_hit,geometry_ids,primitive_ids,primitive_uvs,facing,normals,"
          "primitive_normals,node_ids,mesh_ids,instance_ids");
    EXPECT_TRUE(bytesOf(out("all.npz")) == bytesOf(out("whole.npz")));
    EXPECT_TRUE(bytesOf(out("named.npz")) == bytesOf(out("whole.npz")));
}

TEST_P(RaysCli, ChosenColumnsAreThoseOfPoints) {
    const std::vector<std::string> line = {"--axes",     "--resolution", "20",          "-o",
                                           out("a.ply"), "--columns",    "facing,t_hit"};
    ASSERT_EQ(rays(line).exit_code, 0);
    const std::string file = bytesOf(out("a.ply"));
    EXPECT_NE(file.find("property float x\nproperty float y\nproperty float z\nproperty float t\n"
                        "property int facing\nproperty uint bundle\nend_header\n"),
              std::string::npos);
}

TEST_P(RaysCli, RefusesColumnsThatThereAreNot) {
    expectRefused({"--axes", "--columns", "t_hits"}, 2, "did you mean 't_hit'?");
    expectRefused(
        {"--axes", "--columns", "colour"}, 2,
        "the columns are: t_hit, z_hit, geometry_ids, primitive_ids, primitive_uvs, facing, "
        "normals, primitive_normals, node_ids, mesh_ids, instance_ids, material_ids, base_color");
    expectRefused({"--axes", "--columns", ""}, 2, "--columns");
    expectRefused({"--voxels", "8", "--columns", "t_hit"}, 2, "--columns");
    EXPECT_EQ(
        rays({"--axes", "--map", "first", "--columns", "t_hit", "-o", out("a.exr")}).exit_code, 2);
    EXPECT_EQ(rays({"--axes", "--parity", "report", "--columns", "t_hit"}).exit_code, 2);
    const Outcome deep = rays({"--axes", "--columns", "t_hit", "-o", out("a.exr")});
    EXPECT_EQ(deep.exit_code, 2);
    EXPECT_NE(deep.err.find("a deep image always has all channels"), std::string::npos) << deep.err;
    EXPECT_FALSE(fs::exists(out("a.exr")));
}

TEST_P(RaysCli, MeshioReadsThePointsOfTheArrays) {
    PEELER_REQUIRE_PYTHON("meshio");
    const std::vector<std::string> bundles = {"--directions", "5", "--resolution", "64", "-o"};
    for (const std::string name : {"a.npz", "a.ply", "double.ply"}) {
        std::vector<std::string> arguments = bundles;
        arguments.push_back(out(name));
        if (name == "double.ply") arguments.emplace_back("--double");
        ASSERT_EQ(rays(arguments).exit_code, 0);
    }
    const Outcome read = runPython(R"(
import sys, numpy as np, meshio
a = np.load(sys.argv[1], allow_pickle=False)
for path, dtype in ((sys.argv[2], 'float32'), (sys.argv[3], 'float64')):
    p = meshio.read(path)
    d = p.point_data
    assert p.points.dtype == dtype and len(p.points) == len(a['t_hit']) > 1000
    assert (d['t'] == a['t_hit']).all() and (d['u'] == a['primitive_uvs'][:, 0]).all()
    assert (d['facing'] == a['facing']).all() and (d['nz'] == a['normals'][:, 2]).all()
    assert np.abs(p.points[:, 2]).max() < 1e-6
    rays = a['bundle_resolution'].prod(axis=1).astype(int)
    ray = np.repeat(np.arange(rays.sum()), np.diff(a['ray_splits']))
    assert (d['bundle'] == np.searchsorted(np.cumsum(rays), ray, side='right')).all()
)",
                                   {out("a.npz"), out("a.ply"), out("double.ply")});
    EXPECT_EQ(read.exit_code, 0) << read.err;
}

// The camera at (0, 0, 2) looks at the triangle, which lies in the plane z = 0.
constexpr const char* kCheckCamera = R"(
import sys, numpy as np
a = np.load(sys.argv[1], allow_pickle=False)
x, y, width, height = a['bundle_window'][0]
assert (x, y, width, height) == (10, 20, 30, 40) and len(a['ray_splits']) == 30 * 40 + 1
assert a['bundle_perspective'][0] == 1 and np.abs(a['bundle_origin'][0] - (0, 0, 2)).max() < 1e-12
ray = np.repeat(np.arange(1200), np.diff(a['ray_splits']))
i, j = x + ray % width, y + ray // width
(w, h), (sx, sy) = a['bundle_resolution'][0], a['bundle_size'][0]
toward = (a['bundle_direction'][0] + ((i + 0.5) / w - 0.5)[:, None] * sx * a['bundle_right'][0]
          - ((j + 0.5) / h - 0.5)[:, None] * sy * a['bundle_up'][0])
toward /= np.linalg.norm(toward, axis=1)[:, None]
at = a['bundle_origin'][0] + a['t_hit'][:, None] * toward
assert len(ray) > 300 and np.abs(at[:, 2]).max() < 1e-6, (len(ray), np.abs(at[:, 2]).max())
)";

TEST_P(RaysCli, RaysOfACamerasCropAreWhereTheHelpSaysTheyAre) {
    PEELER_REQUIRE_PYTHON("numpy");
    const std::vector<std::string> camera = {"--eye", "0,0,2",  "--target",
                                             "0,0,0", "--size", "80x70"};
    std::vector<std::string> crop = camera, near = camera;
    crop.insert(crop.end(), {"--crop", "10,20,30,40", "-o", out()});
    const Outcome run = rays(crop);
    ASSERT_EQ(run.exit_code, 0) << run.err;
    const Outcome read = runPython(kCheckCamera, {out()});
    EXPECT_EQ(read.exit_code, 0) << read.err;
    // The triangle is in front of the near plane, so it is not hit.
    near.insert(near.end(), {"--near", "2.5", "-o", out("near.npz"), "--json"});
    EXPECT_EQ(Json::parse(rays(near).out).at("hits"), 0);
}

TEST_P(RaysCli, OpenExrReadsADeepPartABundle) {
    ASSERT_EQ(rays({"--axes", "--direction", "0,0,-1", "--resolution", "50", "-o", out("a.exr")})
                  .exit_code,
              0);
    EXPECT_EQ(runPeeler({"verify", out("a.exr")}).exit_code, 0);
    const Outcome flat = runPeeler({"flatten", out("a.exr"), "-o", out("a.png")});
    EXPECT_EQ(flat.exit_code, 3);
    EXPECT_NE(flat.err.find("4 bundles"), std::string::npos) << flat.err;
    Imf::MultiPartInputFile file(out("a.exr").c_str());
    ASSERT_EQ(file.parts(), 4);
    EXPECT_EQ(file.header(0).name(), "bundle_000");
    EXPECT_EQ(file.header(3).name(), "axis_z");
    for (const int part : {0, 3}) {
        ASSERT_EQ(file.header(part).type(), Imf::DEEPSCANLINE);
        EXPECT_TRUE(file.header(part).channels().findChannel("id.primitive"));
        Imf::DeepScanLineInputPart input(file, part);
        const Imath::Box2i window = file.header(part).dataWindow();
        const int width = window.max.x - window.min.x + 1, height = window.max.y - window.min.y + 1;
        EXPECT_EQ(std::max(width, height), 50);
        const auto pixels = static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
        std::vector<unsigned> counts(pixels);
        std::vector<float*> z(pixels), distance(pixels);
        const auto base = [&](auto& values) {
            return reinterpret_cast<char*>(values.data() - window.min.x - window.min.y * width);
        };
        const auto stride = static_cast<std::size_t>(width);
        Imf::DeepFrameBuffer buffer;
        buffer.insertSampleCountSlice(
            Imf::Slice(Imf::UINT, base(counts), sizeof(unsigned), stride * sizeof(unsigned)));
        buffer.insert("Z", Imf::DeepSlice(Imf::FLOAT, base(z), sizeof(float*),
                                          stride * sizeof(float*), sizeof(float)));
        buffer.insert("distance", Imf::DeepSlice(Imf::FLOAT, base(distance), sizeof(float*),
                                                 stride * sizeof(float*), sizeof(float)));
        input.setFrameBuffer(buffer);
        input.readPixelSampleCounts(window.min.y, window.max.y);
        std::vector<float> depths(pixels), distances(pixels);
        std::size_t hits = 0;
        for (std::size_t p = 0; p < pixels; ++p) {
            ASSERT_LE(counts[p], 1U);
            hits += counts[p];
            z[p] = &depths[p];
            distance[p] = &distances[p];
        }
        // The triangle is half of the square that the bundle covers.
        EXPECT_NEAR(static_cast<double>(hits), 1250, 50);
        input.readPixels(window.min.y, window.max.y);
        for (std::size_t p = 0; p < pixels; ++p) {
            if (counts[p] == 0) continue;
            EXPECT_GT(depths[p], 0);
            EXPECT_EQ(depths[p], distances[p]);
        }
    }
}

TEST_P(RaysCli, RefusesRaysThatCannotBe) {
    expectRefused({"--direction", "0,0,0"}, 2, "--direction 0,0,0");
    expectRefused({"--direction", "0,0,nan"}, 2, "--direction");
    expectRefused({"--axes", "--bounds", "0,0,nan,1,1,1"}, 2, "--bounds");
    expectRefused({"--axes", "--bounds", "0,0,0,0,0,1"}, 2, "box");
    expectRefused({}, 2, "no rays are given");
    expectRefused({"--hemisphere", "--axes"}, 2, "--hemisphere");
    expectRefused({"--axes", "--resolution", "5", "--spacing", "1"}, 2, "--spacing");
    expectRefused({"--axes", "--camera", "0"}, 2, "--camera");
    expectRefused({"--views", "2", "--cameras-out", "cameras.json"}, 2, "--cameras-out");
    expectRefused({"--axes", "--spacing", "1e-9"}, 2, "2^30");
    expectRefused({"--axes", "--size", "8"}, 2, "--size");
    expectRefused({"--voxels", "8", "--faces", "front"}, 2, "--faces");
    expectRefused({"--voxels", "8", "--axes"}, 2, "--voxels");
    expectRefused({"--directions-file", scratch_ / "none.txt"}, 3, "none.txt");
    writeText(scratch_ / "bad.txt", "0 0 1\n# a comment\n0, 1\n");
    expectRefused({"--directions-file", scratch_ / "bad.txt"}, 3, "bad.txt:3");
    EXPECT_NE(rays({"--axes", "-o", out("a.csv")}).err.find(".npz, .safetensors, .ply or .exr"),
              std::string::npos);
}

TEST_P(RaysCli, RefusesMapsThatCannotBe) {
    expectRefused({"--axes", "--map", "thicknes"}, 2, "thickness");
    expectRefused({"--axes", "--map", "overlap"}, 2, "--part");
    const Outcome run =
        rays({"--axes", "--map", "path-length", "--attenuation", "lead=3", "-o", out("a.exr")});
    EXPECT_EQ(run.exit_code, 2);
    EXPECT_NE(run.err.find("--attenuation lead"), std::string::npos) << run.err;
    EXPECT_FALSE(fs::exists(out("a.exr")));
}

/// Returns an ASCII PLY of meshes, one after the other.
std::string plyOf(const std::vector<Primitive>& meshes) {
    std::ostringstream points, faces;
    std::size_t vertices = 0, triangles = 0;
    for (const Primitive& mesh : meshes) {
        for (const glm::vec3& p : mesh.positions)
            points << p.x << ' ' << p.y << ' ' << p.z << '\n';
        for (std::size_t i = 0; i < mesh.indices.size(); i += 3, ++triangles)
            faces << "3 " << vertices + mesh.indices[i] << ' ' << vertices + mesh.indices[i + 1]
                  << ' ' << vertices + mesh.indices[i + 2] << '\n';
        vertices += mesh.positions.size();
    }
    return "ply\nformat ascii 1.0\nelement vertex " + std::to_string(vertices) +
           "\nproperty float x\nproperty float y\nproperty float z\nelement face " +
           std::to_string(triangles) + "\nproperty list uchar int vertex_indices\nend_header\n" +
           points.str() + faces.str();
}

Primitive boxOf(const glm::vec3& min, const glm::vec3& max) {
    Primitive box = cube();
    for (glm::vec3& p : box.positions)
        p = min + (p + 1.0F) / 2.0F * (max - min);
    return box;
}

TEST_P(RaysCli, WithoutAttenuationTheMedianPathIsHalfTransparent) {
    // Blocks with heights of 10 and 30 along z. Most rays along z pass through the lower block.
    const std::string file = (scratch_ / "blocks.ply").string();
    writeText(file, plyOf({boxOf({0, 0, 0}, {8, 8, 10}), boxOf({9, 0, 0}, {12, 8, 30})}));
    const auto run = [&](const std::vector<std::string>& more) {
        std::vector<std::string> all{"rays",        file,          "--engine",     GetParam(),
                                     "--direction", "0,0,1",       "--resolution", "64",
                                     "--map",       "transmission"};
        all.insert(all.end(), more.begin(), more.end());
        return runPeeler(all);
    };
    const Outcome found = run({"-o", out("t.npz"), "--report", out("t.json")});
    ASSERT_EQ(found.exit_code, 0) << found.err;
    EXPECT_NE(found.err.find("attenuation: 0.06931 per scene unit"), std::string::npos)
        << found.err;
    const auto report = nlohmann::json::parse(bytesOf(out("t.json")));
    EXPECT_NEAR(report.at("medianPath").get<double>(), 10, 1e-5);
    EXPECT_NEAR(report.at("attenuation").get<double>(), std::log(2) / 10, 1e-8);
    EXPECT_NEAR(report.at("maps")[0].at("channels")[0].at("least").get<double>(), 0.125, 1e-6);
    // The message about the assumed unit appears only once.
    const std::string unit = "has no unit, so 1 counts as 1 m; for millimetres, add --unit mm";
    EXPECT_NE(found.err.find(unit), std::string::npos) << found.err;
    EXPECT_EQ(found.err.find(unit), found.err.rfind(unit));
    // The same attenuation gives the same file.
    const Outcome given =
        run({"-o", out("g.npz"), "--unit", "mm", "--attenuation",
             "*=" + std::to_string(1000 * std::log(2) / 10), "--report", out("g.json")});
    ASSERT_EQ(given.exit_code, 0) << given.err;
    EXPECT_EQ(given.err.find(unit), std::string::npos) << given.err;
    const auto again = nlohmann::json::parse(bytesOf(out("g.json")));
    EXPECT_FALSE(again.contains("attenuation"));
    EXPECT_NEAR(again.at("maps")[0].at("channels")[0].at("least").get<double>(), 0.125, 1e-5);
    // A triangle has no interior.
    const Outcome none = rays({"--axes", "--map", "transmission", "-o", out("none.exr")});
    EXPECT_EQ(none.exit_code, 0);
    EXPECT_NE(none.err.find("no ray passes through a solid"), std::string::npos) << none.err;
}

Primitive insideOut(Primitive mesh) {
    for (std::size_t i = 0; i < mesh.indices.size(); i += 3)
        std::swap(mesh.indices[i], mesh.indices[i + 1]);
    return mesh;
}

/// Boxes of one mesh, and the volume inside by winding number and by parity.
struct ShellCase {
    const char* name;
    std::vector<Primitive> shells;
    double winding, parity;
    const char* undecided = nullptr;  ///< the reported reason; null if winding numbers decide
};

TEST_P(RaysCli, ShellsThatOverlapAreOneBody) {
    const Primitive box = boxOf({0, 0, 0}, {10, 10, 10}), inner = boxOf({2, 2, 2}, {8, 8, 8});
    const Primitive other = boxOf({5, 5, 5}, {15, 15, 15});
    Primitive flipped = box;
    std::swap(flipped.indices[3], flipped.indices[4]);
    const ShellCase cases[] = {
        {"overlap", {box, other}, 1875, 1750},
        {"nested", {box, inner}, 1000, 784},
        {"cavity", {box, insideOut(inner)}, 784, 784},
        {"twice", {box, box}, 1000, 0},
        {"inside out", {insideOut(box)}, 1000, 1000, "inside out"},
        {"flipped", {flipped}, 1000, 1000, "faces both ways"},
    };
    for (const ShellCase& one : cases) {
        const std::string file = (scratch_ / "shells.ply").string();
        writeText(file, plyOf(one.shells));
        const auto run = [&](const std::vector<std::string>& more) {
            std::vector<std::string> all{"rays", file, "--quiet", "--json", "--engine", GetParam()};
            all.insert(all.end(), more.begin(), more.end());
            const Outcome outcome = runPeeler(all);
            EXPECT_EQ(outcome.exit_code, 0) << one.name << outcome.err;
            return nlohmann::json::parse(outcome.out);
        };
        for (const bool winding : {true, false}) {
            const double volume = winding ? one.winding : one.parity;
            const std::vector<std::string> maps{"--direction", "1,0,0", "--spacing", "0.5", "--map",
                                                "thickness",   "-o",    out("t.npz")},
                voxels{"--voxels", one.shells.size() > 1 && volume > 1000 ? "15" : "10", "-o",
                       out("v.npz")};
            for (std::vector<std::string> arguments : {maps, voxels}) {
                if (!winding) arguments.insert(arguments.end(), {"--overlap", "parity"});
                const auto result = run(arguments);
                const auto& found =
                    result.contains("voxels") ? result["voxels"] : result["maps"][0]["channels"][0];
                EXPECT_NEAR(found.at("volume").get<double>(), volume, 0.05) << one.name << winding;
                EXPECT_EQ(result.contains("undecided"), winding && one.undecided) << one.name;
                if (winding && one.undecided) {
                    EXPECT_EQ(result["undecided"][0]["reason"], one.undecided);
                }
                if (&one == cases && !result.contains("voxels")) {
                    EXPECT_NEAR(found.at("greatest").get<double>(), winding ? 15 : 10, 1e-5);
                }
            }
        }
    }
}

TEST_P(RaysCli, WhatWindingDoesNotDecideIsReported) {
    const std::string file = (scratch_ / "open.ply").string();
    Primitive open = boxOf({0, 0, 0}, {1, 1, 1});
    open.indices.resize(33);
    writeText(file, plyOf({open}));
    const auto run = [&](const std::vector<std::string>& more) {
        std::vector<std::string> all{"rays",       file,           "--engine",  GetParam(),
                                     "--axes",     "--map",        "thickness", "-o",
                                     out("o.npz"), "--resolution", "16"};
        all.insert(all.end(), more.begin(), more.end());
        return runPeeler(all);
    };
    const std::string words = "a surface is not closed and facing outwards";
    const Outcome note = run({}), warning = run({"--overlap", "winding"});
    EXPECT_EQ(note.exit_code + warning.exit_code, 0);
    EXPECT_NE(note.err.find("peeler: " + words), std::string::npos) << note.err;
    EXPECT_NE(note.err.find("(open)"), std::string::npos) << note.err;
    EXPECT_NE(warning.err.find("peeler: warning: " + words), std::string::npos) << warning.err;
    fs::remove(out("o.npz"));
    EXPECT_EQ(run({"--overlap", "winding", "--strict"}).exit_code, 3);
    EXPECT_FALSE(fs::exists(out("o.npz")));
    const Outcome chosen = run({"--overlap", "parity", "--strict"});
    EXPECT_EQ(chosen.exit_code, 0) << chosen.err;
    EXPECT_EQ(chosen.err.find(words), std::string::npos) << chosen.err;
    expectRefused({"--axes", "--overlap", "parity"}, 2, "--overlap");
}

TEST_P(RaysCli, NoPictureOfASeriesIsReplaced) {
    writeText(out("m_0002.png"), "there");
    const Outcome run = rays({"--axes", "--map", "first", "--no-clobber", "-o", out("m_####.png")});
    EXPECT_EQ(run.exit_code, 4);
    EXPECT_NE(run.err.find("m_0002.png"), std::string::npos) << run.err;
    EXPECT_FALSE(fs::exists(out("m_0000.png")));
    writeText(out("d_0001.png"), "0 0 1\n1 0 0\n");
    EXPECT_EQ(
        rays({"--directions-file", out("d_0001.png"), "--map", "first", "-o", out("d_####.png")})
            .exit_code,
        2);
    EXPECT_EQ(bytesOf(out("d_0001.png")), "0 0 1\n1 0 0\n");
}

TEST_P(RaysCli, LinesAndPointsAreNotHit) {
    Json lines = triangleScene();
    Json& primitives = lines["meshes"][0]["primitives"];
    primitives.push_back(primitives[0]);
    primitives[1]["mode"] = 2;  // LINE_LOOP: draws the triangle's outline
    primitives.push_back(primitives[0]);
    primitives[2]["mode"] = 0;
    const auto hits = [&] {
        return Json::parse(rays({"--axes", "--resolution", "64", "-o", out(), "--json"}).out)
            .at("hits")
            .get<std::uint64_t>();
    };
    const std::uint64_t alone = hits();
    writeText(scene_, lines.dump());
    EXPECT_EQ(hits(), alone);
    EXPECT_GT(alone, 1000U);
}

TEST_P(RaysCli, DirectionsOfAnyLengthAreDirections) {
    const auto hits = [&](const std::string& direction) {
        const Outcome run =
            rays({"--direction", direction, "--resolution", "64", "-o", out(), "--json"});
        return Json::parse(run.out).at("hits").get<std::uint64_t>();
    };
    EXPECT_GT(hits("0,0,1"), 1000U);
    EXPECT_EQ(hits("0,0,1e-200"), hits("0,0,1"));
    EXPECT_EQ(hits("0,0,1e200"), hits("0,0,1"));
}

TEST_P(RaysCli, AnEmptySceneHasNothingToHit) {
    Json empty = triangleScene();
    empty["nodes"][0].erase("mesh");
    writeText(scene_, empty.dump());
    expectRefused({"--axes"}, 3, "nothing that rays can hit");
}

TEST_P(RaysCli, AnOpenMeshFailsTheParity) {
    const Outcome run = rays({"--axes", "--resolution", "32", "--parity", "fail"});
    EXPECT_EQ(run.exit_code, 3);
    EXPECT_NE(run.err.find("first"), std::string::npos) << run.err;
    EXPECT_NE(run.err.find("3 edges are open"), std::string::npos) << run.err;
    // The command writes the report, but not the file of hits.
    const Outcome file = rays({"--axes", "--resolution", "32", "--parity", "fail", "-o", out(),
                               "--report", out("report.json")});
    EXPECT_EQ(file.exit_code, 3);
    EXPECT_FALSE(fs::exists(out()));
    const Json report = Json::parse(bytesOf(out("report.json")));
    EXPECT_FALSE(report.at("parity").at("holds").get<bool>());
    EXPECT_TRUE(report.at("output").is_null());
    EXPECT_EQ(rays({"--axes", "--resolution", "32", "--parity", "report"}).exit_code, 0);
}

TEST_P(RaysCli, DirectionsComeFromAFile) {
    writeText(scratch_ / "d.txt", "# two\n0 0 -1\n\n0, 0.5,\t1e0  # up\r\n");
    const Outcome run = rays(
        {"--directions-file", scratch_ / "d.txt", "--resolution", "32", "-o", out(), "--json"});
    ASSERT_EQ(run.exit_code, 0) << run.err;
    EXPECT_EQ(Json::parse(run.out).at("bundles"), 2);
}

TEST_P(RaysCli, TheBytesDoNotDependOnThreadsOrMemory) {
    const std::vector<std::string> same = {"--directions", "3", "--resolution", "400"};
    for (const std::string name : {"a", "b"}) {
        for (const std::string extension : {".npz", ".ply", ".exr"}) {
            std::vector<std::string> arguments = same;
            arguments.insert(arguments.end(), {"-o", out(name + extension)});
            if (name == "b")
                arguments.insert(arguments.end(),
                                 {"--threads", "1", "--memory", kShadowMemory ? "8G" : "512M"});
            const Outcome run = rays(arguments);
            ASSERT_EQ(run.exit_code, 0) << run.err;
        }
    }
    for (const std::string extension : {".npz", ".ply", ".exr"})
        EXPECT_TRUE(bytesOf(out("a" + extension)) == bytesOf(out("b" + extension))) << extension;
}

}  // namespace
}  // namespace peeler::test
