// SPDX-License-Identifier: Apache-2.0
// The GPUs visible under CUDA_VISIBLE_DEVICES, in CUDA's order, and their UUIDs.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

namespace peeler::gl {

/// A GPU with a CUDA number.
struct CudaDevice {
    std::optional<int> ordinal;  ///< nullopt if the driver does not report the ordinal
    std::string uuid;            ///< "8932f937-d72c-4106-c12f-20bd9faed9f6"; empty if unknown
};

/// Returns the indices (into `devices`) of the visible GPUs in CUDA's order; a position in the
/// result is the number after "cuda:". `variable` is the value of CUDA_VISIBLE_DEVICES; nullopt =
/// not set.
///
/// If the variable is not set, the devices with an ordinal are visible, in the order of their
/// ordinals. The same holds if only some devices have an ordinal: a driver that asks CUDA finds the
/// variable in the environment and numbers only the visible devices.
///
/// If the variable is set and all devices have ordinals, the ordinals do not depend on the
/// variable, and CUDA's rules apply (CUDA Programming Guide, "CUDA environment variables"). The
/// variable is a comma-separated list of identifiers: an ordinal, the beginning of a UUID after
/// "GPU-" that matches only one device, or a slice of a GPU, MIG-GPU-UUID/i/j. An identifier that
/// names no device ends the list. A device named twice makes the list empty. A slice with its own
/// UUID (MIG-UUID) names no device, since EGL does not report slices.
std::vector<std::size_t> visibleCudaDevices(const std::optional<std::string>& variable,
                                            const std::vector<CudaDevice>& devices);

/// Returns a UUID's hexadecimal digits in lower case, without "GPU-" and dashes; empty if `text`
/// has any other character.
std::string uuidDigits(std::string text);

/// Returns the value given to setCudaVisibleDevices() or, if it was not called, the current value
/// in the environment.
std::optional<std::string> cudaVisibleDevices();

/// Sets the original value of CUDA_VISIBLE_DEVICES, for a program that has removed the variable
/// from its own environment. (Without the variable, drivers that ask CUDA number all devices, as
/// other drivers always do.) If this function is not called, peeler reads the environment whenever
/// it lists devices. Never changes the environment. Must be called before the first context is
/// opened.
void setCudaVisibleDevices(std::string value);

/// Returns a UUID's 16 bytes as text: "8932f937-d72c-4106-c12f-20bd9faed9f6".
std::string uuidText(const unsigned char* bytes);

}  // namespace peeler::gl
