// SPDX-License-Identifier: Apache-2.0
// Tests that camera attributes project points to the right pixels.
#include <OpenEXR/ImfFloatAttribute.h>
#include <OpenEXR/ImfStandardAttributes.h>
#include <OpenEXR/ImfStringAttribute.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <glm/gtc/matrix_transform.hpp>
#include <numbers>

#include <peeler/error.h>
#include "core/lens/picture_rays.h"
#include "core/scene/intrinsics.h"
#include "formats/exr/exr_header.h"

namespace peeler::test {
namespace {

Plan makePlan(bool perspective, bool infinite) {
    Plan plan;
    View& view = plan.view;
    view.width = 200;
    view.height = 100;
    view.crop = {0, 0, 200, 100};
    view.camera_to_world =
        glm::inverse(glm::lookAt(glm::dvec3(3, 2, 5), glm::dvec3(0, 0, 0), glm::dvec3(0, 1, 0)));
    view.projection.perspective = perspective;
    view.projection.half_width = perspective ? 1.0 : 4.0;
    view.projection.half_height = perspective ? 0.5 : 2.0;
    view.projection.near = 0.5;
    if (!infinite) view.projection.far = 50;
    return plan;
}

float attribute(const Imf::Header& header, const char* name) {
    return header.typedAttribute<Imf::FloatAttribute>(name).value();
}

class Camera : public testing::TestWithParam<std::pair<bool, bool>> {};

TEST_P(Camera, MatricesProjectKnownPoints) {
    const auto [perspective, infinite] = GetParam();
    const Plan plan = makePlan(perspective, infinite);
    const Imf::Header header = exrHeader(plan, {}, plan.view.crop);
    const Imath::M44f to_camera = Imf::worldToCamera(header), to_ndc = Imf::worldToNDC(header);

    // Each point has the image position (u right, v down, both 0 to 1) and the distance d in front
    // of the eye.
    for (const auto& [u, v, d] : {std::array{0.5, 0.5, 4.0},
                                  {0.0, 0.0, 2.0},
                                  {1.0, 1.0, 7.0},
                                  {0.25, 0.9, 1.0},
                                  {0.8, 0.1, 30.0}}) {
        const double size = perspective ? d : 1;
        const double x = (2 * u - 1) * plan.view.projection.half_width * size;
        const double y = (1 - 2 * v) * plan.view.projection.half_height * size;
        const glm::dvec4 world = plan.view.camera_to_world * glm::dvec4(x, y, -d, 1);
        const Imath::V3f point(static_cast<float>(world.x), static_cast<float>(world.y),
                               static_cast<float>(world.z));
        Imath::V3f camera, ndc;
        to_camera.multVecMatrix(point, camera);
        to_ndc.multVecMatrix(point, ndc);  // multiplies the point as a row vector and divides by w
        constexpr float kTolerance = 2e-5F;
        EXPECT_NEAR(camera.x, x, kTolerance * 30);
        EXPECT_NEAR(camera.y, y, kTolerance * 30);
        EXPECT_NEAR(camera.z, d, kTolerance * 30) << "+z is forward";
        EXPECT_NEAR(ndc.x, u, kTolerance);
        EXPECT_NEAR(ndc.y, v, kTolerance) << "y points down";
    }
    EXPECT_NEAR(std::abs(to_camera.determinant()), 1, 1e-5);
    EXPECT_LT(to_camera.determinant(), 0) << "left-handed";
    const Imath::M44f identity = to_ndc * to_ndc.gjInverse(true);
    EXPECT_TRUE(identity.equalWithAbsError(Imath::M44f(), 1e-3F)) << identity;
}

INSTANTIATE_TEST_SUITE_P(ExrHeader, Camera,
                         testing::Values(std::pair{true, true}, std::pair{true, false},
                                         std::pair{false, false}));

TEST(ExrHeader, FrustumAttributes) {
    const Plan plan = makePlan(true, true);
    const Imf::Header header = exrHeader(plan, {}, plan.view.crop);
    EXPECT_FLOAT_EQ(attribute(header, "fieldOfViewHorizontal"), 90);
    EXPECT_FLOAT_EQ(attribute(header, "fieldOfViewVertical"),
                    static_cast<float>(2 * std::atan(0.5) * 180 / std::numbers::pi));
    EXPECT_EQ(attribute(header, "near"), 0.5F);
    EXPECT_TRUE(std::isinf(attribute(header, "far")));
    EXPECT_EQ(header.screenWindowWidth(), 2);
    EXPECT_EQ(header.screenWindowCenter(), Imath::V2f(0, 0));
    EXPECT_EQ(header.pixelAspectRatio(), 1);
    EXPECT_EQ(Imf::chromaticities(header), Imf::Chromaticities());
    EXPECT_FALSE(Imf::hasCapDate(header));
    EXPECT_FALSE(Imf::hasFramesPerSecond(header));

    const Plan box = makePlan(false, false);
    Provenance film;
    film.frames_per_second = 24000.0 / 1001;
    const Imf::Header ortho = exrHeader(box, film, box.view.crop);
    EXPECT_EQ(attribute(ortho, "orthographicWidth"), 8);
    EXPECT_EQ(attribute(ortho, "orthographicHeight"), 4);
    EXPECT_EQ(attribute(ortho, "far"), 50);
    EXPECT_FALSE(ortho.findTypedAttribute<Imf::FloatAttribute>("fieldOfViewVertical"));
    EXPECT_EQ(Imf::framesPerSecond(ortho).n, 24000);
    EXPECT_EQ(Imf::framesPerSecond(ortho).d, 1001U);
}

TEST(ExrHeader, WidePixelsHaveTheirAspectRatio) {
    Plan plan = makePlan(true, true);
    plan.view.width = 100;
    EXPECT_EQ(exrHeader(plan, {}, plan.view.crop).pixelAspectRatio(), 2);
}

TEST(ExrHeader, DateOnlyFromSourceDateEpoch) {
    const Plan plan = makePlan(true, true);
    setenv("SOURCE_DATE_EPOCH", "86400", 1);
    const Imf::Header header = exrHeader(plan, {}, plan.view.crop);
    EXPECT_EQ(Imf::capDate(header), "1970:01:02 00:00:00");
    setenv("SOURCE_DATE_EPOCH", "yesterday", 1);
    EXPECT_THROW(exrHeader(plan, {}, plan.view.crop), Error);
    unsetenv("SOURCE_DATE_EPOCH");
}

TEST(ExrHeader, CameraJsonRoundTripsToTheLastBit) {
    View view = makePlan(true, false).view;
    view.camera_name = "a\"b";
    view.projection.half_width = 1.0 / 3;
    view.crop = {1, 2, 30, 40};
    const View back = viewFromJson(cameraJson(view));
    EXPECT_EQ(back.camera_name, view.camera_name);
    EXPECT_EQ(back.camera_to_world, view.camera_to_world);
    EXPECT_EQ(back.projection.half_width, view.projection.half_width);
    EXPECT_EQ(back.projection.far, view.projection.far);
    EXPECT_EQ(back.crop, view.crop);
    EXPECT_EQ(back.width, view.width);
    EXPECT_EQ(back.sample, view.sample);
    EXPECT_EQ(cameraJson(view).find("sample"), std::string::npos);
    view.sample = {1.0 / 3, 0.75};
    EXPECT_EQ(viewFromJson(cameraJson(view)).sample, view.sample);
    view.camera_name = "\xff\xfe";  // not UTF-8
    EXPECT_NO_THROW(viewFromJson(cameraJson(view)));
    EXPECT_THROW(viewFromJson("{}"), Error);
    EXPECT_THROW(viewFromJson("["), Error);
}

TEST(ExrHeader, ALensIsStoredToTheLastBit) {
    Plan plan = makePlan(true, true);
    setLens(plan.view, {{"opencv-fisheye", {0.1, -1.0 / 3, 0, 1e-17}}, {50, 51.0 / 7, 99.5, 49}});
    plan.view.crop = {10, 20, 110, 70};
    const Imf::Header header = exrHeader(plan, {}, plan.view.crop);
    const auto text = [&](const char* name) {
        const auto* found = header.findTypedAttribute<Imf::StringAttribute>(name);
        return found ? found->value() : "";
    };
    EXPECT_EQ(text("peeler:lens"), "opencv-fisheye");
    EXPECT_EQ(text("peeler:projection"), "lens");
    EXPECT_EQ(text("peeler:depth"), "distance");
    EXPECT_TRUE(Imf::hasWorldToCamera(header));
    for (const char* of_pinholes : {"worldToNDC", "fieldOfViewHorizontal", "fieldOfViewVertical"})
        EXPECT_EQ(header.find(of_pinholes), header.end()) << of_pinholes;
    EXPECT_EQ(header.screenWindowWidth(), 1);
    EXPECT_EQ(header.pixelAspectRatio(), 1);

    const View back = viewFromJson(text("peeler:cameraJson"));
    ASSERT_TRUE(back.rays);
    EXPECT_EQ(back.rays->lens()->lens, plan.view.rays->lens()->lens);
    EXPECT_EQ(back.rays->lens()->intrinsics, plan.view.rays->lens()->intrinsics);
    EXPECT_EQ(back.crop, plan.view.crop);
    EXPECT_EQ(worldPosition(back, 12.5, 30.5, 3), worldPosition(plan.view, 12.5, 30.5, 3));
    EXPECT_EQ(cameraJson(back), cameraJson(plan.view));
}

TEST(ExrHeader, LensesThatDoNotExistAreRefused) {
    Plan plan = makePlan(true, true);
    setLens(plan.view, {{"equirectangular"}, {}});
    const std::string json = cameraJson(plan.view);
    EXPECT_NE(json.find("\"intrinsics\":null"), std::string::npos) << json;
    EXPECT_EQ(cameraJson(viewFromJson(json)), json);
    const auto refused = [&](const std::string& before, const std::string& after) {
        std::string other = json;
        other.replace(other.find(before), before.size(), after);
        try {
            viewFromJson(other);
            FAIL() << other;
        } catch (const Error& error) {
            EXPECT_EQ(error.kind(), ErrorKind::kInput) << other;
        }
    };
    refused("\"equirectangular\"", "\"eye\"");
    refused("\"equirectangular\"", "\"cube\"");  // six squares do not fit 200 x 100 pixels
    refused("\"equirectangular\"", "\"fisheye\"");
    refused("\"coefficients\":[]", "\"coefficients\":[1]");
}

TEST(ExrHeader, AMovingCameraIsNoCamera) {
    Plan plan = makePlan(true, true);
    View& view = plan.view;
    setLens(view, {{"fisheye"}, {50, 50, 99.5, 49.5}});
    view.rays = shutterPicture(view.rays, {glm::dmat4(1), view.camera_to_world}, view.height);
    const Imf::Header header = exrHeader(plan, {}, view.crop);
    EXPECT_EQ(header.typedAttribute<Imf::StringAttribute>("peeler:projection").value(), "shutter");
    EXPECT_EQ(header.typedAttribute<Imf::StringAttribute>("peeler:depth").value(), "distance");
    for (const char* of_cameras : {"peeler:cameraJson", "peeler:lens", "worldToCamera", "near"})
        EXPECT_EQ(header.find(of_cameras), header.end()) << of_cameras;
}

}  // namespace
}  // namespace peeler::test
