// SPDX-License-Identifier: GPL-2.0-or-later
#include "analysis/accuracy/formulas/walls_together.hpp"

#include <fmt/format.h>

#include <cmath>
#include <numbers>
#include <numeric>

namespace lobatto {

namespace {

constexpr double touching = 0x1p-40;  // of what goes into the distance: zero
constexpr double right_angle = 1e-6;  // a cosine as small as this is zero

// A wedge of two walls that give all back, at an angle of pi over a whole number, sends a motion back alike whichever
// it meets first: it is one of the kaleidoscope's. `cosine`: of the angle between the slopes.
bool is_mirrored(double cosine) {
    const double parts = std::numbers::pi / std::acos(-cosine);
    return std::fabs(parts - std::round(parts)) < right_angle * parts;
}

double dot(const std::vector<double>& a, const std::vector<double>& b) {
    return std::inner_product(a.begin(), a.end(), b.begin(), 0.0);
}

}  // namespace

WallsTogether::WallsTogether(const Scene& scene, const LoadedStepper<double>& stepper, const TrajectoryRequest& request)
    : stepper_(stepper),
      parameters_(request.parameters),
      n_(scene.coordinates.size()),
      first_(scene.reported().size() - scene.impacts.size()),
      step_(std::fabs(request.step)) {
    if (scene.impacts.size() < 2) return;
    std::vector<GiNaC::symbol> symbols;
    for (const Parameter& parameter : scene.parameters) symbols.push_back(parameter.symbol);
    symbols.push_back(scene.time);
    for (const Coordinate& coordinate : scene.coordinates) symbols.push_back(coordinate.position);
    const Tape::Variables variables(symbols);
    std::vector<double> start = parameters_;
    start.push_back(request.time);
    start.insert(start.end(), request.q.begin(), request.q.begin() + std::ssize(scene.coordinates));
    const auto of_motion = symbols.begin() + std::ssize(scene.parameters);
    for (const Impact& impact : scene.impacts) {
        const GiNaC::ex g = scene.along_motion(impact.when.value);
        std::optional<Tape> value = Tape::of(g, variables), restitution = Tape::of(impact.restitution, variables);
        std::vector<Tape> slope;
        for (auto x = of_motion; value && x != symbols.end(); ++x)
            if (std::optional<Tape> by = Tape::of(g.diff(*x), variables)) slope.push_back(std::move(*by));
        if (!value || !restitution || slope.size() != 1 + n_) {
            walls_.clear();  // what cannot be looked at is not judged
            return;
        }
        const double distance = std::fabs((*value)(start));
        walls_.push_back({impact.written, impact.when.direction, std::move(*value), std::move(*restitution),
                          std::move(slope), distance, !impact.reset_position.empty()});
    }
}

bool WallsTogether::touches(Wall& wall, const std::vector<double>& variables,
                            const std::vector<double>& velocity) const {
    const double distance = std::fabs(wall.value(variables));
    const bool is_far = wall.farthest > 0 && distance > 1e-3 * wall.farthest;  // as most are
    wall.farthest = std::fmax(wall.farthest, distance);
    if (is_far) return false;
    const double* const motion = variables.data() + parameters_.size();
    double size = std::fabs(wall.slope[0](variables)) * std::fmax(std::fabs(motion[0]), step_);
    for (std::size_t k = 0; k < n_; ++k)
        size += std::fabs(wall.slope[1 + k](variables)) *
                std::fmax(std::fabs(motion[1 + k]), std::fabs(velocity[k]) * step_);
    return distance <= touching * size;
}

double WallsTogether::Push::rate_of(const std::vector<double>& velocity) const {
    return slope_t + dot(slope, velocity);
}

WallsTogether::Push WallsTogether::push_of(const Wall& wall, const std::vector<double>& variables, const double* row,
                                           const std::vector<double>& velocity) const {
    Push push{wall.slope[0](variables), 0, {}, {}};
    std::vector<double> p(row + 2 + n_, row + 2 + 2 * n_);
    for (std::size_t k = 0; k < n_; ++k) {
        push.slope.push_back(wall.slope[1 + k](variables));
        p[k] += push.slope[k];
    }
    if (stepper_.velocity(row[1], {row + 2, row + 2 + n_}, p, push.change) != LOBATTO_OK)
        push.change.assign(n_, std::nan(""));
    for (std::size_t k = 0; k < n_; ++k) push.change[k] -= velocity[k];
    push.rate = push.rate_of(velocity);
    return push;
}

// A row of an impact, with the state after it.
void WallsTogether::look_at(const double* row) {
    std::vector<double> variables = parameters_, velocity;
    variables.insert(variables.end(), row + 1, row + 2 + n_);
    if (stepper_.velocity(row[1], {row + 2, row + 2 + n_}, {row + 2 + n_, row + 2 + 2 * n_}, velocity) != LOBATTO_OK)
        return;
    const std::size_t met = static_cast<std::size_t>(row[0]) - first_;
    const double e = walls_[met].restitution(variables);
    if (walls_[met].is_reset || !(e > 0)) return;
    std::optional<Push> of_met;
    for (std::size_t w = 0; w < walls_.size(); ++w) {
        if (w == met || walls_[w].is_reset || !touches(walls_[w], variables, velocity)) continue;
        if (!of_met) of_met = push_of(walls_[met], variables, row, velocity);
        const Push other = push_of(walls_[w], variables, row, velocity);
        const double of_itself = dot(of_met->slope, of_met->change), both = dot(other.slope, of_met->change);
        const double cosine = both / std::sqrt(of_itself * dot(other.slope, other.change));
        if (std::fabs(cosine) <= right_angle || cosine >= 1 - right_angle) continue;  // or one wall written twice
        if (e == 1 && walls_[w].restitution(variables) == 1 && is_mirrored(cosine)) continue;
        // Before the impact the wall's rate was -1/e of this; one that was not on the way to the other wall then is
        // thrown there, as the balls of a cradle are one after another.
        const double impulse = of_met->rate * (1 + 1 / e) / of_itself, before = other.rate - both * impulse;
        if (before * walls_[w].direction <= right_angle * std::fabs(both * impulse)) continue;
        found_ = {row[1], static_cast<double>(met), static_cast<double>(w)};
        return;
    }
}

void WallsTogether::observe(const EventRecords& records) {
    for (std::int64_t i = 0; i < records.count && !walls_.empty() && found_.empty(); ++i)
        if (const double* const row = records.rows + i * records.columns; row[0] >= static_cast<double>(first_))
            look_at(row);
}

std::string WallsTogether::text() const {
    if (found_.empty()) return "";
    const auto name = [&](std::size_t i) { return walls_.at(static_cast<std::size_t>(found_[i])).name; };
    return fmt::format(
        "at t = {:.6g} the motion meets the walls {} and {} at one time. They act one after another, in the order of "
        "the scene, and another order may give another motion: what follows is not known better than that, whatever "
        "the measured error. Start elsewhere",
        found_[0], name(1), name(2));
}

}  // namespace lobatto
