// SPDX-License-Identifier: Apache-2.0
// Animation options.
#pragma once

#include "cmd/session/scene_request.h"

namespace peeler::cmd {

class VerbOptions;

/// Declares --animation and --time. `options` must outlive the parse.
void addTimeOptions(VerbOptions& verb, AnimationOptions& options);
void addFrameOptions(VerbOptions& verb, AnimationOptions& options);

}  // namespace peeler::cmd
