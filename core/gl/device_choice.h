// SPDX-License-Identifier: Apache-2.0
// The choice of one device of several: by number, by CUDA's number or by UUID.
#pragma once

#include <optional>
#include <string>

namespace peeler::gl {

struct Device;

/// Which device of several. At most one of the three is given; none = the first one that works.
struct DeviceChoice {
    std::optional<int> index{};  ///< Device::index
    std::optional<int> cuda{};   ///< Device::cuda
    std::string uuid{};  ///< hexadecimal digits that Device::uuid starts with, in lower case

    bool given() const { return index || cuda || !uuid.empty(); }
    bool matches(const Device& device) const;
    /// As it is given: "3", "cuda:1", "uuid:8932f937"; "" if none is given.
    std::string text() const;
    bool operator==(const DeviceChoice&) const = default;
};

/// "3", "cuda:1", "uuid:GPU-8932f937-d72c", with or without "GPU-" and dashes. Throws Error
/// (kUsage) that says what is expected.
DeviceChoice parseDeviceChoice(const std::string& text);

}  // namespace peeler::gl
