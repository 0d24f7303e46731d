// SPDX-License-Identifier: Apache-2.0
// Layered depth images back as fragment lists.
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "core/composite.h"
#include "core/layered_image.h"
#include "core/sink.h"
#include "formats/exr_input.h"

namespace peeler {

/// What the headers of an OpenEXR file say, layered or not.
struct ExrInfo {
    std::vector<ExrInputPart> parts;  ///< in the order of the file
    std::vector<std::size_t> layers;  ///< parts `layer_*`, front to back
    int composite = -1;               ///< the part `composite`, −1 = none
    std::uint64_t bytes = 0;          ///< of the file

    /// The plan that wrote the file, as far as it is known: windows always; the camera if there is
    /// a `peeler:cameraJson`, else the default one; `fragments_counted` and `fragments_stored` 0 if
    /// not written; `LayerPlan::pixels` never. `view.crop` holds all parts.
    Plan plan;
    Provenance provenance;   ///< empty where unknown
    bool is_peeler = false;  ///< has `peeler:version`
    /// The first part's `peeler:` attributes, software and the like, as text.
    const std::map<std::string, std::string>& attributes() const {
        return parts.front().attributes;
    }
};

/// Reads headers only. Throws Error (kInput).
ExrInfo readExrInfo(const std::string& path);

/// Reads files of ExrLdiWriter, and any other whose parts `layer_*` hold R, G, B, A, Z. A fragment
/// is where Z is less than +inf. Memory grows with the window that is read, not with the file.
class ExrLdiReader {
  public:
    /// Throws Error (kInput) if the file is not layered; `where` names the part.
    explicit ExrLdiReader(const std::string& path);
    ~ExrLdiReader();

    const ExrInfo& info() const { return info_; }

    /// The fragments of a window inside `info().plan.view.crop`, which may be all of it, or a band
    /// for a Sink. Colours are half if they are half in every layer, else float. Other channels
    /// come after them: those of the first layer, names that agree up to the last dot (N.X, N.Y,
    /// N.Z) in one array, sorted by name; a layer that lacks one has 0. Overwrites `out`, reuses
    /// its storage. Throws Error (kInput) if a chunk is damaged, (kMemory) if there are over 2^32
    /// fragments.
    void read(const Window& window, LayeredImage& out);

    /// The part `composite` as it is stored. Throws Error (kInput) if there is none.
    void readComposite(const Window& window, CompositeImage& out);

    /// Rows of full width whose read() takes about `bytes`, at least one chunk's 16.
    int rowsFor(std::uint64_t bytes) const;

  private:
    struct Layer;
    std::vector<Layer> decode(const Window& window, std::span<const std::size_t> parts,
                              std::span<const ExrInputChannel> channels) const;
    void findChannels();

    ExrInput input_;
    ExrInfo info_;
    std::vector<ExrInputChannel> channels_;  ///< R, G, B, A, Z, then those of extra_
    std::vector<FragmentArray> extra_;       ///< without data
};

}  // namespace peeler
