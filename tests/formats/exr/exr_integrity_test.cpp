// SPDX-License-Identifier: Apache-2.0
// Tests integrity checks: they find every changed bit of a file and, in files without a hash,
// contradictory cameras.
#include "formats/exr/exr_integrity.h"

#include <OpenEXR/ImfChannelList.h>
#include <OpenEXR/ImfFloatAttribute.h>
#include <OpenEXR/ImfFrameBuffer.h>
#include <OpenEXR/ImfHeader.h>
#include <OpenEXR/ImfInputFile.h>
#include <OpenEXR/ImfMatrixAttribute.h>
#include <OpenEXR/ImfOutputFile.h>
#include <OpenEXR/ImfStringAttribute.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <fstream>
#include <functional>

#include <peeler/error.h>
#include "formats/exr/synthetic_image.h"
#include "formats/exr/texture_files.h"
#include "formats/file/content_hash.h"
#include "formats/output_hash.h"
#include "support/exr_headers.h"
#include "support/test_support.h"

namespace peeler::test {
namespace {

constexpr const char* kOutputHash = "0123456789abcdef";

/// The format, the layout and the channels of a small test file.
struct SmallFile {
    const char* name;
    const char* as;
    const char* layout = "";
    bool extra = false;
};
constexpr SmallFile kSmallFiles[] = {{"layered", "ldi"},
                                     {"deep", "deep", "", true},
                                     {"composite", "composite"},
                                     {"single_part", "ldi", "single-part"}};
constexpr SmallFile kOtherFiles[] = {
    {"nuke", "ldi", "nuke", true}, {"per_file", "ldi", "per-file"}, {"midpoint", "midpoint-depth"}};

std::string write(const SmallFile& file, const std::string& path, bool perspective = true) {
    SyntheticPicture picture =
        makePicture({.width = 12, .height = 9, .most_layers = 2, .extra = file.extra});
    picture.plan.view.projection.perspective = perspective;
    picture.plan.view.camera_to_world[3] = {0.3, -0.7, 11, 1};
    OutputOptions options{.as = file.as, .layout = file.layout};
    options.provenance.version = "1";
    options.provenance.output_hash = kOutputHash;
    writePicture(*makeSink(path, options), picture);
    return path;
}

/// Whether the reader detects that a file has changed.
bool isFound(const std::string& path) {
    try {
        return exrIntegrity(path).state == ExrIntegrity::kChanged;
    } catch (const Error& error) {
        return error.kind() == ErrorKind::kInput;
    }
}

class EachFile : public testing::TestWithParam<SmallFile> {
  protected:
    ScratchDir scratch_;
    std::string path_ = write(GetParam(), scratch_ / "small.exr");
};

TEST_P(EachFile, IsProven) {
    EXPECT_EQ(exrIntegrity(path_).state, ExrIntegrity::kProven);
    EXPECT_EQ(exrIntegrity(path_).problem(), "");
    EXPECT_EQ(outputHashOf(path_), kOutputHash);
    EXPECT_EQ(headerContradictions(path_), std::vector<std::string>());
    EXPECT_NO_THROW(requireUnchanged(path_));
}

TEST_P(EachFile, HasNoByteThatBelongsToNothing) {
    const std::string bytes = bytesOf(path_);
    std::ofstream(path_, std::ios::binary) << bytes << '\0';
    EXPECT_TRUE(isFound(path_));
    std::ofstream(path_, std::ios::binary) << bytes.substr(0, bytes.size() - 1);
    EXPECT_TRUE(isFound(path_));
    std::ofstream(path_, std::ios::binary) << bytes;
    EXPECT_FALSE(isFound(path_));
}

INSTANTIATE_TEST_SUITE_P(ExrIntegrity, EachFile, testing::ValuesIn(kOtherFiles),
                         [](const auto& file) { return std::string(file.param.name); });

class EachBit : public EachFile {};

TEST_P(EachBit, ThatHasChangedIsFound) {
    std::fstream file(path_, std::ios::in | std::ios::out | std::ios::binary);
    const std::string bytes = bytesOf(path_);
    ASSERT_GT(bytes.size(), 1000U);
    for (std::size_t at = 0; at < bytes.size(); ++at) {
        for (std::size_t bit = 0; bit < 8; ++bit) {
            // The short run flips one bit per byte, different bits in neighbouring bytes.
            if (!exhaustive() && bit != at * 5 % 8) continue;
            const auto put = [&](int value) {
                file.seekp(static_cast<std::streamoff>(at));
                file.put(static_cast<char>(value)).flush();
            };
            put(bytes[at] ^ (1 << bit));
            EXPECT_TRUE(isFound(path_)) << "bit " << bit << " of byte " << at;
            EXPECT_EQ(outputHashOf(path_), "") << "bit " << bit << " of byte " << at;
            put(bytes[at]);
        }
    }
    EXPECT_EQ(outputHashOf(path_), kOutputHash);
}

INSTANTIATE_TEST_SUITE_P(ExrIntegrity, EachBit, testing::ValuesIn(kSmallFiles),
                         [](const auto& file) { return std::string(file.param.name); });

TEST(ExrIntegrity, TellsWhichPartHasChanged) {
    const ScratchDir scratch;
    const std::string path = write(kSmallFiles[0], scratch / "a.exr");
    std::string bytes = bytesOf(path);
    bytes[bytes.size() - 1] ^= 4;
    std::ofstream(path, std::ios::binary) << bytes;
    EXPECT_EQ(exrIntegrity(path).where, path + ": layer_001");
    EXPECT_TRUE(
        contains(exrIntegrity(path).problem(), "the file has changed since peeler wrote it"));
    EXPECT_THROW(requireUnchanged(path), Error);

    const std::string set = write(kOtherFiles[1], scratch / "set.exr");
    const std::string layer = scratch / "set.layer_001.exr";
    bytes = bytesOf(layer);
    bytes[bytes.size() - 1] ^= 4;
    std::ofstream(layer, std::ios::binary) << bytes;
    EXPECT_EQ(exrIntegrity(set).where, layer + ": layer_001");
    EXPECT_EQ(outputHashOf(set), "");
}

TEST(ExrIntegrity, OfTexturesAndTheirNames) {
    const ScratchDir scratch;
    const std::string path = scratch / "a.exr";
    const ValueTexture textures[] = {{"m", 3, 1, std::vector<float>(9, 0.5F)}};
    writeExrTextures(path, textures, "us");
    EXPECT_EQ(exrIntegrity(path).state, ExrIntegrity::kProven);
}

TEST(ExrIntegrity, IsTheHashThatTheDocumentDescribes) {
    const ScratchDir scratch;
    const std::string bytes = bytesOf(write(kSmallFiles[2], scratch / "a.exr"));
    const auto number = [&](std::size_t at) {
        std::uint64_t value = 0;
        std::memcpy(&value, bytes.data() + at, sizeof value);
        return value;
    };
    // The nine rows are a single chunk, so the offset table has one entry, the offset of the byte
    // after the table.
    std::size_t table = 8;
    while (number(table) != table + 8)
        ++table;
    const auto hashOf = [](const std::string& text) {
        return contentHash(std::as_bytes(std::span(text)), 0);
    };
    const std::uint64_t chunk = hashOf(bytes.substr(table + 8));
    std::string all = bytes.substr(0, table + 8);
    const std::size_t digits = all.find("xxh64:") + 6;
    all.replace(digits, 16, 16, '0');
    all.append(reinterpret_cast<const char*>(&chunk), sizeof chunk);
    EXPECT_EQ(bytes.substr(digits, 16), hexText(hashOf(all)));
}

/// Copies a single-part file with OpenEXR's own classes and a changed header.
std::string rewrite(const std::string& path, const std::function<void(Imf::Header&)>& change) {
    const std::string copy = path + ".copy.exr";
    Imf::InputFile in(path.c_str());
    Imf::Header header = in.header();
    change(header);
    Imf::OutputFile out(copy.c_str(), header);
    out.copyPixels(in);
    return copy;
}

TEST(ExrIntegrity, FilesWithoutAHashAreToldApart) {
    const ScratchDir scratch;
    const std::string path = write(kSmallFiles[2], scratch / "a.exr");
    const std::string older = rewrite(path, [](Imf::Header& h) { h = without(h, kPixelHash); });
    EXPECT_EQ(exrIntegrity(older).state, ExrIntegrity::kNone);
    EXPECT_EQ(outputHashOf(older), kOutputHash);
    EXPECT_NO_THROW(requireUnchanged(older));
    // Another program changes the file and copies unknown attributes.
    const std::string again = rewrite(
        path, [](Imf::Header& h) { h.insert("comment", Imf::StringAttribute("brighter")); });
    EXPECT_EQ(exrIntegrity(again).state, ExrIntegrity::kChanged);

    Imf::Header header(4, 4);
    header.insert("history", Imf::StringAttribute("--eraseattrib peeler:pixelHash xxh64:"));
    header.channels().insert("R", Imf::Channel(Imf::FLOAT));
    const std::string foreign = scratch / "foreign.exr";
    {
        std::vector<float> red(16, 1);
        Imf::FrameBuffer buffer;
        buffer.insert("R", Imf::Slice(Imf::FLOAT, reinterpret_cast<char*>(red.data()), 4, 16));
        Imf::OutputFile file(foreign.c_str(), header);
        file.setFrameBuffer(buffer);
        file.writePixels(4);
    }
    EXPECT_EQ(exrIntegrity(foreign).state, ExrIntegrity::kNone);
    EXPECT_EQ(headerContradictions(foreign), std::vector<std::string>());
    EXPECT_THROW(exrIntegrity(scratch / "missing.exr"), Error);
    std::ofstream(foreign) << "no picture";
    EXPECT_THROW(exrIntegrity(foreign), Error);
}

class CameraOf : public testing::TestWithParam<bool> {};

TEST_P(CameraOf, AFileWithoutAHashMustNotContradictItself) {
    const ScratchDir scratch;
    const std::string path = write(kSmallFiles[2], scratch / "a.exr", GetParam());
    const auto denied = [&](const std::function<void(Imf::Header&)>& change) {
        return headerContradictions(rewrite(path, change));
    };
    const auto sentence = [](const std::string& name) {
        return "composite: " + name + " contradicts peeler:cameraJson";
    };
    using Sentences = std::vector<std::string>;
    EXPECT_EQ(denied([](Imf::Header& h) { h = without(h, kPixelHash); }), Sentences());
    const char* horizontal = GetParam() ? "fieldOfViewHorizontal" : "orthographicWidth";
    for (const char* name : {"near", horizontal}) {
        const auto scale = [&](float factor) {
            return denied([&](Imf::Header& h) {
                h.typedAttribute<Imf::FloatAttribute>(name).value() *= factor;
            });
        };
        EXPECT_EQ(scale(1.001F), Sentences{sentence(name)});
        // Rounding on another machine may differ by this much.
        EXPECT_EQ(scale(1.0000001F), Sentences());
        EXPECT_EQ(denied([&](Imf::Header& h) { h = without(h, name); }), Sentences{sentence(name)});
    }
    for (const char* name : {"worldToCamera", "worldToNDC"}) {
        for (const auto& [row, column] : {std::pair{0, 0}, {1, 2}, {3, 2}, {3, 3}}) {
            const auto add = [&, r = row, c = column](float more) {
                return denied([&](Imf::Header& h) {
                    h.typedAttribute<Imf::M44fAttribute>(name).value()[r][c] += more;
                });
            };
            EXPECT_EQ(add(0.01F), Sentences{sentence(name)});
            EXPECT_EQ(add(NAN), Sentences{sentence(name)});
        }
    }
    EXPECT_EQ(denied([](Imf::Header& h) { h.screenWindowCenter().x = 1; }),
              Sentences{sentence("screenWindowCenter")});
    EXPECT_EQ(denied([](Imf::Header& h) {
                  h.insert("peeler:projection", Imf::StringAttribute("fisheye"));
              }),
              Sentences{sentence("peeler:projection")});
    // worldToCamera and worldToNDC both depend on the position, so both contradict the changed
    // JSON.
    const Sentences both = denied([](Imf::Header& h) {
        std::string& json = h.typedAttribute<Imf::StringAttribute>("peeler:cameraJson").value();
        json.replace(json.find("-0.7"), 4, "-0.8");
    });
    EXPECT_EQ(both, (Sentences{sentence("worldToCamera"), sentence("worldToNDC")}));
}

INSTANTIATE_TEST_SUITE_P(ExrIntegrity, CameraOf, testing::Bool(), [](const auto& perspective) {
    return perspective.param ? "perspective" : "orthographic";
});

}  // namespace
}  // namespace peeler::test
