// SPDX-License-Identifier: GPL-2.0-or-later
// What a scene says of its bodies and joints, while it is read: first their names, then their formulas.
#pragma once

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "generator/scene/bodies/rigid_body.hpp"
#include "generator/scene/system_reader.hpp"

namespace lobatto {

inline const std::string axis_names[] = {"x", "y", "z"};

class SystemReader::Bodies {
public:
    explicit Bodies(SystemReader& reader) : reader_(reader), source_(reader.source_) {}

    // All names, so that definitions may hold them; then the formulas, which may hold definitions.
    void declare(const Entry& section, const Entry* joints);
    void read();

private:
    // The coordinates of a body or joint, of one name or of several.
    struct Symbols {
        std::vector<GiNaC::symbol> q, v;
        std::vector<std::size_t> groups;
    };
    using ex = GiNaC::ex;
    using Starts = std::vector<std::pair<ex, ex>>;  // positions and velocities
    struct Line {
        Table table;
        RigidBody body = {};
        Symbols place = {}, turn = {};                    // its coordinates
        std::optional<std::size_t> joint = std::nullopt;  // that it hangs on
        bool moves = false;                               // its motion is known
        Quaternion orientation = {};
        Vector velocity = {}, turning = {};
    };
    struct JointLine {
        Table table;
        Joint joint = {};
        Symbols coordinate = {};
        ex start = 0, rate = 0;
        // Whether it takes freedom away by constraints, not by hanging its second body on the first.
        bool constrains() const { return joint.closes || joint.type == Joint::Type::distance; }
    };

    [[noreturn]] void fail(Position at, const std::string& message) const { source_.fail(at, message); }
    double number(const ex& expression) const { return real_value(expression, reader_.parameter_values_).to_double(); }

    void declare_body(const Entry& entry);
    void declare_joint(const Entry& entry);
    std::pair<std::optional<std::size_t>, std::size_t> pair_of(const Entry& entry, const std::string& joint) const;
    std::optional<std::size_t> body_of(const Value& value, const std::string& joint) const;
    bool hangs_on(std::optional<std::size_t> body, std::size_t on) const;
    void declare_coordinates(Line& line);
    void add_coordinates(Symbols& symbols, const std::string& owner, const std::string& part, Position at,
                         std::size_t count = 1);
    void declare_quantities(const RigidBody& body);
    void declare_columns(const Line& line);
    void declare_quantity(const std::string& name, const std::vector<std::string>& indices,
                          const std::vector<long>& sizes);

    ex plain(const ex& expression) const;
    ex formula(const Entry& entry, const std::string& owner, bool positive = false);
    std::vector<ex> components(const Entry* entry, const std::string& owner, std::size_t count, const ex& otherwise);
    void read_body(Line& line);
    void read_place(Line& line);
    void read_orientation(Line& line);
    Matrix read_inertia(const Entry& entry, const std::string& name);
    void refuse_inertia(const Entry& entry, const std::string& name, const Matrix& inertia);
    void read_joint(JointLine& line);
    void read_axis(Joint& joint, const Table& table);
    void read_start(JointLine& line);
    void refuse_velocities(const Line& line) const;

    void move(Line& line);
    void move_free_body(Line& line);
    void move_on_joint(Line& line, JointLine& hung);
    void start(const Symbols& symbols, const Starts& starts);
    Starts starts_of_quaternion(const Line& line) const;
    void add_equations(const JointLine& line);
    void give_values(const RigidBody& body);
    void draw(const RigidBody& body);  // for pictures
    void show(const Line& line);
    Operand moving(const RigidBody& body, const ex& expression, bool velocity) const;

    SystemReader& reader_;
    const Source& source_;
    std::vector<Line> lines_;
    std::vector<JointLine> joints_;
};

}  // namespace lobatto
