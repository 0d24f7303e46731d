// SPDX-License-Identifier: Apache-2.0
// Verification of a file, for damage that readers do not notice.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include <peeler/sink.h>
#include "cmd/options/deep_against.h"
#include "core/image/statistics.h"
#include "formats/exr/exr_files.h"
#include "formats/exr/exr_integrity.h"

namespace peeler::cmd {

/// The kind of a file, which determines the checks.
enum class VerifiedKind {
    kUnknown,  ///< the file cannot be opened
    kForeign,  ///< not written by peeler: all chunks must decode
    kFlat,     ///< written by peeler, without layers: all chunks must be present and decode
    kLayered,  ///< written by peeler, with layers: the file must pass all checks
};

/// The result of the checks, ordered from best to worst.
enum class Verdict { kGood, kIncomplete, kBad };

struct VerifiedFile {
    std::string path;
    VerifiedKind kind = VerifiedKind::kUnknown;
    Verdict verdict = Verdict::kGood;
    std::vector<std::string> problems;  ///< problems found, one sentence each
    /// Result for the hashes; none if they could not be checked.
    std::optional<ExrIntegrity::State> proof;
    Provenance provenance;  ///< set only for files written by peeler
    View view;              ///< set only for files written by peeler
    std::size_t layers = 0;
    std::uint64_t fragments = 0;
    std::optional<DeepAgainst> against;  ///< the comparison with another file, if requested

    /// Adds a problem. Sets the verdict to `found` if `found` is worse.
    void blame(Verdict found, const std::string& problem);
    /// Adds a kBad problem with these pixels. Does nothing if the list of pixels is empty.
    void blame(const BrokenPixels& broken, const std::string& what);
};

/// Reads the whole file and checks that its bytes match its hashes. If the hashes match, or the
/// file has no hashes, checks that OpenEXR's classes can open the file and that the camera
/// attributes are consistent. Then checks the layers, band by band: Z is a number for every
/// fragment and never decreases within a pixel; no pixel skips a layer; pixels without a fragment
/// are 0 (for layers in separate parts); the fragment count matches the header; the part
/// `composite` equals the composited layers bit for bit. Throws Error only for causes outside the
/// file (kMemory, kInternal).
VerifiedFile verifyFile(const std::string& path);

/// Measures the certificate of a thinned file again, from `original`. Adds a kBad problem if the
/// difference exceeds the certificate's bound, or a file is not readable.
void verifyAgainst(VerifiedFile& file, const std::string& original);

}  // namespace peeler::cmd
