// SPDX-License-Identifier: Apache-2.0
// Tests the fragments stored in a page by unpacking them like page_drawing.js.
#include "formats/page/html_view_writer.h"

#include <gtest/gtest.h>
#include <libdeflate.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <random>

#include "formats/exr/synthetic_image.h"
#include "formats/writers.h"
#include "support/test_support.h"

namespace peeler::test {
namespace {

std::string between(const std::string& text, const std::string& begin, const std::string& end) {
    const std::size_t from = text.find(begin) + begin.size();
    return text.substr(from, text.find(end, from) - from);
}

Bytes fromBase64(const std::string& text) {
    Bytes bytes;
    std::uint32_t group = 0, bits = 0;
    for (const char c : text) {
        const std::size_t digit =
            std::string_view("ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/")
                .find(c);
        if (digit == std::string_view::npos) break;
        group = group << 6 | static_cast<std::uint32_t>(digit);
        bits += 6;
        if (bits < 8) continue;
        bits -= 8;
        bytes.push_back(static_cast<std::uint8_t>(group >> bits));
    }
    return bytes;
}

/// The JSON of a page, and its planes of bytes.
struct Page {
    Json view;
    Bytes planes;
    std::size_t count = 0;

    explicit Page(const std::string& text)
        : view(Json::parse(between(text, R"(<script id="view" type="application/json">)", "<"))) {
        const Bytes packed =
            fromBase64(between(text, R"(<script id="fragments" type="text/plain">)", "<"));
        count = view["layerEnds"].back();
        planes.resize(64 * count);
        std::size_t size = 0;
        auto* inflater = libdeflate_alloc_decompressor();
        EXPECT_EQ(libdeflate_zlib_decompress(inflater, packed.data(), packed.size(), planes.data(),
                                             planes.size(), &size),
                  LIBDEFLATE_SUCCESS);
        libdeflate_free_decompressor(inflater);
        planes.resize(size);
    }
    std::uint32_t value(std::size_t plane, std::size_t bytes, std::size_t i) const {
        std::uint32_t result = 0;
        for (std::size_t b = 0; b < bytes; ++b)
            result |= std::uint32_t{planes[(plane + b) * count + i]} << (8 * b);
        return result;
    }
    /// Returns the values of planes that store differences between successive values.
    std::vector<std::uint32_t> sums(std::size_t plane, std::size_t bytes) const {
        std::vector<std::uint32_t> values(count);
        std::uint32_t last = 0;
        for (std::size_t i = 0; i < count; ++i)
            last = values[i] = last + value(plane, bytes, i);
        return values;
    }
    /// Returns the codes of the depths at the fragments' centres.
    std::vector<std::uint16_t> depths(std::size_t plane) const {
        std::vector<std::uint16_t> codes;
        std::uint16_t upper_right = 0, lower_right = 0, rise = 0;
        const auto low16 = [](std::uint32_t word) { return static_cast<std::uint16_t>(word); };
        for (std::size_t i = 0; i < count; ++i) {
            const std::uint16_t upper_left = low16(upper_right + value(4, 2, i));
            const std::uint16_t lower_left = low16(lower_right + value(6, 2, i));
            rise = low16(rise + value(8, 2, i));
            upper_right = low16(upper_left + std::uint32_t{rise});
            lower_right = low16(lower_left + rise + value(10, 2, i));
            const std::uint32_t sum =
                std::uint32_t{upper_left} + upper_right + lower_left + lower_right;
            codes.push_back(low16((sum + 2) / 4 + value(plane, 2, i)));
        }
        return codes;
    }
};

class PageOfFragments : public testing::Test {
  protected:
    /// Writes a picture as a page and reads it back.
    Page page(const SyntheticPicture& picture, const IdNames& names = {}) const {
        const std::string path = scratch_ / "a.html";
        OutputOptions options;
        options.provenance.ids = names;
        HtmlViewWriter writer(path, options);
        writePicture(writer, picture, {7, 3});
        return Page(bytesOf(path));
    }
    ScratchDir scratch_;
};

/// Visits the fragments of a picture in the order of a page.
template <class F>
void eachInOrder(const SyntheticPicture& picture, F&& visit) {
    const LayeredImage& image = picture.image;
    std::size_t i = 0;
    for (std::uint32_t layer = 0; layer < picture.plan.layers.size(); ++layer) {
        for (std::uint32_t pixel = 0; pixel < image.window.pixels(); ++pixel)
            if (layer < image.count(pixel)) visit(i++, image.offsets[pixel] + layer, pixel);
    }
    ASSERT_EQ(i, image.fragments());
}

TEST_F(PageOfFragments, HasTheDepthOfEachInSixteenBits) {
    for (const bool perspective : {true, false}) {
        SyntheticPicture picture = makePicture({.seed = 5});
        picture.plan.view.projection.perspective = perspective;
        const Page found = page(picture);
        ASSERT_EQ(found.planes.size(), 18 * found.count) << "no more than colour and depth";
        EXPECT_FALSE(found.view.contains("objects") || found.view.contains("materials"));
        const auto pixels = found.sums(0, 4);
        const auto depths = found.depths(16);
        const double low = found.view["range"][0], high = found.view["range"][1];
        eachInOrder(picture, [&](std::size_t i, std::size_t fragment, std::uint32_t pixel) {
            ASSERT_EQ(pixels[i], pixel);
            const double measure = low + (high - low) * depths[i] / 65535;
            const double z = picture.image.z[fragment];
            ASSERT_NEAR(measure, perspective ? std::log2(z) : z, 0.501 * (high - low) / 65535);
        });
    }
}

TEST_F(PageOfFragments, HasTheIdsThatThereAre) {
    SyntheticPicture picture = makePicture({.seed = 6});
    std::mt19937 random(7);
    FragmentArray ids = {{"id.object", "id.material", "id.primitive"}, PixelType::kUint, {}};
    for (std::size_t i = 0; i < picture.image.fragments(); ++i) {
        appendValue(ids.data, static_cast<std::uint32_t>(random() % 6));
        appendValue(ids.data, random() % 9 == 0 ? ~std::uint32_t{0} : std::uint32_t{2});
        appendValue(ids.data, static_cast<std::uint32_t>(random()));
    }
    const IdNames names = {.objects = {"<a>", "b", "", "fourth"}, .materials = {"x", "y"}};
    const auto* words = reinterpret_cast<const std::uint32_t*>(ids.data.data());
    for (std::size_t kinds = 1; kinds < 4; ++kinds) {
        // Files of other programs may have only one kind of ID.
        SyntheticPicture some = picture;
        FragmentArray kept = ids;
        if ((kinds & 1) == 0) kept.channels[0] = "id.other";
        if ((kinds & 2) == 0) kept.channels[1] = "id.other";
        some.image.extra = {kept};
        const Page found = page(some, names);
        const std::size_t planes = 18 + (kinds == 3 ? 8U : 4U);
        ASSERT_EQ(found.planes.size(), planes * found.count);
        const auto objects = found.sums(18, 4), materials = found.sums(planes - 4, 4);
        eachInOrder(some, [&](std::size_t i, std::size_t fragment, std::uint32_t) {
            const std::uint32_t object = words[3 * fragment], material = words[3 * fragment + 1];
            ASSERT_EQ(objects[i], (kinds & 1) != 0 ? object : material);
            ASSERT_EQ(materials[i], (kinds & 2) != 0 ? material : object);
        });
        const Json all = {{"0", nullptr}, {"1", "<a>"},    {"2", "b"},
                          {"3", ""},      {"4", "fourth"}, {"5", nullptr}};
        EXPECT_EQ(found.view.value("objects", Json()), (kinds & 1) != 0 ? all : Json());
        const Json paints = {{"2", "y"}, {"4294967295", nullptr}};
        EXPECT_EQ(found.view.value("materials", Json()), (kinds & 2) != 0 ? paints : Json())
            << "names of what is not in the picture are left out";
    }
}

// Random fragments hardly compress, so the page must be nearly as large as forecast.
TEST_F(PageOfFragments, TakeNoMoreThanIsForecast) {
    const SyntheticPicture picture = makePicture({.width = 160, .height = 160, .most_layers = 8});
    page(picture);
    const auto bytes = std::filesystem::file_size(scratch_ / "a.html");
    const std::uint64_t forecast = forecastPicture("a.html", picture.plan, {}).bytes;
    EXPECT_LE(bytes, forecast);
    EXPECT_GT(bytes, forecast / 2);
}

}  // namespace
}  // namespace peeler::test
