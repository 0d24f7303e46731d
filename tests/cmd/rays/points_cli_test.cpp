// SPDX-License-Identifier: Apache-2.0
// Tests rays --points, which reads files of points and writes arrays; NumPy reads the arrays.
#include <gtest/gtest.h>

#include <fstream>
#include <nlohmann/json.hpp>

#include "cmd/tiny_gltf.h"
#include "support/python.h"
#include "support/test_support.h"

namespace peeler::test {
namespace {

namespace fs = std::filesystem;

constexpr const char* kReadHits = R"(
import json, sys, numpy
a = numpy.load(sys.argv[1], allow_pickle=False)
finite = lambda v: [None if x in (numpy.inf, 0xFFFFFFFF) else round(float(x), 6)
                    for x in v.flatten()]
print(json.dumps({k: [str(a[k].dtype), list(a[k].shape), finite(a[k])] for k in a}))
)";

/// Three triangles perpendicular to Z, at Z = 0, −0.1 and −0.2. Rays along X do not hit them.
/// Instantiated for each engine.
class Points : public testing::TestWithParam<const char*> {
  protected:
    Points() {
        writeScene(scratch_.path(), stackScene(3));
        std::ofstream(scratch_ / "p.ply")
            << "ply\nformat ascii 1.0\nelement vertex 4\nproperty double x\nproperty double y\n"
               "property double z\nend_header\n0 0 -0.05\n3 -2 1\n1 1 -0.2\n0 500 0\n";
    }
    Outcome rays(std::vector<std::string> options) const {
        options.insert(options.begin(), {"rays", scratch_ / "scene.gltf"});
        options.insert(options.end(), {"--engine", GetParam()});
        return runPeeler(options);
    }
    std::string path(const std::string& name) const { return (scratch_ / name).string(); }

    ScratchDir scratch_;
};
INSTANTIATE_TEST_SUITE_P(By, Points, testing::Values("cpu", "gl"),
                         [](const auto& row) { return std::string(row.param); });

TEST_P(Points, BeforeAndAfter) {
    PEELER_REQUIRE_PYTHON("numpy");
    for (const char* budget : {"0", kShadowMemory ? "8G" : "700M"}) {
        std::vector<std::string> options = {
            "--points",     path("p.ply"), "-o",     path("o.npz"), "--direction",
            "0,0,2",        "--direction", "0,0,-1", "--direction", "1,0,0",
            "--resolution", "500",         "--json"};
        if (std::string(budget) != "0") options.insert(options.end(), {"--memory", budget});
        const Outcome run = rays(options);
        ASSERT_EQ(run.exit_code, 0) << run.err;
        const Json told = Json::parse(run.out).at("points");
        EXPECT_EQ(told,
                  Json::parse(R"({"count": 4, "before": 5, "after": 4, "besideBundles": 4})"));
        const Outcome read = runPython(kReadHits, {path("o.npz")});
        ASSERT_EQ(read.exit_code, 0) << read.err;
        EXPECT_EQ(Json::parse(read.out), Json::parse(R"({
            "t_before": ["float32", [3, 4],
                [0.05, 1, 0, null, 0.05, null, 0, null, null, null, null, null]],
            "geometry_ids_before": ["uint32", [3, 4],
                [1, 0, 2, null, 0, null, 2, null, null, null, null, null]],
            "primitive_ids_before": ["uint32", [3, 4],
                [0, 0, 0, null, 0, null, 0, null, null, null, null, null]],
            "t_after": ["float32", [3, 4],
                [0.05, null, 0.1, null, 0.05, 1, null, null, null, null, null, null]],
            "geometry_ids_after": ["uint32", [3, 4],
                [0, null, 1, null, 1, 0, null, null, null, null, null, null]],
            "primitive_ids_after": ["uint32", [3, 4],
                [0, null, 0, null, 0, 0, null, null, null, null, null, null]],
            "points": ["float64", [4, 3], [0, 0, -0.05, 3, -2, 1, 1, 1, -0.2, 0, 500, 0]],
            "directions": ["float64", [3, 3], [0, 0, 1, 0, 0, -1, 1, 0, 0]],
            "arrays_version": ["int64", [], [2]]})"));
    }
}

TEST_P(Points, WhatContradicts) {
    const auto expect = [&](int code, const std::string& what, std::vector<std::string> options) {
        options.insert(options.end(), {"--points", path("p.ply")});
        const Outcome run = rays(options);
        EXPECT_EQ(run.exit_code, code) << run.err;
        EXPECT_NE(run.err.find(what), std::string::npos) << run.err;
        EXPECT_FALSE(fs::exists(path("o.npz")));
    };
    const std::string out = path("o.npz");
    expect(2, "--voxels", {"--axes", "--map", "thickness", "-o", out});
    expect(2, "--map", {"--voxels", "8", "-o", out});
    expect(2, "not a camera", {"--camera", "front", "-o", out});
    expect(2, ".npz", {"--axes", "-o", path("o.ply")});
    expect(2, "no output file", {"--axes", "--parity", "report"});
    expect(2, "no rays are given", {"-o", out});
    fs::copy(path("p.ply"), path("p.npz"));
    const Outcome over =
        rays({"--axes", "--points", path("p.npz"), "-o", path("p.npz"), "--overwrite"});
    EXPECT_EQ(over.exit_code, 2) << over.err;
    fs::resize_file(path("p.ply"), fs::file_size(path("p.ply")) - 6);
    expect(3, "vertex 3", {"--axes", "-o", out});
}

}  // namespace
}  // namespace peeler::test
