// SPDX-License-Identifier: Apache-2.0
// Tests peeler verify: breaks every rule once, in files that OpenEXR itself accepts.
#include <OpenEXR/ImfChannelList.h>
#include <OpenEXR/ImfFrameBuffer.h>
#include <OpenEXR/ImfInputPart.h>
#include <OpenEXR/ImfMultiPartInputFile.h>
#include <OpenEXR/ImfMultiPartOutputFile.h>
#include <OpenEXR/ImfOutputPart.h>
#include <OpenEXR/ImfTiledOutputFile.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <functional>
#include <limits>
#include <map>
#include <nlohmann/json.hpp>

#include "cmd/tiny_gltf.h"
#include "formats/exr/exr_integrity.h"
#include "formats/exr/exr_writers.h"
#include "formats/exr/synthetic_image.h"
#include "support/exr_headers.h"
#include "support/test_support.h"

namespace peeler::test {
namespace {

namespace fs = std::filesystem;

/// The channels of a part as floats, and their data window.
struct Planes {
    Imath::Box2i window;
    std::map<std::string, std::vector<float>> channels;

    float& at(const std::string& channel, int x, int y) {
        const int width = window.max.x - window.min.x + 1;
        return channels.at(
            channel)[static_cast<std::size_t>((y - window.min.y) * width + x - window.min.x)];
    }
};

/// Copies a file with OpenEXR's own classes, changing one part. The copy has no hash.
void rewrite(const std::string& from, const std::string& to, const std::string& part_name,
             const std::function<void(Planes&)>& change) {
    Imf::MultiPartInputFile in(from.c_str());
    std::vector<Imf::Header> headers;
    for (int part = 0; part < in.parts(); ++part)
        headers.push_back(without(in.header(part), kPixelHash));
    Imf::MultiPartOutputFile out(to.c_str(), headers.data(), in.parts());
    for (int part = 0; part < in.parts(); ++part) {
        Planes planes{headers[static_cast<std::size_t>(part)].dataWindow(), {}};
        const Imath::Box2i& window = planes.window;
        const auto pixels = static_cast<std::size_t>(window.max.x - window.min.x + 1) *
                            static_cast<std::size_t>(window.max.y - window.min.y + 1);
        Imf::FrameBuffer buffer;
        for (const char* name : {"R", "G", "B", "A", "Z"}) {
            auto& plane = planes.channels[name];
            plane.resize(pixels);
            buffer.insert(name, Imf::Slice::Make(Imf::FLOAT, plane.data(), window));
        }
        Imf::InputPart input(in, part);
        input.setFrameBuffer(buffer);
        input.readPixels(window.min.y, window.max.y);
        if (headers[static_cast<std::size_t>(part)].name() == part_name) change(planes);
        Imf::OutputPart output(out, part);
        output.setFrameBuffer(buffer);
        output.writePixels(window.max.y - window.min.y + 1);
    }
}

class VerifyCommand : public testing::Test {
  protected:
    std::string path(const std::string& name) const { return (scratch_ / name).string(); }

    std::string write(const std::string& name, const std::function<void(Provenance&)>& change = {},
                      const SyntheticPicture& picture = picture_) const {
        Provenance provenance;
        provenance.version = "test";
        provenance.scene_hash = "ab";
        provenance.settings_hash = "cd";
        if (change) change(provenance);
        ExrLdiWriter writer(path(name), {.provenance = provenance});
        writePicture(writer, picture);
        return path(name);
    }
    std::string writeFrame(int frame, const std::string& settings = "cd") const {
        return write("frame" + std::to_string(frame) + ".exr", [&](Provenance& provenance) {
            provenance.frame = frame;
            provenance.settings_hash = settings;
        });
    }
    /// Returns a copy of a good file with one part changed.
    std::string damaged(const std::string& part, const std::function<void(Planes&)>& change) {
        rewrite(write("good.exr"), path("bad.exr"), part, change);
        return path("bad.exr");
    }
    static Outcome verify(std::vector<std::string> arguments) {
        arguments.insert(arguments.begin(), "verify");
        return runPeeler(arguments);
    }
    static void expect(const std::string& file, int exit_code, const std::string& says) {
        const Outcome result = verify({file});
        EXPECT_EQ(result.exit_code, exit_code) << says << '\n' << result.out;
        EXPECT_NE(result.out.find(says), std::string::npos) << says << " not in\n" << result.out;
        EXPECT_EQ(std::count(result.out.begin(), result.out.end(), '\n'), 1) << result.out;
        EXPECT_EQ(result.err.find("peeler: error: ") == 0, exit_code != 0) << result.err;
    }
    /// Returns the first pixel in row order that has exactly this many fragments.
    static std::array<int, 2> pixelWith(std::uint32_t fragments) {
        const LayeredImage& image = picture_.image;
        for (int y = 0; y < image.window.y1; ++y) {
            for (int x = 0; x < image.window.x1; ++x) {
                if (image.count(image.pixelIndex(x, y)) == fragments) return {x, y};
            }
        }
        throw std::runtime_error("the synthetic picture has no such pixel");
    }
    static std::string at(const std::array<int, 2>& pixel) {
        return "(" + std::to_string(pixel[0]) + ", " + std::to_string(pixel[1]) + ")";
    }

    /// Float colours, since OpenEXR's classes would not convert them back to half.
    static inline const SyntheticPicture picture_ = makePicture({.color_type = PixelType::kFloat});
    ScratchDir scratch_;
};

constexpr float kInfinity = std::numeric_limits<float>::infinity();

TEST_F(VerifyCommand, GoodFiles) {
    expect(write("a.exr"), 0, "a.exr: good, 7 layers, ");
    // A copy of the same pixels by OpenEXR's own writer is good.
    const std::string copy = damaged("none", [](Planes&) {});
    expect(copy, 0, " fragments; without peeler:pixelHash\n");
    const Json json = Json::parse(verify({path("a.exr"), copy, "--json"}).out);
    EXPECT_EQ(json.at("files").at(0).at("proof"), "proven");
    EXPECT_EQ(json.at("files").at(1).at("proof"), "none");
    SyntheticOptions options;
    options.crop = {11, 7, 60, 50};
    expect(write("b.exr", {}, makePicture(options)), 0, "good, 7 layers");
    options.most_layers = 0;
    expect(write("c.exr", {}, makePicture(options)), 0, "good, 0 layers, 0 fragments");
    Provenance provenance;
    provenance.version = "test";
    ExrCompositeWriter writer(path("flat.exr"), {.provenance = provenance});
    writePicture(writer, picture_);
    expect(path("flat.exr"), 0, "good, without layers");
}

TEST_F(VerifyCommand, LayersOutOfOrder) {
    const auto pixel = pixelWith(3);
    expect(damaged("layer_001", [&](Planes& p) { p.at("Z", pixel[0], pixel[1]) = 1e-3F; }), 3,
           "the layers are not sorted by Z in 1 pixel, the first at " + at(pixel));
}

TEST_F(VerifyCommand, DepthsThatAreNone) {
    const auto pixel = pixelWith(1);
    expect(damaged("layer_000", [&](Planes& p) { p.at("Z", pixel[0], pixel[1]) = -kInfinity; }), 3,
           "a fragment's Z is not finite in 1 pixel, the first at " + at(pixel));
    expect(damaged("layer_000", [&](Planes& p) { p.at("Z", pixel[0], pixel[1]) = NAN; }), 3,
           "layer_000: Z is not a number in 1 pixel, the first at " + at(pixel));
}

TEST_F(VerifyCommand, ColourWithoutAFragment) {
    const auto pixel = pixelWith(0);
    expect(damaged("layer_000", [&](Planes& p) { p.at("G", pixel[0], pixel[1]) = 0.5F; }), 3,
           "layer_000: colour without a fragment in 1 pixel, the first at " + at(pixel));
}

TEST_F(VerifyCommand, ALayerWithoutTheOneBefore) {
    const auto pixel = pixelWith(3);
    const auto bad = damaged("layer_001", [&](Planes& p) {
        for (const char* name : {"R", "G", "B", "A"})
            p.at(name, pixel[0], pixel[1]) = 0;
        p.at("Z", pixel[0], pixel[1]) = kInfinity;
    });
    expect(bad, 3,
           "layer_002: fragment, but none in the previous layer in 1 pixel, the first at " +
               at(pixel));
    EXPECT_NE(verify({bad}).out.find("the header says"), std::string::npos);
}

TEST_F(VerifyCommand, ACompositeOfSomethingElse) {
    const auto pixel = pixelWith(2);
    const std::string says =
        "the composite does not match the layers in 1 pixel, the first at " + at(pixel);
    expect(damaged("composite", [&](Planes& p) { p.at("B", pixel[0], pixel[1]) += 0.0078125F; }), 3,
           says);
    expect(damaged("composite", [&](Planes& p) { p.at("Z", pixel[0], pixel[1]) *= 1.001F; }), 3,
           says);
}

TEST_F(VerifyCommand, HeadersThatDoNotAgree) {
    std::string bytes = bytesOf(write("a.exr"));
    const std::string count = std::to_string(picture_.plan.fragments_stored);
    std::string wrong = count;
    wrong.back() = wrong.back() == '9' ? '8' : static_cast<char>(wrong.back() + 1);
    // Changes the counts in all parts, since OpenEXR does not compare parts.
    for (const char* name : {"peeler:fragmentsStored", "peeler:fragmentsCounted"}) {
        for (std::size_t i = 0; (i = bytes.find(name, i)) != std::string::npos; ++i)
            bytes.replace(bytes.find(count, i), count.size(), wrong);
    }
    writeText(path("b.exr"), bytes);
    expect(path("b.exr"), 3, "the header says ");
}

TEST_F(VerifyCommand, IncompleteFiles) {
    SyntheticPicture picture = picture_;
    picture.plan.fragments_counted += 5;
    expect(write("a.exr", {}, picture), 6, "not complete: ");
    // With several files, verify returns the worst exit code.
    writeText(path("b.exr"), "no picture");
    EXPECT_EQ(verify({path("a.exr"), path("b.exr")}).exit_code, 3);
}

TEST_F(VerifyCommand, FilesCutOffOrDamaged) {
    const std::string bytes = bytesOf(write("a.exr"));
    for (const std::size_t size :
         {std::size_t{0}, std::size_t{100}, bytes.size() / 2, bytes.size() - 1}) {
        writeText(path("cut.exr"), bytes.substr(0, size));
        EXPECT_EQ(verify({path("cut.exr")}).exit_code, 3) << size;
    }
    std::string changed = bytes;  // changes a byte in the last chunk's packed pixels
    changed[changed.size() - 10] ^= 0x55;
    writeText(path("changed.exr"), changed);
    EXPECT_EQ(verify({path("changed.exr")}).exit_code, 3);
    expect(path("missing.exr"), 3, "does not exist");
}

TEST_F(VerifyCommand, FilesThatHaveChangedSinceTheyWereWritten) {
    const std::string bytes =
        bytesOf(write("a.exr", {}, makePicture({.width = 12, .height = 9, .most_layers = 2})));
    // Files with changed bits must not crash verify. (exr_integrity_test checks that every changed
    // bit is found.)
    for (std::size_t at = 0; at < bytes.size(); at += exhaustive() ? 1 : 29) {
        std::string changed = bytes;
        changed[at] = static_cast<char>(changed[at] ^ (1 << (at % 8)));
        writeText(path("changed.exr"), changed);
        const Json file =
            Json::parse(verify({path("changed.exr"), "--json"}).out).at("files").at(0);
        EXPECT_EQ(file.at("verdict"), "bad") << at;
        EXPECT_TRUE(file.at("proof") == "changed" || file.at("proof").is_null()) << at;
    }
    std::string changed = bytes;
    changed.back() ^= 1;
    writeText(path("changed.exr"), changed);
    expect(path("changed.exr"), 3,
           "the file has changed since peeler wrote it: " + path("changed.exr") + ": layer_001");
}

TEST_F(VerifyCommand, CamerasThatContradictThemselves) {
    rewrite(write("good.exr"), path("bad.exr"), "none", [](Planes&) {});
    std::string bytes = bytesOf(path("bad.exr"));
    const std::string name = std::string("worldToCamera") + '\0' + "m44f" + '\0';
    bytes[bytes.find(name) + name.size() + 4 + 3] ^= 1;  // changes an exponent
    writeText(path("bad.exr"), bytes);
    expect(path("bad.exr"), 3, "composite: worldToCamera contradicts peeler:cameraJson");
}

TEST_F(VerifyCommand, ASequence) {
    const std::vector<std::string> frames{writeFrame(1), writeFrame(3), writeFrame(5)};
    EXPECT_EQ(verify(frames).exit_code, 0);  // every second frame is a regular sequence
    const std::string seventh = writeFrame(9);
    const Outcome gap = verify({frames[0], frames[1], frames[2], seventh});
    EXPECT_EQ(gap.exit_code, 6);
    EXPECT_NE(gap.out.find("missing frames: 7\n"), std::string::npos) << gap.out;
    const std::string last = writeFrame(12);
    const Json json = Json::parse(verify({frames[0], last, frames[1], "--json"}).out);
    EXPECT_EQ(json.at("missingFrames"), (Json{2, 4, 5, 6, 7, 8, 9, 10, 11}));
    EXPECT_EQ(json.at("verdict"), "incomplete");
    EXPECT_EQ(json.at("files").at(1).at("frame"), 12);
    EXPECT_EQ(json.at("files").at(1).at("verdict"), "good");
}

TEST_F(VerifyCommand, OtherSettings) {
    const std::string a = writeFrame(1), b = writeFrame(2, "other");
    const Outcome result = verify({a, b});
    EXPECT_EQ(result.exit_code, 3);
    // The first file has no peeler:settings, so verify can only say that settings differ.
    EXPECT_NE(result.out.find("frame2.exr: differs from " + a +
                              " in other settings, which peeler test did not record\n"),
              std::string::npos)
        << result.out;
    EXPECT_EQ(verify({a, b, "--any-settings"}).exit_code, 0);
}

TEST_F(VerifyCommand, DifferencesAreToldInWords) {
    const auto writeWith = [&](const std::string& name, const std::string& settings,
                               const std::string& scene_hash = "ab",
                               const std::string& scene = "a.glb") {
        return write(name, [&](Provenance& provenance) {
            provenance.settings = settings;
            provenance.settings_hash = settings;
            provenance.scene = scene;
            provenance.scene_hash = scene_hash;
        });
    };
    const std::string plain = R"({"layers":0,"precision":"half"})";
    const std::string a = writeWith("a.exr", plain);
    const struct {
        std::string settings, says;
    } rows[] = {
        {R"({"layers":0,"precision":"half","channels":["normal","id"]})",
         "--channels: normal,id, not none"},
        {R"({"layers":3,"precision":"half"})", "--layers: 3, not all"},
        {R"({"layers":0,"precision":"float"})", "--precision: float, not half"},
        {R"({"layers":0,"precision":"half","samples":4})", "--samples: 4, not 1"},
        {R"({"layers":0,"precision":"half","shadows":2048})",
         "--shadows: maps of 2048 texels, not off"},
        {R"({"layers":0,"precision":"half","environment":"0123456789abcdef"})",
         "--environment: given, not none"},
        {R"({"layers":0,"precision":"half","somethingNew":[1,[2]]})",
         "--something-new: 1,[2], not none"},
    };
    for (const auto& row : rows) {
        const Outcome result = verify({a, writeWith("b.exr", row.settings)});
        EXPECT_EQ(result.exit_code, 3);
        EXPECT_NE(result.out.find("b.exr: differs from " + a + " in " + row.says + '\n'),
                  std::string::npos)
            << row.says << '\n'
            << result.out;
    }
    const std::string sky = R"({"environment":"0123456789abcdef"})";
    std::string other_sky = sky;
    other_sky[20] = '7';
    const Outcome skies = verify({writeWith("c.exr", sky), writeWith("d.exr", other_sky)});
    EXPECT_NE(skies.out.find(" in --environment, another file\n"), std::string::npos) << skies.out;
    EXPECT_EQ(skies.out.find("abcdef"), std::string::npos) << skies.out;
    // Settings that are not a JSON object, or are nested too deeply, must not cause a crash.
    for (const std::string& text : {std::string("["), std::string(100000, '['), std::string("7")}) {
        const Outcome broken = verify({a, writeWith("b.exr", text)});
        EXPECT_EQ(broken.exit_code, 3);
        EXPECT_NE(broken.out.find("did not record"), std::string::npos) << broken.out;
    }
    const std::string deep =
        R"({"clip":)" + std::string(100000, '[') + std::string(100000, ']') + "}";
    EXPECT_EQ(verify({a, writeWith("b.exr", deep)}).exit_code, 3);

    const Outcome changed = verify({a, writeWith("b.exr", plain, "ac")});
    EXPECT_NE(changed.out.find(" in the scene a.glb, which has changed since\n"), std::string::npos)
        << changed.out;
    const Outcome another = verify({a, writeWith("b.exr", plain, "ac", "b.glb")});
    EXPECT_NE(another.out.find(" in the scene: b.glb, not a.glb\n"), std::string::npos)
        << another.out;
}

TEST_F(VerifyCommand, FilesOfOthersAreReadToTheirEnd) {
    Imf::Header header(200, 150);
    header.channels().insert("R", Imf::Channel(Imf::FLOAT));
    header.setTileDescription(Imf::TileDescription(32, 32, Imf::MIPMAP_LEVELS));
    {
        std::vector<float> red(200 * 150);
        for (std::size_t i = 0; i < red.size(); ++i)
            red[i] = static_cast<float>(i % 97);
        Imf::FrameBuffer buffer;
        buffer.insert("R", Imf::Slice(Imf::FLOAT, reinterpret_cast<char*>(red.data()), 4, 800));
        Imf::TiledOutputFile file(path("tiled.exr").c_str(), header);
        file.setFrameBuffer(buffer);
        for (int level = 0; level < file.numLevels(); ++level)
            file.writeTiles(0, file.numXTiles(level) - 1, 0, file.numYTiles(level) - 1, level);
    }
    expect(path("tiled.exr"), 0, "readable; not written by peeler");
    std::string bytes = bytesOf(path("tiled.exr"));
    // Damages the size of the last tile's pixels at the smallest level (1 x 1: 4 bytes,
    // uncompressed).
    bytes[bytes.size() - 8] = 99;
    writeText(path("damaged.exr"), bytes);
    expect(path("damaged.exr"), 3, "OpenEXR cannot read the file");
}

}  // namespace
}  // namespace peeler::test
