// SPDX-License-Identifier: Apache-2.0
// PLY writer: a header whose length does not depend on the number of points, followed by the
// points.
#include "formats/arrays/table_writers.h"

#include <limits>
#include <string_view>
#include <utility>

#include <peeler/error.h>

namespace peeler {
namespace {

constexpr std::size_t kCountDigits = std::numeric_limits<std::uint64_t>::digits10 + 1;

void checkWord(const std::string& text, std::string_view forbidden, const std::string& path) {
    if (!text.empty() && text.find_first_of(forbidden) == std::string::npos) return;
    throw Error(ErrorKind::kInternal, "a PLY header cannot hold \"" + text + "\"", path);
}

}  // namespace

PlyWriter::PlyWriter(const std::string& path, std::vector<PlyProperty> properties,
                     std::vector<std::string> comments)
    : file_(path), properties_(std::move(properties)), comments_(std::move(comments)) {
    for (const PlyProperty& property : properties_) {
        checkWord(property.name, " \t\r\n", path);
        if (infoOf(property.type).ply.empty()) {
            throw Error(ErrorKind::kInternal, "PLY has no type for " + property.name, path);
        }
        point_size_ += infoOf(property.type).size;
    }
    for (const std::string& comment : comments_)
        checkWord(comment, "\r\n", path);
    const std::string text = header(properties_, comments_, 0);
    header_size_ = text.size();
    file_.append(std::as_bytes(std::span(text)));
}

/// Returns the header. A comment of dots pads the number of points, so that all headers with these
/// properties and comments have the same length.
std::string PlyWriter::header(std::span<const PlyProperty> properties,
                              std::span<const std::string> comments, std::uint64_t points) {
    const std::string count = std::to_string(points);
    std::string text = "ply\nformat binary_little_endian 1.0\n";
    text += "comment arrays_version " + std::to_string(kArraysVersion) + '\n';
    for (const std::string& comment : comments)
        text += "comment " + comment + '\n';
    text += "comment " + std::string(kCountDigits - count.size(), '.') + '\n';
    text += "element vertex " + count + '\n';
    for (const PlyProperty& property : properties) {
        text += "property " + std::string(infoOf(property.type).ply) + ' ' + property.name + '\n';
    }
    return text + "end_header\n";
}

std::uint64_t PlyWriter::fileBytes(std::span<const PlyProperty> properties,
                                   std::span<const std::string> comments, std::uint64_t points) {
    std::uint64_t point = 0;
    for (const PlyProperty& property : properties)
        point += infoOf(property.type).size;
    return header(properties, comments, points).size() + points * point;
}

void PlyWriter::checkWhole(std::span<const std::byte> points) const {
    if (point_size_ == 0 || points.size() % point_size_ != 0) {
        throw Error(ErrorKind::kInternal, "these are not whole points", file_.path());
    }
}

void PlyWriter::append(std::span<const std::byte> points) {
    checkWhole(points);
    file_.append(points);
    points_ += points.size() / point_size_;
}

void PlyWriter::writeAt(std::uint64_t first, std::span<const std::byte> points) {
    checkWhole(points);
    const std::lock_guard lock(mutex_);
    file_.writeAt(header_size_ + first * point_size_, points);
    points_ += points.size() / point_size_;
}

void PlyWriter::finish() {
    if (file_.size() != header_size_ + points_ * point_size_)
        throw Error(ErrorKind::kInternal, "points are missing", file_.path());
    const std::string text = header(properties_, comments_, points_);
    file_.writeAt(0, std::as_bytes(std::span(text)));
    file_.commit();
}

}  // namespace peeler
