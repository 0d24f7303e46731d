// SPDX-License-Identifier: Apache-2.0
// Everything about one OpenEXR file that can be wrong without anybody noticing.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include <peeler/sink.h>
#include "core/image/statistics.h"
#include "formats/exr/exr_files.h"
#include "formats/exr/exr_integrity.h"

namespace peeler::cmd {

/// How much of a file there is to check.
enum class VerifiedKind {
    kUnknown,  ///< it cannot be opened
    kForeign,  ///< not written by peeler: only whether every chunk can be decoded
    kFlat,     ///< peeler's, without layers: its chunks, and its completeness
    kLayered,  ///< peeler's, with layers: everything
};

/// What was found, worst last.
enum class Verdict { kGood, kIncomplete, kBad };

struct VerifiedFile {
    std::string path;
    VerifiedKind kind = VerifiedKind::kUnknown;
    Verdict verdict = Verdict::kGood;
    std::vector<std::string> problems;         ///< one sentence each
    std::optional<ExrIntegrity::State> proof;  ///< nothing if that was not found out
    Provenance provenance;                     ///< of peeler's files
    View view;                                 ///< of peeler's files
    std::size_t layers = 0;
    std::uint64_t fragments = 0;  ///< as many as were found

    /// Adds a problem; the verdict becomes `found` unless it is worse already.
    void blame(Verdict found, const std::string& problem);
    /// Adds a problem of these pixels, which is bad; does nothing if no pixel is broken.
    void blame(const BrokenPixels& broken, const std::string& what);
};

/// Reads the file from beginning to end: whether its bytes are those that its hashes are of, and
/// where they are or it has none, whether OpenEXR's classes open it, too, and its camera does not
/// contradict itself. Then in bands, of layers: Z is a number wherever there is a
/// fragment and never decreases within a pixel; no pixel has a layer without the one before;
/// everything is 0 where there is no fragment (of layers in parts of their own); as many fragments
/// as the header says; the part `composite` is what the layers make, bit for bit. Throws only what
/// is no fault of the file (kMemory, kInternal).
VerifiedFile verifyFile(const std::string& path);

}  // namespace peeler::cmd
