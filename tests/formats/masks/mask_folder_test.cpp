// SPDX-License-Identifier: Apache-2.0
// Tests mask folders: their content, and remaining files of earlier runs.
#include "formats/masks/mask_folder.h"

#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <glm/gtc/matrix_transform.hpp>
#include <nlohmann/json.hpp>

#include <peeler/error.h>
#include "formats/file/atomic_file.h"
#include "formats/image/image_library.h"
#include "formats/image/image_writer.h"
#include "support/test_support.h"

namespace peeler::test {
namespace {

namespace fs = std::filesystem;

std::vector<std::uint8_t> bytesOfGrey(const fs::path& path, int width, int height) {
    const auto decoder = imageDecoder("png", path.string());
    EXPECT_EQ(decoder->image().width, width);
    EXPECT_EQ(decoder->image().height, height);
    EXPECT_EQ(decoder->image().channels.size(), 1U);
    std::vector<std::uint8_t> samples(static_cast<std::size_t>(width * height));
    decoder->read(0, 1, samples.data());
    return samples;
}

TEST(GreyPng, KeepsItsSamples) {
    const ScratchDir scratch;
    const std::string path = (scratch / "grey.png").string();
    const std::vector<std::uint8_t> bytes = {0, 255, 7, 128, 3, 200};
    const auto write = [&](int width, int height, const auto& samples) {
        AtomicFile file(path);
        writeGreyPng(file, width, height, samples, "a test");
        file.commit();
    };
    write(3, 2, std::span(bytes));
    EXPECT_EQ(bytesOfGrey(path, 3, 2), bytes);
    const std::vector<std::uint16_t> words = {0, 1, 258, 65535, 40000, 513};
    write(2, 3, std::span(words));
    std::vector<float> samples(6);
    imageDecoder("png", path)->read(0, 1, samples.data());
    for (std::size_t i = 0; i < 6; ++i)
        EXPECT_EQ(std::lround(samples[i] * 65535), words[i]);
}

/// Returns a picture of 4 x 3 pixels. The camera is 5 above the origin and looks down at it, with
/// +Z at the bottom of the picture. Its focal lengths are 4 and 6 pixels.
View view() {
    View view;
    view.width = 4;
    view.height = 3;
    view.crop = {0, 0, 4, 3};
    view.projection.half_width = 0.5;
    view.projection.half_height = 0.25;
    view.camera_to_world = glm::rotate(glm::translate(glm::dmat4(1), glm::dvec3(0, 5, 0)),
                                       -std::acos(0.0), glm::dvec3(1, 0, 0));
    return view;
}

ObjectMasks masks(std::initializer_list<std::uint32_t> amodal,
                  std::initializer_list<std::uint32_t> visible) {
    ObjectMasks masks;
    masks.amodal = masks.visible = PixelRuns(4);
    for (const std::uint32_t pixel : amodal)
        masks.amodal.add(pixel);
    for (const std::uint32_t pixel : visible)
        masks.visible.add(pixel);
    masks.canvas_pixels = masks.amodal.count();
    masks.canvas_box = masks.amodal.box();
    return masks;
}

/// Masks of three objects: the second is outside the picture, and the third is hidden.
class MaskFiles : public testing::Test {
  protected:
    MaskFiles() {
        places_[0] = glm::translate(glm::dmat4(1), glm::dvec3(1, 2, 3)) *
                     glm::scale(glm::dmat4(1), glm::dvec3(2));
        objects_[2].material = 7;
        masks_ = {masks({1, 2, 5, 6, 7}, {2, 6, 7}), masks({}, {}), masks({10}, {})};
        layers_.offsets = {0, 0, 1, 2, 2, 2, 3, 4, 5, 5, 5, 7, 7};
        layers_.numbers = {1, 1, 1, 1, 1, 1, 3};
    }

    MaskFolder folder(const MaskFormats& formats) const {
        return MaskFolder({scratch_.path(), formats, "node", ""}, objects_);
    }
    std::uint64_t write(const MaskFolder& folder, std::size_t number,
                        const std::string& hash) const {
        const View seen = view();
        return folder.write({number, seen, hash, masks_, places_, layers_});
    }
    Json json(const std::string& name) const { return Json::parse(bytesOf(scratch_ / name)); }

    ScratchDir scratch_;
    std::vector<MaskedObject> objects_{{"one", 1}, {"two", 2}, {"three", 8}};
    std::vector<glm::dmat4> places_ = std::vector<glm::dmat4>(3, glm::dmat4(1));
    std::vector<ObjectMasks> masks_;
    ObjectLayers layers_;
};

TEST_F(MaskFiles, AreBops) {
    const MaskFolder bop = folder({.bop = true});
    write(bop, 0, "a");
    write(bop, 1, "b");
    EXPECT_FALSE(fs::exists(scratch_ / "scene_gt.json"));
    bop.writeShared(2);
    const std::vector<std::uint8_t> amodal = {0, 255, 255, 0, 0, 255, 255, 255, 0, 0, 0, 0};
    EXPECT_EQ(bytesOfGrey(scratch_ / "mask/000000_000000.png", 4, 3), amodal);
    const std::vector<std::uint8_t> seen = {0, 0, 255, 0, 0, 0, 255, 255, 0, 0, 0, 0};
    EXPECT_EQ(bytesOfGrey(scratch_ / "mask_visib/000001_000000.png", 4, 3), seen);
    EXPECT_EQ(bytesOfGrey(scratch_ / "mask_visib/000001_000001.png", 4, 3),
              std::vector<std::uint8_t>(12, 0));
    EXPECT_FALSE(fs::exists(scratch_ / "mask/000000_000002.png")) << "what is nowhere has none";
    EXPECT_FALSE(fs::exists(scratch_ / "ids"));
    EXPECT_FALSE(fs::exists(scratch_ / "coco.json"));

    const Json info = json("scene_gt_info.json");
    ASSERT_EQ(info.size(), 2U);
    EXPECT_EQ(info["1"][0], (Json{{"px_count_all", 5},
                                  {"px_count_valid", 5},
                                  {"px_count_visib", 3},
                                  {"visib_fract", 0.6},
                                  {"bbox_obj", {1, 0, 2, 1}},
                                  {"bbox_visib", {2, 0, 1, 1}}}));
    EXPECT_EQ(info["0"][1]["bbox_obj"], (Json{-1, -1, -1, -1})) << "as calc_gt_info.py";
    EXPECT_EQ(info["0"][1]["visib_fract"], 0);
    const Json camera = json("scene_camera.json")["0"];
    // Positions are relative to the centre of the first pixel: the middle of 4 pixels is 1.5, and
    // of 3 pixels it is 1.
    EXPECT_EQ(camera["cam_K"], (Json{4.0, 0, 1.5, 0, 6.0, 1.0, 0, 0, 1}));
    EXPECT_EQ(camera["depth_scale"], 1);
    EXPECT_EQ(json("camera.json")["width"], 4);
    EXPECT_EQ(json("camera.json")["fy"], 6);

    const Json gt = json("scene_gt.json")["0"];
    ASSERT_EQ(gt.size(), 2U);
    EXPECT_EQ(gt[0]["obj_id"], 1);
    EXPECT_EQ(gt[1]["obj_id"], 8);
    // In the camera space of BOP, X is world X, Y (down) is world Z, and Z is 5 minus world Y.
    const double place[] = {1000, 3000, 3000}, turned[] = {1, 0, 0, 0, 0, 1, 0, -1, 0};
    for (std::size_t i = 0; i < 3; ++i)
        EXPECT_NEAR(gt[0]["cam_t_m2c"][i].get<double>(), place[i], 1e-9);
    for (std::size_t i = 0; i < 9; ++i)
        EXPECT_NEAR(gt[0]["cam_R_m2c"][i].get<double>(), turned[i], 1e-12)
            << "without the scale, which is the model's";
    EXPECT_NEAR(gt[1]["cam_t_m2c"][2].get<double>(), 5000, 1e-9);

    const Json objects = json("objects.json");
    EXPECT_EQ(objects["by"], "node");
    EXPECT_EQ(objects["objects"][2],
              (Json{{"object", 8}, {"name", "three"}, {"materialIndex", 7}}));
}

TEST_F(MaskFiles, AreCocos) {
    const MaskFolder coco = folder({.coco = true});
    write(coco, 0, "a");
    write(coco, 1, "b");
    coco.writeShared(2);
    const Json json = this->json("coco.json");
    ASSERT_EQ(json["images"].size(), 2U);
    EXPECT_EQ(json["images"][1],
              (Json{{"id", 1}, {"file_name", "rgb/000001.png"}, {"width", 4}, {"height", 3}}));
    ASSERT_EQ(json["categories"].size(), 3U);
    EXPECT_EQ(json["categories"][1]["name"], "two");
    EXPECT_EQ(json["categories"][2]["id"], 8);
    ASSERT_EQ(json["annotations"].size(), 2U) << "of what is seen";
    const Json& annotation = json["annotations"][1];
    EXPECT_EQ(annotation["id"], 2);
    EXPECT_EQ(annotation["image_id"], 1);
    EXPECT_EQ(annotation["category_id"], 1);
    EXPECT_EQ(annotation["iscrowd"], 0);
    EXPECT_EQ(annotation["area"], 3);
    EXPECT_EQ(annotation["bbox"], (Json{2, 0, 2, 2}));
    EXPECT_EQ(annotation["amodal_area"], 5);
    EXPECT_EQ(annotation["amodal_bbox"], (Json{1, 0, 3, 2}));
    EXPECT_EQ(annotation["visib_fract"], 0.6);
    // The mask, column by column, is . . . / . . . / x x . / . x .
    EXPECT_EQ(annotation["segmentation"], (Json{{"size", {3, 4}}, {"counts", {6, 2, 2, 1, 1}}}));
    EXPECT_EQ(annotation["amodal_segmentation"]["counts"], (Json{3, 2, 1, 2, 2, 1, 1}));
    EXPECT_FALSE(fs::exists(scratch_ / "mask"));
}

TEST_F(MaskFiles, AreIdsOfLayers) {
    const MaskFolder ids = folder({.ids = true});
    write(ids, 12, "a");
    std::vector<float> samples(12);
    imageDecoder("png", (scratch_ / "ids/000012_layer_001.png").string())
        ->read(0, 1, samples.data());
    for (std::size_t i = 0; i < 12; ++i)
        EXPECT_EQ(std::lround(samples[i] * 65535), i == 10 ? 8 : 0);
    EXPECT_TRUE(fs::exists(scratch_ / "ids/000012_layer_000.png"));
    EXPECT_FALSE(fs::exists(scratch_ / "ids/000012_layer_002.png"));
    const std::vector<MaskedObject> many{{"last", 65536}};
    EXPECT_THROW(MaskFolder({scratch_.path(), {.ids = true}, "node", ""}, many), Error);
    EXPECT_NO_THROW(MaskFolder({scratch_.path(), {.bop = true}, "node", ""}, many));
}

TEST_F(MaskFiles, AreKnownByTheirRecord) {
    const MaskFolder all = folder({true, true, true});
    const std::uint64_t bytes = write(all, 3, "hash");
    EXPECT_EQ(all.bytesOf(3, "hash"), bytes);
    EXPECT_FALSE(all.bytesOf(3, "other"));
    EXPECT_FALSE(all.bytesOf(2, "hash"));
    fs::resize_file(scratch_ / "mask/000003_000001.png", 20);
    EXPECT_FALSE(all.bytesOf(3, "hash"));
    write(all, 3, "hash");
    EXPECT_TRUE(all.bytesOf(3, "hash"));
    fs::remove(scratch_ / "ids/000003_layer_000.png");
    EXPECT_FALSE(all.bytesOf(3, "hash"));
    // A record may come from another program, so a damaged record is not trusted.
    for (const char* const damage : {"", "{", "[]", "{\"hash\": 3}",
                                     "{\"hash\": \"hash\", \"masks\": -1, \"layers\": 1e99}"}) {
        std::ofstream(all.record(3)) << damage;
        EXPECT_FALSE(all.bytesOf(3, "hash")) << damage;
    }
    EXPECT_THROW(all.writeShared(4), Error);
    EXPECT_FALSE(fs::exists(scratch_ / "coco.json"));
    EXPECT_TRUE(all.owns(scratch_ / "mask/x.png"));
    EXPECT_TRUE(all.owns(scratch_ / "mask/../coco.json"));
    EXPECT_FALSE(all.owns(scratch_ / "scene.glb"));
}

TEST_F(MaskFiles, AreNotNewWhereTheirRecordCannotBeLookedAt) {
    const MaskFolder bop = folder({.bop = true});
    write(bop, 0, "a");
    fs::remove(bop.record(0));
    EXPECT_EQ(bop.bytesOf(0, "a"), std::nullopt);
    fs::create_symlink(bop.record(0).filename(), bop.record(0));
    EXPECT_THROW(bop.bytesOf(0, "a"), Error);
    EXPECT_THROW(write(bop, 0, "a"), Error);
    EXPECT_TRUE(fs::exists(scratch_ / "mask/000000_000000.png"));
}

TEST_F(MaskFiles, LeaveNothingOfWhatWasThereBefore) {
    const MaskFolder all = folder({true, true, true});
    write(all, 0, "more");
    all.writeShared(1);
    EXPECT_TRUE(fs::exists(scratch_ / "mask/000000_000001.png"));
    masks_[2] = masks({}, {});
    layers_.offsets = {0, 0, 1, 2, 2, 2, 3, 4, 5, 5, 5, 6, 6};
    write(all, 0, "fewer");
    EXPECT_TRUE(fs::exists(scratch_ / "mask/000000_000000.png"));
    EXPECT_FALSE(fs::exists(scratch_ / "mask/000000_000001.png"));
    EXPECT_FALSE(fs::exists(scratch_ / "mask_visib/000000_000001.png"));
    EXPECT_FALSE(fs::exists(scratch_ / "ids/000000_layer_001.png"));
    for (const fs::path& file : all.sharedFiles())
        EXPECT_FALSE(fs::exists(file)) << file << " is of what is no more";
}

TEST_F(MaskFiles, HaveNoRecordUntilAllOfThemAreThere) {
    const MaskFolder all = folder({true, true, true});
    const auto begun = fs::path(all.record(0)).replace_extension(".begun");
    write(all, 0, "before");
    EXPECT_FALSE(fs::exists(begun));
    // The state after a kill: there are more files than the next run writes.
    const fs::path blocked = scratch_ / "ids/000000_layer_000.png";
    fs::remove(blocked);
    fs::create_directory(blocked);
    EXPECT_THROW(write(all, 0, "killed"), Error);
    EXPECT_FALSE(fs::exists(all.record(0)));
    EXPECT_TRUE(fs::exists(begun));
    EXPECT_FALSE(all.bytesOf(0, "killed"));
    fs::remove(blocked);
    std::ofstream(scratch_ / "mask/000000_000001.png") << "left";
    masks_[2] = masks({}, {});
    write(all, 0, "after");
    EXPECT_TRUE(all.bytesOf(0, "after"));
    EXPECT_FALSE(fs::exists(begun));
    EXPECT_FALSE(fs::exists(scratch_ / "mask/000000_000001.png"));
    // Earlier versions wrote a record with an empty hash before all files were complete.
    std::ofstream(all.record(0)) << R"({"hash": "", "masks": 3, "layers": 2})";
    std::ofstream(scratch_ / "mask/000000_000002.png") << "left";
    write(all, 0, "after");
    EXPECT_FALSE(fs::exists(scratch_ / "mask/000000_000002.png"));
}

TEST_F(MaskFiles, OfBopAreOfOneSizeAndInPerspective) {
    std::vector<View> views = {view(), view()};
    const MaskFolder bop = folder({.bop = true}), coco = folder({.coco = true});
    EXPECT_NO_THROW(bop.checkViews(views));
    views[1].crop.x1 = 3;
    EXPECT_THROW(bop.checkViews(views), Error);
    EXPECT_NO_THROW(coco.checkViews(views));
    views[1] = view();
    views[1].projection.perspective = false;
    EXPECT_THROW(bop.checkViews(views), Error);
    EXPECT_NO_THROW(coco.checkViews(views));
}

}  // namespace
}  // namespace peeler::test
