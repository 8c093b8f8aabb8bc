// SPDX-License-Identifier: GPL-2.0-or-later
// A scene's equations about a state: its linear system, the equilibria, their frequencies.
#include "analysis/stability/linearisation.hpp"

#include <algorithm>
#include <cmath>
#include <complex>
#include <limits>
#include <numbers>
#include <numeric>

#include "analysis/wide.hpp"
#include "runtime/measure/linear_algebra.hpp"

namespace lobatto {

namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;
template <class Real>
using Matrix = Eigen::Matrix<Real, Eigen::Dynamic, Eigen::Dynamic>;

constexpr int most_turns = 64;       // of angles, in search of equilibria
constexpr int most_iterations = 60;  // from one start: those that end at an equilibrium took at most 12 in all scenes
constexpr int most_looks = 10;       // from 10 to 1e-8 away
constexpr int most_wide = 100;       // rows of matrices whose eigenvalues are computed to 60 digits
constexpr double double_rounding = 1e-13, noise_of_turning = 1e-7;  // relative: of double eigenvalues; of double roots

// A force known to vanish to 1e-45 of its terms may be that of a multiple root, 1e-22 or more away.
constexpr double position_rounding = 1e-20;
constexpr double multiple_rounding = 1e-12;  // where several equilibria meet: the iteration ends beside them

// Each entry divided by the units of its row and column.
template <class Real>
Matrix<Real> dense(const LinearSystem::Entries& entries, const VectorXd& units) {
    Matrix<Real> matrix = Matrix<Real>::Zero(units.size(), units.size());
    for (const auto& [place, entry] : entries) {
        Real& value = matrix(place.first, place.second);
        if constexpr (std::is_same_v<Real, double>)
            value = cln::double_approx(entry.value);
        else
            value = Wide(entry.value);
        value = value / units(place.first) / units(place.second);
    }
    return matrix;
}

Sized entry_of(const LinearSystem::Entries& entries, int row, int column) {
    const auto entry = entries.find({row, column});
    return entry == entries.end() ? Sized{0, 0} : entry->second;
}

bool is_symmetric(const LinearSystem::Entries& entries) {
    return std::all_of(entries.begin(), entries.end(), [&](const auto& entry) {
        return entry.second.equals(entry_of(entries, entry.first.second, entry.first.first));
    });
}

bool is_antisymmetric(const LinearSystem::Entries& entries) {
    return std::all_of(entries.begin(), entries.end(), [&](const auto& entry) {
        const Sized other = entry_of(entries, entry.first.second, entry.first.first);
        return entry.second.equals({-other.value, other.size});
    });
}

// In these every coordinate has mass 1.
VectorXd units_of(const LinearSystem& system) {
    VectorXd units = VectorXd::Ones(system.n);
    for (const auto& [place, entry] : system.mass)
        if (place.first == place.second) units(place.first) = std::sqrt(std::fabs(cln::double_approx(entry.value)));
    return units;
}

cln::cl_R exactly(double x) {
    return cln::cl_float(cln::rational(cln::cl_DF(x)), cln::float_format(number_digits));
}

std::vector<cln::cl_R> exactly(const VectorXd& values) {
    std::vector<cln::cl_R> result;
    for (const double value : values) result.push_back(exactly(value));
    return result;
}

VectorXd plain(const std::vector<cln::cl_R>& values) {
    VectorXd result(std::ssize(values));
    for (std::size_t k = 0; k < values.size(); ++k)
        result(static_cast<Eigen::Index>(k)) = cln::double_approx(values[k]);
    return result;
}

bool is_definite(const LinearSystem& block) {
    const MatrixXd M = dense<double>(block.mass, units_of(block));
    return is_positive_definite(M) || is_positive_definite(-M);
}

// Of a block without an obstacle. An eigenvalue is off by at most |M^-1| times what S is: below that it is 0.
template <class Real>
std::optional<VectorXd> squared_frequencies_of(const LinearSystem& block) {
    const VectorXd units = units_of(block);
    Matrix<Real> M = dense<Real>(block.mass, units), S = dense<Real>(block.stiffness, units);
    const MatrixXd mass = dense<double>(block.mass, units);
    if (!mass.allFinite() || !dense<double>(block.stiffness, units).allFinite()) return std::nullopt;
    if (mass(0, 0) < 0) M = -M, S = -S;
    std::optional<VectorXd> values = generalised_eigenvalues(S, M);
    if (!values) return std::nullopt;
    LinearSystem::Entries sizes = block.stiffness;
    for (auto& [place, entry] : sizes) entry.value = entry.size;
    const double rounding = std::is_same_v<Real, double> ? std::fmax(double_rounding, block.rounding) : block.rounding;
    const double noise = rounding * inverse(mass).norm() * dense<double>(sizes, units).norm();
    for (double& value : *values)
        if (std::fabs(value) <= noise) value = 0;
    return values;
}

template <class Real>
std::vector<std::complex<double>> exponents_of(const LinearSystem& block) {
    const Eigen::Index n = block.n;
    const VectorXd ones = VectorXd::Ones(n);
    Matrix<Real> both(n, 2 * n);
    both << dense<Real>(block.stiffness, ones), dense<Real>(block.drag, ones);
    const Matrix<Real> solved = solution(dense<Real>(block.mass, ones), both, 0).value(), pull = solved.leftCols(n),
                       drag = solved.rightCols(n);
    // Time in a unit in which both blocks are alike.
    const Real unit = std::sqrt(std::fmax(static_cast<double>(pull.norm()), 1e-300));
    Matrix<Real> flow = Matrix<Real>::Zero(2 * n, 2 * n);
    flow.topRightCorner(n, n) = Matrix<Real>::Identity(n, n) * unit;
    flow.bottomLeftCorner(n, n) = -pull / unit;
    flow.bottomRightCorner(n, n) = -drag;
    const Eigen::VectorXcd values = eigenvalues(flow).value();
    return {values.begin(), values.end()};
}

// What tells equilibria apart; nothing where the mass matrix has no inverse: the coordinates are singular there, as
// angles at a pole.
std::optional<VectorXd> spectrum_of(const LinearSystem& system) {
    const VectorXd units = units_of(system);
    const auto pull = solution(dense<double>(system.mass, units), dense<double>(system.stiffness, units), 1e-10);
    if (!pull) return std::nullopt;
    if (const auto squared = system.squared_frequencies()) return squared;
    return Eigen::Vector2d(pull->trace(), (*pull * *pull).trace());
}

}  // namespace

std::vector<LinearSystem> LinearSystem::blocks() const {
    std::vector<int> block(static_cast<std::size_t>(n));  // of each coordinate: the first one coupled to it
    std::iota(block.begin(), block.end(), 0);
    const auto at = [](auto& values, int k) -> auto& {
        return values[static_cast<std::size_t>(k)];
    };
    const auto first_of = [&](int k) {
        while (at(block, k) != k) k = at(block, k) = at(block, at(block, k));
        return k;
    };
    for (const Entries* entries : {&mass, &drag, &stiffness})
        for (const auto& [place, entry] : *entries) {
            const auto [low, high] = std::minmax({first_of(place.first), first_of(place.second)});
            at(block, high) = low;
        }
    std::vector<LinearSystem> result;
    std::vector<int> number(static_cast<std::size_t>(n)), row(static_cast<std::size_t>(n));
    for (int k = 0; k < n; ++k) {
        const int first = first_of(k);
        if (first == k) {
            at(number, k) = static_cast<int>(result.size());
            result.emplace_back().rounding = rounding;
        }
        at(number, k) = at(number, first);
        at(row, k) = at(result, at(number, k)).n++;
    }
    for (Entries LinearSystem::*const entries : {&LinearSystem::mass, &LinearSystem::drag, &LinearSystem::stiffness})
        for (const auto& [place, entry] : this->*entries)
            (at(result, at(number, place.first)).*entries)[{at(row, place.first), at(row, place.second)}] = entry;
    return result;
}

std::string LinearSystem::obstacle() const {
    if (!drag.empty())
        return is_antisymmetric(drag) ? "its velocities couple the coordinates" : "its forces depend on the velocities";
    if (!is_symmetric(stiffness)) return "its forces have no potential";
    const std::vector<LinearSystem> all = blocks();
    return std::all_of(all.begin(), all.end(), is_definite) ? "" : "its masses have both signs";
}

std::optional<VectorXd> LinearSystem::squared_frequencies() const {
    if (!obstacle().empty()) return std::nullopt;
    VectorXd values(n);
    Eigen::Index done = 0;
    for (const LinearSystem& block : blocks()) {
        const auto some =
            block.n <= most_wide ? squared_frequencies_of<Wide>(block) : squared_frequencies_of<double>(block);
        if (!some) return std::nullopt;
        values.segment(done, block.n) = *some;
        done += block.n;
    }
    std::sort(values.begin(), values.end());
    return values;
}

double LinearSystem::rate() const {
    double largest = -std::numeric_limits<double>::infinity();
    for (const LinearSystem& block : blocks())
        for (const std::complex<double>& exponent :
             2 * block.n <= most_wide ? exponents_of<Wide>(block) : exponents_of<double>(block))
            largest = std::fmax(largest, exponent.real());
    return largest;
}

std::optional<double> LinearSystem::largest_frequency() const {
    double largest = 0;
    for (const LinearSystem& block : blocks()) {
        if (block.obstacle().empty()) {
            const auto squared = squared_frequencies_of<double>(block);
            if (!squared) return std::nullopt;
            largest = std::fmax(largest, std::sqrt(std::fmax(squared->maxCoeff(), 0)));
            continue;
        }
        if (block.n > most_wide) return std::nullopt;
        double size = 0, turning = 0;
        for (const std::complex<double>& exponent : exponents_of<double>(block)) {
            size = std::fmax(size, std::abs(exponent));
            turning = std::fmax(turning, exponent.imag());
        }
        if (turning > noise_of_turning * size) largest = std::fmax(largest, turning);
    }
    return largest;
}

Linearisation::Linearisation(const Scene& scene, const System& system) : system_(system) {
    for (const Parameter& parameter : scene.parameters)
        formulas_.set(parameter.symbol, float_of(scene.evaluate(parameter.value, "the parameter " + parameter.name)));
    const Position zero(system.q.size(), cln::cl_R(0));
    set(0, zero, zero);
    force_ = formulas_.convert(system.force);
    const auto entries_of = [&](const SparseMatrix& matrix) {
        Entries entries;
        std::vector<GiNaC::ex> values;
        for (const auto& [place, value] : matrix.entries()) {
            entries.places.push_back(place);
            values.push_back(value);
        }
        entries.values = formulas_.convert(values);
        return entries;
    };
    momentum_v_ = entries_of(system.momentum_v);
    momentum_q_ = entries_of(system.momentum_q);
    force_v_ = entries_of(system.force_v);
    force_q_ = entries_of(system.force_q);
}

void Linearisation::set(double time, const Position& q, const Position& v) {
    formulas_.set(system_.t, float_of(GiNaC::numeric(time)));
    for (std::size_t k = 0; k < q.size(); ++k) {
        formulas_.set(system_.q[k], q[k]);
        formulas_.set(system_.v[k], v[k]);
    }
}

LinearSystem Linearisation::at(double time, const Position& q, const Position& v) {
    set(time, q, v);
    LinearSystem result;
    result.n = system_.n;
    const auto add = [&](LinearSystem::Entries& matrix, const Entries& entries, int sign) {
        const std::vector<Sized> values = formulas_.evaluate_sized(entries.values);
        for (std::size_t i = 0; i < values.size(); ++i) {
            Sized& entry = matrix.try_emplace(entries.places[i], Sized{0, 0}).first->second;
            entry = {entry.value + sign * values[i].value, cln::max(entry.size, values[i].size)};
        }
    };
    add(result.mass, momentum_v_, 1);
    add(result.drag, momentum_q_, 1);
    add(result.drag, force_v_, -1);
    add(result.stiffness, force_q_, -1);
    for (LinearSystem::Entries* entries : {&result.mass, &result.drag, &result.stiffness})
        std::erase_if(*entries, [](const auto& entry) { return entry.second.vanishes(); });
    return result;
}

LinearSystem Linearisation::at(double time, const VectorXd& q, const VectorXd& v) {
    return at(time, exactly(q), exactly(v));
}

std::vector<Sized> Linearisation::force(const Position& q) {
    set(0, q, Position(q.size(), cln::cl_R(0)));
    return formulas_.evaluate_sized(force_);
}

bool Linearisation::rests(const Position& q) {
    const std::vector<Sized> f = force(q);
    return std::all_of(f.begin(), f.end(), [](const Sized& component) { return component.vanishes(); });
}

// Far out a force such as 1 - tanh(x)^2 is a rounding of its terms, or 0, and has no slope that could be told from
// rounding.
bool Linearisation::fades(const Position& q) {
    const LinearSystem::Entries stiffness = at_rest(q).stiffness;
    const std::vector<Sized> f = force(q);
    const std::vector<GiNaC::exset> hidden = formulas_.hidden(force_, formulas_.evaluate_all_sized(force_));
    for (std::size_t k = 0; k < f.size(); ++k) {
        const bool has_slope = std::any_of(stiffness.begin(), stiffness.end(),
                                           [&](const auto& entry) { return entry.first.first == static_cast<int>(k); });
        const bool hides_position = std::any_of(system_.q.begin(), system_.q.end(),
                                                [&](const GiNaC::symbol& x) { return hidden[k].contains(x); });
        if (!has_slope && (hides_position || cln::abs(f[k].value) > f[k].size * cln::expt(cln::cl_RA(10), -54)))
            return true;
    }
    return false;
}

std::vector<Eigen::Index> Linearisation::angles(const Position& q) {
    const auto is_angle = [&](const Position& from, std::size_t k, bool may_rest) {
        Position turned = from;
        turned[k] = turned[k] + 2 * cln::pi(cln::float_format(number_digits));
        try {
            const std::vector<Sized> here = force(from), there = force(turned);
            const bool is_pulled =
                std::any_of(here.begin(), here.end(), [](const Sized& a) { return !cln::zerop(a.value); });
            return (may_rest || is_pulled) && std::equal(here.begin(), here.end(), there.begin(),
                                                         [](const Sized& a, const Sized& b) { return a.equals(b); });
        } catch (const DomainError&) {
            return false;
        }
    };
    // All forces may vanish along a line of equilibria, but not beside it.
    Position beside = q;
    for (std::size_t k = 0; k < q.size(); ++k) beside[k] = beside[k] + exactly(0.1 / (1.0 + static_cast<double>(k)));
    std::vector<Eigen::Index> result;
    for (std::size_t k = 0; k < q.size(); ++k)
        if (is_angle(q, k, true) && is_angle(beside, k, false)) result.push_back(static_cast<Eigen::Index>(k));
    return result;
}

// Newton's step -S^+ f; each coordinate in a unit in which its stiffness is 1, so that a stiff one hides no other.
VectorXd Linearisation::newton_step(const Position& q, const VectorXd& f) {
    const MatrixXd S = dense<double>(at_rest(q).stiffness, VectorXd::Ones(f.size()));
    const VectorXd largest = S.cwiseAbs().rowwise().maxCoeff().cwiseMax(S.cwiseAbs().colwise().maxCoeff().transpose()),
                   unit = largest.unaryExpr([](double s) { return s > 0 ? 1 / std::sqrt(s) : 1; });
    const MatrixXd scaled = unit.asDiagonal() * S * unit.asDiagonal();
    return unit.asDiagonal() * least_squares(scaled, unit.asDiagonal() * f);
}

// A double step along forces and stiffness of 60 digits is refined to as many.
std::optional<Linearisation::Position> Linearisation::equilibrium_from(const VectorXd& start, bool& is_multiple) {
    is_multiple = false;
    const VectorXd most = start.cwiseAbs().cwiseMax(1) / 2,  // of a step
        extent = start.unaryExpr([](double x) { return x == 0 ? 1 : std::fabs(x); });
    const auto plain_force = [&](const Position& q) {
        std::vector<cln::cl_R> values;
        for (const Sized& component : force(q)) values.push_back(component.value);
        return plain(values);
    };
    const auto moved = [](Position q, const VectorXd& step) {
        for (std::size_t k = 0; k < q.size(); ++k) q[k] = q[k] + exactly(step(static_cast<Eigen::Index>(k)));
        return q;
    };
    try {
        Position q = exactly(start);
        VectorXd last = VectorXd::Zero(start.size()), direction = last;
        double last_ratio = 0;
        for (int iteration = 0; iteration < most_iterations && !rests(q); ++iteration) {
            const VectorXd f = plain_force(q);
            VectorXd step = newton_step(q, f);
            if (!step.allFinite()) return std::nullopt;
            if ((step.array().abs() <= 1e-50 * plain(q).cwiseAbs().cwiseMax(1e-10 * extent).array()).all()) break;
            const double limit = step.cwiseAbs().cwiseQuotient(most).maxCoeff();
            if (limit > 1) step /= limit;
            // Towards a multiple root the steps shrink by one ratio: all that remain at once.
            const double ratio = last.isZero(0) ? 0 : step.dot(last) / last.squaredNorm();
            last = direction = step;
            if (limit <= 1 && ratio > 0.4 && ratio < 0.95 && std::fabs(ratio - last_ratio) < 0.01) {
                step /= 1 - ratio;
                last.setZero();
                is_multiple = true;
            }
            last_ratio = ratio;
            // Half as far as long as the force grows much: towards a pole, or over a top.
            for (int halving = 0; halving < 8 && !(plain_force(moved(q, step)).norm() <= 2 * f.norm()); ++halving)
                step /= 2;
            q = moved(q, step);
        }
        // Near 0 a force may never be small beside its terms: exactly at 0 it is.
        Position rounded = q;
        for (std::size_t k = 0; k < q.size(); ++k)
            if (std::fabs(cln::double_approx(q[k])) <= 1e-12 * extent(static_cast<Eigen::Index>(k))) rounded[k] = 0;
        // A multiple root lies between larger forces, a place where they fade does not.
        const auto lies_between = [&](const Position& place) {
            const VectorXd aside = direction.normalized().cwiseProduct(1e-3 * extent);
            const double here = plain_force(place).norm();
            return plain_force(moved(place, aside)).norm() > here && plain_force(moved(place, -aside)).norm() > here;
        };
        for (const Position& place : {rounded, q})
            if (rests(place) && ((is_multiple && lies_between(place)) || !fades(place))) return place;
    } catch (const DomainError&) {
    }
    return std::nullopt;
}

std::vector<Equilibrium> Linearisation::equilibria(const std::vector<VectorXd>& starts) {
    std::vector<Equilibrium> found;
    std::vector<VectorXd> spectra;
    const auto look_from = [&](const VectorXd& start) {
        bool is_multiple = false;
        const auto position = equilibrium_from(start, is_multiple);
        if (!position) return;
        Equilibrium equilibrium{plain(*position), at_rest(*position)};
        equilibrium.system.rounding = is_multiple ? multiple_rounding : position_rounding;
        const auto spectrum = spectrum_of(equilibrium.system);
        if (!spectrum) return;
        const bool known = std::any_of(spectra.begin(), spectra.end(), [&](const VectorXd& other) {
            return other.size() == spectrum->size() &&
                   ((other - *spectrum).array().abs() <= 1e-7 * (other.array().abs() + spectrum->array().abs())).all();
        });
        if (known) return;
        found.push_back(std::move(equilibrium));
        spectra.push_back(*spectrum);
    };
    for (const VectorXd& start : starts) look_from(start);
    // Pendulums hang or stand, each by itself. What is found on the way is turned too.
    int turns = 0;
    for (std::size_t i = 0; i < found.size(); ++i) {
        const VectorXd q = found[i].q;
        for (const Eigen::Index k : angles(exactly(q))) {
            if (++turns > most_turns) return found;
            VectorXd turned = q;
            turned(k) += turned(k) > 0 ? -std::numbers::pi : std::numbers::pi;
            look_from(turned);
        }
    }
    return found;
}

int Linearisation::free_directions(const VectorXd& q) {
    if (!system_.separable) return 0;
    Noise noise(1);
    Matrix<Wide> pulls = Matrix<Wide>::Zero(most_looks * q.size(), q.size());
    int looks = 0;
    for (int look = 0; look < most_looks; ++look) {
        Position near = exactly(q);
        const cln::cl_R far = cln::expt(cln::cl_RA(10), 1 - look);
        for (cln::cl_R& x : near) x = x + noise.next() * cln::max(cln::abs(x), cln::cl_R(1)) * far;
        try {
            pulls.middleRows(look * q.size(), q.size()) =
                dense<Wide>(at_rest(near).stiffness, VectorXd::Ones(q.size()));
            ++looks;
        } catch (const DomainError&) {
        }
    }
    if (looks < most_looks / 2) return 0;
    for (Eigen::Index row = 0; row < pulls.rows(); ++row)
        if (const Wide most = pulls.row(row).cwiseAbs().maxCoeff(); most > Wide(0)) pulls.row(row) /= most;
    return dimension_of_kernel(pulls, 1e-40);
}

}  // namespace lobatto
