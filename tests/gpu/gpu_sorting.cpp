// SPDX-License-Identifier: Apache-2.0
// Benchmark of sorting fragment lists. A quarter of the pixels have lists. The fragments of a list
// are in random order, which is different for each pixel, or the same for runs of neighbours.
// - cpu: depthSort(), as in peeler; cpuAfterGpu: depthSort() of sorted lists
// - gpu: a compute shader with one insertion sort per pixel; readBack: from GPU to CPU memory
#include <algorithm>
#include <cstdint>
#include <cstring>
#include <random>
#include <stdexcept>

#include "core/fragments/depth_sort.h"
#include "core/gl/objects.h"
#include "gpu/gpu_choices.h"

namespace peeler::benchmark {
namespace {

constexpr std::size_t kWords = 4;  // words per fragment: depth, primitive, two for colour

/// Lists with `most` / 2 to `most` fragments.
struct Lists {
    std::vector<std::uint32_t> first{0}, words;

    Lists(std::size_t pixels, std::uint32_t most, bool alike) {
        // If `alike`, 64 successive pixels have the same depths.
        const std::size_t run = alike ? 64 : 1;
        std::minstd_rand random(most);
        std::vector<float> depths(most);
        for (std::size_t pixel = 0; pixel < pixels; ++pixel) {
            if (pixel % run == 0)
                for (float& depth : depths)
                    // 64 different values, so that some depths are equal.
                    depth = static_cast<float>(random() % 64) / 64.0F;
            const std::uint32_t count =
                most - static_cast<std::uint32_t>(random() % (most / 2 + 1));
            for (std::uint32_t k = 0; k < count; ++k) {
                std::uint32_t bits = 0;
                std::memcpy(&bits, &depths[k], sizeof bits);
                words.insert(words.end(), {bits, k + 1, static_cast<std::uint32_t>(pixel), k});
            }
            first.push_back(first.back() + count);
        }
    }
};

constexpr const char* kSort = R"(
layout(local_size_x = 64) in;
layout(std430, binding = 0) readonly buffer First { uint first[]; };
layout(std430, binding = 1) readonly buffer Captured { uvec4 captured[]; };
layout(std430, binding = 2) writeonly buffer Sorted { uvec4 sorted[]; };

void main() {
    uint pixel = gl_GlobalInvocationID.x;
    if (pixel + 1u >= uint(first.length())) return;
    uint begin = first[pixel], count = first[pixel + 1u] - begin;
    uvec2 keys[MOST];  // depth, the greatest first, then primitive
    uint order[MOST];
    for (uint i = 0u; i < count; ++i) {
        uvec2 key = captured[begin + i].xy;
        uint at = i;
        for (; at > 0u; --at) {
            uvec2 before = keys[at - 1u];
            if (before.x > key.x || (before.x == key.x && before.y < key.y)) break;
            keys[at] = before;
            order[at] = order[at - 1u];
        }
        keys[at] = key;
        order[at] = i;
    }
    for (uint i = 0u; i < count; ++i) sorted[begin + i] = captured[begin + order[i]];
}
)";

template <class T>
gl::Buffer bufferOf(const gl::Functions& gl, const std::vector<T>& values) {
    gl::Buffer buffer(gl, values.size() * sizeof(T));
    const auto mapping = buffer.overwrite(buffer.size());
    std::ranges::copy(values, mapping.template as<T>());
    return buffer;
}

/// Sorts lists on the CPU into `out`. Returns the time in milliseconds.
double sortedByCpu(const Settings& settings, const Lists& lists, const std::uint32_t* words,
                   LayeredImage& out) {
    out.window = {0, 0, 256, static_cast<int>((lists.first.size() - 1) / 256)};
    out.color.channels = colorNames(false);
    const CapturedFragments captured{lists.first, words, kWords};
    return milliseconds(
        settings, [] {}, [&] { depthSort(captured, Projection{}, 0, out); });
}

Json sorted(const gl::Functions& gl, const Settings& settings, std::uint32_t most, bool alike) {
    const Lists lists(settings.pixels() / 4 / 256 * 256, most, alike);
    const gl::Buffer first = bufferOf(gl, lists.first), captured = bufferOf(gl, lists.words);
    const gl::Buffer in_order(gl, captured.size());
    const Shaders shaders(gl, "const uint MOST = " + std::to_string(most) + "u;\n",
                          {{GL_COMPUTE_SHADER, kSort}});
    shaders.use();
    first.bindStorage(0);
    captured.bindStorage(1);
    in_order.bindStorage(2);
    Json row{{"fragments", lists.first.back()}};
    row["gpu"] = milliseconds(
        settings, [&] { gl.Finish(); },
        [&] {
            gl.DispatchCompute(static_cast<GLuint>((lists.first.size() + 63) / 64), 1, 1);
            gl.MemoryBarrier(GL_ALL_BARRIER_BITS);
            gl.Finish();
        });
    gl::ReadBack copy;
    row["readBack"] = milliseconds(
        settings, [&] { gl.Finish(); },
        [&] {
            copy.copy(gl, in_order, captured.size());
            gl::Fence(gl).wait();
        });
    gl::checkErrors(gl, "sorting");
    const auto* const words = copy.as<const std::uint32_t>();
    LayeredImage by_cpu, by_both;
    row["cpu"] = sortedByCpu(settings, lists, lists.words.data(), by_cpu);
    row["cpuAfterGpu"] = sortedByCpu(settings, lists, words, by_both);
    const auto colors = by_cpu.color.as<std::uint32_t>();  // a fragment's colour identifies it
    for (std::size_t i = 0; i < by_cpu.fragments(); ++i)
        if (!std::equal(words + kWords * i + 2, words + kWords * (i + 1), &colors[2 * i]))
            throw std::runtime_error("lists of " + std::to_string(most) + " in another order");
    return row;
}

}  // namespace

Json sorting(const gl::Functions& gl, const Settings& settings) {
    Json result;
    for (const std::uint32_t most : {2U, 4U, 8U, 16U, 32U}) {
        const std::string name = "up to " + std::to_string(most);
        result[name] = sorted(gl, settings, most, false);
        result[name + ", alike"] = sorted(gl, settings, most, true);
    }
    return result;
}

}  // namespace peeler::benchmark
