// SPDX-License-Identifier: Apache-2.0
#include "cmd/verify/verified_file.h"

#include <algorithm>
#include <memory>
#include <utility>

#include <peeler/error.h>
#include "cmd/cli/errors.h"
#include "cmd/cli/option_names.h"
#include "cmd/cli/report.h"
#include "cmd/options/layered_bands.h"
#include "cmd/session/reporter.h"
#include "cmd/verify/verified_layers.h"
#include "core/base/printable.h"
#include "core/image/statistics.h"
#include "formats/exr/exr_layout.h"
#include "formats/layered/opened_picture.h"

namespace peeler::cmd {

namespace {

/// The maximum size of a band, in bytes, not counting the band's stored composite.
constexpr std::uint64_t kVerifiedBytes = std::uint64_t{128} << 20;

std::string at(const std::map<std::string, std::string>& attributes, const std::string& name) {
    const auto found = attributes.find(name);
    return found == attributes.end() ? std::string() : found->second;
}

void checkFragments(LayeredInput& input, VerifiedFile& file) {
    const ExrInfo& info = input.info();
    const Window& crop = info.plan.view.crop;
    BrokenPixels unsorted, infinite, wrong;
    CompositeImage composite;
    PixelType composite_type = PixelType::kFloat;
    if (info.composite >= 0) {
        const ExrInputPart& part = info.parts[static_cast<std::size_t>(info.composite)];
        if (const auto* red = part.channel("R")) composite_type = red->type;
        // Without a known camera, as in files converted from other programs' files, the composite
        // may be smaller than the crop.
        if (part.data_window != crop && info.plan.view.known) {
            file.blame(Verdict::kBad, "the composite does not cover the pixels of the picture");
        }
    }
    const bool has_composite =
        info.composite >= 0 &&
        info.parts[static_cast<std::size_t>(info.composite)].data_window == crop;
    forEachBand(input, kVerifiedBytes, [&](const LayeredImage& band) {
        file.fragments += band.fragments();
        findUnsorted(band, unsorted);
        findInfinite(band, infinite);
        if (!has_composite) return;
        input.readComposite(band.window, composite);
        findWrongComposite(band, composite, composite_type, wrong);
    });
    file.blame(unsorted, "the layers are not sorted by Z");
    file.blame(infinite, "a fragment's Z is not finite");
    file.blame(wrong, "the composite does not match the layers");
    if (file.fragments != info.plan.fragments_stored) {
        file.blame(Verdict::kBad, "the header says " + groupedText(info.plan.fragments_stored) +
                                      " fragments, but there are " + groupedText(file.fragments));
    }
}

void checkCompleteness(const ExrInfo& info, VerifiedFile& file) {
    const Plan& plan = info.plan;
    // A per-layer file has the counts of the whole picture but only a part of its fragments.
    if (at(info.attributes(), "peeler:layout") == kPerFileLayout &&
        !at(info.attributes(), "peeler:layer").empty())
        return;
    // Hits of bundles and pictures without layers have no fragment counts.
    if (holdsBundles(info)) return;
    if (info.layers.empty() && info.deep.empty() && at(info.attributes(), "peeler:layers").empty())
        return;
    const bool says_complete = at(info.attributes(), "peeler:complete") == "1";
    if (says_complete != plan.complete()) {
        file.blame(Verdict::kBad, "peeler:complete is " + at(info.attributes(), "peeler:complete") +
                                      ", which contradicts the fragment counts");
    }
    // A thinned file has fewer samples, but within a bound.
    if (plan.complete() || !at(info.attributes(), kDeepCertificate).empty()) return;
    file.blame(Verdict::kIncomplete, "not complete: " + groupedText(plan.fragments_stored) +
                                         " of " + countText(plan.fragments_counted, "fragment"));
}

/// Returns a problem with its location, unless the location is only the file's name.
std::string sentence(const Text& problem, const Text& where, const VerifiedFile& file) {
    return inOptions(problem +
                     (where == file.path ? Text() : ": " + printableText(where, kMostOfName)));
}

/// Checks the bytes of a file against its hashes, and its headers for contradictions. Skips files
/// of arrays, which have neither hashes nor redundant counts.
void checkBytes(VerifiedFile& file) {
    const ExrIntegrity proof = exrIntegrity(file.path);
    file.proof = proof.state;
    if (proof.state == ExrIntegrity::kChanged)
        return file.blame(Verdict::kBad, sentence(proof.problem(), proof.where, file));
    for (const std::string& problem : headerContradictions(file.path))
        file.blame(Verdict::kBad, problem);
}

/// Reads a file of another program, or a lone composite, to the end.
void readToEnd(OpenedPicture opened, VerifiedFile& file) {
    const bool composite = isLoneComposite(opened.info());
    const std::unique_ptr<LayeredInput> input =
        composite ? openComposite(std::move(opened)) : openLayered(std::move(opened));
    forEachBand(*input, kVerifiedBytes,
                [&](const LayeredImage& band) { file.fragments += band.fragments(); });
}

void verify(VerifiedFile& file) {
    OpenedPicture opened(file.path);
    const bool arrays = opened.isOfArrays();
    if (!arrays) checkBytes(file);
    const ExrInfo info = opened.info();
    file.view = info.plan.view;
    file.provenance = info.provenance;
    file.kind = !info.is_peeler   ? VerifiedKind::kForeign
                : isLayered(info) ? VerifiedKind::kLayered
                                  : VerifiedKind::kFlat;
    if (info.is_peeler) checkCompleteness(info, file);
    if (file.kind == VerifiedKind::kLayered) {
        const std::unique_ptr<LayeredInput> input = openLayered(std::move(opened));
        file.layers = input->info().plan.layers.size();
        checkFragments(*input, file);
        if (!arrays) checkLayerParts(file.path, input->info(), file);
        return;
    }
    if (arrays) return readToEnd(std::move(opened), file);
    const ExrInput input(file.path);
    for (std::size_t part = 0; part < input.parts().size(); ++part)
        input.decodeAll(part);
}

}  // namespace

void VerifiedFile::blame(Verdict found, const std::string& problem) {
    verdict = std::max(verdict, found);
    problems.push_back(problem);
}

void VerifiedFile::blame(const BrokenPixels& broken, const std::string& what) {
    if (broken.pixels == 0) return;
    blame(Verdict::kBad, what + " in " + countText(broken.pixels, "pixel") + ", the first at (" +
                             std::to_string(broken.x) + ", " + std::to_string(broken.y) + ")");
}

VerifiedFile verifyFile(const std::string& path) {
    VerifiedFile file;
    file.path = path;
    try {
        verify(file);
    } catch (const Error& error) {
        if (error.kind() != ErrorKind::kInput) throw;
        file.blame(Verdict::kBad, sentence(error.whatText(), error.whereText(), file));
    }
    return file;
}

void verifyAgainst(VerifiedFile& file, const std::string& original) {
    try {
        file.against = compareDeep(file.path, original);
    } catch (const Error& error) {
        if (error.kind() != ErrorKind::kInput) throw;
        return file.blame(Verdict::kBad, sentence(error.whatText(), error.whereText(), file));
    }
    if (!file.against->holds()) file.blame(Verdict::kBad, file.against->text());
}

}  // namespace peeler::cmd
