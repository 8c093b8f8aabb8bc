// SPDX-License-Identifier: GPL-2.0-or-later
// One step of any system in numbers of 60 digits: the node's formulas and the sums over the nodes against differences
// of the action itself (D25 ... D30).
#include <algorithm>
#include <functional>

#include "generator/check/check.hpp"
#include "generator/check/discrete_action.hpp"
#include "generator/check/point.hpp"

namespace lobatto {

namespace {

// A step near the start of the scene, and what was measured of it.
class StepNearStart : protected DiscreteAction {
public:
    StepNearStart(const Derivation& derivation, int attempt)
        : DiscreteAction(derivation), start_(derivation.scene, attempt) {
        start_.set_all(formulas_);
        begin(formulas_.get(system_.t),
              start_.near(float_of(derivation.scene.evaluate(derivation.scene.run.step, "the step"))));
        q_ = values_of(system_.q);
        v_ = values_of(system_.v);
    }

protected:
    void compare(const std::string& claim, double bound, const std::string& meaning, const Numbers& one,
                 const Numbers& other) {
        measured_->push_back({{claim, false, false, 0, bound, meaning}, relative_difference(one, other)});
    }
    template <class Difference>
    void compare_with_differences(const std::string& claim, const std::string& meaning, const Numbers& derivatives,
                                  const Difference& difference) {
        measured_->push_back(
            {{claim, false, false, 0, difference_bound, meaning}, difference_defect(derivatives, difference)});
    }

    static Numbers joined(Numbers x, const Numbers& y) {
        x.insert(x.end(), y.begin(), y.end());
        return x;
    }

    static Numbers part(const Numbers& all, const std::vector<int>& which) {
        Numbers result;
        for (const int k : which) result.push_back(all[static_cast<std::size_t>(k)]);
        return result;
    }

    // A path through the start, velocities near the start's.
    Path path(const Numbers& q, const Numbers& v) {
        Path X;
        for (const cln::cl_R& x : control_) {
            X.emplace_back();
            for (std::size_t k = 0; k < q.size(); ++k) X.back().push_back(q[k] + h_ * x * start_.near(v[k]));
        }
        return X;
    }

    NearStart start_;
    Numbers q_, v_;
    std::vector<std::pair<Check, double>>* measured_ = nullptr;
};

class Step : StepNearStart {
public:
    using StepNearStart::StepNearStart;

    void run(std::vector<std::pair<Check, double>>& measured) {
        measured_ = &measured;
        slopes_of_L();
        second_derivatives();
        slopes_of_the_action();
        if (derivation_.structure.form() == StepForm::general) {
            if (system_.constraints.empty()) routhian();
        } else {
            stage_equations();
        }
    }

private:
    // (D25) p = dL/dv, f = dL/dq + F, along directions in (v, q).
    void slopes_of_L() {
        Symbols z = system_.v;
        z.insert(z.end(), system_.q.begin(), system_.q.end());
        const Numbers here = joined(v_, q_);
        set(z, here);
        Numbers slope = formulas_.evaluate(momentum_);
        const Numbers force = formulas_.evaluate(force_), outer = formulas_.evaluate(outer_force_);
        for (std::size_t k = 0; k < n_; ++k) slope.push_back(force[k] - outer[k]);
        Noise noise(5);
        std::vector<Numbers> directions;
        Numbers products;
        for (int direction = 0; direction < 3; ++direction) {
            directions.push_back(joined(seeded_direction(v_, noise), seeded_direction(q_, noise)));
            products.push_back(times(slope, directions.back())[0]);
        }
        compare_with_differences("momentum and force are derivatives of L", "dL/dq' or dL/dq is wrong", products,
                                 [&](const cln::cl_R& e) {
                                     Numbers quotients;
                                     for (const Numbers& d : directions)
                                         quotients.push_back(central_difference(here, d, e, [&](const Numbers& x) {
                                             set(z, x);
                                             return formulas_.evaluate(lagrangian_);
                                         })[0]);
                                     return quotients;
                                 });
        set(z, here);
    }

    // The derivative of the node's vector g(z) along a direction: what an entry misses or has too much shows.
    void second_derivatives() {
        Symbols z = system_.v;
        std::vector<GiNaC::ex> g = system_.momentum;
        SparseMatrix H;
        if (derivation_.structure.form() == StepForm::general) {
            const Routhian& routhian = derivation_.structure.routhian();
            z = routhian.z;
            g = routhian.gradient;
            H = routhian.second;
            set_cyclic_momenta();
            Noise of_multipliers(17);
            for (const auto& lambda : routhian.multipliers) formulas_.set(lambda, of_multipliers.next());
        } else {  // what is not in (D1) vanishes
            z.insert(z.end(), system_.q.begin(), system_.q.end());
            g.insert(g.end(), system_.force.begin(), system_.force.end());
            for (const auto& [place, value] : system_.mass.entries()) H.put(place.first, place.second, value);
            for (const auto& [place, value] : system_.hessian.entries())
                H.put(system_.n + place.first, system_.n + place.second, -value);
        }
        std::vector<GiNaC::ex> entries;
        for (const auto& [place, value] : H.entries()) entries.push_back(value);
        const Numbers here = values_of(z), second = formulas_(entries);
        Noise noise(6);
        const Numbers d = seeded_direction(here, noise);
        const std::vector<Id> roots = formulas_.convert(g);
        Numbers product(g.size(), cln::cl_R(0));
        std::size_t next = 0;
        for (const auto& [place, value] : H.entries()) {
            cln::cl_R& sum = product[static_cast<std::size_t>(place.first)];
            sum = sum + second[next++] * d[static_cast<std::size_t>(place.second)];
        }
        compare_with_differences("second derivatives against differences", "a second derivative of L is wrong", product,
                                 [&](const cln::cl_R& e) {
                                     return central_difference(here, d, e, [&](const Numbers& x) {
                                         set(z, x);
                                         return formulas_.evaluate(roots);
                                     });
                                 });
        set(z, here);
    }

    void slopes_of_the_action() {
        const Path X = path(q_, v_);
        const Path with_work = slopes(X), work = slopes(X, true);
        Noise noise(8);
        std::vector<Numbers> directions;
        Numbers flat, slope, products;
        for (std::size_t j = 0; j < X.size(); ++j)
            for (std::size_t k = 0; k < n_; ++k) {
                flat.push_back(X[j][k]);
                slope.push_back(with_work[j][k] - work[j][k]);
            }
        for (int direction = 0; direction < 3; ++direction) {
            Numbers d;
            for (std::size_t i = 0; i < flat.size(); ++i) {
                const cln::cl_R& speed = v_[i % n_];
                d.push_back(noise.next() * h_ * (cln::zerop(speed) ? cln::cl_R(1) : cln::abs(speed)));
            }
            products.push_back(times(slope, d)[0]);
            directions.push_back(d);
        }
        const auto moved_action = [&](const Numbers& x) {
            Path moved = X;
            for (std::size_t i = 0; i < x.size(); ++i) moved[i / n_][i % n_] = x[i];
            return Numbers{action(moved)};
        };
        compare_with_differences("the residual is the derivative of the action",
                                 "the equations of the step are not those of the discrete action", products,
                                 [&](const cln::cl_R& e) {
                                     Numbers quotients;
                                     for (const Numbers& d : directions)
                                         quotients.push_back(central_difference(flat, d, e, moved_action)[0]);
                                     return quotients;
                                 });
    }

    // P of the cyclic coordinates as the start has it.
    void set_cyclic_momenta() {
        const Routhian& routhian = derivation_.structure.routhian();
        const Numbers p = formulas_.evaluate(momentum_);
        P0_.clear();
        for (const int k : routhian.cyclic) P0_.push_back(p[static_cast<std::size_t>(k)]);
        set(routhian.P, P0_);
    }

    // The reduced system's residual against the whole system's, and its Jacobian against differences of it.
    void routhian() {
        const Routhian& routhian = derivation_.structure.routhian();
        const Path X = path(part(q_, routhian.active), part(v_, routhian.active));
        set_cyclic_momenta();
        const std::vector<Id> gradient = formulas_.convert(routhian.gradient);
        const Reduced reduced = [&](std::size_t i, const Path& path, const Numbers& kappa) {
            const std::size_t active = routhian.active.size();
            const Symbols v(routhian.z.begin(), routhian.z.begin() + static_cast<std::ptrdiff_t>(active)),
                q(routhian.z.begin() + static_cast<std::ptrdiff_t>(active),
                  routhian.z.begin() + static_cast<std::ptrdiff_t>(2 * active));
            set_node(i, path, q, v);
            for (std::size_t c = 0; c < kappa.size(); ++c)
                formulas_.set(routhian.P[c], P0_[c] + kappa[c] * legendre_[i]);
            return formulas_.evaluate(gradient);
        };
        Numbers kappa(routhian.cyclic.size(), cln::cl_R(0));
        if (has_multiplier()) kappa = multiplier(X, reduced);
        if (!routhian.cyclic.empty()) cyclic_from_momenta(X, kappa, reduced);
        reduced_jacobian(X, kappa, reduced);
    }

    // Lobatto's formulas determine kappa by a condition of their own; with the others it is zero.
    bool has_multiplier() const {
        return !derivation_.structure.routhian().cyclic.empty() &&
               derivation_.quadrature.method.family == Family::lobatto;
    }

    // The slopes of the Routhian at node i of a path, with P_i = P0 + kappa pi(c_i).
    using Reduced = std::function<Numbers(std::size_t, const Path&, const Numbers&)>;

    // Residuals of all control points and of kappa.
    Numbers reduced_residual(const Path& path, const Numbers& kappa, const Reduced& reduced) const {
        const std::size_t active = derivation_.structure.routhian().active.size(), cyclic = kappa.size(),
                          controls = control_.size();
        Numbers sums(controls * active + cyclic, cln::cl_R(0));
        for (std::size_t i = 0; i < nodes_.size(); ++i) {
            const Numbers g = reduced(i, path, kappa);
            const cln::cl_R b = weights_[i];
            for (std::size_t j = 0; j < controls; ++j)
                for (std::size_t a = 0; a < active; ++a)
                    sums[j * active + a] = sums[j * active + a] + b * (D(i, j) * g[a] + h_ * B(i, j) * g[active + a]);
            for (std::size_t c = 0; c < cyclic; ++c)
                sums[controls * active + c] = sums[controls * active + c] + h_ * b * legendre_[i] * g[2 * active + c];
        }
        return sums;
    }

    // kappa, in which its condition is linear.
    Numbers multiplier(const Path& X, const Reduced& reduced) const {
        const std::size_t cyclic = derivation_.structure.routhian().cyclic.size();
        const auto condition = [&](const Numbers& kappa) {
            const Numbers values = reduced_residual(X, kappa, reduced);
            return Numbers(values.end() - static_cast<std::ptrdiff_t>(cyclic), values.end());
        };
        const Numbers at_zero = condition(Numbers(cyclic, cln::cl_R(0)));
        Numbers matrix(cyclic * cyclic, cln::cl_R(0)), right;
        for (std::size_t c = 0; c < cyclic; ++c) {
            Numbers unit(cyclic, cln::cl_R(0));
            unit[c] = 1;
            const Numbers there = condition(unit);
            for (std::size_t row = 0; row < cyclic; ++row) matrix[row * cyclic + c] = there[row] - at_zero[row];
            right.push_back(-at_zero[c]);
        }
        return solve(matrix, right);
    }

    // With P_i = P0 + kappa pi(c_i) and kappa as the condition wants it, the cyclic coordinates move on polynomials,
    // their slopes are those of constant momenta, and the active slopes are the same (D29).
    void cyclic_from_momenta(const Path& X, const Numbers& kappa, const Reduced& reduced) {
        const Routhian& routhian = derivation_.structure.routhian();
        const std::size_t active = routhian.active.size(), cyclic = kappa.size(), controls = control_.size();
        // The whole path: the cyclic coordinates from their velocities at the nodes, with m = controls - 1 of them.
        const std::size_t m = controls - 1;
        Path whole(controls, Numbers(n_, cln::cl_R(0)));
        for (std::size_t j = 0; j < controls; ++j)
            for (std::size_t a = 0; a < active; ++a) whole[j][static_cast<std::size_t>(routhian.active[a])] = X[j][a];
        Numbers slope_matrix;
        for (std::size_t i = 0; i < m; ++i)
            for (std::size_t j = 1; j <= m; ++j) slope_matrix.push_back(D(i, j));
        for (std::size_t c = 0; c < cyclic; ++c) {
            Numbers rises;
            for (std::size_t i = 0; i < m; ++i) rises.push_back(-h_ * reduced(i, X, kappa)[2 * active + c]);
            const auto k = static_cast<std::size_t>(routhian.cyclic[c]);
            const Numbers positions = solve(slope_matrix, rises);
            for (std::size_t j = 0; j < controls; ++j) whole[j][k] = q_[k] + (j == 0 ? cln::cl_R(0) : positions[j - 1]);
        }
        const Numbers residual = reduced_residual(X, kappa, reduced);
        const Path all = slopes(whole);
        Numbers one, other;
        for (std::size_t j = 0; j < controls; ++j) {
            for (std::size_t a = 0; a < active; ++a) {
                one.push_back(residual[j * active + a]);
                other.push_back(all[j][static_cast<std::size_t>(routhian.active[a])]);
            }
            for (std::size_t c = 0; c < cyclic; ++c) {
                one.push_back(j == 0 ? -P0_[c] : j == m ? P0_[c] : cln::cl_R(0));
                other.push_back(all[j][static_cast<std::size_t>(routhian.cyclic[c])]);
            }
        }
        compare("cyclic coordinates follow from their momenta", identity_bound,
                "the system without its cyclic coordinates is not the same system", one, other);
    }

    // (D30) along one direction of all unknowns.
    void reduced_jacobian(const Path& X, const Numbers& kappa, const Reduced& reduced) {
        const Routhian& routhian = derivation_.structure.routhian();
        const std::size_t active = routhian.active.size(), cyclic = kappa.size(), controls = control_.size();
        Numbers flat, d;
        Noise noise(9);
        for (const Numbers& positions : X) flat = joined(flat, positions);
        for (std::size_t e = 0; e < flat.size(); ++e) {
            const cln::cl_R& speed = v_[static_cast<std::size_t>(routhian.active[e % active])];
            d.push_back(noise.next() * h_ * (cln::zerop(speed) ? cln::cl_R(1) : cln::abs(speed)));
        }
        flat = joined(flat, kappa);
        for (std::size_t c = 0; c < cyclic; ++c)
            d.push_back(has_multiplier() ? noise.next() * (cln::zerop(P0_[c]) ? cln::cl_R(1) : cln::abs(P0_[c]))
                                         : cln::cl_R(0));
        const auto parts_of = [&](const Numbers& x) {
            Path moved(controls, Numbers(active));
            for (std::size_t e = 0; e < controls * active; ++e) moved[e / active][e % active] = x[e];
            return std::pair{moved, Numbers(x.end() - static_cast<std::ptrdiff_t>(cyclic), x.end())};
        };
        compare_with_differences("Jacobian of the step against differences", "an entry of the Jacobian is wrong",
                                 jacobian_times(X, kappa, parts_of(d), reduced), [&](const cln::cl_R& e) {
                                     return central_difference(flat, d, e, [&](const Numbers& x) {
                                         const auto [moved, multipliers] = parts_of(x);
                                         return reduced_residual(moved, multipliers, reduced);
                                     });
                                 });
    }

    // (D30) sum_i h b_i T_i^T H_i T_i d with T_i d = (D d/h, B d, kappa pi).
    Numbers jacobian_times(const Path& X, const Numbers& kappa, const std::pair<Path, Numbers>& direction,
                           const Reduced& reduced) {
        const Routhian& routhian = derivation_.structure.routhian();
        const std::size_t active = routhian.active.size(), cyclic = routhian.cyclic.size(), controls = X.size();
        std::vector<GiNaC::ex> entries;
        for (const auto& [place, value] : routhian.second.entries()) entries.push_back(value);
        const std::vector<Id> roots = formulas_.convert(entries);
        Numbers sums(controls * active + cyclic, cln::cl_R(0));
        for (std::size_t i = 0; i < nodes_.size(); ++i) {
            reduced(i, X, kappa);
            const Numbers H = formulas_.evaluate(roots);
            Numbers dz(2 * active + cyclic, cln::cl_R(0)), w = dz;
            for (std::size_t a = 0; a < active; ++a)
                for (std::size_t j = 0; j < controls; ++j) {
                    dz[a] = dz[a] + D(i, j) * direction.first[j][a] / h_;
                    dz[active + a] = dz[active + a] + B(i, j) * direction.first[j][a];
                }
            for (std::size_t c = 0; c < cyclic; ++c) dz[2 * active + c] = legendre_[i] * direction.second[c];
            std::size_t next = 0;
            for (const auto& [place, value] : routhian.second.entries()) {
                cln::cl_R& sum = w[static_cast<std::size_t>(place.first)];
                sum = sum + H[next++] * dz[static_cast<std::size_t>(place.second)];
            }
            for (std::size_t a = 0; a < active; ++a)
                for (std::size_t j = 0; j < controls; ++j)
                    sums[j * active + a] =
                        sums[j * active + a] + weights_[i] * (D(i, j) * w[a] + h_ * B(i, j) * w[active + a]);
            for (std::size_t c = 0; c < cyclic; ++c)
                sums[controls * active + c] =
                    sums[controls * active + c] + h_ * weights_[i] * legendre_[i] * w[2 * active + c];
        }
        return sums;
    }

    // (D12, D16) M times the stage equations is a sum of the slopes R_j = dL_d/dQ_j + delta_j0 p0:
    // h sum_j C_ij R_j, C_i0 = -c_i, C_ij = (B G)_ij - c_i (1 - x_j), of straight paths G_ij - ...
    void stage_equations() {
        const Quadrature& quadrature = derivation_.quadrature;
        const bool lobatto = quadrature.method.family == Family::lobatto;
        const std::size_t s = quadrature.c.size(), stages = s - 2, controls = control_.size(), inner = controls - 2;
        const Numbers c = formulas_(quadrature.c), b = formulas_(quadrature.b), A = values_of(quadrature.A),
                      G = values_of(quadrature.G);
        const Path X = path(q_, v_);
        Path R = slopes(X);
        const Numbers p0 = [&] {
            set(system_.q, q_);
            set(system_.v, v_);
            return formulas_.evaluate(momentum_);
        }();
        for (std::size_t k = 0; k < n_; ++k) R[0][k] = R[0][k] + p0[k];
        const std::vector<Id> gradient = formulas_.convert(system_.gradient);
        std::vector<GiNaC::ex> mass;
        for (const auto& [place, value] : system_.mass.entries()) mass.push_back(value);
        const Numbers M = formulas_(mass);
        const auto times_mass = [&](const Numbers& x) {
            Numbers product(n_, cln::cl_R(0));
            std::size_t next = 0;
            for (const auto& [place, value] : system_.mass.entries()) {
                cln::cl_R& sum = product[static_cast<std::size_t>(place.first)];
                sum = sum + M[next++] * x[static_cast<std::size_t>(place.second)];
            }
            return product;
        };
        // Positions and grad V at the nodes of the list; those of no weight are not needed.
        Path Y(s), grad(s, Numbers(n_, cln::cl_R(0)));
        for (std::size_t i = 0; i < s; ++i) {
            if (is_straight_) {
                formulas_.set(system_.t, t0_ + c[i] * h_);
                set(system_.q, X[i]);
            } else if (!lobatto && (i == 0 || i + 1 == s)) {
                Y[i] = i == 0 ? X.front() : X.back();
                continue;
            } else {
                set_node(lobatto ? i : i - 1, X, system_.q, system_.v);
            }
            Y[i] = values_of(system_.q);
            grad[i] = formulas_.evaluate(gradient);
        }
        Numbers one, other;
        for (std::size_t i = 1; i < s; ++i) {
            Numbers moved;
            for (std::size_t k = 0; k < n_; ++k) moved.push_back(Y[i][k] - X[0][k]);
            Numbers F = times_mass(moved);
            const std::size_t row = lobatto ? i : i - 1;
            for (std::size_t k = 0; k < n_; ++k) {
                F[k] = F[k] - h_ * c[i] * (p0[k] - h_ * b[0] * grad[0][k]);
                for (std::size_t j = 1; j <= stages; ++j)
                    F[k] = F[k] + h_ * h_ * (i + 1 < s ? A[(i - 1) * stages + j - 1] : b[j] * (1 - c[j])) * grad[j][k];
                cln::cl_R sum = -c[i] * R[0][k];
                for (std::size_t j = 1; j <= inner; ++j) {
                    cln::cl_R C = -c[i] * (1 - control_[j]);
                    if (is_straight_ && i + 1 < s) C = C + G[(i - 1) * inner + j - 1];
                    for (std::size_t l = 1; l <= inner && i + 1 < s && !is_straight_; ++l)
                        C = C + B(row, l) * G[(l - 1) * inner + j - 1];
                    sum = sum + C * R[j][k];
                }
                one.push_back(F[k]);
                other.push_back(h_ * sum);
            }
        }
        compare("the stage equations combine these", identity_bound,
                "what the kernel solves does not follow from the discrete action", one, other);
    }

    Numbers P0_;  // of the cyclic coordinates
};

}  // namespace

std::vector<Check> check_action(const Derivation& derivation) {
    std::vector<Check> checks;
    at_two_attempts([&](int attempt) {
        std::vector<std::pair<Check, double>> measured;
        Step(derivation, attempt).run(measured);
        if (checks.empty())
            for (const auto& [check, difference] : measured) checks.push_back(check);
        for (std::size_t i = 0; i < checks.size(); ++i) {
            checks[i].measured = std::max(checks[i].measured, measured[i].second);
            checks[i].holds = checks[i].measured <= checks[i].bound;
        }
    });
    return checks;
}

}  // namespace lobatto
