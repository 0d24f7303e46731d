// SPDX-License-Identifier: Apache-2.0
// Selection of objects and materials in a layered file, by id or name.
#pragma once

#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "cmd/session/reporter.h"
#include "core/image/layers.h"
#include "formats/exr/layered_input.h"

namespace peeler::cmd {

class VerbOptions;

/// The chosen objects and materials: globs of names, or ids as numbers.
struct ObjectOptions {
    /// Globs or ids of objects, which are the scene's nodes.
    std::vector<std::string> include{}, exclude{};
    std::vector<std::string> materials{};

    bool any() const { return !include.empty() || !exclude.empty() || !materials.empty(); }
};

/// Declares --include, --exclude and --material. `options` must outlive the parse.
void addObjectOptions(VerbOptions& verb, ObjectOptions& options);

/// Returns the selection among the ids of a file. Throws like openChosen().
ObjectSelection selectionOf(const ObjectOptions& options, const ExrInfo& info,
                            const std::string& path);
nlohmann::json toJson(const ObjectOptions& options);

/// Appends `value` to the list `key` of Provenance::settings, and updates
/// Provenance::settings_hash.
void recordSetting(const std::string& key, const nlohmann::json& value, Provenance& provenance);

/// Returns the file restricted to fragments of the chosen objects, as if nothing else had been
/// rendered. Keeps the objects that match `include` (all if `include` is empty) and do not match
/// `exclude`. An object also matches if one of its ancestors matches. If `materials` is not empty,
/// keeps only fragments with these materials. Reads the file once, to count the layers after
/// filtering, and drops the composite. Without any of these options, returns the same as
/// openInput().
///
/// Throws like openInput() and LayeredInput::read(). Throws Error (kInput) if fragments have no
/// ids, or if names are given but the ids have no names. Throws Error (kUsage) if no object or
/// material has a given name.
std::unique_ptr<LayeredInput> openChosen(const std::string& path, const LayeredReadOptions& reading,
                                         const ObjectOptions& options, Reporter& reporter);

}  // namespace peeler::cmd
