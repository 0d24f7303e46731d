// SPDX-License-Identifier: Apache-2.0
// Tone mapping, quantisation and encoding of rows, written to an AtomicFile.
#include "formats/image/image_writer.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdint>
#include <exception>
#include <limits>
#include <numeric>
#include <stdexcept>
#include <type_traits>
#include <utility>
#include <vector>

#include <peeler/error.h>
#include "core/base/color.h"
#include "core/base/parallel.h"
#include "core/base/stage_times.h"
#include "core/image/composite.h"
#include "formats/file/atomic_file.h"
#include "formats/file/content_hash.h"
#include "formats/file/file_name.h"
#include "formats/image/image_library.h"

namespace peeler {
namespace {

using Rgba = std::array<float, 4>;

template <class T>
T quantize(float value) {
    constexpr float kMax = static_cast<float>(std::numeric_limits<T>::max());
    return static_cast<T>(std::lround(std::clamp(value, 0.0F, 1.0F) * kMax));
}

template <class T>
T quantizeSrgb(float linear) {
    return quantize<T>(encodeSrgb(linear));
}
template <>
std::uint8_t quantizeSrgb(float linear) {
    static const SrgbBytes bytes;
    return bytes(linear);
}

constexpr int kEncodedRows = 64;  // rows per call of the encoder

}  // namespace

SizeForecast imageForecast(const std::string& path, std::uint64_t pixels) {
    constexpr std::uint64_t kHeaders = std::uint64_t{64} << 10;
    const ImageFormat* format = findImageFormat(path);
    const std::uint64_t bits = format ? static_cast<std::uint64_t>(format->bits) : 16;
    const std::uint64_t bytes = pixels * 4 * bits / 8;
    return {bytes + bytes / 1000 + kHeaders, Certainty::kAtMost};
}

/// An adapter that writes an encoder's output to an AtomicFile. A full disk is thus noticed at once
/// and reported as for every other format. Stores exceptions in `failure`.
class AtomicTarget final : public EncodedFile {
  public:
    explicit AtomicTarget(AtomicFile& file) : file_(file) {}

    std::uint64_t size() const override { return file_.size(); }
    std::size_t writeAt(std::uint64_t offset, std::span<const std::byte> bytes) override {
        if (discards) return bytes.size();
        return guarded([&] {
            if (offset == file_.size()) {
                file_.append(bytes);
            } else {
                file_.writeAt(offset, bytes);
            }
            return bytes.size();
        });
    }
    std::size_t readAt(std::uint64_t offset, std::span<std::byte> bytes) override {
        return guarded([&] { return file_.readAt(offset, bytes); });
    }

    std::exception_ptr failure;
    bool discards = false;  ///< whether writeAt() ignores the bytes and reports success

  private:
    template <class F>
    std::size_t guarded(F&& action) {
        if (failure) return 0;
        try {
            return action();
        } catch (...) {
            failure = std::current_exception();
            return 0;
        }
    }

    AtomicFile& file_;
};

/// The open file. `file` must come before `target` and `encoder`, which refer to it.
struct ImageWriter::Output {
    explicit Output(const std::string& path) : file(path), target(file) {}
    ~Output() { abandon(); }

    /// Calls `action`. If a disk error made the encoder fail, throws the disk error, not the
    /// encoder's.
    template <class F>
    void checked(F&& action) {
        std::string problem;
        try {
            action();
        } catch (const std::runtime_error& error) {
            problem = "cannot write: " + std::string(error.what());
        }
        if (target.failure) std::rethrow_exception(target.failure);
        if (!problem.empty()) throw Error(ErrorKind::kOutput, problem, file.path());
    }

    /// Writes the rows of `composite`. Returns the number of pixels whose alpha exceeds the
    /// coverage (StraightPixel::raised).
    template <class T>
    std::uint64_t writeRows(const CompositeImage& composite, const Display& display,
                            const std::array<float, 4>& background, PictureAlpha alpha);

    /// Closes an unfinished picture. OpenImageIO's encoders complain on stderr about missing rows,
    /// so the encoder gets black rows, which are not written to disk.
    void abandon() noexcept;

    AtomicFile file;
    AtomicTarget target;
    std::unique_ptr<ImageEncoder> encoder;
    ImageToEncode image{};  ///< height is 0 until encoding begins
    int next_row = 0;       ///< next row to be written, from the top of the crop
    std::vector<std::byte> pixels;
};

template <class T>
std::uint64_t ImageWriter::Output::writeRows(const CompositeImage& composite,
                                             const Display& display,
                                             const std::array<float, 4>& background,
                                             PictureAlpha alpha) {
    const auto width = static_cast<std::size_t>(composite.window.width());
    const int height = composite.window.height();
    const auto channels = static_cast<std::size_t>(image.channels);
    const bool keeps_alpha = channels == 4, has_background = background != Rgba{};
    pixels.resize(width * kEncodedRows * channels * sizeof(T));
    T* const first = reinterpret_cast<T*>(pixels.data());
    std::atomic<std::uint64_t> raised = 0;
    const auto isCovered = [&](std::size_t in) { return std::isfinite(composite.z[in]); };
    const auto isSame = [&](std::size_t a, std::size_t b) {
        return composite.isSame(a, b) &&
               (alpha == PictureAlpha::kOpacity || isCovered(a) == isCovered(b));
    };
    /// Applies PictureAlpha::kAnyFragment to an encoded pixel.
    const auto mask = [&](std::size_t in, T* out) {
        const bool black = out[0] == 0 && out[1] == 0 && out[2] == 0;
        if (!isCovered(in))
            std::fill_n(out, channels, T(0));
        else if (black)
            std::fill_n(out, 3, T(1));
        if (isCovered(in) && keeps_alpha) out[3] = std::numeric_limits<T>::max();
    };
    const auto shownPixel = [&](std::size_t in) -> StraightPixel {
        if (!keeps_alpha) {
            Rgba opaque = background;
            opaque[3] = 1;
            const Rgba over = display.shownOver(composite, in, opaque);
            return {{over[0], over[1], over[2]}};
        }
        if (has_background) return straightPixel(display.shownOver(composite, in, background));
        return display.straight(composite.rgba[in]);
    };
    for (int y = 0; y < height; y += kEncodedRows) {
        const int rows = std::min(kEncodedRows, height - y);
        parallelFor(static_cast<std::size_t>(rows), [&](std::size_t row) {
            T* out = first + row * width * channels;
            std::size_t in = (static_cast<std::size_t>(y) + row) * width;
            std::uint64_t raised_here = 0;
            bool is_raised = false;
            for (std::size_t x = 0; x < width; ++x, ++in, out += channels) {
                // Copy the left neighbour if it is equal, as around the scene and on flat areas.
                if (x > 0 && isSame(in, in - 1)) {
                    std::copy_n(out - channels, channels, out);
                } else {
                    const StraightPixel pixel = shownPixel(in);
                    for (std::size_t c = 0; c < 3; ++c)
                        out[c] = quantizeSrgb<T>(pixel.color[c]);
                    if (keeps_alpha) out[3] = quantize<T>(pixel.alpha);
                    if (alpha == PictureAlpha::kAnyFragment) mask(in, out);
                    is_raised = pixel.raised;
                }
                raised_here += is_raised ? 1 : 0;
            }
            raised += raised_here;
        });
        checked([&] { encoder->writeRows(next_row, next_row + rows, first); });
        next_row += rows;
    }
    return raised;
}

void ImageWriter::Output::abandon() noexcept {
    target.discards = true;
    try {
        const std::vector<std::byte> black(static_cast<std::size_t>(image.width * image.channels) *
                                           static_cast<std::size_t>(image.bits / 8));
        for (; next_row < image.height; ++next_row)
            encoder->writeRows(next_row, next_row + 1, black.data());
        encoder.reset();
    } catch (...) {  // the picture is lost, and its error is already being reported
    }
}

std::span<const ImageFormat> imageFormats() {
    static const std::array<ImageFormat, 3> formats = {{
        {"png", {".png"}, "8-bit sRGB with straight alpha"},
        {"jpeg", {".jpg", ".jpeg"}, "8-bit sRGB without alpha"},
        {"tiff", {".tif", ".tiff"}, "16-bit sRGB with straight alpha", 16},
    }};
    return formats;
}

const ImageFormat* findImageFormat(const std::string& path) {
    const std::string extension = lowerExtension(path);
    for (const ImageFormat& format : imageFormats())
        if (std::ranges::find(format.extensions, extension) != format.extensions.end())
            return &format;
    return nullptr;
}

std::span<float> onePerPixel(const Window& window, LayeredImage& image) {
    const std::size_t pixels = window.pixels();
    image.window = window;
    image.offsets.resize(pixels + 1);
    std::iota(image.offsets.begin(), image.offsets.end(), 0U);
    image.z.assign(pixels, 0.0F);
    image.color.channels = {"R", "G", "B", "A"};
    image.color.type = PixelType::kFloat;
    image.color.data.resize(pixels * image.color.stride());
    return image.color.as<float>();
}

namespace {

template <class Sample>
void writeGrey(AtomicFile& file, int width, int height, std::span<const Sample> samples,
               const std::string& software) {
    AtomicTarget target(file);
    std::string problem;
    try {
        const auto encoder = imageEncoder("png");
        ImageToEncode image{file.path(), width, height, 1};
        image.bits = static_cast<int>(8 * sizeof(Sample));
        image.software = software;
        encoder->open(image, target);
        encoder->writeRows(0, height, samples.data());
        encoder->close();
    } catch (const std::runtime_error& error) {
        problem = "cannot write: " + std::string(error.what());
    }
    if (target.failure) std::rethrow_exception(target.failure);
    if (!problem.empty()) throw Error(ErrorKind::kOutput, problem, file.path());
}

}  // namespace

void writeGreyPng(AtomicFile& file, int width, int height, std::span<const std::uint8_t> samples,
                  const std::string& software) {
    writeGrey(file, width, height, samples, software);
}

void writeGreyPng(AtomicFile& file, int width, int height, std::span<const std::uint16_t> samples,
                  const std::string& software) {
    writeGrey(file, width, height, samples, software);
}

ImageWriter::ImageWriter(std::string path, OutputOptions options, PictureAlpha alpha)
    : path_(std::move(path)),
      options_(std::move(options)),
      alpha_(alpha),
      format_(findImageFormat(path_)),
      display_(options_.exposure, options_.tone_map, options_.blends_encoded) {
    if (alpha == PictureAlpha::kAnyFragment) options_.background = {0, 0, 0, 1};
    if (format_ == nullptr) throw Error(ErrorKind::kInternal, "no picture has this name", path_);
}

ImageWriter::~ImageWriter() = default;

void ImageWriter::begin(const Plan& plan) {
    const StageTimer timer(times_, "encode");
    // Create the encoder before the file, so that no file is left if this fails.
    auto encoder = imageEncoder(std::string(format_->name));
    output_ = std::make_unique<Output>(path_);
    Output& output = *output_;
    output.encoder = std::move(encoder);

    const Window& crop = plan.view.crop;
    metered_ = metersOf(plan);
    tinted_ = plan.tinted;
    if (metered_) {
        kept_.window = crop;
        kept_.rgba.reserve(crop.pixels());
    }
    if (options_.outcome) *options_.outcome = {options_.exposure, 0};
    ImageToEncode image{path_, crop.width(), crop.height(), output.encoder->keepsAlpha() ? 4 : 3};
    image.bits = format_->bits;
    image.software = "peeler " + options_.provenance.version;
    image.description = outputHashText(options_.provenance.output_hash);
    // A TIFF is not marked as sRGB: OpenImageIO would store the mark in an Exif directory, and
    // OpenImageIO 2.4.7 links such a directory wrongly when it writes through a proxy, which makes
    // the file unreadable. TIFF is read as sRGB in any case.
    image.srgb = format_->name != "tiff";
    output.checked([&] { output.encoder->open(image, output.target); });
    output.image = image;
}

void ImageWriter::write(LayeredImage&& band) {
    for (int y = band.window.y0; y < band.window.y1; y += kEncodedRows) {
        {
            const StageTimer timer(times_, "composite");
            compositeRows(band, y, std::min(y + kEncodedRows, band.window.y1), {}, composite_);
        }
        if (metered_) {
            kept_.appendColors(composite_);
            if (alpha_ == PictureAlpha::kAnyFragment)
                kept_.z.insert(kept_.z.end(), composite_.z.begin(), composite_.z.end());
            continue;
        }
        const StageTimer timer(times_, "encode");  // includes the time for writing
        encode(composite_);
    }
}

bool ImageWriter::metersOf(const Plan& plan) const {
    return options_.automatic_exposure && !isPart(plan.view);
}

SinkMemory ImageWriter::memory(const Plan& plan) const {
    const std::uint64_t picture =
        plan.view.crop.pixels() * 4 * static_cast<std::uint64_t>(format_->bits / 8);
    // Rows of the picture and of its composite: RGBA and Z, and if tinted the opacities of R, G
    // and B.
    const std::uint64_t rows =
        static_cast<std::uint64_t>(plan.view.crop.width()) * kEncodedRows *
        (4 * static_cast<std::uint64_t>(format_->bits / 8) + (plan.tinted ? 8 : 5) * sizeof(float));
    const std::uint64_t encoder = imageEncoderBytes(std::string(format_->name), picture) + rows;
    if (!metersOf(plan)) return {.bytes = encoder};
    const std::size_t pixel_bytes =
        sizeof(kept_.rgba.front()) + (plan.tinted ? sizeof(kept_.opacity.front()) : 0) +
        (alpha_ == PictureAlpha::kAnyFragment ? sizeof(kept_.z.front()) : 0);
    return {.bytes = encoder + plan.view.crop.pixels() * pixel_bytes};
}

void ImageWriter::encode(const CompositeImage& composite) {
    const std::uint64_t raised =
        format_->bits == 16
            ? output_->writeRows<std::uint16_t>(composite, display_, options_.background, alpha_)
            : output_->writeRows<std::uint8_t>(composite, display_, options_.background, alpha_);
    if (options_.outcome) options_.outcome->raised_pixels += raised;
}

void ImageWriter::finish() {
    close();
    const StageTimer timer(times_, "write");
    output_->file.commit();
    output_.reset();
}

AtomicFile& ImageWriter::close() {
    if (metered_) {
        const StageTimer timer(times_, "encode");
        ExposureMeter meter;
        meter.add(kept_);
        display_ = Display(meter.stopsIfNeeded(), options_.tone_map, options_.blends_encoded);
        if (options_.outcome) options_.outcome->exposure = meter.stopsIfNeeded();
        encode(kept_);
        kept_ = {};
    }
    if (output_->next_row != output_->image.height) {
        throw Error(ErrorKind::kInternal, "rows of the picture are missing", path_);
    }
    const StageTimer timer(times_, "write");
    output_->checked([&] { output_->encoder->close(); });
    return output_->file;
}

}  // namespace peeler
