// SPDX-License-Identifier: Apache-2.0
// The capture plan, and the interface that consumes bands.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include <peeler/layered_image.h>
#include <peeler/scene.h>
#include <peeler/stage_times.h>
#include <peeler/view.h>

#pragma GCC visibility push(default)

namespace peeler::inline v0 {

/// The extent of a layer, known before it is captured.
struct LayerPlan {
    Window data_window;  ///< bounding box of the layer's pixels
    std::uint64_t pixels = 0;
};

/// The result of the count pass: all that a writer needs to open its file.
struct Plan {
    View view;
    std::vector<LayerPlan> layers;  ///< the layers that will be stored, front to back
    /// Fragments found by the count pass, before the layer limit.
    std::uint64_t fragments_counted = 0;
    std::uint64_t fragments_stored = 0;  ///< fragments within the layer limit
    /// Fragments beyond the layer limit that the tail of a composite blends.
    std::uint64_t fragments_blended = 0;
    PixelType color_type = PixelType::kHalf;
    bool tinted = false;            ///< whether opacity is coloured (LayeredImage::tinted)
    std::size_t channel_bytes = 0;  ///< bytes per fragment besides colour and Z
    /// The extra arrays of bands, without data. Empty if there are no extra arrays, or if they are
    /// unknown.
    std::vector<FragmentArray> channels{};
    /// Number of sub-pixel samples per pixel. If there are several, fragments are counted after
    /// merging.
    int samples = 1;

    bool complete() const { return fragments_counted == fragments_stored; }
};

/// A raw header attribute: name, type name and the bytes of the value.
struct StoredAttribute {
    std::string name, type;
    std::vector<std::byte> value;
};

/// The provenance of a picture: the `peeler:` attributes, except those for the plan and the view.
struct Provenance {
    std::string version{}, method{}, surfaces{};
    std::string scene{};  ///< file name without folder
    std::string scene_hash{}, settings_hash{};
    /// The settings that change pixels, as a JSON object; settings_hash is its hash. "" = unknown.
    std::string settings{};
    /// A hash of everything that determines the file's content, so that an unchanged file need not
    /// be rendered again; "" = not reproducible by one command.
    std::string output_hash{};
    std::string renderer{};    ///< GL_RENDERER
    std::string deep_merge{};  ///< method of merging deep samples; "" = not merged
    /// The certificate of thinned deep samples, as JSON (formats/README.md, "Attributes"); "" =
    /// none.
    std::string deep_certificate{};
    std::string tile{};  ///< "2/7": the second of seven strips; "" = not a tile
    /// The merged elements as a JSON array (formats/README.md, "Attributes"); "" = none.
    std::string elements{};
    int frame = 0;
    std::optional<int> view{};     ///< number of the view, if there are several; by default from 0
    double time = 0;               ///< seconds
    double frames_per_second = 0;  ///< 0 = unknown or not an animation
    IdNames ids{};                 ///< empty if fragments have no ids
    /// Attributes from another program's OpenEXR file, copied to OpenEXR output.
    std::vector<StoredAttribute> carried{};
};

/// The memory that a sink needs in addition to its current band. The capture reserves this memory
/// within its budget.
struct SinkMemory {
    int rows = 0;                      ///< rows of fragments kept from one band to the next
    std::uint64_t bytes = 0;           ///< independent of the bands
    std::uint64_t pixel_bytes = 0;     ///< bytes per pixel, for the kept rows and the current band
    std::uint64_t fragment_bytes = 0;  ///< bytes per fragment of the current band
    int bands = 0;  ///< bands that the sink still holds while the next band is made
};

/// A consumer of a picture's bands. Bands arrive top to bottom without gaps. Each band is as wide
/// as the crop, and together the bands cover the crop. A Sink destroyed before finish() leaves no
/// output behind.
class Sink {
  public:
    virtual ~Sink() = default;
    /// Called once, before the first band.
    virtual void begin(const Plan& plan) = 0;
    /// Consumes a band, which the sink may keep or change. The sink may leave storage in `band`,
    /// for example the storage of an earlier band; the caller reuses the storage.
    virtual void write(LayeredImage&& band) = 0;
    /// Called once, after the last band. When it returns, the output is complete.
    virtual void finish() = 0;
    /// Returns the memory that the sink will need for a picture. The result depends on the plan
    /// alone, so memory() can be called before begin(), which may create a file.
    virtual SinkMemory memory(const Plan&) const { return {}; }
    /// Returns the time spent in each stage of the sink: "composite", "encode", "write".
    virtual StageTimes times() const { return {}; }
};

}  // namespace peeler::inline v0

#pragma GCC visibility pop
