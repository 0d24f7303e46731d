// SPDX-License-Identifier: Apache-2.0
// Tests peeler view: compares views of layers from other cameras with renders from those cameras.
#include <OpenImageIO/imagebuf.h>
#include <OpenImageIO/imagebufalgo.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <sstream>

#include "support/test_support.h"

namespace peeler::test {
namespace {

namespace fs = std::filesystem;
using Arguments = std::vector<std::string>;

constexpr int kViewWidth = 384, kViewHeight = 216;

std::string exactly(const std::vector<double>& numbers) {
    std::ostringstream text;
    text.precision(17);
    for (std::size_t i = 0; i < numbers.size(); ++i)
        text << (i == 0 ? "" : ",") << numbers[i];
    return text.str();
}

/// Returns a picture over grey as displayed: in sRGB, from 0 to 1.
OIIO::ImageBuf shown(const fs::path& path) {
    OIIO::ImageBuf image(path.string());
    EXPECT_TRUE(image.read(0, 0, true, OIIO::TypeDesc::FLOAT)) << image.geterror();
    image = OIIO::ImageBufAlgo::channels(image, 4, {}, {}, {"R", "G", "B", "A"});
    OIIO::ImageBuf result(OIIO::ImageSpec(kViewWidth, kViewHeight, 3, OIIO::TypeDesc::FLOAT));
    for (OIIO::ImageBuf::ConstIterator<float> from(image); !from.done(); ++from) {
        for (int c = 0; c < 3; ++c) {
            const double sum = from[c] + (1 - from[3]) * 0.18;
            const double light = std::min(1.0, std::max(0.0, sum));
            const double encoded =
                light <= 0.0031308 ? 12.92 * light : 1.055 * std::pow(light, 1 / 2.4) - 0.055;
            const auto value = static_cast<float>(encoded);
            OIIO::ImageBuf::Iterator<float> to(result, from.x(), from.y());
            to[c] = value;
        }
    }
    return result;
}

double psnr(const fs::path& a, const fs::path& b) {
    const auto result = OIIO::ImageBufAlgo::compare(shown(a), shown(b), 1, 1);
    return -20 * std::log10(std::max(result.rms_error, 1e-9));
}

class ViewsOf : public testing::TestWithParam<const char*> {
  protected:
    static void run(Arguments arguments) {
        arguments.emplace_back("-q");
        const Outcome result = runPeeler(arguments);
        ASSERT_EQ(result.exit_code, 0) << result.err;
    }

    std::string file(const std::string& name) const { return (scratch_ / name).string(); }

    /// Captures layers of the scene from its own camera, with the field of view widened by the
    /// factor `margin`.
    void capture(const std::string& name, double margin) {
        run({"render", scene_, "-o", file("own.exr"), "--as", "composite", "--size", "384x216"});
        Arguments arguments{"render",
                            scene_,
                            "-o",
                            file(name),
                            "--size",
                            std::to_string(std::lround(kViewWidth * margin)) + 'x' +
                                std::to_string(std::lround(kViewHeight * margin)),
                            "--samples",
                            "4"};
        const Arguments camera = cameraOf("own.exr", margin);
        arguments.insert(arguments.end(), camera.begin(), camera.end());
        run(arguments);
    }

    /// Returns render's options for the camera of a picture, with the field of view widened by the
    /// factor `margin`.
    Arguments cameraOf(const std::string& name, double margin = 1) const {
        const OIIO::ImageBuf image(file(name));
        const Json camera =
            Json::parse(image.spec().get_string_attribute("peeler:cameraJson").c_str());
        const auto row = [&](int i) {
            return camera.at("cameraToWorld").at(static_cast<std::size_t>(i));
        };
        std::vector<double> eye, target, up;
        for (int i = 0; i < 3; ++i) {
            eye.push_back(row(i).at(3));
            target.push_back(row(i).at(3).get<double>() - row(i).at(2).get<double>());
            up.push_back(row(i).at(1));
        }
        const double half = camera.at("halfHeight").get<double>() * margin;
        return {"--eye", exactly(eye), "--target", exactly(target),
                "--up",  exactly(up),  "--fov",    exactly({2 * std::atan(half) * 180 / M_PI})};
    }

    ScratchDir scratch_;
    std::string scene_ =
        (sourceDir() / "examples" / "scenes" / (std::string(GetParam()) + ".glb")).string();
};

TEST_P(ViewsOf, TheOwnCameraShowsTheComposite) {
    run({"render", scene_, "-o", file("layers.exr"), "--size", "384x216"});
    run({"flatten", file("layers.exr"), "-o", file("flat.exr")});
    run({"view", file("layers.exr"), "-o", file("view.exr")});
    const double same = psnr(file("view.exr"), file("flat.exr"));
    std::printf("%s: %.1f dB\n", GetParam(), same);
    EXPECT_GE(same, 50);
    run({"view", file("layers.exr"), "-o", file("first.exr"), "--layers", "1", "--orbit", "0,0"});
    run({"flatten", file("layers.exr"), "-o", file("first_flat.exr"), "--layers", "1"});
    EXPECT_GE(psnr(file("first.exr"), file("first_flat.exr")), 50);
}

TEST_P(ViewsOf, AllLayersAreWorthThreeDecibelsBesideIt) {
    // Layers are captured wider than the views, because views show parts from outside the picture.
    // They are antialiased, because jagged edges would dominate the comparison.
    capture("layers.exr", 1.5);
    const Arguments own = cameraOf("own.exr");
    for (const char* orbit : {"5,0", "10,0", "20,0"}) {
        // Each view has its own file name, because OpenImageIO caches files by name, and detects a
        // change only by modification time in seconds.
        const std::string all_name = std::string("all ") + orbit + ".exr";
        const std::string one_name = std::string("one ") + orbit + ".exr";
        const std::string direct_name = std::string("direct ") + orbit + ".exr";
        const auto view = [&](const std::string& name, const char* layers) {
            run({"view", file("layers.exr"), "-o", file(name), "--orbit", orbit, "--size",
                 "384x216", own[6], own[7], "--layers", layers});
        };
        view(all_name, "all");
        view(one_name, "1");
        Arguments render{"render", scene_,      "-o",     file(direct_name),
                         "--as",   "composite", "--size", "384x216"};
        const Arguments camera = cameraOf(all_name);
        render.insert(render.end(), camera.begin(), camera.end());
        run(render);
        const double all = psnr(file(all_name), file(direct_name));
        const double one = psnr(file(one_name), file(direct_name));
        std::printf("%s, %s degrees: one layer %.1f dB, all %.1f dB\n", GetParam(), orbit, one,
                    all);
        EXPECT_GE(all, one + 3) << orbit;
    }
}

INSTANTIATE_TEST_SUITE_P(Examples, ViewsOf, testing::Values("engine", "plant"),
                         [](const auto& scene) { return std::string(scene.param); });

class View : public testing::Test {
  protected:
    View() {
        const auto scene = sourceDir() / "examples" / "scenes" / "engine.glb";
        const Outcome result =
            runPeeler({"render", scene.string(), "-o", layers_, "--size", "160x90"});
        EXPECT_EQ(result.exit_code, 0) << result.err;
    }

    Outcome view(Arguments more) const {
        more.insert(more.begin(), {"view", layers_});
        return runPeeler(more);
    }

    ScratchDir scratch_;
    std::string layers_ = (scratch_ / "layers.exr").string();
};

TEST_F(View, TheSameBytesWithAnyNumberOfThreads) {
    for (const char* threads : {"1", "3"}) {
        const auto result = view({"-o", scratch_ / (std::string(threads) + ".png"), "--orbit",
                                  "15,10", "--threads", threads});
        ASSERT_EQ(result.exit_code, 0) << result.err;
    }
    EXPECT_EQ(bytesOf(scratch_ / "1.png"), bytesOf(scratch_ / "3.png"));
    EXPECT_FALSE(bytesOf(scratch_ / "1.png").empty());
}

TEST_F(View, OrbitsAboutTheTarget) {
    // A target in the middle of the picture must stay there, at the same distance.
    const auto result = view({"-o", scratch_ / "a.exr", "--orbit", "90,0", "--target", "1,2,3",
                              "--up", "0,2,0", "--size", "64", "--json"});
    ASSERT_EQ(result.exit_code, 0) << result.err;
    const Json json = Json::parse(result.out);
    EXPECT_EQ(json.at("width"), 64);
    EXPECT_EQ(json.at("height"), 36);
    EXPECT_EQ(json.at("method"), "reprojection");
    const auto matrixOf = [](const fs::path& path) {
        const OIIO::ImageBuf image(path.string());
        return Json::parse(image.spec().get_string_attribute("peeler:cameraJson").c_str())
            .at("cameraToWorld");
    };
    const Json before = matrixOf(layers_), after = matrixOf(scratch_ / "a.exr");
    const auto at = [](const Json& m, std::size_t row) { return m.at(row).at(3).get<double>(); };
    // The camera makes a quarter turn to the right: its position (x, z) relative to the target
    // becomes (z, −x).
    EXPECT_NEAR(at(after, 0) - 1, at(before, 2) - 3, 1e-9);
    EXPECT_NEAR(at(after, 2) - 3, -(at(before, 0) - 1), 1e-9);
    EXPECT_NEAR(at(after, 1), at(before, 1), 1e-9);
}

TEST_F(View, RefusesWhatCannotBe) {
    struct Case {
        Arguments more;
        int exit_code;
        std::string says;
    };
    const std::string png = scratch_ / "a.png", html = scratch_ / "a.html";
    const std::vector<Case> cases = {
        {{"-o", png, "--orbit", "5,0", "--eye", "1,2,3"}, 2, "--orbit, --eye"},
        {{"-o", png, "--orbit", "5"}, 2, "yaw,pitch"},
        {{"-o", png, "--fov", "30", "--ortho-height", "2"}, 2, "--ortho-height"},
        {{"-o", png, "--eye", "1,2,3", "--target", "1,2,3"}, 2, "the eye is at the target"},
        {{"-o", png, "--eye", "0,5,0", "--target", "0,0,0", "--up", "0,1,0"}, 2, "--up"},
        {{"-o", png, "--size", "64x36", "--crop", "60,0,10,10"}, 2, "--crop 60,0,10,10"},
        {{"-o", png, "--max-fragments", "5"}, 2, "--max-fragments"},
        {{"-o", html, "--orbit", "5,0"}, 2, "the file's camera"},
        {{"-o", html, "--max-fragments", "100"}, 2, "--max-fragments"},
        {{"-o", scratch_ / "a.xyz"}, 2, ".xyz"},
        {{"-o", layers_}, 2, "the output is the input"},
    };
    for (const Case& one : cases) {
        const auto result = view(one.more);
        EXPECT_EQ(result.exit_code, one.exit_code) << one.says << '\n' << result.err;
        EXPECT_NE(result.err.find(one.says), std::string::npos) << one.says << '\n' << result.err;
        EXPECT_FALSE(fs::exists(one.more[1]) && one.more[1] != layers_) << one.more[1];
    }
}

}  // namespace
}  // namespace peeler::test
