// SPDX-License-Identifier: Apache-2.0
// Tests --channels, --cryptomatte and --manifest: the files written, and errors.
#include <gtest/gtest.h>

#include <OpenEXR/ImfChannelList.h>
#include <OpenEXR/ImfFrameBuffer.h>
#include <OpenEXR/ImfHeader.h>
#include <OpenEXR/ImfInputPart.h>
#include <OpenEXR/ImfMultiPartInputFile.h>
#include <OpenEXR/ImfStringAttribute.h>

#include <algorithm>
#include <bit>
#include <fstream>
#include <functional>
#include <map>
#include <nlohmann/json.hpp>
#include <string_view>

#include <peeler/channels.h>
#include "formats/exr/cryptomatte.h"
#include "formats/layered/opened_picture.h"
#include "support/test_support.h"

namespace peeler::test {
namespace {

constexpr int kEngineWidth = 96, kEngineHeight = 54;

class ChannelsCli : public testing::Test {
  protected:
    Outcome render(const std::string& output, const std::vector<std::string>& options,
                   const std::filesystem::path& scene = sourceDir() /
                                                        "examples/scenes/engine.glb") {
        std::vector<std::string> command{
            "render", scene.string(),
            "-o",     folder_ / output,
            "--size", std::to_string(kEngineWidth) + "x" + std::to_string(kEngineHeight)};
        command.insert(command.end(), options.begin(), options.end());
        return runPeeler(command);
    }

    LayeredImage read(const std::string& name) {
        const auto input = openLayered(folder_ / name);
        LayeredImage image;
        input->read(input->info().plan.view.crop, image);
        return image;
    }

    /// Returns the bits of a channel of the first part, which must cover the picture.
    std::vector<std::uint32_t> composite(const std::string& name, const char* channel,
                                         Imf::PixelType type) {
        Imf::MultiPartInputFile file((folder_ / name).c_str());
        Imf::InputPart part(file, 0);
        std::vector<std::uint32_t> values(static_cast<std::size_t>(kEngineWidth) * kEngineHeight);
        Imf::FrameBuffer buffer;
        buffer.insert(channel, Imf::Slice(type, reinterpret_cast<char*>(values.data()), 4,
                                          4 * static_cast<std::size_t>(kEngineWidth)));
        part.setFrameBuffer(buffer);
        part.readPixels(0, kEngineHeight - 1);
        return values;
    }

    ScratchDir folder_;
};

const FragmentArray& arrayOf(const LayeredImage& image, std::string_view channel) {
    const auto found = std::find_if(image.extra.begin(), image.extra.end(), [&](const auto& array) {
        return std::find(array.channels.begin(), array.channels.end(), channel) !=
               array.channels.end();
    });
    if (found == image.extra.end()) throw std::runtime_error("no channel " + std::string(channel));
    return *found;
}

TEST_F(ChannelsCli, StandInEveryLayerAfterColourAndZ) {
    const auto result = render("all.exr", {"--channels", "all"});
    ASSERT_EQ(result.exit_code, 0) << result.err;
    Imf::MultiPartInputFile file((folder_ / "all.exr").c_str());
    std::vector<std::string> wanted{"R", "G", "B", "A", "Z"};
    for (const ChannelInfo& info : channelTable())
        wanted.insert(wanted.end(), info.components.begin(), info.components.end());
    std::sort(wanted.begin(), wanted.end());
    ASSERT_GT(file.parts(), 2);
    for (int part = 1; part < file.parts(); ++part) {
        std::vector<std::string> found;
        const Imf::ChannelList& channels = file.header(part).channels();
        for (auto i = channels.begin(); i != channels.end(); ++i)
            found.emplace_back(i.name());
        EXPECT_EQ(found, wanted);
        EXPECT_EQ(channels["P.X"].type, Imf::FLOAT);
        EXPECT_EQ(channels["N.X"].type, Imf::HALF);
        EXPECT_EQ(channels["id.object"].type, Imf::UINT);
    }
    // The rest of the file must be the same without these channels.
    ASSERT_EQ(render("plain.exr", {}).exit_code, 0);
    LayeredImage all = read("all.exr");
    const LayeredImage plain = read("plain.exr");
    EXPECT_EQ(all.z, plain.z);
    EXPECT_EQ(all.color.data, plain.color.data);
}

TEST_F(ChannelsCli, PrecisionIsThatOfTheColours) {
    ASSERT_EQ(render("f.exr", {"--channels", "normal", "--precision", "float"}).exit_code, 0);
    EXPECT_EQ(arrayOf(read("f.exr"), "N.X").type, PixelType::kFloat);
}

TEST_F(ChannelsCli, ACompositeHasThoseOfTheFirstFragment) {
    ASSERT_EQ(render("layers.exr", {"--channels", "position,id"}).exit_code, 0);
    ASSERT_EQ(render("flat.exr", {"--channels", "id,position", "--as", "composite"}).exit_code, 0);
    ASSERT_EQ(render("plain.exr", {"--as", "composite"}).exit_code, 0);
    const LayeredImage image = read("layers.exr");
    const auto& position = arrayOf(image, "P.Y");
    const auto& ids = arrayOf(image, "id.object");
    const auto component = [](const FragmentArray& array, const std::string& name) {
        return static_cast<std::size_t>(
            std::find(array.channels.begin(), array.channels.end(), name) - array.channels.begin());
    };
    const auto y = composite("flat.exr", "P.Y", Imf::FLOAT);
    const auto object = composite("flat.exr", "id.object", Imf::UINT);
    std::size_t hits = 0;
    for (std::size_t p = 0; p < y.size(); ++p) {
        if (image.count(p) == 0) {
            ASSERT_EQ(y[p], 0U);
            ASSERT_EQ(object[p], 0U);
            continue;
        }
        ++hits;
        const std::size_t f = image.offsets[p];
        ASSERT_EQ(std::bit_cast<float>(y[p]),
                  position.as<float>()[f * position.components() + component(position, "P.Y")]);
        ASSERT_EQ(object[p],
                  ids.as<std::uint32_t>()[f * ids.components() + component(ids, "id.object")]);
    }
    EXPECT_GT(hits, 500U);
    for (const char* channel : {"R", "A"})
        EXPECT_EQ(composite("flat.exr", channel, Imf::HALF),
                  composite("plain.exr", channel, Imf::HALF));
}

/// Returns the number of fragments for each ID in a channel.
std::map<std::uint32_t, std::size_t> counts(const LayeredImage& image, const std::string& channel) {
    const FragmentArray& array = arrayOf(image, channel);
    const auto c = static_cast<std::size_t>(
        std::find(array.channels.begin(), array.channels.end(), channel) - array.channels.begin());
    std::map<std::uint32_t, std::size_t> result;
    for (std::size_t f = 0; f < image.fragments(); ++f)
        ++result[array.as<std::uint32_t>()[f * array.components() + c]];
    return result;
}

/// Checks the names in an ID manifest: each node, rendered alone by its name, must have as many
/// fragments as its ID has in the whole picture.
void checkNames(const std::function<Outcome(const std::string&, std::vector<std::string>)>& render,
                const std::function<LayeredImage(const std::string&)>& read,
                const std::filesystem::path& manifest_path, std::size_t most) {
    const auto all = render("ids.exr", {"--channels", "id", "--manifest", manifest_path.string()});
    ASSERT_EQ(all.exit_code, 0) << all.err;
    const auto manifest = nlohmann::json::parse(std::ifstream(manifest_path));
    std::map<std::string, int> uses;
    for (const auto& entry : manifest.at("object"))
        ++uses[entry.at("name").get<std::string>()];
    const auto ids = openLayered(manifest_path.parent_path() / "ids.exr")->info().provenance.ids;
    std::size_t checked = 0;
    for (const auto& [id, fragments] : counts(read("ids.exr"), "id.object")) {
        const std::string name = manifest.at("object").at(id - 1).at("name");
        ASSERT_EQ(manifest.at("object").at(id - 1).at("id"), id);
        ASSERT_EQ(ids.objects.at(id - 1), name) << "OpenEXR's manifest in the file";
        if (uses[name] > 1 || name.find_first_of("*?[") != std::string::npos || checked >= most)
            continue;
        const auto alone = render("alone.exr", {"--channels", "id", "--include", name});
        ASSERT_EQ(alone.exit_code, 0) << alone.err;
        EXPECT_EQ(counts(read("alone.exr"), "id.object")[id], fragments) << name;
        ++checked;
    }
    EXPECT_GE(checked, std::min<std::size_t>(most, 3));
}

TEST_F(ChannelsCli, IdsAreThoseOfTheirNames) {
    checkNames([&](const std::string& output,
                   std::vector<std::string> options) { return render(output, options); },
               [&](const std::string& name) { return read(name); }, folder_ / "ids.json", 6);
}

TEST_F(ChannelsCli, IdsAreThoseOfTheirNamesInARealModel) {
    PEELER_REQUIRE_ASSETS(assets);
    const auto model = assets / "gltf-sample-assets/2CylinderEngine/glTF/2CylinderEngine.gltf";
    checkNames(
        [&](const std::string& output, std::vector<std::string> options) {
            options.insert(options.end(), {"--camera", "0"});
            return render(output, options, model);
        },
        [&](const std::string& name) { return read(name); }, folder_ / "ids.json", 5);
}

TEST_F(ChannelsCli, CryptomatteCoversWhatAlphaCovers) {
    const auto result = render("crypto.exr", {"--cryptomatte", "--surfaces", "visible"});
    ASSERT_EQ(result.exit_code, 0) << result.err;
    const auto alpha = composite("crypto.exr", "A", Imf::FLOAT);
    const IdNames names = openLayered(folder_ / "crypto.exr")->info().provenance.ids;
    for (const CryptomatteLayer& layer : cryptomatteLayers(names)) {
        std::vector<float> sum(alpha.size(), 0);
        std::map<std::uint32_t, std::string> known;
        for (const std::string& name : layer.names)
            known[cryptomatteHash(name)] = name;
        for (const char* rank : {"00", "01", "02"}) {
            for (const auto& [hash, coverage] : {std::pair{".R", ".G"}, std::pair{".B", ".A"}}) {
                const auto hashes =
                    composite("crypto.exr", (layer.name + rank + hash).c_str(), Imf::FLOAT);
                const auto covers =
                    composite("crypto.exr", (layer.name + rank + coverage).c_str(), Imf::FLOAT);
                for (std::size_t p = 0; p < alpha.size(); ++p) {
                    if (covers[p] != 0) {
                        ASSERT_TRUE(known.contains(hashes[p]));
                    }
                    sum[p] += std::bit_cast<float>(covers[p]);
                }
            }
        }
        for (std::size_t p = 0; p < alpha.size(); ++p)
            ASSERT_NEAR(sum[p], std::bit_cast<float>(alpha[p]), 2e-3);
    }
}

TEST_F(ChannelsCli, AStillSceneDoesNotMoveAndAMovingOneDoes) {
    ASSERT_EQ(render("still.exr", {"--channels", "motion"}).exit_code, 0);
    const LayeredImage still = read("still.exr");
    for (const float value : arrayOf(still, "motion.X").as<float>())
        ASSERT_EQ(value, 0);
    const auto jellyfish = sourceDir() / "examples/scenes/jellyfish.glb";
    const auto fastest = [&](const std::string& name) {
        float most = 0;
        const LayeredImage image = read(name);
        for (const float value : arrayOf(image, "motion.X").as<float>())
            most = std::max(most, std::abs(value));
        return most;
    };
    // Half the frame rate roughly doubles the motion. Frame 24 at 24 frames per second is the time
    // 1 s.
    ASSERT_EQ(render("a.exr", {"--channels", "motion", "--time", "1"}, jellyfish).exit_code, 0);
    ASSERT_EQ(render("b.exr", {"--channels", "motion", "--time", "1", "--fps", "12"}, jellyfish)
                  .exit_code,
              0);
    ASSERT_EQ(render("c.####.exr", {"--channels", "motion", "--frames", "24"}, jellyfish).exit_code,
              0);
    EXPECT_GT(fastest("a.exr"), 0.05);
    EXPECT_NEAR(fastest("b.exr") / fastest("a.exr"), 2, 0.3);
    EXPECT_EQ(read("c.0024.exr").extra[0].data, read("a.exr").extra[0].data);
}

TEST_F(ChannelsCli, CryptomatteOfADeepImageIsBesideIt) {
    ASSERT_EQ(render("deep.exr", {"--as", "deep", "--cryptomatte"}).exit_code, 0);
    ASSERT_EQ(render("flat.exr", {"--as", "composite", "--cryptomatte"}).exit_code, 0);
    ASSERT_EQ(render("ldi.exr", {"--cryptomatte"}).exit_code, 0);
    const auto same = [&](const std::string& a, const std::string& b) {
        return runPeeler({"compare", folder_ / a, folder_ / b}).exit_code == 0;
    };
    const auto run = [&](std::vector<std::string> arguments) {
        const Outcome result = runPeeler(arguments);
        EXPECT_EQ(result.exit_code, 0) << result.err;
        return result;
    };
    EXPECT_TRUE(same("deep.exr", "ldi.exr"));
    EXPECT_TRUE(same("deep.cryptomatte.exr", "flat.exr"));
    const std::string info = run({"info", folder_ / "deep.cryptomatte.exr", "--json"}).out;
    EXPECT_NE(info.find("CryptoMaterial00.R"), std::string::npos);
    // A conversion without --cryptomatte warns that the output lacks the Cryptomatte.
    const std::string in = folder_ / "ldi.exr", out = folder_ / "converted.exr";
    const Outcome lossy = run({"convert", in, "-o", out, "--as", "deep"});
    EXPECT_NE(lossy.err.find("lacks the Cryptomatte of the input"), std::string::npos) << lossy.err;
    EXPECT_EQ(runPeeler({"convert", in, "-o", out, "--as", "deep", "--strict"}).exit_code, 3);
    run({"convert", in, "-o", out, "--as", "deep", "--cryptomatte"});
    EXPECT_TRUE(same("converted.exr", "deep.exr"));
    EXPECT_TRUE(same("converted.cryptomatte.exr", "flat.exr"));
    // --skip-existing requires both files.
    const std::vector<std::string> again{"--as", "deep", "--cryptomatte", "--skip-existing"};
    EXPECT_NE(render("deep.exr", again).err.find("already exists"), std::string::npos);
    std::filesystem::remove(folder_ / "deep.cryptomatte.exr");
    EXPECT_NE(render("deep.exr", again).err.find("is missing"), std::string::npos);
    EXPECT_TRUE(std::filesystem::exists(folder_ / "deep.cryptomatte.exr"));
}

TEST_F(ChannelsCli, RefusesWhatCannotBe) {
    struct Case {
        std::string output;
        std::vector<std::string> options;
        std::string said;
    };
    const std::vector<Case> cases{
        {"a.exr", {"--channels", "normals"}, "did you mean 'normal'?"},
        {"a.exr", {"--channels", "id,,uv"}, "channel"},
        {"a.png", {"--channels", "id"}, "cannot store channels"},
        {"a.png", {"--cryptomatte"}, "cannot store channels"},
        {"a.exr", {"--cryptomatte", "--no-composite"}, "needs a composite"},
        {"a.exr", {"--manifest", "x.json"}, "no ids"},
        {"a.exr", {"--channels", "id", "--manifest", folder_ / "a.exr"}, "would replace"},
        {"a.exr", {"--channels", "id", "--manifest", "/dev/null/x.json"}, "/dev/null"},
        {"a.exr", {"--channels", "id", "--as", "composite", "--fxaa"}, "--fxaa"},
        {"a.exr", {"--channels", "id", "--as", "composite", "--method", "unsorted"}, "unsorted"},
        {"a.exr", {"--channels", "id", "--as", "midpoint-depth"}, "cannot store channels"},
    };
    for (const Case& row : cases) {
        const auto result = render(row.output, row.options);
        EXPECT_EQ(result.exit_code, row.said == "/dev/null" ? 4 : 2) << row.said;
        EXPECT_NE(result.err.find(row.said), std::string::npos) << result.err;
        EXPECT_FALSE(std::filesystem::exists(folder_ / row.output));
    }
}

}  // namespace
}  // namespace peeler::test
