// SPDX-License-Identifier: Apache-2.0
// Tone maps, quantises and encodes rows, by an encoder on top of an AtomicFile.
#include "formats/image/image_writer.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <exception>
#include <limits>
#include <numeric>
#include <stdexcept>
#include <type_traits>
#include <utility>
#include <vector>

#include "core/base/color.h"
#include "core/base/error.h"
#include "core/base/parallel.h"
#include "formats/file/atomic_file.h"
#include "formats/file/content_hash.h"
#include "formats/file/file_name.h"
#include "formats/image/image_library.h"

namespace peeler {
namespace {

using Rgb = std::array<float, 3>;

Rgb keep(Rgb color) {
    return color;
}

/// Khronos PBR Neutral leaves base colours below 0.8 as they are (but for Fresnel's 4 %) and
/// compresses highlights. github.com/KhronosGroup/ToneMapping, PBR_Neutral.
Rgb neutral(Rgb color) {
    constexpr float kStart = 0.8F - 0.04F, kDesaturation = 0.15F, kRoom = 1 - kStart;
    const float low = std::min({color[0], color[1], color[2]});
    const float offset = low < 0.08F ? low - 6.25F * low * low : 0.04F;
    for (float& c : color)
        c -= offset;
    const float peak = std::max({color[0], color[1], color[2]});
    if (peak < kStart) return color;
    const float new_peak = 1 - kRoom * kRoom / (peak + kRoom - kStart);
    const float gray = 1 - 1 / (kDesaturation * (peak - new_peak) + 1);
    for (float& c : color)
        c = std::lerp(c * new_peak / peak, new_peak, gray);
    return color;
}

Rgb multiply(const std::array<Rgb, 3>& m, const Rgb& v) {
    Rgb out{};
    for (std::size_t i = 0; i < 3; ++i)
        out[i] = m[i][0] * v[0] + m[i][1] * v[1] + m[i][2] * v[2];
    return out;
}

/// ACES RRT and ODT as fitted by Stephen Hill (BakingLab, ACES.hlsl, MIT licence): sRGB to a space
/// near AP1, the curve for each channel, and back.
Rgb aces(Rgb color) {
    constexpr std::array<Rgb, 3> kIn = {{{0.59719F, 0.35458F, 0.04823F},
                                         {0.07600F, 0.90834F, 0.01566F},
                                         {0.02840F, 0.13383F, 0.83777F}}};
    constexpr std::array<Rgb, 3> kOut = {{{1.60475F, -0.53108F, -0.07367F},
                                          {-0.10208F, 1.10813F, -0.00605F},
                                          {-0.00327F, -0.07276F, 1.07602F}}};
    color = multiply(kIn, color);
    for (float& c : color) {
        c = (c * (c + 0.0245786F) - 0.000090537F) / (c * (0.983729F * c + 0.4329510F) + 0.238081F);
    }
    return multiply(kOut, color);
}

constexpr ToneMap kToneMaps[] = {
    {"none", "clip at 1", keep},
    {"neutral", "Khronos PBR Neutral: true base colours, soft highlights", neutral},
    {"aces", "ACES filmic (fit by S. Hill)", aces},
};

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

}  // namespace

std::span<const ToneMap> toneMaps() {
    return kToneMaps;
}

SizeForecast imageForecast(const std::string& path, std::uint64_t pixels) {
    constexpr std::uint64_t kHeaders = std::uint64_t{64} << 10;
    const ImageFormat* format = findImageFormat(path);
    const std::uint64_t bits = format ? static_cast<std::uint64_t>(format->bits) : 16;
    const std::uint64_t bytes = pixels * 4 * bits / 8;
    return {bytes + bytes / 1000 + kHeaders, Certainty::kAtMost};
}

float encodeSrgb(float linear) {
    if (!(linear > 0)) return 0;
    if (linear >= 1) return 1;
    return srgbFromLinear(linear);
}

/// What the encoder writes goes through the AtomicFile, so that a full disk is noticed at once and
/// reported as for every other format. Exceptions wait in `failure`.
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
    bool discards = false;  ///< writes succeed and do nothing

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

/// The open file. `target` and `encoder` refer to `file`, so the order of members matters.
struct ImageWriter::Output {
    explicit Output(const std::string& path) : file(path), target(file) {}
    ~Output() { abandon(); }

    /// Runs `action`; an error of the disk goes before the one that the encoder made of it.
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

    template <class T>
    void writeRows(const CompositeImage& composite, float gain, const ToneMap& tone_map);

    /// Closes an unfinished picture. OpenImageIO's encoders complain on stderr about missing rows,
    /// so they get them, black; nothing of it reaches the disk.
    void abandon() noexcept;

    AtomicFile file;
    AtomicTarget target;
    std::unique_ptr<ImageEncoder> encoder;
    ImageToEncode image{};  ///< height 0 = not begun
    int next_row = 0;       ///< of the file, 0 = top of the crop
    std::vector<std::byte> pixels;
};

template <class T>
void ImageWriter::Output::writeRows(const CompositeImage& composite, float gain,
                                    const ToneMap& tone_map) {
    const auto width = static_cast<std::size_t>(composite.window.width());
    const int height = composite.window.height();
    constexpr int kRowsAtOnce = 64;
    const auto channels = static_cast<std::size_t>(image.channels);
    pixels.resize(width * kRowsAtOnce * channels * sizeof(T));
    T* const first = reinterpret_cast<T*>(pixels.data());
    for (int y = 0; y < height; y += kRowsAtOnce) {
        const int rows = std::min(kRowsAtOnce, height - y);
        parallelFor(static_cast<std::size_t>(rows), [&](std::size_t row) {
            T* out = first + row * width * channels;
            const auto* in = composite.rgba.data() + (static_cast<std::size_t>(y) + row) * width;
            for (std::size_t x = 0; x < width; ++x, out += channels) {
                const auto& [r, g, b, alpha] = in[x];
                const bool keeps_alpha = channels == 4;
                const float scale = !keeps_alpha ? gain : alpha > 0 ? gain / alpha : 0;
                const Rgb mapped = tone_map.map({r * scale, g * scale, b * scale});
                for (std::size_t c = 0; c < 3; ++c)
                    out[c] = quantizeSrgb<T>(mapped[c]);
                if (keeps_alpha) out[3] = quantize<T>(alpha);
            }
        });
        checked([&] { encoder->writeRows(next_row, next_row + rows, first); });
        next_row += rows;
    }
}

void ImageWriter::Output::abandon() noexcept {
    target.discards = true;
    try {
        const std::vector<std::byte> black(static_cast<std::size_t>(image.width * image.channels) *
                                           static_cast<std::size_t>(image.bits / 8));
        for (; next_row < image.height; ++next_row)
            encoder->writeRows(next_row, next_row + 1, black.data());
        encoder.reset();
    } catch (...) {  // the picture is lost anyway, and for a reason that is being reported
    }
}

const ToneMap& findToneMap(const std::string& name) {
    std::string names;
    for (const ToneMap& entry : kToneMaps) {
        if (entry.name == name) return entry;
        names += (names.empty() ? "" : ", ") + std::string(entry.name);
    }
    throw Error(ErrorKind::kUsage, "there is no tone map \"" + name + "\"", "--tone-map",
                "choose one of: " + names);
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

ImageWriter::ImageWriter(std::string path, OutputOptions options)
    : path_(std::move(path)),
      options_(std::move(options)),
      format_(findImageFormat(path_)),
      tone_map_(&findToneMap(options_.tone_map)) {
    if (format_ == nullptr) throw Error(ErrorKind::kInternal, "no picture has this name", path_);
}

ImageWriter::~ImageWriter() = default;

void ImageWriter::begin(const Plan& plan) {
    const StageTimer timer(times_, "encode");
    // The encoder comes first: without it no file is to be created.
    auto encoder = imageEncoder(std::string(format_->name));
    output_ = std::make_unique<Output>(path_);
    Output& output = *output_;
    output.encoder = std::move(encoder);

    const Window& crop = plan.view.crop;
    ImageToEncode image{path_, crop.width(), crop.height(), output.encoder->keepsAlpha() ? 4 : 3};
    image.bits = format_->bits;
    image.software = "peeler " + options_.provenance.version;
    image.description = outputHashText(options_.provenance.output_hash);
    // For TIFF this becomes an Exif directory, which OpenImageIO 2.4.7 links wrongly when it writes
    // through a proxy: the file is then unreadable. TIFF is taken for sRGB anyway.
    image.srgb = format_->name != "tiff";
    output.checked([&] { output.encoder->open(image, output.target); });
    output.image = image;
}

void ImageWriter::write(LayeredImage&& band) {
    {
        const StageTimer timer(times_, "composite");
        compositeOver(band, options_.background, composite_);
    }
    const StageTimer timer(times_, "encode");  // the encoder writes as it encodes
    const float gain = std::exp2(options_.exposure);
    if (format_->bits == 16) {
        output_->writeRows<std::uint16_t>(composite_, gain, *tone_map_);
    } else {
        output_->writeRows<std::uint8_t>(composite_, gain, *tone_map_);
    }
}

void ImageWriter::finish() {
    if (output_->next_row != output_->image.height) {
        throw Error(ErrorKind::kInternal, "rows of the picture are missing", path_);
    }
    const StageTimer timer(times_, "write");
    output_->checked([&] { output_->encoder->close(); });
    output_->file.commit();
    output_.reset();
}

}  // namespace peeler
