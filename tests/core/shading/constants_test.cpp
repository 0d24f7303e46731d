// SPDX-License-Identifier: Apache-2.0
// Tests that embedded constants equal freshly computed ones, bit for bit. Both are computed by the
// same object files (peeler_calculating), so flags and unity builds make no difference. However,
// the maths library of a machine other than the build machine could change a last bit.
#include "core/shading/constants.h"

#include <gtest/gtest.h>

#include <cstddef>
#include <cstring>
#include <span>

namespace peeler::test {
namespace {

template <typename T>
bool sameBits(std::span<const T> a, std::span<const T> b) {
    return a.size() == b.size() && std::memcmp(a.data(), b.data(), a.size_bytes()) == 0;
}

TEST(Constants, AreTablesAsCalculated) {
    EXPECT_TRUE(sameBits<glm::vec4>(constants().albedos, albedoTable()));
    EXPECT_TRUE(sameBits<glm::vec4>(constants().lobes, lobeTable()));
    EXPECT_FALSE(sameBits<glm::vec4>(constants().albedos, constants().lobes));
}

TEST(Constants, AreTheStudioAsCalculated) {
    const Environment studio = embeddedStudio(), calculated = studioEnvironment();
    EXPECT_EQ(studio.width, calculated.width);
    EXPECT_EQ(studio.height, calculated.height);
    EXPECT_EQ(studio.rotation, 0);
    EXPECT_TRUE(studio.is_studio);
    EXPECT_TRUE(calculated.is_studio);
    EXPECT_TRUE(sameBits<glm::vec3>(studio.radiance, calculated.radiance));
}

TEST(Constants, AreTheStudiosMapsAsCalculated) {
    const EnvironmentMaps maps = embeddedStudioMaps(), calculated = prefilter(studioEnvironment());
    ASSERT_EQ(maps.radiance.size(), calculated.radiance.size());
    for (std::size_t level = 0; level < maps.radiance.size(); ++level) {
        EXPECT_EQ(maps.radiance[level].size, calculated.radiance[level].size);
        EXPECT_TRUE(
            sameBits<glm::vec3>(maps.radiance[level].texels, calculated.radiance[level].texels))
            << level;
    }
    EXPECT_EQ(maps.irradiance.size, calculated.irradiance.size);
    EXPECT_TRUE(sameBits<glm::vec3>(maps.irradiance.texels, calculated.irradiance.texels));
}

}  // namespace
}  // namespace peeler::test
