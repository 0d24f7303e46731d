// SPDX-License-Identifier: Apache-2.0
// Sequences of files as inputs: "in.####.exr" stands for a file per frame, "in.@@@@.exr" for one
// per view.
#pragma once

#include <cstdint>

#include "cmd/cli/command_line.h"

namespace peeler::cmd {

/// The runs that a verb needs for the files of a sequence.
enum class SequenceUse : std::uint8_t {
    kEach,      ///< one run per picture
    kLayers,    ///< like kEach; in output names, placeholders after the first are for layer numbers
    kTogether,  ///< one run, with the files of all pictures as inputs
};

/// Declares a verb, and the sequence options that it lacks: --frames, --chunk and, except for
/// kTogether, --skip-existing and --keep-going. If no input is a sequence, the returned action is
/// that of `declare`. Otherwise, the returned action runs the action of `declare` for the pictures
/// and reports {"frames": […]} or {"views": […]}, like `peeler render`. Numbers replace the
/// placeholders in the inputs and in the output options (group "Output").
VerbAction declareWithSequences(VerbOptions& verb, VerbAction (*declare)(VerbOptions&),
                                SequenceUse use);

/// Calls declareWithSequences(). Has the type of Verb::declare.
template <VerbAction (*declare)(VerbOptions&), SequenceUse use = SequenceUse::kEach>
VerbAction withSequences(VerbOptions& verb) {
    return declareWithSequences(verb, declare, use);
}

}  // namespace peeler::cmd
