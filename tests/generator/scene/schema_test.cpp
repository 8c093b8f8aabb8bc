// SPDX-License-Identifier: GPL-2.0-or-later
// The JSON schema of scenes, beside the reader: what one refuses the other must not take.
#include "generator/scene/file/schema.hpp"

#include <doctest/doctest.h>

#include "cli/print/embedded.hpp"
#include "generator/scene/file/document.hpp"
#include "generator/scene/scene.hpp"
#include "tests/json_schema.hpp"
#include "tests/support.hpp"

using namespace lobatto;

namespace {

const std::string tree = LOBATTO_SOURCE_DIR;

// As an editor sees it.
nlohmann::json json_of(const Value& value) {
    switch (value.kind) {
        case Value::Kind::text:
            return value.text.value;
        case Value::Kind::integer:
            return value.integer;
        case Value::Kind::real:
            return std::stod(value.text.value);
        case Value::Kind::boolean:
            return value.boolean;
        case Value::Kind::list: {
            nlohmann::json list = nlohmann::json::array();
            for (const Value& item : value.items) list.push_back(json_of(item));
            return list;
        }
        case Value::Kind::table:
            break;
    }
    nlohmann::json table = nlohmann::json::object();
    for (const Entry& entry : value.entries) table[entry.key] = json_of(entry.value);
    return table;
}

std::string complaint(const Source& source) {
    static const test::JsonSchema schema(nlohmann::json::parse(scene_schema()));
    return schema.complaint(json_of(read_document(source)));
}

// A scene with another text in the place of one of its lines.
std::string with(const std::string& line, const std::string& other) {
    std::string text =
        "title = \"x\"\nlagrangian = \"m*q'^2/2 - m*q^2/2\"\n[coordinates]\nq = { position = 1, velocity = 0 }\n"
        "[parameters]\nm = { value = 1, unit = \"kg\" }\n[method]\npoints = 4\n[run]\nstep = 0.1\nuntil = 1\n"
        "[output]\nevents = [\"q = 0\"]\n[view]\nbob = { point = [\"q\", 0] }\n";
    const std::size_t at = text.find(line);
    REQUIRE(at != std::string::npos);
    return text.replace(at, line.size(), other);
}

}  // namespace

TEST_CASE("the schema takes every scene of the repository and every template") {
    int count = 0;
    for (const char* folder : {"/scenes", "/bench/scenes", "/tests/scenes"})
        for (const auto& entry : std::filesystem::directory_iterator(tree + folder))
            if (entry.path().extension() == ".toml") {
                CAPTURE(entry.path().string());
                CHECK(complaint(Source(entry.path().string(), test::read_file(entry.path()))) == "");
                ++count;
            }
    CHECK(count > 45);
    for (const EmbeddedText& one : scene_templates) {
        CAPTURE(std::string(one.name));
        CHECK(complaint(Source(std::string(one.name), std::string(one.text))) == "");
    }
    CHECK(complaint(Source("x.toml", with("title", "title"))) == "");
}

TEST_CASE("what the schema refuses the reader refuses too") {
    const std::pair<const char*, const char*> broken[] = {
        {"title = \"x\"", "titel = \"x\""},
        {"title = \"x\"", "title = 3"},
        {"until = 1\n", "\n"},
        {"[run]", "[runs]"},
        {"step = 0.1", "step = true"},
        {"points = 4", "points = 1"},
        {"points = 4", "points = 13"},
        {"points = 4", "points = \"4\""},
        {"points = 4", "points = 4\nfamily = \"radau\""},
        {"points = 4", "points = 4\nnumbers = \"half\""},
        {"position = 1,", "position = { x = 1 },"},
        {"velocity = 0", "velocity = 0, spin = 1"},
        {"unit = \"kg\"", "unit = 5"},
        {"value = 1, ", ""},
        {"[\"q = 0\"]", "[1, 2]"},
        {"events = [\"q = 0\"]", "energy = 1"},
        {"events = [\"q = 0\"]", "dense = 101"},
        {"point = [\"q\", 0]", "point = [\"q\"]"},
        {"point = [\"q\", 0]", "dot = [\"q\", 0]"},
        {"point = [\"q\", 0]", "point = [\"q\", 0], line = [[0, 0], [1, 1]]"},
        {"point = [\"q\", 0]", "trail = true"},
    };
    for (const auto& one : broken) {
        const std::string line = one.first, other = one.second;
        CAPTURE(other);
        const Source source("x.toml", with(line, other));
        CHECK(complaint(source) != "");
        CHECK(test::message_of<InputError>([&] { read_scene(source); }) != "");
    }
}

TEST_CASE("the schema in docs/ is the one that the program prints") {
    CHECK(test::read_file(tree + "/docs/schemas/scene.json") == scene_schema());
}
