// SPDX-License-Identifier: Apache-2.0
// One device of several, by its number, its UUID or its number in CUDA.
#pragma once

#include <optional>
#include <string>

namespace peeler::gl {

struct Device;

/// At most one of the three; none = the first device that works.
struct DeviceChoice {
    std::optional<int> index{};  ///< Device::index
    std::optional<int> cuda{};   ///< Device::cuda
    std::string uuid{};  ///< hexadecimal digits that Device::uuid starts with, in lower case

    bool given() const { return index || cuda || !uuid.empty(); }
    bool matches(const Device& device) const;
    /// As it is given: "3", "cuda:1", "uuid:8932f937"; "" if none is given.
    std::string text() const;
};

/// "3", "cuda:1", "uuid:GPU-8932f937-d72c", with or without "GPU-" and dashes. Throws Error
/// (kUsage) that says what is expected.
DeviceChoice parseDeviceChoice(const std::string& text);

/// What a UUID's 16 bytes are written like: "8932f937-d72c-4106-c12f-20bd9faed9f6".
std::string uuidText(const unsigned char* bytes);

}  // namespace peeler::gl
