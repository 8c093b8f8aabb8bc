// SPDX-License-Identifier: GPL-2.0-or-later
// A step that a kernel took, put into the discrete Euler-Lagrange equations that it was derived from.
#include <algorithm>

#include "generator/check/check.hpp"
#include "generator/check/discrete_action.hpp"

namespace lobatto {

namespace {

class TakenStepCheck : DiscreteAction {
public:
    TakenStepCheck(const Derivation& derivation, const TakenStep& step) : DiscreteAction(derivation), step_(step) {
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
        Noise noise(12);
        const auto rounded = [&](const cln::cl_R& value, const cln::cl_R& of) {
            return value + cln::cl_R((cln::plusp(noise.next()) ? 1 : -1)) * of * step_.epsilon;
        };
        for (int draw = 0; draw < 4; ++draw) {
            Path moved = path_;
            Numbers p0 = step_.p0, p1 = step_.p1;
            for (Numbers& positions : moved)
                for (std::size_t k = 0; k < n_; ++k) positions[k] = rounded(positions[k], size[k]);
            if (is_solved_) moved = path_between(moved.front(), moved.back());
            for (std::size_t k = 0; k < n_; ++k) {
                p0[k] = rounded(p0[k], p0[k]);
                p1[k] = rounded(p1[k], p1[k]);
            }
            const Numbers there = equations(moved, p0, p1);
            for (std::size_t i = 0; i < there.size(); ++i)
                rounding[i % n_] = cln::max(rounding[i % n_], cln::abs(there[i] - left[i]));
        }
        cln::cl_R worst = 0;
        for (std::size_t i = 0; i < left.size(); ++i)
            if (!cln::zerop(left[i]) && !cln::zerop(rounding[i % n_]))
                worst = cln::max(worst, cln::abs(left[i]) / rounding[i % n_]);
        return cln::double_approx(worst);
    }

private:
    // dL_d/dQ_j, with the momenta at the ends: all of them vanish for a step (D28).
    Numbers equations(const Path& path, const Numbers& p0, const Numbers& p1) {
        const Path R = slopes(path);
        Numbers flat;
        for (std::size_t j = 0; j < R.size(); ++j)
            for (std::size_t k = 0; k < n_; ++k)
                flat.push_back(R[j][k] + (j == 0 ? p0[k] : j + 1 == R.size() ? -p1[k] : cln::cl_R(0)));
        return flat;
    }

    // (D40) Kicks and drifts, one after another; the end stays the one that was taken.
    void follow_straight_path() {
        const Numbers mass = values_of(system_.mass.dense());
        const Numbers end = path_.back();
        path_ = {path_.front()};
        Numbers p = step_.p0;
        for (std::size_t j = 0; j + 1 < controls(); ++j) {
            formulas_.set(system_.t, t0_ + nodes_[j] * h_);
            set(system_.q, path_.back());
            const Numbers force = formulas_.evaluate(force_);
            for (std::size_t k = 0; k < n_; ++k) p[k] = p[k] + h_ * weights_[j] * force[k];
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
    Path path_;
    bool is_solved_ =
        false;  // inside, from both ends: what these lose by rounding, the path loses as that amplifies it
};

}  // namespace

double equations_left(const Derivation& derivation, const TakenStep& step) {
    return TakenStepCheck(derivation, step).defect();
}

}  // namespace lobatto
