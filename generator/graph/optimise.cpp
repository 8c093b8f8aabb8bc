// SPDX-License-Identifier: GPL-2.0-or-later
// All passes in order, each counted and checked at 40 digits.
#include "generator/graph/optimise.hpp"

#include <cln/cln.h>

#include <algorithm>
#include <array>
#include <map>
#include <optional>
#include <set>
#include <stdexcept>

#include "generator/formula/real.hpp"

namespace lobatto {

namespace {

cln::float_format_t format_of_samples() {
    return cln::float_format(static_cast<std::uintptr_t>(working_digits()));
}

// Seeded sample values: the same on every machine.
class Samples {
public:
    explicit Samples(std::uint64_t seed) : state_(seed * 2654435761u + 12345u) {}
    cln::cl_R next() {
        state_ = state_ * 6364136223846793005u + 1442695040888963407u;
        const auto bits = static_cast<unsigned long>(state_ >> 34);  // 30 bits
        return cln::cl_float(cln::cl_RA(cln::cl_I(bits) * 7 + 1) / cln::cl_I(1ul << 33), format_of_samples()) +
               cln::cl_RA("1/16");
    }

private:
    std::uint64_t state_;
};

constexpr int any_seeds = 20;

// The value of an output, and the largest number met on the way to it: what rounding is measured against.
struct Sampled {
    cln::cl_R value, largest;
};

// The values of all outputs at the seed's point; nothing when one of them is not real there.
std::optional<std::vector<Sampled>> outputs_at(const Programs& programs, std::uint64_t seed) {
    Samples samples(seed);
    std::vector<cln::cl_R> inputs;
    // Anywhere in (0, 1) first; where that leaves the real numbers, ever nearer to the scene's own values.
    for (const Input& input : programs.graph.inputs()) {
        const cln::cl_R sample = samples.next();
        const cln::cl_R start = cln::cl_float(input.start, format_of_samples());
        const cln::cl_R nearness =
            cln::scale_float(cln::cl_float(1, format_of_samples()), -(static_cast<int>(seed) - any_seeds) / 4);
        inputs.push_back(static_cast<int>(seed) <= any_seeds ? sample
                                                             : start + nearness * (sample - cln::cl_RA("1/2")));
    }
    try {
        const std::vector<Id> roots = roots_of(programs);
        const std::vector<cln::cl_R> values = programs.graph.evaluate(inputs, roots);
        std::vector<cln::cl_R> largest(values.size());
        for (const Id id : programs.graph.topological(roots)) {
            cln::cl_R& here = largest[static_cast<std::size_t>(id)];
            here = cln::abs(values[static_cast<std::size_t>(id)]);
            for (const Id operand : programs.graph[id].operands)
                here = cln::max(here, largest[static_cast<std::size_t>(operand)]);
        }
        std::vector<Sampled> outputs;
        for (const Program& program : programs.programs)
            for (const Output& output : program.outputs) {
                const auto place = static_cast<std::size_t>(output.value);
                outputs.push_back({values[place], largest[place]});
            }
        return outputs;
    } catch (const DomainError&) {
        return std::nullopt;
    }
}

double disagreement(const std::vector<Sampled>& before, const std::vector<Sampled>& after) {
    double worst = 0;
    for (std::size_t i = 0; i < before.size(); ++i) {
        const cln::cl_R difference = cln::abs(before[i].value - after[i].value);
        // A value that cancels to nothing leaves rounding only, 60 digits below what it is made of: not a difference.
        if (difference <= before[i].largest * cln::expt(cln::cl_RA(10), -50)) continue;
        worst = std::max(
            worst, cln::double_approx(difference / cln::max(cln::abs(before[i].value), cln::abs(after[i].value))));
    }
    return worst;
}

}  // namespace

Operations count(const Graph& graph, const std::vector<Id>& nodes) {
    Operations operations;
    std::map<Id, int> uses;
    for (const Id id : nodes)
        for (const Id operand : graph[id].operands) ++uses[operand];
    for (const Id id : nodes) {
        const Node& node = graph[id];
        if (node.phase == Phase::constant) continue;
        // A reciprocal known earlier is hoisted, one used twice has a name: then it is a factor like others.
        const auto is_reciprocal = [&](Id operand) {
            return graph[operand].op == Op::power && graph[operand].index < 0 && graph[operand].phase == node.phase &&
                   uses[operand] == 1;
        };
        switch (node.op) {
            case Op::constant:
            case Op::input:
            case Op::pair_sine:
            case Op::pair_cosine:
                break;
            case Op::add:
                operations.additions += static_cast<long>(node.operands.size()) - 1;
                break;
            case Op::multiply: {
                // Numerator and denominator are products of their own; a reciprocal turns its multiplication into the
                // division counted with it.
                long factors = 0, reciprocals = 0;
                for (const Id operand : node.operands) {
                    if (is_reciprocal(operand))
                        ++reciprocals;
                    else if (!graph.is_number(operand, 1) && !graph.is_number(operand, -1))
                        ++factors;
                }
                operations.multiplications += std::max(factors - 1, 0L) + std::max(reciprocals - 1, 0L);
                operations.divisions += reciprocals > 0 ? 1 - reciprocals : 0;
                break;
            }
            case Op::power:
                operations.multiplications += std::abs(node.index) - 1;
                operations.divisions += node.index < 0 ? 1 : 0;
                break;
            default:
                ++operations.functions;
                break;
        }
    }
    return operations;
}

Operations count(const Programs& programs) {
    Operations sum;
    const auto accumulate = [&](const std::vector<Id>& nodes) {
        const Operations part = count(programs.graph, nodes);
        sum.additions += part.additions;
        sum.multiplications += part.multiplications;
        sum.divisions += part.divisions;
        sum.functions += part.functions;
    };
    std::set<Id> hoisted;
    for (const Program& program : programs.programs) {
        std::vector<Id> roots, here;
        for (const Output& output : program.outputs) roots.push_back(output.value);
        for (const Id id : programs.graph.topological(roots)) {
            if (programs.graph[id].phase <= Phase::step_size)
                hoisted.insert(id);
            else
                here.push_back(id);
        }
        accumulate(here);
    }
    accumulate({hoisted.begin(), hoisted.end()});
    return sum;
}

std::vector<PassReport> optimise(Programs& programs) {
    struct Pass {
        const char* name;
        Programs (*run)(const Programs&);
        bool only_if_cheaper;
    };
    constexpr std::array<Pass, 7> passes = {{{"fold constants", fold_constants, false},
                                             {"factor sums (Horner)", factor_sums, true},
                                             {"powers by multiplication", multiply_powers, false},
                                             {"group by phase", group_by_phase, false},
                                             {"share common parts", share_pairs, true},
                                             {"sums of angles", add_angles, false},
                                             {"pair sines and cosines", pair_sines, false}}};
    // Sample points at which everything is real: the first two of 180 seeds.
    std::vector<std::pair<std::uint64_t, std::vector<Sampled>>> expected;
    for (std::uint64_t seed = 1; seed <= 180 && expected.size() < 2; ++seed)
        if (auto values = outputs_at(programs, seed)) expected.emplace_back(seed, std::move(*values));
    if (expected.empty())
        throw DomainError(
            "the formulas of this scene have no real value at any of 180 sample points, the nearest 2^-40 from its "
            "start");

    std::vector<PassReport> reports{{"as derived", count(programs), 0}};
    for (const Pass& pass : passes) {
        Programs result = pass.run(programs);
        PassReport report{pass.name, count(result), 0};
        for (const auto& [seed, values] : expected) {
            const auto now = outputs_at(result, seed);
            report.disagreement = std::max(report.disagreement, now ? disagreement(values, *now) : 1.0);
        }
        if (!(report.disagreement < 1e-40)) throw std::logic_error("the pass '" + report.pass + "' changed a value");
        if (pass.only_if_cheaper && report.after.total() >= reports.back().after.total())
            report.after = reports.back().after;
        else
            programs = std::move(result);
        reports.push_back(report);
    }
    return reports;
}

}  // namespace lobatto
