// SPDX-License-Identifier: GPL-2.0-or-later
#include "cli/view/motion.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <set>

#include "analysis/motion.hpp"
#include "analysis/tape.hpp"
#include "cli/print/interruption.hpp"
#include "cli/view/figures.hpp"
#include "generator/formula/text/source.hpp"
#include "library/opened_run.hpp"

namespace lobatto {

namespace {

constexpr std::size_t wanted_frames = 4000;  // at least, where steps can be filled
constexpr int most_dense = 100;
constexpr double rests = 1e-9;  // relative: what moves by less
constexpr std::size_t most_plotted = 6, most_events = 2000;
const char* const kind_names[] = {"point", "line", "spring", "circle"};

// The states of a run; long ones keep every second when there are too many, again and again. States between two steps
// are less accurate than those at steps, so they are given the energy of the step before.
class ShownStates {
public:
    ShownStates(std::size_t columns, std::size_t most, int dense)
        : columns_(columns), most_(std::max<std::size_t>(most, 16)), rows_a_step_(1 + dense) {}

    void add(const Records& records) {
        for (std::int64_t i = 0; i < records.count; ++i, ++seen_) {
            const double* const row = records.rows + i * records.columns;
            last_.assign(row, row + columns_);
            if (seen_ % rows_a_step_ == 0) energy_ = records.energy != nullptr ? records.energy[i] : std::nan("");
            last_.push_back(energy_);
            if (seen_ % every_ != 0) continue;
            rows_.insert(rows_.end(), last_.begin(), last_.end());
            if (count() >= 2 * most_) halve();
        }
    }
    void finish() {
        if (!last_.empty() && row(count() - 1)[0] != last_[0]) rows_.insert(rows_.end(), last_.begin(), last_.end());
        while (count() > most_ + 1) halve();
    }
    std::size_t count() const { return rows_.size() / (columns_ + 1); }
    std::int64_t every() const { return every_; }  // one state in so many is shown
    // t, q, p, H.
    const double* row(std::size_t i) const { return rows_.data() + i * (columns_ + 1); }

private:
    void halve() {
        const std::size_t width = columns_ + 1, last = count() - 1;
        std::size_t kept = 0;
        for (std::size_t i = 0; i <= last; i += 2, ++kept)
            std::copy_n(rows_.begin() + static_cast<std::ptrdiff_t>(i * width), width,
                        rows_.begin() + static_cast<std::ptrdiff_t>(kept * width));
        rows_.resize(kept * width);
        every_ *= 2;
    }

    std::size_t columns_, most_;
    std::int64_t rows_a_step_, seen_ = 0, every_ = 1;
    double energy_ = 0;  // of the last step
    std::vector<double> rows_, last_;
};

// Formulas become channels, each once.
class Channels {
public:
    Channels(const Scene& scene, std::vector<GiNaC::symbol> variables)
        : scene_(scene), variables_(std::move(variables)) {}

    std::size_t of(const GiNaC::ex& formula) {
        for (std::size_t i = 0; i < formulas_.size(); ++i)
            if (formulas_[i].is_equal(formula)) return i;
        const std::optional<Tape> tape = Tape::of(scene_.along_motion(formula), variables_);
        if (!tape) throw InputError(scene_.path + ": a formula of [view] holds a function that pictures do not know");
        formulas_.push_back(formula);
        tapes_.push_back(*tape);
        return formulas_.size() - 1;
    }
    std::size_t count() const { return tapes_.size(); }
    // Room for each frame; what is no number there is drawn as it was before.
    std::vector<ViewChannel> values(const std::vector<std::vector<double>>& frames) const {
        std::vector<ViewChannel> channels(tapes_.size());
        for (std::size_t c = 0; c < tapes_.size(); ++c)
            for (const std::vector<double>& frame : frames) {
                const double value = tapes_[c](frame);
                channels[c].push_back(std::isfinite(value) ? value : channels[c].empty() ? 0 : channels[c].back());
            }
        return channels;
    }

private:
    const Scene& scene_;
    std::vector<GiNaC::symbol> variables_;
    std::vector<GiNaC::ex> formulas_;
    std::vector<Tape> tapes_;
};

std::string with_unit(const std::string& name, const std::string& unit) {
    return unit.empty() ? name : fmt::format("{} ({})", name, unit);
}

// The symbols that formulas of [view] may hold, in the order of a frame: parameters, t, q, velocities, p, H,
// H - H(0).
std::vector<GiNaC::symbol> variables_of(Scene& scene, const GiNaC::symbol& energy_change) {
    std::vector<GiNaC::symbol> variables;
    for (const Parameter& parameter : scene.parameters) variables.push_back(parameter.symbol);
    variables.push_back(scene.time);
    for (const Coordinate& coordinate : scene.coordinates) variables.push_back(coordinate.position);
    for (const Coordinate& coordinate : scene.coordinates) variables.push_back(coordinate.velocity);
    while (scene.outputs.momenta_of_kept.size() < scene.coordinates.size())
        scene.outputs.momenta_of_kept.emplace_back("p_" + scene.coordinates[scene.outputs.momenta_of_kept.size()].name);
    for (const GiNaC::symbol& momentum : scene.outputs.momenta_of_kept) variables.push_back(momentum);
    variables.push_back(scene.outputs.energy_of_kept);
    variables.push_back(energy_change);
    return variables;
}

std::vector<ViewFigure> figures_in(const std::vector<DrawnFigure>& figures, Channels& channels) {
    std::vector<ViewFigure> all;
    for (const DrawnFigure& drawn : figures) {
        ViewFigure figure;
        figure.kind = kind_names[static_cast<int>(drawn.figure.kind)];
        for (const auto& corner : drawn.figure.corners) {
            figure.places.emplace_back();
            for (const GiNaC::ex& component : corner) figure.places.back().push_back(channels.of(component));
        }
        figure.colour = drawn.colour;
        figure.trail = drawn.figure.trail;
        figure.closed = drawn.figure.closed;
        figure.still = drawn.still;
        figure.many = drawn.many;
        if (drawn.figure.kind == MovingFigure::Kind::circle) figure.radius = channels.of(drawn.figure.radius);
        all.push_back(figure);
    }
    return all;
}

// The curves that [view] names, or the first coordinates, those of one unit together; a phase portrait.
void add_curves(Viewed& viewed, const Scene& scene, Channels& channels) {
    ViewMotion& motion = viewed.motion;
    std::map<std::string, ViewChart> by_unit;
    std::vector<std::string> order;
    const auto curve = [&](const std::string& name, const std::string& label, const GiNaC::ex& formula) {
        motion.curves.push_back({name, label, channels.of(formula)});
    };
    if (scene.plots.empty()) {
        const std::size_t moving = scene.coordinates.size() - (scene.has_time_coordinate() ? 1 : 0);
        for (std::size_t k = 0; k < std::min(moving, most_plotted); ++k) {
            const Coordinate& coordinate = scene.coordinates[k];
            curve(coordinate.name, with_unit(coordinate.written, coordinate.unit), coordinate.position);
            if (by_unit.count(coordinate.unit) == 0) order.push_back(coordinate.unit);
            by_unit[coordinate.unit].curves.push_back(coordinate.name);
        }
        for (const std::string& unit : order) viewed.charts.push_back(by_unit[unit]);
    }
    for (const Plot& plot : scene.plots) {
        curve(plot.text, plot.text, plot.value);
        viewed.charts.push_back({"", {plot.text}});
    }
    const Coordinate& first = scene.coordinates.front();
    // No coordinate and no formula has a name like these.
    const std::string name = "phase portrait:";
    motion.curves.push_back({name, fmt::format("p_{0} over {0}", first.name),
                             channels.of(scene.outputs.momenta_of_kept.front()), false, channels.of(first.position)});
    viewed.charts.push_back({"phase portrait", {name}, true});
}

// `change`: of motions that conserve it.
void add_energy(Viewed& viewed, const Scene& scene, Channels& channels, const std::optional<GiNaC::ex>& change) {
    const std::string name = "energy:";
    viewed.motion.curves.push_back(
        {name, change ? "H - H(0)" : "H", channels.of(change.value_or(scene.outputs.energy_of_kept))});
    viewed.charts.push_back({change ? "energy error" : "energy", {name}});
}

// What a run keeps so that it looks smooth: states between steps, or arrivals of a clock.
void fill_steps(Scene& scene, std::size_t most_frames) {
    const std::size_t wanted = std::min(wanted_frames, most_frames);
    Outputs outputs = scene.outputs;
    outputs.every = 1;
    outputs.dense = 0;
    outputs.tangent = outputs.multipliers = false;
    if (scene.clock) {
        outputs.interval = scene.run.until / GiNaC::numeric(static_cast<long>(wanted));
    } else if (!scene.is_cut() && scene.method.family != Family::splitting && scene.run.stops.empty()) {
        const double step = scene.evaluate(scene.run.step, "the step").to_double();
        if (!(step > 0)) return;  // the run says it
        const double steps = scene.evaluate(scene.run.until, "the end time").to_double() / step;
        const double between = std::ceil(static_cast<double>(wanted) / std::max(steps, 1.0)) - 1;
        outputs.dense = static_cast<int>(std::clamp(between, 0.0, static_cast<double>(most_dense)));
    }
    scene.outputs = outputs;
}

std::vector<std::vector<double>> frames_of(const ShownStates& states, const LoadedStepper<double>& stepper,
                                           const TrajectoryRequest& request) {
    const std::size_t n = request.q.size();
    const double energy_start = states.row(0)[1 + 2 * n];
    std::vector<std::vector<double>> frames;
    for (std::size_t i = 0; i < states.count(); ++i) {
        const double* const row = states.row(i);
        const std::vector<double> q(row + 1, row + 1 + n), p(row + 1 + n, row + 1 + 2 * n);
        std::vector<double> frame = request.parameters, velocity(n);
        if (stepper.velocity(row[0], q, p, velocity) != LOBATTO_OK) velocity.assign(n, std::nan(""));
        frame.push_back(row[0]);
        for (const auto& part : {q, velocity, p}) frame.insert(frame.end(), part.begin(), part.end());
        frame.push_back(row[1 + 2 * n]);
        frame.push_back(row[1 + 2 * n] - energy_start);
        frames.push_back(frame);
    }
    return frames;
}

// Of a motion that fails, how many frames to show: else it is a dot in a picture as wide as where it was thrown.
std::size_t frames_before_blow_up(const std::vector<std::vector<double>>& frames, const TrajectoryRequest& request) {
    std::vector<double> farthest;
    const auto first = static_cast<std::ptrdiff_t>(request.parameters.size()) + 1;
    for (const std::vector<double>& frame : frames) {
        farthest.push_back(0);
        for (auto q = frame.begin() + first; q != frame.begin() + first + std::ssize(request.q); ++q)
            farthest.back() = std::fmax(farthest.back(), std::fabs(*q));
    }
    const double sane = *std::max_element(farthest.begin(), farthest.begin() + (std::ssize(farthest) + 3) / 4);
    const auto beyond = [&](double far) { return !(far <= 1e5 * sane); };
    const auto count = std::find_if(farthest.begin(), farthest.end(), beyond) - farthest.begin();
    return sane > 0 && std::isfinite(sane) && count >= 2 ? static_cast<std::size_t>(count) : frames.size();
}

// Whether so few states are shown that what is seen is another motion: between two of them the mean velocity does not
// lead from one position to the next, or an angle goes most of half a turn. `frames`: parameters, t, q, velocities, ...
bool is_too_fast(const Scene& scene, const std::vector<std::vector<double>>& frames) {
    const std::size_t n = scene.coordinates.size(), first = scene.parameters.size() + 1;
    for (std::size_t k = 0; k < n; ++k) {
        double low = std::numeric_limits<double>::infinity(), high = -low, missed = 0, turned = 0;
        for (std::size_t i = 0; i < frames.size(); ++i) {
            const double q = frames[i][first + k], v = frames[i][first + n + k];
            low = std::min(low, q);
            high = std::max(high, q);
            if (i == 0) continue;
            const std::vector<double>& before = frames[i - 1];
            const double way = (frames[i][first - 1] - before[first - 1]) * (before[first + n + k] + v) / 2;
            missed += std::fabs(q - before[first + k] - way);
            turned += std::fabs(way);
        }
        const double steps = static_cast<double>(frames.size() - 1), place = std::fmax(std::fabs(low), std::fabs(high));
        if (high - low <= rests * place && turned <= rests * place * steps) continue;
        if (missed / steps > 0.25 * (high - low) / 2) return true;
        if (scene.coordinates[k].unit == "rad" && turned / steps > 2) return true;
    }
    return false;
}

}  // namespace

Viewed viewed_motion(const api::Scene& written, const api::Settings& settings, bool is_alone, std::size_t most_numbers,
                     const std::function<void(std::int64_t, std::int64_t)>& progress) {
    Viewed viewed;
    Scene kept = api::with_method(written, settings);
    Scene scene = kept;
    MethodChoice::require_double(scene, "view");
    apply(api::overrides_of(settings), scene);
    viewed.title = scene.title.empty() ? scene.name : scene.title;
    const GiNaC::symbol energy_change;
    Channels channels(scene, variables_of(scene, energy_change));
    scene.outputs.energy = true;
    const std::vector<DrawnFigure> figures = figures_of(scene);
    viewed.motion.figures = figures_in(figures, channels);
    viewed.motion.is_profile = figures.front().profile;
    add_curves(viewed, scene, channels);
    const std::size_t with_energy = channels.count() + 1,
                      most_frames = std::clamp<std::size_t>(most_numbers / with_energy, 64, 36000);
    fill_steps(scene, most_frames);

    kept.outputs = scene.outputs;
    api::RunOptions values;
    values.set = settings.set;
    values.step = settings.step;
    values.until = settings.until;
    api::OpenedRun run(api::scene_of(kept), values);
    add_energy(viewed, scene, channels,
               run.prepared().outline.conserves_energy() ? std::optional<GiNaC::ex>(energy_change) : std::nullopt);
    ShownStates states(1 + 2 * run.request().q.size(), most_frames, scene.outputs.dense);
    api::OpenedRun::Listeners listeners;
    listeners.states = [&](const Records& records) { states.add(records); };
    listeners.events = [&](const EventRecords& events) {
        for (std::int64_t i = 0; i < events.count && viewed.motion.events.size() < most_events; ++i) {
            const double* const row = events.rows + i * events.columns;
            if (row[0] < static_cast<double>(scene.reported().size()))
                viewed.motion.events.push_back({row[1], static_cast<int>(row[0])});
        }
    };
    const Interruption interruption;
    listeners.interrupted = interruption.flag();
    listeners.progress = [&](std::int64_t done) { progress(done, run.request().steps); };
    const TrajectoryResult& result = run.go(listeners);
    viewed.is_interrupted = result.interrupted;
    states.finish();
    if (const std::string failure = run.verdict().failure; !failure.empty())
        viewed.failure = (result.status != LOBATTO_OK ? "the motion on the page ends early: "
                                                      : "the motion on the page is wrong: ") +
                         failure;

    const std::string method = scene.method.name();
    const TrajectoryRequest& request = run.request();
    LoadedStepper<double> stepper(run.prepared().plain);
    if (stepper.prepare(request.parameters, request.step) == LOBATTO_OK)
        stepper.start(request.time, request.q, request.p);
    ViewMotion& motion = viewed.motion;
    motion.label = is_alone ? viewed.title : method;
    motion.note = fmt::format("{}h = {:.4g}{}{}", motion.label == method ? "" : method + ", ", request.step,
                              scene.clock ? " in the time of a clock" : "",
                              states.every() > 1 ? fmt::format(", one state in {}", states.every()) : "");
    std::vector<std::vector<double>> frames = frames_of(states, stepper, request);
    if (!viewed.failure.empty()) frames.resize(frames_before_blow_up(frames, request));
    if (frames.size() < states.count()) {
        const double end = states.row(frames.size() - 1)[0];
        std::erase_if(motion.events, [&](const ViewEvent& event) { return event.time > end; });
        viewed.failure += fmt::format(" The page ends at t = {:.6g}, before the motion blows up.", end);
    }
    for (std::size_t i = 0; i < frames.size(); ++i) motion.times.push_back(states.row(i)[0]);
    motion.channels = channels.values(frames);
    if (viewed.failure.empty() && states.every() > 1 && is_too_fast(scene, frames))
        viewed.failure = fmt::format(
            "the page has room for one state in {}, and between two of them the motion goes too far: what moves there "
            "looks like another motion. Try an earlier end, such as --until {:.4g}",
            states.every(), 0.999 * motion.times.back() / static_cast<double>(states.every()));
    for (const Event& event : scene.reported()) motion.event_names.push_back(event.text);
    return viewed;
}

}  // namespace lobatto
