// SPDX-License-Identifier: GPL-2.0-or-later
// What a scene file says of the system: time, parameters, coordinates, definitions, the Lagrangian, forces.
#pragma once

#include <deque>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "generator/formula/expression.hpp"
#include "generator/scene/file/declarations.hpp"
#include "generator/scene/file/table.hpp"
#include "generator/scene/scene.hpp"

namespace lobatto {

GiNaC::exset symbols_of(const GiNaC::ex& expression);

class SystemReader {
public:
    // All three outlive the reader.
    SystemReader(const Source& source, const Table& root, Scene& scene)
        : source_(source), root_(root), scene_(scene), declarations_(source), names_(declarations_.names) {}

    // All names before the formulas they occur in.
    void read();
    // What is drawn and plotted of the motion; after read_kept.
    void read_view();
    // After the last formula of the scene.
    void add_switches();
    void refuse_unused() const;
    // After coordinates were eliminated.
    void require_velocities() const;

    // How further formulas are read: those that may hold what moves, and those in parameters.
    // What the formulas read so far ask for.
    const std::vector<DomainCondition>& conditions() const { return names_.conditions; }
    const auto& tables() const { return names_.tables; }
    Scope scope_of(const std::string& formula, bool motion_allowed) { return {&names_, formula, motion_allowed, {}}; }
    // A formula whose value with the parameters of the scene must be a real number that a double can hold.
    GiNaC::ex read_formula(const Entry& entry, const Scope& scope, GiNaC::numeric* value = nullptr);

    // A list such as ["x = 0 rising"], or one of them.
    std::vector<Event> read_events(const Entry& entry, const std::string& key);
    // [output] columns: formulas that stand in the table of a trajectory beside the motion.
    void read_columns(const Entry& entry);
    // [output] keep, or in its place what --keep gives.
    void read_kept(const std::vector<std::string>& given);

private:
    // The lines of [coordinates]: one coordinate, or an array of them.
    struct Group {
        const Entry* entry;
        std::size_t first, count;
        bool array;
        const Entry* position;  // nullptr: not given, nor the rate: a constraint is an equation for it
        const Entry* rate;
        std::vector<std::pair<GiNaC::ex, GiNaC::ex>> starts = {};  // of a body: instead of these
    };
    class Bodies;

    [[noreturn]] void fail(Position at, const std::string& message) const { source_.fail(at, message); }
    // Of a value that the scene keeps: other values of its parameters must keep it, too.
    void require(const GiNaC::ex& value, bool may_vanish, const std::string& complaint, Position at) {
        if (!symbols_of(value).empty()) scene_.requirements.push_back({value, may_vanish, complaint, at});
    }

    void read_time();
    void read_parameters();
    void read_parameters(const std::string& section, const std::string& what);
    Parameter read_parameter(const Entry& entry, const Entry& value);
    std::vector<Parameter> read_elements(const Entry& entry, const Entry& list);
    void read_coordinates();
    void read_coordinate(const Entry& entry);
    void read_initial_entries(Group& group, const Table& table);
    void read_count(Group& group, const Entry* count);
    void read_bodies_and_definitions();
    void refuse_names_of_momenta() const;
    void read_definitions();
    void read_lagrangian();
    void read_forces();
    void add_force_along(const std::string& name, const Entry& entry, const Scope& scope);
    bool holds_velocity(const GiNaC::ex& expression) const;
    void read_constraints();
    void read_constraint(const Entry& entry);
    void require_freedom(Position at, const std::string& or_else = "") const;
    void solve_constraint(Constraint& constraint, const EventSyntax& sides, const Scope& scope,
                          const std::vector<long>& indices) const;
    // "link" or "link[i]"; how many links there are.
    struct ArrayName {
        std::string name;
        std::optional<std::string> index;
    };
    ArrayName declare_array(const Entry& entry, const std::string& what, const std::string& section);
    long count_of(const Entry& entry, const Entry* count, const ArrayName& array, const std::string& what);
    void read_impacts();
    void read_impact(const Entry& entry);
    bool passes_through(const Impact& impact, const Entry* passes, const Entry* reset) const;
    void read_reset(const Entry& entry, Impact& impact, const Scope& scope, const std::vector<long>& indices);
    Event read_event(const Value& value, const std::string& key);
    void read_figure(const Entry& entry);
    void read_plots(const Entry& entry);
    void name_energy_and_momenta();
    void read_kept(const Source& source, const Text& text);
    void find_inputs_without_speed();
    GiNaC::exset symbols_of_kernel() const;
    const Group& group_of(const Subject& subject) const;
    void read_places();
    void read_initial_values();
    void follow_equations(std::set<std::size_t>& missing);
    void read_values(const Group& group, const Entry& entry, const std::string& what, std::vector<GiNaC::ex>& values);

    const Source& source_;
    const Table& root_;
    Scene& scene_;
    Declarations declarations_;
    Names& names_;
    std::deque<Text> keys_;  // of definitions: their indices are read from them
    std::vector<std::pair<const Name*, const Entry*>> definition_lines_;
    GiNaC::exmap parameter_values_;
    std::vector<Group> groups_;
    std::deque<Entry> parts_;  // of bodies: the lines of their coordinates
    GiNaC::ex kinetic_energy_ = 0;
    std::string kinetic_text_;  // "T(top) + T(arm)"
};

constexpr std::size_t longest_unit = 40;

// On one line, without comments.
std::string collapsed(const std::string& formula);
// A key with brackets, "x[i]", stands in quotes, which are not a part of it.
Text text_of_key(const Entry& entry);

}  // namespace lobatto
