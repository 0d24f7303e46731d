// SPDX-License-Identifier: Apache-2.0
// Lens models: the table of models, and their coefficients.
#pragma once

#include <memory>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include <peeler/camera_choice.h>
#include <peeler/lens.h>

namespace peeler {

class LensShape;

/// A lens model. To add a model, add a row to the table in lens.cpp.
struct LensModel {
    std::string_view name;     ///< lower case with hyphens: "opencv-fisheye"
    std::string_view summary;  ///< for help texts: the model and its coefficients
    /// The permitted numbers of coefficients. Missing ones at the end are 0.
    std::span<const std::size_t> counts;
    /// Whether the plane is in pixels, so that the focal lengths are 1.
    bool in_pixels;
    /// Whether the model is a pinhole if all coefficients are 0.
    bool perspective;
    /// Returns the intrinsics of a picture that the model fills. Null for models whose cameras have
    /// intrinsics of their own.
    Intrinsics (*filling)(const Size& size);
    /// Returns the lens for pictures of a size, or {0, 0} for any size. Throws Error (kUsage) if
    /// the coefficients or the size have no meaning.
    std::unique_ptr<const LensShape> (*shape)(std::span<const double> coefficients,
                                              const Size& size);
};

/// Returns the models, in the order of help texts.
std::span<const LensModel> lensModels();

/// Returns the model with this name, or null. COLMAP's and nerfstudio's names (OPENCV_FISHEYE) name
/// the same models.
const LensModel* findLensModel(std::string_view name);

/// Returns the lens's model. Throws Error (kUsage) if it is unknown.
const LensModel& lensModel(const Lens& lens);

/// Whether the lens maps straight lines to straight lines.
bool isPinhole(const Lens& lens);

/// Returns the lens, with the name of the table. Throws Error (kUsage) if the model is unknown, or
/// if the coefficients are not finite, too few or too many, or have no meaning.
Lens makeLens(std::string_view model, std::vector<double> coefficients);

}  // namespace peeler
