// SPDX-License-Identifier: GPL-2.0-or-later
// Many trajectories of one scene, from starts in columns.
#include <fmt/format.h>

#include <cmath>
#include <limits>

#include "analysis/accuracy/energy_watch.hpp"
#include "analysis/accuracy/ensemble_companion.hpp"
#include "analysis/accuracy/sweep_watch.hpp"
#include "analysis/reductions.hpp"
#include "generator/formula/suggest.hpp"
#include "generator/mechanics/start.hpp"
#include "generator/pipeline.hpp"
#include "library/parts.hpp"

namespace lobatto::api {

namespace {

constexpr int departed = 7, unresolved = 8;
const char* const words[] = {"reached the end",
                             "not converged",
                             "not finite",
                             "singular Jacobian",
                             "singular mass matrix",
                             "t + h equals t",
                             "not supported by the kernel",
                             "energy off: beyond stability, or past a singularity",
                             "not resolved: the error is as large as the motion",
                             "start off the constraints",
                             "a formula has no value there",
                             "stopped",
                             "impacts accumulate"};

// Where each column goes: into the parameters, the positions or the rates of a start.
class ColumnStarts {
public:
    ColumnStarts(const lobatto::Scene& scene, const Starts& starts) : scene_(scene) {
        if (scene.run.assemble)
            throw InputError(fmt::format(
                "{}: a sweep of the library takes starts as they are; leave assemble out, and give starts that keep "
                "the constraints",
                scene.path));
        for (const Parameter& parameter : scene.parameters)
            base_.parameters.push_back(scene.evaluate(parameter.value, "the parameter " + parameter.name).to_double());
        for (const auto& [name, values] : starts.columns) {
            if (values.size() != starts.count)
                throw InputError(fmt::format("the column '{}' has {} values for {} trajectories", name, values.size(),
                                             starts.count));
            place(name, values);
        }
        fill(base_.q, scene.initial_position, false);
        fill(base_.rate, scene.initial_rate, true);
    }

    void start(std::int64_t index, EnsembleStart& start) const {
        start = base_;
        for (const auto& [which, place, values] : columns_)
            (which == parameter  ? start.parameters
             : which == position ? start.q
                                 : start.rate)[place] = (*values)[static_cast<std::size_t>(index)];
        if (dependent_.empty()) return;
        const std::lock_guard lock(algebra());
        std::vector<GiNaC::ex> parameters;
        for (const double value : start.parameters) parameters.push_back(GiNaC::numeric(value));
        for (const auto& [is_rate, k] : dependent_) {
            double& number = (is_rate ? start.rate : start.q)[k];
            try {
                number = scene_.evaluate((is_rate ? scene_.initial_rate : scene_.initial_position)[k], "", parameters)
                             .to_double();
            } catch (const lobatto::InputError&) {  // a root of a negative number, for example
                number = std::numeric_limits<double>::quiet_NaN();
            }
        }
    }

private:
    enum Which { parameter, position, rate };
    struct Column {
        Which which;
        std::size_t place;
        const std::vector<double>* values;
    };

    void place(const std::string& name, const std::vector<double>& values) {
        std::vector<std::string> names;
        const auto is = [&](const std::string& candidate, Which which, std::size_t place) {
            names.push_back(candidate);
            if (candidate != name) return false;
            columns_.push_back({which, place, &values});
            return true;
        };
        for (std::size_t i = 0; i < scene_.parameters.size(); ++i)
            if (is(scene_.parameters[i].name, parameter, i)) return;
        for (std::size_t k = 0; k < scene_.coordinates.size(); ++k) {
            const std::string& coordinate = scene_.coordinates[k].name;
            const bool velocities = scene_.start == Start::velocity;
            if (is(coordinate, position, k) || is(velocities ? coordinate + "'" : "p_" + coordinate, rate, k)) return;
        }
        throw InputError(
            fmt::format("unknown column '{}'; what can vary: {}.{}", name, listing(names), suggestion(name, names)));
    }

    // What has no column: a number, or a formula that follows a parameter which has one.
    void fill(std::vector<double>& base, const std::vector<GiNaC::ex>& formulas, bool is_rate) {
        for (std::size_t k = 0; k < formulas.size(); ++k) {
            bool given = false, depends = false;
            for (const Column& column : columns_) {
                given = given || (column.place == k && column.which == (is_rate ? rate : position));
                depends =
                    depends || (column.which == parameter && formulas[k].has(scene_.parameters[column.place].symbol));
            }
            if (depends && !given) dependent_.emplace_back(is_rate, k);
            base.push_back(given || depends ? std::numeric_limits<double>::quiet_NaN()
                                            : scene_.evaluate(formulas[k], "a start").to_double());
        }
    }

    const lobatto::Scene& scene_;
    EnsembleStart base_;
    std::vector<Column> columns_;
    std::vector<std::pair<bool, std::size_t>> dependent_;
};

// The kernel of a sweep, and its request.
struct BegunSweep {
    lobatto::Scene scene;
    Derivation derivation;
    KernelSource source;
    std::optional<lobatto::Kernel> kernel;
    EnsembleRequest request;
};

BegunSweep begin_sweep(const Scene& scene, const Starts& starts, const SweepOptions& options) {
    BegunSweep begun;
    begun.scene = options.keep.empty() ? scene.parts().scene : read_scene(scene.parts().scene.source, options.keep);
    begun.scene.outputs.watch_kept();
    method_of(options).apply(begun.scene);
    MethodChoice::require_double(begun.scene, "sweep");
    if (options.every) throw InputError("every: a sweep of the library keeps the last state; leave it out");
    const lobatto::Scene as_written = begun.scene;  // one kernel serves all values
    begun.scene.outputs.dense = 0;
    apply(overrides_of(options), begun.scene);
    begun.derivation = derive(as_written);
    Outputs& outputs = begun.derivation.scene.outputs;
    if (EnergyWatch::can_watch(begun.derivation) || !begun.scene.outputs.kept.empty()) outputs.energy = true;
    begun.source = lobatto::emit(begun.derivation);

    const Steps steps = steps_of(begun.scene, overrides_of(options));
    EnsembleRequest& request = begun.request;
    request.count = static_cast<std::int64_t>(starts.count);
    request.from_velocities = begun.scene.start == Start::velocity;
    request.step = begun.scene.evaluate(begun.scene.run.step, "the step").to_double();
    request.steps = steps.count;
    request.tolerance = begun.scene.method.tolerance;
    request.arrivals = arrivals_of(begun.scene, steps.count);
    request.arrivals.keeps_chain = false;
    request.every = options.measure && steps.count > 0 ? (steps.count + 60) / 61 : 0;  // to compare companions
    request.threads = options.threads;
    request.stops = !begun.scene.run.stops.empty();
    const bool is_alone = !begun.scene.outputs.kept.empty() || request.stops || begun.scene.is_cut();
    const std::int64_t together = begun.scene.coordinates.size() > 2 ? std::min<std::int64_t>(request.count, 8)
                                                                     : request.count / thread_count(options.threads);
    begun.kernel = is_alone ? kernel_of(begun.source, Precision::double_)
                            : ensemble_kernel_of(begun.source, Precision::double_, together);
    return begun;
}

void keep(Sweep& sweep, const BegunSweep& begun, const EnsembleTrajectory& trajectory, int status) {
    const Records& kept = trajectory.kept;
    const double* const row = kept.rows + (kept.count - 1) * kept.columns;
    const auto n = static_cast<std::ptrdiff_t>(sweep.coordinates.size());
    sweep.status.push_back(status);
    sweep.steps.push_back(trajectory.steps_done);
    const auto first = static_cast<int>(begun.scene.outputs.events.size()) - 1;
    sweep.stop.push_back(trajectory.stop >= 0 ? trajectory.stop - first : 0);
    sweep.t.push_back(row[0]);
    sweep.q.insert(sweep.q.end(), row + 1, row + 1 + n);
    sweep.p.insert(sweep.p.end(), row + 1 + n, row + 1 + 2 * n);
    sweep.energy_error.push_back(kept.energy != nullptr ? kept.energy[kept.count - 1] - trajectory.energy_start
                                                        : std::nan(""));
    for (std::size_t k = 0; k < sweep.kept_names.size(); ++k)
        sweep.kept.push_back(trajectory.reduced != nullptr && k < trajectory.reduced->size() ? (*trajectory.reduced)[k]
                                                                                             : std::nan(""));
    ++sweep.count;
}

}  // namespace

Sweep sweep(const Scene& scene, const Starts& starts, const SweepOptions& options) {
    return guarded([&] {
        BegunSweep begun = in_algebra([&] { return begin_sweep(scene, starts, options); });
        EnsembleRequest& request = begun.request;
        Sweep sweep;
        std::optional<ColumnStarts> columns;
        std::optional<SweepWatch> watch;
        std::optional<EnsembleCompanion> companion;
        in_algebra([&] {
            sweep.coordinates = coordinates_of(begun.scene);
            columns.emplace(begun.scene, starts);
            request.start = [&](std::int64_t index, EnsembleStart& start) { columns->start(index, start); };
            watch.emplace(begun.derivation, begun.source, *begun.kernel, request);
            if (options.measure) companion.emplace(begun.derivation, *begun.kernel, request);
        });
        for (const Reduction& kept : begun.scene.outputs.kept) sweep.kept_names.push_back(kept.text);
        sweep.statuses.assign(std::begin(words), std::end(words));
        if (!begun.scene.outputs.kept.empty())
            request.reducer = [&] {
                const std::lock_guard lock(algebra());
                return std::make_unique<Reductions>(begun.scene);
            };
        volatile int is_interrupted = 0;
        request.interrupted = &is_interrupted;
        if (options.progress)
            request.progress = [&](std::int64_t done) {
                const double all = static_cast<double>(request.count) * static_cast<double>(request.steps);
                if (!options.progress(static_cast<double>(done) / all)) is_interrupted = 1;
            };
        request.sink = [&](const EnsembleTrajectory& trajectory) {
            int status = trajectory.status;
            double error = std::nan("");
            if (status == LOBATTO_OK) {
                if (watch->departs(trajectory)) status = departed;
                if (companion) {
                    const EnsembleCompanion::Error measured = companion->of(trajectory);
                    error = measured.relative;
                    if (measured.lost && status == LOBATTO_OK) status = unresolved;
                }
            }
            if (companion) sweep.error.push_back(error);
            keep(sweep, begun, trajectory, status);
        };
        sweep.interrupted = integrate(*begun.kernel, request).interrupted;
        return sweep;
    });
}

}  // namespace lobatto::api
