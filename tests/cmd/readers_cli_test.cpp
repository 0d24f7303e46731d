// SPDX-License-Identifier: Apache-2.0
// Tests that the programs in examples/readers print the same as `peeler info`.
#include <gtest/gtest.h>

#include "formats/exr/exr_writers.h"
#include "formats/exr/synthetic_image.h"
#include "support/python.h"
#include "support/test_support.h"

namespace peeler::test {
namespace {

namespace fs = std::filesystem;

const fs::path kReaders = sourceDir() / "examples" / "readers";

class Readers : public testing::Test {
  protected:
    void SetUp() override {
        const std::string scene = sourceDir() / "examples" / "scenes" / "coincident.glb";
        render("perspective.exr", {scene, "--crop", "100,50,200,90"});
        render("orthographic.exr", {scene, "--camera", "front"});
        SyntheticPicture far = makePicture({.crop = {3, 5, 50, 60}});
        far.plan.view.camera_to_world[3] = {1e6, -2e-3, 0, 1};
        write("far.exr", far);
        SyntheticPicture empty = makePicture({.most_layers = 0});
        write("empty.exr", empty);
    }
    void render(const std::string& name, std::vector<std::string> more) {
        more.insert(more.begin(), "render");
        more.insert(more.end(), {"-o", scratch_ / name, "--size", "320x180", "-q"});
        ASSERT_EQ(runPeeler(more).exit_code, 0);
        files_.push_back(scratch_ / name);
    }
    void write(const std::string& name, const SyntheticPicture& picture) {
        ExrLdiWriter writer(scratch_ / name);
        writePicture(writer, picture);
        files_.push_back(scratch_ / name);
    }

    /// Runs the command with each file and expects the lines that `peeler info` prints.
    template <class Prepare>
    void expectLines(const std::vector<std::string>& command, Prepare&& prepare) {
        for (const std::string& file : files_) {
            std::vector<std::string> line = command;
            line.push_back(prepare(file));
            const Outcome result = runCommand(line);
            ASSERT_EQ(result.exit_code, 0) << result.err;
            ASSERT_EQ(result.out.find("points: "), 0U) << result.out;
            const std::string info = runPeeler({"info", file}).out;
            EXPECT_NE(info.find('\n' + result.out), std::string::npos) << file << ":\n"
                                                                       << result.out << "not in\n"
                                                                       << info;
        }
    }

    ScratchDir scratch_;
    std::vector<std::string> files_;
};

TEST_F(Readers, OpenImageIo) {
    PEELER_REQUIRE_PYTHON("OpenImageIO");
    PEELER_REQUIRE_PYTHON("numpy");
    expectLines({python(), kReaders / "layers_with_openimageio.py"},
                [](const std::string& file) { return file; });
}

TEST_F(Readers, Numpy) {
    PEELER_REQUIRE_PYTHON("numpy");
    expectLines({python(), kReaders / "layers_with_numpy.py"}, [&](const std::string& file) {
        EXPECT_EQ(runPeeler({"extract", file, "--npz", scratch_ / "a.npz", "-q"}).exit_code, 0);
        return (scratch_ / "a.npz").string();
    });
}

TEST_F(Readers, PlainOpenExr) {
    const std::string program = scratch_ / "layers";
    const Outcome flags = runCommand({"pkg-config", "--cflags", "--libs", "OpenEXR"});
    if (flags.exit_code != 0) GTEST_SKIP() << "pkg-config does not know OpenEXR";
    const std::string source = kReaders / "layers_with_openexr.cpp";
    const Outcome compiled =
        runCommand({"sh", "-c",
                    "c++ -std=c++17 -Wall -Wextra -Werror '" + source + "' -o '" + program + "' " +
                        flags.out.substr(0, flags.out.find('\n'))});
    ASSERT_EQ(compiled.exit_code, 0) << compiled.err;
    expectLines({program}, [](const std::string& file) { return file; });
    const std::string text = bytesOf(source);
    EXPECT_LE(std::count(text.begin(), text.end(), '\n'), 60);
}

}  // namespace
}  // namespace peeler::test
