// SPDX-License-Identifier: Apache-2.0
// Fragments of masks through lenses, which the CPU traces.
#pragma once

#include <peeler/sink.h>
#include <peeler/view.h>
#include <optional>
#include "core/raster/surface_values.h"

namespace peeler::cmd {

/// A sink that gives traced hits their opacity, and passes them on.
class TranslucentHits final : public Sink {
  public:
    /// `sink` must outlive this object.
    TranslucentHits(const PosedScene& posed, const View& view, Sink& sink)
        : colors_(posed), view_(view), sink_(sink) {}

    void begin(const Plan& plan) override { sink_.begin(plan); }
    void write(LayeredImage&& band) override {
        colors_.addTo(view_, band);
        sink_.write(std::move(band));
    }
    void finish() override { sink_.finish(); }
    SinkMemory memory(const Plan& plan) const override {
        SinkMemory memory = sink_.memory(plan);
        memory.bytes += colors_.mostBytes();
        memory.fragment_bytes += sizeof(glm::vec4);
        return memory;
    }

  private:
    SurfaceColors colors_;
    View view_;
    Sink& sink_;
};

}  // namespace peeler::cmd
