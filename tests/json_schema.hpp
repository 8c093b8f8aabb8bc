// SPDX-License-Identifier: GPL-2.0-or-later
// Checks JSON by a JSON schema: of draft 7 as much as our schemas use. An unknown keyword is an error, not skipped.
#pragma once

#include <cmath>
#include <nlohmann/json.hpp>
#include <regex>
#include <set>
#include <stdexcept>
#include <string>

namespace lobatto::test {

class JsonSchema {
public:
    explicit JsonSchema(nlohmann::json schema) : root_(std::move(schema)) {}

    // Where the value breaks the schema, and how; empty: nowhere.
    std::string complaint(const nlohmann::json& value) const { return complaint(root_, value, "$"); }

private:
    using Json = nlohmann::json;

    static bool has_type(const Json& value, const std::string& type) {
        if (type == "integer") return value.is_number_integer();
        if (type == "number") return value.is_number();
        if (type == "string") return value.is_string();
        if (type == "boolean") return value.is_boolean();
        if (type == "array") return value.is_array();
        if (type == "object") return value.is_object();
        if (type == "null") return value.is_null();
        throw std::invalid_argument("no type " + type);
    }

    std::size_t matches(const Json& choices, const Json& value, const std::string& at) const {
        std::size_t count = 0;
        for (const Json& choice : choices) count += complaint(choice, value, at).empty() ? 1 : 0;
        return count;
    }

    std::string complaint(const Json& schema, const Json& value, const std::string& at) const {
        if (schema.is_boolean()) return schema.get<bool>() ? "" : at + " may not be there";
        for (const auto& [keyword, rule] : schema.items())
            if (const std::string why = broken(schema, keyword, rule, value, at); !why.empty()) return why;
        return "";
    }

    std::string broken(const Json& schema, const std::string& keyword, const Json& rule, const Json& value,
                       const std::string& at) const {
        static const std::set<std::string> remarks = {"$schema", "title", "description", "definitions"};
        if (remarks.count(keyword) > 0) return "";
        if (keyword == "$ref")
            return complaint(root_.at(Json::json_pointer(rule.get<std::string>().substr(1))), value, at);
        if (keyword == "type") {
            const Json types = rule.is_array() ? rule : Json::array({rule});
            for (const Json& type : types)
                if (has_type(value, type)) return "";
            return at + " is not of type " + rule.dump();
        }
        if (keyword == "enum") {
            for (const Json& one : rule)
                if (one == value) return "";
            return at + " is not one of " + rule.dump();
        }
        if (keyword == "pattern")
            return !value.is_string() ||
                           std::regex_search(value.get<std::string>(), std::regex(rule.get<std::string>()))
                       ? ""
                       : at + " does not match " + rule.dump();
        if (keyword == "const") return value == rule ? "" : at + " is not " + rule.dump();
        if (keyword == "minimum") return !value.is_number() || value >= rule ? "" : at + " is below " + rule.dump();
        if (keyword == "maximum") return !value.is_number() || value <= rule ? "" : at + " is above " + rule.dump();
        if (keyword == "minItems") return !value.is_array() || value.size() >= rule ? "" : at + " has too few items";
        if (keyword == "maxItems") return !value.is_array() || value.size() <= rule ? "" : at + " has too many items";
        if (keyword == "items") {
            for (std::size_t i = 0; value.is_array() && i < value.size(); ++i)
                if (const std::string why = complaint(rule, value[i], at + "/" + std::to_string(i)); !why.empty())
                    return why;
            return "";
        }
        if (keyword == "required") {
            for (const Json& key : rule)
                if (value.is_object() && !value.contains(key.get<std::string>())) return at + " has no " + key.dump();
            return "";
        }
        if (keyword == "properties" || keyword == "additionalProperties") return members(schema, keyword, value, at);
        if (keyword == "anyOf") return matches(rule, value, at) > 0 ? "" : at + " is none of several things";
        if (keyword == "oneOf")
            return matches(rule, value, at) == 1 ? "" : at + " is not exactly one of several things";
        if (keyword == "allOf")
            return matches(rule, value, at) == rule.size() ? "" : at + " is not all of several things";
        throw std::invalid_argument("unknown keyword " + keyword);
    }

    std::string members(const Json& schema, const std::string& keyword, const Json& value,
                        const std::string& at) const {
        if (!value.is_object()) return "";
        const Json properties = schema.value("properties", Json::object());
        for (const auto& [key, member] : value.items()) {
            const bool is_known = properties.contains(key);
            if (is_known != (keyword == "properties")) continue;
            const std::string why =
                complaint(is_known ? properties[key] : schema["additionalProperties"], member, at + "/" + key);
            if (!why.empty()) return why;
        }
        return "";
    }

    Json root_;
};

}  // namespace lobatto::test
