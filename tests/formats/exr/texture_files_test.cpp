// SPDX-License-Identifier: Apache-2.0
// Tests value textures with the readers of OpenImageIO and OpenEXR.
#include "formats/exr/texture_files.h"

#include <ImfChannelList.h>
#include <ImfFrameBuffer.h>
#include <ImfHeader.h>
#include <ImfInputPart.h>
#include <ImfMultiPartInputFile.h>
#include <OpenImageIO/imagebuf.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "support/test_support.h"

namespace peeler::test {
namespace {

TEST(TextureFiles, PngHoldsNumbersLinearlyInSixteenBits) {
    const ScratchDir folder;
    const std::string path = (folder / "values.png").string();
    writePngTexture(path, {"", 2, 1, {0, 0.25F, -3, std::numeric_limits<float>::quiet_NaN()}}, "");
    const OIIO::ImageBuf image(path);
    ASSERT_EQ(image.spec().nchannels, 1);
    EXPECT_EQ(image.spec().format, OIIO::TypeDesc::UINT16);
    EXPECT_EQ(image.spec().get_string_attribute("oiio:ColorSpace").find("Gamma"),
              std::string::npos);
    EXPECT_NEAR(image.getchannel(1, 0, 0, 0), 0.25F, 1.0F / 65535);
    EXPECT_EQ(image.getchannel(0, 1, 0, 0), 0.0F);
    EXPECT_EQ(image.getchannel(1, 1, 0, 0), 0.0F);
}

TEST(TextureFiles, ExrHasAPartATextureTopRowFirst) {
    // With 37 rows, the last chunk is incomplete.
    constexpr int kSize = 37;
    ValueTexture grey{"material_0", kSize, 1, {}}, rgb{"material_4", kSize, 3, {}};
    for (int i = 0; i < kSize * kSize; ++i) {
        grey.values.push_back(static_cast<float>(i) * 0.37F);
        rgb.values.insert(rgb.values.end(), {static_cast<float>(i), -0.5F, 1e6F});
    }
    const ScratchDir folder;
    const std::string path = (folder / "values.exr").string();
    const ValueTexture textures[] = {grey, rgb};
    writeExrTextures(path, textures, "us");
    Imf::MultiPartInputFile file(path.c_str());
    ASSERT_EQ(file.parts(), 2);
    EXPECT_EQ(file.header(0).name(), "material_0");
    EXPECT_EQ(file.header(1).name(), "material_4");
    const auto read = [&](int part, const char* channel) {
        std::vector<float> values(kSize * kSize, -1);
        Imf::InputPart input(file, part);
        EXPECT_NE(input.header().channels().findChannel(channel), nullptr) << channel;
        Imf::FrameBuffer frame;
        frame.insert(channel, Imf::Slice(Imf::FLOAT, reinterpret_cast<char*>(values.data()),
                                         sizeof(float), sizeof(float) * kSize));
        input.setFrameBuffer(frame);
        input.readPixels(0, kSize - 1);
        return values;
    };
    EXPECT_EQ(read(0, "Y"), grey.values);
    EXPECT_EQ(read(1, "R")[kSize + 2], kSize + 2.0F);
    EXPECT_EQ(read(1, "G")[5], -0.5F);
    EXPECT_EQ(read(1, "B")[kSize * kSize - 1], 1e6F);
}

}  // namespace
}  // namespace peeler::test
