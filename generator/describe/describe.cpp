// SPDX-License-Identifier: GPL-2.0-or-later
// A derivation as a list of numbered formulas: which ones, in which order, under which names.
#include "generator/describe/describe.hpp"

#include "generator/describe/writer.hpp"

namespace lobatto {

DescriptionWriter::DescriptionWriter(const Derivation& derivation)
    : d_(derivation),
      n_(static_cast<std::size_t>(derivation.system.n)),
      s_(static_cast<std::size_t>(derivation.quadrature.points)),
      controls_(derivation.quadrature.control.size()),
      lobatto_(derivation.quadrature.method.family == Family::lobatto),
      general_(derivation.structure.form() == StepForm::general),
      written_out_(!derivation.quadrature.is_explicit() && is_written_out(derivation.system, derivation.quadrature)),
      is_paper_scheme_(lobatto_ && s_ == 4 && n_ == 1 && !general_) {
    for (const Coordinate& coordinate : d_.scene.coordinates) {
        taken_.insert(coordinate.name);
        taken_.insert(coordinate.name + "'");
    }
    for (const Parameter& parameter : d_.scene.parameters) taken_.insert(parameter.name);
    if (d_.scene.has_time) taken_.insert(d_.scene.time.get_name());
    taken_.insert("h");
    if (!written_out_) return;
    const Discretisation& disc = d_.discretisation();
    if (d_.scene.has_time) rename(disc.t0, d_.scene.time.get_name() + "_left");
    for (std::size_t i = 0; i < controls_; ++i)
        for (std::size_t k = 0; k < n_; ++k) rename(disc.Q[i][k], fmt::format("{}_{}", name(k), i + 1));
    for (std::size_t k = 0; k < n_; ++k) {
        rename(disc.p0[k], n_ == 1 ? "p_left" : fmt::format("p_{}_left", name(k)));
        rename(disc.p1[k], n_ == 1 ? "p_right" : fmt::format("p_{}_right", name(k)));
    }
    for (std::size_t i = 0; i + 1 < controls_; ++i)
        for (std::size_t k = 0; k < n_; ++k) rename(disc.Q_before[i][k], fmt::format("{}_before_{}", name(k), i + 1));
    if (!lobatto_)
        for (std::size_t i = 1; i + 1 < disc.Y.size(); ++i)
            for (std::size_t k = 0; k < n_; ++k) rename(disc.Y[i][k], fmt::format("{}_stage_{}", name(k), i));
}

Description Describer::run() {
    result_.name = d_.scene.name;
    result_.title = d_.scene.title;
    result_.findings = d_.findings;
    facts();
    quadrature();
    if (general_)
        general_system();
    else
        separable_system();
    if (written_out_ && !general_) discrete_equations();
    if (general_) {
        if (!d_.system.constraints.empty())
            constraints();
        else if (written_out_)
            general_equations();
        if (!d_.structure.routhian().cyclic.empty()) routhian();
        general_step();
    } else if (written_out_) {
        if (lobatto_) full_system();
        if (d_.structure.form() == StepForm::linear_map && n_ == 1)
            propagation_of_one();
        else
            reduced_system();
    }
    return std::move(result_);
}

Description describe(const Derivation& derivation) {
    return Describer(derivation).run();
}

}  // namespace lobatto
