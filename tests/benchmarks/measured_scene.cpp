// SPDX-License-Identifier: Apache-2.0
#include "benchmarks/measured_scene.h"

#include <sys/resource.h>

#include <chrono>
#include <cmath>
#include <cstdio>
#include <exception>
#include <numbers>
#include <sstream>

#include <peeler/error.h>
#include "cmd/machine/resources.h"
#include "cmd/options/camera_options.h"
#include "cmd/session/scene_request.h"

namespace peeler::benchmark {
namespace {

std::vector<std::string> listOf(const std::string& text) {
    std::vector<std::string> items;
    std::istringstream list(text);
    for (std::string item; std::getline(list, item, ',');)
        items.push_back(item);
    return items;
}

View viewOf(const PosedScene& posed, const Options& options) {
    cmd::CameraOptions camera;
    camera.size = {options.width, options.height};
    return cmd::makeView(posed, SceneExtent(posed), camera);
}

Scene sceneOf(const std::string& file) {
    cmd::SceneRequest request;
    request.scene.file = file;
    return cmd::loadScene(request);
}

}  // namespace

Options parse(int count, char** arguments) {
    Options options;
    for (int i = 1; i < count; ++i) {
        const std::string argument = arguments[i];
        const auto value = [&] { return std::string(++i < count ? arguments[i] : ""); };
        if (argument == "--size") {
            if (std::sscanf(value().c_str(), "%dx%d", &options.width, &options.height) != 2)
                throw Error(ErrorKind::kUsage, "a size is WxH", "--size");
        } else if (argument == "--bundles") {
            options.bundles = std::stoi(value());
        } else if (argument == "--lens") {
            options.lens = value();
        } else if (argument == "--runs") {
            options.runs = std::stoi(value());
        } else if (argument == "--what") {
            options.what = listOf(value());
        } else if (argument == "--folder") {
            options.folder = value();
        } else {
            options.scene = argument;
        }
    }
    if (options.scene.empty()) throw Error(ErrorKind::kUsage, "no scene was named", arguments[0]);
    cmd::setThreads(0);
    return options;
}

MeasuredScene::MeasuredScene(const Options& options)
    : scene(sceneOf(options.scene)), posed(scene), view(viewOf(posed, options)) {}

nlohmann::json cameraJson(const View& view) {
    const glm::dmat4& m = view.camera_to_world;
    const glm::dvec3 eye(m[3]), target = eye - glm::dvec3(m[2]);
    const double fov = 2 * std::atan(view.projection.half_height) * 180 / std::numbers::pi;
    return {{"eye", {eye.x, eye.y, eye.z}},
            {"target", {target.x, target.y, target.z}},
            {"up", {m[1].x, m[1].y, m[1].z}},
            {"fov", fov},
            {"near", view.projection.near}};
}

double milliseconds(const std::function<void()>& work) {
    using Clock = std::chrono::steady_clock;
    const Clock::time_point start = Clock::now();
    work();
    return std::chrono::duration<double, std::milli>(Clock::now() - start).count();
}

double processorMilliseconds() {
    rusage usage{};
    getrusage(RUSAGE_SELF, &usage);
    const auto in_milliseconds = [](const timeval& time) {
        return 1e3 * static_cast<double>(time.tv_sec) + 1e-3 * static_cast<double>(time.tv_usec);
    };
    return in_milliseconds(usage.ru_utime) + in_milliseconds(usage.ru_stime);
}

nlohmann::json timesInTurn(const std::vector<Contender>& contenders, int runs) {
    nlohmann::json times = nlohmann::json::object();
    for (const Contender& contender : contenders) {
        contender.work();
        times[contender.name] = nlohmann::json::array();
    }
    for (int i = 0; i < runs; ++i)
        for (const Contender& contender : contenders)
            times[contender.name].push_back(milliseconds(contender.work));
    return times;
}

int run(int count, char** arguments, const std::function<nlohmann::json(const Options&)>& measure) {
    try {
        std::printf("%s\n", measure(parse(count, arguments)).dump(1).c_str());
        return 0;
    } catch (const std::exception& error) {
        std::fprintf(stderr, "%s: %s\n", arguments[0], error.what());
        return 2;
    }
}

}  // namespace peeler::benchmark
