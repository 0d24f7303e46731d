// SPDX-License-Identifier: Apache-2.0
// The choice of a device: by number, by CUDA number or by UUID.
#pragma once

#include <optional>
#include <string>

namespace peeler::gl {

struct Device;

/// A choice of device. At most one of the three members is set. If no member is set, the first
/// usable device is chosen.
struct DeviceChoice {
    std::optional<int> index{};  ///< Device::index
    std::optional<int> cuda{};   ///< Device::cuda
    std::string uuid{};          ///< leading hexadecimal digits of Device::uuid, lower case

    bool given() const { return index || cuda || !uuid.empty(); }
    bool matches(const Device& device) const;
    /// Returns the choice in the syntax of parseDeviceChoice(): "3", "cuda:1", "uuid:8932f937"; ""
    /// if no member is set.
    std::string text() const;
    bool operator==(const DeviceChoice&) const = default;
};

/// Parses "3", "cuda:1" or "uuid:GPU-8932f937-d72c", with or without "GPU-" and dashes. Throws
/// Error (kUsage) if the text has another form.
DeviceChoice parseDeviceChoice(const std::string& text);

}  // namespace peeler::gl
