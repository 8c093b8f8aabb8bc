// SPDX-License-Identifier: GPL-2.0-or-later
// A step that a kernel took, put into the discrete Euler-Lagrange equations that it was derived from.
#include <algorithm>
#include <map>
#include <string>

#include "generator/check/check.hpp"
#include "generator/check/discrete_action.hpp"
#include "generator/mechanics/system/mass_equations.hpp"

namespace lobatto {

namespace {

class TakenStepCheck : DiscreteAction {
public:
    TakenStepCheck(const Derivation& derivation, const TakenStep& step) : DiscreteAction(derivation), step_(step) {
        for (const Coordinate& coordinate : derivation.scene.coordinates) arrays_.push_back(coordinate.array());
        for (std::size_t i = 0; i < step.parameters.size(); ++i)
            formulas_.set(system_.parameters[i], step.parameters[i]);
        set(system_.q, step.positions.front());
        set(system_.v, Numbers(n_, cln::cl_R(0)));
        formulas_.set(system_.t, step.time);
        begin(step.time, step.step);
        path_ = step.positions;
        if (is_straight_)
            follow_straight_path();
        else if (path_.size() < controls()) {
            is_solved_ = true;
            path_ = path_between(path_.front(), path_.back());
        }
    }

    double defect() {
        const Numbers left = equations(path_, step_.p0, step_.p1);
        // What the rounding of each number may leave in the equations of a coordinate.
        Numbers rounding(n_, cln::cl_R(0)), size(n_, cln::cl_R(0));
        for (const Numbers& positions : path_)
            for (std::size_t k = 0; k < n_; ++k) size[k] = cln::max(size[k], cln::abs(positions[k]));
        Numbers size0 = step_.p0, size1 = step_.p1;  // of the momenta at the ends
        add_sizes_of_arrays(size, size0, size1);
        if (!system_.constraints.empty()) {
            add_sizes_of_others(size, size0, size1);
            add_sizes_of_constraints(size);
            add_sizes_of_impulses(size0, size1);
        }
        Noise noise(12);
        const auto rounded = [&](const cln::cl_R& value, const cln::cl_R& of) {
            return value + cln::cl_R((cln::plusp(noise.next()) ? 1 : -1)) * of * step_.epsilon;
        };
        rounding.resize(left.size(), cln::cl_R(0));
        // Equations of one coordinate, or of one constraint, at all control points: a single one may round to nothing.
        const std::size_t motion = controls() * n_, count = system_.constraints.size();
        const auto group = [&](std::size_t i) {
            return i < motion ? i % n_ : i < motion + (controls() - 1) * count ? motion + (i - motion) % count : i;
        };
        for (int draw = 0; draw < 4; ++draw) {
            Path moved = path_;
            Numbers p0 = step_.p0, p1 = step_.p1;
            for (Numbers& positions : moved)
                for (std::size_t k = 0; k < n_; ++k) positions[k] = rounded(positions[k], size[k]);
            if (is_solved_) moved = path_between(moved.front(), moved.back());
            for (std::size_t k = 0; k < n_; ++k) {
                p0[k] = rounded(p0[k], size0[k]);
                p1[k] = rounded(p1[k], size1[k]);
            }
            const Numbers there = equations(moved, p0, p1);
            for (std::size_t i = 0; i < there.size(); ++i)
                rounding[group(i)] = cln::max(rounding[group(i)], cln::abs(there[i] - left[i]));
        }
        const Numbers in_forces = rounding_in_forces();
        for (std::size_t i = 0; i < motion && i < left.size(); ++i)
            rounding[group(i)] = cln::max(rounding[group(i)], in_forces[i % n_]);
        const cln::cl_R underflow = cln::expt(cln::cl_RA(10), -300);
        cln::cl_R worst = 0;
        for (std::size_t i = 0; i < left.size(); ++i)
            if (cln::abs(left[i]) > underflow && !cln::zerop(rounding[group(i)]))
                worst = cln::max(worst, cln::abs(left[i]) / rounding[group(i)]);
        return cln::double_approx(worst);
    }

private:
    // What rounding inside the formulas of the forces leaves in the equations of each coordinate: their terms may be
    // far larger than the force, as near an equilibrium.
    Numbers rounding_in_forces() {
        Numbers largest(n_, cln::cl_R(0));
        if (is_straight_) return largest;
        for (std::size_t i = 0; i < nodes_.size(); ++i) {
            set_node(i, path_, system_.q, system_.v);
            const std::vector<Sized> forces = formulas_.evaluate_sized(force_);
            for (std::size_t k = 0; k < n_; ++k)
                largest[k] = cln::max(largest[k], cln::abs(h_) * weights_[i] * forces[k].size * step_.epsilon);
        }
        return largest;
    }

    // An iteration ends where all increments together are rounding, so an element of an array is as exact as the one
    // that moves most; its momentum as if it moved so far.
    void add_sizes_of_arrays(Numbers& position, Numbers& momentum0, Numbers& momentum1) {
        std::map<std::string, cln::cl_R> farthest;
        std::vector<GiNaC::ex> diagonal;
        for (std::size_t k = 0; k < n_; ++k) {
            cln::cl_R& moved = farthest[arrays_[k]];
            moved = cln::max(moved, cln::abs(path_.back()[k] - path_.front()[k]));
            diagonal.push_back(system_.momentum_v(static_cast<int>(k), static_cast<int>(k)));
        }
        const Numbers mass = formulas_(diagonal);
        for (std::size_t k = 0; k < n_; ++k) {
            const cln::cl_R &moved = farthest[arrays_[k]], pushed = cln::abs(mass[k] * moved / h_);
            position[k] = cln::max(position[k], moved);
            momentum0[k] = cln::max(cln::abs(momentum0[k]), pushed);
            momentum1[k] = cln::max(cln::abs(momentum1[k]), pushed);
        }
    }

    // Constraints pull on all coordinates at once, so that each is rounded beside the others, in the metric of the
    // mass: M_kk x_k^2 beside the sum of M_jj d_j^2, p_k^2 / M_kk beside the sum of p_j^2 / M_jj; d: how far it goes in
    // a step.
    void add_sizes_of_others(Numbers& position, Numbers& momentum0, Numbers& momentum1) {
        std::vector<GiNaC::ex> diagonal;
        for (int k = 0; k < static_cast<int>(n_); ++k) diagonal.push_back(system_.momentum_v(k, k));
        const Numbers mass = formulas_(diagonal);
        cln::cl_R moved = 0, pushed = 0;
        for (std::size_t k = 0; k < n_; ++k) {
            if (!cln::plusp(mass[k])) continue;
            moved = moved + mass[k] * cln::square(path_.back()[k] - path_.front()[k]);
            pushed = pushed + (cln::square(momentum0[k]) + cln::square(momentum1[k])) / mass[k];
        }
        for (std::size_t k = 0; k < n_; ++k) {
            if (!cln::plusp(mass[k])) continue;
            position[k] = cln::max(position[k], cln::sqrt(moved / mass[k]));
            for (Numbers* const momentum : {&momentum0, &momentum1})
                (*momentum)[k] = cln::max(cln::abs((*momentum)[k]), cln::sqrt(pushed * mass[k]));
        }
    }

    // Momenta are sums of impulses, which constraints may take all away.
    void add_sizes_of_impulses(Numbers& momentum0, Numbers& momentum1) {
        const Numbers in_forces = rounding_in_forces();
        for (Numbers* const momentum : {&momentum0, &momentum1})
            for (std::size_t k = 0; k < n_; ++k)
                (*momentum)[k] = cln::max((*momentum)[k], in_forces[k] / step_.epsilon);
    }

    // Positions are no better than the constraints that they are solved for: the terms of phi round, and what that
    // leaves, G^T phi / |G|^2, is in the positions, however small these are.
    void add_sizes_of_constraints(Numbers& position) {
        std::vector<GiNaC::ex> values;
        for (const Constraint& constraint : system_.constraints) values.push_back(constraint.value);
        const std::vector<Id> constraints = formulas_.convert(values);
        for (std::size_t j : {std::size_t(0), controls() - 1}) {
            formulas_.set(system_.t, t0_ + control_[j] * h_);
            set(system_.q, path_[j]);
            const std::vector<Sized> phi = formulas_.evaluate_sized(constraints);
            const Numbers G = values_of(system_.constraint_q.dense());
            for (std::size_t c = 0; c < phi.size(); ++c) {
                cln::cl_R square = 0;
                for (std::size_t k = 0; k < n_; ++k) square = square + cln::square(G[c * n_ + k]);
                for (std::size_t k = 0; k < n_ && cln::plusp(square); ++k)
                    position[k] = cln::max(position[k], phi[c].size * cln::abs(G[c * n_ + k]) / square);
            }
        }
    }

    // dL_d/dQ_j, with the momenta at the ends: all of them vanish for a step (D28). With constraints, what of them no
    // multiplier takes away; then the constraints at each control point (D45), and the multipliers that the momentum at
    // the end would need to keep them on (D46).
    Numbers equations(const Path& path, const Numbers& p0, const Numbers& p1) {
        if (!system_.constraints.empty()) return constrained_equations(path, p0, p1);
        const Path R = slopes(path);
        Numbers flat;
        for (std::size_t j = 0; j < R.size(); ++j)
            for (std::size_t k = 0; k < n_; ++k)
                flat.push_back(R[j][k] + (j == 0 ? p0[k] : j + 1 == R.size() ? -p1[k] : cln::cl_R(0)));
        return flat;
    }

    Numbers constrained_equations(const Path& path, const Numbers& p0, const Numbers& p1) {
        Path R = slopes(path);
        Numbers flat, kept;
        for (std::size_t j = 0; j < R.size(); ++j) {
            for (std::size_t k = 0; k < n_ && j == 0; ++k) R[j][k] = R[j][k] + p0[k];
            for (std::size_t k = 0; k < n_ && j + 1 == R.size(); ++k) R[j][k] = R[j][k] - p1[k];
            formulas_.set(system_.t, t0_ + control_[j] * h_);
            set(system_.q, path[j]);
            const Numbers G = values_of(system_.constraint_q.dense());
            const Numbers free = without_pull(R[j], G);
            flat.insert(flat.end(), free.begin(), free.end());
            if (j == 0) continue;
            for (const Constraint& constraint : system_.constraints)
                kept.push_back(formulas_({constraint.value}).front());
        }
        flat.insert(flat.end(), kept.begin(), kept.end());
        const Numbers needed = multipliers_of(p1, path);
        flat.insert(flat.end(), needed.begin(), needed.end());
        return flat;
    }
    // R - G^T (G G^T)^-1 G R.
    Numbers without_pull(const Numbers& R, const Numbers& G) const {
        const std::size_t count = system_.constraints.size();
        Numbers square(count * count, cln::cl_R(0)), right(count, cln::cl_R(0));
        for (std::size_t c = 0; c < count; ++c)
            for (std::size_t k = 0; k < n_; ++k) {
                right[c] = right[c] + G[c * n_ + k] * R[k];
                for (std::size_t d = 0; d < count; ++d)
                    square[c * count + d] = square[c * count + d] + G[c * n_ + k] * G[d * n_ + k];
            }
        const Numbers lambda = solve(square, right);
        Numbers free = R;
        for (std::size_t c = 0; c < count; ++c)
            for (std::size_t k = 0; k < n_; ++k) free[k] = free[k] - G[c * n_ + k] * lambda[c];
        return free;
    }
    // mu of dL/dv + G^T mu = p1, G v + dphi/dt = 0 at the end of the path, by Newton's iteration.
    Numbers multipliers_of(const Numbers& p1, const Path& path) {
        const std::size_t count = system_.constraints.size();
        formulas_.set(system_.t, t0_ + h_);
        set(system_.q, path.back());
        const Numbers G = values_of(system_.constraint_q.dense()), phi_t = formulas_(system_.constraint_t);
        MassEquations equations(system_, formulas_);
        Numbers v = values_of(system_.v), mu(count, cln::cl_R(0));
        for (int iteration = 0; iteration < 12; ++iteration) {  // from the velocity of the path: some five are enough
            Numbers left = formulas_.evaluate(momentum_);
            for (std::size_t k = 0; k < n_; ++k) {
                left[k] = left[k] - p1[k];
                for (std::size_t c = 0; c < count; ++c) left[k] = left[k] + G[c * n_ + k] * mu[c];
            }
            for (std::size_t c = 0; c < count; ++c) {
                left.push_back(phi_t[c]);
                for (std::size_t k = 0; k < n_; ++k) left.back() = left.back() + G[c * n_ + k] * v[k];
            }
            const Numbers step = equations.eliminate(left).vector;
            for (std::size_t k = 0; k < n_; ++k) v[k] = v[k] - step[k];
            for (std::size_t c = 0; c < count; ++c) mu[c] = mu[c] - step[n_ + c];
            set(system_.v, v);
        }
        return mu;
    }

    // (D40) Kicks and drifts, one after another; the end stays the one that was taken.
    void follow_straight_path() {
        const Numbers mass = values_of(system_.mass.dense());
        const Numbers end = path_.back();
        path_ = {path_.front()};
        Numbers p = step_.p0;
        for (std::size_t j = 0; j + 1 < controls(); ++j) {
            set(system_.q, path_.back());
            for (std::size_t i = 0; i < nodes_.size(); ++i) {
                if (cln::zerop(B(i, j))) continue;  // no kick here, as at the ends of a step that begins with a drift
                formulas_.set(system_.t, t0_ + nodes_[i] * h_);
                const Numbers force = formulas_.evaluate(force_);
                for (std::size_t k = 0; k < n_; ++k) p[k] = p[k] + h_ * weights_[i] * force[k];
            }
            const Numbers velocity = solve(mass, p);
            Numbers next = path_.back();
            for (std::size_t k = 0; k < n_; ++k) next[k] = next[k] + h_ * (control_[j + 1] - control_[j]) * velocity[k];
            path_.push_back(next);
        }
        path_.back() = end;
    }

    // With the positions inside of a linear system: its equations are affine in them.
    Path path_between(const Numbers& start, const Numbers& end) {
        const std::size_t inside = controls() - 2, N = inside * n_;
        const auto path_through = [&](const Numbers& positions) {
            Path path = {start};
            for (std::size_t j = 0; j < inside; ++j)
                path.emplace_back(positions.begin() + static_cast<std::ptrdiff_t>(j * n_),
                                  positions.begin() + static_cast<std::ptrdiff_t>((j + 1) * n_));
            path.push_back(end);
            return path;
        };
        const auto inner_equations = [&](const Numbers& positions) {
            const Path R = slopes(path_through(positions));
            Numbers flat;
            for (std::size_t j = 1; j <= inside; ++j) flat.insert(flat.end(), R[j].begin(), R[j].end());
            return flat;
        };
        Numbers positions(N, cln::cl_R(0));
        cln::cl_R unit = 0;  // beside which nothing is lost
        for (std::size_t k = 0; k < n_; ++k) unit = cln::max(unit, cln::max(cln::abs(start[k]), cln::abs(end[k])));
        if (cln::zerop(unit)) unit = 1;
        const Numbers at_zero = inner_equations(positions);
        Numbers matrix(N * N, cln::cl_R(0)), right;
        for (std::size_t c = 0; c < N; ++c) {
            positions[c] = unit;
            const Numbers there = inner_equations(positions);
            positions[c] = 0;
            for (std::size_t r = 0; r < N; ++r) matrix[r * N + c] = (there[r] - at_zero[r]) / unit;
            right.push_back(-at_zero[c]);
        }
        return path_through(N > 0 ? solve(matrix, right) : Numbers{});
    }

    const TakenStep& step_;
    std::vector<std::string> arrays_;  // of each coordinate, or its own name
    Path path_;
    bool is_solved_ =
        false;  // inside, from both ends: what these lose by rounding, the path loses as that amplifies it
};

}  // namespace

double equations_left(const Derivation& derivation, const TakenStep& step) {
    return TakenStepCheck(derivation, step).defect();
}

}  // namespace lobatto
