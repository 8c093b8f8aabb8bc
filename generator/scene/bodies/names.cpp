// SPDX-License-Identifier: GPL-2.0-or-later
// The names that [bodies] and [joints] bring: coordinates, and quantities such as top.omega[3].
#include <fmt/format.h>

#include <algorithm>

#include "generator/formula/text/suggest.hpp"
#include "generator/scene/bodies/reader.hpp"

namespace lobatto {
namespace {

constexpr std::size_t most_of_bodies = 4096;  // coordinates
const std::string body_example = "{ mass = 1, inertia = [1, 1, 0.5], position = [0, 0, 1] }";
const std::string joint_example =
    "{ type = \"hinge\", bodies = [\"ground\", \"arm\"], point = [0, 0, 0], axis = [0, 1, 0] }";

}  // namespace

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
        declare_columns(line);
    }
}

void SystemReader::Bodies::declare_body(const Entry& entry) {
    if (entry.key == "ground") fail(entry.at, "'ground' is what does not move; give the body another name");
    reader_.declarations_.declare(entry.key, entry.at, "body");
    Line line{Table(source_, table_of(source_, entry, body_example), entry.at, "body " + entry.key,
                    keys_of_section("bodies"))};
    const std::string moments = "its principal moments in space, [1, 1, 0.5], or one number in a plane";
    line.body.name = entry.key;
    line.body.at = entry.at;
    line.body.plane = line.table.get("inertia", moments).value.kind != Value::Kind::list;
    lines_.push_back(line);
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
    const auto& types = joint_types();
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
    JointLine line{
        Table(source_, keys, entry.at, type->first + " " + entry.key, keys_of_section("joints"), type->second)};
    Joint& joint = line.joint;
    joint.name = entry.key;
    joint.at = entry.at;
    joint.type = static_cast<Joint::Type>(type - types.begin());
    std::tie(joint.first, joint.second) =
        pair_of(line.table.get("bodies", "bodies = [\"ground\", \"arm\"]"), entry.key);
    Line& second = lines_[joint.second];
    if (second.body.plane && joint.type == Joint::Type::ball)
        fail(given->value.at, "in a plane a ball is a hinge: write type = \"hinge\"");
    const Entry* const asked = line.table.find("constraint");
    joint.asked_for = asked != nullptr && boolean_of(source_, *asked);
    joint.closes = joint.asked_for || second.joint.has_value() || hangs_on(joint.first, joint.second);
    if (!line.constrains()) second.joint = joints_.size();
    joints_.push_back(line);
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
    const std::vector<GiNaC::symbol>& q = line.turn.q;
    if (!body.plane) reader_.scene_.quaternions.push_back({q[0], q[1], q[2], q[3]});
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

void SystemReader::Bodies::declare_columns(const Line& line) {
    const std::string &name = line.body.name, omega = name + "_omega", orientation = name + "_orientation";
    Declarations& declarations = reader_.declarations_;
    if (line.body.plane) {
        if (line.joint) declarations.declare(name + "_angle", line.body.at, "angle");
        return declarations.declare(omega, line.body.at, "angular velocity");
    }
    declarations.declare_elements(omega, line.body.at, 3);
    declarations.declare_elements(orientation, line.body.at, 4);
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

}  // namespace lobatto
