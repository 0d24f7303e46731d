// SPDX-License-Identifier: Apache-2.0
// OpenEXR chunks: compression, and assembly of a file.
#include "formats/exr/exr_chunks.h"

#include <OpenEXR/IexErrnoExc.h>
#include <OpenEXR/ImfChannelList.h>
#include <OpenEXR/ImfIO.h>
#include <OpenEXR/ImfMultiPartInputFile.h>
#include <OpenEXR/ImfPartType.h>
#include <OpenEXR/ImfStringAttribute.h>
#include <OpenEXR/ImfVersion.h>
#include <libdeflate.h>

#include <array>
#include <bit>
#include <cstring>
#include <exception>
#include <limits>
#include <new>
#include <string>

#include <peeler/error.h>
#include "formats/exr/exr_integrity.h"
#include "formats/exr/exr_layout.h"
#include "formats/file/content_hash.h"

namespace peeler {
namespace {

static_assert(std::endian::native == std::endian::little,
              "pixels are stored little-endian as they are");

/// An in-memory output stream for Imf::Header::writeTo().
class MemoryStream : public Imf::OStream {
  public:
    MemoryStream() : Imf::OStream("header") {}
    void write(const char bytes[], int count) override {
        data.append(bytes, static_cast<std::size_t>(count));
    }
    std::uint64_t tellp() override { return data.size(); }
    void seekp(std::uint64_t) override {
        throw Error(ErrorKind::kInternal, "a header is written front to back");
    }

    std::string data;
};

template <class T>
void appendNumber(std::string& out, T value) {
    std::array<char, sizeof(T)> bytes;
    std::memcpy(bytes.data(), &value, sizeof(T));
    out.append(bytes.data(), bytes.size());
}

std::span<const std::byte> bytesOfText(const std::string& text) {
    return std::as_bytes(std::span(text.data(), text.size()));
}

bool hasLongNames(const Imf::Header& header) {
    constexpr std::size_t kShortName = 31;
    for (auto i = header.begin(); i != header.end(); ++i) {
        if (std::strlen(i.name()) > kShortName ||
            std::strlen(i.attribute().typeName()) > kShortName)
            return true;
    }
    for (auto i = header.channels().begin(); i != header.channels().end(); ++i) {
        if (std::strlen(i.name()) > kShortName) return true;
    }
    return false;
}

void checkChunkSize(const Imf::Header& header, const std::string& path) {
    std::uint64_t pixel = 0;
    for (auto i = header.channels().begin(); i != header.channels().end(); ++i) {
        pixel += i.channel().type == Imf::HALF ? 2 : 4;
    }
    const Imath::Box2i& window = header.dataWindow();
    const auto width =
        static_cast<std::uint64_t>(std::int64_t{window.max.x} - std::int64_t{window.min.x} + 1);
    const auto rows = static_cast<std::uint64_t>(exrRowsPerChunk(header.compression()));
    if (width * pixel * rows > std::numeric_limits<std::int32_t>::max()) {
        throw Error(ErrorKind::kOutput,
                    std::to_string(rows) + " rows of the picture exceed OpenEXR's limit of 2 GiB",
                    path, "render narrower tiles, or fewer channels");
    }
}

bool isDeep(const Imf::Header& header) {
    return Imf::isDeepData(header.type());
}

/// Packs in OpenEXR's run-length encoding (ImfRle.cpp): n ≥ 0 means that the next byte occurs n + 1
/// times; n < 0 means that −n literal bytes follow. A run has 3 to 128 bytes.
void packRuns(std::span<const std::byte> in, ByteBuffer& out) {
    constexpr std::size_t kShortest = 3, kLongest = 128, kMostLiterals = 127;
    out.clear();
    const auto runAt = [&](std::size_t i) {
        std::size_t run = 1;
        while (run < kLongest && i + run < in.size() && in[i + run] == in[i])
            ++run;
        return run;
    };
    for (std::size_t i = 0; i < in.size();) {
        if (const std::size_t run = runAt(i); run >= kShortest) {
            out.push_back(static_cast<std::byte>(run - 1));
            out.push_back(in[i]);
            i += run;
            continue;
        }
        std::size_t literals = 1;
        while (literals < kMostLiterals && i + literals < in.size() &&
               runAt(i + literals) < kShortest)
            ++literals;
        out.push_back(static_cast<std::byte>(-static_cast<int>(literals)));
        out.insert(out.end(), in.begin() + static_cast<std::ptrdiff_t>(i),
                   in.begin() + static_cast<std::ptrdiff_t>(i + literals));
        i += literals;
    }
}

}  // namespace

Imf::Compression exrCompressionOf(const std::string& name, bool deep) {
    return static_cast<Imf::Compression>(findExrCompression(name, deep).value);
}

Imf::PixelType exrPixelType(PixelType type) {
    switch (type) {
        case PixelType::kHalf:
            return Imf::HALF;
        case PixelType::kFloat:
            return Imf::FLOAT;
        case PixelType::kUint:
            break;
    }
    return Imf::UINT;
}

ExrChunkPacker::ExrChunkPacker(int level, Imf::Compression compression)
    : compression_(compression), compressor_(libdeflate_alloc_compressor(level)) {
    if (!compressor_) throw Error(ErrorKind::kMemory, "no memory for a compressor");
}

ExrChunkPacker::~ExrChunkPacker() {
    libdeflate_free_compressor(compressor_);
}

std::span<std::byte> ExrChunkPacker::raw(std::size_t bytes) {
    raw_.clear();  // so that resize() copies no old content
    raw_.resize(bytes);
    return raw_;
}

/// Applies OpenEXR's filter (ImfZip.cpp) in one loop: puts all even bytes before all odd bytes,
/// then replaces each byte by its difference from the previous byte, plus 128.
void ExrChunkPacker::filter() {
    const std::size_t size = raw_.size();
    filtered_.clear();
    filtered_.resize(size);
    const auto* in = reinterpret_cast<const std::uint8_t*>(raw_.data());
    auto* to = reinterpret_cast<std::uint8_t*>(filtered_.data());
    const std::size_t even = (size + 1) / 2, odd = size / 2;
    if (size > 0) to[0] = in[0];
    for (std::size_t i = 1; i < even; ++i) {
        to[i] = static_cast<std::uint8_t>(in[2 * i] - in[2 * i - 2] + 128);
    }
    if (odd > 0) to[even] = static_cast<std::uint8_t>(in[1] - in[2 * even - 2] + 128);
    for (std::size_t i = 1; i < odd; ++i) {
        to[even + i] = static_cast<std::uint8_t>(in[2 * i + 1] - in[2 * i - 1] + 128);
    }
}

void ExrChunkPacker::pack(ByteBuffer& out) {
    const std::size_t size = raw_.size();
    bool smaller = false;
    if (compression_ != Imf::NO_COMPRESSION && size > 0) {
        filter();
        if (compression_ == Imf::RLE_COMPRESSION) {
            packRuns(filtered_, out);
            smaller = out.size() < size;
        } else {
            out.clear();
            out.resize(size);
            const std::size_t packed =
                libdeflate_zlib_compress(compressor_, filtered_.data(), size, out.data(), size - 1);
            smaller = packed > 0;
            out.resize(packed);
        }
    }
    // Store the chunk uncompressed. Readers recognise an uncompressed chunk by its size.
    if (!smaller) out = raw_;
}

std::size_t ExrPackerPool::bytesKept() const {
    std::size_t bytes = 0;
    for (const auto& packer : idle_)
        bytes += packer->bytesKept();
    return bytes;
}

std::unique_ptr<ExrChunkPacker> ExrPackerPool::take() {
    const std::lock_guard lock(mutex_);
    if (idle_.empty()) return std::make_unique<ExrChunkPacker>(level_, compression_);
    std::unique_ptr<ExrChunkPacker> packer = std::move(idle_.back());
    idle_.pop_back();
    return packer;
}

ExrOutput::ExrOutput(AtomicFile& file, std::vector<Imf::Header> headers)
    : file_(file), headers_(std::move(headers)) {
    const bool multi_part = headers_.size() > 1;
    int version = Imf::EXR_VERSION | (multi_part ? Imf::MULTI_PART_FILE_FLAG : 0);
    std::size_t chunks = 0;
    try {
        for (Imf::Header& header : headers_) {
            header.insert(kPixelHash, Imf::StringAttribute(pixelHashText(0)));
            const Imath::Box2i& window = header.dataWindow();
            const int rows = window.max.y - window.min.y + 1;
            const int step = exrRowsPerChunk(header.compression());
            header.setChunkCount((rows + step - 1) / step);
            first_offset_.push_back(chunks);
            chunks += static_cast<std::size_t>(header.chunkCount());
            header.sanityCheck(false, multi_part);
            checkChunkSize(header, file_.path());
            if (hasLongNames(header)) version |= Imf::LONG_NAMES_FLAG;
            if (isDeep(header)) version |= Imf::NON_IMAGE_FLAG;
        }
    } catch (const Error&) {
        throw;
    } catch (const std::bad_alloc&) {
        throw;
    } catch (const std::exception& e) {
        throw Error(ErrorKind::kOutput, std::string("OpenEXR refuses the header: ") + e.what(),
                    file_.path());
    }
    appendNumber(start_, std::int32_t{Imf::MAGIC});
    appendNumber(start_, std::int32_t{version});
    file_.append(bytesOfText(start_));
    for (const Imf::Header& header : headers_)
        file_.append(bytesOfText(headerBytes(header)));
    if (multi_part) file_.append(std::array{std::byte{}});  // end of the headers

    table_position_ = file_.size();
    offsets_.assign(chunks, 0);
    hashes_.assign(chunks, 0);
    file_.append(std::as_bytes(std::span(offsets_)));
}

std::string ExrOutput::headerBytes(const Imf::Header& header) {
    MemoryStream stream;
    header.writeTo(stream);
    return std::move(stream.data);
}

/// Records the chunk's offset. Returns the fields before the chunk's data: the part's number (in
/// multi-part files), and y.
std::string ExrOutput::beginChunk(std::size_t part, int chunk) {
    chunk_ = first_offset_[part] + static_cast<std::size_t>(chunk);
    std::uint64_t& offset = offsets_.at(chunk_);
    if (offset != 0) throw Error(ErrorKind::kInternal, "a chunk is written twice", file_.path());
    offset = file_.size();
    const Imf::Header& header = headers_[part];
    std::string start;
    if (headers_.size() > 1) appendNumber(start, static_cast<std::int32_t>(part));
    appendNumber(start, std::int32_t{header.dataWindow().min.y +
                                     chunk * exrRowsPerChunk(header.compression())});
    return start;
}

void ExrOutput::writeChunk(std::initializer_list<std::span<const std::byte>> pieces) {
    ContentHasher hash;
    for (const auto piece : pieces) {
        hash.add(piece);
        file_.append(piece);
    }
    hashes_[chunk_] = hash.value();
}

void ExrOutput::append(std::size_t part, int chunk, std::span<const std::byte> packed) {
    std::string start = beginChunk(part, chunk);
    appendNumber(start, static_cast<std::int32_t>(packed.size()));
    writeChunk({bytesOfText(start), packed});
}

void ExrOutput::append(std::size_t part, int chunk, const ExrDeepChunk& packed) {
    if (packed.unpacked > std::numeric_limits<std::int32_t>::max()) {
        throw Error(ErrorKind::kOutput, "the samples of a row exceed OpenEXR's limit of 2 GiB",
                    file_.path(), "render narrower tiles, or fewer channels or layers");
    }
    std::string start = beginChunk(part, chunk);
    appendNumber(start, std::uint64_t{packed.counts.size()});
    appendNumber(start, std::uint64_t{packed.samples.size()});
    appendNumber(start, std::uint64_t{packed.unpacked});
    writeChunk({bytesOfText(start), packed.counts, packed.samples});
}

void ExrOutput::setAttribute(std::size_t part, const char* name, const Imf::Attribute& value) {
    headers_[part].insert(name, value);
    headers_changed_ = true;
}

void ExrOutput::finish() {
    writeTables();
    writeHashes();
    readBack();
}

void ExrOutput::writeTables() {
    for (const std::uint64_t offset : offsets_) {
        if (offset == 0)
            throw Error(ErrorKind::kInternal, "rows of the picture are missing", file_.path());
    }
    file_.writeAt(table_position_, std::as_bytes(std::span(offsets_)));
}

void ExrOutput::writeHashes() {
    std::uint64_t at = start_.size();
    for (std::size_t part = 0; part < headers_.size(); ++part) {
        std::string header = headerBytes(headers_[part]);
        const auto chunks = static_cast<std::size_t>(chunkCount(part));
        ContentHasher hash;
        hash.add(bytesOfText(start_));
        hash.add(bytesOfText(header));
        hash.add(std::as_bytes(std::span(offsets_).subspan(first_offset_[part], chunks)));
        hash.add(std::as_bytes(std::span(hashes_).subspan(first_offset_[part], chunks)));
        const std::size_t place = header.find(pixelHashRecord(0));
        const std::string record = pixelHashRecord(hash.value());
        header.replace(place, record.size(), record);
        if (headers_changed_)
            file_.writeAt(at, bytesOfText(header));
        else
            file_.writeAt(at + place, bytesOfText(record));
        at += header.size();
    }
    if (at + (headers_.size() > 1 ? 1 : 0) != table_position_)
        throw Error(ErrorKind::kInternal, "a changed header has another size", file_.path());
}

void ExrOutput::readBack() {
    try {
        Imf::MultiPartInputFile check(file_.temporaryPath().c_str(), 0, false);
        bool same = check.parts() == static_cast<int>(headers_.size());
        for (int part = 0; same && part < check.parts(); ++part) {
            const Imf::Header& wanted = headers_[static_cast<std::size_t>(part)];
            const Imf::Header& found = check.header(part);
            same = check.partComplete(part) && found.dataWindow() == wanted.dataWindow() &&
                   found.channels() == wanted.channels();
        }
        if (!same) {
            throw Error(ErrorKind::kOutput, "the file reads back differently", file_.path(),
                        "check the disk");
        }
    } catch (const Error&) {
        throw;
    } catch (const std::bad_alloc&) {
        throw;
    } catch (const Iex::EnomemExc&) {
        throw std::bad_alloc();
    } catch (const std::exception& e) {
        throw Error(ErrorKind::kOutput, std::string("the file does not read back: ") + e.what(),
                    file_.path(), "check the disk");
    }
}

}  // namespace peeler
