// SPDX-License-Identifier: Apache-2.0
#include "core/gl/context.h"

#include <gtest/gtest-spi.h>
#include <gtest/gtest.h>

#include <algorithm>

#include <peeler/error.h>
#include "core/gl/functions.h"
#include "support/capture.h"
#include "support/test_support.h"

namespace peeler::gl {
namespace {

TEST(Context, TheBackendAskedForIsTheBackendMade) {
    const Device& device = test::sharedContext().device();
    EXPECT_EQ(device.backend, test::testBackend());
    EXPECT_TRUE(device.problem.empty());
    EXPECT_FALSE(device.renderer.empty());
    EXPECT_GE(device.limits.framebuffer_width, 16384);
    EXPECT_GE(device.limits.shader_storage_block_size, 1 << 27);
}

TEST(Context, EveryListedDeviceWorksOrSaysWhyNot) {
    std::vector<Device> devices;
    test::inOwnThread([&] { devices = listDevices(); });
    ASSERT_FALSE(devices.empty());
    for (std::size_t i = 0; i < devices.size(); ++i) {
        EXPECT_EQ(devices[i].index, static_cast<int>(i));
        EXPECT_NE(devices[i].problem.empty(), devices[i].version.empty()) << devices[i].name;
    }
}

TEST(Context, WhatTheDriverComplainsOfFailsATest) {
    const Functions& gl = test::sharedContext().functions();
    EXPECT_NONFATAL_FAILURE(gl.Enable(GL_NONE), "GL: ");
    EXPECT_EQ(gl.GetError(), static_cast<GLenum>(GL_INVALID_ENUM));
}

ErrorKind kindOf(const ContextRequest& request) {
    ErrorKind kind = ErrorKind::kInternal;
    test::inOwnThread([&] {
        try {
            createContext(request);
        } catch (const Error& error) {
            EXPECT_FALSE(error.hint().empty());
            kind = error.kind();
        }
    });
    return kind;
}

TEST(Context, UnknownBackendsAndDevicesAreRefused) {
    EXPECT_EQ(kindOf({.backend = "vulkan"}), ErrorKind::kUsage);
    EXPECT_EQ(kindOf({.device = {.index = 99}}), ErrorKind::kDevice);
}

TEST(Context, ASoftwareRendererIsRefusedWhereAGpuIsRequired) {
    if (!test::sharedContext().device().software) GTEST_SKIP() << "this machine has a GPU";
    EXPECT_EQ(kindOf({.backend = test::testBackend(), .require_gpu = true}), ErrorKind::kDevice);
}

TEST(Context, AGpuIsFoundIfThereIsOne) {
    std::vector<std::string> attempts;
    bool found = false;
    test::inOwnThread([&] {
        const auto context = findGpuContext(&attempts);
        found = context != nullptr;
        EXPECT_FALSE(found && context->device().software);
    });
    std::vector<Device> devices;
    test::inOwnThread([&] { devices = listDevices(); });
    const bool listed = std::ranges::any_of(
        devices, [](const Device& device) { return device.problem.empty() && !device.software; });
    EXPECT_EQ(found, listed);
    EXPECT_TRUE(found || attempts.size() == devices.size()) << "each says why not";
}

}  // namespace
}  // namespace peeler::gl
