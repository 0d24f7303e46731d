// SPDX-License-Identifier: Apache-2.0
// Writer of fragments as .ply points.
#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>
#include <vector>

#include <peeler/composite.h>
#include <peeler/layered_image.h>
#include "core/base/parallel.h"
#include "core/base/resize_anew.h"
#include "formats/arrays/fragment_columns.h"
#include "formats/arrays/fragment_tables.h"
#include "formats/arrays/table_writers.h"
#include "formats/file/byte_buffer.h"
#include "formats/image/display.h"

namespace peeler {
namespace {

/// Returns the names of the channels of the normals; empty if the band has no normals.
std::vector<std::string> normalChannels(const LayeredImage& band) {
    for (const std::string prefix : {"N", "Ng"}) {
        std::vector<std::string> names{prefix + ".X", prefix + ".Y", prefix + ".Z"};
        if (std::ranges::all_of(names, [&](const std::string& name) {
                return static_cast<bool>(findChannel(band, name));
            }))
            return names;
    }
    return {};
}

/// The properties of a point: position, normal, colour, then integers.
struct PointTable {
    PointTable(const LayeredImage& band, const FragmentPointOptions& options)
        : normal(normalChannels(band)) {
        const NumberType position =
            options.double_positions ? NumberType::kDouble : NumberType::kFloat;
        for (const char* name : {"x", "y", "z"})
            properties.push_back({name, position});
        if (!normal.empty()) {
            for (const char* name : {"nx", "ny", "nz"})
                properties.push_back({name, NumberType::kFloat});
        }
        for (const char* name : {"red", "green", "blue", "alpha"})
            properties.push_back({name, NumberType::kUint8});
        for (FragmentColumn& column : fragmentColumns(band)) {
            for (const std::string& name : column.properties)
                properties.push_back({name, column.type});
            if (!column.properties.empty()) numbers.push_back(std::move(column));
        }
        comments = {options.comment};
        if (!normal.empty())
            comments.emplace_back(findChannel(band, "facing") ? "normals on the front"
                                                              : "normals toward the viewer");
    }

    std::vector<std::string> normal;
    std::vector<FragmentColumn> numbers;
    std::vector<PlyProperty> properties;
    std::vector<std::string> comments;
};

class FragmentPoints final : public Sink {
  public:
    FragmentPoints(std::string path, FragmentPointOptions options)
        : path_(std::move(path)), options_(std::move(options)) {}

    void begin(const Plan& plan) override { view_ = plan.view; }
    void write(LayeredImage&& band) override;
    void finish() override { writer_->finish(); }

  private:
    std::string path_;
    FragmentPointOptions options_;
    View view_;
    std::optional<PointTable> table_;
    std::optional<PlyWriter> writer_;  ///< created with the first band
    std::vector<std::byte> points_;
};

void FragmentPoints::write(LayeredImage&& band) {
    if (!writer_) {
        table_.emplace(band, options_);
        writer_.emplace(path_, table_->properties, table_->comments);
    }
    const FragmentChannel facing = findChannel(band, "facing");
    std::vector<FragmentChannel> normal;
    for (const std::string& name : table_->normal)
        normal.push_back(findChannel(band, name));
    std::vector<FragmentColumnReader> numbers;
    for (const FragmentColumn& column : table_->numbers)
        numbers.emplace_back(band, column, options_.default_material);

    const std::size_t size = writer_->pointSize();
    resizeAnew(points_, band.fragments() * size);
    const auto width = static_cast<std::size_t>(band.window.width());
    parallelFor(static_cast<std::size_t>(band.window.height()), [&](std::size_t row) {
        const double y = band.window.y0 + static_cast<int>(row) + view_.sample.y;
        for (std::size_t column = 0; column < width; ++column) {
            const std::size_t pixel = row * width + column;
            const double x = band.window.x0 + static_cast<int>(column) + view_.sample.x;
            for (std::size_t f = band.offsets[pixel]; f < band.offsets[pixel + 1]; ++f) {
                std::byte* out = points_.data() + f * size;
                const glm::dvec3 position = worldPosition(view_, x, y, band.z[f]);
                for (int i = 0; i < 3; ++i) {
                    out = options_.double_positions
                              ? storeNumber(position[i], out)
                              : storeNumber(static_cast<float>(position[i]), out);
                }
                const float side = facing && facing.value(f) < 0 ? -1.0F : 1.0F;
                for (const FragmentChannel& component : normal)
                    out = storeNumber(side * component.value(f), out);
                out = storeNumber(displayColor(colorOf(band, f)), out);
                for (const FragmentColumnReader& number : numbers)
                    out = number.put(f, out);
            }
        }
    });
    writer_->append(points_);
}

}  // namespace

std::unique_ptr<Sink> makeFragmentPoints(std::string path, FragmentPointOptions options) {
    return std::make_unique<FragmentPoints>(std::move(path), std::move(options));
}

SizeForecast forecastFragmentPoints(const Plan& plan, const LayeredImage& band,
                                    const FragmentPointOptions& options) {
    const PointTable table(band, options);
    return {PlyWriter::fileBytes(table.properties, table.comments, plan.fragments_stored)};
}

std::uint64_t fragmentPointBytes(const LayeredImage& band, const FragmentPointOptions& options) {
    std::uint64_t bytes = 0;
    for (const PlyProperty& property : PointTable(band, options).properties)
        bytes += infoOf(property.type).size;
    return bytes;
}

}  // namespace peeler
