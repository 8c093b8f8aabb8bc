// SPDX-License-Identifier: GPL-2.0-or-later
// The constants of a kernel: shapes, claims, quadrature tables, and the order in which unknowns are solved.
#include "generator/emit/tables.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "generator/emit/function_text.hpp"
#include "generator/mechanics/clock/clock.hpp"
#include "generator/mechanics/derivation.hpp"
#include "generator/mechanics/structure/scaled_mass.hpp"
#include "generator/programs/looped.hpp"

namespace lobatto {

namespace {

void line(std::string& text, const std::string& declaration, const std::string& comment) {
    text += fmt::format("    {:<42}  // {}\n", "static constexpr " + declaration + ";", comment);
}

// One that holds; where none does, KernelDefaults of runtime/kernel/base/contract.hpp says so.
void claim(std::string& text, const std::string& name, bool holds, const std::string& comment) {
    if (holds) line(text, "bool " + name + " = true", comment);
}

// Rows and columns of a sparse matrix.
std::string places(const std::string& of, const std::vector<std::pair<int, int>>& entries) {
    std::vector<int> rows, columns;
    for (const auto& [row, column] : entries) {
        rows.push_back(row);
        columns.push_back(column);
    }
    return integer_table(of + "_row", rows) + integer_table(of + "_column", columns);
}

// The same of a full matrix of so many rows, row by row.
std::string full_places(const std::string& of, int rows) {
    return fmt::format(
        "    static constexpr lobatto::RowOfFull<{0}> {1}_row{{}};\n"
        "    static constexpr lobatto::ColumnOfFull<{0}> {1}_column{{}};\n",
        rows, of);
}

std::vector<std::pair<int, int>> places_of(const SparseMatrix& matrix) {
    std::vector<std::pair<int, int>> result;
    for (const auto& [place, value] : matrix.entries()) result.push_back(place);
    return result;
}

// Which formula each of the summands belongs to.
std::string summand_rows(const std::string& of, const std::vector<std::vector<GiNaC::ex>>& summands) {
    std::vector<int> rows;
    int row = 0;
    for (const std::vector<GiNaC::ex>& of_one : summands) rows.insert(rows.end(), of_one.size(), row++);
    std::string text;
    line(text, fmt::format("int {}_summand_count = {}", of, rows.size()), "by which rounding in formulas is measured");
    return text + integer_table(of + "_summand_row", rows);
}

std::string separable_shapes(const Structure& structure, const System& system, int nodes, Precision precision) {
    std::string text;
    line(text, fmt::format("int points = {}", nodes), "nodes of a step, both ends included");
    claim(text, "is_explicit", structure.is_explicit(), "kicks and drifts in turn");
    if (structure.form() == StepForm::separable) {
        claim(text, "diagonal_part", structure.diagonal_part(),
              "taken into the stage map: the constant part of M^-1 V''");
        claim(text, "neighbours", structure.neighbours() && has_lanes(precision),
              "formulas go along neighbouring coordinates, which lie in lanes");
        if (structure.neighbours() && has_lanes(precision)) {
            line(text, fmt::format("int row_reach = {}", row_reach(structure.elements)),
                 "how far formulas reach from the first coordinate on; -1: their runs begin elsewhere");
            claim(text, "unit_masses", has_unit_masses(system), "forces are accelerations");
            claim(text, "immediate", is_one_pass(structure.elements, structure.separable().fixed_ends, system.q),
                  "coordinates may move one after another, each as soon as its force is known");
        }
        claim(text, "clean", structure.clean(), "round-off-clean steps");
        claim(text, "absorbed", structure.absorbed(), "Newton's iteration has the Jacobian of V's quadratic part");
    }
    line(text, fmt::format("int entries = {}", structure.constant_mass().entries.size()),
         "of M^-1 V'' that are not identically zero");
    return text;
}

std::string general_shapes(const Derivation& d) {
    const Routhian& routhian = d.structure.routhian();
    const auto entries = places_of(routhian.second), mass = places_of(d.system.momentum_v);
    std::string text;
    line(text, fmt::format("int nodes = {}", d.quadrature.nodes.size()), "of the quadrature");
    line(text, fmt::format("int controls = {}", d.quadrature.control.size()), "control points, both ends included");
    line(text, fmt::format("int active = {}", routhian.active.size()), "coordinates that are solved for");
    text += integer_table("active_index", routhian.active);
    line(text, fmt::format("int cyclic = {}", routhian.cyclic.size()), "coordinates whose momenta are constant");
    text += integer_table("cyclic_index", routhian.cyclic);
    line(text, fmt::format("int entries = {}", entries.size()), "of H = d2R/dzdz that are not identically zero");
    text += has_full_matrix(d) ? full_places("entry", 2 * d.system.n) : places("entry", entries);
    line(text, fmt::format("int mass_entries = {}", mass.size()), "of M = d2L/dvdv that are not identically zero");
    text += places("mass", mass);
    claim(text, "mass_needs_velocity",
          d.system.momentum_v.holds_any(d.system.v) && d.system.constraints.empty() && !d.scene.clock,
          "M changes with velocities");
    claim(text, "constant_mass", d.system.constant_mass, "and forces without velocities");
    claim(text, "scaled_mass", uses_scaled_mass(d.scene, d.system, d.structure),
          "M is one function times a constant matrix");
    const bool hamiltonian = d.structure.hamiltonian().has_value();
    claim(text, "hamiltonian", hamiltonian, "velocities and forces are formulas of positions and momenta");
    if (!d.system.constraints.empty()) {
        const auto slopes = places_of(d.system.constraint_q);
        line(text, fmt::format("int constraints = {}", d.system.constraints.size()), "phi(q, t) = 0");
        line(text, fmt::format("int constraint_entries = {}", slopes.size()),
             "of G = dphi/dq that are not identically zero");
        text += places("constraint", slopes) + summand_rows("constraint", d.system.constraint_summands());
    }
    if (!hamiltonian && d.system.momenta_cancel()) text += summand_rows("momentum", d.system.momentum_summands());
    return text;
}

// Where the unknowns of each coordinate stand, and the groups that are solved by themselves.
std::string order_of_unknowns(const Structure& structure) {
    std::vector<int> position, first{0}, bandwidth;
    for (const Group& group : structure.groups) {
        for (std::size_t i = 0; i < group.coordinates.size(); ++i) {
            const auto place = static_cast<std::size_t>(group.coordinates[i]);
            if (position.size() <= place) position.resize(place + 1);
            position[place] = first.back() + static_cast<int>(i);
        }
        first.push_back(first.back() + static_cast<int>(group.coordinates.size()));
        bandwidth.push_back(group.bandwidth);
    }
    std::string text = "    // Unknowns of coordinate a stand at position[a]; groups are solved by themselves.\n";
    text += integer_table("position", position);
    line(text, fmt::format("int group_count = {}", structure.groups.size()), "groups of coupled coordinates");
    return text + integer_table("group_first", first) + integer_table("group_bandwidth", bandwidth);
}

std::string vector_text(const std::string& name, const std::vector<GiNaC::ex>& values, Precision precision,
                        std::string& exact) {
    Graph graph;
    std::string numbers;
    for (const GiNaC::ex& value : values) {
        const Id id = graph.from(value, {});
        const cln::cl_R number = graph.evaluate({}, {id})[static_cast<std::size_t>(id)];
        numbers += (numbers.empty() ? "" : ", ") + formula(graph, graph.constant(number), Notation::cpp, {}, precision);
        exact += (exact.empty() ? "" : "; ") + formula(graph, id, Notation::text);
    }
    return wrapped(fmt::format("    static constexpr real {}[{}] = {{{}}};", name,
                               std::max<std::size_t>(values.size(), 1), numbers),
                   "        ");
}

class Tables {
public:
    Tables(Precision precision, bool shows_exact) : precision_(precision), shows_exact_(shows_exact) {}

    std::string vector(const char* name, const std::vector<GiNaC::ex>& values, const std::string& comment) const {
        std::string exact;
        const std::string text = vector_text(name, values, precision_, exact);
        return wrapped(
                   "    // " + comment + (shows_exact_ && exact.size() < 1000 && !exact.empty() ? ": " + exact : ""),
                   "    //     ") +
               text;
    }
    std::string matrix(const char* name, const GiNaC::matrix& values, const std::string& comment) const {
        std::vector<GiNaC::ex> flat;
        for (unsigned i = 0; i < values.rows(); ++i)
            for (unsigned j = 0; j < values.cols(); ++j) flat.push_back(values(i, j));
        return vector(name, flat, comment + ", row-major");
    }

private:
    Precision precision_;
    bool shows_exact_;
};

}  // namespace

std::string integer_table(const std::string& name, const std::vector<int>& values) {
    std::string numbers;
    for (const int value : values) numbers += (numbers.empty() ? "" : ", ") + std::to_string(value);
    return wrapped(fmt::format("    static constexpr int {}[{}] = {{{}}};", name,
                               std::max<std::size_t>(values.size(), 1), numbers),
                   "        ");
}

std::string number_table(const std::string& name, const std::vector<GiNaC::ex>& values, Precision precision) {
    std::string exact;
    return vector_text(name, values, precision, exact);
}

std::string value_table(const std::string& name, const std::vector<cln::cl_R>& values, Precision precision) {
    Graph graph;
    std::string numbers;
    for (const cln::cl_R& value : values)
        numbers += (numbers.empty() ? "" : ", ") + formula(graph, graph.constant(value), Notation::cpp, {}, precision);
    return wrapped(fmt::format("        static constexpr real {}[{}] = {{{}}};", name, values.size(), numbers),
                   "            ");
}

std::string type_name(Precision precision) {
    if (has_many_digits(precision)) return fmt::format("lobatto::ManyDigits<{}>", bits_of(precision));
    switch (precision) {
        case Precision::single:
            return "float";
        case Precision::double_:
            return "double";
        case Precision::extended:
            return "long double";
        case Precision::double_double:
            return "DoubleDouble";
        default:
            return "__float128";
    }
}

// What is looked for in each step.
std::string watched_shapes(const Scene& scene) {
    std::string text;
    const std::vector<Event> watched = scene.watched();
    if (watched.empty()) return text;
    line(text, fmt::format("int events = {}", watched.size()), "that are watched for");
    std::vector<int> directions, reset_of, passage_of;
    for (const Event& event : watched) directions.push_back(event.direction);
    for (std::size_t w = 0; w < scene.impacts.size(); ++w) {  // of passages, all crossings
        int& direction = directions[scene.outputs.events.size() + scene.run.stops.size() + w];
        const bool passes = scene.impacts[w].passes;
        passage_of.push_back(!passes ? 0 : direction == 0 ? 2 : direction);
        if (passes) direction = 0;
    }
    text += integer_table("event_direction", directions);
    int resets = 0;
    for (const Impact& impact : scene.impacts) reset_of.push_back(impact.reset_position.empty() ? -1 : resets++);
    if (!scene.run.stops.empty())
        line(text, fmt::format("int stops = {}", scene.run.stops.size()), "which end the motion");
    if (!scene.switches.empty()) {
        line(text, fmt::format("int switches = {}", scene.switches.size()),
             "where formulas change; the last parameters are the sides");
        std::vector<int> refraction_of;
        int refractions = 0;
        for (const Switch& one : scene.switches) refraction_of.push_back(one.refracts ? refractions++ : -1);
        line(text, fmt::format("int refractions = {}", refractions), "switches at which the Lagrangian may jump");
        text += integer_table("refraction_of", refraction_of);
    }
    if (scene.impacts.empty()) return text;
    line(text, fmt::format("int impacts = {}", scene.impacts.size()), "walls that throw it back");
    line(text, fmt::format("int resets = {}", resets), "walls with an outcome of their own");
    text += integer_table("reset_of", reset_of);
    const auto passages = std::count_if(passage_of.begin(), passage_of.end(), [](int one) { return one != 0; });
    line(text, fmt::format("int passages = {}", passages), "walls that let the motion pass");
    return text + integer_table("passage_of", passage_of);
}

std::string shapes(const Derivation& d, Precision precision, const std::string& name) {
    const Structure& structure = d.structure;
    static constexpr const char* forms[] = {"linear_map", "separable", "general"};
    const int controls = static_cast<int>(d.quadrature.control.size());
    const bool multiplier = d.scene.method.family == Family::lobatto;
    const int unknowns =
        structure.form() == StepForm::linear_map || structure.is_explicit() ? 0
        : structure.form() == StepForm::separable
            ? d.system.n * (d.quadrature.points - 2)
            : static_cast<int>(structure.routhian().active.size() + d.system.constraints.size()) * (controls - 1) +
                  (multiplier ? static_cast<int>(structure.routhian().cyclic.size()) : 0);
    std::string text = fmt::format("    using real = {};\n\n", type_name(precision));
    text += fmt::format(
        "    static constexpr const char* name = \"{}\";\n    static constexpr const char* digest = \"\";\n"
        "    static constexpr const char* method = \"{}\";\n",
        name, d.quadrature.method.name());
    line(text, fmt::format("lobatto::Form form = lobatto::Form::{}", forms[static_cast<int>(structure.form())]),
         "how a step is taken");
    line(text, fmt::format("int coordinates = {}", d.system.n), "n");
    line(text, fmt::format("int order = {}", d.quadrature.order()), "of accuracy in h");
    line(text, fmt::format("int unknowns = {}", unknowns), "of the equations of a step; 0: none to solve");
    const bool iterates = !structure.full() && d.system.constraints.empty();
    line(text, fmt::format("bool any_number = {}", iterates),
         iterates ? "formulas are templates on the type of numbers: fixed-point iteration first"
                  : "Newton's iteration alone");
    claim(text, "linear", structure.linear, "all second derivatives are constant");
    line(text, fmt::format("bool autonomous = {}", d.system.autonomous), "no formula holds the time");
    line(text, fmt::format("bool has_energy = {}", d.scene.has_energy()), "asked for by the scene");
    line(text, fmt::format("bool has_tangent = {}", has_tangent(d)), "the derivative of a step");
    claim(text, "clocked", d.scene.clock.has_value(), "steps are equally long in tau, dt = clock(q) dtau");
    claim(text, "has_time_coordinate", d.scene.has_time_coordinate(), "the last one (D64)");
    if (d.scene.has_time_coordinate())
        line(text, fmt::format("double pace_exponent = {}", pace_exponent(d.scene.clock->rate).to_double()), "a");
    line(text, fmt::format("int parameter_count = {}", d.scene.parameters.size() - (d.scene.clock ? 1 : 0)),
         d.scene.has_time_coordinate() ? "in the order of the scene; the one after them is sigma (D64)"
         : d.scene.clock               ? "in the order of the scene; the one after them is the energy at the start"
                                       : "in the order of the scene");
    if (const std::size_t inputs = d.system.inputs.size(); inputs > 0) {
        const auto& all = d.scene.parameters;
        const auto first = std::find_if(all.begin(), all.end(), [](const Parameter& one) { return one.is_input; });
        line(text, fmt::format("int inputs = {}", inputs), "parameters that set_inputs() may change before a step");
        line(text, fmt::format("int first_input = {}", first - all.begin()), "which are one after another");
    }
    text += watched_shapes(d.scene);
    if (structure.form() == StepForm::general) return text + general_shapes(d) + order_of_unknowns(structure);
    text += separable_shapes(structure, d.system, d.quadrature.points, precision);
    text += has_full_matrix(d) ? full_places("entry", d.system.n) : places("entry", structure.constant_mass().entries);
    const bool solves = structure.form() == StepForm::separable && !structure.is_explicit();
    return solves ? text + order_of_unknowns(structure) : text;
}

bool has_unit_masses(const System& system) {
    for (int i = 0; i < system.n; ++i)
        if (!(system.mass(i, i) - 1).is_zero()) return false;
    return true;
}

bool has_lanes(Precision precision) {
    return precision == Precision::single || precision == Precision::double_;
}

bool has_tangent(const Derivation& d) {
    return d.scene.outputs.tangent && d.system.n <= tangent_limit && d.system.constraints.empty();
}

std::string tables(const Derivation& d, Precision precision) {
    const Quadrature& rule = d.quadrature;
    const Tables table(precision, !rule.is_explicit());  // of published decimals: their fractions tell nothing
    if (rule.is_explicit()) {
        std::vector<GiNaC::ex> drifts;
        for (std::size_t i = 0; i + 1 < rule.c.size(); ++i) drifts.push_back(rule.c[i + 1] - rule.c[i]);
        return "\n" + table.vector("c", rule.c, "nodes, in units of the step") +
               table.vector("b", rule.b, "kicks at the nodes") +
               table.vector("drift_length", drifts, "between neighbouring nodes");
    }
    if (d.structure.form() != StepForm::general) {
        std::string text = "\n" + table.vector("c", rule.c, "nodes on [0, 1]") +
                           table.vector("b", rule.b, "their weights") +
                           table.matrix("A", rule.A, "stage map A_ij over the interior nodes");
        if (d.structure.form() == StepForm::separable)
            text +=
                table.matrix("E", rule.E, "extrapolation from the nodes of one step to the interior nodes of the next");
        return text;
    }
    return "\n" + table.vector("c", rule.nodes, "quadrature nodes on [0, 1]") +
           table.vector("b", rule.weights, "their weights") + table.vector("control", rule.control, "control points") +
           table.matrix("B", rule.B, "basis polynomials at the nodes, nodes x controls") +
           table.matrix("D", rule.D, "their slopes, nodes x controls") +
           table.matrix("extrapolation", rule.extrapolation, "basis polynomials at 1 + control points") +
           table.vector("legendre_polynomial", rule.legendre, "the Legendre polynomial orthogonal to all slopes") +
           table.matrix("integration", rule.integration, "from 0 to the nodes, over the polynomials on the nodes") +
           table.matrix("reach", rule.reach, "the same to the control points after the first") +
           table.matrix("ahead", rule.ahead, "the polynomials on the nodes at 1 + nodes");
}

}  // namespace lobatto
