// SPDX-License-Identifier: Apache-2.0
// The array containers, .npz and .safetensors, and the layout of their files.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "formats/arrays/array_writer.h"

namespace peeler {

/// An array and its offset in the file.
struct PlacedArray {
    NamedArray array;
    std::uint64_t numbers = 0;  ///< offset of the array's data in the file
    std::string value{};        ///< contents of the data, if known at construction
};

/// The layout of a file of arrays with known shapes and texts.
class ArrayContainer {
  public:
    virtual ~ArrayContainer() = default;

    /// Returns the arrays passed to the constructor, in order, then the container's own arrays.
    const std::vector<PlacedArray>& arrays() const { return arrays_; }
    virtual std::uint64_t fileBytes() const = 0;
    /// Whether finish() needs a CRC-32 of each array.
    virtual bool hasChecksums() const = 0;
    /// Writes everything except the array data. If hasChecksums(), `crcs` holds the CRC-32 of each
    /// array's data, in the order of arrays().
    virtual void finish(AtomicFile& file, std::span<const std::uint32_t> crcs) const = 0;

    /// Whether the container supports compress().
    virtual bool canCompress() const { return false; }
    /// Writes the whole file, with the arrays' data compressed. `crcs` as for finish(). Frees
    /// `values`.
    virtual void compress(AtomicFile& /*file*/, std::span<const std::uint32_t> /*crcs*/,
                          std::span<ByteBuffer> /*values*/) const {}

  protected:
    std::vector<PlacedArray> arrays_;
};

/// A container and its extension. A new container needs a source file and a row in
/// kArrayContainers.
struct ArrayContainerRow {
    std::string_view extension;
    std::unique_ptr<ArrayContainer> (*make)(std::vector<NamedArray> arrays,
                                            const ArrayTexts& texts);
    /// Implements arrayText().
    std::string (*text)(const std::string& path, const std::string& name);
};

/// Makes a ZIP archive of .npy files (numpy.lib.format 1.0; PKWARE APPNOTE 6.3), uncompressed like
/// numpy.savez, or with DEFLATE like numpy.savez_compressed, always with ZIP64 fields, dated 1980.
/// numpy.load(path) reads it without pickle.
std::unique_ptr<ArrayContainer> makeNpz(std::vector<NamedArray> arrays, const ArrayTexts& texts);
std::string npzText(const std::string& path, const std::string& name);

/// Makes a .safetensors file (github.com/huggingface/safetensors, "Format"): the length of the
/// header (8 bytes), the header as JSON, padded with blanks, and the arrays, without gaps. Arrays
/// of wider elements come first, so that each array is aligned to its element size.
std::unique_ptr<ArrayContainer> makeSafetensors(std::vector<NamedArray> arrays,
                                                const ArrayTexts& texts);
std::string safetensorsText(const std::string& path, const std::string& name);

}  // namespace peeler
