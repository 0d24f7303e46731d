// SPDX-License-Identifier: Apache-2.0
// Benchmark of peeler's writers of layered and deep OpenEXR against OpenEXR's own classes: the same
// pixels, channels, compression and threads. Prints JSON with the milliseconds of every run and the
// files' sizes.
//
//     writers SCENE [--size 1920x1080] [--runs 3] [--what layered,deep,ours] [--folder .]
//
// `--what`: the kinds of file, and "ours" to skip OpenEXR's classes (for a profile). The picture is
// captured once, in advance. peeler's time is that from begin() to finish(): cropping, gathering,
// compositing the first part, compressing, writing, flushing to disk. OpenEXR's time is only that
// of opening, writePixels() and closing; preparing its input planes is not timed.
#include <OpenEXR/ImfChannelList.h>
#include <OpenEXR/ImfDeepFrameBuffer.h>
#include <OpenEXR/ImfDeepScanLineOutputFile.h>
#include <OpenEXR/ImfFrameBuffer.h>
#include <OpenEXR/ImfMultiPartOutputFile.h>
#include <OpenEXR/ImfOutputPart.h>
#include <OpenEXR/ImfPartType.h>
#include <OpenEXR/ImfThreading.h>

#include <algorithm>
#include <filesystem>
#include <limits>
#include <optional>

#include <peeler/composite.h>
#include "benchmarks/measured_scene.h"
#include "core/base/parallel.h"
#include "core/gl/context.h"
#include "formats/exr/exr_writers.h"
#include "support/capture.h"
#include "support/test_support.h"

namespace peeler::benchmark {
namespace {

namespace fs = std::filesystem;
constexpr const char* kColors[] = {"R", "G", "B", "A"};

/// A stopwatch that adds up the timed parts of a run.
class Watch {
  public:
    template <class Work>
    void time(Work&& work) {
        milliseconds_ += milliseconds(work);
    }
    double total() const { return milliseconds_; }

  private:
    double milliseconds_ = 0;
};

Imath::Box2i boxOf(const Window& window) {
    return {{window.x0, window.y0}, {window.x1 - 1, window.y1 - 1}};
}

class KeepingSink final : public Sink {
  public:
    void begin(const Plan&) override {}
    void write(LayeredImage&& band) override { bands.push_back(std::move(band)); }
    void finish() override {}
    std::vector<LayeredImage> bands;
};

struct Picture {
    explicit Picture(const Options& options) {
        const MeasuredScene scene(options);
        const auto context = gl::createContext({.backend = test::testBackend()});
        GlRenderer renderer(*context, scene.posed);
        const CapturePlan planned = renderer.plan(scene.view, {});
        plan = planned;
        KeepingSink sink;
        renderer.capture(planned, sink);
        bands = std::move(sink.bands);
    }
    Plan plan;
    std::vector<LayeredImage> bands;
};

/// The pixels of one part in OpenEXR's layout: R, G, B, A as half and Z as float.
struct Planes {
    explicit Planes(const Window& window)
        : area(window),
          z(window.pixels(), std::numeric_limits<float>::infinity()),
          color(window.pixels() * 4, Imath::half(0)) {}

    std::size_t at(int x, int y) const {
        return static_cast<std::size_t>(y - area.y0) * static_cast<std::size_t>(area.width()) +
               static_cast<std::size_t>(x - area.x0);
    }
    Imf::FrameBuffer frameBuffer() {
        Imf::FrameBuffer buffer;
        const auto width = static_cast<std::size_t>(area.width());
        for (std::size_t c = 0; c < 4; ++c)
            buffer.insert(kColors[c],
                          Imf::Slice::Make(Imf::HALF, color.data() + c * area.pixels(), boxOf(area),
                                           sizeof(Imath::half), sizeof(Imath::half) * width));
        buffer.insert("Z", Imf::Slice::Make(Imf::FLOAT, z.data(), boxOf(area), sizeof(float),
                                            sizeof(float) * width));
        return buffer;
    }

    Window area;
    std::vector<float> z;
    std::vector<Imath::half> color;  ///< one plane for each channel
};

Planes layerPlanes(const Picture& picture, std::size_t layer, const Window& window) {
    Planes planes(window);
    for (const LayeredImage& band : picture.bands) {
        const Window rows = intersect(band.window, window);
        for (int y = rows.y0; y < rows.y1; ++y) {
            for (int x = rows.x0; x < rows.x1; ++x) {
                const std::size_t pixel = band.pixelIndex(x, y), to = planes.at(x, y);
                if (band.count(pixel) <= layer) continue;
                const std::size_t from = band.offsets[pixel] + layer;
                planes.z[to] = band.z[from];
                for (std::size_t c = 0; c < 4; ++c)
                    planes.color[c * window.pixels() + to] =
                        band.color.as<Imath::half>()[from * 4 + c];
            }
        }
    }
    return planes;
}

Planes compositePlanes(const Picture& picture) {
    const Window window = picture.plan.view.crop;
    Planes planes(window);
    CompositeImage composite;
    for (const LayeredImage& band : picture.bands) {
        compositeOver(band, {}, composite);
        const std::size_t first = planes.at(band.window.x0, band.window.y0);
        for (std::size_t i = 0; i < composite.z.size(); ++i) {
            planes.z[first + i] = composite.z[i];
            for (std::size_t c = 0; c < 4; ++c)
                planes.color[c * window.pixels() + first + i] = composite.rgba[i][c];
        }
    }
    return planes;
}

Imf::Header headerOf(const Picture& picture, const std::string& name, const Window& window,
                     const char* type, Imf::Compression compression) {
    Imf::Header header(boxOf(picture.plan.view.crop), boxOf(window));
    header.setName(name);
    header.setType(type);
    header.compression() = compression;
    for (const char* color : kColors)
        header.channels().insert(color, Imf::Channel(Imf::HALF));
    header.channels().insert("Z", Imf::Channel(Imf::FLOAT));
    return header;
}

/// Writes all parts with OpenEXR's classes: the layers' data windows if `cropped`, otherwise whole
/// pictures. Returns milliseconds.
double writeLayered(const Picture& picture, const std::string& path, bool cropped) {
    const Window whole = picture.plan.view.crop;
    const std::size_t layers = picture.plan.layers.size();
    std::vector<Window> windows = {whole};
    std::vector<Imf::Header> headers;
    for (const LayerPlan& layer : picture.plan.layers)
        windows.push_back(cropped ? layer.data_window : whole);
    for (std::size_t i = 0; i <= layers; ++i)
        headers.push_back(headerOf(picture, i == 0 ? "composite" : layerName(i - 1), windows[i],
                                   Imf::SCANLINEIMAGE.c_str(), Imf::ZIP_COMPRESSION));
    Watch watch;
    std::optional<Imf::MultiPartOutputFile> file;
    watch.time(
        [&] { file.emplace(path.c_str(), headers.data(), static_cast<int>(headers.size())); });
    for (std::size_t i = 0; i <= layers; ++i) {
        Planes planes = i == 0 ? compositePlanes(picture) : layerPlanes(picture, i - 1, windows[i]);
        const Imf::FrameBuffer buffer = planes.frameBuffer();
        watch.time([&] {
            Imf::OutputPart part(*file, static_cast<int>(i));
            part.setFrameBuffer(buffer);
            part.writePixels(windows[i].height());
        });
    }
    watch.time([&] { file.reset(); });
    return watch.total();
}

/// Pointers to the first sample of every pixel, for each channel of the frame buffer.
struct DeepPointers {
    explicit DeepPointers(const LayeredImage& image) {
        const std::size_t pixels = image.window.pixels();
        for (auto& channel : samples)
            channel.resize(pixels);
        for (std::size_t p = 0; p < pixels; ++p) {
            counts.push_back(image.count(p));
            const std::size_t first = image.offsets[p];
            for (std::size_t c = 0; c < 4; ++c)
                samples[c][p] = image.color.data.data() + (first * 4 + c) * sizeof(Imath::half);
            samples[4][p] = reinterpret_cast<const std::byte*>(image.z.data() + first);
        }
    }

    Imf::DeepFrameBuffer frameBuffer(const Window& window) {
        const auto width = static_cast<std::size_t>(window.width());
        // OpenEXR's slices address pixels relative to the display window's origin.
        const auto at = [&](auto& values) {
            const auto back = static_cast<std::ptrdiff_t>(window.y0) * window.width() + window.x0;
            return reinterpret_cast<char*>(values.data()) -
                   back * static_cast<std::ptrdiff_t>(sizeof(values[0]));
        };
        Imf::DeepFrameBuffer buffer;
        buffer.insertSampleCountSlice(
            Imf::Slice(Imf::UINT, at(counts), sizeof(unsigned), sizeof(unsigned) * width));
        for (std::size_t c = 0; c < 5; ++c)
            buffer.insert(c < 4 ? kColors[c] : "Z",
                          Imf::DeepSlice(c < 4 ? Imf::HALF : Imf::FLOAT, at(samples[c]),
                                         sizeof(void*), sizeof(void*) * width,
                                         c < 4 ? 4 * sizeof(Imath::half) : sizeof(float)));
        return buffer;
    }

    std::vector<unsigned> counts{};
    std::array<std::vector<const std::byte*>, 5> samples{};
};

/// Writes all rows in a single call. Returns milliseconds.
double writeDeep(const Picture& picture, const LayeredImage& image, DeepPointers& pointers,
                 const std::string& path) {
    const Window window = image.window;
    Imf::Header header =
        headerOf(picture, "color", window, Imf::DEEPSCANLINE.c_str(), Imf::ZIPS_COMPRESSION);
    const Imf::DeepFrameBuffer buffer = pointers.frameBuffer(window);
    Watch watch;
    watch.time([&] {
        Imf::DeepScanLineOutputFile file(path.c_str(), header);
        file.setFrameBuffer(buffer);
        file.writePixels(window.height());
    });
    return watch.total();
}

/// Writes the bands with peeler's writer. Returns milliseconds.
template <class Writer>
double writeOurs(const Picture& picture, const std::string& path) {
    Watch watch;
    Writer writer(path);
    watch.time([&] { writer.begin(picture.plan); });
    for (const LayeredImage& band : picture.bands) {
        LayeredImage copy = band;
        watch.time([&] { writer.write(std::move(copy)); });
    }
    watch.time([&] { writer.finish(); });
    return watch.total();
}

/// A writer to compare.
struct Row {
    std::string name;
    std::function<double(const std::string& path)> write;
};

bool asked(const Options& options, const char* name) {
    return std::ranges::count(options.what, name) != 0;
}

/// Times the rows, which take turns. The first row is peeler's writer.
nlohmann::json compared(std::vector<Row> rows, const Options& options) {
    if (asked(options, "ours")) rows.resize(1);
    nlohmann::json result = nlohmann::json::object();
    for (int i = 0; i < options.runs; ++i) {
        for (const Row& row : rows) {
            const fs::path path = fs::path(options.folder) / (row.name + ".exr");
            fs::remove(path);  // so that OpenEXR creates the file, as peeler does
            result["milliseconds"][row.name].push_back(row.write(path.string()));
            result["bytes"][row.name] = fs::file_size(path);
            fs::remove(path);
        }
    }
    return result;
}

nlohmann::json layered(const Picture& picture, const Options& options) {
    return compared(
        {{"peeler", [&](const auto& path) { return writeOurs<ExrLdiWriter>(picture, path); }},
         {"full", [&](const auto& path) { return writeLayered(picture, path, false); }},
         {"cropped", [&](const auto& path) { return writeLayered(picture, path, true); }}},
        options);
}

nlohmann::json deep(const Picture& picture, const Options& options) {
    test::CollectSink whole;
    for (const LayeredImage& band : picture.bands)
        whole.write(LayeredImage(band));
    DeepPointers pointers(whole.image);
    return compared(
        {{"peeler", [&](const auto& path) { return writeOurs<ExrDeepWriter>(picture, path); }},
         {"openexr",
          [&](const auto& path) { return writeDeep(picture, whole.image, pointers, path); }}},
        options);
}

nlohmann::json measure(const Options& options) {
    const Picture picture(options);
    Imf::setGlobalThreadCount(threadCount());
    nlohmann::json result = {{"threads", threadCount()},
                             {"layers", picture.plan.layers.size()},
                             {"fragments", picture.plan.fragments_stored}};
    const bool both = asked(options, "layered") == asked(options, "deep");
    if (both || asked(options, "layered")) result["layered"] = layered(picture, options);
    if (both || asked(options, "deep")) result["deep"] = deep(picture, options);
    return result;
}

}  // namespace
}  // namespace peeler::benchmark

int main(int count, char** arguments) {
    return peeler::benchmark::run(count, arguments, peeler::benchmark::measure);
}
