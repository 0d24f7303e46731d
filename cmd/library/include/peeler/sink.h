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
    Window data_window;  ///< bounding box of this layer's pixels
    std::uint64_t pixels = 0;
};

/// The result of the count pass: all a writer needs to open its file.
struct Plan {
    View view;
    std::vector<LayerPlan> layers;        ///< those that will be stored, front to back
    std::uint64_t fragments_counted = 0;  ///< in the count pass, before the layer limit
    std::uint64_t fragments_stored = 0;   ///< after the layer limit
    std::uint64_t fragments_blended = 0;  ///< beyond the limit, if a composite blends them
    PixelType color_type = PixelType::kHalf;
    bool tinted = false;            ///< opacity is coloured (LayeredImage::tinted)
    std::size_t channel_bytes = 0;  ///< per fragment, besides colour and Z
    /// The extra arrays of bands, without data; also empty if unknown.
    std::vector<FragmentArray> channels{};
    int samples = 1;  ///< sub-pixel samples; if several, counts are after merging

    /// Whether every fragment is stored as a fragment.
    bool complete() const { return fragments_counted == fragments_stored; }
};

/// A raw header attribute: name, type name and the bytes of the value.
struct StoredAttribute {
    std::string name, type;
    std::vector<std::byte> value;
};

/// The provenance of a picture: the `peeler:` attributes besides plan and view.
struct Provenance {
    std::string version{}, method{}, surfaces{};
    std::string scene{};  ///< file name without folder
    std::string scene_hash{}, settings_hash{};
    /// The settings that change pixels, as a JSON object whose hash is settings_hash; "" = unknown.
    std::string settings{};
    /// Hash of everything that determines the file's content, so that an unchanged file need not be
    /// rendered again; "" = not reproducible by one command.
    std::string output_hash{};
    std::string renderer{};    ///< GL_RENDERER
    std::string deep_merge{};  ///< how deep samples were merged; "" = not merged
    std::string tile{};        ///< "2/7": the second of seven strips; "" = not a tile
    int frame = 0;
    std::optional<int> view{};     ///< index of a view, from 0
    double time = 0;               ///< seconds
    double frames_per_second = 0;  ///< 0 = does not apply
    IdNames ids{};                 ///< empty unless fragments have ids
    /// Attributes from another program's OpenEXR file, copied to OpenEXR output.
    std::vector<StoredAttribute> carried{};
};

/// Memory of a sink besides its current band. The capture reserves it under a budget.
struct SinkMemory {
    int rows = 0;                      ///< rows of fragments kept from one band to the next
    std::uint64_t bytes = 0;           ///< independent of the bands
    std::uint64_t pixel_bytes = 0;     ///< per pixel of those rows and of the current band
    std::uint64_t fragment_bytes = 0;  ///< per fragment of the current band
    int bands = 0;                     ///< bands it keeps while the next one is made
};

/// A consumer of a picture's bands. Bands arrive top to bottom without gaps, each as wide as the
/// crop, and together cover it. A Sink destroyed before finish() leaves no output behind.
class Sink {
  public:
    virtual ~Sink() = default;
    /// Called once, before the first band.
    virtual void begin(const Plan& plan) = 0;
    /// Consumes a band, which the sink may keep or change. The caller reuses the storage left in
    /// `band`: the band itself, or that of an earlier one.
    virtual void write(LayeredImage&& band) = 0;
    /// Called once, after the last band: the output is complete then.
    virtual void finish() = 0;
    /// Returns the memory it will hold for a picture. Depends on the plan alone: callable before
    /// begin(), which may create a file.
    virtual SinkMemory memory(const Plan&) const { return {}; }
    /// Returns the times of its stages: "composite", "encode", "write".
    virtual StageTimes times() const { return {}; }
};

}  // namespace peeler::inline v0

#pragma GCC visibility pop
