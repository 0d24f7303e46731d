// SPDX-License-Identifier: Apache-2.0
#include "cmd/options/dense_options.h"

#include <limits>

#include <peeler/error.h>
#include "cmd/cli/arguments.h"
#include "cmd/cli/errors.h"
#include "cmd/cli/parse.h"
#include "cmd/options/output_options.h"
#include "cmd/session/choices.h"

namespace peeler::cmd {

namespace {

constexpr std::int64_t kMostPlanes = 4096;

constexpr Choice<PixelType> kPlaneTypes[] = {
    {"float", PixelType::kFloat, "32 bits"},
    {"half", PixelType::kHalf, "16 bits: three significant digits, up to 65,504"},
};

double parseFill(const std::string& text) {
    constexpr double kInfinity = std::numeric_limits<double>::infinity();
    if (text == "nan") return std::numeric_limits<double>::quiet_NaN();
    if (text == "inf") return kInfinity;
    if (text == "-inf") return -kInfinity;
    try {
        return parseNumber(text);
    } catch (const Error&) {
        throw Error(ErrorKind::kUsage, "expected nan, inf, last or a number");
    }
}

}  // namespace

void addDenseOptions(VerbOptions& verb, OutputRequest& output) {
    constexpr const char* kGroup = "Planes";
    DenseSettings& dense = output.options.dense;
    verb.addText(
            "--dense", "N",
            [&output, &dense](const std::string& text) {
                dense.layers = static_cast<std::uint32_t>(parseInteger(text, 1, kMostPlanes));
                output.given.insert("--dense");
                if (output.options.as.empty()) output.options.as = "dense";
            },
            "write N dense planes instead of lists: arrays of shape (h, w, N) or (h, w, N, "
            "components), where plane k holds the k-th fragment of every pixel, plus count (h, w); "
            "N is 1 to " +
                std::to_string(kMostPlanes))
        .group(kGroup);
    verb.addText(
            "--fill", "VALUE",
            [&output, &dense](const std::string& text) {
                dense.repeat_last = text == "last";
                if (!dense.repeat_last) dense.fill = parseFill(text);
                output.given.insert("--fill");
            },
            "value of planes where a pixel has no fragment: nan, inf, a number such as -1, or last "
            "to repeat the pixel's last fragment; ids are always filled with 0xFFFFFFFF, facing "
            "with 0 (default: nan)")
        .group(kGroup);
    addValue(
        verb, "--dense-type", "NAME", dense.type,
        [&output](const std::string& text) {
            output.given.insert("--dense-type");
            return choose<PixelType>("type", kPlaneTypes, text);
        },
        "number type of planes, except ids, facing and count:")
        .oneOf(describeChoices(kPlaneTypes, true))
        .group(kGroup);
}

void checkDenseOptions(const OutputRequest& output, bool has_planes) {
    if (has_planes) return;
    if (output.isGiven("--dense"))
        refuse("only arrays can have planes", "--dense",
               "write a .npz or .safetensors, or leave it out");
    for (const char* option : {"--fill", "--dense-type"})
        if (output.isGiven(option)) refuse("there are no planes", option, "add --dense N");
}

}  // namespace peeler::cmd
