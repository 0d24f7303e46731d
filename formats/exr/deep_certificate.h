// SPDX-License-Identifier: Apache-2.0
// The certificate of a thinned deep image: the attribute peeler:deepCertificate.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include <peeler/layered_image.h>
#include "formats/file/content_hash.h"

namespace peeler {

inline constexpr char kDeepCertificate[] = "peeler:deepCertificate";

/// The bound and the outcome of thinDeepSamples().
struct DeepCertificate {
    double error = 0, largest = 0;
    std::uint64_t before = 0, after = 0;  ///< samples
    std::string source{};                 ///< DeepSourceHash::text() of the original

    /// Returns the certificate as JSON. The length depends on `error` and `before` alone.
    std::string text() const;
};

/// Reads a certificate from its text. Returns nothing if the text is not a certificate.
std::optional<DeepCertificate> deepCertificateFrom(const std::string& text);

/// The hash of all samples of a picture, by which a certificate names its original: the XXH64 of
/// the XXH64s of all rows with samples, from the top. The bytes of a row are x, y and number of
/// samples (three 32-bit integers) of each pixel with samples; all Z; all colours
/// (LayeredImage::color); all ZBack as float, if there are any.
class DeepSourceHash {
  public:
    /// Adds the rows [y0, y1). Rows must be added from top to bottom; bands do not matter.
    void add(const LayeredImage& image, int y0, int y1);
    /// Returns `xxh64:` and 16 hexadecimal digits.
    std::string text() const { return "xxh64:" + hexText(hasher_.value()); }

  private:
    ContentHasher hasher_;
};

}  // namespace peeler
