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

/// Name globs, or ids as numbers.
struct ObjectOptions {
    std::vector<std::string> include{}, exclude{};  ///< objects: nodes of the scene
    std::vector<std::string> materials{};

    bool any() const { return !include.empty() || !exclude.empty() || !materials.empty(); }
};

/// Declares --include, --exclude and --material. `options` must outlive the parse.
void addObjectOptions(VerbOptions& verb, ObjectOptions& options);

/// Returns the file restricted to fragments of the chosen objects, as if nothing else had been
/// rendered. Keeps objects that match `include` (all if it is empty) or are below such a node,
/// except those that match `exclude` or are below such a node; then only the given materials, if
/// any. Recounts layers, which reads the file once, and drops the composite. Without any of the
/// options, same as openInput(). Throws like openInput() and LayeredInput::read(). Throws Error
/// (kInput) if fragments have no ids, or the ids have no names where names are given; Error
/// (kUsage) if nothing has a given name.
std::unique_ptr<LayeredInput> openChosen(const std::string& path, const LayeredReadOptions& reading,
                                         const ObjectOptions& options, Reporter& reporter);

}  // namespace peeler::cmd
