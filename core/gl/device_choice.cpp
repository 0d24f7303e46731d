// SPDX-License-Identifier: Apache-2.0
#include "core/gl/device_choice.h"

#include <charconv>
#include <string_view>

#include <peeler/error.h>
#include "core/gl/context.h"
#include "core/gl/cuda_devices.h"

namespace peeler::gl {
namespace {

[[noreturn]] void refuse() {
    throw Error(ErrorKind::kUsage, "expected a device's number from " + Parameter::kListDevices +
                                       ", cuda: and its CUDA number, or "
                                       "uuid: and the beginning of its UUID");
}

int number(std::string_view text) {
    constexpr int kMost = 9999;
    int value = 0;
    const auto [end, failure] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (failure != std::errc() || end != text.data() + text.size() || value < 0 || value > kMost)
        refuse();
    return value;
}

}  // namespace

bool DeviceChoice::matches(const Device& device) const {
    if (index) return device.index == *index;
    if (cuda) return device.cuda == cuda;
    if (!uuid.empty()) return uuidDigits(device.uuid).starts_with(uuid);
    return true;
}

std::string DeviceChoice::text() const {
    if (index) return std::to_string(*index);
    if (cuda) return "cuda:" + std::to_string(*cuda);
    return uuid.empty() ? "" : "uuid:" + uuid;
}

DeviceChoice parseDeviceChoice(const std::string& text) {
    constexpr std::string_view kCuda = "cuda:", kUuid = "uuid:";
    DeviceChoice choice;
    if (text.starts_with(kCuda)) {
        choice.cuda = number(std::string_view(text).substr(kCuda.size()));
    } else if (text.starts_with(kUuid)) {
        choice.uuid = uuidDigits(text.substr(kUuid.size()));
        if (choice.uuid.empty()) refuse();
    } else {
        choice.index = number(text);
    }
    return choice;
}

}  // namespace peeler::gl
