// SPDX-License-Identifier: Apache-2.0
// Pictures as arrays (.safetensors; formats/README.md, "Pictures as arrays"): the fragment lists of
// layers as they are in memory, and composites, with what an OpenEXR header says of them.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include <peeler/output_options.h>
#include <peeler/sink.h>
#include "formats/arrays/safetensors.h"
#include "formats/exr/exr_files.h"
#include "formats/exr/layered_input.h"
#include "formats/file/read_warnings.h"
#include "formats/file/regular_file.h"
#include "formats/file/size_forecast.h"

namespace peeler {

/// A Sink of every fragment: `splits` (pixels of the crop + 1, int64), `z` (n, float), `rgba` (n,
/// 4; half or float), `opacity` (n, 3; likewise, if the plan is tinted), and an array of every
/// other one of the bands, called as nameOf() says; the texts of pictureTexts().
std::unique_ptr<Sink> makeLayerArrays(const std::string& path, const OutputOptions& options);
/// The size of its file, to the byte, if the plan knows its channels.
SizeForecast forecastLayerArrays(const std::string& path, const Plan& plan,
                                 const OutputOptions& options);

/// A Sink of the composite, over the background: `rgba` (h, w, 4; float), `opacity` (h, w, 3;
/// likewise, if the plan is tinted) and `z` (h, w; float: of the nearest fragment, +inf = none). In
/// a .safetensors there are the texts of pictureTexts(), in a .npz `output_hash`.
std::unique_ptr<Sink> makeCompositeArrays(const std::string& path, const OutputOptions& options);
SizeForecast forecastCompositeArrays(const std::string& path, const Plan& plan,
                                     const OutputOptions& options);

/// Fragment lists of a file of makeLayerArrays(), or of another program that has at least its first
/// three arrays and says where they lie; or a composite of makeCompositeArrays().
class PictureArrays {
  public:
    /// Opens the file. Throws Error (kInput) if it is no picture, or its arrays do not fit
    /// together. Warns of arrays that are passed over.
    explicit PictureArrays(const std::string& path, const LayeredReadOptions& read = {});

    LayeredReadOptions options;
    ReadWarnings warnings;
    const std::string& path() const { return path_; }
    const ExrInfo& info() const { return info_; }
    const RegularFile& file() const { return file_; }
    bool composite() const { return composite_; }
    /// One that is there: "z", "rgba", …; `opacity` is null if it is not.
    const SafetensorsArray *splits = nullptr, *z = nullptr, *rgba = nullptr, *opacity = nullptr;
    /// Other channels of fragments, and where they are.
    struct ExtraArray {
        FragmentArray like;  ///< without data
        const SafetensorsArray* stored = nullptr;
    };
    std::vector<ExtraArray> extra;  ///< sorted by the channels' names

  private:
    const SafetensorsArray* take(const char* name, const std::vector<std::uint64_t>& shape,
                                 const std::vector<std::string>& types, bool required = true) const;
    void takeFragments();
    void takeComposite();
    void takeExtra(const SafetensorsArray& array);
    void describePart();
    [[noreturn]] void fail(const std::string& what, const std::string& array = {}) const;

    std::string path_;
    RegularFile file_;
    SafetensorsHeader header_;
    bool composite_ = false;
    Window display_, data_;
    ExrInfo info_;
};

/// Opens their fragments; or, of `pixels`, a composite as openComposite() has it
/// (formats/layered/opened_picture.h). Reads where all lists begin, so that info().plan has the
/// layers with their windows and pixels, and the fragments as they are. Throws Error (kInput) if
/// the file is the other one, or lists are not in order; (kUsage) if the options choose a part or
/// view.
std::unique_ptr<LayeredInput> openArrays(std::unique_ptr<PictureArrays> arrays,
                                         bool pixels = false);

}  // namespace peeler
