// SPDX-License-Identifier: Apache-2.0
// Which objects and materials of a layered file count, by the ids and names that it carries.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "cmd/session/reporter.h"
#include "formats/exr/layered_input.h"

namespace peeler::cmd {

class VerbOptions;

/// Globs of names, or ids as numbers.
struct ObjectOptions {
    std::vector<std::string> include{}, exclude{};  ///< of objects: nodes of the scene
    std::vector<std::string> materials{};

    bool any() const { return !include.empty() || !exclude.empty() || !materials.empty(); }
};

/// Declares --include, --exclude and --material. `options` must outlive the parse.
void addObjectOptions(VerbOptions& verb, ObjectOptions& options);

/// The file with the fragments of the chosen objects alone, as if nothing else had been rendered:
/// of objects that are included (all, if none is named), or below one that is in the scene, unless
/// they are excluded, or below one that is; and of the materials, if any are named. Layers are
/// counted anew, which reads the file once; its composite is no more. Without any of the options it
/// is openInput(). Throws like that and LayeredInput::read(), Error (kInput) if fragments have no
/// ids, or these no names where names are given, and (kUsage) for a name that nothing has.
std::unique_ptr<LayeredInput> openChosen(const std::string& path, const LayeredReadOptions& reading,
                                         const ObjectOptions& options, Reporter& reporter);

}  // namespace peeler::cmd
