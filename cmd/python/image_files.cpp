// SPDX-License-Identifier: Apache-2.0
// Pictures of Python in files and together: written, read, merged, compared, shown in notebooks.
#include <stdlib.h>

#include <algorithm>
#include <cstring>
#include <filesystem>
#include <nlohmann/json.hpp>

#include <peeler/channels.h>
#include <peeler/error.h>
#include "cmd/compare/compare_result.h"
#include "cmd/options/layered_options.h"
#include "cmd/options/output_checks.h"
#include "cmd/options/output_options.h"
#include "cmd/python/binding.h"
#include "core/image/composite.h"
#include "core/image/layers.h"
#include "core/image/merge.h"
#include "formats/arrays/fragment_tables.h"
#include "formats/file/file_name.h"
#include "formats/file/regular_file.h"
#include "formats/layered/opened_picture.h"
#include "formats/output_hash.h"
#include "formats/writers.h"

namespace peeler::python {

namespace {

namespace fs = std::filesystem;

/// Rows [y0, y1) of a picture as a picture.
LayeredImage rowsOf(const LayeredImage& image, int y0, int y1) {
    LayeredImage band;
    band.window = {image.window.x0, y0, image.window.x1, y1};
    const std::size_t first = image.pixelIndex(image.window.x0, y0);
    const std::size_t last = first + band.window.pixels();
    const std::uint32_t begin = image.offsets[first], end = image.offsets[last];
    for (std::size_t p = first; p <= last; ++p)
        band.offsets.push_back(image.offsets[p] - begin);
    band.z.assign(image.z.begin() + begin, image.z.begin() + end);
    const auto cut = [&](const FragmentArray& array) {
        FragmentArray part{array.channels, array.type, {}};
        part.data.assign(array.data.begin() + static_cast<std::ptrdiff_t>(begin * array.stride()),
                         array.data.begin() + static_cast<std::ptrdiff_t>(end * array.stride()));
        return part;
    };
    band.color = cut(image.color);
    for (const FragmentArray& array : image.extra)
        band.extra.push_back(cut(array));
    return band;
}

void writeBands(const LayeredImage& image, Sink& sink) {
    constexpr std::uint64_t kBandFragments = std::uint64_t{1} << 21;
    const Window& window = image.window;
    const std::uint64_t bands = image.fragments() / kBandFragments + 1;
    const int rows =
        std::max(1, static_cast<int>(static_cast<std::uint64_t>(window.height()) / bands));
    for (int y = window.y0; y < window.y1; y += rows)
        sink.write(rowsOf(image, y, std::min(y + rows, window.y1)));
}

/// Files have channels by name; pictures have them in the order of the table, components, too.
void arrange(LayeredImage& image) {
    const auto place = [](const FragmentArray& array) {
        for (const ChannelInfo& info : channelTable())
            if (std::ranges::is_permutation(array.channels, info.components)) return &info;
        return static_cast<const ChannelInfo*>(nullptr);
    };
    for (FragmentArray& array : image.extra) {
        const ChannelInfo* const info = place(array);
        if (!info || std::ranges::equal(array.channels, info->components)) continue;
        const std::size_t number = pixelTypeSize(array.type), stride = array.stride();
        std::vector<std::size_t> from;
        for (const std::string_view component : info->components)
            from.push_back(static_cast<std::size_t>(std::ranges::find(array.channels, component) -
                                                    array.channels.begin()));
        std::vector<std::byte> one(stride);
        for (std::size_t f = 0; f < array.data.size(); f += stride) {
            std::memcpy(one.data(), array.data.data() + f, stride);
            for (std::size_t c = 0; c < from.size(); ++c)
                std::memcpy(array.data.data() + f + c * number, one.data() + from[c] * number,
                            number);
        }
        array.channels.assign(info->components.begin(), info->components.end());
    }
    // What the table does not know goes last.
    std::ranges::stable_sort(image.extra, {}, [&](const FragmentArray& array) {
        const ChannelInfo* const info = place(array);
        return info ? info - channelTable().data() : std::ptrdiff_t{1000};
    });
}

}  // namespace

ImageHolder selected(const ImageObject& from, LayeredImage&& image) {
    auto object = std::make_shared<ImageObject>();
    object->image = std::move(image);
    object->plan = from.plan;
    object->provenance = from.provenance;
    object->provenance.output_hash.clear();
    object->plan.view.crop = object->image.window;
    object->plan.layers = unlocked([&] {
        DepthComplexity complexity(object->image.window);
        complexity.addBand(object->image);
        return complexity.layers();
    });
    object->plan.fragments_stored = object->image.fragments();
    return object;
}

void saveTo(const std::string& call, const py::object& path, const py::dict& given,
            const Plan& plan, const Provenance& provenance, bool composited,
            const std::function<void(Sink&)>& bands) {
    cmd::OutputRequest output;
    Keywords keywords(call);
    addOutputOptions(keywords.options(), output);
    addLayerOutputOptions(keywords.options(), output);
    bool cryptomatte = false;
    keywords.options().addFlag("--cryptomatte", cryptomatte,
                               "Cryptomatte in the composite part; needs channels=['id']");
    const std::string file = pathOf(path);
    keywords.options().option("--output").required(false);
    keywords.parse(given);
    output.path = file;
    if (composited && output.options.as.empty()) output.options.as = "composite";
    unlocked([&] {
        cmd::checkOutput(output, {});
        const OutputFormat& format = findOutputFormat(file, output.options.as);
        if (composited && !format.holds(OutputContent::kComposite))
            throw Error(ErrorKind::kUsage, "a composite has no layers", file,
                        "layers() renders them");
        if (format.holds(OutputContent::kShadowMap))
            throw Error(ErrorKind::kUsage, "layers do not tell which surfaces cast shadows",
                        "--as midpoint-depth", "peeler.render() writes it");
        OutputOptions options = output.from(provenance);
        options.automatic_exposure = output.leavesExposureOpen();
        options.composited = composited;
        options.cryptomatte = cryptomatte;
        if (!provenance.settings_hash.empty())
            options.provenance.output_hash = outputHash(plan.view, file, options);
        const std::unique_ptr<Sink> sink = makeSink(file, options);
        sink->begin(plan);
        bands(*sink);
        sink->finish();
    });
}

py::bytes pngOf(const CompositeImage& picture) {
    constexpr int kMostShown = 1024;
    const int step = std::max(
        1, (std::max(picture.window.width(), picture.window.height()) - 1) / kMostShown + 1);
    std::string bytes;
    unlocked([&] {
        // Of a large picture every step-th pixel of every step-th row, as the mean of those beside.
        CompositeImage shown;
        shown.window = {0, 0, std::max(1, picture.window.width() / step),
                        std::max(1, picture.window.height() / step)};
        shown.rgba.resize(shown.window.pixels());
        shown.z.assign(shown.window.pixels(), 0);
        const auto width = static_cast<std::size_t>(picture.window.width());
        const float weight = 1.0F / static_cast<float>(step * step);
        for (int y = 0; y < shown.window.height() * step; ++y) {
            for (int x = 0; x < shown.window.width() * step; ++x) {
                const auto& from =
                    picture.rgba[static_cast<std::size_t>(y) * width + static_cast<std::size_t>(x)];
                auto& to = shown.rgba[static_cast<std::size_t>(y / step) *
                                          static_cast<std::size_t>(shown.window.width()) +
                                      static_cast<std::size_t>(x / step)];
                for (std::size_t c = 0; c < 4; ++c)
                    to[c] += weight * from[c];
            }
        }
        std::string folder = (fs::temp_directory_path() / "peeler-XXXXXX").string();
        if (!mkdtemp(folder.data()))
            throw Error(ErrorKind::kOutput, "no temporary folder can be made", folder);
        const fs::path file = fs::path(folder) / "shown.png";
        const auto clean = [&] {
            std::error_code ignored;
            fs::remove_all(folder, ignored);
        };
        try {
            OutputOptions options;
            options.as = "composite";
            options.automatic_exposure = true;
            options.tone_map = "neutral";
            writePicture(file.string(), shown, options);
            bytes = readRegularText(file);
        } catch (...) {
            clean();
            throw;
        }
        clean();
    });
    return bytes;
}

void saveImage(const ImageObject& object, const py::object& path, const py::kwargs& keywords) {
    const std::string file = pathOf(path), extension = lowerExtension(file);
    py::dict given = keywords.attr("copy")();
    Plan plan = object.plan;
    plan.color_type = object.image.color.type;
    plan.tinted = object.image.tinted();
    const auto default_material =
        static_cast<std::uint32_t>(object.provenance.ids.materials.size());
    if ((extension == ".npz" && given.empty()) || extension == ".ply") {
        Keywords none("save");
        none.parse(given);
        unlocked([&] {
            cmd::OutputRequest output;
            output.path = file;
            cmd::checkTarget(output, {});
            LayeredImage image = object.image;
            addLayerIndices(image);
            const std::unique_ptr<Sink> sink =
                extension == ".npz"
                    ? makeFragmentArrays(file, {plan.view.known, default_material})
                    : makeFragmentPoints(file, {.comment = "fragments by peeler " PEELER_VERSION,
                                                .default_material = default_material});
            plan.fragments_stored = image.fragments();
            sink->begin(plan);
            sink->write(std::move(image));
            sink->finish();
        });
        return;
    }
    saveTo("save", path, given, plan, object.provenance, false,
           [&](Sink& sink) { writeBands(object.image, sink); });
}

void saveComposite(const CompositeObject& object, const py::object& path,
                   const py::kwargs& keywords) {
    saveTo("save", path, py::dict(keywords.attr("copy")()), object.plan, object.provenance, true,
           [&](Sink& sink) {
               LayeredImage image;
               toSingleLayer(object.image, image);
               sink.write(std::move(image));
           });
}

ImageHolder readImage(const py::object& path, const py::kwargs& keywords) {
    const std::string file = pathOf(path);
    LayeredReadOptions options;
    Keywords declared("read");
    cmd::addLayeredOptions(declared.options(), options);
    declared.parse(keywords);
    options.pixels_only = true;
    std::vector<std::string> warnings;
    auto object = std::make_shared<ImageObject>();
    unlocked([&] {
        const std::unique_ptr<LayeredInput> input = openLayered(file, options);
        const ExrInfo& info = input->info();
        object->plan = info.plan;
        object->plan.view.known = info.attributes().contains("peeler:cameraJson");
        object->provenance = info.provenance;
        input->read(info.plan.view.crop, object->image);
        arrange(object->image);
        DepthComplexity complexity(object->image.window);
        complexity.addBand(object->image);
        object->plan.layers = complexity.layers();
        object->plan.fragments_stored = object->image.fragments();
        if (!info.is_peeler) object->plan.fragments_counted = object->image.fragments();
        object->plan.color_type = object->image.color.type;
        object->plan.tinted = object->image.tinted();
        warnings = input->takeWarnings();
    });
    warn(warnings);
    return object;
}

/// Elements by depth, or tiles side by side.
ImageHolder mergeImages(const std::vector<ImageHolder>& images, bool elements) {
    if (images.empty()) throw Error(ErrorKind::kUsage, "there is nothing to merge", "images");
    std::vector<LayeredImage> parts;
    Window window;
    std::uint64_t counted = 0;
    for (const ImageHolder& image : images) {
        parts.push_back(image->image);
        window = unite(window, image->image.window);
        counted += image->plan.fragments_counted;
    }
    LayeredImage merged;
    unlocked([&] {
        if (elements) {
            mergeByDepth(parts, window, parts.front(), merged);
        } else if (const auto pixel = joinTiles(parts, window, parts.front(), merged)) {
            throw Error(ErrorKind::kUsage,
                        "tiles that overlap do not agree on pixel (" + std::to_string(pixel->x0) +
                            ", " + std::to_string(pixel->y0) + ')',
                        "images", "elements=True merges by depth");
        }
    });
    ImageHolder object = selected(*images.front(), std::move(merged));
    object->plan.fragments_counted = counted;
    return object;
}

py::object compareImages(const ImageObject& a, const ImageObject& b) {
    if (a.image.window.width() != b.image.window.width() ||
        a.image.window.height() != b.image.window.height())
        throw Error(ErrorKind::kUsage, "pictures of different sizes cannot be compared", "a, b");
    cmd::Comparison found;
    found.by_layer = true;
    found.width = a.image.window.width();
    found.height = a.image.window.height();
    found.a = {"a", true, a.plan.layers.size()};
    found.b = {"b", true, b.plan.layers.size()};
    unlocked([&] { addDifference(a.image, b.image, found.difference); });
    return toPython(cmd::toJson(found, {}, {}));
}

}  // namespace peeler::python
