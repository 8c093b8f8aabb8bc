// SPDX-License-Identifier: GPL-2.0-or-later
// The keys of a scene file and what they mean: a document in, a Scene out. Every key is described in
// docs/scene_format.md.
#include "generator/scene/scene.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <map>
#include <stdexcept>

#include "generator/formula/expression.hpp"
#include "generator/formula/real.hpp"
#include "generator/formula/switch.hpp"
#include "generator/formula/text/token.hpp"
#include "generator/method/splitting.hpp"
#include "generator/scene/eliminated.hpp"
#include "generator/scene/file/document.hpp"
#include "generator/scene/file/table.hpp"
#include "generator/scene/system_reader.hpp"
#include "generator/scene/time_coordinate.hpp"

namespace lobatto {
namespace {

constexpr std::size_t longest_title = 200;

// The values of the run-time parameters: as given, or else those of the scene.
GiNaC::exmap values_of(const std::vector<Parameter>& parameters, const std::vector<GiNaC::ex>& given) {
    GiNaC::exmap values;
    for (std::size_t k = 0; k < parameters.size(); ++k)
        values[parameters[k].symbol] = real_value(given.empty() ? parameters[k].value : given[k]);
    return values;
}

std::string shown(const GiNaC::numeric& number) {
    return fmt::format("{:.6g}", number.to_double());
}

class Reader {
public:
    explicit Reader(const Source& source)
        : source_(source),
          document_(read_document(source)),
          root_(source, document_.entries, {1, 1}, "a scene", scene_keys()),
          system_(source, root_, scene_) {}

    Scene run(const std::vector<std::string>& kept) {
        scene_.source = source_;
        scene_.path = source_.path();
        scene_.name = identifier_of_file(source_.path());
        scene_.title = scene_.name;
        if (const Entry* title = root_.find("title")) scene_.title = label_of(source_, *title, longest_title);
        system_.read();
        read_method();
        const std::size_t of_motion = system_.conditions().size();
        read_run();
        scene_.conditions = system_.conditions();
        for (std::size_t i = of_motion; i < scene_.conditions.size(); ++i) scene_.conditions[i].of_motion = false;
        read_output();
        system_.read_kept(kept);
        system_.read_view();
        system_.add_switches();
        eliminate_coordinates(scene_);
        system_.require_velocities();
        refuse_beside_impacts();
        for (const auto& [file, use] : system_.tables()) scene_.tables.push_back(use);
        system_.refuse_unused();
        add_time_coordinate(scene_);
        return std::move(scene_);
    }

private:
    [[noreturn]] void fail(Position at, const std::string& message) const { source_.fail(at, message); }

    static std::string identifier_of_file(const std::string& path) {
        std::string name;
        for (const char c : std::filesystem::path(path).stem().string()) {
            const bool fits = is_identifier(std::string("x") + c);
            if (fits && !(c == '_' && name.ends_with('_'))) name += c;
            if (!fits && !name.ends_with('_')) name += '_';
        }
        return is_identifier(name) ? name : (name.starts_with('_') ? "scene" : "scene_") + name;
    }

    int splitting_stages_of(const Entry& entry) const {
        const std::vector<int>& all = splitting_stages();
        const std::string there_are = fmt::format("there are splitting methods with {} stages", fmt::join(all, ", "));
        const auto stages = static_cast<int>(integer_of(source_, entry, all.front(), all.back(), there_are.c_str()));
        if (std::find(all.begin(), all.end(), stages) == all.end()) fail(entry.value.at, there_are);
        return stages;
    }

    void read_numbers(const Entry& entry) {
        const Value& value = entry.value;
        const auto numbers =
            value.kind == Value::Kind::text ? precision_of(value.text.value) : std::optional<Precision>();
        if (!numbers) fail(value.at, "unknown numbers; there are " + precision_list());
        scene_.method.numbers = *numbers;
        need_digits_for(*numbers);
        if (const std::string why = reason_against_numbers(scene_.method); !why.empty()) fail(value.at, why);
    }

    void read_method() {
        const Entry* section = root_.find("method");
        if (section == nullptr) return;
        const Table table(source_, table_of(source_, *section, "[method] with a line points = 4"), section->at,
                          "[method]", keys_of_section("method"));
        const Entry *family = table.find("family"), *points = table.find("points"), *stages = table.find("stages");
        if (family != nullptr) {
            const Value& value = family->value;
            const bool text = value.kind == Value::Kind::text;
            try {
                scene_.method.family = family_of(text ? value.text.value : "");
            } catch (const std::invalid_argument&) {
                fail(value.at, "unknown family; there are \"lobatto\", \"gauss\" and \"splitting\"");
            }
            if (scene_.method.family == Family::gauss) scene_.method.points = 3;
            if (scene_.method.family == Family::splitting) scene_.method.points = 11;
        }
        const bool lobatto = scene_.method.family == Family::lobatto,
                   splitting = scene_.method.family == Family::splitting;
        if (!lobatto && points != nullptr)
            fail(points->at, splitting ? "splitting methods have stages, not points: write stages = 11"
                                       : "Gauss has stages, not points: write stages = 3");
        if (lobatto && stages != nullptr)
            fail(stages->at,
                 "Lobatto has points, not stages: write points = 4, or add family = \"gauss\" or \"splitting\"");
        if (points != nullptr)
            scene_.method.points = static_cast<int>(table.whole(*points, "there is Lobatto with 2 to 12 points"));
        if (stages != nullptr && splitting)
            scene_.method.points = splitting_stages_of(*stages);
        else if (stages != nullptr)
            scene_.method.points =
                static_cast<int>(integer_of(source_, *stages, 1, 10, "there is Gauss with 1 to 10 stages"));
        if (const Entry* tolerance = table.find("tolerance")) {
            GiNaC::numeric value = 0;
            system_.read_formula(*tolerance, system_.scope_of("the tolerance", false), &value);
            scene_.method.tolerance = value.to_double();
            if (!(scene_.method.tolerance > 0 && scene_.method.tolerance <= 0.001))
                fail(tolerance->value.at, fmt::format("the tolerance is {}; it must be above 0 and at most 0.001; "
                                                      "leave it out to iterate to rounding",
                                                      shown(value)));
        }
        if (scene_.method.tolerance > 0 && splitting)
            fail(table.find("tolerance")->at, "splitting methods iterate nothing; leave out the tolerance");
        if (const Entry* clock = table.find("clock")) read_clock(*clock);
        if (const Entry* arithmetic = table.find("arithmetic")) {
            const Value& value = arithmetic->value;
            const bool text = value.kind == Value::Kind::text;
            if (!text || (value.text.value != "plain" && value.text.value != "clean"))
                fail(value.at, "unknown arithmetic; there are \"plain\" and \"clean\"");
            if (value.text.value == "clean") scene_.method.arithmetic = StepArithmetic::clean;
            if (scene_.method.arithmetic == StepArithmetic::clean && scene_.method.tolerance > 0)
                fail(
                    value.at,
                    "clean arithmetic iterates until nothing changes, so a tolerance has no meaning; leave one of both "
                    "out");
        }
        if (const Entry* numbers = table.find("numbers")) read_numbers(*numbers);
    }

    void read_clock(const Entry& entry) {
        const Scope scope = system_.scope_of("the clock", true);
        Clock clock;
        const Position at = entry.value.at;
        clock.at = at;
        if (!scene_.inputs().empty())
            fail(at,
                 "a clock knows no inputs, which change the energy between steps; remove the clock, or declare the "
                 "inputs under [parameters]");
        if (entry.value.kind == Value::Kind::text) clock.text = collapsed(entry.value.text.value);
        clock.is_automatic = clock.text == "auto";
        if (clock.is_automatic) {
            scene_.clock = clock;
            return;
        }
        const Operand rate = evaluate(source_, parse_formula(source_, formula_of(source_, entry), scope), scope);
        if (rate.velocities)
            fail(at, "a clock is a formula of positions, parameters and the time, such as \"sqrt(x^2 + y^2)\"");
        const bool moves = std::any_of(scene_.coordinates.begin(), scene_.coordinates.end(),
                                       [&](const Coordinate& one) { return rate.expression.has(one.position); });
        if (!rate.moves || !(moves || rate.expression.has(scene_.time)))
            fail(at, "this clock holds no position and no time, so that all its steps are equal; leave it out");
        clock.rate = rate.expression;
        scene_.clock = clock;
    }

    void read_run() {
        const std::string example = "[run] with lines step = 0.05 and until = 10";
        const Entry& section = root_.get("run", example);
        const Table table(source_, table_of(source_, section, example), section.at, "[run]", keys_of_section("run"));
        const Entry* step = table.find("step");
        const Entry* per_period = table.find("steps_per_period");
        const Entry* period = table.find("period");
        if (step == nullptr && per_period == nullptr)
            fail(table.at(), "[run] has no step; add step = 0.05, or steps_per_period and period");
        if (step != nullptr && per_period != nullptr)
            fail(per_period->at, "[run] has both step and steps_per_period; keep one");
        if (step != nullptr && period != nullptr)
            fail(period->at, "period goes with steps_per_period; with step it has no meaning");
        const Entry& length =
            step != nullptr
                ? *step
                : table.get("period", "the period that has these steps, for example period = \"2*pi/omega\"");
        const Scope scope = system_.scope_of(step != nullptr ? "the step" : "the period", false);
        GiNaC::numeric h = 0;
        scene_.run.step = system_.read_formula(length, scope, &h);
        scene_.run.step_at = length.value.at;
        if (!h.is_positive())
            fail(length.value.at, fmt::format("{} is {}; it must be positive", scope.formula, shown(h)));
        if (per_period != nullptr) {
            const long long count = table.whole(*per_period, "at least 1 and at most 9e15");
            scene_.run.step = scene_.run.step / GiNaC::numeric(static_cast<long>(count));
            h = h / GiNaC::numeric(static_cast<long>(count));
        }
        const Entry& until = table.get("until", "the end time, for example until = 10");
        GiNaC::numeric end = 0;
        scene_.run.until = system_.read_formula(until, system_.scope_of("the end time", false), &end);
        if (end.is_negative())
            fail(until.value.at,
                 fmt::format("the end time is {}; it must not be negative: a run starts at time 0", shown(end)));
        if (end > h * GiNaC::numeric(static_cast<long>(most_steps)))
            fail(until.value.at,
                 fmt::format("the run has {} steps; at most 9e15: make until smaller or the step larger",
                             shown(end / h)));
        if (const Entry* assemble = table.find("assemble")) {
            scene_.run.assemble = boolean_of(source_, *assemble);
            if (scene_.constraints.empty())
                fail(assemble->at, "without constraints there is nothing to assemble; leave it out");
        }
        if (const Entry* stop = table.find("stop")) scene_.run.stops = system_.read_events(*stop, "stop");
        if (const Entry* beyond = table.find("beyond_horizon"))
            scene_.run.beyond_horizon = boolean_of(source_, *beyond);
        if (const Entry* error = table.find("error")) {
            GiNaC::numeric value = 0;
            system_.read_formula(*error, system_.scope_of("the error", false), &value);
            scene_.run.error = value.to_double();
            if (!(scene_.run.error >= Run::least_error && scene_.run.error <= Run::largest_error))
                fail(error->value.at,
                     fmt::format("the error is {}; it is relative to the amplitude of the motion, at least {:.0e} and "
                                 "at most {}",
                                 shown(value), Run::least_error, Run::largest_error));
        }
    }

    void read_output() {
        const Entry* section = root_.find("output");
        if (section == nullptr) return;
        const Table table(source_, table_of(source_, *section, "[output] with a line every = 1"), section->at,
                          "[output]", keys_of_section("output"));
        Outputs& outputs = scene_.outputs;
        const Entry* every = table.find("every");
        if (every != nullptr && scene_.clock) {
            GiNaC::numeric value = 0;
            outputs.interval = system_.read_formula(*every, system_.scope_of("the time between states", false), &value);
            if (!value.is_positive())
                fail(every->value.at,
                     fmt::format("every is {}; with a clock it is the time from one kept state to the next, above 0",
                                 shown(value)));
        } else if (every != nullptr)
            outputs.every = static_cast<long>(
                integer_of(source_, *every, 1, most_steps,
                           "at least 1 and at most 9e15: states whose step is a multiple of it are kept"));
        if (const Entry* energy = table.find("energy")) outputs.energy = boolean_of(source_, *energy);
        if (const Entry* momenta = table.find("momenta")) outputs.momenta = boolean_of(source_, *momenta);
        if (const Entry* bodies = table.find("bodies")) {
            if (scene_.bodies.empty()) fail(bodies->at, "the scene has no bodies; leave it out");
            if (!boolean_of(source_, *bodies)) outputs.columns.clear();
        }
        if (const Entry* columns = table.find("columns")) system_.read_columns(*columns);
        if (const Entry* multipliers = table.find("multipliers")) {
            outputs.multipliers = boolean_of(source_, *multipliers);
            if (outputs.multipliers && scene_.constraints.empty())
                fail(multipliers->at, "without constraints there are no multipliers; leave it out");
        }
        if (const Entry* tangent = table.find("tangent")) outputs.tangent = boolean_of(source_, *tangent);
        if (const Entry* dense = table.find("dense")) {
            outputs.dense = static_cast<int>(table.whole(*dense, "0 to 100 states between two steps are computed"));
            if (outputs.dense > 0 && scene_.clock)
                fail(
                    dense->at,
                    "with a clock states are kept at given times: write every = 0.1, the time between them, instead of "
                    "dense");
            if (outputs.dense > 0 && outputs.every > 1)
                fail(dense->at, "dense fills the time between two steps, so all steps are kept: remove every");
        }
        if (const Entry* events = table.find("events")) outputs.events = system_.read_events(*events, "events");
    }

    void refuse_beside_impacts() const {
        if (!scene_.is_cut()) return;
        const Position at = scene_.impacts.empty() ? scene_.switches.front().at : scene_.impacts.front().when.at;
        const std::string what = scene_.impacts.empty() ? "formulas that are not smooth" : "impacts";
        if (scene_.clock) fail(at, what + " need equal steps in time; leave out the clock");
        if (scene_.outputs.dense > 0) fail(at, what + " need dense = 0: a step that is cut is no polynomial");
    }

    const Source& source_;
    const Value document_;
    const Table root_;
    Scene scene_;
    SystemReader system_;
};

}  // namespace

void Outputs::watch_kept() {
    for (Reduction& one : kept) {
        if (one.of != Reduction::Of::first && one.of != Reduction::Of::count) continue;
        one.event = events.size();
        events.push_back(one.crossing);
    }
}

std::vector<GiNaC::symbol> Scene::inputs() const {
    std::vector<GiNaC::symbol> symbols;
    for (const Parameter& parameter : parameters)
        if (parameter.is_input) symbols.push_back(parameter.symbol);
    return symbols;
}

std::vector<Event> Scene::reported() const {
    std::vector<Event> all = outputs.events;
    all.insert(all.end(), run.stops.begin(), run.stops.end());
    for (const Impact& impact : impacts) all.push_back(impact.when);
    return all;
}

std::vector<std::pair<std::size_t, Event>> Scene::ends() const {
    std::vector<std::pair<std::size_t, Event>> all;
    std::size_t number = outputs.events.size();
    for (const Event& stop : run.stops) all.emplace_back(number++, stop);
    for (const Impact& impact : impacts) {
        if (!impact.rest.is_zero()) all.emplace_back(number, impact.when);
        ++number;
    }
    return all;
}

bool Scene::has_energy() const {
    return outputs.energy ||
           std::any_of(switches.begin(), switches.end(), [](const Switch& one) { return one.refracts; });
}

std::vector<Event> Scene::watched() const {
    std::vector<Event> all = reported();
    for (const Switch& one : switches) all.push_back({one.text, one.value, 0, one.at});
    return all;
}

GiNaC::ex Scene::along_motion(GiNaC::ex formula) const {
    // The values of switches may hold the sides of those before them.
    for (const std::vector<Switch>* list : {&seen_switches, &switches})
        for (auto one = list->rbegin(); one != list->rend(); ++one)
            if (formula.has(one->side)) formula = formula.subs(one->side == side_of(one->value));
    return formula;
}

GiNaC::numeric Scene::value_of(const GiNaC::ex& expression, const std::vector<GiNaC::ex>& given) const {
    if (symbols_of(expression).empty()) return real_value(expression, {});  // as values of most parameters
    return real_value(expression, values_of(parameters, given));
}

GiNaC::numeric Scene::value_at_start(const GiNaC::ex& expression, const std::vector<GiNaC::ex>& velocities) const {
    GiNaC::exmap values = values_of(parameters, {});
    values[time] = 0;
    for (std::size_t k = 0; k < coordinates.size(); ++k) {
        values[coordinates[k].position] = value_of(initial_position[k]);
        values[coordinates[k].velocity] = value_of(velocities[k]);
    }
    return real_value(expression, values);
}

GiNaC::numeric Scene::evaluate(const GiNaC::ex& expression, const std::string& what,
                               const std::vector<GiNaC::ex>& given) const {
    try {
        return value_of(expression, given);
    } catch (const NoValue& error) {
        throw InputError(fmt::format("{}: {} has no finite real value: {}", printable(path), what, error.what()));
    }
}

Names parameter_names(const Scene& scene) {
    struct Values {
        std::vector<GiNaC::ex> values;
        bool array = false;
    };
    std::map<std::string, Values> all;
    const auto add = [&](const Parameter& parameter, const GiNaC::ex& value) {
        const std::size_t bracket = parameter.written.find('[');
        Values& values = all[parameter.written.substr(0, bracket)];
        values.values.push_back(value);
        values.array = bracket != std::string::npos;
    };
    for (const Parameter& parameter : scene.parameters) add(parameter, parameter.symbol);
    for (const Parameter& constant : scene.constants) add(constant, constant.value);
    Names names;
    for (const auto& [name, values] : all) names.add_parameter(name, values.values, values.array);
    return names;
}

void fail_at_clock(const Scene& scene, const std::string& message) {
    if (scene.clock->at) scene.source.fail(*scene.clock->at, message);
    throw InputError(fmt::format("{}: clock = \"{}\", from an option: {}", scene.path, scene.clock->text, message));
}

Scene read_scene(const std::string& path, const std::vector<std::string>& kept) {
    return Reader(Source::read(path)).run(kept);
}

Scene read_scene(const Source& source, const std::vector<std::string>& kept) {
    return Reader(source).run(kept);
}

}  // namespace lobatto
