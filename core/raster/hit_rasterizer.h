// SPDX-License-Identifier: Apache-2.0
// Hits of rays on the CPU.
#pragma once

#include <utility>

#include "core/base/error.h"
#include "core/capture/hit_source.h"

namespace peeler {

class HitRasterizer final : public HitSource {
  public:
    explicit HitRasterizer(PosedScene posed) : posed_(std::move(posed)) {}
    Plan plan(const View&, const CaptureSettings&, const Progress& = {}) override { refuse(); }
    CaptureReport capture(Sink&, const Progress& = {}) override { refuse(); }
    const PosedScene& posed() const override { return posed_; }
    StageTimes takeTimes() override { return {}; }

  private:
    [[noreturn]] static void refuse() {
        throw Error(ErrorKind::kInternal, "there is no rasteriser of hits yet");
    }
    PosedScene posed_;
};

}  // namespace peeler
