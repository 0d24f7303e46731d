// SPDX-License-Identifier: Apache-2.0
// The files that hold one layered picture (one, or in the layout "per-file" a set), and what their
// headers say about it: layers, camera, where it comes from.
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

/// The name of the file of one layer beside the head of its set: of "out.exr" it is
/// "out.layer_007.exr".
std::string exrLayerFile(const std::string& path, std::size_t layer);

/// Whether `path` names the file of a layer beside `head`, however both are spelt.
bool isExrLayerFile(const std::string& path, const std::string& head);

/// All files that reading a picture touches: the named one and, if it is the head of a set, those
/// of its layers, be they there or not. Only the named one if it cannot be read.
std::vector<std::string> exrFilesOf(const std::string& path);

/// An open picture as one list of parts. The file that is named comes first; if it is the head of
/// a set (layout "per-file"), the files of its layers follow, front to back.
class ExrFiles {
  public:
    /// Throws Error (kInput), also if a file of a set is missing or is of another render.
    explicit ExrFiles(const std::string& path);

    const std::string& path() const { return files_.front()->path(); }
    std::uint64_t bytes() const;  ///< of all files
    const std::vector<ExrInputPart>& parts() const { return parts_; }
    /// The path of the file that a part is in, and the part's name: for messages.
    std::string where(std::size_t part) const;

    /// The named file.
    const ExrInput& head() const { return *files_.front(); }

    /// These are as in ExrInput, with the part as an index into parts().
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

/// What the headers of a picture say, layered, deep or flat, of OpenEXR or of arrays.
struct ExrInfo {
    std::vector<ExrInputPart> parts;  ///< in the order of the file, then of the files of a set
    /// Of each layer, front to back, the part it is in; empty for deep and flat files. How many
    /// layers a picture has, whatever holds them, an open LayeredInput tells: plan.layers.size().
    std::vector<std::size_t> layers;
    std::vector<std::string> prefixes;  ///< of each layer's channels in its part: "", "layer_000."
    int composite = -1;                 ///< the part with the composite, −1 = none
    /// How many layers a composite says it was made of, at most kMostLayers.
    std::size_t layersOfComposite() const;
    std::vector<std::size_t> deep;  ///< parts with deep samples
    std::uint64_t bytes = 0;        ///< of the file, or of all files of a set

    /// The plan that wrote the file, as far as it is known: windows always; the camera if there is
    /// a `peeler:cameraJson`, else the default one; `fragments_counted` and `fragments_stored` 0 if
    /// not written; `LayerPlan::pixels` never; the layers of a deep file only if a LayeredInput
    /// has it open. `view.crop` holds all parts; without a camera it is at least the display
    /// window, since a data window says what is stored and nothing of the picture.
    Plan plan;
    Provenance provenance;         ///< empty where unknown
    bool has_cryptomatte = false;  ///< in its composite
    bool is_peeler = false;        ///< has `peeler:version`; not if a part of it was chosen
    /// The first part's `peeler:` attributes, software and the like, as text.
    const std::map<std::string, std::string>& attributes() const {
        return parts.front().attributes;
    }
};

/// Whether the part has R, G, B, A, AR, AG and AB, with this before their names, none an integer.
bool hasTint(const ExrInputPart& part, const std::string& prefix);

/// What the headers of an open picture say, which are those of `parts` in so many bytes. Throws
/// Error (kInput), naming `path`, if it has no plausible parts.
ExrInfo describe(std::vector<ExrInputPart> parts, std::uint64_t bytes, const std::string& path);

/// An open picture with what its headers say, by which it is decided how to read it.
struct OpenedExr {
    /// Throws like ExrFiles and describe(), and Error (kInput) with what to do if it is a scene.
    explicit OpenedExr(const std::string& path, const LayeredReadOptions& options = {});

    LayeredReadOptions options;
    ExrFiles files;
    ExrInfo info;
    ReadWarnings warnings;
};

/// What the headers of the picture at `path` say; no pixels are read. Throws Error (kInput).
ExrInfo readExrInfo(const std::string& path);

// exr_header.cpp.

/// The camera as JSON, all numbers in double precision: name, projection, near, far (null =
/// infinite), halfWidth, halfHeight (as in Projection), width, height, crop [x, y, w, h], and the
/// 4×4 matrix cameraToWorld as rows for column vectors (OpenGL's camera: looks along −Z, +Y up).
std::string cameraJson(const View& view);

/// The inverse of cameraJson(). Throws Error (kInput) if the text is none of its texts.
View viewFromJson(const std::string& json);

}  // namespace peeler
