// SPDX-License-Identifier: GPL-2.0-or-later
#include "analysis/accuracy/formulas/jumps.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <random>

#include "analysis/tape.hpp"

namespace lobatto {

namespace {

constexpr int tried_places = 8;             // of each switch, at random
constexpr double notable = 1e-4;            // of the pieces: constants that people round jump by less
constexpr std::size_t most_switches = 256;  // switches that are looked at

class Jumps {
public:
    Jumps(const Scene& scene, const std::vector<double>& parameters) : scene_(scene), parameters_(parameters.size()) {
        for (const Parameter& parameter : scene.parameters) symbols_.push_back(parameter.symbol);
        for (const Coordinate& coordinate : scene.coordinates) symbols_.push_back(coordinate.position);
        for (const Coordinate& coordinate : scene.coordinates) symbols_.push_back(coordinate.velocity);
        symbols_.push_back(scene.time);
        variables_ = parameters;
        variables_.resize(symbols_.size());
        sizes_.assign(symbols_.size(), 1);
        const std::size_t n = scene.coordinates.size();
        for (std::size_t k = 0; k < n; ++k) {
            const double q = size_of(scene.initial_position[k]),
                         v = scene.start == Start::velocity ? size_of(scene.initial_rate[k]) : 0;
            // A large position says nothing of velocities: the origin may be far away.
            sizes_[parameters_ + k] = std::fmax(q, v) > 0 ? std::fmax(q, v) : 1;
            sizes_[parameters_ + n + k] = v > 0 ? v : sizes_[parameters_ + k];
        }
    }

    // The median jump of a formula where u = 0, and the size of the pieces; nothing where that is not known.
    std::optional<std::pair<double, double>> of(const Switch& one, const GiNaC::ex& formula) {
        const auto piece = [&](int side) {
            return Tape::of(scene_.along_motion(formula.subs(one.side == side)), symbols_);
        };
        const std::optional<Tape> above = piece(1), below = piece(-1),
                                  u = Tape::of(scene_.along_motion(one.value), symbols_);
        std::size_t k = 0;
        const std::optional<Tape> slope = slope_of(one, k);
        if (!above || !below || !u || !slope) return std::nullopt;
        std::vector<std::pair<double, double>> found;
        for (int place = 0; place < tried_places; ++place) {
            for (std::size_t i = parameters_; i < variables_.size(); ++i) variables_[i] = sizes_[i] * random();
            // Pieces may be small where they meet: as large as anywhere.
            const double elsewhere = std::fmax(std::fabs((*above)(variables_)), std::fabs((*below)(variables_)));
            const double rate = (*slope)(variables_);
            variables_[k] -= (*u)(variables_) / rate;
            const double a = (*above)(variables_), b = (*below)(variables_), jump = std::fabs(a - b);
            const double size = std::fmax(std::fabs(a), std::fabs(b));
            if (std::isfinite(jump))
                found.emplace_back(jump, std::isfinite(elsewhere) ? std::fmax(size, elsewhere) : size);
        }
        if (found.size() < tried_places / 2) return std::nullopt;
        std::sort(found.begin(), found.end());
        return found[found.size() / 2];
    }

private:
    // du/dv of the first velocity in which u is linear: number k.
    std::optional<Tape> slope_of(const Switch& one, std::size_t& k) const {
        for (k = parameters_ + scene_.coordinates.size(); k + 1 < symbols_.size(); ++k) {
            const GiNaC::ex slope = one.value.diff(symbols_[k]);
            if (!slope.is_zero() && !slope.has(symbols_[k])) return Tape::of(scene_.along_motion(slope), symbols_);
        }
        return std::nullopt;
    }
    double size_of(const GiNaC::ex& start) const { return std::fabs(scene_.evaluate(start, "the start").to_double()); }
    double random() { return 2 * static_cast<double>(generator_() >> 11) * 0x1p-53 - 1; }

    const Scene& scene_;
    std::size_t parameters_;
    std::vector<GiNaC::symbol> symbols_;
    std::vector<double> variables_, sizes_;  // sizes: those of the start, in the unit of each
    std::mt19937_64 generator_{1};
};

}  // namespace

std::vector<std::string> jumps_of(const Scene& scene, const std::vector<double>& parameters) {
    std::vector<std::string> sentences;
    Jumps jumps(scene, parameters);
    for (std::size_t i = 0; i < std::min(scene.switches.size(), most_switches); ++i) {
        const Switch& one = scene.switches[i];
        if (!scene.lagrangian.has(one.side)) continue;
        const auto look_at = [&](const GiNaC::ex& formula, const std::string& what) {
            const auto jump = jumps.of(one, formula);
            if (!jump || !(jump->first > notable * jump->second)) return false;
            sentences.push_back(fmt::format(
                "{} jumps, by about {:.2g}, where {} (line {} column {}) goes from one piece to the other at some "
                "velocity. No motion follows that: write the pieces so that they, and their derivatives by the "
                "velocity, have one value there",
                what, jump->first, one.text, one.at.line, one.at.column));
            return true;
        };
        bool is_told = look_at(scene.lagrangian, "the Lagrangian");
        for (const Coordinate& x : scene.coordinates)
            is_told = is_told || (one.value.has(x.velocity) &&
                                  look_at(scene.lagrangian.diff(x.velocity), "the momentum of " + x.written));
    }
    return sentences;
}

}  // namespace lobatto
