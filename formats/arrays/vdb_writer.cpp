// SPDX-License-Identifier: Apache-2.0
// .vdb writer: the file around the grid. The code that uses OpenVDB is in
// formats/modules/vdb_grid.cpp.
#include "formats/arrays/vdb_writer.h"

#include <array>
#include <cstdio>
#include <exception>
#include <new>
#include <ostream>
#include <streambuf>

#include <peeler/error.h>
#include "core/base/parallel.h"
#include "formats/file/module.h"

namespace peeler {
namespace {

// The position and size of the UUID. Archive::writeHeader in OpenVDB 10 begins the file with: magic
// number (8 bytes), versions of format (4) and library (2 × 4), presence of offsets (1), then the
// UUID as text.
constexpr std::uint64_t kUuidAt = 21, kUuidSize = 36;

/// A 64-bit FNV-1a hash of a file's bytes, without its UUID.
class ContentHash {
  public:
    explicit ContentHash(std::uint64_t basis) : hash_(basis) {}

    void add(std::uint64_t position, std::span<const char> bytes) {
        for (const char byte : bytes) {
            // The unsigned difference of a position before the UUID wraps around.
            if (position - kUuidAt >= kUuidSize) {
                hash_ = (hash_ ^ static_cast<std::uint8_t>(byte)) * 0x100000001B3U;
            }
            ++position;
        }
    }
    std::uint64_t value() const { return hash_; }

  private:
    std::uint64_t hash_;
};

/// A stream buffer through which OpenVDB writes to the AtomicFile. Exceptions cannot pass through
/// streams, so they are kept in `failure`.
class FileBuffer : public std::streambuf {
  public:
    explicit FileBuffer(AtomicFile& file) : file_(file) {}

    /// Returns a UUID made from the hashes of all bytes written so far.
    std::string uuid() const {
        std::array<char, 33> hex{};
        std::snprintf(hex.data(), hex.size(), "%016llx%016llx",
                      static_cast<unsigned long long>(high_.value()),
                      static_cast<unsigned long long>(low_.value()));
        std::string text(hex.data());
        for (const std::size_t dash : std::array<std::size_t, 4>{8, 13, 18, 23})
            text.insert(dash, 1, '-');
        return text;
    }

    std::exception_ptr failure;

  protected:
    std::streamsize xsputn(const char* bytes, std::streamsize count) override {
        if (failure) return 0;
        try {
            const std::span text(bytes, static_cast<std::size_t>(count));
            high_.add(file_.size(), text);
            low_.add(file_.size(), text);
            file_.append(std::as_bytes(text));
            return count;
        } catch (...) {
            failure = std::current_exception();
            return 0;
        }
    }
    int_type overflow(int_type letter) override {
        const char byte = traits_type::to_char_type(letter);
        return xsputn(&byte, 1) == 1 ? letter : traits_type::eof();
    }
    /// Returns the current position, which is always the end of the file. Returns −1 if another
    /// position is requested.
    pos_type seekoff(off_type offset, std::ios_base::seekdir from,
                     std::ios_base::openmode) override {
        if (offset != 0 || from == std::ios_base::beg) return pos_type(off_type(-1));
        return static_cast<off_type>(file_.size());
    }

  private:
    AtomicFile& file_;
    ContentHash high_{0xCBF29CE484222325U}, low_{0x9AE16A3B2F90404FU};
};

}  // namespace

void writeVdb(AtomicFile& file, const VdbVoxels& voxels, const std::string& creator) {
    FileBuffer buffer(file);
    try {
        std::ostream stream(&buffer);
        void* const function = moduleFunction(kVdbModule, kVdbModuleFunction, PEELER_OPENVDB);
        reinterpret_cast<VdbModuleFunction*>(function)(stream, voxels, creator, threadCount());
        if (!stream && !buffer.failure) {
            throw Error(ErrorKind::kOutput, "OpenVDB could not write the grid", file.path());
        }
    } catch (const std::bad_alloc&) {
        throw Error(ErrorKind::kMemory, "no memory for the OpenVDB grid", file.path(),
                    "ask for fewer voxels, or write .npz");
    } catch (const Error&) {
        throw;
    } catch (const std::exception& e) {
        if (!buffer.failure) {
            throw Error(ErrorKind::kOutput, std::string("OpenVDB: ") + e.what(), file.path());
        }
    }
    if (buffer.failure) std::rethrow_exception(buffer.failure);
    const std::string uuid = buffer.uuid();
    file.writeAt(kUuidAt, std::as_bytes(std::span(uuid)));
}

}  // namespace peeler
