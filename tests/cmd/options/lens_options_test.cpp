// SPDX-License-Identifier: Apache-2.0
// Tests the camera of --lens and --distortion.
#include "cmd/options/lens_options.h"

#include <gtest/gtest.h>

#include <numbers>

#include <peeler/error.h>
#include "support/test_support.h"

namespace peeler::cmd {
namespace {

CameraOptions cameraOf(Size size, std::optional<double> fov = {}) {
    CameraOptions camera;
    camera.size = size;
    camera.fov = fov;
    return camera;
}

TEST(LensOptions, FieldsOfViewBecomeIntrinsics) {
    CameraOptions fisheye = cameraOf({640, 480}, 90);
    takeLens({"fisheye", {}}, fisheye);
    EXPECT_EQ(fisheye.lens, Lens{"fisheye"});
    EXPECT_FALSE(fisheye.fov);
    // An equidistant lens: 240 pixels are an eighth of a turn.
    const double f = 240 / (std::numbers::pi / 4);
    EXPECT_NEAR(fisheye.intrinsics->fx, f, 1e-12 * f);
    EXPECT_EQ(fisheye.intrinsics->cx, 319.5);
    EXPECT_EQ(fisheye.intrinsics->cy, 239.5);

    CameraOptions radial = cameraOf({640, 480}, 90);
    takeLens({{}, std::vector<double>{0.5, 0, 0, 0}}, radial);  // opencv
    EXPECT_NEAR(radial.intrinsics->fy, 240 / 1.5, 1e-12);

    CameraOptions pinhole = cameraOf({640, 480}, 90);
    takeLens({{}, std::vector<double>{0, 0, 0, 0}}, pinhole);
    EXPECT_FALSE(pinhole.lens);
    EXPECT_EQ(pinhole.fov, 90);

    CameraOptions world = cameraOf({640, 0});
    takeLens({"equirectangular", {}}, world);
    EXPECT_EQ(world.size, (Size{640, 320}));

    CameraOptions ftheta = cameraOf({640, 480});
    takeLens({"ftheta", std::vector<double>{0, 0.01}}, ftheta);
    EXPECT_EQ(ftheta.intrinsics, (Intrinsics{1, 1, 319.5, 239.5}));
}

TEST(LensOptions, ContradictionsAreRefused) {
    const auto refused = [](const LensOptions& options, CameraOptions camera, const char* what) {
        try {
            takeLens(options, camera);
            ADD_FAILURE() << what;
        } catch (const Error& error) {
            EXPECT_EQ(error.kind(), ErrorKind::kUsage);
            EXPECT_TRUE(test::contains(error.whatText(), what)) << error.what();
        }
    };
    refused({"fisheye", {}}, cameraOf({640, 480}), "no focal length");
    refused({"fisheye", {}}, cameraOf({640, 0}, 90), "picture size");
    refused({"fisheye", std::vector<double>{1}}, cameraOf({640, 480}, 90), "takes 0 coefficients");
    refused({"cube", {}}, cameraOf({640, 480}), "six faces");
    refused({"equirectangular", {}}, cameraOf({640, 320}, 90), "all directions");
    refused({"ftheta", std::vector<double>{0, 1}}, cameraOf({640, 480}, 90), "no focal length");
    refused({"simple-radial", std::vector<double>{-1}}, cameraOf({640, 480}, 120), "does not see");
}

}  // namespace
}  // namespace peeler::cmd
