// SPDX-License-Identifier: Apache-2.0
#include "cmd/compare/compared_image.h"

#include <algorithm>
#include <utility>

#include "core/base/error.h"
#include "formats/file/file_kind.h"

namespace peeler::cmd {

namespace {

std::string text(const Window& window) {
    return std::to_string(window.width()) + " x " + std::to_string(window.height()) + " at (" +
           std::to_string(window.x0) + ", " + std::to_string(window.y0) + ')';
}

std::string size(int width, int height) {
    return std::to_string(width) + " x " + std::to_string(height);
}

}  // namespace

ComparedImage::ComparedImage(const std::string& path) : path_(path) {
    if (fileKind(path) == FileKind::kExr) {
        if (OpenedExr opened(path); isLayered(opened.info))
            reader_ = openLayered(std::move(opened));
    }
    if (!reader_) flat_ = readFlatImage(path);
}

int ComparedImage::width() const {
    return layered() ? reader_->info().plan.view.width : flat_.width;
}

int ComparedImage::height() const {
    return layered() ? reader_->info().plan.view.height : flat_.height;
}

Window ComparedImage::window() const {
    return layered() ? reader_->info().plan.view.crop : flat_.image.window;
}

int ComparedImage::rowsFor(std::uint64_t bytes) const {
    return layered() ? reader_->rowsFor(bytes) : window().height();
}

void ComparedImage::read(int first, int rows, LayeredImage& out) {
    const Window& crop = reader_->info().plan.view.crop;
    reader_->read({crop.x0, crop.y0 + first, crop.x1, crop.y0 + first + rows}, out);
}

void ComparedImage::read(int first, int rows, CompositeImage& out) {
    if (layered()) {
        read(first, rows, band_);
        compositeOver(band_, {}, out);
        return;
    }
    const Window all = window();
    out.window = {all.x0, all.y0 + first, all.x1, all.y0 + first + rows};
    const auto width = static_cast<std::size_t>(all.width());
    const std::size_t begin = static_cast<std::size_t>(first) * width;
    const std::size_t end = begin + out.window.pixels();
    out.rgba.assign(flat_.image.rgba.data() + begin, flat_.image.rgba.data() + end);
    out.z.assign(flat_.image.z.data() + begin, flat_.image.z.data() + end);
}

void checkComparable(const ComparedImage& a, const ComparedImage& b) {
    const Window wa = a.window(), wb = b.window();
    const std::string where = a.path() + ", " + b.path();
    if (a.placed() && b.placed()) {
        if (a.width() != b.width() || a.height() != b.height()) {
            throw Error(ErrorKind::kUsage, "the images differ in size", where,
                        "they are " + size(a.width(), a.height()) + " and " +
                            size(b.width(), b.height()) + " pixels; compare images of one size");
        }
        if (wa != wb) {
            throw Error(
                ErrorKind::kUsage, "the images differ in their crops", where,
                "they hold " + text(wa) + " and " + text(wb) + "; compare images of one crop");
        }
    }
    if (wa.width() != wb.width() || wa.height() != wb.height()) {
        throw Error(ErrorKind::kUsage, "the images differ in size", where,
                    "they hold " + size(wa.width(), wa.height()) + " and " +
                        size(wb.width(), wb.height()) + " pixels; compare images of one size");
    }
}

}  // namespace peeler::cmd
