// SPDX-License-Identifier: GPL-2.0-or-later
#include "analysis/sweep/study.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "analysis/accuracy/companion/companion.hpp"
#include "analysis/accuracy/watch/energy_watch.hpp"
#include "analysis/exact_start.hpp"
#include "analysis/kernel/derived_kernel.hpp"
#include "analysis/kernel/device_kernel.hpp"
#include "analysis/reductions.hpp"
#include "analysis/sweep/pace.hpp"
#include "generator/mechanics/clock/clock.hpp"
#include "generator/mechanics/start.hpp"
#include "runtime/error.hpp"
#include "runtime/run/output.hpp"

namespace lobatto {

namespace {

// The first prime number from here on: a motion with so many steps in its period, or a part of them, is rare.
std::int64_t prime_from(std::int64_t number) {
    const auto is_prime = [](std::int64_t candidate) {
        for (std::int64_t factor = 2; factor <= candidate / factor; ++factor)
            if (candidate % factor == 0) return false;
        return true;
    };
    while (!is_prime(number)) ++number;
    return number;
}

// After how many steps a state is kept: as often as the user asks for, and about 61 times in all if companions are
// compared, fewer in short motions that are driven. With a clock the steps are arrivals.
std::int64_t looked_at(std::int64_t every, std::int64_t steps, bool measures, bool is_driven) {
    constexpr std::int64_t comparisons = 61, most_tried = 1000;  // no part of times that one writes
    const std::int64_t fewest = is_driven ? fewest_driven_steps : 1;
    if (!measures || steps == 0) return every;
    if (every == 0 || every > steps) {
        const std::int64_t least = std::max(fewest, (steps + comparisons - 1) / comparisons);
        return least == 1 ? 1 : prime_from(least);
    }
    const std::int64_t wanted = std::min(comparisons * every / steps, every / fewest);
    for (std::int64_t parts = std::max<std::int64_t>(1, wanted); parts <= std::min(every, wanted + most_tried); ++parts)
        if (every % parts == 0) return every / parts;
    return every;
}

// Whether trajectories of these numbers go side by side in vector registers.
bool has_ensembles(Precision numbers) {
    return numbers == Precision::double_ || numbers == Precision::single;
}

// Clocks, and what is kept of a trajectory, are computed in double.
void check_numbers(const Scene& scene) {
    if (scene.method.numbers == Precision::double_) return;
    const std::string numbers = ", but numbers are \"" + precision_name(scene.method.numbers) + "\"";
    if (scene.clock)
        fail_at_clock(scene, "with a clock `lobatto sweep` computes in double" + numbers +
                                 "; remove the clock, or give --numbers double");
    if (!scene.outputs.kept.empty())
        throw InputError(
            fmt::format("{}: what sweeps keep of a trajectory is computed in double{}; leave out --keep and `keep`, or "
                        "give --numbers double",
                        scene.path, numbers));
}

}  // namespace

void StudyTimes::add(const StudyTimes& more) {
    interrupted = interrupted || more.interrupted;
    trajectories += more.trajectories;
    steps_done += more.steps_done;
    processor_seconds += more.processor_seconds;
    seconds += more.seconds;
    threads = std::max(threads, more.threads);
    lanes = std::max(lanes, more.lanes);
}

SweepStudy::SweepStudy(Scene scene, const StartsRequest& starts, const StudyOptions& options,
                       std::recursive_mutex& algebra)
    : as_written_(std::move(scene)), options_(options), algebra_(algebra) {
    if (!as_written_.outputs.kept.empty() && options.overrides.every)
        throw InputError("--every: what is kept of a trajectory is one row; leave out --every, or --keep");
    check_numbers(as_written_);
    as_written_.outputs.watch_kept();
    scene_ = as_written_;  // one kernel serves all values
    scene_.outputs.dense = 0;
    apply(options.overrides, scene_);
    if (options.steps && scene_.clock)
        throw InputError(
            "--steps: with a clock the number of steps is not known in advance; give the end time with --until");
    if (options.steps && *options.steps < 0)
        throw InputError(fmt::format("--steps: {} is not a number of steps", *options.steps));
    starts_ = std::make_unique<SweepStarts>(scene_, starts, algebra_);
    count_steps();
    rows_ = std::make_unique<SweepRows>(scene_, *starts_, kept_by_sweeps(options.overrides, scene_), options.measures);
    first_ = prepare(0);
    if (options_.device != StudyDevice::cuda) return;
    if (const std::string obstacle = why_not_on_device(scene_); !obstacle.empty())
        throw InputError(fmt::format("{}: --device cuda: {}; compute with --device cpu", scene_.path, obstacle));
    device_ = CudaDevice::open();
    put_on_device(*first_);
}

void SweepStudy::count_steps() {
    double first_end = 0, last_end = 0;
    for (std::int64_t number = 0; number < starts_->settings(); ++number) {
        Scene of_setting = starts_->with_settings(scene_, number * starts_->count_of_setting());
        steps_.push_back(steps_of_setting(of_setting).count);
        const double end = static_cast<double>(steps_.back()) * step_of(of_setting, options_.overrides).to_double();
        first_end = number == 0 ? end : std::fmin(first_end, end);
        last_end = number == 0 ? end : std::fmax(last_end, end);
    }
    if (!options_.steps && *std::max_element(steps_.begin(), steps_.end()) == 0)
        steps_of_run(starts_->with_settings(scene_, 0), options_.overrides);
    constexpr double rounding = 1e-9;
    if (!scene_.clock && !options_.steps && !scene_.may_end_early() && last_end - first_end > rounding * last_end)
        warnings_.push_back(
            fmt::format("the end time is not a multiple of every step: trajectories end at the last multiple before "
                        "it, from t = {:.6g} to t = {:.6g}, so part of the differences comes from the end time",
                        first_end, last_end));
}

void SweepStudy::choose_device() {
    if (options_.device != StudyDevice::automatic || !why_not_on_device(scene_).empty() ||
        !is_long(*first_->kernel, first_->request, starts_->count()))
        return;
    try {
        if (!find_nvcc()) return;
        device_ = CudaDevice::open();
        put_on_device(*first_);
        if (is_faster_on_device(*first_->kernel, first_->request)) return;
    } catch (const MachineError&) {  // no driver, no device, a full one: then the processor
    } catch (const InputError&) {    // no lanes
    }
    device_ = nullptr;
    const std::lock_guard lock(algebra_);
    first_ = prepare(0);
}

void SweepStudy::put_on_device(Setting& setting) const {
    if (!device_) return;
    WatchedLanes watched;
    {
        const std::lock_guard lock(algebra_);
        watched.events = !scene_.watched().empty() && (setting.request.stops || setting.request.reducer);
        if (!scene_.outputs.kept.empty()) watched.kept = Reductions(scene_).text();
    }
    std::string compiled;
    setting.request.device =
        device_kernel_of(*setting.source, setting.scene.method.numbers, device_, &compiled, watched);
    setting.compiled += "+" + compiled;
}

Steps SweepStudy::steps_of_setting(Scene& scene) const {
    if (options_.steps) {
        step_of(scene, options_.overrides);
        scene.run.until = scene.run.step * GiNaC::numeric(static_cast<long>(*options_.steps));
    }
    return lobatto::steps_of(scene, options_.overrides);
}

// Of the parameters of one trajectory.
Overrides SweepStudy::values_of(std::int64_t index) const {
    EnsembleStart start;
    start.parameters.resize(scene_.parameters.size());
    start.q.resize(scene_.coordinates.size());
    start.rate.resize(scene_.coordinates.size());
    starts_->start(index, start);
    Overrides values;
    for (std::size_t k = 0; k < scene_.parameters.size(); ++k)
        if (!scene_.parameters[k].is_side)
            values.set.push_back(fmt::format("{}={}", scene_.parameters[k].written, start.parameters[k]));
    return values;
}

std::unique_ptr<SweepStudy::Setting> SweepStudy::prepare(std::int64_t number) {
    const std::int64_t first = number * starts_->count_of_setting();
    auto setting = std::make_unique<Setting>();
    setting->number = number;
    setting->scene = starts_->with_settings(scene_, first);
    setting->steps = steps_of_setting(setting->scene);
    const Method& method = setting->scene.method;
    const bool is_double = method.numbers == Precision::double_;
    Derived& known = derived_[{static_cast<int>(method.family), method.points}];
    if (!known.outline) {
        if (number == 0 && !options_.overrides.set.empty()) check_values(scene_);
        // Steps and values are the kernel's arguments: the scene is derived as it was written.
        Scene scene = starts_->with_settings(as_written_, first);
        if (!scene_.outputs.kept.empty()) scene.outputs.energy = true;
        const auto derived_in = [&](Precision numbers, const Derivation* derivation) {
            return derived_kernel(scene, {numbers, Shortcuts::all, EnergyWatch::can_watch}, derivation,
                                  with_values(scene, values_of(first)));
        };
        DerivedKernel derived = derived_in(method.numbers, nullptr);
        known.source = std::make_shared<const KernelSource>(std::move(derived.source));
        known.plain =
            is_double
                ? known.source
                : std::make_shared<const KernelSource>(derived_in(Precision::double_, derived.derivation.get()).source);
        known.outline = std::make_shared<const Outline>(std::move(derived.outline));
    }
    setting->outline = known.outline;
    setting->source = known.source;
    setting->plain_source = known.plain;
    // With more than two coordinates one register of each value is enough for all threads (ensemble_lanes), so that no
    // number of them changes what a trajectory becomes. Impacts are of single trajectories.
    const std::int64_t count = starts_->count_of_setting();
    const bool is_refilled = !scene_.outputs.kept.empty() || scene_.may_end_early();
    const std::int64_t together =
        scene_.coordinates.size() > 2 ? std::min<std::int64_t>(count, 8) : count / thread_count(options_.threads);
    Compiled compiled;
    const bool is_alone = scene_.is_cut() || !has_ensembles(method.numbers) || (is_refilled && !is_double);
    setting->kernel = is_alone ? kernel_of(*known.source, method.numbers, &compiled)
                               : ensemble_kernel_of(*known.source, method.numbers, together, &compiled, is_refilled);
    setting->plain = is_double ? setting->kernel : kernel_of(*known.plain, Precision::double_);
    setting->compiled = std::filesystem::path(compiled.object).stem().string();
    setting->request = request_of(*setting);
    put_on_device(*setting);
    return setting;
}

EnsembleRequest SweepStudy::request_of(const Setting& setting) const {
    const Scene& scene = setting.scene;
    EnsembleRequest request;
    request.first = setting.number * starts_->count_of_setting();
    request.count = starts_->count_of_setting();
    request.start = [this](std::int64_t index, EnsembleStart& start) { starts_->start(index, start); };
    request.from_velocities = scene.start == Start::velocity;
    const GiNaC::numeric step = scene.evaluate(scene.run.step, "the step");
    request.step = step.to_double();
    if ((*setting.kernel)->parts > 1)
        request.whole_step = parts_of({step}, static_cast<std::size_t>((*setting.kernel)->parts));
    request.steps = setting.steps.count;
    request.tolerance = scene.method.tolerance;
    request.arrivals = arrivals_of(scene, setting.steps.count);
    request.arrivals.keeps_chain = false;
    request.every = looked_at(kept_by_sweeps(options_.overrides, scene), setting.steps.count, options_.measures,
                              !scene.clock && !setting.outline->system.autonomous);
    request.threads = options_.threads;
    request.stops = scene.may_end_early();
    if (!scene.outputs.kept.empty()) {  // threads copy it: formulas are not for several at once
        ClockedSteps clocked;
        if (scene.clock)
            clocked = {clock_rate(starts_->with_settings(as_written_, request.first)), request.step, request.arrivals,
                       request.time};
        request.reducer = [reductions = std::make_shared<const Reductions>(scene, clocked)] {
            return std::make_unique<Reductions>(*reductions);
        };
    }
    return request;
}

void SweepStudy::enter(std::int64_t number) {
    if (current_ && current_->number == number) return;
    const std::lock_guard lock(algebra_);
    note_warnings();
    judges_.reset();
    current_ = prepare(number);
    const Setting& setting = *current_;
    judges_.emplace(setting.scene, *setting.outline, *setting.plain_source, *setting.plain, *setting.kernel,
                    setting.request, options_.measures, options_.beyond_horizon || scene_.run.beyond_horizon, algebra_);
}

StudyTimes SweepStudy::compute(std::int64_t first, std::int64_t last, const Sink& sink,
                               const std::function<void(std::int64_t)>& progress, const volatile int* interrupted) {
    StudyTimes times;
    std::int64_t steps_gone = 0;
    const std::int64_t of_setting = starts_->count_of_setting();
    while (first < last && !times.interrupted) {
        enter(first / of_setting);
        EnsembleRequest& request = current_->request;
        request.first = first;
        request.count = std::min(last, (first / of_setting + 1) * of_setting) - first;
        request.interrupted = interrupted;
        request.progress = nullptr;
        if (progress) request.progress = [&](std::int64_t done) { progress(steps_gone + done); };
        request.sink = [&](const EnsembleTrajectory& trajectory) {
            if (times.interrupted) return;  // what is handed on has no gaps
            const Verdict verdict = judges_->judge(trajectory);
            times.interrupted = verdict.interrupted;
            if (verdict.interrupted) return;
            if (verdict.status == LOBATTO_OK && trajectory.reduced != nullptr) count_missing(*trajectory.reduced);
            sink(trajectory, verdict, request);
        };
        const EnsembleResult result = integrate(*current_->kernel, request);
        steps_gone += request.count * request.steps;
        first += request.count;
        times.add({result.interrupted, result.trajectories, result.steps_done, result.processor_seconds, result.seconds,
                   result.threads, (*current_->kernel)->lanes == 0 && !device_ ? 0 : result.lanes});
    }
    return times;
}

// What is kept and has no value, as the root of what became negative. first() is no number where nothing was met.
void SweepStudy::count_missing(const std::vector<double>& kept) {
    const std::vector<Reduction>& asked = scene_.outputs.kept;
    missing_.resize(asked.size());
    for (std::size_t k = 0; k < std::min(asked.size(), kept.size()); ++k)
        if (asked[k].of != Reduction::Of::first && std::isnan(kept[k])) ++missing_[k];
}

void SweepStudy::note_warnings() {
    if (!judges_) return;
    if (const Judges::NotPositive& found = judges_->not_positive(); found.count > 0) {
        const std::string values = starts_->text_of(found.first, false);
        warnings_.push_back(fmt::format("trajectory {}{}: {}. That is allowed, but mostly a value that is not meant{}",
                                        found.first, values.empty() ? "" : ", " + values, found.complaint,
                                        found.count == 1   ? ""
                                        : found.count == 2 ? "; so it is in another one"
                                                           : fmt::format("; so it is in {} others", found.count - 1)));
    }
    const std::string warning = judges_->warning();
    if (warning.empty()) return;
    const std::string setting = starts_->text_of(current_->number * starts_->count_of_setting(), true);
    warnings_.push_back(setting.empty() ? warning : setting + ": " + warning);
}

std::vector<std::string> SweepStudy::end() {
    note_warnings();
    for (std::size_t k = 0; k < missing_.size(); ++k)
        if (missing_[k] > 0)
            warnings_.push_back(fmt::format("{} has no value in {} {} that reached the end, and is nan there",
                                            scene_.outputs.kept[k].text, missing_[k],
                                            missing_[k] == 1 ? "trajectory" : "trajectories"));
    judges_.reset();
    current_.reset();
    return std::exchange(warnings_, {});
}

double SweepStudy::steps_of(std::int64_t first, std::int64_t last) const {
    const std::int64_t of_setting = starts_->count_of_setting();
    double steps = 0;
    for (std::int64_t number = first / of_setting; number * of_setting < last; ++number) {
        const std::int64_t begin = std::max(first, number * of_setting),
                           end = std::min(last, (number + 1) * of_setting);
        steps += static_cast<double>(end - begin) * static_cast<double>(steps_[static_cast<std::size_t>(number)]);
    }
    return steps;
}

std::string SweepStudy::identity() const {
    std::string text = scene_.source.content() + '\n';
    for (const Reduction& kept : scene_.outputs.kept) text += "keep " + kept.text + '\n';
    for (const auto& [what, value] : starts_->sources()) text += what + ' ' + value + '\n';
    const Overrides& given = options_.overrides;
    for (const std::string& set : given.set) text += "set " + set + '\n';
    text += fmt::format("step {}\nuntil {}\nsteps {}\nevery {}\nmethod {}\ntolerance {}\nmeasured {}\nbeyond {}\n",
                        given.step, given.until, options_.steps.value_or(-1), given.every.value_or(0),
                        as_written_.method.name(), exact_text(as_written_.method.tolerance), options_.measures,
                        options_.beyond_horizon);
    if (as_written_.method.numbers != Precision::double_)
        text += "numbers " + precision_name(as_written_.method.numbers) + '\n';
    if (as_written_.clock) text += "clock " + as_written_.clock->text + '\n';
    return text;
}

}  // namespace lobatto
