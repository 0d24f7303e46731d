// SPDX-License-Identifier: Apache-2.0
// Fuzz target for point files (PLY or .npz), and for the other readers of arrays.
#include "formats/arrays/array_containers.h"
#include "formats/arrays/array_reader.h"
#include "formats/arrays/point_reader.h"
#include "fuzz/fuzz_target.h"

namespace peeler::fuzz {
namespace {

void takePoints(Input input) {
    const std::string path = fileOf("points", input);
    attempt([&] { readPoints(path); });
    attempt([&] { npzText(path, "output_hash"); });
    attempt([&] { safetensorsText(path, "output_hash"); });
    attempt([&] { npyText(input); });
    attempt([&] {
        const auto array = npyArray(input, "array");
        for (std::uint64_t i = 0; array && i < array->count(); ++i)
            array->at(i);
    });
}

}  // namespace
}  // namespace peeler::fuzz

PEELER_FUZZ_TARGET(points, peeler::fuzz::takePoints)
