// SPDX-License-Identifier: Apache-2.0
// The module peeler_images: implements formats/image/image_library.h with OpenImageIO.
#include "formats/image/image_library.h"

#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>
#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <memory>
#include <optional>
#include <stdexcept>

#include <peeler/error.h>
#include "formats/file/regular_file.h"

namespace peeler {
namespace {

[[noreturn]] void fail(const std::string& message) {
    throw std::runtime_error(message);
}

StoredImage storedImage(const OIIO::ImageSpec& spec) {
    StoredImage image{spec.x,      spec.y,      spec.width,      spec.height,     spec.depth,
                      spec.full_x, spec.full_y, spec.full_width, spec.full_height};
    image.channels = spec.channelnames;
    image.channels.resize(static_cast<std::size_t>(std::max(0, spec.nchannels)));
    image.floating_point = spec.format.is_floating_point();
    image.straight_alpha = spec.get_int_attribute("oiio:UnassociatedAlpha", 0) != 0;
    image.deep = spec.deep;
    image.description = spec.get_string_attribute("ImageDescription");
    image.orientation = spec.get_int_attribute("Orientation", 1);
    return image;
}

/// A FILE opened through RegularFile, because OpenImageIO would block on a pipe. The FILE is needed
/// because the JPEG plugin can read nothing else.
struct FileStream {
    explicit FileStream(const std::string& path) {
        const RegularFile file(path);
        file.check();
        const int descriptor = ::fcntl(file.descriptor(), F_DUPFD_CLOEXEC, 0);
        stream = descriptor < 0 ? nullptr : ::fdopen(descriptor, "rb");
        if (stream) return;
        const int error = errno;
        if (descriptor >= 0) ::close(descriptor);
        failToOpen(path, error);
    }
    ~FileStream() { std::fclose(stream); }
    FileStream(const FileStream&) = delete;
    FileStream& operator=(const FileStream&) = delete;

    std::FILE* stream;
};

class FileProxy final : FileStream, public OIIO::Filesystem::IOFile {
  public:
    explicit FileProxy(const std::string& path) : FileStream(path), IOFile(stream, Read) {}
};

class Decoder final : public ImageDecoder {
  public:
    Decoder(const std::string& format, const std::string& path,
            std::span<const std::uint8_t> bytes) {
        input_ = OIIO::ImageInput::create(format);
        if (!input_) {
            OIIO::geterror();  // discards OpenImageIO's pending message
            fail("no decoder for " + format + " is installed");
        }
        OIIO::ImageSpec config;
        config.attribute("oiio:UnassociatedAlpha", 1);
        if (bytes.empty())
            proxy_ = std::make_unique<FileProxy>(path);
        else
            proxy_ = std::make_unique<OIIO::Filesystem::IOMemReader>(bytes.data(), bytes.size());
        OIIO::Filesystem::IOProxy* const proxy = proxy_.get();
        config.attribute("oiio:ioproxy", OIIO::TypeDesc::PTR, &proxy);
        OIIO::ImageSpec spec;
        check(input_->open(path, spec, config));
        if (format == "tiff") refuseFragileTiff(spec);
        by_rows_ = format == "tiff" && spec.tile_width == 0;
        image_ = storedImage(spec);
    }

    const StoredImage& image() const override { return image_; }
    void read(int begin, int end, float* samples) override {
        readAs(begin, end, OIIO::TypeDesc::FLOAT, samples);
    }
    void read(int begin, int end, std::uint8_t* samples) override {
        readAs(begin, end, OIIO::TypeDesc::UINT8, samples);
    }

  private:
    template <class Sample>
    void readAs(int begin, int end, OIIO::TypeDesc type, Sample* samples) {
        if (!by_rows_) return check(input_->read_image(0, 0, begin, end, type, samples));
        const std::size_t row =
            static_cast<std::size_t>(image_.width) * static_cast<std::size_t>(end - begin);
        for (int y = image_.y; y < image_.y + image_.height; ++y, samples += row)
            check(input_->read_scanlines(0, 0, y, y + 1, 0, begin, end, type, samples));
    }

    /// Rejects TIFFs for which OpenImageIO before 3.1.16 writes beyond its buffers: palettes with
    /// indices of three bytes, and CMYK in tiles or with samples that are not whole bytes, when
    /// converted to RGB (CVE-2026-67549).
    static void refuseFragileTiff(const OIIO::ImageSpec& spec) {
        // Values defined in TIFF 6.0, sections 5 and 16.
        constexpr int kPalette = 3, kSeparated = 5;
        const int bits = spec.get_int_attribute("oiio:BitsPerSample", 8);
        const int colors = spec.get_int_attribute("tiff:PhotometricInterpretation");
        const std::string of_bits = " of " + std::to_string(bits) + " bits is not read";
        if (colors == kSeparated && bits != 8 && bits != 16 && bits != 32)
            fail("TIFF: CMYK" + of_bits);
        if (colors == kSeparated && spec.tile_width > 0) fail("TIFF: CMYK in tiles is not read");
        if (colors == kPalette && bits > 16) fail("TIFF: a palette" + of_bits);
    }
    void check(bool success) const {
        if (!success) fail(input_->geterror());
    }

    std::unique_ptr<OIIO::Filesystem::IOProxy> proxy_;  // declared before input_, which uses it
    std::unique_ptr<OIIO::ImageInput> input_;
    /// Whether to read a TIFF row by row. When it reads strips, OpenImageIO before 3.1.17 unpacks
    /// data that it failed to read, and inverts more samples than there are.
    bool by_rows_ = false;
    StoredImage image_;
};

class Proxy final : public OIIO::Filesystem::IOProxy {
  public:
    Proxy(const std::string& path, EncodedFile& file) : IOProxy(path, Write), file_(file) {}

    const char* proxytype() const override { return "peeler"; }
    std::size_t size() const override { return file_.size(); }
    std::size_t write(const void* data, std::size_t bytes) override {
        return moved(pwrite(data, bytes, m_pos));
    }
    std::size_t pwrite(const void* data, std::size_t bytes, std::int64_t offset) override {
        return file_.writeAt(static_cast<std::uint64_t>(offset),
                             {static_cast<const std::byte*>(data), bytes});
    }
    std::size_t read(void* data, std::size_t bytes) override {
        return moved(pread(data, bytes, m_pos));
    }
    std::size_t pread(void* data, std::size_t bytes, std::int64_t offset) override {
        return file_.readAt(static_cast<std::uint64_t>(offset),
                            {static_cast<std::byte*>(data), bytes});
    }

  private:
    std::size_t moved(std::size_t bytes) {
        m_pos += static_cast<std::int64_t>(bytes);
        return bytes;
    }

    EncodedFile& file_;
};

class Encoder final : public ImageEncoder {
  public:
    explicit Encoder(const std::string& format)
        : format_(format), output_(OIIO::ImageOutput::create(format)) {
        if (!output_) fail(OIIO::geterror());
    }

    bool keepsAlpha() const override { return output_->supports("alpha"); }

    void open(const ImageToEncode& image, EncodedFile& file) override {
        type_ = image.bits == 16 ? OIIO::TypeDesc::UINT16 : OIIO::TypeDesc::UINT8;
        OIIO::ImageSpec spec(image.width, image.height, image.channels, type_);
        if (image.srgb) spec.attribute("oiio:ColorSpace", "sRGB");
        // Alpha is already straight, so OpenImageIO must not divide colours by it.
        spec.attribute("oiio:UnassociatedAlpha", 1);
        if (!image.software.empty()) spec.attribute("Software", image.software);
        if (!image.description.empty()) spec.attribute("ImageDescription", image.description);
        // Without an empty date, the file would contain the time of writing.
        if (format_ == "tiff") spec.attribute("DateTime", "");
        if (format_ == "jpeg") {
            spec.attribute("Compression", "jpeg:95");
            spec.attribute("jpeg:subsampling", "4:4:4");
        }
        proxy_.emplace(image.path, file);
        check(output_->set_ioproxy(&*proxy_));
        check(output_->open(image.path, spec));
    }

    void writeRows(int begin, int end, const void* samples) override {
        check(output_->write_scanlines(begin, end, 0, type_, samples));
    }

    void close() override { check(output_->close()); }

  private:
    void check(bool success) const {
        if (!success) fail(output_->geterror());
    }

    std::string format_;
    OIIO::TypeDesc type_;
    std::optional<Proxy> proxy_;  // declared before output_, which uses it
    std::unique_ptr<OIIO::ImageOutput> output_;
};

class Library final : public ImageLibrary {
  public:
    // TIFFs are decoded without threads. If a file is damaged, the threads that unpack its strips
    // and tiles may use freed memory (CVE-2023-24472, before 2.4.8.1; CVE-2026-65970, before
    // 3.1.16).
    Library() { OIIO::attribute("tiff:multithread", 0); }
    std::unique_ptr<ImageDecoder> decoder(const std::string& format, const std::string& path,
                                          std::span<const std::uint8_t> bytes) const override {
        return std::make_unique<Decoder>(format, path, bytes);
    }
    std::unique_ptr<ImageEncoder> encoder(const std::string& format) const override {
        return std::make_unique<Encoder>(format);
    }
    void setThreads(int threads) const override {
#ifdef __SANITIZE_THREAD__
        threads = 1;  // ThreadSanitizer does not see how OpenImageIO's threads are synchronised
#endif
        OIIO::attribute("threads", threads);
        // OpenEXR counts threads in addition to the caller's. In OpenImageIO, −1 means no such
        // threads.
        OIIO::attribute("exr_threads", threads > 1 ? threads : -1);
    }
};

}  // namespace
}  // namespace peeler

extern "C" __attribute__((visibility("default"))) const peeler::ImageLibrary* peelerImageLibrary() {
    static const peeler::Library library;
    return &library;
}
