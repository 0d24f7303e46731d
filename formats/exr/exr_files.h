// SPDX-License-Identifier: Apache-2.0
// The files of one layered picture (one, or a set in the layout "per-file"), and the metadata in
// their headers: layers, camera, provenance.
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

/// Returns the name of a layer's file beside the head of its set: "out.layer_007.exr" for
/// "out.exr".
std::string exrLayerFile(const std::string& path, std::size_t layer);

/// Whether `path` names the file of a layer beside `head`, in any spelling of both paths.
bool isExrLayerFile(const std::string& path, const std::string& head);

/// Returns all files touched by reading a picture: the named one and, if it is the head of a set,
/// the files of its layers, whether they exist or not. Returns only the named one if it cannot be
/// read.
std::vector<std::string> exrFilesOf(const std::string& path);

/// An open picture as one list of parts. The named file comes first; if it is the head of a set
/// (layout "per-file"), the files of its layers follow, front to back.
class ExrFiles {
  public:
    /// Throws Error (kInput), also if a file of a set is missing or belongs to another render.
    explicit ExrFiles(const std::string& path);

    const std::string& path() const { return files_.front()->path(); }
    std::uint64_t bytes() const;  ///< of all files
    const std::vector<ExrInputPart>& parts() const { return parts_; }
    /// Returns a part's place for messages: the path of its file, and its name.
    std::string where(std::size_t part) const;

    /// Returns the named file.
    const ExrInput& head() const { return *files_.front(); }

    /// As in ExrInput, with the part as an index into parts().
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
    std::vector<Place> places_;  ///< of each part
};

/// The metadata of a picture, layered, deep or flat, from OpenEXR headers or arrays.
struct ExrInfo {
    std::vector<ExrInputPart> parts;  ///< in file order, then in the order of a set's files
    /// The part of each layer, front to back; empty for deep and flat files. For the number of
    /// layers of any picture, see plan.layers.size() of an open LayeredInput.
    std::vector<std::size_t> layers;
    std::vector<std::string> prefixes;  ///< of each layer's channels: "", "layer_000."
    int composite = -1;                 ///< the part with the composite, −1 = none
    /// Returns the number of layers that a composite records, at most kMostLayers.
    std::size_t layersOfComposite() const;
    std::vector<std::size_t> deep;  ///< parts with deep samples
    std::uint64_t bytes = 0;        ///< of the file, or of all files of a set

    /// The plan that wrote the file, as far as known: windows always; the camera if there is a
    /// `peeler:cameraJson`, else the default one; `fragments_counted` and `fragments_stored` 0 if
    /// not written; `LayerPlan::pixels` never; the layers of a deep file only while a LayeredInput
    /// has it open. `view.crop` contains all parts; without a camera it is at least the display
    /// window, since a data window describes only what is stored.
    Plan plan;
    Provenance provenance;         ///< empty where unknown
    bool has_cryptomatte = false;  ///< in its composite
    bool is_peeler = false;        ///< has `peeler:version`; false once a part of it was chosen
    /// Returns the first part's `peeler:` attributes, software and similar, as text.
    const std::map<std::string, std::string>& attributes() const {
        return parts.front().attributes;
    }
};

/// Whether the part has R, G, B, A, AR, AG and AB with this prefix, none of them integer.
bool hasTint(const ExrInputPart& part, const std::string& prefix);

/// Returns the metadata of an open picture from its parts' headers; `bytes` is its size. Throws
/// Error (kInput), naming `path`, if it has no plausible parts.
ExrInfo describe(std::vector<ExrInputPart> parts, std::uint64_t bytes, const std::string& path);

/// An open picture with its metadata, which decides how to read it.
struct OpenedExr {
    /// Throws like ExrFiles and describe(); for a scene, the Error (kInput) has a hint.
    explicit OpenedExr(const std::string& path, const LayeredReadOptions& options = {});

    LayeredReadOptions options;
    ExrFiles files;
    ExrInfo info;
    ReadWarnings warnings;
};

/// Reads the metadata of the picture at `path`, without pixels. Throws Error (kInput).
ExrInfo readExrInfo(const std::string& path);

// exr_header.cpp.

/// Returns the camera as JSON, all numbers in double precision: name, projection, near, far (null =
/// infinite), halfWidth, halfHeight (as in Projection), width, height, crop [x, y, w, h], and the
/// 4×4 matrix cameraToWorld as rows for column vectors (OpenGL's camera: looks along −Z, +Y up).
std::string cameraJson(const View& view);

/// The inverse of cameraJson(). Throws Error (kInput) if the text is malformed.
View viewFromJson(const std::string& json);

}  // namespace peeler
