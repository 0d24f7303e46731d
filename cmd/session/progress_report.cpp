// SPDX-License-Identifier: Apache-2.0
#include "cmd/session/progress_report.h"

#include <algorithm>

namespace peeler::cmd {

ProgressReport::ProgressReport(Reporter& reporter, Stage stage)
    : reporter_(reporter), stage_(std::move(stage)), begin_(reporter.done()) {
    reporter_.beginStage({stage_.name, 0, begin_});
}

ProgressReport::~ProgressReport() {
    reporter_.endStage();
}

void ProgressReport::update(double share) {
    const double done = std::clamp(share, 0.0, 1.0);
    const double of_run = begin_ + (std::max(stage_.end, begin_) - begin_) * done;
    reporter_.done_ = std::max(reporter_.done_, of_run);
    reporter_.progress({stage_.name, done, of_run});
}

}  // namespace peeler::cmd
