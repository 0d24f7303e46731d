// SPDX-License-Identifier: Apache-2.0
// A deep image, with its Cryptomatte in a composite beside it.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include <peeler/output_options.h>
#include <peeler/sink.h>

namespace peeler {

/// Returns an ExrDeepWriter and, if OutputOptions::cryptomatte is set, an ExrCompositeWriter for
/// deepCompanions(). Cryptomatte describes pixels, not samples, and its readers look for it in flat
/// images, so it needs a file of its own. Readers of deep images fail if a file also has flat parts
/// (OpenImageIO's flatten, for one), so the composite is no part of the deep file. Either both
/// files are published, the composite first, or none.
std::unique_ptr<Sink> makeDeepImage(const std::string& path, const OutputOptions& options);

/// Returns the file beside a deep image: "out.cryptomatte.exr" for "out.exr"; none without
/// OutputOptions::cryptomatte.
std::vector<std::string> deepCompanions(const std::string& path, const OutputOptions& options);

}  // namespace peeler
