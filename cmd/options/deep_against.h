// SPDX-License-Identifier: Apache-2.0
// The largest difference between two deep or layered files at any depth, beside the certificate of
// a thinned file.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "core/image/deep_curve.h"
#include "formats/exr/deep_certificate.h"

namespace peeler::cmd {

struct DeepAgainst {
    std::string path;      ///< of the original
    DeepDifference worst;  ///< in the norm of largestDifference()
    int x = 0, y = 0;      ///< the pixel of `worst`
    bool tinted = false;   ///< whether one of the files has coloured opacity
    std::uint64_t samples = 0, original_samples = 0;
    std::optional<DeepCertificate> certificate;  ///< of the file, not the original
    bool is_original = false;  ///< whether the certificate has the original's hash

    /// Whether the difference is at most the certificate's bound; true without a certificate.
    bool holds() const { return !certificate || worst.error <= certificate->error; }
    /// Returns "differs from … by at most …".
    std::string text() const;
};

/// Compares two files of one size, band by band. Throws Error (kInput) if the sizes differ or a
/// file has no layers.
DeepAgainst compareDeep(const std::string& path, const std::string& original);

}  // namespace peeler::cmd
