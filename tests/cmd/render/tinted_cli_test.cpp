// SPDX-License-Identifier: Apache-2.0
// Tests coloured glass on the command line: AR, AG, AB in every kind of file, and the verbs that
// read them.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include <peeler/composite.h>
#include "cmd/tiny_gltf.h"
#include "formats/exr/exr_readers.h"
#include "formats/image/flat_image.h"
#include "formats/layered/opened_picture.h"
#include "support/python.h"
#include "support/test_support.h"

namespace peeler::test {
namespace {

class TintedFiles : public testing::Test {
  protected:
    std::string at(const std::string& name) const { return (scratch_ / name).string(); }
    Outcome run(std::vector<std::string> arguments) const {
        arguments.emplace_back("--quiet");
        Outcome result = runPeeler(arguments);
        EXPECT_EQ(result.exit_code, 0) << arguments.front() << ": " << result.err;
        return result;
    }
    void render(const std::string& name, const std::vector<std::string>& more = {}) const {
        std::vector<std::string> arguments{"render",   scene_.string(), "-o",     at(name),
                                           "--camera", "front",         "--size", "40x30"};
        arguments.insert(arguments.end(), more.begin(), more.end());
        run(arguments);
    }
    static LayeredImage read(const std::string& path, CompositeImage* composite = nullptr) {
        const auto input = openLayered(path);
        LayeredImage image;
        input->read(input->info().plan.view.crop, image);
        EXPECT_EQ(image.tinted(), input->info().plan.tinted) << path;
        if (composite) input->readComposite(input->info().plan.view.crop, *composite);
        return image;
    }

    ScratchDir scratch_;
    std::filesystem::path scene_ = writeScene(scratch_.path(), tintedPanes());
};

TEST_F(TintedFiles, HaveTheOpacityOfEveryChannelBesideAlpha) {
    render("a.exr");
    CompositeImage stored, made;
    const LayeredImage image = read(at("a.exr"), &stored);
    ASSERT_TRUE(image.tinted());
    const std::size_t middle = image.pixelIndex(20, 16);
    ASSERT_EQ(image.count(middle), 4U);
    const std::size_t first = image.offsets[middle];
    EXPECT_EQ(tintedColorOf(image, first)[5], 0.75F);  // red glass absorbs 0.75 of green
    EXPECT_EQ(tintedColorOf(image, first + 3), tinted({1, 1, 1, 1}));
    ASSERT_TRUE(stored.tinted());
    EXPECT_EQ(stored.colorAt(middle), (TintedColor{0.125F, 0.125F, 0.25F, 1, 1, 1, 1}));
    compositeOver(image, {}, made);
    EXPECT_EQ(made.rgba.size(), stored.rgba.size());
    EXPECT_EQ(run({"verify", at("a.exr")}).exit_code, 0);
    // At the side of the wall, only the red pane is visible, with nothing behind it.
    EXPECT_EQ(stored.colorAt(0), (TintedColor{0, 0, 0, stored.rgba[0][3], 0, 0.75F, 0.5F}));
    EXPECT_NEAR(stored.rgba[0][3], 1.25 / 3, 1e-3);
    EXPECT_NE(runPeeler({"info", at("a.exr")}).out.find("A half AB half AG half AR half B half"),
              std::string::npos);
}

TEST_F(TintedFiles, AreThereOnlyIfGlassIsColouredAndWanted) {
    render("alpha.exr", {"--transmission", "alpha"});
    EXPECT_FALSE(read(at("alpha.exr")).tinted());
    render("opaque.exr", {"--transmission", "opaque"});
    EXPECT_FALSE(read(at("opaque.exr")).tinted());
    render("without.exr", {"--include", "pane 3"});
    EXPECT_FALSE(read(at("without.exr")).tinted());
    const auto hash = [&](const std::string& name) {
        return openLayered(at(name))->info().provenance.settings_hash;
    };
    render("color.exr");
    EXPECT_NE(hash("color.exr"), hash("alpha.exr"));
    // Without coloured opacity, both kinds of transmission give the same bytes.
    render("other.exr", {"--include", "pane 3", "--transmission", "alpha"});
    EXPECT_EQ(hash("without.exr"), hash("other.exr"));
    const std::string example = (sourceDir() / "examples/scenes/glasses.glb").string();
    for (const char* how : {"color", "alpha"}) {
        run({"render", example, "-o", at(std::string(how) + ".glasses.exr"), "--size", "48x27",
             "--transmission", how});
    }
    EXPECT_TRUE(bytesOf(at("color.glasses.exr")) == bytesOf(at("alpha.glasses.exr")));
}

TEST_F(TintedFiles, TurnIntoEachOtherByteForByte) {
    for (const char* precision : {"half", "float"}) {
        render("ldi.exr", {"--precision", precision});
        render("deep.exr", {"--precision", precision, "--as", "deep", "--channels", "id"});
        render("plain-deep.exr", {"--precision", precision, "--as", "deep"});
        run({"convert", at("ldi.exr"), "-o", at("to-deep.exr"), "--as", "deep"});
        EXPECT_TRUE(bytesOf(at("to-deep.exr")) == bytesOf(at("plain-deep.exr")));
        for (const char* layout : {"plain", "nuke", "single-part", "per-file"}) {
            run({"convert", at("plain-deep.exr"), "-o", at("layout.exr"), "--as", "ldi", "--layout",
                 layout});
            run({"convert", at("layout.exr"), "-o", at("back.exr"), "--as", "ldi"});
            EXPECT_TRUE(bytesOf(at("back.exr")) == bytesOf(at("ldi.exr"))) << layout;
            EXPECT_EQ(runPeeler({"compare", at("layout.exr"), at("deep.exr")}).exit_code, 0);
            EXPECT_EQ(runPeeler({"verify", at("layout.exr")}).exit_code, 0) << layout;
        }
        run({"flatten", at("ldi.exr"), "-o", at("flat.exr")});
        run({"flatten", at("deep.exr"), "-o", at("deep-flat.exr")});
        render("composite.exr", {"--precision", precision, "--as", "composite"});
        CompositeImage stored;
        read(at("ldi.exr"), &stored);
        for (const char* flat : {"flat.exr", "deep-flat.exr", "composite.exr"}) {
            CompositeImage composite;
            openComposite(OpenedPicture(at(flat)))->readComposite(stored.window, composite);
            EXPECT_EQ(composite.rgba, stored.rgba) << flat;
            EXPECT_EQ(composite.opacity, stored.opacity) << flat;
        }
    }
}

TEST_F(TintedFiles, OfTilesAreThoseOfTheWhole) {
    render("whole.exr");
    render("1.exr", {"--tile", "1/2"});
    render("2.exr", {"--tile", "2/2"});
    run({"merge", at("1.exr"), at("2.exr"), "-o", at("merged.exr")});
    run({"compare", at("merged.exr"), at("whole.exr"), "--max-color", "0"});
    render("plain.exr", {"--tile", "2/2", "--transmission", "alpha"});
    const Outcome refused =
        runPeeler({"merge", at("1.exr"), at("plain.exr"), "-o", at("merged.exr")});
    EXPECT_EQ(refused.exit_code, 3);
    EXPECT_TRUE(contains(refused.err, "--transmission color")) << refused.err;
}

TEST_F(TintedFiles, AreElementsBesideThoseWithOneAlpha) {
    render("whole.exr");
    render("glass.exr", {"--exclude", "pane 3"});
    render("wall.exr", {"--include", "pane 3"});
    ASSERT_FALSE(read(at("wall.exr")).tinted());
    for (const auto& [first, second] :
         {std::pair("glass.exr", "wall.exr"), {"wall.exr", "glass.exr"}}) {
        run({"merge", at(first), at(second), "-o", at("merged.exr"), "--elements"});
        EXPECT_TRUE(read(at("merged.exr")).tinted());
        run({"compare", at("merged.exr"), at("whole.exr"), "--max-color", "0"});
    }
}

TEST_F(TintedFiles, TintTheBackgroundOfPictures) {
    render("flat.png", {"--background", "#ffffff", "--samples", "1"});
    const FlatImage picture = readFlatImage(at("flat.png"));
    const auto& corner = picture.image.rgba[0];
    EXPECT_NEAR(corner[0], 1, 5e-3);
    EXPECT_NEAR(corner[1], 0.25, 5e-3);
    EXPECT_NEAR(corner[2], 0.5, 5e-3);
    // Pictures made from layers, also by view and sheet, must look the same.
    render("layers.exr");
    run({"flatten", at("layers.exr"), "-o", at("again.png"), "--background", "#ffffff"});
    const auto same = [&](const std::string& other) {
        const FlatImage found = readFlatImage(at(other));
        for (std::size_t p = 0; p < found.image.rgba.size(); ++p)
            for (std::size_t c = 0; c < 4; ++c)
                EXPECT_NEAR(found.image.rgba[p][c], picture.image.rgba[p][c], 6e-3) << other << p;
    };
    same("again.png");
    run({"view", at("layers.exr"), "-o", at("view.png"), "--orbit", "0,0", "--background",
         "#ffffff"});
    const FlatImage view = readFlatImage(at("view.png"));
    for (const std::size_t p : {0UL, 41UL, 16 * 40 + 20UL})
        for (std::size_t c = 0; c < 4; ++c)
            EXPECT_NEAR(view.image.rgba[p][c], picture.image.rgba[p][c], 0.02) << p;
    run({"sheet", at("layers.exr"), "-o", at("sheet.png"), "--background", "#ffffff"});
    const FlatImage sheet = readFlatImage(at("sheet.png"));
    int red = 0;  // number of pixels that show the red pane over white
    for (const auto& rgba : sheet.image.rgba)
        red += rgba[0] > 0.99F && std::abs(rgba[1] - 0.25F) < 0.01F ? 1 : 0;
    EXPECT_GT(red, 100);
}

TEST_F(TintedFiles, AreOtherProgramsToo) {
    PEELER_REQUIRE_PYTHON("OpenImageIO")
    PEELER_REQUIRE_PYTHON("numpy")
    render("layers.exr", {"--precision", "float"});
    render("deep.exr", {"--precision", "float", "--as", "deep"});
    run({"extract", at("layers.exr"), "--npz", at("a.npz")});
    const Outcome found = runPython(R"(
import sys, numpy, OpenImageIO as oiio
layers, deep, arrays = sys.argv[1:]
source = oiio.ImageInput.open(layers)
def part(index):
    spec = source.spec(index)
    pixels = source.read_image(index, 0, 0, spec.nchannels, oiio.FLOAT)
    whole = numpy.zeros((spec.full_height, spec.full_width, spec.nchannels), numpy.float32)
    whole[spec.y:spec.y + spec.height, spec.x:spec.x + spec.width] = pixels.reshape(spec.height, spec.width, -1)
    return {name: whole[..., i] for i, name in enumerate(spec.channelnames)}
composite, light, through = part(0), {c: 0 for c in 'RGB'}, {c: 1 for c in 'RGB'}
for index in range(1, 5):
    layer = part(index)
    for c in 'RGB':
        light[c] = light[c] + through[c] * layer[c]
        through[c] = through[c] * (1 - layer['A' + c])
for c in 'RGB':
    assert numpy.array_equal(light[c], composite[c]), c
    assert numpy.array_equal(1 - through[c], composite['A' + c]), c
mean = (composite['AR'] + composite['AG'] + composite['AB']) / 3
assert numpy.abs(mean - composite['A']).max() < 1e-6
# OpenImageIO flattens deep images by AR, AG and AB, too, but adds these up by their mean: so it
# has the same light where a pixel has two samples at most.
flat = oiio.ImageBufAlgo.flatten(oiio.ImageBuf(deep, 0, 0))
names, pixels, spec = flat.spec().channelnames, flat.get_pixels(oiio.FLOAT), flat.spec()
place = numpy.s_[spec.y:spec.y + spec.height, spec.x:spec.x + spec.width]
few = part(3)['A'][place] == 0
assert few.sum() > 100 and (~few).sum() > 10
for c in 'RGB':
    assert numpy.abs(pixels[..., names.index(c)] - composite[c][place])[few].max() < 1e-6, c
a = numpy.load(arrays)
assert a['rgba'].shape[1] == 4 and a['opacity'].shape == (len(a['z']), 3)
assert numpy.abs(a['opacity'].mean(1) - a['rgba'][:, 3]).max() < 1e-6
print('good')
)",
                                    {at("layers.exr"), at("deep.exr"), at("a.npz")});
    EXPECT_TRUE(contains(found.out, "good")) << found.out << found.err;
}

TEST_F(TintedFiles, PagesHaveTheOpacities) {
    render("layers.exr");
    run({"view", at("layers.exr"), "-o", at("page.html")});
    EXPECT_TRUE(contains(bytesOf(at("page.html")), "\"tinted\":true"));
    render("alpha.exr", {"--transmission", "alpha"});
    run({"view", at("alpha.exr"), "-o", at("page.html")});
    EXPECT_FALSE(contains(bytesOf(at("page.html")), "\"tinted\":true"));
}

}  // namespace
}  // namespace peeler::test
