// SPDX-License-Identifier: GPL-2.0-or-later
// [bodies] and [joints]: rigid bodies become coordinates, kinetic energy, constraints, and names such as top.omega[3].
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "generator/formula/real.hpp"
#include "generator/formula/suggest.hpp"
#include "generator/scene/rigid_body.hpp"
#include "generator/scene/scene_system.hpp"

namespace lobatto {
namespace {

using GiNaC::ex;

const std::string body_example = "{ mass = 1, inertia = [1, 1, 0.5], position = [0, 0, 1] }";
const std::string joint_example =
    "{ type = \"hinge\", bodies = [\"ground\", \"arm\"], point = [0, 0, 0], axis = [0, 1, 0] }";

constexpr std::size_t most_of_bodies = 4096;  // coordinates
const std::string axis_names[] = {"x", "y", "z"};

Vector vector_of(const std::vector<ex>& components) {
    return {components[0], components[1], components.size() > 2 ? components[2] : ex(0)};
}

}  // namespace

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
    void declare_quantity(const std::string& name, const std::vector<std::string>& indices,
                          const std::vector<long>& sizes);

    ex formula(const Entry& entry, const std::string& owner, bool positive = false);
    std::vector<ex> components(const Entry* entry, const std::string& owner, std::size_t count, const ex& otherwise);
    void read_body(Line& line);
    void read_place(Line& line);
    void read_orientation(Line& line);
    Matrix read_inertia(const Entry& entry, const std::string& name);
    void refuse_inertia(const Entry& entry, const std::string& name, const Matrix& inertia) const;
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
    Operand moving(const RigidBody& body, const ex& expression, bool velocity) const;

    SystemReader& reader_;
    const Source& source_;
    std::vector<Line> lines_;
    std::vector<JointLine> joints_;
};

void SystemReader::read_bodies_and_definitions() {
    const Entry *section = root_.find("bodies"), *joints = root_.find("joints");
    if (section == nullptr && joints != nullptr)
        fail(joints->at, "joints hold bodies together; add [bodies] with lines such as top = " + body_example);
    Bodies bodies(*this);
    if (section != nullptr) bodies.declare(*section, joints);
    refuse_names_of_momenta();
    read_definitions();
    if (section != nullptr) bodies.read();
}

void SystemReader::Bodies::declare(const Entry& section, const Entry* joints) {
    if (reader_.scene_.start == Start::momentum)
        fail(section.at, "bodies start with velocities; give those of the coordinates instead of momenta");
    const std::vector<Entry>& entries = table_of(source_, section, "[bodies] with lines such as top = " + body_example);
    if (entries.empty()) fail(section.at, "there is no body; add top = " + body_example + ", or remove the section");
    for (const Entry& entry : entries) declare_body(entry);
    if (joints != nullptr)
        for (const Entry& entry : table_of(source_, *joints, "[joints] with lines such as swing = " + joint_example))
            declare_joint(entry);
    for (Line& line : lines_) {
        declare_coordinates(line);
        declare_quantities(line.body);
    }
}

void SystemReader::Bodies::read() {
    for (Line& line : lines_) read_body(line);
    for (JointLine& line : joints_) read_joint(line);
    for (Line& line : lines_) move(line);
    for (const JointLine& line : joints_)
        if (line.constrains()) add_equations(line);
    for (const Line& line : lines_) {
        give_values(line.body);
        reader_.kinetic_energy_ += moving(line.body, kinetic_energy(line.body), true).expression;
        reader_.kinetic_text_ += fmt::format("{}T({})", reader_.kinetic_text_.empty() ? "" : " + ", line.body.name);
    }
}

ex SystemReader::Bodies::formula(const Entry& entry, const std::string& owner, bool positive) {
    GiNaC::numeric value = 0;
    const std::string what = fmt::format("the {} of {}", entry.key, owner);
    const ex expression = reader_.read_formula(entry, {&reader_.names_, what, false, {}}, &value);
    if (positive && !value.is_positive())
        fail(entry.value.at, fmt::format("{} is {:.6g}; it must be positive", what, value.to_double()));
    return expression;
}

std::vector<ex> SystemReader::Bodies::components(const Entry* entry, const std::string& owner, std::size_t count,
                                                 const ex& otherwise) {
    if (entry == nullptr) return std::vector<ex>(count, otherwise);
    const std::vector<Value>& items = entry->value.items;
    if (entry->value.kind != Value::Kind::list || items.size() != count)
        fail(entry->value.at,
             fmt::format("the {} of {} is a list of {} formulas such as [{}], not {}", entry->key, owner, count,
                         count == 2   ? "0, 1"
                         : count == 3 ? "0, 0, 1"
                                      : "1, 0, 0, 0",
                         entry->value.kind != Value::Kind::list ? entry->value.kind_name()
                                                                : fmt::format("of {}", items.size())));
    std::vector<ex> result;
    for (const Value& item : items) result.push_back(formula({entry->key, item.at, item}, owner));
    return result;
}

void SystemReader::Bodies::declare_body(const Entry& entry) {
    if (entry.key == "ground") fail(entry.at, "'ground' is what does not move; give the body another name");
    reader_.declarations_.declare(entry.key, entry.at, "body");
    Line line{Table(source_, table_of(source_, entry, body_example), entry.at, "body " + entry.key,
                    {"mass", "inertia", "position", "orientation", "angle", "velocity", "angular_velocity"})};
    const std::string moments = "its principal moments in space, [1, 1, 0.5], or one number in a plane";
    line.body.name = entry.key;
    line.body.at = entry.at;
    line.body.plane = line.table.get("inertia", moments).value.kind != Value::Kind::list;
    lines_.push_back(line);
}

void SystemReader::Bodies::read_body(Line& line) {
    line.body.mass = formula(line.table.get("mass", "for example mass = 1"), line.body.name, true);
    line.body.inertia = read_inertia(*line.table.find("inertia"), line.body.name);
    if (line.joint) refuse_velocities(line);
    read_place(line);
    read_orientation(line);
}

void SystemReader::Bodies::read_place(Line& line) {
    const std::size_t dimension = line.body.plane ? 2 : 3;
    const auto vector = [&](const std::string& key) {
        return vector_of(components(line.table.find(key), line.body.name, dimension, 0));
    };
    line.body.drawn_place = vector("position");
    line.velocity = vector("velocity");
}

void SystemReader::Bodies::read_orientation(Line& line) {
    RigidBody& body = line.body;
    const Entry *orientation = line.table.find("orientation"), *angle = line.table.find("angle"),
                *turning = line.table.find("angular_velocity");
    if (body.plane && orientation != nullptr)
        fail(orientation->at, fmt::format("{} has one moment of inertia, so it moves in a plane: write angle = 0 "
                                          "instead of an orientation",
                                          body.name));
    if (!body.plane && angle != nullptr)
        fail(angle->at,
             fmt::format("{} turns in space: write orientation = [1, 0, 0, 0], a quaternion, instead of an angle",
                         body.name));
    if (body.plane) {
        if (angle != nullptr) body.drawn_angle = formula(*angle, body.name);
        body.drawn_rotation = rotation_in_plane(body.drawn_angle);
        line.turning = {0, 0, turning != nullptr ? formula(*turning, body.name) : ex(0)};
        return;
    }
    line.turning = vector_of(components(turning, body.name, 3, 0));
    const std::vector<ex> q =
        orientation != nullptr ? components(orientation, body.name, 4, 0) : std::vector<ex>{1, 0, 0, 0};
    const ex square = q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3];
    const double length = std::sqrt(number(square));
    if (length == 0)
        fail(orientation->value.at, fmt::format("the orientation of {} is a quaternion of length 0; [1, 0, 0, 0] turns "
                                                "nothing, [\"cos(a/2)\", 0, 0, \"sin(a/2)\"] by a about z",
                                                body.name));
    for (std::size_t k = 0; k < 4; ++k) line.orientation[k] = length == 1 ? q[k] : q[k] / sqrt(square);
    body.drawn_rotation = rotation_of(line.orientation);
}

// One moment in a plane; three principal moments; or xx, yy, zz, xy, xz, yz.
Matrix SystemReader::Bodies::read_inertia(const Entry& entry, const std::string& name) {
    if (entry.value.kind != Value::Kind::list) return {{{0, 0, 0}, {0, 0, 0}, {0, 0, formula(entry, name, true)}}};
    const std::size_t count = entry.value.items.size();
    if (count != 3 && count != 6)
        fail(entry.value.at, fmt::format("the inertia of {} has {} values; in space it has three principal moments, or "
                                         "six values xx, yy, zz, xy, xz, yz; in a plane it is one number",
                                         name, count));
    const std::vector<ex> v = components(&entry, name, count, 0);
    const bool full = count == 6;
    const ex xy = full ? v[3] : 0, xz = full ? v[4] : 0, yz = full ? v[5] : 0;
    const Matrix inertia = {{{v[0], xy, xz}, {xy, v[1], yz}, {xz, yz, v[2]}}};
    refuse_inertia(entry, name, inertia);
    return inertia;
}

// I is positive definite, and so is tr(I)/2 - I, the moments of the mass itself, but for flat bodies.
void SystemReader::Bodies::refuse_inertia(const Entry& entry, const std::string& name, const Matrix& inertia) const {
    double I[3][3], E[3][3], scale = 0;
    for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j) {
            I[i][j] = number(inertia[static_cast<std::size_t>(i)][static_cast<std::size_t>(j)]);
            scale = std::max(scale, std::fabs(I[i][j]));
        }
    for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j) E[i][j] = (i == j ? (I[0][0] + I[1][1] + I[2][2]) / 2 : 0) - I[i][j];
    const auto least_minor = [&](const double(&m)[3][3]) {  // of all orders, in units of the largest entry
        double least = m[0][0] / scale;
        for (int i = 0; i < 3; ++i) {
            const int j = (i + 1) % 3;
            least = std::min({least, m[i][i] / scale, (m[i][i] * m[j][j] - m[i][j] * m[i][j]) / scale / scale});
        }
        const double determinant = m[0][0] * (m[1][1] * m[2][2] - m[1][2] * m[2][1]) -
                                   m[0][1] * (m[1][0] * m[2][2] - m[1][2] * m[2][0]) +
                                   m[0][2] * (m[1][0] * m[2][1] - m[1][1] * m[2][0]);
        return std::min(least, determinant / scale / scale / scale);
    };
    if (scale == 0 || !(least_minor(I) > 0))
        fail(entry.value.at, fmt::format("the inertia of {} is not positive: every moment of inertia is", name));
    if (least_minor(E) < -1e-12)
        fail(entry.value.at, fmt::format("no body has the inertia of {}: each principal moment is at most the sum of "
                                         "the other two",
                                         name));
}

std::optional<std::size_t> SystemReader::Bodies::body_of(const Value& value, const std::string& joint) const {
    std::vector<std::string> known{"ground"};
    for (std::size_t b = 0; b < lines_.size(); ++b) {
        if (value.kind == Value::Kind::text && value.text.value == lines_[b].body.name) return b;
        known.push_back(lines_[b].body.name);
    }
    if (value.kind != Value::Kind::text)
        fail(value.at, fmt::format("joint {} joins bodies by their names in quotes, not {}", joint, value.kind_name()));
    const std::string& name = value.text.value;
    if (name == "ground") return std::nullopt;
    fail(value.at, fmt::format("unknown body '{}' in joint {}; bodies: {}.{}", name.substr(0, 40), joint,
                               listing(known), suggestion(name, known)));
}

std::pair<std::optional<std::size_t>, std::size_t> SystemReader::Bodies::pair_of(const Entry& entry,
                                                                                 const std::string& joint) const {
    const std::vector<Value>& items = entry.value.items;
    if (entry.value.kind != Value::Kind::list || items.size() != 2)
        fail(entry.value.at, fmt::format("joint {} joins two bodies, as in bodies = [\"ground\", \"arm\"]", joint));
    const std::optional<std::size_t> first = body_of(items[0], joint), second = body_of(items[1], joint);
    if (!second) fail(items[1].at, fmt::format("the ground is the first body of a joint; exchange those of {}", joint));
    if (first == second) fail(items[1].at, fmt::format("joint {} joins a body to itself", joint));
    if (first && lines_[*first].body.plane != lines_[*second].body.plane)
        fail(entry.value.at,
             fmt::format("joint {} joins a body in a plane to one in space; give both one moment of inertia, or both "
                         "three",
                         joint));
    return {first, *second};
}

// Whether a body is `on`, or hangs on it.
bool SystemReader::Bodies::hangs_on(std::optional<std::size_t> body, std::size_t on) const {
    while (body && *body != on) {
        const std::optional<std::size_t>& joint = lines_[*body].joint;
        body = joint ? joints_[*joint].joint.first : std::nullopt;
    }
    return body.has_value();
}

void SystemReader::Bodies::declare_joint(const Entry& entry) {
    static const std::vector<std::pair<std::string, std::vector<std::string>>> types = {
        {"ball", {"type", "bodies", "point"}},
        {"hinge", {"type", "bodies", "point", "axis", "angle", "velocity"}},
        {"slider", {"type", "bodies", "axis", "position", "velocity"}},
        {"distance", {"type", "bodies", "from", "to", "length"}}};
    reader_.declarations_.declare(entry.key, entry.at, "joint");
    const std::vector<Entry>& keys = table_of(source_, entry, joint_example);
    const auto given = std::find_if(keys.begin(), keys.end(), [](const Entry& key) { return key.key == "type"; });
    const auto type = std::find_if(types.begin(), types.end(), [&](const auto& known) {
        return given != keys.end() && given->value.kind == Value::Kind::text && known.first == given->value.text.value;
    });
    if (type == types.end())
        fail(given == keys.end() ? entry.at : given->value.at,
             fmt::format("of which type is joint {}? there are \"ball\", \"hinge\", \"slider\" and \"distance\"",
                         entry.key));
    JointLine line{Table(source_, keys, entry.at, type->first + " " + entry.key, type->second)};
    Joint& joint = line.joint;
    joint.name = entry.key;
    joint.at = entry.at;
    joint.type = static_cast<Joint::Type>(type - types.begin());
    std::tie(joint.first, joint.second) =
        pair_of(line.table.get("bodies", "bodies = [\"ground\", \"arm\"]"), entry.key);
    Line& second = lines_[joint.second];
    if (second.body.plane && joint.type == Joint::Type::ball)
        fail(given->value.at, "in a plane a ball is a hinge: write type = \"hinge\"");
    joint.closes = second.joint.has_value() || hangs_on(joint.first, joint.second);
    if (!line.constrains()) second.joint = joints_.size();
    joints_.push_back(line);
}

void SystemReader::Bodies::read_joint(JointLine& line) {
    Joint& joint = line.joint;
    const bool plane = lines_[joint.second].body.plane;
    const std::string origin = plane ? "[0, 0]" : "[0, 0, 0]";
    const auto point = [&](const std::string& key, const std::string& which) {
        const Entry& entry = line.table.get(key, fmt::format("{}, {} = {}", which, key, origin));
        return vector_of(components(&entry, joint.name, plane ? 2 : 3, 0));
    };
    if (joint.type == Joint::Type::distance) {
        joint.point = point("from", "the point on the first body");
        joint.to = point("to", "the point on the second body");
        if (const Entry* length = line.table.find("length")) joint.length = formula(*length, joint.name, true);
        return;
    }
    if (joint.type != Joint::Type::slider) joint.point = point("point", "where it is while no joint has moved");
    if (joint.type == Joint::Type::ball) return;
    read_axis(joint, line.table);
    read_start(line);
}

void SystemReader::Bodies::read_axis(Joint& joint, const Table& table) {
    const bool plane = lines_[joint.second].body.plane;
    if (const Entry* given = table.find("axis"); plane && joint.type == Joint::Type::hinge) {
        if (given != nullptr) fail(given->at, "in a plane every hinge turns about z; leave out the axis");
        joint.axis = {0, 0, 1};
        return;
    }
    const Entry& entry = table.get("axis", plane ? "axis = [1, 0]" : "axis = [0, 0, 1]");
    joint.axis = vector_of(components(&entry, joint.name, plane ? 2 : 3, 0));
    const ex square = dot(joint.axis, joint.axis);
    if (number(square) == 0) fail(entry.value.at, fmt::format("the axis of joint {} has length 0", joint.name));
    for (ex& part : joint.axis) part = part / sqrt(square);
}

void SystemReader::Bodies::read_start(JointLine& line) {
    const Entry *start = line.table.find(line.joint.type == Joint::Type::hinge ? "angle" : "position"),
                *rate = line.table.find("velocity");
    for (const Entry* entry : {start, rate}) {
        if (entry == nullptr) continue;
        if (line.joint.closes)
            fail(entry->at, fmt::format("joint {} closes a loop, so that the other joints tell its start; leave out {}",
                                        line.joint.name, entry->key));
        (entry == start ? line.start : line.rate) = formula(*entry, line.joint.name);
    }
}

void SystemReader::Bodies::refuse_velocities(const Line& line) const {
    const Joint& joint = joints_[*line.joint].joint;
    const bool ball = joint.type == Joint::Type::ball;
    for (const char* const key : {"velocity", "angular_velocity"}) {
        const Entry* const entry = line.table.find(key);
        if (entry == nullptr || (ball && entry->key != "velocity")) continue;
        fail(entry->at, fmt::format("{} hangs on joint {}, which tells its {}: leave it out{}", line.body.name,
                                    joint.name, entry->key == "velocity" ? "velocity" : "angular velocity",
                                    ball ? "" : fmt::format(", and give {} a velocity", joint.name)));
    }
}

void SystemReader::Bodies::declare_coordinates(Line& line) {
    RigidBody& body = line.body;
    if (line.joint && joints_[*line.joint].joint.type != Joint::Type::ball) {
        JointLine& hung = joints_[*line.joint];
        const bool hinge = hung.joint.type == Joint::Type::hinge;
        return add_coordinates(hung.coordinate, hung.joint.name, hinge ? "angle" : "position", hung.joint.at);
    }
    for (std::size_t k = 0; !line.joint && k < (body.plane ? 2 : 3); ++k)
        add_coordinates(line.place, body.name, axis_names[k], body.at);
    add_coordinates(line.turn, body.name, body.plane ? "angle" : "q", body.at, body.plane ? 1 : 4);
}

void SystemReader::Bodies::add_coordinates(Symbols& symbols, const std::string& owner, const std::string& part,
                                           Position at, std::size_t count) {
    const bool array = count > 1;
    const std::string column = owner + "_" + part, written = owner + "." + part;
    reader_.declarations_.declare(column, at, "coordinate");
    if (array) reader_.declarations_.declare_elements(column, at, count);
    std::vector<Coordinate>& all = reader_.scene_.coordinates;
    symbols.groups.push_back(reader_.groups_.size());
    reader_.groups_.push_back(
        {&reader_.parts_.emplace_back(Entry{written, at, {}}), all.size(), count, array, nullptr, nullptr});
    std::vector<GiNaC::symbol> q, v;
    for (std::size_t k = 1; k <= count; ++k) {
        const std::string name = array ? element_name(column, k) : column;
        q.emplace_back(name);
        v.emplace_back(name + "'");
        Coordinate coordinate{name, "", q.back(), v.back()};
        coordinate.written = array ? fmt::format("{}[{}]", written, k) : written;
        all.push_back(coordinate);
    }
    reader_.names_.add_coordinate(written, q, v, array);
    symbols.q.insert(symbols.q.end(), q.begin(), q.end());
    symbols.v.insert(symbols.v.end(), v.begin(), v.end());
    if (all.size() > most_of_bodies)
        fail(at, fmt::format("{} coordinates up to here; at most {}", all.size(), most_of_bodies));
}

// arm.x, arm.R[i,j], arm.omega[i]; in a plane arm.omega, arm.angle. What is no coordinate gets its values later.
void SystemReader::Bodies::declare_quantities(const RigidBody& body) {
    const long dimension = body.plane ? 2 : 3;
    for (long k = 0; k < dimension; ++k) {
        const std::string x = body.name + "." + axis_names[k];
        if (reader_.names_.all.count(x) == 0) declare_quantity(x, {}, {});
        reader_.names_.all[x].row.resize(static_cast<std::size_t>(dimension));
    }
    declare_quantity(body.name + ".R", {"i", "j"}, {dimension, dimension});
    if (body.plane && reader_.names_.all.count(body.name + ".angle") == 0)
        declare_quantity(body.name + ".angle", {}, {});
    if (body.plane)
        declare_quantity(body.name + ".omega", {}, {});
    else
        declare_quantity(body.name + ".omega", {"i"}, {3});
}

void SystemReader::Bodies::declare_quantity(const std::string& name, const std::vector<std::string>& indices,
                                            const std::vector<long>& sizes) {
    const auto definition = std::make_shared<Definition>();
    definition->label = name;
    definition->indices = indices;
    definition->sizes = sizes;
    definition->given = true;
    Name& added = reader_.names_.all[name];
    added.role = Name::Role::definition;
    added.definition = definition;
}

void SystemReader::Bodies::start(const Symbols& symbols, const Starts& starts) {
    for (std::size_t k = 0, g = 0; k < starts.size(); ++g) {
        Group& group = reader_.groups_[symbols.groups[g]];
        for (std::size_t i = 0; i < group.count; ++i) group.starts.push_back(starts[k++]);
    }
}

SystemReader::Bodies::Starts SystemReader::Bodies::starts_of_quaternion(const Line& line) const {
    const Quaternion rate = rate_of(line.orientation, line.turning);
    Starts starts;
    for (std::size_t k = 0; k < 4; ++k) starts.emplace_back(line.orientation[k], rate[k]);
    return starts;
}

void SystemReader::Bodies::move_free_body(Line& line) {
    RigidBody& body = line.body;
    Vector x{0, 0, 0}, v{0, 0, 0};
    Starts places;
    for (std::size_t k = 0; k < line.place.q.size(); ++k) {
        places.emplace_back(body.drawn_place[k], line.velocity[k]);
        x[k] = line.place.q[k];
        v[k] = line.place.v[k];
    }
    start(line.place, places);
    const auto& [q, dq, groups] = line.turn;
    if (body.plane) {
        start(line.turn, {{body.drawn_angle, line.turning[2]}});
        return move_free_in_plane(body, x, v, q[0], dq[0]);
    }
    start(line.turn, starts_of_quaternion(line));
    move_free(body, x, v, {q[0], q[1], q[2], q[3]}, {dq[0], dq[1], dq[2], dq[3]});
}

void SystemReader::Bodies::move_on_joint(Line& line, JointLine& hung) {
    const Joint& joint = hung.joint;
    const RigidBody* const parent = joint.first ? &lines_[*joint.first].body : nullptr;
    if (joint.type == Joint::Type::ball) {
        const auto& [q, dq, groups] = line.turn;
        start(line.turn, starts_of_quaternion(line));
        return hang_on_ball(line.body, joint, parent, {q[0], q[1], q[2], q[3]}, {dq[0], dq[1], dq[2], dq[3]});
    }
    start(hung.coordinate, {{hung.start, hung.rate}});
    const GiNaC::symbol &s = hung.coordinate.q[0], &ds = hung.coordinate.v[0];
    (joint.type == Joint::Type::hinge ? hang_on_hinge : hang_on_slider)(line.body, joint, parent, s, ds);
}

// After the body that it hangs on.
void SystemReader::Bodies::move(Line& line) {
    if (line.moves) return;
    line.moves = true;
    if (!line.joint) return move_free_body(line);
    JointLine& hung = joints_[*line.joint];
    if (hung.joint.first) move(lines_[*hung.joint.first]);
    move_on_joint(line, hung);
}

// Those that the other joints do not keep.
void SystemReader::Bodies::add_equations(const JointLine& line) {
    const Joint& joint = line.joint;
    std::size_t upright = 0;
    for (std::size_t k = 1; k < 3; ++k)
        if (std::fabs(number(joint.axis[k])) < std::fabs(number(joint.axis[upright]))) upright = k;
    const RigidBody* const first = joint.first ? &lines_[*joint.first].body : nullptr;
    const RigidBody& second = lines_[joint.second].body;
    const std::vector<ex> equations = equations_of(joint, first, second, upright);
    reader_.declarations_.declare_elements(joint.name, joint.at, equations.size());
    for (std::size_t k = 1; k <= equations.size(); ++k) {
        Constraint constraint{element_name(joint.name, k), fmt::format("{}[{}]", joint.name, k)};
        constraint.text = fmt::format("joint of {} and {}", first != nullptr ? first->name : "ground", second.name);
        constraint.value = moving(second, equations[k - 1], false).expression;
        constraint.at = joint.at;
        reader_.scene_.constraints.push_back(constraint);
    }
}

Operand SystemReader::Bodies::moving(const RigidBody& body, const ex& expression, bool velocity) const {
    Operand operand = operand_of(expression);
    if (operand.extent.size > ExpressionLimits::size)
        fail(body.at, fmt::format("the motion of {}, written out, has more than {} operations: too many joints lie "
                                  "between it and the ground",
                                  body.name, ExpressionLimits::size));
    operand.moves = !operand.value && !velocity;
    operand.velocities = !operand.value && velocity;
    return operand;
}

void SystemReader::Bodies::give_values(const RigidBody& body) {
    const std::size_t dimension = body.plane ? 2 : 3;
    const Vector v = body.velocity_in_space();
    std::map<std::string, Name, std::less<>>& names = reader_.names_.all;
    const auto give = [&](const std::string& part, const std::vector<long>& indices, const ex& value, bool velocity,
                          const std::optional<Operand>& rate = std::nullopt) {
        Name& name = names[body.name + "." + part];
        if (name.definition) name.definition->values[indices] = {true, true, moving(body, value, velocity), rate};
    };
    for (std::size_t i = 0; i < dimension; ++i) {
        give(axis_names[i], {}, body.x[i], false, moving(body, v[i], true));
        for (std::size_t j = 0; j < dimension; ++j) {
            give("R", {static_cast<long>(i + 1), static_cast<long>(j + 1)}, body.R[i][j], false);
            names[body.name + "." + axis_names[i]].row[j] = moving(body, body.R[i][j], false);
        }
        if (!body.plane) give("omega", {static_cast<long>(i + 1)}, body.omega[i], true);
    }
    if (!body.plane) return;
    give("omega", {}, body.omega[2], true);
    give("angle", {}, body.angle, false, moving(body, body.omega[2], true));
}

}  // namespace lobatto
