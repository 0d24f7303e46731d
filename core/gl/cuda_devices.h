// SPDX-License-Identifier: Apache-2.0
// The GPUs that CUDA_VISIBLE_DEVICES leaves, in its order, and the UUIDs that it names them by.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

namespace peeler::gl {

/// A GPU that has a number in CUDA.
struct CudaDevice {
    std::optional<int> ordinal;  ///< as the driver tells it; nothing = it does not
    std::string uuid;  ///< "8932f937-d72c-4106-c12f-20bd9faed9f6", or empty if it is not known
};

/// Positions in `devices` of those that are visible, in CUDA's order: the position of a position is
/// the number after "cuda:". `variable` is the value of CUDA_VISIBLE_DEVICES; nothing = not set,
/// all are visible by their ordinals. So are they where some have an ordinal and others have none:
/// a driver that asks CUDA finds the variable in the environment and numbers what it leaves. Else
/// all ordinals are those that CUDA gives without the variable, and the rules are CUDA's (CUDA
/// Programming Guide, "CUDA environment variables"): identifiers with commas between, each an
/// ordinal, the beginning of a UUID with "GPU-" before it that only one device has, or a slice of a
/// GPU, MIG-GPU-UUID/i/j; the first that names no device ends the list, and one that is named twice
/// empties it. A slice that has a UUID of its own (MIG-UUID) names none: EGL tells nothing of
/// slices.
std::vector<std::size_t> visibleCudaDevices(const std::optional<std::string>& variable,
                                            const std::vector<CudaDevice>& devices);

/// A UUID's hexadecimal digits in lower case, without "GPU-" and dashes; empty if there is another
/// character in it.
std::string uuidDigits(std::string text);

/// The value that setCudaVisibleDevices() was given, else what the environment has now.
std::optional<std::string> cudaVisibleDevices();

/// Says what CUDA_VISIBLE_DEVICES was, for a program that has taken it out of its own environment:
/// a driver that asks CUDA for its numbers then gives all devices theirs, as one does that does
/// not. Otherwise the environment is read whenever devices are listed; it is never changed. Call it
/// before the first context.
void setCudaVisibleDevices(std::string value);

/// What a UUID's 16 bytes are written like: "8932f937-d72c-4106-c12f-20bd9faed9f6".
std::string uuidText(const unsigned char* bytes);

}  // namespace peeler::gl
