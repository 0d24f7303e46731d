// SPDX-License-Identifier: Apache-2.0
// How long a GPU itself works, beside what the CPU does meanwhile.
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

/// Measures spans of commands by timer queries (OpenGL 4.5 core, 4.3, "Time Queries"), without
/// waiting for them. Software renderers are not measured: what they do the CPU does.
class GpuTimer {
  public:
    explicit GpuTimer(const Context& context) : context_(context) {}

    /// Lasts as long as the object. Spans do not lie within each other.
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

    /// Begins a span of a stage.
    [[nodiscard]] Span span(const char* stage);

    /// Waits for all spans and adds their milliseconds to their stages.
    void takeInto(StageTimes& times);

  private:
    const Context& context_;
    std::vector<std::pair<const char*, Query>> spans_;
    std::vector<Query> unused_;
};

}  // namespace peeler::gl
