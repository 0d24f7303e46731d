// SPDX-License-Identifier: Apache-2.0
// Sequences of files as inputs: "in.####.exr" stands for a file per frame, "in.@@@@.exr" for one
// per view.
#pragma once

#include <cstdint>

#include "cmd/cli/command_line.h"

namespace peeler::cmd {

/// The way in which a verb processes the files of a sequence.
enum class SequenceUse : std::uint8_t {
    kEach,      ///< runs once per picture
    kLayers,    ///< like kEach; in output names, placeholders after the first are for layer numbers
    kTogether,  ///< runs once, with the files of all pictures as inputs
};

/// Declares a verb and, unless it has them, --frames, --chunk and for kEach and kLayers
/// --skip-existing and --keep-going. If no input is a sequence, the returned action is that of
/// `declare`. Otherwise, it runs that action for the pictures and reports {"frames": […]} or
/// {"views": […]}, like `peeler render`. Numbers replace the placeholders in the inputs and in the
/// output options (group "Output").
VerbAction declareWithSequences(VerbOptions& verb, VerbAction (*declare)(VerbOptions&),
                                SequenceUse use);

/// The same as a row of the verb table.
template <VerbAction (*declare)(VerbOptions&), SequenceUse use = SequenceUse::kEach>
VerbAction withSequences(VerbOptions& verb) {
    return declareWithSequences(verb, declare, use);
}

}  // namespace peeler::cmd
