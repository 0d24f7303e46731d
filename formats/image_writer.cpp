// SPDX-License-Identifier: Apache-2.0
// Tone mapping, sRGB, and OpenImageIO's scan-line writers on top of an AtomicFile.
#include "formats/image_writer.h"

#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <exception>
#include <limits>
#include <type_traits>
#include <utility>
#include <vector>

#include "core/error.h"
#include "core/parallel.h"
#include "core/srgb.h"
#include "formats/atomic_file.h"
#include "formats/output_hash.h"

namespace peeler {
namespace {

using Rgb = std::array<float, 3>;

Rgb keep(Rgb color) {
    return color;
}

/// Khronos PBR Neutral: leaves base colours below 0.8 as they are (but for Fresnel's 4 %) and
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

/// What OpenImageIO writes goes through the AtomicFile, so that a full disk is noticed at once and
/// said as for every other format. Exceptions must not pass through the plugins (some are C
/// inside): they wait in `failure`.
class AtomicProxy : public OIIO::Filesystem::IOProxy {
  public:
    explicit AtomicProxy(AtomicFile& file) : IOProxy(file.path(), Write), file_(file) {}

    const char* proxytype() const override { return "peeler"; }
    std::size_t size() const override { return file_.size(); }

    std::size_t write(const void* data, std::size_t bytes) override {
        const std::size_t written = pwrite(data, bytes, m_pos);
        m_pos += static_cast<std::int64_t>(written);
        return written;
    }
    std::size_t pwrite(const void* data, std::size_t bytes, std::int64_t offset) override {
        const std::span source(static_cast<const std::byte*>(data), bytes);
        const auto position = static_cast<std::uint64_t>(offset);
        if (discards) return bytes;
        return guarded([&] {
            if (position == file_.size()) {
                file_.append(source);
            } else {
                file_.writeAt(position, source);
            }
            return bytes;
        });
    }
    std::size_t read(void* data, std::size_t bytes) override {
        const std::size_t got = pread(data, bytes, m_pos);
        m_pos += static_cast<std::int64_t>(got);
        return got;
    }
    std::size_t pread(void* data, std::size_t bytes, std::int64_t offset) override {
        return guarded([&] {
            return file_.readAt(static_cast<std::uint64_t>(offset),
                                {static_cast<std::byte*>(data), bytes});
        });
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

template <class T>
T quantize(float value) {
    constexpr float kMax = static_cast<float>(std::numeric_limits<T>::max());
    return static_cast<T>(std::lround(std::clamp(value, 0.0F, 1.0F) * kMax));
}

}  // namespace

std::span<const ToneMap> toneMaps() {
    return kToneMaps;
}

float encodeSrgb(float linear) {
    if (!(linear > 0)) return 0;
    if (linear >= 1) return 1;
    return srgbFromLinear(linear);
}

/// The open file. `proxy` and `image` refer to `file`, so the order of members matters.
struct ImageWriter::Output {
    explicit Output(const std::string& path) : file(path), proxy(file) {}
    ~Output() { abandon(); }

    /// Throws unless `success`; what the disk said goes before what the plugin made of it.
    void check(bool success) {
        if (proxy.failure) std::rethrow_exception(proxy.failure);
        if (success) return;
        const std::string message = image ? image->geterror() : OIIO::geterror();
        throw Error(ErrorKind::kOutput, "cannot write: " + message, file.path());
    }

    template <class T>
    void writeRows(const CompositeImage& composite, float gain, const ToneMap& tone_map);

    /// Closes an unfinished picture. libpng complains on stderr about missing rows, so it gets
    /// them, black; nothing of it reaches the disk.
    void abandon() noexcept;

    AtomicFile file;
    AtomicProxy proxy;
    std::unique_ptr<OIIO::ImageOutput> image;
    std::size_t channels = 4;
    int next_row = 0;  ///< of the file, 0 = top of the crop
    std::vector<std::byte> pixels;
};

template <class T>
void ImageWriter::Output::writeRows(const CompositeImage& composite, float gain,
                                    const ToneMap& tone_map) {
    const auto width = static_cast<std::size_t>(composite.window.width());
    const int height = composite.window.height();
    constexpr int kRowsAtOnce = 64;
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
                    out[c] = quantize<T>(encodeSrgb(mapped[c]));
                if (keeps_alpha) out[3] = quantize<T>(alpha);
            }
        });
        const OIIO::TypeDesc type = sizeof(T) == 1 ? OIIO::TypeDesc::UINT8 : OIIO::TypeDesc::UINT16;
        check(image->write_scanlines(next_row, next_row + rows, 0, type, first));
        next_row += rows;
    }
}

void ImageWriter::Output::abandon() noexcept {
    proxy.discards = true;
    try {
        if (!image || image->spec().height == 0) return;
        const OIIO::ImageSpec& spec = image->spec();
        const std::vector<std::byte> black(spec.scanline_bytes(true));
        while (next_row < spec.height &&
               image->write_scanline(next_row, 0, spec.format, black.data())) {
            ++next_row;
        }
        image->close();
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

ImageWriter::ImageWriter(std::string path, std::string format, ImageOptions options)
    : path_(std::move(path)),
      format_(std::move(format)),
      options_(std::move(options)),
      tone_map_(&findToneMap(options_.tone_map)) {}

ImageWriter::~ImageWriter() = default;

void ImageWriter::begin(const Plan& plan) {
    output_ = std::make_unique<Output>(path_);
    Output& output = *output_;
    output.image = OIIO::ImageOutput::create(format_);
    output.check(output.image != nullptr);
    output.channels = output.image->supports("alpha") ? 4 : 3;

    const Window& crop = plan.view.crop;
    OIIO::ImageSpec spec(crop.width(), crop.height(), static_cast<int>(output.channels),
                         format_ == "tiff" ? OIIO::TypeDesc::UINT16 : OIIO::TypeDesc::UINT8);
    // For TIFF this becomes an Exif directory, which OpenImageIO 2.4.7 links wrongly when it writes
    // through a proxy: the file is then unreadable. TIFF is taken for sRGB anyway.
    if (format_ != "tiff") spec.attribute("oiio:ColorSpace", "sRGB");
    spec.attribute("oiio:UnassociatedAlpha", 1);  // it is straight already: do not divide once more
    if (!options_.software.empty()) spec.attribute("Software", options_.software);
    if (const std::string hash = outputHashText(options_.output_hash); !hash.empty())
        spec.attribute("ImageDescription", hash);
    if (format_ == "tiff") spec.attribute("DateTime", "");  // else it says when it was written
    if (format_ == "jpeg") {
        spec.attribute("Compression", "jpeg:95");
        spec.attribute("jpeg:subsampling", "4:4:4");
    }
    output.check(output.image->set_ioproxy(&output.proxy));
    output.check(output.image->open(path_, spec));
}

void ImageWriter::write(const LayeredImage& band) {
    {
        const StageTimer timer(times_, "composite");
        compositeOver(band, options_.background, composite_);
    }
    const StageTimer timer(times_, "encode");  // the plugin writes as it encodes
    const float gain = std::exp2(options_.exposure);
    if (format_ == "tiff") {
        output_->writeRows<std::uint16_t>(composite_, gain, *tone_map_);
    } else {
        output_->writeRows<std::uint8_t>(composite_, gain, *tone_map_);
    }
}

void ImageWriter::finish() {
    const OIIO::ImageSpec& spec = output_->image->spec();
    if (output_->next_row != spec.height) {
        throw Error(ErrorKind::kInternal, "rows of the picture are missing", path_);
    }
    const StageTimer timer(times_, "write");
    output_->check(output_->image->close());
    output_->file.commit();
    output_.reset();
}

}  // namespace peeler
