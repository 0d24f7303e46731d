// SPDX-License-Identifier: Apache-2.0
#include "formats/exr/exr_deep_with_cryptomatte.h"

#include <algorithm>
#include <filesystem>
#include <utility>

#include "core/base/stage_times.h"
#include "formats/exr/exr_writers.h"

namespace peeler {

namespace {

OutputOptions deepOptions(OutputOptions options) {
    options.cryptomatte = false;
    return options;
}

OutputOptions compositeOptions(OutputOptions options) {
    options.as = "composite";
    options.compression.clear();
    options.provenance.output_hash.clear();  // it is the hash of the deep image
    return options;
}

class DeepWithCryptomatte final : public Sink {
  public:
    DeepWithCryptomatte(const std::string& path, const OutputOptions& options)
        : deep_(path, deepOptions(options)),
          composite_(deepCompanions(path, options).front(), compositeOptions(options)) {}

    void begin(const Plan& plan) override {
        deep_.begin(plan);
        composite_.begin(plan);
    }
    void write(LayeredImage&& band) override {
        copy_ = band;
        composite_.write(std::move(copy_));
        deep_.write(std::move(band));
    }
    void finish() override {
        composite_.finish();
        deep_.finish();
    }
    SinkMemory memory(const Plan& plan) const override {
        SinkMemory memory = deep_.memory(plan);
        const SinkMemory more = composite_.memory(plan);
        memory.rows = std::max(memory.rows, more.rows);
        memory.bytes += more.bytes;
        memory.pixel_bytes += more.pixel_bytes;
        memory.fragment_bytes += more.fragment_bytes;
        memory.bands = std::max(memory.bands, more.bands) + 1;  // for copy_
        return memory;
    }
    StageTimes times() const override {
        StageTimes times = deep_.times();
        add(times, composite_.times());
        return times;
    }

  private:
    ExrDeepWriter deep_;
    ExrCompositeWriter composite_;
    LayeredImage copy_;
};

}  // namespace

std::unique_ptr<Sink> makeDeepImage(const std::string& path, const OutputOptions& options) {
    if (options.cryptomatte) return std::make_unique<DeepWithCryptomatte>(path, options);
    return std::make_unique<ExrDeepWriter>(path, options);
}

std::vector<std::string> deepCompanions(const std::string& path, const OutputOptions& options) {
    if (!options.cryptomatte) return {};
    return {std::filesystem::path(path).replace_extension(".cryptomatte.exr").string()};
}

}  // namespace peeler
