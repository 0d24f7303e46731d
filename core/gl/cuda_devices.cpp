// SPDX-License-Identifier: Apache-2.0
#include "core/gl/cuda_devices.h"

#include <algorithm>
#include <charconv>
#include <cstdlib>
#include <mutex>
#include <string_view>
#include <utility>

namespace peeler::gl {
namespace {

/// Returns the only device that matches the predicate; nullopt if no device or several match.
template <class Predicate>
std::optional<std::size_t> only(const std::vector<CudaDevice>& devices, Predicate matches) {
    const auto first = std::find_if(devices.begin(), devices.end(), matches);
    if (first == devices.end() || std::find_if(first + 1, devices.end(), matches) != devices.end())
        return std::nullopt;
    return static_cast<std::size_t>(first - devices.begin());
}

std::optional<std::size_t> named(std::string_view identifier,
                                 const std::vector<CudaDevice>& devices) {
    constexpr std::string_view kSlice = "MIG-GPU-", kGpu = "GPU-";
    if (identifier.starts_with(kSlice)) {
        identifier = identifier.substr(0, identifier.find('/'));
        identifier.remove_prefix(kSlice.size() - kGpu.size());
    }
    if (identifier.starts_with(kGpu)) {
        const std::string digits = uuidDigits(std::string(identifier));
        if (digits.empty()) return std::nullopt;
        return only(devices, [&](const CudaDevice& device) {
            return uuidDigits(device.uuid).starts_with(digits);
        });
    }
    int ordinal = 0;
    const char* end = identifier.data() + identifier.size();
    const auto [stop, failure] = std::from_chars(identifier.data(), end, ordinal);
    if (failure != std::errc() || stop != end) return std::nullopt;
    return only(devices, [&](const CudaDevice& device) { return device.ordinal == ordinal; });
}

/// Returns the devices with an ordinal, sorted by ordinal.
std::vector<std::size_t> byOrdinal(const std::vector<CudaDevice>& devices) {
    std::vector<std::size_t> found;
    for (std::size_t i = 0; i < devices.size(); ++i)
        if (devices[i].ordinal) found.push_back(i);
    std::stable_sort(found.begin(), found.end(), [&](std::size_t a, std::size_t b) {
        return *devices[a].ordinal < *devices[b].ordinal;
    });
    return found;
}

std::string_view trimmed(std::string_view text) {
    const std::size_t first = text.find_first_not_of(" \t");
    if (first == std::string_view::npos) return {};
    return text.substr(first, text.find_last_not_of(" \t") + 1 - first);
}

/// The value passed to setCudaVisibleDevices().
struct Told {
    std::mutex mutex;
    std::optional<std::string> value;
};

Told& told() {
    static Told instance;
    return instance;
}

}  // namespace

std::vector<std::size_t> visibleCudaDevices(const std::optional<std::string>& variable,
                                            const std::vector<CudaDevice>& devices) {
    std::vector<std::size_t> visible = byOrdinal(devices);
    if (!variable || visible.size() < devices.size()) return visible;
    visible.clear();
    for (std::string_view rest = *variable;;) {
        const std::size_t end = rest.find(',');
        const auto device = named(trimmed(rest.substr(0, end)), devices);
        if (!device) return visible;
        if (std::find(visible.begin(), visible.end(), *device) != visible.end()) return {};
        visible.push_back(*device);
        if (end == std::string_view::npos) return visible;
        rest.remove_prefix(end + 1);
    }
}

std::string uuidDigits(std::string text) {
    for (char& c : text)
        if (c >= 'A' && c <= 'Z') c = static_cast<char>(c + 32);
    if (text.starts_with("gpu-")) text.erase(0, 4);
    std::erase(text, '-');
    return text.find_first_not_of("0123456789abcdef") == std::string::npos ? text : "";
}

std::string uuidText(const unsigned char* bytes) {
    static constexpr char kDigits[] = "0123456789abcdef";
    std::string text;
    for (int i = 0; i < 16; ++i) {
        if (i == 4 || i == 6 || i == 8 || i == 10) text += '-';
        text += {kDigits[bytes[i] >> 4], kDigits[bytes[i] & 15]};
    }
    return text;
}

void setCudaVisibleDevices(std::string value) {
    const std::lock_guard lock(told().mutex);
    told().value = std::move(value);
}

std::optional<std::string> cudaVisibleDevices() {
    {
        const std::lock_guard lock(told().mutex);
        if (told().value) return told().value;
    }
    const char* const value = std::getenv("CUDA_VISIBLE_DEVICES");
    return value ? std::optional<std::string>(value) : std::nullopt;
}

}  // namespace peeler::gl
