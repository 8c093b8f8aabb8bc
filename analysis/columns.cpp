// SPDX-License-Identifier: GPL-2.0-or-later
#include "analysis/columns.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>

#include "generator/mechanics/algebra/sample.hpp"

namespace lobatto {

namespace {

using Parts = TrajectoryRequest::Formulas::Parts;

// What a formula may hold, after the parameters: time, q, v.
std::vector<GiNaC::symbol> motion_of(const Scene& scene) {
    std::vector<GiNaC::symbol> all{scene.time};
    for (const Coordinate& coordinate : scene.coordinates) all.push_back(coordinate.position);
    for (const Coordinate& coordinate : scene.coordinates) all.push_back(coordinate.velocity);
    return all;
}

// Of numbers with more digits, each a sum of `parts` doubles.
class InManyDigits {
public:
    InManyDigits(const Scene& scene, const Parts& parameters, std::recursive_mutex* algebra)
        : parts_(parameters.empty() ? 0 : parameters.size() / scene.parameters.size()),
          motion_(motion_of(scene)),
          algebra_(algebra) {
        for (std::size_t i = 0; i < scene.parameters.size(); ++i)
            formulas_.set(scene.parameters[i].symbol, number(parameters, i));
        for (const GiNaC::symbol& symbol : motion_) formulas_.set(symbol, 0);
        for (const Column& column : scene.outputs.columns)
            columns_.push_back(formulas_.convert({scene.along_motion(column.value)}));
    }

    void operator()(const Parts& time, const Parts& q, const Parts& velocity, Parts& values) {
        std::unique_lock<std::recursive_mutex> lock;
        if (algebra_ != nullptr) lock = std::unique_lock(*algebra_);
        Parts motion = time;
        for (const Parts* part : {&q, &velocity}) motion.insert(motion.end(), part->begin(), part->end());
        std::fill(values.begin(), values.end(), std::nan(""));
        if (!std::all_of(motion.begin(), motion.end(), [](double x) { return std::isfinite(x); })) return;
        parts_ = time.size();
        for (std::size_t i = 0; i < motion_.size(); ++i) formulas_.set(motion_[i], number(motion, i));
        for (std::size_t c = 0; c < columns_.size(); ++c) put(columns_[c], &values[c * parts_]);
    }

private:
    cln::cl_R number(const Parts& numbers, std::size_t i) const {
        cln::cl_R sum = float_of(GiNaC::numeric(0));
        for (std::size_t part = 0; part < parts_; ++part)
            sum = sum + float_of(GiNaC::numeric(numbers[i * parts_ + part]));
        return sum;
    }

    void put(const std::vector<Id>& column, double* value) const {
        try {
            cln::cl_R rest = formulas_.evaluate(column).front();
            for (std::size_t part = 0; part < parts_; ++part) {
                value[part] = cln::double_approx(rest);
                rest = rest - float_of(GiNaC::numeric(value[part]));
            }
        } catch (const DomainError&) {  // it has no value here
        }
    }

    std::size_t parts_;
    std::vector<GiNaC::symbol> motion_;
    std::recursive_mutex* algebra_;
    Formulas formulas_;
    std::vector<std::vector<Id>> columns_;
};

}  // namespace

ColumnFormulas::ColumnFormulas(const Scene& scene) : coordinates_(std::ssize(scene.coordinates)) {
    std::vector<GiNaC::symbol> symbols;
    for (const Parameter& parameter : scene.parameters) symbols.push_back(parameter.symbol);
    for (const GiNaC::symbol& symbol : motion_of(scene)) symbols.push_back(symbol);
    for (const Column& column : scene.outputs.columns) {
        const std::optional<Tape> tape = Tape::of(scene.along_motion(column.value), symbols);
        if (!tape)
            throw InputError(
                fmt::format("{}: the column {} cannot be evaluated along a trajectory", scene.path, column.name));
        tapes_.push_back(*tape);
    }
}

void ColumnFormulas::evaluate(const std::vector<double>& parameters, double time, const std::vector<double>& q,
                              const std::vector<double>& velocity, double* values) const {
    std::vector<double> variables = parameters;
    variables.push_back(time);
    for (const std::vector<double>* part : {&q, &velocity})
        variables.insert(variables.end(), part->begin(), part->begin() + coordinates_);
    for (const Tape& tape : tapes_) {
        const double value = tape(variables);
        *values++ = std::isnan(value) ? std::numeric_limits<double>::quiet_NaN() : value;  // which has no sign then
    }
}

std::vector<std::pair<std::string, std::string>> names_beside(const Scene& scene) {
    std::vector<std::pair<std::string, std::string>> names;
    if (scene.outputs.multipliers)
        for (const Constraint& constraint : scene.constraints) {
            std::string name = "lambda_" + constraint.name;
            while (std::any_of(scene.coordinates.begin(), scene.coordinates.end(),
                               [&](const Coordinate& one) { return name == one.name || name == "p_" + one.name; }))
                name += '_';
            names.emplace_back(name, "");
        }
    for (const Column& column : scene.outputs.columns) names.emplace_back(column.name, column.unit);
    return names;
}

TrajectoryRequest::Formulas columns_of(const Scene& scene, const TrajectoryRequest& request,
                                       std::recursive_mutex* algebra) {
    if (scene.outputs.columns.empty()) return {};
    const bool is_double = request.whole_q.empty();
    if (is_double)
        return {scene.outputs.columns.size(),
                [formulas = ColumnFormulas(scene), parameters = request.parameters](
                    const Parts& time, const Parts& q, const Parts& velocity, Parts& values) {
                    formulas.evaluate(parameters, time.front(), q, velocity, values.data());
                }};
    const auto formulas = std::make_shared<InManyDigits>(scene, request.whole_parameters, algebra);
    return {scene.outputs.columns.size(), [formulas](const Parts& time, const Parts& q, const Parts& velocity,
                                                     Parts& values) { (*formulas)(time, q, velocity, values); }};
}

}  // namespace lobatto
