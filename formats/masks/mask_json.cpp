// SPDX-License-Identifier: Apache-2.0
#include "formats/masks/mask_json.h"

#include <utility>

#include <peeler/camera_choice.h>
#include "core/scene/view.h"
#include "formats/cameras/bop_lens.h"
#include "formats/file/json_text.h"

namespace peeler {

namespace {

using nlohmann::json;

constexpr double kMillimetresAMetre = 1000;

/// Adds two members to `to`: the rotation (row-major) and the translation (millimetres).
void addRigid(const glm::dmat4& matrix, const std::string& names, json& to) {
    json& rotation = to["cam_R_" + names] = json::array();
    json& shift = to["cam_t_" + names] = json::array();
    for (int row = 0; row < 3; ++row) {
        for (int column = 0; column < 3; ++column)
            rotation.push_back(matrix[column][row]);
        shift.push_back(matrix[3][row] * kMillimetresAMetre);
    }
}

/// Returns the matrix from world to camera, with OpenCV's camera axes (Y down, Z forward), for a
/// rigid glTF camera.
glm::dmat4 worldToOpencv(const glm::dmat4& camera_to_world) {
    const glm::dmat3 turned = glm::transpose(glm::dmat3(camera_to_world));
    glm::dmat4 result(turned);
    result[3] = glm::dvec4(-(turned * glm::dvec3(camera_to_world[3])), 1);
    for (int column = 0; column < 4; ++column) {
        result[column].y = -result[column].y;
        result[column].z = -result[column].z;
    }
    return result;
}

/// Returns an object's model-to-world transform without scale. BOP counts the scale as part of the
/// model.
glm::dmat4 rigidPlace(const glm::dmat4& to_world) {
    if (const auto place = rigid(to_world)) return *place;
    glm::dmat4 place(1);
    place[3] = to_world[3];
    return place;
}

/// Returns the box as in bop_toolkit's misc.calc_2d_bbox: from the first to the last pixel, so that
/// a single pixel has width 0.
json bopBox(const Window& box) {
    return {box.x0, box.y0, box.x1 - box.x0 - 1, box.y1 - box.y0 - 1};
}

/// Returns the box as in COCO: a single pixel has width 1.
json cocoBox(const Window& box) {
    return {box.x0, box.y0, box.width(), box.height()};
}

/// Returns the data of bop_toolkit's scripts/calc_gt_info.py. Invisible objects get the box [−1,
/// −1, −1, −1].
json bopInfo(const ObjectMasks& masks) {
    const json none = {-1, -1, -1, -1};
    const bool seen = masks.visible.count() > 0;
    return {{"px_count_all", masks.canvas_pixels},
            {"px_count_valid", masks.amodal.count()},
            {"px_count_visib", masks.visible.count()},
            {"visib_fract", masks.visibleFraction()},
            {"bbox_obj", seen ? bopBox(masks.canvas_box) : none},
            {"bbox_visib", seen ? bopBox(masks.visible.box()) : none}};
}

json annotationOf(std::uint32_t number, const ObjectMasks& masks, const Window& crop) {
    const int height = crop.height();
    const auto rle = [&](const PixelRuns& runs) -> json {
        return {{"counts", runs.columnCounts(height)}, {"size", {height, crop.width()}}};
    };
    return {{"category_id", number},
            {"iscrowd", 0},
            {"area", masks.visible.count()},
            {"bbox", cocoBox(masks.visible.box())},
            {"segmentation", rle(masks.visible)},
            {"amodal_area", masks.amodal.count()},
            {"amodal_bbox", cocoBox(masks.canvas_box)},
            {"amodal_segmentation", rle(masks.amodal)},
            {"visib_fract", masks.visibleFraction()},
            {"width", crop.width()},
            {"height", height}};
}

/// Returns the file name of a picture: at least six digits, as in BOP.
std::string pictureFileName(std::size_t number) {
    std::string text = std::to_string(number);
    return std::string(text.size() < 6 ? 6 - text.size() : 0, '0') + text + ".png";
}

std::string categoriesText(std::span<const MaskedObject> objects) {
    std::string text;
    for (std::size_t i = 0; i < objects.size(); ++i)
        text += (i == 0 ? "\n    " : ",\n    ") + dumpJson(json{{"id", objects[i].number},
                                                                {"name", objects[i].name},
                                                                {"supercategory", "object"}});
    return text;
}

}  // namespace

json viewJson(const MaskedView& view, const MaskFormats& formats,
              std::span<const MaskedObject> objects, std::span<const std::size_t> listed) {
    json record = json::object();
    const Window& crop = view.view.crop;
    if (formats.bop) {
        const glm::dmat4 world_to_camera = worldToOpencv(view.view.camera_to_world);
        const Intrinsics k = intrinsicsOf(view.view);
        json camera = {{"depth_scale", 1.0}};
        if (const LensCamera* const lens = lensCameraOf(view.view))
            camera["cam_model"] =
                bopCameraModel(lens->lens, k, {crop.width(), crop.height()}).value();
        else
            camera["cam_K"] = {k.fx, 0, k.cx, 0, k.fy, k.cy, 0, 0, 1};
        addRigid(world_to_camera, "w2c", camera);
        record["scene_camera"] = std::move(camera);
        record["camera"] = {{"fx", k.fx},
                            {"fy", k.fy},
                            {"cx", k.cx},
                            {"cy", k.cy},
                            {"width", crop.width()},
                            {"height", crop.height()},
                            {"depth_scale", 1.0}};
        record["scene_gt"] = record["scene_gt_info"] = json::array();
        for (const std::size_t object : listed) {
            json entry = {{"obj_id", objects[object].number}};
            addRigid(world_to_camera * rigidPlace(view.to_world[object]), "m2c", entry);
            record["scene_gt"].push_back(std::move(entry));
            record["scene_gt_info"].push_back(bopInfo(view.masks[object]));
        }
    }
    if (formats.coco) {
        record["coco_image"] = {{"id", view.number},
                                {"file_name", "rgb/" + pictureFileName(view.number)},
                                {"width", crop.width()},
                                {"height", crop.height()}};
        record["coco_annotations"] = json::array();
        for (const std::size_t object : listed)
            if (view.masks[object].visible.count() > 0)
                record["coco_annotations"].push_back(
                    annotationOf(objects[object].number, view.masks[object], crop));
    }
    return record;
}

std::string SharedJson::begin(const std::string& by, std::span<const MaskedObject> objects) const {
    if (name_ == "camera.json") return "";
    if (name_ == "coco.json")
        return R"({"info": {"description": "visible and whole silhouettes of objects"}, )"
               R"("licenses": [],)"
               "\n\"categories\": [" +
               categoriesText(objects) + "],\n\"annotations\": [";
    if (name_ != "objects.json") return "{";
    std::string text = "{\"by\": " + dumpJson(json(by)) + ", \"objects\": [";
    for (std::size_t i = 0; i < objects.size(); ++i) {
        json entry = {{"object", objects[i].number}, {"name", objects[i].name}};
        if (objects[i].node) entry["nodeIndex"] = *objects[i].node;
        if (objects[i].instance) entry["instance"] = *objects[i].instance;
        if (objects[i].material) entry["materialIndex"] = *objects[i].material;
        text += (i == 0 ? "\n    " : ",\n    ") + dumpJson(entry);
    }
    return text + "]}\n";
}

std::string SharedJson::add(std::size_t view, const json& record) {
    if (name_ == "objects.json") return "";
    const bool first = std::exchange(first_, false);
    if (name_ == "camera.json") return first ? dumpJson(record.at("camera")) + '\n' : "";
    if (name_ != "coco.json") {
        const std::string member = name_.substr(0, name_.find('.'));
        return (first ? "\n  \"" : ",\n  \"") + std::to_string(view) +
               "\": " + dumpJson(record.at(member));
    }
    held_ += (first ? "\n    " : ",\n    ") + dumpJson(record.at("coco_image"));
    std::string text;
    for (json annotation : record.at("coco_annotations")) {
        annotation["id"] = ++annotations_;
        annotation["image_id"] = view;
        text += (annotations_ == 1 ? "\n    " : ",\n    ") + dumpJson(annotation);
    }
    return text;
}

std::string SharedJson::end() {
    if (name_ == "coco.json") return "],\n\"images\": [" + held_ + "]}\n";
    return name_ == "objects.json" || name_ == "camera.json" ? "" : "\n}\n";
}

}  // namespace peeler
