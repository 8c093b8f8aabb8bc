// SPDX-License-Identifier: GPL-2.0-or-later
#include "generator/scene/file/schema.hpp"

#include <nlohmann/json.hpp>

#include "generator/scene/file/keys.hpp"

namespace lobatto {

namespace {

using Schema = nlohmann::ordered_json;

Schema reference(const std::string& name) {
    return {{"$ref", "#/definitions/" + name}};
}

// What several keys share.
Schema definitions() {
    const auto list_of = [](const Schema& item) { return Schema{{"type", "array"}, {"items", item}}; };
    const auto either = [](const Schema& one, const Schema& other) {
        return Schema{{"anyOf", Schema::array({one, other})}};
    };
    const Schema text = {{"type", "string"}}, formula = reference("formula"), place = reference("place");
    Schema all;
    all["formula"] = {{"type", {"number", "string"}}, {"description", "A number, or a formula in quotes"}};
    all["formulas"] = either(formula, list_of(formula));
    all["place"] = list_of(formula);
    all["place"]["minItems"] = 2;
    all["place"]["maxItems"] = 3;
    all["places"] = list_of(place);
    all["places"]["minItems"] = 2;
    all["events"] = either(text, list_of(text));
    all["names"] = {{"type", "object"}, {"additionalProperties", formula}};
    return all;
}

Schema object_of(const std::vector<Key>& keys);

Schema schema_of_value(const Key& key) {
    switch (key.holds) {
        case Holds::text:
        case Holds::quoted:
            return {{"type", "string"}};
        case Holds::formula:
            return reference("formula");
        case Holds::formulas:
            return reference("formulas");
        case Holds::list:
            return {{"type", "array"}, {"items", reference("formula")}};
        case Holds::events:
            return reference("events");
        case Holds::texts:
            return {{"type", "array"}, {"items", {{"type", "string"}}}};
        case Holds::place:
            return reference("place");
        case Holds::places:
            return reference("places");
        case Holds::whole:
            return {{"type", "integer"}, {"minimum", key.least}, {"maximum", key.most}};
        case Holds::truth:
            return {{"type", "boolean"}};
        case Holds::word:
            if (key.pattern.empty()) return {{"type", "string"}, {"enum", key.words}};
            return {{"type", "string"}, {"anyOf", {{{"enum", key.words}}, {{"pattern", key.pattern}}}}};
        case Holds::names:
            return reference("names");
        case Holds::table:
            break;
    }
    return object_of(key.keys);
}

// One key of some, each with the keys of its own.
Schema one_of_joints(const std::vector<Key>& keys) {
    Schema choices = Schema::array();
    for (const auto& [type, names] : joint_types()) {
        std::vector<Key> own;
        for (const Key& key : keys)
            if (std::find(names.begin(), names.end(), key.name) != names.end()) own.push_back(key);
        Schema choice = object_of(own);
        choice["properties"]["type"] = {{"const", type}};
        choices.push_back(choice);
    }
    return {{"oneOf", choices}};
}

Schema one_of_figures(const std::vector<Key>& keys) {
    Schema figure = object_of(keys);
    figure["oneOf"] = Schema::array();
    for (const std::string& shape : figure_shapes()) figure["oneOf"].push_back({{"required", {shape}}});
    return figure;
}

// A line of a section whose names are the scene's own.
Schema schema_of_line(const Key& section) {
    if (section.name == "joints") return one_of_joints(section.keys);
    if (section.name == "view") return one_of_figures(section.keys);
    const Schema table = object_of(section.keys);
    if (!section.is_short) return table;
    const Schema alone = section.name == "constraints" ? Schema{{"type", "string"}} : reference("formulas");
    return {{"anyOf", Schema::array({alone, table})}};
}

Schema schema_of(const Key& key) {
    Schema schema;
    if (key.lines) {
        schema = {{"type", "object"}, {"additionalProperties", schema_of_line(key)}};
        if (key.name == "view")
            schema["properties"]["plot"] = {{"type", "array"},
                                            {"items", reference("formula")},
                                            {"minItems", 1},
                                            {"description", "The curves: formulas such as \"H\""}};
    } else {
        schema = schema_of_value(key);
    }
    // Beside a reference nothing else is read.
    if (schema.contains("$ref")) schema = {{"allOf", Schema::array({schema})}};
    schema["description"] = key.help;
    return schema;
}

Schema object_of(const std::vector<Key>& keys) {
    Schema object = {{"type", "object"}, {"properties", Schema::object()}};
    Schema required = Schema::array();
    for (const Key& key : keys) {
        object["properties"][key.name] = schema_of(key);
        if (key.required) required.push_back(key.name);
    }
    if (!required.empty()) object["required"] = required;
    object["additionalProperties"] = false;
    return object;
}

}  // namespace

std::string scene_schema() {
    Schema schema = {{"$schema", "http://json-schema.org/draft-07/schema#"},
                     {"title", "A scene of Lobatto"},
                     {"description", "A mechanical system, how to integrate it, and what to keep"}};
    schema.update(object_of(scene_keys()));
    schema["definitions"] = definitions();
    return schema.dump(2) + "\n";
}

}  // namespace lobatto
