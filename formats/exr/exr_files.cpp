// SPDX-License-Identifier: Apache-2.0
// The parts of several files as one list, with checks that the files belong together.
#include "formats/exr/exr_files.h"

#include <algorithm>
#include <filesystem>

#include <peeler/error.h>
#include "formats/exr/exr_layout.h"
#include "formats/file/file_name.h"

namespace peeler {
namespace {

/// The attributes that must have the same values in all files of a set.
constexpr const char* kShared[] = {
    "peeler:layers", "peeler:sceneHash", "peeler:settingsHash",    "peeler:cameraJson",
    "peeler:frame",  "peeler:time",      "peeler:fragmentsCounted"};

bool sameRender(const ExrInputPart& a, const ExrInputPart& b) {
    for (const char* name : kShared) {
        if (a.attribute(name) != b.attribute(name)) return false;
    }
    return true;
}

/// Whether a file with these parts is the head of a set. The other files of a set hold one layer
/// each.
bool isHead(const std::vector<ExrInputPart>& parts) {
    return !parts.empty() && parts.front().attribute("peeler:layout") == kPerFileLayout &&
           parts.front().attribute("peeler:layer").empty();
}

}  // namespace

std::string exrLayerFile(const std::string& path, std::size_t layer) {
    const std::filesystem::path whole(path);
    return (whole.parent_path() /
            (whole.stem().string() + "." + layerName(layer) + whole.extension().string()))
        .string();
}

bool isExrLayerFile(const std::string& path, const std::string& head) {
    namespace fs = std::filesystem;
    std::error_code failure;
    const fs::path file = fs::weakly_canonical(fs::absolute(path), failure);
    const fs::path whole = fs::weakly_canonical(fs::absolute(head), failure);
    const std::string name = file.stem().string(), beginning = whole.stem().string() + ".";
    return file.parent_path() == whole.parent_path() && file.extension() == whole.extension() &&
           name.starts_with(beginning) &&
           layerNumber(std::string_view(name).substr(beginning.size())) >= 0;
}

std::vector<std::string> exrFilesOf(const std::string& path) {
    std::vector<std::string> files{path};
    try {
        if (fileKind(path) != FileKind::kExr) return files;
        const ExrInput input(path);
        if (!isHead(input.parts())) return files;
        const int layers = numberIn<int>(input.parts().front().attribute("peeler:layers"));
        for (int layer = 0; layer < std::min(layers, kMostLayers); ++layer)
            files.push_back(exrLayerFile(path, static_cast<std::size_t>(layer)));
    } catch (const Error&) {
        // The caller will find the same error when it reads the file.
    }
    return files;
}

ExrFiles::ExrFiles(const std::string& path) {
    add(path);
    addLayers();
}

void ExrFiles::add(const std::string& path) {
    files_.push_back(std::make_unique<ExrInput>(path));
    const std::vector<ExrInputPart>& parts = files_.back()->parts();
    for (std::size_t i = 0; i < parts.size(); ++i) {
        parts_.push_back(parts[i]);
        places_.push_back({files_.size() - 1, i});
    }
}

void ExrFiles::addLayers() {
    if (!isHead(parts_)) return;
    const ExrInputPart head = parts_.front();
    const int layers = numberIn<int>(head.attribute("peeler:layers"));
    if (layers < 0 || layers > kMostLayers)
        throw Error(ErrorKind::kInput, "the file has an implausible number of layers", path());
    for (int layer = 0; layer < layers; ++layer) {
        const std::string file = exrLayerFile(path(), static_cast<std::size_t>(layer));
        try {
            add(file);
        } catch (const Error& error) {
            throw Error(error.kind(), "a layer's file cannot be read: " + error.whatText(),
                        error.whereText(), "keep the files of " + path() + " together");
        }
        if (sameRender(head, parts_.back()) &&
            parts_.back().attribute("peeler:layer") == std::to_string(layer))
            continue;
        throw Error(ErrorKind::kInput, "the file belongs to another picture", file,
                    "keep the files of " + path() + " together, and remove others of that name");
    }
}

std::uint64_t ExrFiles::bytes() const {
    std::uint64_t sum = 0;
    for (const auto& file : files_)
        sum += file->bytes();
    return sum;
}

std::string ExrFiles::where(std::size_t part) const {
    const std::string& name = parts_[part].name;
    const std::string& path = files_[places_[part].file]->path();
    return name.empty() ? path : path + ": " + name;
}

int ExrFiles::rowsPerChunk(std::size_t part) const {
    return files_[places_[part].file]->rowsPerChunk(places_[part].part);
}

void ExrFiles::readChunk(std::size_t part, int y, const Window& window,
                         std::span<const ExrTarget> targets) const {
    files_[places_[part].file]->readChunk(places_[part].part, y, window, targets);
}

void ExrFiles::checkChunks(std::size_t part) const {
    files_[places_[part].file]->checkChunks(places_[part].part);
}

std::vector<StoredAttribute> ExrFiles::attributes(std::size_t part) const {
    return files_[places_[part].file]->attributes(places_[part].part);
}

std::size_t ExrFiles::deepBlocks(std::size_t part) const {
    return files_[places_[part].file]->deepBlocks(places_[part].part);
}

Window ExrFiles::deepBlockWindow(std::size_t part, std::size_t block) const {
    return files_[places_[part].file]->deepBlockWindow(places_[part].part, block);
}

void ExrFiles::readDeepBlock(std::size_t part, std::size_t block, bool counts_only,
                             ExrDeepBlock& out) const {
    files_[places_[part].file]->readDeepBlock(places_[part].part, block, counts_only, out);
}

}  // namespace peeler
