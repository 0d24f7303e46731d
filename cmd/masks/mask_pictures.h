// SPDX-License-Identifier: Apache-2.0
// The pictures that masks belong to.
#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "cmd/options/capture_job.h"
#include "cmd/options/output_options.h"
#include "cmd/options/view_options.h"

namespace peeler::cmd {

class VerbOptions;

/// The values of --rgb and of the options for its pictures.
struct MaskPictureOptions {
    bool asked = false;
    OutputRequest output;  ///< background, exposure, tone map
    int samples = kDisplaySamples;
    std::optional<int> shadow_size;
};

/// Declares --rgb and its options. The arguments must outlive the parse.
void addMaskPictureOptions(VerbOptions& verb, MaskPictureOptions& options, CaptureJobOptions& job);

/// Throws Error (kUsage) if an option for pictures is given without --rgb.
void checkMaskPictureOptions(const VerbOptions& verb, const MaskPictureOptions& options);

/// A writer of the masked views' composites, as `peeler render` writes them.
class MaskPictures {
  public:
    /// `capture` has the settings that masks and pictures share. All arguments must outlive this
    /// object.
    MaskPictures(const MaskPictureOptions& options, const CaptureSettings& capture, CaptureJob& job,
                 const ViewList& views);

    /// Returns the hash of everything that determines the picture of a view.
    std::string hash(const View& view, const ClipVolume& clip, nlohmann::json more,
                     Provenance provenance) const;

    /// Captures and writes the picture of a view. Opens the GlRenderer if it is not open; for views
    /// without a lens, it must show `posed`. Sets the display
    /// transform in `result`.
    void write(const View& view, const PosedScene& posed, const ClipVolume& clip,
               const Provenance& provenance, const std::filesystem::path& path,
               PictureResult& result);

  private:
    CaptureSettings settings(const ClipVolume& clip) const;
    bool metersExposure(const PosedScene& posed) const;

    const MaskPictureOptions& options_;
    CaptureSettings capture_;
    CaptureJob& job_;
    const ViewList& views_;
    std::optional<float> exposure_;  ///< metered before the first picture
};

}  // namespace peeler::cmd
