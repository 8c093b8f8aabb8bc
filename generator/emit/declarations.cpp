// SPDX-License-Identifier: GPL-2.0-or-later
// The functions of a kernel: how each is declared and what its comment says.
#include "generator/emit/declarations.hpp"

#include <algorithm>
#include <set>

namespace lobatto {

namespace {

const char* const in = "const real*";
const char* const out = "real*";

const Declaration of_events = {"event", "What is watched, at a state: the scene's events, stops and walls.",
                               "void",  {{in, "q"}, {in, "velocity"}, {out, "value"}},
                               true,    true};
const Declaration of_impacts = {"impact",
                                "(D52) Of each wall g(q, t) = 0: dg/dq, dg/dt at fixed q, its restitution, and the "
                                "speed below which the motion comes to rest there.",
                                "void",
                                {{in, "q"}, {out, "G"}, {out, "g_t"}, {out, "restitution"}, {out, "rest"}},
                                true};
const Declaration of_refractions = {"refraction",
                                    "(D67) Of each switch u(q, t) = 0 at which L may jump: du/dq, du/dt at fixed q.",
                                    "void",
                                    {{in, "q"}, {out, "G"}, {out, "g_t"}},
                                    true};
const Declaration of_resets = {"reset",
                               "The state after each impact that the scene gives one.",
                               "void",
                               {{in, "q"}, {in, "velocity"}, {out, "q1"}, {out, "velocity1"}},
                               true};

const std::vector<Declaration>& separable() {
    static const std::vector<Declaration> table = {
        {"energy",
         "(D3) Hamiltonian H(q, p) = p^T M^-1 p / 2 + V(q); q, p: n.",
         "real",
         {{in, "q"}, {in, "p"}},
         true,
         true},
        {"momentum", "(D2) p = dL/dq' = M q'; n each.", "void", {{in, "velocity"}, {out, "p"}}, false, true},
        {"velocity", "(D2) q' = M^-1 p; n each.", "void", {{in, "p"}, {out, "velocity"}}, false, true},
        {"node",
         "(D1) At one node: W = M^-1 grad V(q), n, and S = the entries of M^-1 V''(q) listed in entry_row, "
         "entry_column.",
         "void",
         {{in, "q"}, {out, "W"}, {out, "S"}},
         true,
         true},
        {"minus_acceleration", "(D1) W = M^-1 grad V(q) alone; n.", "void", {{in, "q"}, {out, "W"}}, true, true},
        {"propagate",
         "(D20) The whole step: (q1, p1) = Phi (q, p) + shift, as (q, p) + (Phi - I) (q, p) + shift.",
         "void",
         {{in, "q"}, {in, "p"}, {out, "q1"}, {out, "p1"}},
         false,
         true},
        {"quadratic_part",
         "(D31) S0 = the part of M^-1 V'' that does not depend on q; its entries as those of S.",
         "void",
         {{out, "S0"}}},
        of_events,
        of_impacts,
        of_resets,
        of_refractions,
    };
    return table;
}

const std::vector<Declaration>& general() {
    static const std::vector<Declaration> table = {
        {"energy",
         "(D26) Energy H = velocity . dL/dvelocity - L; q, velocity: n.",
         "real",
         {{in, "q"}, {in, "velocity"}},
         true,
         true},
        {"clock", "(D42) g = dt/dtau; q: n.", "real", {{in, "q"}}, true, true},
        {"constraint",
         "(D44) phi(q, t), dphi/dt at fixed q, and the entries of G = dphi/dq listed in constraint_row, "
         "constraint_column.",
         "void",
         {{in, "q"}, {out, "phi"}, {out, "phi_t"}, {out, "G"}},
         true,
         true},
        {"constraint_summands",
         "Of the constraints in constraint_summand_row: phi is rounded by epsilon times the sum of the sizes of its T.",
         "void",
         {{in, "q"}, {out, "T"}},
         true,
         true},
        {"multiplier_terms",
         "(D49) Of M a - G^T lambda = r, G a = s, which give accelerations a and multipliers lambda: r, n, and s.",
         "void",
         {{in, "q"}, {in, "velocity"}, {out, "r"}, {out, "s"}},
         true,
         true},
        {"momentum", "(D2) p = dL/dvelocity; n each.", "void", {{in, "q"}, {in, "velocity"}, {out, "p"}}, true, true},
        {"momentum_summands",
         "Of the momenta in momentum_summand_row: p is rounded by epsilon times the sum of the sizes of its T.",
         "void",
         {{in, "q"}, {in, "velocity"}, {out, "T"}},
         true,
         true},
        {"legendre",
         "(D27) p and its derivative M in the velocity, the entries listed in mass_row, mass_column.",
         "void",
         {{in, "q"}, {in, "velocity"}, {out, "p"}, {out, "M"}},
         true,
         true},
        {"stage",
         "(D35) Lv = dL/dvelocity, Lq = dL/dq + F, n each, and M = dLv/dvelocity as in legendre; where masses are "
         "scaled, one over its first entry alone.",
         "void",
         {{in, "q"}, {in, "velocity"}, {out, "Lv"}, {out, "Lq"}, {out, "M"}},
         true,
         true},
        {"velocity", "(D62) velocity = dH/dp; n each.", "void", {{in, "q"}, {in, "p"}, {out, "velocity"}}, true, true},
        {"force",
         "(D62) dL/dq + F at the momentum of this velocity; n each.",
         "void",
         {{in, "q"}, {in, "velocity"}, {in, "p"}, {out, "F"}},
         true,
         true},
        {"slopes",
         "Lv = dL/dvelocity and Lq = dL/dq + F; n each.",
         "void",
         {{in, "q"}, {in, "velocity"}, {out, "Lv"}, {out, "Lq"}},
         true,
         true},
        {"node",
         "(D25) At one node, z = (velocities, positions of the active coordinates, momenta of the cyclic ones, "
         "multipliers): g = dR/dz, with the force beside dR/dq, and the entries of H = dg/dz listed in entry_row, "
         "entry_column.",
         "void",
         {{in, "z"}, {out, "g"}, {out, "H"}},
         true,
         true},
        {"slope", "(D25) g alone.", "void", {{in, "z"}, {out, "g"}}, true, true},
        of_events,
        of_impacts,
        of_resets,
        of_refractions,
    };
    return table;
}

}  // namespace

const std::vector<Declaration>& declarations(StepForm form) {
    return form == StepForm::general ? general() : separable();
}

// Constants, types and functions of every form that are not in the tables above.
constexpr const char* names_of_members[] = {"name",
                                            "digest",
                                            "method",
                                            "form",
                                            "autonomous",
                                            "has_energy",
                                            "has_tangent",
                                            "events",
                                            "clocked",
                                            "has_time_coordinate",
                                            "pace_exponent",
                                            "angles",
                                            "coordinates",
                                            "points",
                                            "order",
                                            "unknowns",
                                            "linear",
                                            "absorbed",
                                            "clean",
                                            "is_explicit",
                                            "row_reach",
                                            "unit_masses",
                                            "immediate",
                                            "drift_length",
                                            "any_number",
                                            "uses_hessian",
                                            "diagonal_part",
                                            "neighbours",
                                            "parameter_count",
                                            "entries",
                                            "entry_row",
                                            "entry_column",
                                            "c",
                                            "b",
                                            "A",
                                            "E",
                                            "B",
                                            "D",
                                            "control",
                                            "extrapolation",
                                            "nodes",
                                            "controls",
                                            "active",
                                            "active_index",
                                            "cyclic",
                                            "cyclic_index",
                                            "mass_entries",
                                            "mass_row",
                                            "mass_column",
                                            "mass_needs_velocity",
                                            "constant_mass",
                                            "scaled_mass",
                                            "hamiltonian",
                                            "constraints",
                                            "constraint_entries",
                                            "constraint_row",
                                            "constraint_column",
                                            "constraint_summand_count",
                                            "constraint_summand_row",
                                            "momentum_summand_count",
                                            "momentum_summand_row",
                                            "position",
                                            "group_count",
                                            "group_first",
                                            "group_bandwidth",
                                            "legendre_polynomial",
                                            "integration",
                                            "reach",
                                            "ahead",
                                            "event_direction",
                                            "stops",
                                            "impacts",
                                            "resets",
                                            "switches",
                                            "reset_of",
                                            "refractions",
                                            "refraction_of",
                                            "passages",
                                            "passage_of",
                                            "parameter",
                                            "prepare",
                                            "inputs",
                                            "first_input",
                                            "set_inputs",
                                            "Parameters",
                                            "Coefficients",
                                            "CoefficientsOf",
                                            "discrete_energy",
                                            "real"};
const std::set<std::string>& member_names() {
    static const std::set<std::string> names(std::begin(names_of_members), std::end(names_of_members));
    return names;
}

bool is_member_name(const std::string& name) {
    const auto is_function = [&](StepForm form) {
        return std::any_of(declarations(form).begin(), declarations(form).end(),
                           [&](const Declaration& declaration) { return declaration.program == name; });
    };
    // Those of measured values (generator/formula/spline.hpp).
    const bool is_table = name.starts_with("table_") && name.size() == 13 &&
                          name.find_first_not_of("0123456789abcdef", 6) == std::string::npos;
    return is_table || member_names().contains(name) || is_function(StepForm::separable) ||
           is_function(StepForm::general);
}

}  // namespace lobatto
