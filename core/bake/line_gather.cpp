// SPDX-License-Identifier: Apache-2.0
// Gathering along lines from each receiver: tasks of receivers and directions, and their sums.
#include "core/bake/line_gather.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <mutex>
#include <numeric>
#include <utility>

#include "core/bake/occluders.h"
#include "core/bake/visibility_rays.h"
#include "core/base/parallel.h"
#include "core/base/process_memory.h"

namespace peeler {
namespace {

// Hits nearer than this fraction of the scene's diagonal are ignored as the receiver's own surface.
constexpr double kOwnSurfaceShare = 1e-4;
// The maximum number of receivers per chunk. A chunk must fit a core's cache, but be large enough
// to justify projecting the scene for it.
constexpr std::size_t kMostTogether = std::size_t{1} << 17;
constexpr std::size_t kGroupDirections = 8;  // directions per task
constexpr std::size_t kTasksAThread = 4;
constexpr std::size_t kSumsAtOnce = 4096;  // sums per task
// Bytes that the first use takes for code, tables and sorted cells; measured.
constexpr std::uint64_t kLineBytes = std::uint64_t{4} << 20;

/// Returns the receivers in an order that keeps neighbours together: along a Z-order curve (Morton
/// 1966) through a grid of 1024 cells per side.
std::vector<std::uint32_t> spatialOrder(const Receivers& receivers, const Occluders& occluders) {
    constexpr double kSide = 1024;
    const auto spread = [](double at) {
        auto bits = static_cast<std::uint64_t>(at > 0 ? std::min(at, kSide - 1) : 0);
        bits = (bits | bits << 16) & 0x030000FF;
        bits = (bits | bits << 8) & 0x0300F00F;
        bits = (bits | bits << 4) & 0x030C30C3;
        return (bits | bits << 2) & 0x09249249;
    };
    const double cells_a_unit = kSide / occluders.diagonal();
    std::vector<std::uint64_t> keys(receivers.size());
    for (std::size_t r = 0; r < keys.size(); ++r) {
        const glm::dvec3 at =
            (receivers.positions[r] - occluders.origin()) * cells_a_unit + kSide / 2;
        keys[r] = (spread(at.x) | spread(at.y) << 1 | spread(at.z) << 2) << 32 | r;
    }
    std::ranges::sort(keys);
    std::vector<std::uint32_t> order(keys.size());
    std::ranges::transform(keys, order.begin(),
                           [](std::uint64_t key) { return static_cast<std::uint32_t>(key); });
    return order;
}

/// The division of the work into tasks. Each task has a chunk of receivers and a group of
/// directions.
struct LineTasks {
    /// Throws Error (kMemory) if a single group of directions exceeds the budget.
    LineTasks(const GatherJob& job, const MemoryBudget& budget)
        : count(job.receivers.size()),
          chunks((count + kMostTogether - 1) / kMostTogether),
          chunk((count + chunks - 1) / chunks),
          groups((job.directions.size() + kGroupDirections - 1) / kGroupDirections) {
        const auto threads = static_cast<std::size_t>(threadCount());
        const std::size_t busy = (kTasksAThread * threads + chunks - 1) / chunks;
        groups_at_once = std::clamp<std::size_t>(busy, 1, groups);
        const std::uint64_t keys = chunks > 1 ? count * sizeof(std::uint64_t) : 0;
        const std::uint64_t fixed =
            count * sizeof(std::uint32_t) + keys + threads * VisibilityRays::bytes(chunk);
        const std::uint64_t of_group = count * sizeof(Sum);
        if (budget != 0) {
            const std::uint64_t used = usedBytes(budget) + fixed;
            const std::uint64_t left = budget > used ? budget - used : 0;
            groups_at_once = std::clamp<std::size_t>(left / of_group, 1, groups_at_once);
        }
        bytes = fixed + groups_at_once * of_group;
        checkReceiverMemory(bytes, count, budget);
    }

    std::size_t count, chunks, chunk, groups, groups_at_once = 1;
    std::uint64_t bytes = 0;  // memory of all tasks together
};

/// Runs the tasks, one per chunk and group. Runs enough groups at the same time to keep all threads
/// busy. The sums of each task begin at 0 and are added up in the order of the groups, so the
/// result does not depend on the number of groups that run at the same time.
class LineGather {
  public:
    LineGather(const Occluders& occluders, const GatherJob& job, const LineTasks& tasks)
        : occluders_(occluders), job_(job), tasks_(tasks) {
        if (tasks_.chunks > 1) {
            order_ = spatialOrder(job.receivers, occluders);
        } else {
            order_.resize(tasks_.count);
            std::iota(order_.begin(), order_.end(), 0U);
        }
        partial_.resize(tasks_.groups_at_once * tasks_.count);
    }

    void addTo(std::vector<Sum>& sums, const Progress& progress) {
        for (std::size_t first = 0; first < tasks_.groups; first += tasks_.groups_at_once) {
            const std::size_t groups = std::min(tasks_.groups_at_once, tasks_.groups - first);
            parallelFor(groups * tasks_.chunks, [&](std::size_t task) {
                const std::size_t group = task / tasks_.chunks;
                lookAlong(first + group, task % tasks_.chunks,
                          partial_.data() + group * tasks_.count);
            });
            parallelFor((tasks_.count + kSumsAtOnce - 1) / kSumsAtOnce, [&](std::size_t part) {
                const std::size_t end = std::min(tasks_.count, (part + 1) * kSumsAtOnce);
                for (std::size_t i = part * kSumsAtOnce; i < end; ++i) {
                    Sum& sum = sums[order_[i]];
                    for (std::size_t group = 0; group < groups; ++group) {
                        sum.value += partial_[group * tasks_.count + i].value;
                        sum.weight += partial_[group * tasks_.count + i].weight;
                    }
                }
            });
            if (progress)
                progress(static_cast<double>(first + groups) / static_cast<double>(tasks_.groups));
        }
    }

  private:
    /// Runs one task. `sums` holds the sums of all receivers for the task's group, in the order of
    /// `order_`.
    void lookAlong(std::size_t group, std::size_t chunk, Sum* sums) {
        const std::size_t first = chunk * tasks_.chunk,
                          end = std::min(tasks_.count, first + tasks_.chunk);
        std::fill(sums + first, sums + end, Sum{});
        const std::span<const std::uint32_t> chosen(order_.data() + first, end - first);
        std::unique_ptr<VisibilityRays> rays = take();
        rays->place(job_.receivers, chosen);
        const std::size_t from = group * kGroupDirections;
        const std::size_t to = std::min(from + kGroupDirections, job_.directions.size());
        for (std::size_t d = from; d < to; ++d) {
            const glm::dvec3& direction = job_.directions[d];
            rays->look(direction, job_.integrator.looksInside(),
                       static_cast<float>(job_.settings.max_distance));
            VisibleHit seen;
            for (std::size_t i = 0; i < chosen.size(); ++i) {
                const float cosine = rays->cosines()[i];
                if (cosine == 0) continue;
                seen.direction = glm::vec3(cosine > 0 ? direction : -direction);
                seen.distance = rays->distances()[i];
                job_.integrator.add(seen, job_.receivers.positions[chosen[i]], std::abs(cosine),
                                    sums[first + i]);
            }
        }
        const std::lock_guard lock(mutex_);
        idle_.push_back(std::move(rays));
    }

    std::unique_ptr<VisibilityRays> take() {
        const std::lock_guard lock(mutex_);
        if (idle_.empty())
            return std::make_unique<VisibilityRays>(
                occluders_, static_cast<float>(kOwnSurfaceShare * occluders_.diagonal()));
        std::unique_ptr<VisibilityRays> rays = std::move(idle_.back());
        idle_.pop_back();
        return rays;
    }

    const Occluders& occluders_;
    const GatherJob& job_;
    const LineTasks& tasks_;
    std::vector<std::uint32_t> order_;  // indices of the receivers, chunk by chunk
    // sums of the groups in progress; the sums of each group are in the order of order_
    std::vector<Sum> partial_;
    std::mutex mutex_;
    std::vector<std::unique_ptr<VisibilityRays>> idle_;
};

}  // namespace

void gatherByLines(const PosedScene& posed, const CaptureSettings& capture, const GatherJob& job,
                   std::vector<Sum>& sums, const Progress& progress) {
    if (job.receivers.size() == 0) return;
    const Occluders occluders(posed, capture.faces);
    const LineTasks tasks(job, capture.memory);
    if (job.tell) job.tell(residentBytes() + tasks.bytes + kLineBytes);
    LineGather(occluders, job, tasks).addTo(sums, progress);
}

std::uint64_t forecastLines(const PosedScene& posed, const CaptureSettings& capture,
                            const GatherJob& job) {
    if (job.receivers.size() == 0) return residentBytes();
    const Occluders occluders(posed, capture.faces);
    return residentBytes() + LineTasks(job, capture.memory).bytes + kLineBytes;
}

}  // namespace peeler
