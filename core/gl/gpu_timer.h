// SPDX-License-Identifier: Apache-2.0
// GPU time, measured separately from CPU time.
#pragma once

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <peeler/stage_times.h>
#include "core/gl/context.h"
#include "core/gl/objects.h"

namespace peeler::gl {

using Query = Object<&Functions::DeleteQueries>;

/// A timer for spans of GPU commands. Uses timer queries (OpenGL 4.5 core, 4.3, "Time Queries"), so
/// that measuring does not wait for the GPU. Does not measure software renderers, because their
/// time is CPU time.
class GpuTimer {
  public:
    explicit GpuTimer(const Context& context) : context_(context) {}

    /// A scope that measures its GPU commands. Spans must not nest.
    class Span {
      public:
        explicit Span(const Functions* gl) : gl_(gl) {}
        Span(const Span&) = delete;
        Span& operator=(const Span&) = delete;
        ~Span() {
            if (gl_) gl_->EndQuery(GL_TIME_ELAPSED);
        }

      private:
        const Functions* gl_;
    };

    /// Begins a span of this stage.
    [[nodiscard]] Span span(const char* stage);

    /// Waits for all spans and adds their milliseconds to the times of their stages.
    void takeInto(StageTimes& times);

  private:
    const Context& context_;
    std::vector<std::pair<const char*, Query>> spans_;
    std::vector<Query> unused_;
};

}  // namespace peeler::gl
