// SPDX-License-Identifier: GPL-2.0-or-later
// Which of q, v, t and the inputs the derivatives of a system depend on, from their values at sample points.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "generator/mechanics/algebra/sample.hpp"
#include "generator/mechanics/system/occurrences.hpp"
#include "generator/mechanics/system/system.hpp"

namespace lobatto {

[[noreturn]] void refuse_lagrangian(const Scene& scene, const std::string& reason);

class Dependence {
public:
    struct Kind {
        bool zero = true, on_q = false, on_v = false, on_t = false, on_inputs = false;
        bool constant() const { return !on_q && !on_v && !on_t && !on_inputs; }
    };

    Dependence(const Scene& scene, const System& system, const std::vector<GiNaC::symbol>& motion)
        : scene_(scene), system_(system), motion_(motion) {}

    // What is pieced may jump or bend beyond the sampled points, as x/sqrt(x^2) does: what holds it is taken to depend
    // on all that it mentions. Everything else is analytic: constant near a point is constant.
    bool is_broken(const GiNaC::ex& expression) const;
    // Whether something broken holds positions or velocities.
    bool is_bent(const GiNaC::ex& expression) const;

    std::vector<Kind> of(const std::vector<GiNaC::ex>& expressions) const;

    std::shared_ptr<const Formulas> formulas() const { return formulas_; }

private:
    std::vector<Kind> sampled(const std::vector<GiNaC::ex>& expressions) const;

    void examine(Formulas& formulas, const std::vector<Id>& roots, NearStart& point, std::vector<Kind>& kinds) const;

    const Scene& scene_;
    const System& system_;
    const Occurrences motion_;  // q, v, t, inputs
    const std::shared_ptr<Formulas> formulas_ = std::make_shared<Formulas>();
};

}  // namespace lobatto
