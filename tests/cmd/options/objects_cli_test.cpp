// SPDX-License-Identifier: Apache-2.0
// Tests that choosing objects in a layered file gives the same picture as rendering only those
// objects.
#include <OpenImageIO/imagebuf.h>
#include <OpenImageIO/imagebufalgo.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <iterator>
#include <nlohmann/json.hpp>
#include <sstream>
#include <tuple>

#include <peeler/error.h>
#include "cmd/cli/console.h"
#include "cmd/options/object_options.h"
#include "cmd/tiny_gltf.h"
#include "support/test_support.h"

namespace peeler::test {
namespace {

namespace fs = std::filesystem;
using cmd::ObjectOptions;
using cmd::openChosen;

/// The compared data of a fragment: depth, IDs and the bits of its colour.
using Fragment = std::tuple<float, std::uint32_t, std::uint32_t, std::vector<std::byte>>;

std::vector<std::vector<Fragment>> fragmentsOf(const std::string& path,
                                               const ObjectOptions& options) {
    std::ostringstream out, err;
    cmd::Console console(out, err, false);
    const auto input = openChosen(path, {}, options, console);
    LayeredImage image;
    input->read(input->info().plan.view.crop, image);
    EXPECT_EQ(input->info().plan.fragments_stored, image.fragments());
    const FragmentChannel objects = findIds(image, "id.object");
    const FragmentChannel materials = findIds(image, "id.material");
    std::vector<std::vector<Fragment>> pixels(image.window.pixels());
    std::size_t deepest = 0;
    for (std::size_t p = 0; p < pixels.size(); ++p) {
        for (std::size_t f = image.offsets[p]; f < image.offsets[p + 1]; ++f) {
            const auto first =
                image.color.data.begin() + static_cast<std::ptrdiff_t>(f * image.color.stride());
            pixels[p].emplace_back(
                image.z[f], objects.id(f), materials.id(f),
                std::vector(first, first + static_cast<std::ptrdiff_t>(image.color.stride())));
        }
        deepest = std::max(deepest, pixels[p].size());
    }
    EXPECT_EQ(input->info().plan.layers.size(), deepest);
    return pixels;
}

class Objects : public testing::Test {
  protected:
    std::string at(const std::string& name) const { return (scratch_ / name).string(); }

    static void run(std::vector<std::string> arguments) {
        arguments.emplace_back("--quiet");
        const Outcome result = runPeeler(arguments);
        ASSERT_EQ(result.exit_code, 0) << arguments.front() << ": " << result.err;
    }
    std::string render(const std::string& name, std::vector<std::string> more,
                       const std::string& scene = "engine") const {
        const fs::path path = sourceDir() / "examples/scenes" / (scene + ".glb");
        more.insert(more.begin(), {"render", path.string(), "-o", at(name), "--size", "120x68"});
        run(more);
        return at(name);
    }
    static void expectEqual(const std::string& a, const std::string& b) {
        const Outcome result = runPeeler({"compare", a, b, "--json", "--quiet"});
        EXPECT_EQ(result.exit_code, 0) << a << ' ' << b << '\n' << result.out << result.err;
        EXPECT_TRUE(Json::parse(result.out).at("identical").get<bool>()) << a << ' ' << b;
    }
    static void expectSamePixels(const std::string& a, const std::string& b) {
        const OIIO::ImageBuf one(a), other(b);
        EXPECT_EQ(OIIO::ImageBufAlgo::compare(one, other, 0, 0).maxerror, 0) << a << ' ' << b;
        EXPECT_GT(one.spec().image_pixels(), 100U);
    }
    static void expectRefused(const std::vector<std::string>& arguments, int code,
                              const std::string& says) {
        const Outcome result = runPeeler(arguments);
        EXPECT_EQ(result.exit_code, code) << result.err;
        EXPECT_NE(result.err.find(says), std::string::npos) << says << '\n' << result.err;
    }

    ScratchDir scratch_;
};

TEST_F(Objects, IncludeAndExcludePartitionTheFragments) {
    for (const char* kind : {"ldi", "deep"}) {
        const std::string whole = render("whole.exr", {"--channels", "id", "--as", kind});
        const auto all = fragmentsOf(whole, {});
        for (const std::vector<std::string>& globs : std::vector<std::vector<std::string>>{
                 {"housing/upper"}, {"*bolt*", "base"}, {"gearbox"}, {"12"}, {"main"}}) {
            const auto in = fragmentsOf(whole, {.include = globs});
            const auto out = fragmentsOf(whole, {.exclude = globs});
            ASSERT_EQ(in.size(), all.size());
            std::size_t kept = 0, left = 0;
            for (std::size_t p = 0; p < all.size(); ++p) {
                kept += in[p].size();
                left += out[p].size();
                // Fragments with and without the objects must together be all fragments, in any
                // order.
                std::vector<Fragment> both = in[p];
                both.insert(both.end(), out[p].begin(), out[p].end());
                std::vector<Fragment> sorted = all[p];
                std::ranges::sort(both);
                std::ranges::sort(sorted);
                ASSERT_EQ(both, sorted) << kind << ' ' << globs.front() << " pixel " << p;
            }
            EXPECT_EQ(kept > 0, globs.front() != "main") << globs.front();
            EXPECT_EQ(left > 0, globs.front() != "gearbox") << globs.front();
        }
    }
}

TEST_F(Objects, WhatIsChosenIsWhatARenderOfItHas) {
    const std::string whole = render("whole.exr", {"--channels", "id"});
    for (const std::vector<std::string>& choice : std::vector<std::vector<std::string>>{
             {"--include", "base"},  // this node has no mesh, so its descendants count
             {"--exclude", "housing/upper"},
             {"--include", "gearbox", "--exclude", "*bolt*"},
             {"--include", "*shell", "--include", "base/plate"}}) {
        std::vector<std::string> rendered{"--as", "composite"};
        rendered.insert(rendered.end(), choice.begin(), choice.end());
        const std::string alone = render("alone.exr", rendered);
        std::vector<std::string> flatten{"flatten", whole, "-o", at("flat.exr")};
        flatten.insert(flatten.end(), choice.begin(), choice.end());
        run(flatten);
        expectEqual(alone, at("flat.exr"));
        // --layers keeps the nearest layers of the selected objects.
        const std::string near = render("near.exr", [&] {
            std::vector<std::string> more = rendered;
            more.insert(more.end(), {"--layers", "2"});
            return more;
        }());
        flatten.insert(flatten.end(), {"--layers", "2"});
        run(flatten);
        expectEqual(near, at("flat.exr"));
    }
}

TEST_F(Objects, ExtractAndViewTakeThemToo) {
    const std::string whole = render("whole.exr", {"--channels", "id,normal", "--as", "deep"});
    const std::string alone =
        render("alone.exr", {"--channels", "id,normal", "--as", "deep", "--include", "base"});
    for (const std::string& from : {whole, alone}) {
        const std::string name = from == whole ? "chosen" : "alone";
        run({"extract", from, "--include", "base", "--points", at(name + ".ply"), "--npz",
             at(name + ".npz"), "--depth-complexity", at(name + ".counts.exr"), "-o",
             at(name + ".layer.##.exr")});
        run({"view", from, "--include", "base", "--orbit", "20,10", "--target", "0,0,0", "-o",
             at(name + ".view.exr")});
    }
    EXPECT_TRUE(bytesOf(at("chosen.ply")) == bytesOf(at("alone.ply")));
    EXPECT_TRUE(bytesOf(at("chosen.npz")) == bytesOf(at("alone.npz")));
    expectSamePixels(at("chosen.counts.exr"), at("alone.counts.exr"));
    expectEqual(at("chosen.layer.00.exr"), at("alone.layer.00.exr"));
    EXPECT_EQ(fs::exists(at("chosen.layer.09.exr")), fs::exists(at("alone.layer.09.exr")));
    expectEqual(at("chosen.view.exr"), at("alone.view.exr"));
    run({"view", whole, "--exclude", "housing*", "-o", at("page.html")});
    EXPECT_GT(fs::file_size(at("page.html")), 1000U);
}

TEST_F(Objects, MaterialsAreChosenByNameOrId) {
    const std::string whole = render("whole.exr", {"--channels", "id"});
    const auto all = fragmentsOf(whole, {});
    const auto oil = fragmentsOf(whole, {.materials = {"oil"}});
    EXPECT_EQ(oil, fragmentsOf(whole, {.materials = {"15"}}));
    std::size_t count = 0;
    for (std::size_t p = 0; p < all.size(); ++p) {
        std::vector<Fragment> wanted;
        std::ranges::copy_if(all[p], std::back_inserter(wanted),
                             [](const Fragment& f) { return std::get<2>(f) == 15; });
        count += wanted.size();
        ASSERT_EQ(oil[p], wanted);
    }
    EXPECT_GT(count, 0U);
}

TEST_F(Objects, TheFileSaysThatItIsOfAChoice) {
    const std::string whole = render("whole.exr", {"--channels", "id"});
    run({"flatten", whole, "-o", at("a.exr")});
    run({"flatten", whole, "-o", at("b.exr"), "--exclude", "base"});
    const Json a = Json::parse(runPeeler({"info", at("a.exr"), "--json"}).out).at("provenance");
    const Json b = Json::parse(runPeeler({"info", at("b.exr"), "--json"}).out).at("provenance");
    EXPECT_EQ(b.at("settings").at("selected").dump(),
              R"([{"exclude":["base"],"include":[],"material":[]}])");
    EXPECT_NE(a.at("settingsHash"), b.at("settingsHash"));
    EXPECT_EQ(runPeeler({"info", at("b.exr")}).out.find("peeler:outputHash"), std::string::npos);
    const Outcome result = runPeeler({"verify", at("a.exr"), at("b.exr")});
    EXPECT_NE(result.out.find("--include, --exclude or --material: given, not none"),
              std::string::npos)
        << result.out;
}

TEST_F(Objects, WhatCannotBeChosenIsRefused) {
    const std::string whole = render("whole.exr", {"--channels", "id"}, "coincident");
    const std::string plain = render("plain.exr", {}, "coincident");
    const std::string out = at("out.png");
    expectRefused({"flatten", plain, "-o", out, "--include", "floor"}, 3,
                  "hint: render it with --channels id");
    expectRefused({"view", plain, "-o", out, "--material", "1"}, 3,
                  "the fragments have no ids, which --material needs");
    expectRefused({"extract", plain, "--npz", at("out.npz"), "--exclude", "floor"}, 3,
                  "hint: render it with --channels id");
    expectRefused({"flatten", whole, "-o", out, "--include", "flor"}, 2, "did you mean 'floor'?");
    expectRefused({"flatten", whole, "-o", out, "--material", "glas"}, 2,
                  "no material matches this name: --material glas");
    EXPECT_FALSE(fs::exists(out));
    // In an empty picture, no name can match, so this is no error.
    const std::string empty = render(
        "empty.exr", {"--channels", "id", "--eye", "0,50,0", "--target", "0,99,1"}, "coincident");
    run({"flatten", empty, "-o", out, "--include", "floor"});
}

}  // namespace
}  // namespace peeler::test
