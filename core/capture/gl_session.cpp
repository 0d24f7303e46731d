// SPDX-License-Identifier: Apache-2.0
#include "core/capture/gl_session.h"

#include <algorithm>

#include "core/base/process_memory.h"
#include "core/gl/adopted_context.h"
#include "core/gl/borrowed_state.h"
#include "core/splats/projected_splats.h"

namespace peeler {

GlSession::GlSession(bool keeps_scenes) : keeps_scenes_(keeps_scenes) {}

GlSession::GlSession(void* (*function_of)(const char* name)) : function_of_(function_of) {
    if (function_of_) adopt();
}

GlSession::~GlSession() {
    if (adopted_ && !adopted_->current()) adopted_->abandonObjects();
    close();
}

void GlSession::adopt() {
    auto adopted = std::make_unique<gl::AdoptedContext>(function_of_);
    adopted_ = adopted.get();
    context_ = std::move(adopted);
}

gl::Context& GlSession::borrow() {
    if (borrowed_) return *context_;
    if (!context_) adopt();  // the earlier context was lost
    adopted_->requireCurrent();
    const gl::Functions& functions = adopted_->functions();
    for (const unsigned code : gl::takeErrors(functions))
        if (std::ranges::find(pending_errors_, code) == pending_errors_.end())
            pending_errors_.push_back(code);
    gl::requireNothingBegun(functions);
    borrowed_ = std::make_unique<gl::BorrowedState>(functions);
    return *context_;
}

gl::Context& GlSession::context(const gl::ContextRequest& device) {
    if (function_of_) return borrow();
    if (context_ && request_ == device) return *context_;
    close();
    context_ = gl::createContext(device);
    request_ = device;
    return *context_;
}

bool GlSession::findGpu(std::string& reasons) {
    const gl::ContextRequest any;  // a default request, which prefers the first GPU
    if (context_ && request_ == any && !context_->device().software) return true;
    reasons = no_gpu_;
    if (!no_gpu_.empty()) return false;
    std::vector<std::string> attempts;
    std::unique_ptr<gl::Context> found = gl::findGpuContext(&attempts);
    if (!found) {
        for (const std::string& attempt : attempts)
            no_gpu_ += (no_gpu_.empty() ? "" : "; ") + attempt;
        reasons = no_gpu_;
        return false;
    }
    close();
    context_ = std::move(found);
    request_ = any;
    return true;
}

bool needsContext(const gl::ContextRequest& device, const PosedScene& posed) {
    return device.choosesDevice() || !hasOnlySplats(posed);
}

GlRenderer& GlSession::renderer(const gl::ContextRequest& device,
                                const std::shared_ptr<const Scene>& scene, int index,
                                const PosedScene& posed) {
    gl::Context* const opened =
        function_of_ || needsContext(device, posed) ? &context(device) : nullptr;
    const auto known = std::ranges::find_if(uploads_, [&](const Upload& upload) {
        return scene && upload.scene == scene && upload.index == index;
    });
    if (known != uploads_.end() && !known->renderer->canShow(posed)) {
        uploads_.erase(known);
    } else if (known != uploads_.end()) {
        uploads_.splice(uploads_.begin(), uploads_, known);
        known->renderer->setPose(posed);
        return *known->renderer;
    }
    if (!keeps_scenes_) uploads_.clear();
    const std::uint64_t before = residentBytes();
    auto renderer =
        opened ? std::make_unique<GlRenderer>(*opened, posed) : std::make_unique<GlRenderer>(posed);
    const std::uint64_t now = residentBytes();
    uploads_.push_front({scene, index, std::move(renderer), now - std::min(now, before)});
    return *uploads_.front().renderer;
}

std::uint64_t GlSession::uploadedBytes() const {
    std::uint64_t sum = 0;
    for (const Upload& upload : uploads_)
        sum += upload.bytes;
    return sum;
}

bool GlSession::closeOldest() {
    if (uploads_.size() < 2) return false;
    uploads_.pop_back();
    return true;
}

void GlSession::closeUnowned() {
    std::erase_if(uploads_, [](const Upload& upload) { return !upload.scene; });
}

void GlSession::close() {
    uploads_.clear();
    borrowed_.reset();
    adopted_ = nullptr;
    context_.reset();
}

void GlSession::giveBack() {
    borrowed_.reset();
}

void GlSession::giveUp(bool device_lost) {
    // If no context was borrowed, another owner's context may be current, in which the session's
    // objects do not exist.
    if (function_of_ && !borrowed_) return;
    uploads_.clear();
    borrowed_.reset();
    if (device_lost) close();
}

}  // namespace peeler
