// SPDX-License-Identifier: Apache-2.0
// A sink that keeps the whole picture.
#pragma once

#include <peeler/layered_image.h>
#include <peeler/sink.h>

#pragma GCC visibility push(default)

namespace peeler::inline v0 {

/// Puts the bands of a picture together: after finish() `image` has its crop as window.
class ImageSink final : public Sink {
  public:
    /// Throws Error (kMemory) if the picture has 2^32 fragments or more: offsets are of 32 bits.
    void begin(const Plan& plan) override;
    void write(LayeredImage&& band) override;
    void finish() override {}
    SinkMemory memory(const Plan& plan) const override;

    LayeredImage image;

  private:
    std::size_t fragments_ = 0, pixels_ = 0;  // that there will be
};

}  // namespace peeler::inline v0

#pragma GCC visibility pop
