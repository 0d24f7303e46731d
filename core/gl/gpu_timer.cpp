// SPDX-License-Identifier: Apache-2.0
#include "core/gl/gpu_timer.h"

namespace peeler::gl {

GpuTimer::Span GpuTimer::span(const char* stage) {
    if (context_.device().software) return Span(nullptr);
    const Functions& gl = context_.functions();
    if (unused_.empty()) {
        GLuint name = 0;
        gl.CreateQueries(GL_TIME_ELAPSED, 1, &name);
        unused_.emplace_back(gl, name);
    }
    spans_.emplace_back(stage, std::move(unused_.back()));
    unused_.pop_back();
    gl.BeginQuery(GL_TIME_ELAPSED, spans_.back().second.name());
    return Span(&gl);
}

void GpuTimer::takeInto(StageTimes& times) {
    constexpr double kMilliseconds = 1e-6;  // milliseconds per nanosecond
    for (auto& [stage, query] : spans_) {
        GLuint64 nanoseconds = 0;
        context_.functions().GetQueryObjectui64v(query.name(), GL_QUERY_RESULT, &nanoseconds);
        times[stage] += static_cast<double>(nanoseconds) * kMilliseconds;
        unused_.push_back(std::move(query));
    }
    spans_.clear();
}

}  // namespace peeler::gl
