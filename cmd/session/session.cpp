// SPDX-License-Identifier: Apache-2.0
#include "cmd/session/session.h"

#include <algorithm>
#include <chrono>
#include <utility>

#include <peeler/error.h>
#include "core/base/process_memory.h"

namespace peeler::cmd {

namespace {

/// Returns the states of all files that determine the scene. Adds the folder's state if the reader
/// warned, because a file may be missing: when this file appears, the folder's state changes.
std::vector<FileState> statesOf(const SceneRequest& request, const Scene& scene) {
    std::vector<FileState> states{fileState(request.scene.file)};
    for (const std::filesystem::path& file : scene.files)
        states.push_back(fileState(file));
    if (const auto file = environmentFile(request.appearance)) states.push_back(fileState(*file));
    if (!scene.warnings.empty()) {
        const std::filesystem::path folder = request.scene.file.parent_path();
        states.push_back(fileState(folder.empty() ? "." : folder));
    }
    return states;
}

bool areUnchanged(const std::vector<FileState>& files) {
    return std::ranges::all_of(files,
                               [](const FileState& file) { return file == fileState(file.path); });
}

/// Whether no file changed shortly before reading began. File-system clocks are coarse: a file that
/// was just written may change again and keep its time stamp.
bool areSettled(const std::vector<FileState>& files, std::chrono::system_clock::time_point begin) {
    constexpr std::chrono::milliseconds kWhile{100};
    const std::chrono::nanoseconds latest = (begin - kWhile).time_since_epoch();
    return std::ranges::all_of(
        files, [&](const FileState& file) { return file.modified <= latest.count(); });
}

std::uint64_t grownBy(std::uint64_t before) {
    const std::uint64_t now = residentBytes();
    return now > before ? now - before : 0;
}

}  // namespace

void checkEngine(RayEngine engine, const gl::ContextRequest& device) {
    if (engine != RayEngine::kCpu || !device.choosesDevice()) return;
    std::string options;
    if (device.backend != "auto") options += ", --backend " + device.backend;
    if (device.device.given()) options += ", --device " + device.device.text();
    if (device.require_gpu) options += ", --require-gpu";
    throw Error(ErrorKind::kUsage, "the cpu engine uses no GL device", "--engine cpu" + options,
                "leave one of them out, or choose --engine gl");
}

Session::Session(Reporter& reporter, std::uint64_t keep)
    : reporter_(&reporter), keep_(keep), gl_(keep > 0) {}

SharedScene Session::open(const SceneRequest& request) {
    const auto known = std::ranges::find(scenes_, request, &KeptScene::request);
    if (known != scenes_.end()) {
        if (areUnchanged(known->files)) {
            for (const Text& warning : known->scene->scene().warnings)
                reporter_->warning(warning);
            scenes_.splice(scenes_.begin(), scenes_, known);
            return known->scene;
        }
        scenes_.erase(known);
    }
    const auto begin = std::chrono::system_clock::now();
    const std::uint64_t before = residentBytes();
    auto scene = std::make_shared<const OpenedScene>(request, *reporter_);
    std::vector<FileState> files = statesOf(request, scene->scene());
    if (keep_ > 0 && areSettled(files, begin)) {
        scenes_.push_front({request, scene, std::move(files), grownBy(before)});
        evict();
    }
    return scene;
}

GlRenderer& Session::renderer(const gl::ContextRequest& device, const SharedScene& scene,
                              const PosedScene& posed) {
    // shares ownership with the OpenedScene
    const std::shared_ptr<const Scene> shown(scene, scene ? &scene->scene() : nullptr);
    GlRenderer& renderer = gl_.renderer(device, shown, scene ? scene->index() : 0, posed);
    evict();
    return renderer;
}

/// Evicts the oldest renderers and scenes while the kept bytes exceed the limit. Keeps the most
/// recent scene and renderer, which a run is using.
void Session::evict() {
    const auto bytes = [this] {
        std::uint64_t sum = gl_.uploadedBytes();
        for (const KeptScene& scene : scenes_)
            sum += scene.bytes;
        return sum;
    };
    while (bytes() > keep_) {
        if (gl_.closeOldest()) continue;
        if (scenes_.size() < 2) return;
        scenes_.pop_back();
    }
}

void Session::release() {
    if (keep_ == 0) return close();
    gl_.closeUnowned();
}

bool Session::forget() {
    const bool had = hasContext() || !scenes_.empty();
    close();
    scenes_.clear();
    return had;
}

}  // namespace peeler::cmd
