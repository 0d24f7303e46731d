// SPDX-License-Identifier: Apache-2.0
// Deep image with Cryptomatte: a deep file, and a flat composite for the Cryptomatte.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include <peeler/output_options.h>
#include <peeler/sink.h>

namespace peeler {

/// Returns an ExrDeepWriter and, if OutputOptions::cryptomatte is set, an ExrCompositeWriter for
/// the file deepCompanions(). Cryptomatte describes pixels, not samples, and its readers expect
/// flat images. Some readers of deep images (OpenImageIO's flatten) fail if a file also has flat
/// parts, so the composite needs a file of its own. The composite is published before the deep
/// image.
std::unique_ptr<Sink> makeDeepImage(const std::string& path, const OutputOptions& options);

/// Returns the path of a deep image's Cryptomatte: "out.cryptomatte.exr" for "out.exr"; an empty
/// list without OutputOptions::cryptomatte.
std::vector<std::string> deepCompanions(const std::string& path, const OutputOptions& options);

}  // namespace peeler
