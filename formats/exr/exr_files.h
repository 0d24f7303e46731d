// SPDX-License-Identifier: Apache-2.0
// The files of one layered picture (a single file, or a set in the layout "per-file"), and the
// metadata in their headers: layers, camera, provenance.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include <peeler/layered_read_options.h>
#include <peeler/sink.h>
#include "formats/exr/exr_input.h"
#include "formats/file/read_warnings.h"

namespace peeler {

/// Returns the name of a layer's file in the set whose head is `path`: "out.layer_007.exr" for
/// "out.exr".
std::string exrLayerFile(const std::string& path, std::size_t layer);

/// Whether `path` names the file of a layer of `head`. The two paths may be written differently.
bool isExrLayerFile(const std::string& path, const std::string& head);

/// Returns all files that must be opened to read a picture: the named file and, if the named file
/// is the head of a set, the files of its layers, even missing ones. If the named file cannot be
/// read, returns only the named file.
std::vector<std::string> exrFilesOf(const std::string& path);

/// An open picture as one list of parts. The parts of the named file come first. If the named file
/// is the head of a set (layout "per-file"), the parts of its layers' files follow, front to back.
class ExrFiles {
  public:
    /// Opens the files. Throws Error (kInput) if a file is malformed, or if a file of a set is
    /// missing or belongs to another render.
    explicit ExrFiles(const std::string& path);

    const std::string& path() const { return files_.front()->path(); }
    std::uint64_t bytes() const;
    const std::vector<ExrInputPart>& parts() const { return parts_; }
    /// Returns a part's place for messages: the path of its file, and the part's name.
    std::string where(std::size_t part) const;

    /// Returns the named file, which is the head of a set of files.
    const ExrInput& head() const { return *files_.front(); }

    /// These functions are like those of ExrInput, but `part` is an index into parts().
    int rowsPerChunk(std::size_t part) const;
    void readChunk(std::size_t part, int y, const Window& window,
                   std::span<const ExrTarget> targets) const;
    void checkChunks(std::size_t part) const;
    std::vector<StoredAttribute> attributes(std::size_t part) const;
    std::size_t deepBlocks(std::size_t part) const;
    Window deepBlockWindow(std::size_t part, std::size_t block) const;
    void readDeepBlock(std::size_t part, std::size_t block, bool counts_only,
                       ExrDeepBlock& out) const;

  private:
    struct Place {
        std::size_t file, part;
    };

    void add(const std::string& path);
    void addLayers();

    std::vector<std::unique_ptr<ExrInput>> files_;
    std::vector<ExrInputPart> parts_;
    std::vector<Place> places_;  ///< index of each part's file, and the part's index in that file
};

/// The metadata of a picture, layered, deep or flat, from OpenEXR headers or arrays.
struct ExrInfo {
    std::vector<ExrInputPart> parts;  ///< in file order; for a set of files, file by file
    /// The index in `parts` of each layer's part, front to back; empty for deep and flat files. For
    /// the number of layers of any picture, use plan.layers.size() of an open LayeredInput.
    std::vector<std::size_t> layers;
    std::vector<std::string> prefixes;  ///< prefix of each layer's channel names: "", "layer_000."
    /// Index in `parts` of the part with the composite; −1 if there is no composite.
    int composite = -1;
    /// Returns the number of layers that the header of a composite records, at most kMostLayers.
    std::size_t layersOfComposite() const;
    std::vector<std::size_t> deep;  ///< indices of parts with deep samples
    std::uint64_t bytes = 0;        ///< size of the file, or of all files of a set

    /// The plan from which the file was written, as far as known. Windows are always known. The
    /// camera is the default camera unless the header has `peeler:cameraJson`. `fragments_counted`
    /// and `fragments_stored` are 0 if the file does not record them. `LayerPlan::pixels` is never
    /// known. The layers of a deep file are known only while a LayeredInput has the file open.
    ///
    /// `view.crop` contains all parts. Without a camera, `view.crop` also contains the display
    /// window, since a data window only bounds the stored pixels.
    Plan plan;
    Provenance provenance;         ///< members are empty if unknown
    bool has_cryptomatte = false;  ///< whether the composite has Cryptomatte layers
    /// Whether the file has `peeler:version`. choosePicture() sets this to false if the file is to
    /// be read like another program's.
    bool is_peeler = false;
    /// Returns the first part's attributes: text by name.
    const std::map<std::string, std::string>& attributes() const {
        return parts.front().attributes;
    }
};

/// Whether the part has the channels R, G, B, A, AR, AG and AB with this prefix, and none of them
/// has an integer type.
bool hasTint(const ExrInputPart& part, const std::string& prefix);

/// Returns the metadata of an open picture from the headers of its parts. `bytes` is the size of
/// its files. Throws Error (kInput), naming `path`, if the parts are not plausible.
ExrInfo describe(std::vector<ExrInputPart> parts, std::uint64_t bytes, const std::string& path);

/// An open picture with its metadata.
struct OpenedExr {
    /// Opens the picture. Throws the errors of ExrFiles and describe(). For a scene file, the Error
    /// (kInput) has a hint.
    explicit OpenedExr(const std::string& path, const LayeredReadOptions& options = {});

    LayeredReadOptions options;
    ExrFiles files;
    ExrInfo info;
    ReadWarnings warnings;
};

/// Reads the metadata of the picture at `path`, without pixels. Throws Error (kInput).
ExrInfo readExrInfo(const std::string& path);

// Defined in exr_header.cpp.

/// Returns the camera as JSON, with all numbers in double precision: name; projection; near; far
/// (null if infinite); halfWidth and halfHeight (as in Projection), or lens (lensJson()) in place
/// of both; width; height; crop [x, y, w, h]; cameraToWorld, a 4×4 matrix in rows, for column
/// vectors (OpenGL's camera: looks along −Z, +Y up); and sample [x, y] unless it is the pixel's
/// centre.
std::string cameraJson(const View& view);

/// The inverse of cameraJson(). Throws Error (kInput) if the text is malformed.
View viewFromJson(const std::string& json);

}  // namespace peeler
