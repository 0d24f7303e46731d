// SPDX-License-Identifier: Apache-2.0
// The containers of arrays, a row each: where numbers lie in a file, and what stands around them.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "formats/arrays/array_writer.h"

namespace peeler {

/// An array in its place.
struct PlacedArray {
    NamedArray array;
    std::uint64_t numbers = 0;  ///< offset of the first number in the file
    std::string value{};        ///< the numbers, where they are known from the start
};

/// A file of arrays whose shapes and texts are known.
class ArrayContainer {
  public:
    virtual ~ArrayContainer() = default;

    /// The arrays that were given, in their order, then those that the container adds.
    const std::vector<PlacedArray>& arrays() const { return arrays_; }
    virtual std::uint64_t fileBytes() const = 0;
    /// Whether finish() needs checksums.
    virtual bool hasChecksums() const = 0;
    /// Writes everything but the numbers. `crcs` are the CRC-32 of the numbers of arrays(), if it
    /// needs them.
    virtual void finish(AtomicFile& file, std::span<const std::uint32_t> crcs) const = 0;

  protected:
    std::vector<PlacedArray> arrays_;
};

/// A container by its extension. New ones are a file and a row of kArrayContainers.
struct ArrayContainerRow {
    std::string_view extension;
    std::unique_ptr<ArrayContainer> (*make)(std::vector<NamedArray> arrays,
                                            const ArrayTexts& texts);
    std::string (*text)(const std::string& path, const std::string& name);  ///< arrayText()
};

/// A ZIP archive of .npy files (numpy.lib.format 1.0; PKWARE APPNOTE 6.3), not compressed as
/// numpy.savez does it, always with ZIP64 fields, dated 1980. numpy.load(path) reads it without
/// pickle.
std::unique_ptr<ArrayContainer> makeNpz(std::vector<NamedArray> arrays, const ArrayTexts& texts);
std::string npzText(const std::string& path, const std::string& name);

/// A .safetensors file (github.com/huggingface/safetensors, "Format"): the length of a header (8
/// bytes), the header as JSON, the arrays without gaps. The header is padded with blanks, and
/// arrays of larger numbers come first, so that each is aligned to its numbers.
std::unique_ptr<ArrayContainer> makeSafetensors(std::vector<NamedArray> arrays,
                                                const ArrayTexts& texts);
std::string safetensorsText(const std::string& path, const std::string& name);

}  // namespace peeler
