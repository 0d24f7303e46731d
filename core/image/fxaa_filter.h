// SPDX-License-Identifier: Apache-2.0
// FXAA of a picture that arrives in bands.
#pragma once

#include <array>
#include <memory>

#include "core/image/composite.h"
#include "core/image/sink.h"

namespace peeler {

/// Composites the bands it gets, filters them (core/image/fxaa.h) and hands them to another Sink,
/// as bands of one layer. The result does not depend on how the picture is cut into bands. It keeps
/// the rows that others still need: twice kFxaaReach, and those being filtered.
class FxaaFilter : public Sink {
  public:
    /// `background`: premultiplied linear RGBA that `next` will put behind the picture. What is not
    /// opaque is filtered for any.
    FxaaFilter(std::unique_ptr<Sink> next, const std::array<float, 4>& background);

    void begin(const Plan& plan) override;
    void write(LayeredImage&& band) override;
    void finish() override;
    SinkMemory memory() const override;
    /// Its own are part of "composite".
    StageTimes times() const override;

  private:
    void keep(int y0, int y1);
    void passOn();

    std::unique_ptr<Sink> next_;
    std::array<float, 4> background_;
    Window crop_;
    int slice_rows_ = 0;        ///< most rows filtered at once
    int next_row_ = 0;          ///< the first that has not been handed on
    CompositeImage composite_;  ///< the band
    CompositeImage kept_;       ///< rows of it and of those before
    CompositeImage filtered_;
    LayeredImage layer_;
    StageTimes times_;
};

}  // namespace peeler
