// SPDX-License-Identifier: GPL-2.0-or-later
#include "analysis/sweep/judges.hpp"

#include <cmath>

namespace lobatto {

Judges::Judges(const Scene& scene, const Outline& outline, const KernelSource& plain, const Kernel& plain_kernel,
               const Kernel& kernel, const EnsembleRequest& request, bool measures, bool accepts_lost,
               std::recursive_mutex& algebra)
    : request_(request),
      watch_(outline, plain, plain_kernel, request),
      domains_(scene, outline.system),
      masses_(outline),
      accepts_lost_(accepts_lost),
      algebra_(algebra) {
    if (measures) companion_.emplace(outline, kernel, plain_kernel, request);
}

Verdict Judges::judge(const EnsembleTrajectory& trajectory) {
    Verdict verdict{static_cast<int>(trajectory.status), std::nan("")};
    EnsembleStart start;
    request_.start(trajectory.index, start);
    look_at_masses(trajectory.index, start.parameters);
    if (verdict.status == LOBATTO_NOT_FINITE && std::isnan(start.q.front())) verdict.status = undefined;
    if (verdict.status != LOBATTO_OK) return verdict;
    {
        const std::lock_guard lock(algebra_);
        if (watch_.departs(trajectory)) verdict.status = departed;
    }
    if (companion_) {
        const EnsembleCompanion::Error error = companion_->of(trajectory);
        verdict.error = error.relative;
        verdict.interrupted = error.interrupted;
        if (error.lost && !accepts_lost_ && verdict.status == LOBATTO_OK) verdict.status = unresolved;
    }
    if (!is_defined(trajectory, start)) verdict.status = undefined;
    if (verdict.status == LOBATTO_OK) watch_.observe(trajectory);
    return verdict;
}

// Whether formulas have values at the start and where states are kept, also those that kernels have lost.
bool Judges::is_defined(const EnsembleTrajectory& trajectory, const EnsembleStart& start) const {
    return domains_.hold_at_start(request_.time, start.parameters, start.q, start.rate) &&
           domains_.left_at(start.parameters, trajectory.kept) < 0;
}

void Judges::look_at_masses(std::int64_t trajectory, const std::vector<double>& parameters) {
    std::string complaint = masses_.complaint(parameters);
    if (complaint.empty()) return;
    if (++not_positive_.count > 1) return;
    not_positive_.first = trajectory;
    not_positive_.complaint = std::move(complaint);
}

}  // namespace lobatto
