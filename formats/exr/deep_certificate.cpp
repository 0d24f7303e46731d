// SPDX-License-Identifier: Apache-2.0
#include "formats/exr/deep_certificate.h"

#include <algorithm>
#include <array>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <span>
#include <vector>

#include "core/base/parallel.h"
#include "formats/file/json_text.h"

namespace peeler {
namespace {

std::string numberOf(double value) {
    std::array<char, 40> text{};
    std::snprintf(text.data(), text.size(), "%.8e", value);
    return text.data();
}

/// Returns the hash of a row's samples; 0 for a row without samples.
std::uint64_t rowHash(const LayeredImage& image, int y) {
    const std::size_t first = image.pixelIndex(image.window.x0, y);
    const auto width = static_cast<std::size_t>(image.window.width());
    const std::size_t begin = image.offsets[first], end = image.offsets[first + width];
    if (begin == end) return 0;
    std::vector<std::int32_t> counts;
    for (std::size_t x = 0; x < width; ++x) {
        if (const std::uint32_t count = image.count(first + x))
            counts.insert(counts.end(), {image.window.x0 + static_cast<int>(x), y,
                                         static_cast<std::int32_t>(count)});
    }
    ContentHasher hasher;
    hasher.add(std::as_bytes(std::span(counts)));
    hasher.add(std::as_bytes(std::span(image.z).subspan(begin, end - begin)));
    const std::size_t stride = image.color.stride();
    hasher.add(std::span(image.color.data).subspan(begin * stride, (end - begin) * stride));
    const FragmentChannel back = findChannel(image, "ZBack");
    std::vector<float> backs;
    for (std::size_t f = begin; back && f < end; ++f)
        backs.push_back(back.value(f));
    hasher.add(std::as_bytes(std::span(backs)));
    return hasher.value();
}

}  // namespace

std::string DeepCertificate::text() const {
    const std::string most = std::to_string(before), now = std::to_string(after);
    return "{\"error\":" + dumpJson(nlohmann::json(error)) + ",\"largest\":" + numberOf(largest) +
           ",\"norm\":\"at every depth: |T - T0|, |C - C0| / max(1, max |C0|)\"" +
           ",\"samplesBefore\":" + most + ",\"samplesAfter\":" + now + ",\"source\":\"" + source +
           "\"}" + std::string(most.size() - std::min(most.size(), now.size()), ' ');
}

std::optional<DeepCertificate> deepCertificateFrom(const std::string& text) {
    const nlohmann::json json = parseJsonOrNull(text);
    try {
        if (!json.is_object()) return {};
        return DeepCertificate{json.at("error").get<double>(), json.at("largest").get<double>(),
                               json.at("samplesBefore").get<std::uint64_t>(),
                               json.at("samplesAfter").get<std::uint64_t>(),
                               json.at("source").get<std::string>()};
    } catch (const nlohmann::json::exception&) {
        return {};  // another program changed the attribute
    }
}

void DeepSourceHash::add(const LayeredImage& image, int y0, int y1) {
    std::vector<std::uint64_t> rows(static_cast<std::size_t>(y1 - y0));
    parallelFor(rows.size(),
                [&](std::size_t row) { rows[row] = rowHash(image, y0 + static_cast<int>(row)); });
    std::erase(rows, 0);
    hasher_.add(std::as_bytes(std::span(rows)));
}

}  // namespace peeler
