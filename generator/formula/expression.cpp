// SPDX-License-Identifier: GPL-2.0-or-later
// Walks the tree of a formula, with a value for each index; what cannot be computed is refused where it stands.
#include "generator/formula/expression.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <utility>

#include "generator/formula/spline.hpp"
#include "generator/formula/switch.hpp"

namespace lobatto {
namespace {

using GiNaC::ex;
using GiNaC::ex_to;
using GiNaC::is_a;
using GiNaC::numeric;
using Kind = Syntax::Kind;

std::string idle_text(bool is_condition) {
    return fmt::format(
        "{} over whole stretches of the motion, where this formula is undecided; write one that changes its sign at "
        "single moments, such as x > 0 in place of max(x, 0) > 0",
        is_condition ? "both sides of this condition stay equal" : "the argument of this sign stays 0");
}

class Evaluator {
public:
    Evaluator(const Source& source, Work& work, Names* names, bool motion_allowed)
        : source_(source), work_(work), names_(names), motion_allowed_(motion_allowed) {}

    // The indices a formula has, by name and value; and how to speak of it.
    struct Frame {
        const std::string& formula;
        std::vector<std::pair<std::string, long>> indices;
    };

    Operand evaluate(const Syntax& formula, Frame& frame) {
        const Arithmetic arithmetic(frame.formula, work_);
        spend(formula.at, frame, 1);
        if (++depth_ > deepest) fail_depth(formula.at, frame);
        Operand result = value_of(formula, frame, arithmetic);
        --depth_;
        return result;
    }

    void spend(const Token& at, const Frame& frame, double operations) const {
        try {
            work_.spend(operations);
        } catch (const Refusal& refusal) {
            fail(at, frame, refusal.what());
        }
    }

    // A value that is needed as a whole number: a subscript, a bound.
    long whole(const Syntax& formula, Frame& frame, const std::string& what) {
        const ex value = evaluate(formula, frame).expression;
        if (!is_a<numeric>(value))
            fail(formula.at, frame,
                 fmt::format("{} must be known when the kernel is written: numbers, indices and parameters declared "
                             "constant, such as n = {{ value = 8, constant = true }}{}",
                             what, what.starts_with("what mod") ? mod_advice : ""));
        const numeric number = ex_to<numeric>(value);
        if (!number.is_integer())
            fail(formula.at, frame, fmt::format("{} must be a whole number, not {:.6g}", what, number.to_double()));
        if (abs(number) > largest) fail(formula.at, frame, fmt::format("{} is beyond {}", what, largest));
        return number.to_long();
    }

private:
    static constexpr const char* mod_advice =
        ". For what repeats in time write sin(2*pi*t/T), for a square wave sign(sin(2*pi*t/T))";
    static constexpr int deepest = 1000;            // nodes in nodes, those of definitions too
    static constexpr long largest = 1'000'000'000;  // subscript or bound

    [[noreturn]] void fail(const Token& at, const Frame& frame, std::string message) const {
        std::string indices;
        for (const auto& [name, value] : frame.indices)
            indices += fmt::format("{}{} = {}", indices.empty() ? "" : ", ", name, value);
        if (!indices.empty()) message += fmt::format(" ({})", indices);
        source_.fail(at.at, message);
    }

    [[noreturn]] void fail_depth(const Token& at, const Frame& frame) const {
        fail(at, frame,
             definitions_ > 0
                 ? fmt::format("definitions need one another without end here, or more than {} deep", deepest)
                 : fmt::format("{} is nested more than {} deep", frame.formula, deepest));
    }

    template <typename Compute>
    Operand computed(const Token& at, const Frame& frame, const Compute& compute) const {
        try {
            return compute();
        } catch (const Refusal& refusal) {
            fail(at, frame, refusal.what());
        }
    }

    // Adds or multiplies neighbours in pairs of like length, so that long sums cost n log n and no intermediate number
    // can grow unseen.
    class Fold {
    public:
        using Combine = Operand (Arithmetic::*)(const Operand&, const Operand&) const;
        Fold(const Evaluator& evaluator, const Frame& frame, const Arithmetic& arithmetic, Combine combine)
            : evaluator_(evaluator), frame_(frame), arithmetic_(arithmetic), combine_(combine) {}

        void push(Operand operand, const Token& at) {
            parts_.push_back({std::move(operand), at, 0});
            while (parts_.size() > 1 && parts_[parts_.size() - 2].pairs == parts_.back().pairs) join();
        }
        Operand result() {
            while (parts_.size() > 1) join();
            return std::move(parts_.front().operand);
        }

    private:
        struct Part {
            Operand operand;
            Token at;  // the operator before it
            int pairs;
        };
        void join() {
            const Part right = std::move(parts_.back());
            parts_.pop_back();
            Part& left = parts_.back();
            left.operand = evaluator_.computed(right.at, frame_,
                                               [&] { return (arithmetic_.*combine_)(left.operand, right.operand); });
            ++left.pairs;
        }

        const Evaluator& evaluator_;
        const Frame& frame_;
        const Arithmetic& arithmetic_;
        const Combine combine_;
        std::vector<Part> parts_;
    };

    Operand value_of(const Syntax& formula, Frame& frame, const Arithmetic& arithmetic) {
        const auto operand = [&](std::size_t k) { return evaluate(formula.operands[k], frame); };
        const auto compute = [&](const auto& operation) { return computed(formula.at, frame, operation); };
        switch (formula.kind) {
            case Kind::number:
                return compute([&] { return arithmetic.number(std::string(formula.at.text)); });
            case Kind::pi: {
                static const Operand pi = operand_of(GiNaC::Pi);
                return pi;
            }
            case Kind::index:
                return operand_of(frame.indices[formula.index].second);
            case Kind::name:
                return formula.name->definition ? defined(formula, frame) : declared(formula, frame);
            case Kind::point:
                return point(formula, frame, arithmetic);
            case Kind::sum:
                return folded(formula, frame, arithmetic, &Arithmetic::add);
            case Kind::product:
                return folded(formula, frame, arithmetic, &Arithmetic::multiply);
            case Kind::negation: {
                const Operand a = operand(0);
                return compute([&] { return arithmetic.negate(a); });
            }
            case Kind::inverse: {
                const Operand a = operand(0);
                require(DomainCondition::Kind::nonzero, a, "a division", formula);
                return compute([&] { return arithmetic.invert(a); });
            }
            case Kind::power: {
                const Operand written = operand(0), exponent = operand(1);
                const Operand base =
                    computed(formula.at, frame, [&] { return power_base(written, exponent, arithmetic); });
                require_power(base, exponent, formula);
                return compute([&] { return arithmetic.raise(base, exponent); });
            }
            case Kind::call: {
                const Operand argument = operand(0);
                require_call(formula.function->name, argument, formula);
                return compute([&] { return arithmetic.call(*formula.function, argument); });
            }
            case Kind::series:
                return series(formula, frame, arithmetic);
            case Kind::pieced:
                return pieced(formula, frame, arithmetic);
            case Kind::table:
                return table(formula, frame, arithmetic);
            case Kind::remainder:
                break;
        }
        const long a = whole(formula.operands[0], frame, "what mod divides"),
                   b = whole(formula.operands[1], frame, "what mod divides by");
        if (b <= 0) fail(formula.operands[1].at, frame, fmt::format("mod divides by {}; it must be positive", b));
        return operand_of((a % b + b) % b);
    }

    Operand pieced(const Syntax& formula, Frame& frame, const Arithmetic& arithmetic) {
        std::vector<Operand> parts;
        for (const Syntax& operand : formula.operands) parts.push_back(evaluate(operand, frame));
        return computed(formula.at, frame, [&] {
            const std::string_view name = formula.at.text;
            const auto less = [&](const Operand& a, const Operand& b) {
                return arithmetic.add(a, arithmetic.negate(b));
            };
            if (name == "hypot")
                return arithmetic.call(*find_function("sqrt"), arithmetic.add(arithmetic.multiply(parts[0], parts[0]),
                                                                              arithmetic.multiply(parts[1], parts[1])));
            if (name == "atan2") {
                require(
                    DomainCondition::Kind::nonzero,
                    arithmetic.add(arithmetic.multiply(parts[0], parts[0]), arithmetic.multiply(parts[1], parts[1])),
                    "atan2, which has no value where both of its arguments are 0,", formula);
                return arithmetic.angle(parts[0], parts[1]);
            }
            const bool is_of_one = name == "abs" || name == "sign";
            const Operand u = is_of_one ? parts[0] : less(parts[0], parts[1]);
            if ((name == "sign" || name == "if") && (u.moves || u.velocities) &&
                stays_zero(u.expression, names_->switches))
                fail(formula.at, frame, idle_text(name == "if"));
            const Operand side = side_of(u, formula, frame);
            if (name == "sign" && !u.moves && !u.velocities)  // 0 may be its value for good
                return arithmetic.multiply(operand_of(numeric(1, 2)),
                                           less(side, side_of(arithmetic.negate(u), formula, frame)));
            if (name == "sign") return side;
            if (name == "abs") return with_one_sign(1, arithmetic.multiply(side, u));
            const Operand half = operand_of(numeric(1, 2)), one = operand_of(1);
            const Operand above = arithmetic.multiply(half, arithmetic.add(one, side)),
                          below = arithmetic.multiply(half, less(one, side));
            const bool is_if = name == "if", is_min = name == "min";
            const Operand &first = parts[is_if ? 2 : is_min ? 1 : 0], &second = parts[is_if ? 3 : is_min ? 0 : 1];
            return with_one_sign(sign_of_pieces(u.expression, first.expression, second.expression),
                                 arithmetic.add(arithmetic.multiply(above, first), arithmetic.multiply(below, second)));
        });
    }

    Operand table(const Syntax& formula, Frame& frame, const Arithmetic& arithmetic) {
        const int number = read_table(formula, frame);
        const Spline& spline = spline_of(number);
        const Operand argument = evaluate(formula.operands[0], frame);
        return computed(formula.at, frame, [&] {
            const auto end = [](const cln::cl_R& x) { return operand_of(numeric(cln::rationalize(x))); };
            const Operand first = end(spline.x().front()), last = end(spline.x().back());
            const std::string what = fmt::format("the table {}, which goes from {:.6g} to {:.6g},", spline.file(),
                                                 first.value->to_double(), last.value->to_double());
            const auto least = DomainCondition::Kind::nonnegative;
            require(least, arithmetic.add(argument, arithmetic.negate(first)), what, formula, 0, argument.expression);
            require(least, arithmetic.add(last, arithmetic.negate(argument)), what, formula, 0, argument.expression);
            return arithmetic.table(number, argument);
        });
    }

    // A file beside that of the scene, read once.
    int read_table(const Syntax& formula, const Frame& frame) {
        const std::string name(formula.file.text);
        if (names_ != nullptr)
            if (const auto known = names_->tables.find(name); known != names_->tables.end())
                return known->second.spline;
        const std::filesystem::path path(name);
        const auto refuse = [&](const std::string& why) { fail(formula.file, frame, why); };
        if (name.empty()) refuse("the file of a table has no name");
        if (!is_printable(name) || name.find('\\') != std::string::npos)
            refuse("the name of a table holds no control characters and no backslashes");
        if (path.is_absolute() || std::find(path.begin(), path.end(), "..") != path.end())
            refuse(
                "a table lies in the folder of its scene, or below it: write its place from there, without /.. and "
                "without / at the beginning");
        const std::filesystem::path folder = std::filesystem::path(source_.path()).parent_path(), whole = folder / path;
        std::error_code error;
        if (!std::filesystem::exists(whole, error))
            refuse(fmt::format("there is no file {} for this table", whole.string()));
        if (!std::filesystem::is_regular_file(whole, error))
            refuse(fmt::format("{} is no file that a table can be read from", whole.string()));
        const std::filesystem::path home = std::filesystem::canonical(folder.empty() ? "." : folder, error),
                                    target = std::filesystem::canonical(whole, error);
        if (error || std::mismatch(home.begin(), home.end(), target.begin(), target.end()).first != home.end())
            refuse(fmt::format("{} is a link to a file outside of the folder of the scene; copy the file",
                               whole.string()));
        const int number = number_of(read_spline(Source::read(whole.string(), "table"), name));
        if (names_ != nullptr) names_->tables.emplace(name, TableUse{number, formula.at.at});
        return number;
    }

    // 1 where u > 0, -1 elsewhere: a number where that is known, else the side of a switch.
    Operand side_of(const Operand& u, const Syntax& formula, const Frame& frame) {
        if (u.value) return operand_of(u.value->is_positive() ? 1 : -1);
        if (names_ == nullptr || !motion_allowed_)
            fail(formula.at, frame,
                 fmt::format("{} needs a number here: numbers, indices and parameters declared constant",
                             formula.at.text));
        return as_side(names_->side_of(u.expression, std::string(formula.at.text), frame.formula, formula.at.at), u);
    }

    // Of constants the arithmetic itself finds what has no value.
    void require(DomainCondition::Kind kind, const Operand& part, const std::string& operation, const Syntax& formula,
                 const GiNaC::ex& exponent = 0, const GiNaC::ex& argument = 0) {
        if (kind != DomainCondition::Kind::any && names_ != nullptr && names_->records && !part.value)
            names_->conditions.push_back({kind, part.expression, exponent, argument, operation, formula.at.at});
    }

    // Of x^n with a parameter n that is whole, x may be negative; x^q has a logarithm in its derivative.
    void require_power(const Operand& base, const Operand& exponent, const Syntax& formula) {
        using Kind = DomainCondition::Kind;
        const bool varies = exponent.moves || exponent.velocities || exponent.inputs;
        if (!exponent.value)
            return require(varies ? Kind::positive : Kind::power, base, "a power", formula, exponent.expression);
        const bool negative = exponent.value->is_negative(), whole = exponent.value->is_integer();
        require(DomainCondition::of_base(whole, negative), base, whole ? "a negative power" : "a broken power", formula,
                exponent.expression);
    }

    void require_call(const std::string& function, const Operand& argument, const Syntax& formula) {
        if (function == "sqrt") require(DomainCondition::Kind::nonnegative, argument, "a square root", formula);
        if (function == "log") require(DomainCondition::Kind::positive, argument, "a logarithm", formula);
        if (function == "asin" || function == "acos")
            require(DomainCondition::Kind::within_one, argument, "an " + function, formula);
        if (function == "tan" && !argument.value)
            require(DomainCondition::Kind::nonzero, operand_of(GiNaC::cos(argument.expression)),
                    "a tangent, which has a pole where its cosine is 0,", formula);
    }

    Operand folded(const Syntax& formula, Frame& frame, const Arithmetic& arithmetic, Fold::Combine combine) {
        Fold fold(*this, frame, arithmetic, combine);
        for (std::size_t k = 0; k < formula.operands.size(); ++k)
            fold.push(evaluate(formula.operands[k], frame), formula.signs[k]);
        return fold.result();
    }

    Operand series(const Syntax& formula, Frame& frame, const Arithmetic& arithmetic) {
        const long first = whole(formula.operands[0], frame, "the first index of a sum"),
                   last = whole(formula.operands[1], frame, "the last index of a sum");
        if (first > last) return operand_of(0);
        Fold fold(*this, frame, arithmetic, &Arithmetic::add);
        frame.indices.emplace_back(formula.index_name, first);
        for (long i = first; i <= last; ++i) {
            frame.indices.back().second = i;
            fold.push(evaluate(formula.operands[2], frame), formula.at);
        }
        frame.indices.pop_back();
        return fold.result();
    }

    // A coordinate, a parameter, the time.
    Operand declared(const Syntax& formula, Frame& frame) {
        const Name& name = *formula.name;
        const std::vector<Operand>& elements = formula.primed ? name.velocities : name.values;
        if (!name.array) return elements.front();
        const long k = whole(formula.operands[0], frame, fmt::format("the index of {}", formula.at.text));
        if (k < 1 || k > static_cast<long>(elements.size()))
            fail(formula.at, frame,
                 fmt::format("there is no {0}[{1}]: the array has the elements {0}[1] to {0}[{2}]", formula.at.text, k,
                             elements.size()));
        return elements[static_cast<std::size_t>(k - 1)];
    }

    // x + R[1,1] a + R[1,2] b + R[1,3] c
    Operand point(const Syntax& formula, Frame& frame, const Arithmetic& arithmetic) {
        const Name& name = *formula.name;
        Operand sum = name.definition ? name.definition->values.at({}).value : name.values.front();
        for (std::size_t k = 0; k < name.row.size(); ++k) {
            const Operand part = evaluate(formula.operands[k], frame);
            sum = computed(formula.at, frame,
                           [&] { return arithmetic.add(sum, arithmetic.multiply(name.row[k], part)); });
        }
        return sum;
    }

    Operand defined(const Syntax& formula, Frame& frame) {
        Definition& definition = *formula.name->definition;
        std::vector<long> indices;
        for (const Syntax& subscript : formula.operands)
            indices.push_back(whole(subscript, frame, fmt::format("an index of {}", formula.at.name())));
        for (std::size_t k = 0; k < definition.sizes.size(); ++k)
            if (indices[k] < 1 || indices[k] > definition.sizes[k])
                fail(formula.at, frame,
                     fmt::format("there is no {0}[{1}]: its {2} index goes from 1 to {3}", definition.label,
                                 fmt::join(indices, ","), k == 0 ? "first" : "second", definition.sizes[k]));
        Definition::Value& entry = definition.values[indices];
        if (!entry.complete) {
            if (definition.given)
                fail(formula.at, frame,
                     fmt::format("{} moves, so that {} cannot hold it: write it with numbers and parameters",
                                 definition.label, frame.formula));
            if (entry.needed)
                fail(formula.at, frame,
                     fmt::format("{} needs its own value: definitions must not refer to one another in a circle",
                                 definition.label));
            entry.needed = true;
            Frame own{definition.label, {}};
            for (std::size_t k = 0; k < indices.size(); ++k)
                own.indices.emplace_back(definition.indices[k], indices[k]);
            ++definitions_;
            entry.value = evaluate(definition.formula, own);
            --definitions_;
            entry.complete = true;
        }
        if (!motion_allowed_ && (entry.value.moves || entry.value.velocities))
            fail(formula.at, frame,
                 fmt::format("{} holds coordinates or the time, which cannot occur in {}: write it with numbers and "
                             "parameters",
                             definition.label, frame.formula));
        if (!motion_allowed_ && entry.value.inputs)
            fail(formula.at, frame,
                 fmt::format("{} holds an input, which cannot occur in {}: write it with numbers and parameters",
                             definition.label, frame.formula));
        if (!formula.primed) return entry.value;
        if (entry.value.velocities)
            fail(formula.at, frame,
                 fmt::format("{} holds a velocity, so its time derivative would hold an acceleration",
                             definition.label));
        if (!entry.rate)
            entry.rate = computed(formula.at, frame, [&] {
                return Arithmetic(definition.label, work_).derivative(entry.value, names_->flow);
            });
        return *entry.rate;
    }

    const Source& source_;
    Work& work_;
    Names* names_;
    const bool motion_allowed_;
    int depth_ = 0;
    int definitions_ = 0;
};

Evaluator::Frame frame_of(const Scope& scope, const std::vector<long>& indices) {
    Evaluator::Frame frame{scope.formula, {}};
    for (std::size_t k = 0; k < indices.size(); ++k) frame.indices.emplace_back(scope.indices[k], indices[k]);
    return frame;
}

}  // namespace

Operand evaluate(const Source& source, const Syntax& formula, const Scope& scope, const std::vector<long>& indices) {
    Work own;
    Evaluator::Frame frame = frame_of(scope, indices);
    Work& work = scope.names != nullptr ? scope.names->work : own;
    Evaluator evaluator(source, work, scope.names, scope.motion_allowed);
    Operand result = evaluator.evaluate(formula, frame);
    // Its value will be needed, with 60 digits.
    if (!scope.motion_allowed) evaluator.spend(formula.at, frame, 4 * result.extent.size);
    return result;
}

long evaluate_whole(const Source& source, const Syntax& formula, const Scope& scope) {
    Work own;
    Evaluator::Frame frame = frame_of(scope, {});
    Work& work = scope.names != nullptr ? scope.names->work : own;
    return Evaluator(source, work, scope.names, scope.motion_allowed).whole(formula, frame, scope.formula);
}

ex parse_expression(const Source& source, const Text& text, const Scope& scope) {
    return evaluate(source, parse_formula(source, text, scope), scope).expression;
}

GiNaC::numeric value_in_range(const Source& source, Position at, const ex& expression, const std::string& formula,
                              const GiNaC::exmap& symbols, bool derived) {
    try {
        const numeric value = real_value(expression, symbols);
        const double size = std::fabs(value.to_double());  // 1e-300 itself is in range, though its double is below it
        const double least = derived || value.is_zero() ? 0 : 1e-300;
        if (!(size >= least && size <= 1e300))
            source.fail(at, fmt::format("{} must be 0, or of a size between 1e-300 and 1e300", formula));
        return value;
    } catch (const NoValue& error) {
        source.fail(at, fmt::format("{} has no finite real value: {}", formula, error.what()));
    }
}

}  // namespace lobatto
