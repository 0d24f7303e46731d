// SPDX-License-Identifier: Apache-2.0
// peeler devices: all GL backends and devices, with the reason why a device cannot be used.
#include <algorithm>
#include <memory>
#include <nlohmann/json.hpp>

#include <peeler/error.h>
#include "cmd/cli/arguments.h"
#include "cmd/cli/report.h"
#include "cmd/machine/limits.h"
#include "cmd/machine/resources.h"
#include "cmd/session/session.h"
#include "cmd/verbs.h"
#include "core/base/memory_budget.h"
#include "core/gl/context.h"

namespace peeler::cmd {

namespace {

struct DevicesOptions {
    bool json = false;
};

nlohmann::ordered_json toJson(const gl::Device& device) {
    const gl::Limits& limits = device.limits;
    nlohmann::ordered_json json;
    json["index"] = device.index;
    json["backend"] = device.backend;
    json["name"] = device.name;
    json["usable"] = device.problem.empty();
    json["problem"] = device.problem;
    json["software"] = device.software;
    json["uuid"] = device.uuid;
    if (device.cuda) json["cuda"] = *device.cuda;
    json["version"] = device.version;
    json["renderer"] = device.renderer;
    json["vendor"] = device.vendor;
    json["limits"] = {
        {"shaderStorageBlockSize", limits.shader_storage_block_size},
        {"fragmentStorageBlocks", limits.fragment_storage_blocks},
        {"framebufferWidth", limits.framebuffer_width},
        {"framebufferHeight", limits.framebuffer_height},
        {"viewportWidth", limits.viewport_width},
        {"viewportHeight", limits.viewport_height},
        {"textureSize", limits.texture_size},
        {"subpixelBits", limits.subpixel_bits},
    };
    return json;
}

std::string toText(const gl::Device& device) {
    const gl::Limits& limits = device.limits;
    std::string text =
        std::to_string(device.index) + "  " + device.backend + "  " + device.name + '\n';
    const auto line = [&](const std::string& content) { text += "     " + content + '\n'; };
    if (device.cuda) line("cuda:" + std::to_string(*device.cuda));
    if (!device.uuid.empty()) line("uuid:" + device.uuid);
    if (!device.renderer.empty()) line(device.renderer + (device.software ? " (software)" : ""));
    if (!device.version.empty()) line("OpenGL " + device.version + ", " + device.vendor);
    if (!device.problem.empty()) {
        line("cannot be used: " + device.problem);
        return text;
    }
    const auto area = [](int width, int height) {
        return std::to_string(width) + " x " + std::to_string(height);
    };
    line("framebuffer " + area(limits.framebuffer_width, limits.framebuffer_height) +
         ", viewport " + area(limits.viewport_width, limits.viewport_height) + ", texture " +
         area(limits.texture_size, limits.texture_size));
    line(std::to_string(limits.fragment_storage_blocks) + " storage blocks of " +
         groupedText(static_cast<std::uint64_t>(
             std::max<std::int64_t>(0, limits.shader_storage_block_size))) +
         " bytes, " + std::to_string(limits.subpixel_bits) + " subpixel bits");
    return text;
}

nlohmann::ordered_json machineJson() {
    const Limit threads = allowedThreads();
    nlohmann::ordered_json json;
    json["threads"] = {{"count", threads.amount}, {"source", threads.source}};
    json["memory"] = nullptr;
    if (const auto memory = allowedMemory()) {
        json["memory"] = {{"bytes", memory->amount},
                          {"budget", budgetUnder(*memory).bytes},
                          {"source", memory->source}};
    }
    return json;
}

std::string machineText() {
    const Limit threads = allowedThreads();
    std::string text =
        "--threads " + std::to_string(threads.amount) + " (" + threads.source + ")\n";
    const auto memory = allowedMemory();
    if (!memory) return text + "--memory: no limit\n";
    const MemoryBudget budget = budgetUnder(*memory);
    return text + "--memory " + mebibytesText(budget) + " (" + budget.source + ")\n";
}

int listAll(const DevicesOptions& options, Reporter& reporter) {
    setThreads(0);
    takeVisibleGpus();
    const std::vector<gl::Device> devices = gl::listDevices();
    if (options.json) {
        nlohmann::ordered_json json = machineJson();
        json["devices"] = nlohmann::ordered_json::array();
        for (const auto& device : devices)
            json["devices"].push_back(toJson(device));
        reporter.result(json);
    } else {
        std::string text = machineText();
        for (const auto& device : devices)
            text += toText(device);
        reporter.text(text);
    }
    if (std::any_of(devices.begin(), devices.end(),
                    [](const gl::Device& device) { return device.problem.empty(); })) {
        return 0;
    }
    throw Error(ErrorKind::kDevice, "no GL device can be used", "", gl::kInstallDriver);
}

}  // namespace

VerbAction declareDevices(VerbOptions& verb) {
    const auto options = std::make_shared<DevicesOptions>();
    verb.addFlag("--json", options->json, "print JSON");
    return [options](Session& session) { return listAll(*options, session.reporter()); };
}

}  // namespace peeler::cmd
