// SPDX-License-Identifier: Apache-2.0
#include "cmd/options/layered_options.h"

#include <algorithm>
#include <utility>

#include <peeler/error.h>
#include "cmd/cli/arguments.h"
#include "cmd/cli/errors.h"
#include "cmd/options/scene_options.h"
#include "formats/file/file_name.h"

namespace peeler::cmd {

namespace {

/// A layered file that reports its warnings.
class WarningInput final : public LayeredInput {
  public:
    WarningInput(std::unique_ptr<LayeredInput> input, Reporter& reporter)
        : input_(std::move(input)), reporter_(reporter) {
        print();
    }

    const ExrInfo& info() const override { return input_->info(); }
    void read(const Window& window, LayeredImage& out) override {
        input_->read(window, out);
        print();
    }
    void readComposite(const Window& window, CompositeImage& out) override {
        input_->readComposite(window, out);
    }
    int rowsFor(std::uint64_t bytes) const override { return input_->rowsFor(bytes); }
    BandRead mostOf(int rows) const override { return input_->mostOf(rows); }

  private:
    void print() {
        for (const Text& warning : input_->takeWarnings())
            reporter_.warning(warning);
    }

    std::unique_ptr<LayeredInput> input_;
    Reporter& reporter_;
};

}  // namespace

void addLayeredOptions(VerbOptions& verb, LayeredReadOptions& options) {
    const auto add = [&](const char* name, std::string& target, const char* help) {
        verb.addText(
                name, "NAME", [&target](const std::string& text) { target = text; }, help)
            .group("Input");
    };
    add("--part", options.part,
        "part or layer (beauty for beauty.R) to read from an .exr of another program (default: the "
        "first part with colours)");
    add("--view", options.view,
        "view to read from an .exr with several views, such as left and right");
    if (!verb.knows("--strict")) addStrictOption(verb, options.strict);
}

void refusePictureChoice(const LayeredReadOptions& options) {
    if (!options.choosesPicture()) return;
    throw Error(ErrorKind::kUsage, "a scene has no pictures to choose from",
                options.part.empty() ? "--view" : "--part", "leave it out, or give an .exr");
}

LayeredReadOptions readingFor(const LayeredReadOptions& options,
                              std::span<const std::filesystem::path> outputs) {
    LayeredReadOptions reading = options;
    reading.pixels_only = std::ranges::any_of(outputs, [](const std::filesystem::path& path) {
        return !path.empty() && lowerExtension(path) != ".exr" &&
               lowerExtension(path) != ".safetensors";
    });
    return reading;
}

std::unique_ptr<LayeredInput> openInput(const std::string& path, const LayeredReadOptions& options,
                                        Reporter& reporter) {
    return openInput(OpenedPicture(path, options), reporter);
}

std::unique_ptr<LayeredInput> openInput(OpenedPicture opened, Reporter& reporter) {
    return std::make_unique<WarningInput>(openLayered(std::move(opened)), reporter);
}

}  // namespace peeler::cmd
