// SPDX-License-Identifier: Apache-2.0
// Tests fragment lists as dense planes: known lists, and generated pictures.
#include <Imath/half.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include <peeler/error.h>
#include "core/base/parallel.h"
#include "formats/arrays/fragment_tables.h"
#include "formats/arrays/table_writers.h"
#include "formats/exr/synthetic_image.h"
#include "formats/output_hash.h"
#include "formats/writers.h"
#include "support/npz_file.h"
#include "support/ray_hits.h"
#include "support/test_support.h"

namespace peeler {
namespace {

using test::readNpz;
using test::ScratchDir;
using test::StoredArray;
using test::SyntheticPicture;

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
constexpr float kInf = std::numeric_limits<float>::infinity();

template <class Out, class In>
std::vector<Out> planes(const DenseSettings& settings, std::uint32_t layers,
                        const DensePlanes::Column& column, std::vector<std::uint32_t> offsets,
                        const std::vector<In>& numbers) {
    ByteBuffer bytes;
    const DensePlanes dense(settings, layers);
    dense.fill(column, offsets, std::as_bytes(std::span(numbers)), bytes);
    EXPECT_EQ(bytes.size(), (offsets.size() - 1) * dense.pixelBytes(column));
    std::vector<Out> values(bytes.size() / sizeof(Out));
    std::memcpy(values.data(), bytes.data(), bytes.size());
    return values;
}

/// Expects equal values; NaN equals NaN.
void expectSame(const std::vector<float>& got, const std::vector<float>& expected) {
    ASSERT_EQ(got.size(), expected.size());
    for (std::size_t i = 0; i < got.size(); ++i)
        EXPECT_TRUE(got[i] == expected[i] || (std::isnan(got[i]) && std::isnan(expected[i])))
            << i << ": " << got[i] << ", not " << expected[i];
}

constexpr DensePlanes::Column kNumber{NumberType::kFloat, 1};

TEST(DensePlanes, TheKthOfAListIsInPlaneK) {
    // Three pixels with one, no and three fragments. The offsets begin at 10, as for a band in the
    // middle of a picture.
    const std::vector<std::uint32_t> offsets{10, 11, 11, 14};
    const std::vector<float> z{1, 2, 3, 4};
    expectSame(planes<float>({}, 2, kNumber, offsets, z), {1, kNan, kNan, kNan, 2, 3});
    expectSame(planes<float>({}, 1, kNumber, offsets, z), {1, kNan, 2});
    expectSame(planes<float>({}, 4, kNumber, offsets, z),
               {1, kNan, kNan, kNan, kNan, kNan, kNan, kNan, 2, 3, 4, kNan});
    const std::vector<float> uv{1, 10, 2, 20, 3, 30, 4, 40};
    expectSame(planes<float>({.fill = 0}, 2, {NumberType::kFloat, 2}, offsets, uv),
               {1, 10, 0, 0, 0, 0, 0, 0, 2, 20, 3, 30});
}

TEST(DensePlanes, FillIsForNumbersThatAreNoIntegers) {
    const std::vector<std::uint32_t> offsets{0, 1, 1, 3};
    const std::vector<float> z{1, 2, 3};
    expectSame(planes<float>({.fill = -1}, 2, kNumber, offsets, z), {1, -1, -1, -1, 2, 3});
    expectSame(planes<float>({.fill = kInf}, 2, kNumber, offsets, z), {1, kInf, kInf, kInf, 2, 3});
    // `repeat_last` repeats the last fragment in all its components. A pixel without fragments
    // stays NaN.
    expectSame(planes<float>({.fill = 7, .repeat_last = true}, 3, kNumber, offsets, z),
               {1, 1, 1, kNan, kNan, kNan, 2, 3, 3});
    const std::vector<float> uv{1, 10, 2, 20, 3, 30};
    expectSame(planes<float>({.repeat_last = true}, 2, {NumberType::kFloat, 2}, offsets, uv),
               {1, 10, 1, 10, kNan, kNan, kNan, kNan, 2, 20, 3, 30});
    for (const bool repeat : {false, true}) {
        const DenseSettings settings{.type = PixelType::kHalf, .fill = 5, .repeat_last = repeat};
        const std::vector<std::uint32_t> ids{0, 7, 9};
        constexpr std::uint32_t kNone = 0xFFFFFFFF;
        EXPECT_EQ(planes<std::uint32_t>(settings, 2, {NumberType::kUint32, 1}, offsets, ids),
                  (std::vector<std::uint32_t>{0, kNone, kNone, kNone, 7, 9}));
        const std::vector<std::int32_t> facing{1, -1, 1};
        EXPECT_EQ(planes<std::int32_t>(settings, 2, {NumberType::kInt32, 1}, offsets, facing),
                  (std::vector<std::int32_t>{1, 0, 0, 0, -1, 1}));
    }
}

TEST(DensePlanes, HalfIsTheNearestAndTiesGoToEven) {
    const DenseSettings half_planes{.type = PixelType::kHalf};
    const float ulp = 1.0F / 1024;
    const std::vector<float> z{1 + ulp / 2, 1 + 3 * ulp / 2,  1 + ulp / 2 + ulp / 64, 65519, 65520,
                               -70000,      1.0F / (1 << 24), 1.0F / (1 << 26),       -0.0F};
    std::vector<std::uint32_t> offsets;
    for (std::uint32_t p = 0; p <= z.size(); ++p)
        offsets.push_back(p);
    const auto bits = planes<std::uint16_t>(half_planes, 1, kNumber, offsets, z);
    EXPECT_EQ(bits, (std::vector<std::uint16_t>{0x3C00, 0x3C02, 0x3C01, 0x7BFF, 0x7C00, 0xFC00,
                                                0x0001, 0x0000, 0x8000}));
    // The conversion back to float must be exact.
    std::vector<float> as_float;
    for (const std::uint16_t b : bits)
        as_float.push_back(imath_half_to_float(b));
    expectSame(planes<float>({}, 1, {NumberType::kHalf, 1}, offsets, bits), as_float);
    const std::uint16_t nothing = planes<std::uint16_t>({.type = PixelType::kHalf, .fill = -1}, 1,
                                                        kNumber, {0, 0}, std::vector<float>{})
                                      .at(0);
    EXPECT_EQ(nothing, 0xBC00);
}

TEST(DensePlanes, RangesAreAllPixelsOnceAndNotTooMany) {
    std::vector<std::uint32_t> offsets{5};
    for (std::uint32_t p = 0; p < 100'000; ++p)
        offsets.push_back(offsets.back() + (p == 777 ? 1'000'000 : p % 3));
    std::vector<int> seen(offsets.size() - 1);
    DensePlanes::forEachRange(offsets, 64, [&](std::size_t first, std::size_t last) {
        EXPECT_TRUE(last - first == 1 || (offsets[last] - offsets[first] <= 40'000 &&
                                          (last - first) * 64 <= std::size_t{2} << 20));
        for (std::size_t p = first; p < last; ++p)
            ++seen[p];
    });
    EXPECT_EQ(std::ranges::count(seen, 1), 100'000);
}

SyntheticPicture picture(const Window& crop = {}) {
    return test::makePicture(
        {.seed = 3, .width = 53, .height = 41, .crop = crop, .most_layers = 6, .extra = true});
}

std::map<std::string, StoredArray> written(const ScratchDir& scratch, const SyntheticPicture& from,
                                           const FragmentArrayOptions& options,
                                           const std::vector<int>& heights = {1 << 20}) {
    const std::string path = scratch / "a.npz";
    test::writePicture(*makeFragmentArrays(path, options), from, heights);
    return readNpz(path);
}

/// Compares planes with the fragment lists of the same channels. Fragments have `components`
/// numbers; missing fragments have the value `fill`.
template <class T>
void expectPlanes(const StoredArray& planes, const StoredArray& lists,
                  const std::vector<std::int64_t>& splits, std::size_t n, std::size_t components,
                  T fill) {
    const std::vector<T> dense = planes.as<T>(), rows = lists.as<T>();
    ASSERT_EQ(dense.size(), (splits.size() - 1) * n * components);
    std::size_t kept = 0;
    for (std::size_t p = 0; p + 1 < splits.size(); ++p) {
        for (std::size_t k = 0; k < n; ++k) {
            for (std::size_t c = 0; c < components; ++c) {
                const auto f = static_cast<std::size_t>(splits[p]) + k;
                const bool there = f < static_cast<std::size_t>(splits[p + 1]);
                ASSERT_EQ(dense[(p * n + k) * components + c],
                          there ? rows[f * components + c] : fill)
                    << p << ' ' << k << ' ' << c;
                kept += there ? 1 : 0;
            }
        }
    }
    EXPECT_GT(kept, 100U);
}

TEST(DenseArrays, HaveTheNumbersOfTheLists) {
    const ScratchDir scratch;
    for (const Window& crop : {Window{}, Window{5, 3, 47, 40}}) {
        const SyntheticPicture from = picture(crop);
        const auto lists = written(scratch, from, {});
        const std::vector<std::int64_t> splits = lists.at("ray_splits").as<std::int64_t>();
        for (const std::uint32_t n : {1U, 3U, 9U}) {
            FragmentArrayOptions options;
            options.dense = DenseSettings{.layers = n, .fill = -1};
            const auto dense = written(scratch, from, options);
            const Window& window = from.plan.view.crop;
            const std::string pixels =
                std::to_string(window.height()) + ", " + std::to_string(window.width());
            EXPECT_EQ(dense.at("count").shape, "(" + pixels + ")");
            EXPECT_EQ(dense.at("z").shape, "(" + pixels + ", " + std::to_string(n) + ")");
            EXPECT_EQ(dense.at("rgba").shape, "(" + pixels + ", " + std::to_string(n) + ", 4)");
            EXPECT_EQ(dense.at("rgba").type, "<f4");  // converted exactly from half
            EXPECT_EQ(dense.at("id").type, "<u4");
            EXPECT_FALSE(dense.contains("layer"));
            EXPECT_FALSE(dense.contains("ray_splits"));
            const auto counts = dense.at("count").as<std::uint32_t>();
            for (std::size_t p = 0; p < counts.size(); ++p)
                ASSERT_EQ(counts[p], splits[p + 1] - splits[p]);
            expectPlanes<float>(dense.at("z"), lists.at("z"), splits, n, 1, -1);
            expectPlanes<std::uint32_t>(dense.at("id"), lists.at("id"), splits, n, 1, 0xFFFFFFFF);
            options.dense->type = PixelType::kHalf;
            const auto halves = written(scratch, from, options);
            EXPECT_EQ(halves.at("z").type, "<f2");
            expectPlanes<std::uint16_t>(halves.at("rgba"), lists.at("rgba"), splits, n, 4, 0xBC00);
            expectPlanes<std::uint16_t>(halves.at("viewer_normals"), lists.at("viewer_normals"),
                                        splits, n, 3, 0xBC00);
            for (const char* same : {"bundle_window", "bundle_origin", "near", "far"})
                EXPECT_EQ(dense.at(same).numbers, lists.at(same).numbers);
        }
    }
}

TEST(DenseArrays, BandsAndThreadsDoNotMatter) {
    const ScratchDir scratch;
    const SyntheticPicture from = picture({2, 1, 50, 40});
    FragmentArrayOptions options;
    options.dense = DenseSettings{.layers = 4, .repeat_last = true};
    written(scratch, from, options);
    const std::string whole = test::bytesOf(scratch / "a.npz");
    for (const std::vector<int>& heights :
         std::vector<std::vector<int>>{{1}, {7, 3, 1}, {13}, {2, 30}}) {
        written(scratch, from, options, heights);
        EXPECT_TRUE(test::bytesOf(scratch / "a.npz") == whole) << heights.front();
    }
}

TEST(DenseArrays, TintedPicturesHaveTheOpacityOfEachChannel) {
    const ScratchDir scratch;
    SyntheticPicture from = picture();
    from.plan.tinted = true;
    FragmentArray colors{colorNames(true), PixelType::kFloat, {}};
    for (std::size_t f = 0; f < from.image.fragments(); ++f)
        for (std::size_t c = 0; c < kTintedComponents; ++c)
            test::appendValue(colors.data, static_cast<float>(100 * f + c));
    from.image.color = colors;
    const auto lists = written(scratch, from, {});
    const auto splits = lists.at("ray_splits").as<std::int64_t>();
    FragmentArrayOptions options;
    options.dense = DenseSettings{.layers = 2, .fill = 0.5};
    const auto dense = written(scratch, from, options, {5});
    expectPlanes<float>(dense.at("rgba"), lists.at("rgba"), splits, 2, 4, 0.5F);
    expectPlanes<float>(dense.at("opacity"), lists.at("opacity"), splits, 2, 3, 0.5F);
    EXPECT_EQ(dense.at("opacity").as<float>().at(0) != 0, true);
}

TEST(DenseArrays, SomeLayersKeepTheirNumbers) {
    const ScratchDir scratch;
    const SyntheticPicture from = picture();
    FragmentArrayOptions options;
    options.dense = DenseSettings{.layers = 2};
    options.layers_listed = true;
    const auto dense = written(scratch, from, options);
    const auto layer = dense.at("layer").as<std::uint32_t>();
    const auto count = dense.at("count").as<std::uint32_t>();
    for (std::size_t p = 0; p < count.size(); ++p)
        for (std::uint32_t k = 0; k < 2; ++k)
            ASSERT_EQ(layer[2 * p + k], k < count[p] ? k : 0xFFFFFFFF);
}

TEST(DenseArrays, AsManyPlanesAsLayersUnlessTold) {
    const ScratchDir scratch;
    OutputOptions options;
    options.as = "dense";
    const SyntheticPicture from = picture();
    test::writePicture(*makeSink(scratch / "a.npz", options), from);
    EXPECT_EQ(readNpz(scratch / "a.npz").at("z").shape,
              "(41, 53, " + std::to_string(from.plan.layers.size()) + ")");
    // The planes exist even if a picture has no fragments.
    SyntheticPicture empty = test::makePicture({.width = 4, .height = 2, .most_layers = 0});
    test::writePicture(*makeSink(scratch / "b.npz", options), empty);
    EXPECT_EQ(readNpz(scratch / "b.npz").at("z").shape, "(2, 4, 1)");
}

TEST(DenseArrays, SizesAreForecastToTheByte) {
    const ScratchDir scratch;
    SyntheticPicture from = picture({2, 1, 50, 40});
    for (const FragmentArray& array : from.image.extra)
        from.plan.channels.push_back({array.channels, array.type, {}});
    for (const char* kind : {"", "arrays", "dense"}) {
        for (const std::uint32_t layers : {0U, 5U}) {
            OutputOptions options;
            options.as = kind;
            options.dense.layers = layers;
            options.provenance.output_hash = layers ? "0123456789abcdef" : "";
            const std::string path = scratch / "a.npz";
            const SizeForecast told = forecastPicture(path, from.plan, options);
            EXPECT_EQ(told.certainty, Certainty::kExact);
            test::writePicture(*makeSink(path, options), from);
            EXPECT_EQ(told.bytes, std::filesystem::file_size(path)) << kind << layers;
        }
    }
}

TEST(DenseArrays, TheHashIsOfThePlanesToo) {
    const View view;
    OutputOptions options;
    options.as = "dense";
    std::set<std::string> hashes;
    const auto is_new = [&] { return hashes.insert(outputHash(view, "a.npz", options)).second; };
    EXPECT_TRUE(is_new());
    options.dense.layers = 8;
    EXPECT_TRUE(is_new());
    options.dense.fill = -1;
    EXPECT_TRUE(is_new());
    options.dense.fill = kInf;
    EXPECT_TRUE(is_new());
    options.dense.repeat_last = true;
    EXPECT_TRUE(is_new());
    options.dense.type = PixelType::kHalf;
    EXPECT_TRUE(is_new());
    options.as = "arrays";
    EXPECT_TRUE(is_new());
    options.dense = {};
    EXPECT_FALSE(is_new());  // the hash of the kind "arrays" does not depend on `dense`
}

class DenseHits : public testing::Test, protected test::TracedSpheres {
  protected:
    std::map<std::string, StoredArray> hits(std::optional<DenseSettings> dense,
                                            std::span<const Bundle> bundles) {
        HitOptions options{.posed = shown_,
                           .provenance = {},
                           .columns = {"t_hit", "geometry_ids", "primitive_ids", "material_ids"},
                           .dense = dense};
        const std::string path = scratch_ / "a.npz";
        const auto output = makeHitOutput(path, options);
        std::vector<std::uint64_t> counts;
        std::vector<LayeredImage> images;
        for (const Bundle& bundle : bundles) {
            images.push_back(sphereHits(bundle, spheres_));
            counts.push_back(images.back().fragments());
        }
        EXPECT_EQ(output->needsHits(), !dense);
        const SizeForecast told = output->forecast(bundles, counts);
        output->begin(bundles, counts);
        for (std::size_t i = 0; i < bundles.size(); ++i) {
            const Window& window = images[i].window;
            for (int y = window.y0; y < window.y1; y += 7)
                output->take(i, test::cutRows(images[i], y, std::min(y + 7, window.y1)));
        }
        output->finish();
        EXPECT_EQ(told.bytes, std::filesystem::file_size(path));
        return readNpz(path);
    }
    ScratchDir scratch_;
};

TEST_F(DenseHits, HaveTheNumbersOfTheLists) {
    std::vector<Bundle> same{bundles_[0], bundles_[0]};
    same[1].name = "again";
    for (const std::size_t count : {std::size_t{1}, std::size_t{2}}) {
        const std::span some = std::span<const Bundle>(same).first(count);
        const auto lists = hits({}, some);
        const auto splits = lists.at("ray_splits").as<std::int64_t>();
        const Window& crop = same[0].view.crop;
        const std::string pixels = (count == 2 ? "(2, " : "(") + std::to_string(crop.height()) +
                                   ", " + std::to_string(crop.width());
        for (const std::uint32_t n : {1U, 3U, 5U}) {
            const auto dense = hits(DenseSettings{.layers = n, .fill = -1}, some);
            EXPECT_EQ(dense.at("count").shape, pixels + ")");
            EXPECT_EQ(dense.at("t_hit").shape, pixels + ", " + std::to_string(n) + ")");
            expectPlanes<float>(dense.at("t_hit"), lists.at("t_hit"), splits, n, 1, -1);
            for (const char* ids : {"geometry_ids", "primitive_ids", "material_ids"})
                expectPlanes<std::uint32_t>(dense.at(ids), lists.at(ids), splits, n, 1, 0xFFFFFFFF);
            EXPECT_EQ(dense.at("bundle_origin").numbers, lists.at("bundle_origin").numbers);
            const auto counts = dense.at("count").as<std::uint32_t>();
            for (std::size_t p = 0; p < counts.size(); ++p)
                ASSERT_EQ(counts[p], splits[p + 1] - splits[p]);
        }
    }
}

TEST_F(DenseHits, BundlesOfDifferentSizesAreNoArray) {
    std::vector<Bundle> bundles{bundles_[0], bundles_[0]};
    bundles[1].name = "narrow";
    bundles[1].view.crop.x1 -= 1;
    HitOptions options{.posed = shown_, .provenance = {}, .dense = DenseSettings{.layers = 2}};
    const auto output = makeHitOutput(scratch_ / "a.npz", options);
    try {
        output->begin(bundles, {});
        FAIL();
    } catch (const Error& error) {
        EXPECT_EQ(error.kind(), ErrorKind::kUsage);
        EXPECT_TRUE(test::contains(error.where(), "narrow: ")) << error.where();
        EXPECT_TRUE(test::contains(error.where(), bundles[0].name + ": ")) << error.where();
    }
    EXPECT_THROW(output->forecast(bundles, {}), Error);
    EXPECT_THROW(makeHitOutput(scratch_ / "a.ply", options), Error);
    EXPECT_TRUE(scratch_.files().empty());
}

}  // namespace
}  // namespace peeler
