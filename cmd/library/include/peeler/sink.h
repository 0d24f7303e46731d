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

/// The extent of one layer, known before it is captured.
struct LayerPlan {
    Window data_window;        ///< bounding box of the pixels that have this layer
    std::uint64_t pixels = 0;  ///< how many of them
};

/// The result of the count pass: everything a writer must know to open its file.
struct Plan {
    View view;
    std::vector<LayerPlan> layers;        ///< front to back; as many as will be stored
    std::uint64_t fragments_counted = 0;  ///< by the count pass, without any layer limit
    std::uint64_t fragments_stored = 0;   ///< after the layer limit
    std::uint64_t fragments_blended = 0;  ///< those beyond it, if a composite blends them
    PixelType color_type = PixelType::kHalf;
    bool tinted = false;            ///< opacity is coloured (LayeredImage::tinted)
    std::size_t channel_bytes = 0;  ///< of a fragment, besides colour and Z
    /// The other channels of bands, without fragments; empty also where that is not known.
    std::vector<FragmentArray> channels{};
    int samples = 1;  ///< sub-pixel positions; of several, what they merge into is counted

    /// Whether every fragment is in its place.
    bool complete() const { return fragments_counted == fragments_stored; }
};

/// An attribute of a header as it is stored: the name of its type, and the bytes of its value.
struct StoredAttribute {
    std::string name, type;
    std::vector<std::byte> value;
};

/// The origin of a picture: the `peeler:` attributes besides plan and view.
struct Provenance {
    std::string version{}, method{}, surfaces{};
    std::string scene{};  ///< file name without folder
    std::string scene_hash{}, settings_hash{};
    /// The settings that change pixels, as a JSON object whose hash is settings_hash; "" = not
    /// known.
    std::string settings{};
    /// Of everything that decides what is in the file, so that it can be left alone when it would
    /// be made again; "" = it cannot be made again by one command.
    std::string output_hash{};
    std::string renderer{};    ///< GL_RENDERER
    std::string deep_merge{};  ///< how samples of a deep image were merged, "" = not
    std::string tile{};        ///< "2/7": the second of seven strips; "" = not one of several
    int frame = 0;
    std::optional<int> view{};     ///< which of many views, from 0
    double time = 0;               ///< seconds
    double frames_per_second = 0;  ///< 0 = does not apply
    IdNames ids{};                 ///< if fragments have ids
    /// Other attributes of another program's OpenEXR file; OpenEXR files that are written carry
    /// them.
    std::vector<StoredAttribute> carried{};
};

/// Memory of a sink besides the band it is given; the capture leaves room for it under a budget.
struct SinkMemory {
    int rows = 0;                      ///< of fragments, kept from one band to the next
    std::uint64_t bytes = 0;           ///< whatever the bands
    std::uint64_t pixel_bytes = 0;     ///< of every pixel of those rows and of the current band
    std::uint64_t fragment_bytes = 0;  ///< of every fragment of the current band
    int bands = 0;                     ///< that it keeps while the next one is made
};

/// Takes a picture band by band. Bands arrive top to bottom without gaps, each as wide as the crop,
/// together covering it. A Sink that is destroyed before finish() leaves nothing behind.
class Sink {
  public:
    virtual ~Sink() = default;
    /// Called once, before the first band.
    virtual void begin(const Plan& plan) = 0;
    /// The band is the sink's to keep or to change. What it leaves there is storage that the caller
    /// may fill again: the band itself, or what it kept of an earlier one.
    virtual void write(LayeredImage&& band) = 0;
    /// Called once, after the last band: the output is complete then.
    virtual void finish() = 0;
    /// Memory that it will hold for such a picture; it depends on the plan alone, so that it can be
    /// asked before begin(), which may create a file.
    virtual SinkMemory memory(const Plan&) const { return {}; }
    /// Times of its stages: "composite", "encode", "write".
    virtual StageTimes times() const { return {}; }
};

}  // namespace peeler::inline v0

#pragma GCC visibility pop
