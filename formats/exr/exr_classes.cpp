// SPDX-License-Identifier: Apache-2.0
#include "formats/exr/exr_classes.h"

#include <OpenEXR/IexErrnoExc.h>
#include <OpenEXR/ImfChannelList.h>
#include <OpenEXR/ImfFrameBuffer.h>
#include <OpenEXR/ImfInputPart.h>
#include <OpenEXR/ImfMultiPartInputFile.h>
#include <OpenEXR/ImfTiledInputPart.h>

#include <exception>
#include <mutex>
#include <new>
#include <string_view>
#include <vector>

#include <peeler/error.h>
#include "formats/exr/exr_chunks.h"
#include "formats/exr/exr_stream.h"

namespace peeler {
namespace {

/// Calls `action`, which uses OpenEXR's classes, and converts exceptions of OpenEXR.
template <class Action>
auto byClasses(const std::string& place, Action&& action) {
    try {
        return action();
    } catch (const Error&) {
        throw;
    } catch (const std::bad_alloc&) {
        throw;
    } catch (const Iex::EnomemExc&) {
        throw std::bad_alloc();
    } catch (const std::exception& problem) {
        const std::string_view what = problem.what();
        // OpenEXR's tasks keep only the text of an exception.
        if (what.find("bad_alloc") != std::string_view::npos) throw std::bad_alloc();
        throw Error(ErrorKind::kInput, "OpenEXR cannot read the file: " + std::string(what), place,
                    "the file may be damaged or cut off; write it again");
    }
}

}  // namespace

struct ExrClasses::File {
    File(const RegularFile& file, const std::string& path)
        : stream(file, path), input(stream, 0, false) {}

    ExrStream stream;
    Imf::MultiPartInputFile input;
    std::mutex mutex;
};

ExrClasses::ExrClasses(const RegularFile& file, const std::string& path)
    : file_(byClasses(path, [&] { return std::make_unique<File>(file, path); })) {}

ExrClasses::~ExrClasses() = default;

void ExrClasses::readRows(int part, const Window& rows, std::span<const ExrPlane> planes,
                          const std::string& place) {
    const std::lock_guard lock(file_->mutex);
    byClasses(place, [&] {
        Imf::FrameBuffer buffer;
        const Imath::Box2i window({rows.x0, rows.y0}, {rows.x1 - 1, rows.y1 - 1});
        for (const ExrPlane& plane : planes)
            buffer.insert(plane.name,
                          Imf::Slice::Make(exrPixelType(plane.type), plane.first, window));
        Imf::InputPart input(file_->input, part);
        input.setFrameBuffer(buffer);
        input.readPixels(rows.y0, rows.y1 - 1);
    });
}

void ExrClasses::decodeTiles(int part, const std::string& place) {
    const std::lock_guard lock(file_->mutex);
    byClasses(place, [&] {
        Imf::TiledInputPart input(file_->input, part);
        const std::size_t width = input.tileXSize();
        std::vector<float> pixels(width * input.tileYSize());
        // The slice of one channel is enough: decoding a tile unpacks all channels.
        Imf::FrameBuffer buffer;
        buffer.insert(input.header().channels().begin().name(),
                      Imf::Slice(Imf::FLOAT, reinterpret_cast<char*>(pixels.data()), sizeof(float),
                                 width * sizeof(float), 1, 1, 0, true, true));
        input.setFrameBuffer(buffer);
        for (int y = 0; y < input.numYLevels(); ++y) {
            for (int x = 0; x < input.numXLevels(); ++x) {
                if (!input.isValidLevel(x, y)) continue;
                input.readTiles(0, input.numXTiles(x) - 1, 0, input.numYTiles(y) - 1, x, y);
            }
        }
    });
}

}  // namespace peeler
