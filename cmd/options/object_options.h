// SPDX-License-Identifier: Apache-2.0
// Selection of objects and materials in a layered file, by id or name.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "cmd/session/reporter.h"
#include "formats/exr/layered_input.h"

namespace peeler::cmd {

class VerbOptions;

/// The chosen objects and materials: globs of names, or ids as numbers.
struct ObjectOptions {
    std::vector<std::string> include{}, exclude{};  ///< objects: nodes of the scene
    std::vector<std::string> materials{};

    bool any() const { return !include.empty() || !exclude.empty() || !materials.empty(); }
};

/// Declares --include, --exclude and --material. `options` must outlive the parse.
void addObjectOptions(VerbOptions& verb, ObjectOptions& options);

/// Returns the file restricted to fragments of the chosen objects, as if nothing else had been
/// rendered. Keeps objects that match `include`, or all if `include` is empty, but not those that
/// match `exclude`; an object also matches if a node above it does. Of their fragments, keeps those
/// with a material in `materials`, if any are given. Counts the layers again, which reads the file
/// once, and drops the composite. If no option is given, this is openInput(). Throws like
/// openInput() and LayeredInput::read(). Throws Error (kInput) if fragments have no ids, or if
/// names are given but the ids have none. Throws Error (kUsage) if nothing has a given name.
std::unique_ptr<LayeredInput> openChosen(const std::string& path, const LayeredReadOptions& reading,
                                         const ObjectOptions& options, Reporter& reporter);

}  // namespace peeler::cmd
