// SPDX-License-Identifier: Apache-2.0
// Layout of a mask folder, write order of its files, and removal of leftover files.
#include "formats/masks/mask_folder.h"

#include <algorithm>
#include <cstdio>
#include <limits>
#include <nlohmann/json.hpp>
#include <system_error>
#include <utility>

#include <peeler/error.h>
#include "core/base/parallel.h"
#include "core/scene/view.h"
#include "formats/cameras/bop_lens.h"
#include "formats/file/atomic_file.h"
#include "formats/file/json_text.h"
#include "formats/file/regular_file.h"
#include "formats/image/image_writer.h"
#include "formats/masks/mask_json.h"

namespace peeler {

namespace fs = std::filesystem;

namespace {

constexpr const char* kMaskFolders[] = {"mask", "mask_visib"};
constexpr const char* kRecords = "views";
constexpr const char* kIds = "ids";
constexpr const char* kPictures = "rgb";
constexpr std::uint64_t kMostRecordBytes = std::uint64_t{1} << 30;

std::string viewDigits(std::size_t number, int count) {
    char text[32];
    std::snprintf(text, sizeof text, "%0*zu", count, number);
    return text;
}

std::unique_ptr<AtomicFile> textFile(const fs::path& path, const std::string& text) {
    auto file = std::make_unique<AtomicFile>(path.string());
    file->append(std::as_bytes(std::span(text)));
    return file;
}

std::uint64_t writtenBytes(const fs::path& file) {
    std::error_code failure;
    const std::uint64_t bytes = fs::file_size(file, failure);
    if (!failure) return bytes;
    throw Error(ErrorKind::kOutput, "the file is gone: " + failure.message(), file.string(),
                "something else has removed it, or its folder");
}

void removeFile(const fs::path& file) {
    std::error_code failure;
    fs::remove(file, failure);
    if (failure)
        throw Error(ErrorKind::kOutput, "cannot remove an outdated file: " + failure.message(),
                    file.string(), "check the permissions of the folder");
}

}  // namespace

/// The members of a view's record that describe the view's files.
struct MaskFolder::Record {
    std::string hash{};  ///< hash of the view; "" if the record is incomplete
    std::size_t masks = 0, layers = 0;
    bool rgb = false;  ///< whether the view has a colour picture
    std::uint64_t bytes = 0;
};

MaskFolder::MaskFolder(MaskFolderOptions options, std::vector<MaskedObject> objects)
    : options_(std::move(options)), objects_(std::move(objects)) {
    constexpr std::size_t kMostNumbers = std::numeric_limits<std::uint16_t>::max();
    if (!options_.formats.ids || objects_.empty()) return;
    const std::uint32_t greatest = std::ranges::max(objects_, {}, &MaskedObject::number).number;
    if (greatest > kMostNumbers)
        throw Error(
            ErrorKind::kUsage,
            "a picture of ids has 16 bits, too few for object number " + std::to_string(greatest),
            "", "leave pictures of ids out, or make fewer objects");
}

void MaskFolder::checkViews(std::span<const View> views) const {
    if (!options_.formats.bop) return;
    for (const View& view : views) {
        if (!view.projection.perspective)
            throw Error(ErrorKind::kUsage, "BOP has no orthographic cameras", view.camera_name,
                        "choose a perspective camera, or give " + Parameter::kAs + " coco,ids");
        const LensCamera* const lens = lensCameraOf(view);
        if (view.rays && !(lens && bopCameraModel(lens->lens, lens->intrinsics, {})))
            throw Error(ErrorKind::kUsage, "BOP has no lens like this", view.camera_name,
                        "give " + Parameter::kAs + " coco,ids");
        const Window &crop = view.crop, &first = views.front().crop;
        if (crop.width() != first.width() || crop.height() != first.height())
            throw Error(
                ErrorKind::kUsage, "BOP needs the same size for all pictures", view.camera_name,
                "give " + Parameter::kSize + ", or leave BOP out: " + Parameter::kAs + " coco,ids");
    }
}

bool MaskFolder::owns(const fs::path& file) const {
    std::error_code failure;
    const auto whole = [&](const fs::path& path) {
        return fs::weakly_canonical(fs::absolute(path, failure), failure);
    };
    const fs::path name = whole(file), folder = name.parent_path();
    for (const char* const below : {kMaskFolders[0], kMaskFolders[1], kIds, kRecords})
        if (folder == whole(options_.folder / below)) return true;
    if (options_.formats.rgb && folder == whole(options_.folder / kPictures)) return true;
    const std::vector<fs::path> shared = sharedFiles();
    return std::ranges::any_of(shared, [&](const fs::path& path) { return name == whole(path); });
}

fs::path MaskFolder::record(std::size_t view) const {
    return options_.folder / kRecords / (viewDigits(view, 6) + ".json");
}

/// Returns the path of the file that stands in for the record while the view's files are written.
fs::path MaskFolder::begun(std::size_t view) const {
    return record(view).replace_extension(".begun");
}

fs::path MaskFolder::picture(std::size_t view) const {
    return options_.folder / kPictures / (viewDigits(view, 6) + ".png");
}

std::vector<fs::path> MaskFolder::sharedFiles() const {
    std::vector<fs::path> names{"objects.json"};
    if (options_.formats.bop)
        names.insert(names.end(),
                     {"scene_gt.json", "scene_gt_info.json", "scene_camera.json", "camera.json"});
    if (options_.formats.coco) names.emplace_back("coco.json");
    for (fs::path& name : names)
        name = options_.folder / name;
    return names;
}

/// Returns the paths of a view's pictures: masks [begin_mask, masks) and layers [begin_layer,
/// layers).
std::vector<fs::path> MaskFolder::files(std::size_t view, std::size_t begin_mask, std::size_t masks,
                                        std::size_t begin_layer, std::size_t layers) const {
    std::vector<fs::path> all;
    for (std::size_t i = begin_mask; i < masks; ++i)
        for (const char* const folder : kMaskFolders)
            all.push_back(options_.folder / folder /
                          (viewDigits(view, 6) + '_' + viewDigits(i, 6) + ".png"));
    for (std::size_t i = begin_layer; i < layers; ++i)
        all.push_back(options_.folder / kIds /
                      (viewDigits(view, 6) + "_layer_" + viewDigits(i, 3) + ".png"));
    return all;
}

/// Reads a record. Returns an empty record if the file is missing or damaged.
MaskFolder::Record MaskFolder::readRecord(const fs::path& file) {
    Record record;
    if (!fileExists(file, ErrorKind::kOutput)) return record;
    const auto json = parseJsonOrNull(readRegularText(file, kMostRecordBytes));
    if (!json.is_object()) return record;
    bool whole = true;
    const auto number = [&](const char* key) -> std::uint64_t {
        const auto found = json.find(key);
        if (found != json.end() && found->is_number_unsigned()) return found->get<std::uint64_t>();
        whole = false;
        return 0;
    };
    // No view reaches these limits. Without them, a damaged record could make write() remove files
    // endlessly.
    record.masks = std::min<std::uint64_t>(number("masks"), 10'000'000);
    record.layers = std::min<std::uint64_t>(number("layers"), 100'000);
    record.rgb = json.contains("rgb");
    record.bytes = number("bytes");
    const auto hash = json.find("hash");
    if (whole && hash != json.end() && hash->is_string()) record.hash = hash->get<std::string>();
    return record;
}

std::optional<std::uint64_t> MaskFolder::bytesOf(std::size_t view, const std::string& hash) const {
    const Record record = readRecord(this->record(view));
    if (record.hash.empty() || record.hash != hash) return std::nullopt;
    std::uint64_t bytes = 0;
    std::vector<fs::path> all = files(view, 0, record.masks, 0, record.layers);
    if (record.rgb) all.push_back(picture(view));
    for (const fs::path& file : all) {
        std::error_code failure;
        bytes += fs::file_size(file, failure);
        if (failure) return std::nullopt;
    }
    if (bytes != record.bytes) return std::nullopt;
    return bytes + writtenBytes(this->record(view));
}

/// Writes the object numbers of a layer.
void MaskFolder::writeIds(AtomicFile& file, const MaskedView& view, std::uint32_t layer) const {
    std::vector<std::uint16_t> numbers = view.layers.layer(layer);
    for (std::uint16_t& number : numbers)
        if (number != 0) number = static_cast<std::uint16_t>(objects_[number - 1U].number);
    const Window& crop = view.view.crop;
    writeGreyPng(file, crop.width(), crop.height(), std::span<const std::uint16_t>(numbers),
                 options_.software);
}

std::uint64_t MaskFolder::write(const MaskedView& view) const {
    for (const fs::path& file : sharedFiles())
        removeFile(file);
    const Window& crop = view.view.crop;
    const int width = crop.width(), height = crop.height();
    // BOP lists only objects with pixels on the canvas.
    std::vector<std::size_t> listed;
    for (std::size_t i = 0; i < view.masks.size(); ++i)
        if (view.masks[i].canvas_pixels > 0) listed.push_back(i);
    const std::size_t masks = options_.formats.bop ? listed.size() : 0;
    const std::size_t pictures = options_.formats.ids ? view.layers.layers() : 0;
    const Record whole = readRecord(record(view.number)), killed = readRecord(begun(view.number));
    const std::size_t masks_before = std::max(whole.masks, killed.masks);
    const std::size_t pictures_before = std::max(whole.layers, killed.layers);
    const bool had_picture = whole.rgb || killed.rgb;
    nlohmann::json most = {{"masks", std::max(masks, masks_before)},
                           {"layers", std::max(pictures, pictures_before)}};
    if (had_picture || options_.formats.rgb) most["rgb"] = true;
    // Commit this file first: the next run finds in it which files a killed run may have left.
    textFile(begun(view.number), dumpJson(most) + '\n')->commit();
    removeFile(record(view.number));

    std::vector<fs::path> names = files(view.number, 0, masks, 0, pictures);
    const auto write_picture = [&](AtomicFile& file, std::size_t i) {
        if (i >= 2 * masks) return writeIds(file, view, static_cast<std::uint32_t>(i - 2 * masks));
        const ObjectMasks& of = view.masks[listed[i / 2]];
        std::vector<std::uint8_t> bytes(crop.pixels());
        (i % 2 == 0 ? of.amodal : of.visible).fill(255, bytes);
        writeGreyPng(file, width, height, bytes, options_.software);
    };
    // Write several files in parallel, because most of the time is waiting for the disk.
    constexpr std::size_t kAtOnce = 128;
    for (std::size_t first = 0; first < names.size(); first += kAtOnce) {
        std::vector<std::unique_ptr<AtomicFile>> some(std::min(kAtOnce, names.size() - first));
        parallelFor(some.size(), [&](std::size_t i) {
            some[i] = std::make_unique<AtomicFile>(names[first + i].string());
            write_picture(*some[i], first + i);
        });
        commitAll(some);
    }
    for (const fs::path& file : files(view.number, masks, masks_before, pictures, pictures_before))
        removeFile(file);
    if (options_.formats.rgb) {
        names.push_back(picture(view.number));
        view.write_rgb(names.back());
    } else if (had_picture) {
        removeFile(picture(view.number));
    }

    std::uint64_t bytes = 0;
    for (const fs::path& name : names)
        bytes += writtenBytes(name);
    nlohmann::json json = viewJson(view, options_.formats, objects_, listed);
    if (options_.formats.rgb) json["rgb"] = true;
    json["hash"] = view.hash;
    json["masks"] = masks;
    json["layers"] = pictures;
    json["bytes"] = bytes;
    const auto last = textFile(record(view.number), dumpJson(json) + '\n');
    last->commit();
    removeFile(begun(view.number));
    return bytes + last->size();
}

void MaskFolder::writeShared(std::size_t views) const {
    std::vector<std::unique_ptr<AtomicFile>> files;
    std::vector<SharedJson> texts;
    for (const fs::path& path : sharedFiles()) {
        files.push_back(std::make_unique<AtomicFile>(path.string()));
        texts.emplace_back(path.filename().string());
    }
    const auto append = [&](std::size_t i, const std::string& text) {
        files[i]->append(std::as_bytes(std::span(text)));
    };
    for (std::size_t i = 0; i < texts.size(); ++i)
        append(i, texts[i].begin(options_.by, objects_));
    // Read one record at a time, to use the same memory for any number of views.
    for (std::size_t view = 0; view < views; ++view) {
        const std::string text = readRegularText(record(view), kMostRecordBytes);
        try {
            const auto json = parseJson(text, record(view).string());
            for (std::size_t i = 0; i < texts.size(); ++i)
                append(i, texts[i].add(view, json));
        } catch (const nlohmann::json::exception& error) {
            throw Error(ErrorKind::kInput, std::string("the record is damaged: ") + error.what(),
                        record(view).string(), "remove it and run again");
        }
    }
    for (std::size_t i = 0; i < texts.size(); ++i)
        append(i, texts[i].end());
    commitAll(files);
}

}  // namespace peeler
