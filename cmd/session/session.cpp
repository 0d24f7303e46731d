// SPDX-License-Identifier: Apache-2.0
#include "cmd/session/session.h"

#include <algorithm>
#include <chrono>
#include <utility>

#include "core/base/error.h"
#include "core/base/process_memory.h"

namespace peeler::cmd {

namespace {

/// The states of all files that decide what the scene is. Where readers warn, a file may have been
/// missing, so the folder of the scene counts, too.
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

/// Whether all files had been as they are for a while when reading them began. The clock of a file
/// system goes in steps, so one that has just been written may change again and look the same.
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

bool asksForDevice(const gl::ContextRequest& device) {
    return device.backend != "auto" || device.device.given() || device.require_gpu;
}

void checkEngine(Engine engine, const gl::ContextRequest& device) {
    if (engine != Engine::kCpu || !asksForDevice(device)) return;
    std::string options;
    if (device.backend != "auto") options += ", --backend " + device.backend;
    if (device.device.given()) options += ", --device " + device.device.text();
    if (device.require_gpu) options += ", --require-gpu";
    throw Error(ErrorKind::kUsage, "the CPU finds hits without a GL device",
                "--engine cpu" + options, "leave out one or the other, or choose --engine gl");
}

Session::Session(Reporter& reporter, std::uint64_t keep) : reporter_(&reporter), keep_(keep) {}

Session::~Session() {
    close();
}

SharedScene Session::open(const SceneRequest& request) {
    const auto known = std::ranges::find(scenes_, request, &KeptScene::request);
    if (known != scenes_.end()) {
        if (areUnchanged(known->files)) {
            for (const std::string& warning : known->scene->scene().warnings)
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

gl::Context& Session::context(const gl::ContextRequest& device) {
    if (context_ && request_ == device) return *context_;
    close();
    context_ = gl::createContext(device);
    request_ = device;
    return *context_;
}

bool Session::findGpu(std::string& reasons) {
    const gl::ContextRequest any;  // which comes to the first GPU, where there is one
    if (context_ && request_ == any && !context_->device().software) return true;
    reasons = no_gpu_;
    if (!no_gpu_.empty()) return false;
    std::vector<std::string> attempts;
    std::unique_ptr<gl::Context> found = gl::findGpuContext(&attempts);
    if (!found) {
        for (const std::string& attempt : attempts)
            no_gpu_ += (no_gpu_.empty() ? "" : "; ") + attempt;
        reasons = no_gpu_;
        return false;
    }
    close();
    context_ = std::move(found);
    request_ = any;
    return true;
}

GlRenderer& Session::renderer(const gl::ContextRequest& device, const SharedScene& scene,
                              const PosedScene& posed) {
    gl::Context& context = this->context(device);
    const auto known = std::ranges::find_if(
        renderers_, [&](const KeptRenderer& kept) { return scene && kept.scene == scene; });
    if (known != renderers_.end()) {
        renderers_.splice(renderers_.begin(), renderers_, known);
        known->renderer->setPose(posed);
        return *known->renderer;
    }
    if (keep_ == 0) renderers_.clear();
    const std::uint64_t before = residentBytes();
    renderers_.push_front({scene, std::make_unique<GlRenderer>(context, posed), 0});
    renderers_.front().bytes = grownBy(before);
    evict();
    return *renderers_.front().renderer;
}

/// The scene and the renderer that were used last always stay: a run is using them.
void Session::evict() {
    const auto bytes = [this] {
        std::uint64_t sum = 0;
        for (const KeptScene& scene : scenes_)
            sum += scene.bytes;
        for (const KeptRenderer& renderer : renderers_)
            sum += renderer.bytes;
        return sum;
    };
    while (bytes() > keep_) {
        if (renderers_.size() > 1)
            renderers_.pop_back();
        else if (scenes_.size() > 1)
            scenes_.pop_back();
        else
            return;
    }
}

void Session::release() {
    if (keep_ == 0) return close();
    std::erase_if(renderers_, [](const KeptRenderer& kept) { return !kept.scene; });
}

void Session::close() {
    renderers_.clear();
    context_.reset();
}

bool Session::forget() {
    const bool had = context_ || !scenes_.empty();
    close();
    scenes_.clear();
    return had;
}

}  // namespace peeler::cmd
