// SPDX-License-Identifier: Apache-2.0
// Verification of an OpenEXR file against silent faults.
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

/// The extent of the checks for a file.
enum class VerifiedKind {
    kUnknown,  ///< cannot be opened
    kForeign,  ///< not written by peeler: chunks must decode
    kFlat,     ///< written by peeler, without layers: chunks and completeness
    kLayered,  ///< written by peeler, with layers: all checks
};

/// The result of the checks, worst last.
enum class Verdict { kGood, kIncomplete, kBad };

struct VerifiedFile {
    std::string path;
    VerifiedKind kind = VerifiedKind::kUnknown;
    Verdict verdict = Verdict::kGood;
    std::vector<std::string> problems;         ///< one sentence each
    std::optional<ExrIntegrity::State> proof;  ///< nothing if not determined
    Provenance provenance;                     ///< peeler files only
    View view;                                 ///< peeler files only
    std::size_t layers = 0;
    std::uint64_t fragments = 0;  ///< number found

    /// Adds a problem; raises the verdict to `found` if that is worse.
    void blame(Verdict found, const std::string& problem);
    /// Adds a kBad problem with these pixels. Does nothing if no pixel is broken.
    void blame(const BrokenPixels& broken, const std::string& what);
};

/// Reads and checks the whole file. Its bytes match its hashes. If they match or there are none,
/// OpenEXR's classes can open it and its camera is consistent. Then, band by band, its layers are
/// checked: Z is a number for every fragment and never decreases within a pixel; no pixel skips a
/// layer; pixels without a fragment are 0 (for layers in separate parts); the fragment count
/// matches the header; the part `composite` equals the composited layers bit for bit. Throws Error
/// only for causes outside the file (kMemory, kInternal).
VerifiedFile verifyFile(const std::string& path);

}  // namespace peeler::cmd
