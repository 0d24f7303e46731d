// SPDX-License-Identifier: Apache-2.0
// A sink that keeps the picture in memory.
#pragma once

#include <peeler/layered_image.h>
#include <peeler/sink.h>

#pragma GCC visibility push(default)

namespace peeler::inline v0 {

/// A sink that joins all bands into `image`. After finish(), the window of `image` is the crop.
class ImageSink final : public Sink {
  public:
    /// Throws Error (kMemory) if the picture has 2^32 fragments or more, because offsets have 32
    /// bits.
    void begin(const Plan& plan) override;
    void write(LayeredImage&& band) override;
    void finish() override {}
    SinkMemory memory(const Plan& plan) const override;

    LayeredImage image;

  private:
    std::size_t fragments_ = 0, pixels_ = 0;  // totals in the plan
};

}  // namespace peeler::inline v0

#pragma GCC visibility pop
