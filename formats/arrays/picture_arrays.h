// SPDX-License-Identifier: Apache-2.0
// Pictures as arrays (.safetensors; formats/README.md, "Pictures as arrays"): the fragment lists of
// layered pictures, and composites, with the metadata of an OpenEXR header.
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

/// Returns a Sink that writes every fragment: `splits` (pixels of the crop + 1, int64), `z` (n,
/// float), `rgba` (n, 4; half or float), `opacity` (n, 3; half or float, if the plan is tinted), an
/// array for every other channel array of the bands, named by nameOf(), and the texts of
/// pictureTexts().
std::unique_ptr<Sink> makeLayerArrays(const std::string& path, const OutputOptions& options);
/// Forecasts the size of the file of makeLayerArrays(); exact if the plan knows its channels.
SizeForecast forecastLayerArrays(const std::string& path, const Plan& plan,
                                 const OutputOptions& options);

/// Returns a Sink that writes the composite over the background: `rgba` (h, w, 4; float), `opacity`
/// (h, w, 3; float, if the plan is tinted) and `z` (h, w; float: camera Z of the nearest fragment,
/// +inf without fragments). A .safetensors also has the texts of pictureTexts(), a .npz only
/// `output_hash`.
std::unique_ptr<Sink> makeCompositeArrays(const std::string& path, const OutputOptions& options);
SizeForecast forecastCompositeArrays(const std::string& path, const Plan& plan,
                                     const OutputOptions& options);

/// An open file of a picture as arrays: either a composite, from makeCompositeArrays(), or fragment
/// lists, from makeLayerArrays() or from another program. Other programs must write at least
/// `splits`, `z`, `rgba` and the windows.
class PictureArrays {
  public:
    /// Opens the file. Throws Error (kInput) if it is not a picture, or if its arrays contradict
    /// each other. Warns about arrays that it ignores.
    explicit PictureArrays(const std::string& path, const LayeredReadOptions& read = {});

    LayeredReadOptions options;
    ReadWarnings warnings;
    const std::string& path() const { return path_; }
    const ExrInfo& info() const { return info_; }
    const RegularFile& file() const { return file_; }
    bool composite() const { return composite_; }
    /// The arrays with these names; `splits` is null for a composite, `opacity` is null if missing.
    const SafetensorsArray *splits = nullptr, *z = nullptr, *rgba = nullptr, *opacity = nullptr;
    struct ExtraArray {
        FragmentArray like;  ///< channels and type of the array, without data
        const SafetensorsArray* stored = nullptr;
    };
    std::vector<ExtraArray> extra;  ///< sorted by channel names

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

/// Opens a picture of fragment lists; with `pixels`, opens a composite like openComposite()
/// (formats/layered/opened_picture.h). Reads the splits, so that info().plan has the window and the
/// number of pixels of each layer, and the actual fragment counts. Throws Error (kInput) if the
/// file holds the kind of picture that `pixels` excludes, or if lists are out of order. Throws
/// Error (kUsage) if the options choose a part or view.
std::unique_ptr<LayeredInput> openArrays(std::unique_ptr<PictureArrays> arrays,
                                         bool pixels = false);

}  // namespace peeler
