// SPDX-License-Identifier: GPL-2.0-or-later
// Scene files: what is read from the two scenes of the project, and what is said of each mistake, word for word.
#include "generator/scene/scene.hpp"

#include <doctest/doctest.h>
#include <sys/stat.h>

#include <string>

#include "tests/support.hpp"

using GiNaC::ex;
using GiNaC::numeric;
using GiNaC::Pi;
using lobatto::InputError;
using lobatto::Scene;
using lobatto::Source;
using lobatto::Start;

namespace {

// A scene of ten lines; each mistake changes one of them.
const std::string oscillator =
    "lagrangian = \"m*q'^2/2 - k*q^2/2\"\n"
    "[coordinates]\n"
    "q = { position = 1, velocity = 0 }\n"
    "[parameters]\n"
    "m = 1\n"
    "k = 4\n"
    "[run]\n"
    "step = 0.1\n"
    "until = 10\n";

std::string with_line_of(const std::string& scene, int number, const std::string& replacement) {
    std::string text;
    std::size_t begin = 0;
    for (int line = 1; begin < scene.size(); ++line) {
        const std::size_t end = scene.find('\n', begin) + 1;
        text += line == number ? replacement + "\n" : scene.substr(begin, end - begin);
        begin = end;
    }
    return text;
}

std::string with_line(int number, const std::string& replacement) {
    return with_line_of(oscillator, number, replacement);
}

Scene read(const std::string& text) {
    return lobatto::read_scene(Source("some/oscillator.toml", text));
}

std::string error_of(const std::string& text) {
    try {
        read(text);
    } catch (const InputError& error) {
        return error.what();
    }
    return "no error";
}

std::string line_of(const std::string& text, int line) {
    std::size_t begin = 0;
    for (int i = 1; i < line; ++i) begin = text.find('\n', begin) + 1;
    return text.substr(begin, text.find('\n', begin) - begin);
}

// An error is its place, its text, the line and the caret.
void check_error_in(const std::string& text, lobatto::Position at, const std::string& message) {
    const std::string line = std::to_string(at.line);
    CHECK(error_of(text) == "some/oscillator.toml:" + line + ":" + std::to_string(at.column) + ": " + message + "\n" +
                                std::string(3 - line.size(), ' ') + line + " | " + line_of(text, at.line) + "\n    | " +
                                std::string(static_cast<std::size_t>(at.column - 1), ' ') + "^");
}

// The oscillator with one line replaced.
void check_error(int changed, const std::string& replacement, lobatto::Position at, const std::string& message) {
    check_error_in(with_line(changed, replacement), at, message);
}

std::string scene_path(const std::string& name) {
    return std::string(LOBATTO_SOURCE_DIR) + "/scenes/" + name;
}

}  // namespace

TEST_CASE("the pendulum scene is the paper's pendulum") {
    const Scene scene = lobatto::read_scene(scene_path("pendulum.toml"));
    CHECK(scene.name == "pendulum");
    CHECK(scene.title == "A plane pendulum");
    REQUIRE(scene.coordinates.size() == 1);
    REQUIRE(scene.parameters.size() == 2);
    const ex q = scene.coordinates[0].position, v = scene.coordinates[0].velocity;
    const ex m = scene.parameters[0].symbol, omega = scene.parameters[1].symbol;
    CHECK((scene.lagrangian - (m * pow(v, 2) / 2 - m * pow(omega, 2) * (1 - cos(q)))).expand().is_zero());
    CHECK(scene.lagrangian_text == "m*q'^2/2 - m*omega^2*(1 - cos(q))");
    CHECK(scene.coordinates[0].unit == "rad");
    CHECK(scene.parameters[0].value.is_equal(1));
    CHECK(scene.parameters[1].value.is_equal(2 * Pi));
    CHECK(scene.initial_position[0].is_equal(Pi / 2));
    CHECK(scene.initial_rate[0].is_zero());
    CHECK(scene.start == Start::velocity);
    CHECK(scene.method.points == 4);
    CHECK(scene.run.step.is_equal(numeric(1, 20)));
    CHECK(scene.run.until.is_equal(120));
    CHECK(scene.outputs.every == 1);
    CHECK(scene.outputs.energy);
}

TEST_CASE("the oscillator scene starts with a momentum and steps by a fraction of its period") {
    const Scene scene = lobatto::read_scene(scene_path("harmonic_oscillator.toml"));
    const ex omega = scene.parameters.at(1).symbol;
    CHECK(scene.name == "harmonic_oscillator");
    CHECK(scene.start == Start::momentum);
    CHECK(scene.run.step.is_equal(Pi / 10 / omega));
    CHECK(abs(scene.evaluate(scene.run.step, "the step") - numeric(1, 20)) < pow(numeric(10), -58));
    // Another omega than the scene's: a step of pi / 10.
    CHECK(abs(scene.evaluate(scene.run.step - Pi / 10, "the step", {1, 1})) < pow(numeric(10), -58));
}

TEST_CASE("the examples and the error of docs/scene_format.md are true") {
    const std::string page = Source::read(std::string(LOBATTO_SOURCE_DIR) + "/docs/scene_format.md").content();
    const auto block = [&](const std::string& kind, int number) {
        std::size_t begin = 0;
        for (int k = 0; k < number; ++k) begin = page.find("```" + kind + "\n", begin) + kind.size() + 4;
        return page.substr(begin, page.find("```", begin) - begin);
    };
    const Scene scene = read(block("toml", 1));
    CHECK(scene.title == "Two masses on springs");
    CHECK(scene.coordinates.size() == 2);
    CHECK(scene.parameters.size() == 3);
    CHECK(scene.constants.size() == 1);
    // ten periods of twenty steps
    CHECK(abs(scene.evaluate(scene.run.until / scene.run.step, "the number of steps") - 200) < pow(numeric(10), -50));

    const Scene chain = read(block("toml", 2));
    CHECK(chain.coordinates.size() == 32);
    CHECK(chain.parameters.size() == 6);
    CHECK(chain.coordinates[0].force.has(chain.time));
    CHECK_FALSE(chain.coordinates[1].force.has(chain.time));
    CHECK(chain.method.order() == 4);
    CHECK(chain.outputs.events.size() == 2);
    const Scene pendulum = read(block("text", 1) +
                                "[coordinates]\ntheta1 = { position = 1, velocity = 0 }\n"
                                "theta2 = { position = 1, velocity = 0 }\n[parameters]\nm = [1, 2]\n"
                                "l = [1, 2]\ng = 9.81\n[run]\nstep = 1\nuntil = 1\n");
    const ex v1 = pendulum.coordinates[0].velocity, v2 = pendulum.coordinates[1].velocity;
    CHECK(pendulum.lagrangian.diff(ex_to<GiNaC::symbol>(v1)).has(v2));
    try {
        lobatto::read_scene(Source("pendulum.toml",
                                   "\n\n\nlagrangian = \"m*q'^2/2 - m*omgea^2*(1 - cos(q))\"\n[coordinates]\n"
                                   "q = { position = 1, velocity = 0 }\n[parameters]\nm = 1\nomega = 1\n"));
        FAIL("read");
    } catch (const InputError& error) {
        CHECK(error.what() + std::string("\n") == block("text", 2));
    }
}

TEST_CASE("names keep the order of the file, whatever their alphabet") {
    const Scene scene = read(
        "lagrangian = \"z'^2 + a'^2 + b'^2 - w*c*y*z\"\n"
        "run = { step = 1, until = 0 }\n"
        "[parameters]\nw = 1\nc = 2\ny = 3\n"
        "[coordinates]\n"
        "z = { position = 1, velocity = 0 }\n"
        "a = { position = 2, velocity = 0 }\n"
        "[coordinates.b]\nposition = 3\nvelocity = 0\n");
    CHECK(scene.coordinates[0].name + scene.coordinates[1].name + scene.coordinates[2].name == "zab");
    CHECK(scene.parameters[0].name + scene.parameters[1].name + scene.parameters[2].name == "wcy");
    CHECK(scene.initial_position[2].is_equal(3));
}

TEST_CASE("decimal numbers of TOML are exact, and constants are substituted") {
    const Scene scene = read(with_line(5, "m = { value = 1_0.1, constant = true, unit = \"kg\" }"));
    REQUIRE(scene.constants.size() == 1);
    CHECK(scene.constants[0].value.is_equal(numeric(101, 10)));
    CHECK(scene.constants[0].unit == "kg");
    REQUIRE(scene.parameters.size() == 1);
    CHECK_FALSE(scene.lagrangian.has(scene.constants[0].symbol));
    CHECK(scene.lagrangian.coeff(scene.coordinates[0].velocity, 2).is_equal(numeric(101, 20)));
    CHECK(read(with_line(8, "step = 1e-1")).run.step.is_equal(numeric(1, 10)));
    CHECK(read(with_line(5, "m = 0x1F")).parameters[0].value.is_equal(31));
}

TEST_CASE("what is left out has its default") {
    const Scene scene = read(oscillator);
    CHECK(scene.title == "oscillator");
    CHECK(scene.method.points == 4);
    CHECK(scene.outputs.every == 1);
    CHECK(scene.outputs.energy);
    CHECK(scene.coordinates[0].unit.empty());
}

TEST_CASE("a name of a file becomes a C identifier") {
    const auto name_of = [](const std::string& path) { return lobatto::read_scene(Source(path, oscillator)).name; };
    CHECK(name_of("a/b/three-body (new).toml") == "three_body_new_");
    CHECK(name_of("3body.toml") == "scene_3body");
    CHECK(name_of("") == "scene_");
    CHECK(name_of("\xc3\xa9t\xc3\xa9.toml") == "scene_t_");
}

TEST_CASE("a Lagrangian of several lines knows the place of every character") {
    const std::string lagrangian = "lagrangian = \"\"\"\n  m*q'^2/2 \\\n     - \\u006b*q^2/2\n  %\"\"\"";
    CHECK(error_of(with_line(1, lagrangian)) ==
          "some/oscillator.toml:4:3: unexpected character '%' in the Lagrangian\n"
          "  4 |   %\"\"\"\n"
          "    |   ^");
    const std::string correct = "lagrangian = '''\r\nm*q'^2/2\r\n\t- k*q^2/2'''";
    CHECK(read(with_line(1, correct)).lagrangian_text == "m*q'^2/2 - k*q^2/2");
}

TEST_CASE("mistakes of TOML come with their place") {
    check_error(1, "lagrangian = m*q'^2/2", {1, 14},
                "not valid TOML: value: could not determine value type; a formula must stand in quotes");
    check_error(6, "k = 2*pi", {6, 6},
                "not valid TOML: decimal integer: expected digit, saw '*'; a formula must stand in quotes");
    check_error(6, "k = forty", {6, 6},
                "not valid TOML: boolean: expected 'false', saw 'fo'; a formula must stand in quotes");
    check_error(6, "m = 2", {6, 5}, "'m' is given twice; keep one");
    check_error(6, "m.a = 2", {6, 1},
                "not valid TOML: key-value pair: cannot redefine existing integer as dotted key-value pair");
    check_error(6, "ω = 2", {6, 1}, "not valid TOML: 'ω' cannot stand outside quotes and comments");
    check_error(6, "k = nan", {6, 5}, "inf and nan are not numbers a scene can use; write a finite number");
    check_error(6, "k = 1979-05-27  # a date", {6, 5}, "a date or time: no value of a scene is one");
    check_error(7, "[[run]]", {7, 1}, "a list of tables: each table of a scene occurs once; write [name]");
    check_error(7, "[+run]", {7, 1}, "not valid TOML: the name of a table must follow [, for example [run]");
    CHECK(error_of(with_line(6, "k = \"\xff\"")) ==
          "some/oscillator.toml:6:6: this byte is not UTF-8; save the file with the encoding UTF-8\n"
          "  6 | k = \"\uFFFD\"\n"
          "    |      ^");
    std::string key = "k";
    for (int i = 0; i < 100000; ++i) key += ".k";
    CHECK(error_of(with_line(6, key + " = 1"))
              .starts_with("some/oscillator.toml:6:32: a key of more than 16 parts; keys of a scene have at most 3\n"));
}

TEST_CASE("unknown and missing keys are named") {
    check_error(8, "stpe = 0.1", {8, 1},
                "unknown key 'stpe' in [run]; known: step, steps_per_period, period, until, error, beyond_horizon, "
                "assemble, stop. Did you mean 'step'?");
    check_error(3, "q = { position = 1, velocty = 0 }", {3, 21},
                "unknown key 'velocty' in coordinate q; known: count, unit, position, velocity, momentum. "
                "Did you mean 'velocity'?");
    check_error(3, "q = { velocity = 0 }", {3, 1},
                "coordinate q has no position: add its initial position, for example position = 1");
    check_error(3, "q = { position = 1 }", {3, 1},
                "coordinate q has no initial velocity or momentum; add velocity = 0 or momentum = 0");
    check_error(3, "q = { position = 1, velocity = 0, momentum = 0 }", {3, 35},
                "coordinate q has both a velocity and a momentum; keep one");
    check_error(3, "q = { position = 1, velocity = 0 }\nx = { position = 1, momentum = 0 }", {4, 21},
                "coordinate x starts with a momentum and the ones before with a velocity; give the same for all");
    check_error(3, "", {2, 2}, "a scene needs a coordinate; add a line such as q = { position = 1, velocity = 0 }");
    check_error(8, "", {7, 2}, "[run] has no step; add step = 0.05, or steps_per_period and period");
    check_error(8, "step = 0.1\nsteps_per_period = 10", {9, 1}, "[run] has both step and steps_per_period; keep one");
    check_error(8, "steps_per_period = 10", {7, 2},
                "[run] has no period: add the period that has these steps, for example period = \"2*pi/omega\"");
    check_error(8, "step = 0.1\nperiod = 1", {9, 1}, "period goes with steps_per_period; with step it has no meaning");
    check_error(9, "", {7, 2}, "[run] has no until: add the end time, for example until = 10");
    check_error(1, "", {1, 1},
                "a scene has no lagrangian: add lagrangian = \"...\", the kinetic minus the potential energy");
}

TEST_CASE("values of the wrong type are named") {
    check_error(1, "lagrangian = 3", {1, 14}, "the Lagrangian must be a formula in quotes, not a whole number");
    check_error(1, "title = 3", {1, 9}, "title must be a text in quotes, not a whole number");
    check_error(3, "q = 1", {3, 5}, "q must be a table such as q = { position = 1, velocity = 0 }, not a whole number");
    check_error(5, "m = true", {5, 5}, "m must be a number or a formula in quotes, not true or false");
    check_error(5, "m = { value = 1, constant = 1 }", {5, 29}, "constant must be true or false, not a whole number");
    check_error(9, "until = 1\n[output]\nevery = 1.5", {11, 9},
                "every must be a whole number, written without a point, not 1.5");
    check_error(9, "until = 1\n[output]\nevery = 0", {11, 9},
                "every is 0; at least 1 and at most 9e15: states whose step is a multiple of it are kept");
    check_error(9, "until = 1\n[method]\npoints = 13", {11, 10}, "points is 13; there is Lobatto with 2 to 12 points");
    check_error(9, "until = 1\n[method]\nfamily = \"euler\"", {11, 10},
                "unknown family; there are \"lobatto\", \"gauss\" and \"splitting\"");
    check_error(3, "q = { unit = \"a\\\\b\", position = 1, velocity = 0 }", {3, 14},
                "unit must be one line without control characters, quotes and backslashes");
}

TEST_CASE("names that are taken are refused") {
    check_error(5, "q = 1", {3, 1}, "'q' is both a parameter and a coordinate; rename one");
    check_error(5, "h = 1", {5, 1}, "'h' is the time step; give the parameter another name");
    check_error(3, "t = { position = 1, velocity = 0 }", {3, 1}, "'t' is the time; give the coordinate another name");
    check_error(5, "pi = 3", {5, 1}, "'pi' is the number 3.14159...; give the parameter another name");
    check_error(5, "sin = 3", {5, 1}, "'sin' is the name of a function; give the parameter another name");
    check_error(5, "_m = 3", {5, 1},
                "'_m' cannot be the name of a parameter: names are letters, digits and single underscores, and begin "
                "with a letter");
    check_error(5, "\"μ\" = 3", {5, 1},
                "this cannot be the name of a parameter: names are letters, digits and single underscores, and begin "
                "with a letter; of Greek letters write the names, such as theta");
}

TEST_CASE("a coordinate cannot have the name of another's momentum, in either order") {
    const std::string x = "q = { position = 1, velocity = 0 }", p = "p_q = { position = 1, velocity = 0 }";
    const std::string message =
        "'p_q' is the momentum of coordinate q in the trajectory; give the coordinate another name";
    check_error(3, x + "\n" + p, {4, 1}, message);
    check_error(3, p + "\n" + x, {3, 1}, message);
    CHECK(read("lagrangian = \"p_m*p_q'^2\"\n[coordinates]\n" + p +
               "\n[parameters]\np_m = 1\n[run]\nstep = 1\nuntil = 1\n")
              .coordinates.size() == 1);
}

TEST_CASE("names that are never used are refused") {
    check_error(6, "k = 4\nlength = 2", {7, 1}, "parameter length occurs in no formula; use it or remove it");
    check_error(3, "q = { position = 1, velocity = 0 }\nx = { position = 1, velocity = 0 }", {1, 14},
                "the Lagrangian is degenerate: the velocity x' of coordinate x does not occur in it; add the kinetic "
                "energy of x, or remove the coordinate; if x is a multiplier, write its condition as an equation under "
                "[constraints]");
    CHECK(read(with_line(9, "until = \"late\"\n[parameters.late]\nvalue = 3")).parameters.size() == 3);
}

TEST_CASE("initial values, parameters, step and end time are finite real numbers") {
    check_error(3, "q = { position = \"q\", velocity = 0 }", {3, 19},
                "the coordinate q cannot occur in the initial position of q: write it with numbers and parameters");
    check_error(3, "q = { position = 1, velocity = \"sqrt(1 - k)\" }", {3, 32},
                "the initial velocity of q has no finite real value: -3 to the power 0.5 is not a real number");
    check_error(3, "q = { position = \"1/(k - 4)\", velocity = 0 }", {3, 18},
                "the initial position of q has no finite real value: it divides by zero");
    check_error(6, "k = \"2*m\"", {6, 8},
                "unknown name 'm' in the value of k: only numbers, pi and functions of them may stand here; formulas "
                "of other names stand under [definitions]");
    check_error(6, "k = \"log(0)\"", {6, 6}, "the value of k has no finite real value here: log of 0 is not finite");
    check_error(6, "k = \"10^301\"", {6, 5}, "the value of k must be 0, or of a size between 1e-300 and 1e300");
    check_error(8, "step = 0", {8, 8}, "the step is 0; it must be positive");
    check_error(8, "step = \"1 - k\"", {8, 8}, "the step is -3; it must be positive");
    check_error(8, "steps_per_period = 0\nperiod = 1", {8, 20}, "steps_per_period is 0; at least 1 and at most 9e15");
    check_error(9, "until = -1", {9, 9}, "the end time is -1; it must not be negative: a run starts at time 0");
    check_error(9, "until = 1e15", {9, 9},
                "the run has 1e+16 steps; at most 9e15: make until smaller or the step larger");
}

TEST_CASE("an expression that has no value with other parameters says whose it is") {
    const Scene scene = read(oscillator);
    try {
        scene.evaluate(1 / (scene.parameters[1].symbol - 5), "the period", {1, 5});
        FAIL("evaluated");
    } catch (const InputError& error) {
        CHECK(std::string(error.what()) ==
              "some/oscillator.toml: the period has no finite real value: it divides by zero");
    }
}

TEST_CASE("a file that cannot be read is named with the reason") {
    const auto error_of_path = [](const std::string& path) {
        try {
            lobatto::read_scene(path);
        } catch (const InputError& error) {
            return std::string(error.what());
        }
        return std::string("no error");
    };
    CHECK(error_of_path("no/such\x1b.toml") == "no/such\uFFFD.toml: cannot read the scene: there is no such file");
    CHECK(error_of_path(LOBATTO_SOURCE_DIR) == LOBATTO_SOURCE_DIR ": cannot read the scene: it is a directory");
    const lobatto::test::TemporaryFolder folder;
    const std::string pipe = folder / "pipe";
    REQUIRE(::mkfifo(pipe.c_str(), 0600) == 0);
    const lobatto::test::Finished done = lobatto::test::run({"timeout", "20", LOBATTO_PROGRAM, "derive", pipe});
    CHECK(done.exit_code == 2);
    CHECK(done.err == pipe +
                          ": cannot read the scene: it is a named pipe; give a file, or /dev/stdin for the output of "
                          "another program\n");
    CHECK(error_of(std::string(1000001, ' ')) ==
          "some/oscillator.toml: the file has 1000001 bytes; a scene has at most 1000000");
}

TEST_CASE("the output of another program can be a scene") {
    const std::string program = LOBATTO_PROGRAM, scene = scene_path("pendulum.toml");
    for (const std::string& command :
         {"cat " + scene + " | " + program + " derive /dev/stdin", program + " derive /dev/stdin < " + scene,
          program + " derive <(sleep 0.1; cat " + scene + ")"}) {
        const lobatto::test::Finished done = lobatto::test::run({"bash", "-c", command});
        CHECK(done.exit_code == 0);
        CHECK(done.err == "");
    }
}

namespace {

// Two arrays, definitions, forces, the time and all outputs; each mistake changes one line.
const std::string chain =
    "lagrangian = \"sum(i = 1 .. n, m[i]*x[i]'^2)/2 - sum(i = 2 .. n, V[i]) - V_ends\"\n"
    "time = \"t\"\n"
    "[coordinates]\n"
    "x = { count = \"n\", position = \"a*sin(pi*i/4)\", velocity = [0, 1, \"2*a\"] }\n"
    "[parameters]\n"
    "n = { value = 3, constant = true }\n"
    "m = { value = [1, 2, \"6/2\"], unit = \"kg\" }\n"
    "a = 0.5\n"
    "[definitions]\n"
    "\"V[i]\" = \"(x[i] - x[i-1])^2/2\"\n"
    "V_ends = \"x[1]^2/2 + x[n]^2/2\"\n"
    "[forces]\n"
    "\"x[i]\" = \"-a*i*x[i]'\"\n"
    "\"x[n]\" = \"cos(t)\"\n"
    "[method]\n"
    "family = \"gauss\"\n"
    "stages = 2\n"
    "[run]\n"
    "step = 0.1\n"
    "until = 1\n"
    "[output]\n"
    "momenta = false\n"
    "tangent = false\n"
    "dense = 4\n"
    "events = [\"x[1] = 0 rising\", \"x[1] = x[2]   falling\", \"t = 1/2\"]\n";

void check_error_of_chain(int changed, const std::string& replacement, lobatto::Position at,
                          const std::string& message) {
    check_error_in(with_line_of(chain, changed, replacement), at, message);
}

}  // namespace

TEST_CASE("a scene with arrays is the scene with its elements written out") {
    const Scene scene = read(chain);
    REQUIRE(scene.coordinates.size() == 3);
    REQUIRE(scene.parameters.size() == 4);
    const auto x = [&](int i) -> ex { return scene.coordinates.at(static_cast<std::size_t>(i - 1)).position; };
    const auto v = [&](int i) -> ex { return scene.coordinates.at(static_cast<std::size_t>(i - 1)).velocity; };
    const ex a = scene.parameters[3].symbol;
    ex lagrangian = -pow(x(2) - x(1), 2) / 2 - pow(x(3) - x(2), 2) / 2 - pow(x(1), 2) / 2 - pow(x(3), 2) / 2;
    for (int i = 1; i <= 3; ++i) {
        const auto& mass = scene.parameters[static_cast<std::size_t>(i - 1)];
        CHECK(mass.name == "m_" + std::to_string(i));
        CHECK(mass.written == "m[" + std::to_string(i) + "]");
        CHECK(mass.unit == "kg");
        CHECK(mass.value.is_equal(i));
        const auto& coordinate = scene.coordinates[static_cast<std::size_t>(i - 1)];
        CHECK(coordinate.name == "x_" + std::to_string(i));
        CHECK(coordinate.written == "x[" + std::to_string(i) + "]");
        CHECK(coordinate.velocity.get_name() == "x_" + std::to_string(i) + "'");
        CHECK(coordinate.force.is_equal(-a * i * v(i) + (i == 3 ? cos(ex(scene.time)) : ex(0))));
        CHECK(scene.initial_position[static_cast<std::size_t>(i - 1)].is_equal(a * sin(Pi * i / 4)));
        lagrangian += mass.symbol * pow(v(i), 2) / 2;
    }
    CHECK((scene.lagrangian - lagrangian).expand().is_zero());
    CHECK(scene.initial_rate[2].is_equal(2 * a));
    CHECK(scene.has_time);
    CHECK(scene.coordinates[0].force_at.line == 13);
    CHECK(scene.method.name() == "Gauss, 2 stages");
    CHECK(scene.method.order() == 4);
    CHECK_FALSE(scene.outputs.momenta);
    CHECK_FALSE(scene.outputs.tangent);
    CHECK(scene.outputs.dense == 4);
    REQUIRE(scene.outputs.events.size() == 3);
    CHECK(scene.outputs.events[0].text == "x[1] = 0 rising");
    CHECK(scene.outputs.events[0].value.is_equal(x(1)));
    CHECK(scene.outputs.events[0].direction == 1);
    CHECK(scene.outputs.events[1].text == "x[1] = x[2] falling");
    CHECK(scene.outputs.events[1].value.is_equal(x(1) - x(2)));
    CHECK(scene.outputs.events[1].direction == -1);
    CHECK(scene.outputs.events[2].value.is_equal(scene.time - numeric(1, 2)));
    CHECK(scene.outputs.events[2].direction == 0);
}

TEST_CASE("lists, counts and elements that do not fit are refused") {
    check_error_of_chain(4, "x = { count = 2.5, position = 0, velocity = 0 }", {4, 15},
                         "count must be a whole number, not 2.5");
    check_error_of_chain(4, "x = { count = \"a\", position = 0, velocity = 0 }", {4, 16},
                         "count must be known when the kernel is written: numbers, indices and parameters declared "
                         "constant, such as n = { value = 8, constant = true }");
    check_error_of_chain(4, "x = { count = 0, position = 0, velocity = 0 }", {4, 15},
                         "count is 0; at least 1 and at most 4096");
    check_error_of_chain(4, "x = { count = 4097, position = 0, velocity = 0 }", {4, 15},
                         "count is 4097; at least 1 and at most 4096");
    check_error_of_chain(4, "x = { count = 3, position = [1, 2], velocity = 0 }", {4, 29},
                         "position has 2 values, but x has 3 elements");
    check_error_of_chain(4, "x = { position = [1, 2], velocity = [0, 0, 0] }", {4, 37},
                         "velocity has 3 values, but x has 2 elements");
    check_error_of_chain(4, "x = { position = [], velocity = 0 }", {4, 18}, "the list of position is empty");
    check_error_of_chain(4, "x = { position = [1, true, 3], velocity = 0 }", {4, 22},
                         "a list in a scene holds numbers, and formulas in quotes");
    check_error_of_chain(4, "x = { position = [1, [2], 3], velocity = 0 }", {4, 22},
                         "position 2 must be a number or a formula in quotes, not a list");
    check_error_of_chain(4, "x = { position = [1 2, 3], velocity = 0 }", {4, 21}, "a comma is missing before this");
    check_error_of_chain(7, "m = [1, 2", {8, 1}, "a comma is missing before this");
    check_error_of_chain(25, "events = [\"t = 1\", ", {25, 10}, "this list is not closed: add a ]");
    check_error_of_chain(7, "m = [1, 2, 1979-05-27]", {7, 12}, "a date or time: no value of a scene is one");
    check_error_of_chain(7, "m = [1, 2, \"1/0\"]", {7, 14}, "division by zero in the value of m[3]");
    check_error_of_chain(7, "m = []", {7, 5}, "the list of m is empty");
    check_error_of_chain(7, "m = 2", {1, 32}, "m is a parameter, not an array: write m without brackets");
    check_error_of_chain(4, "x = { count = 2, position = 0, velocity = 0 }", {1, 36},
                         "there is no x[3]: the array has the elements x[1] to x[2] (i = 3)");
    check_error_of_chain(4, "x = { count = 3, position = \"1/(i - 2)\", velocity = 0 }", {4, 31},
                         "division by zero in the initial position of x[i] (i = 2)");
    check_error_of_chain(4, "x = { count = 3, position = \"1e200^i\", velocity = 0 }", {4, 29},
                         "the initial position of x[2] must be 0, or of a size between 1e-300 and 1e300");
    const std::string array = with_line_of(with_line(1, "lagrangian = \"sum(k = 1 .. 2, m*q[k]'^2)*i\""), 3,
                                           "q = { count = 2, position = 0.5, velocity = \"i*m\" }");
    check_error_in(with_line_of(array, 6, "i = 4"), {3, 45},
                   "in the initial velocity of an array, i is the number of the element; rename what else is called i");
    check_error(1, "lagrangian = [1]", {1, 14}, "the Lagrangian must be a formula in quotes, not a list");
    check_error(8, "step = [1]", {8, 8}, "step must be a number or a formula in quotes, not a list");
}

TEST_CASE("names of elements are taken") {
    check_error_of_chain(8, "a = 0.5\nx_3 = 1", {4, 1},
                         "element 3 of x would be called x_3 in the trajectory, and that is a parameter; rename one");
    check_error_of_chain(4, line_of(chain, 4) + "\nx_3 = { position = 0, velocity = 0 }", {5, 1},
                         "'x_3' is element 3 of x in the trajectory; rename one");
    check_error_of_chain(4, line_of(chain, 4) + "\np_x = { position = [0, 0, 0], velocity = 0 }", {5, 1},
                         "'p_x_1' is the momentum of coordinate x[1] in the trajectory; give the coordinate another "
                         "name");
    check_error_of_chain(11, "a = \"x[1]^2\"", {11, 1}, "'a' is both a parameter and a definition; rename one");
    check_error_of_chain(11, "V = \"x[1]^2\"", {11, 1}, "'V' is declared twice");
    check_error_of_chain(2, "time = \"a\"", {8, 1}, "'a' is both a time and a parameter; rename one");
    check_error(5, "sum = 1", {5, 1}, "'sum' is the name of a function; give the parameter another name");
}

TEST_CASE("the time is declared under the name that formulas give it") {
    const std::string driven = "lagrangian = \"m*q'^2/2 + k*q*cos(tau)\"\ntime = \"tau\"";
    CHECK(read(with_line(1, driven)).time.get_name() == "tau");
    CHECK(read(with_line(1, "time = \"t\"\n" + line_of(oscillator, 1))).has_time);
    CHECK_FALSE(read(oscillator).has_time);
    check_error(1, "lagrangian = \"m*q'^2/2 - k*q*cos(t)\"", {1, 34},
                "the scene declares no time: add the line time = \"t\" before its first [table]");
    check_error(1, "lagrangian = \"m*q'^2/2 - k*q*cos(t)\"\ntime = \"tau\"", {1, 34},
                "the time of this scene is called tau");
    check_error(1, line_of(oscillator, 1) + "\ntime = 3", {2, 8},
                "time must be a name in quotes, as in time = \"t\", not a whole number");
    check_error(1, line_of(oscillator, 1) + "\ntime = \"h\"", {2, 8},
                "'h' is the time step; give the time another name");
    check_error_of_chain(4, "x = { count = 3, position = \"t\", velocity = 0 }", {4, 30},
                         "the time t cannot occur in the initial position of x[i]: write it with numbers and "
                         "parameters");
}

TEST_CASE("a definition is its formula wherever its name stands, and its prime is the time derivative") {
    const std::string head = "time = \"t\"\nlagrangian = \"";
    const std::string rest =
        "\"\n[coordinates]\nq = { position = \"b\", velocity = 0 }\n[parameters]\na = 2\n[run]\n"
        "step = \"b/10\"\nuntil = 1\n[definitions]\nb = \"sqrt(a)\"\n";
    const Scene scene = read(head + "y'^2 + s[3] + q'" + rest +
                             "y = \"t*sin(q) + b\"\n\"s[i]\" = \"i*q + sum(k = 1 .. i - 1, s[k])\"\n");
    const ex q = scene.coordinates[0].position, v = scene.coordinates[0].velocity, t = scene.time;
    const ex a = scene.parameters[0].symbol;
    CHECK((scene.lagrangian - (pow(sin(q) + t * cos(q) * v, 2) + 7 * q + v)).expand().is_zero());
    CHECK(scene.initial_position[0].is_equal(sqrt(a)));
    CHECK(scene.run.step.is_equal(sqrt(a) / 10));
    const auto error = [&](const std::string& lagrangian, const std::string& definitions) {
        const std::string text = error_of(head + lagrangian + rest + definitions);
        return text.substr(0, text.find('\n'));
    };
    const std::string at = "some/oscillator.toml:";
    CHECK(error("y'", "y = \"q'^2\"\n") ==
          at + "2:15: the definition y holds a velocity, so its time derivative would hold an acceleration");
    CHECK(error("y + q'", "y = \"z\"\nz = \"2*y\"\n") ==
          at + "13:8: the definition y needs its own value: definitions must not refer to one another in a circle");
    CHECK(error("y[1]", "\"y[i]\" = \"y[i+1]\"\n").find("definitions need one another without end here") !=
          std::string::npos);
    CHECK(error("q'", "y = 3\n") == at + "12:1: definition y occurs in no formula of the scene; use it in one, such as "
                                         "keep in [output], or remove it");
    // Nor do definitions that only one another use.
    CHECK(error("q'", "y = \"z\"\nz = \"y\"\n") == at + "12:1: definition y occurs in no formula of the scene; use it "
                                                        "in one, such as keep in [output], or remove it");
    CHECK(error("q'", "y = \"y + 1\"\n") == at + "12:1: definition y occurs in no formula of the scene; use it in one, "
                                                 "such as keep in [output], or remove it");
    CHECK(error("q'", "y = 3\nz = \"2*y\"\n") == at + "12:1: definition y occurs in no formula of the scene; use it in "
                                                      "one, such as keep in [output], or remove it");
    CHECK(error("y*q'", "y = \"1/(a - a)\"\n") == at + "12:7: division by zero in the definition y");
    CHECK(error("y[2]*q'", "\"y[i]\" = \"1/(i - 2)\"\n") == at + "12:12: division by zero in the definition y (i = 2)");
    CHECK(error("y[1,2]*q'", "\"y[i]\" = \"i\"\n") == at + "2:16: the definition y is written y[i]");
    CHECK(error("y*q'", "\"y[i]\" = \"i\"\n") == at + "2:15: the definition y has indices: write y[i]");
    CHECK(error("y[1]*q'", "y = 2\n") == at + "2:16: y is a definition, not an array: write y without brackets");
    CHECK(error("y*q'", "\"y[1]\" = 2\n") ==
          at + "12:4: the indices of a definition are names without another meaning, as in \"r[i,j]\"; single ones are "
               "definitions of their own, such as r1 and r2");
    CHECK(error("y*q'", "\"y[a]\" = 2\n") ==
          at + "12:4: the indices of a definition are names without another meaning, as in \"r[i,j]\"; single ones are "
               "definitions of their own, such as r1 and r2");
    CHECK(error("y*q'", "\"y + 1\" = 2\n") ==
          at + "12:4: '+' is too much here: a line of [definitions] begins with x = or \"x[i]\" =");
    CHECK(error("q'", "y[i] = 2\n") ==
          at + "12:2: not valid TOML: a key with brackets must stand in quotes, as in \"x[i]\" = ...");
    check_error_of_chain(4, "x = { count = 3, position = \"V_ends\", velocity = 0 }", {4, 30},
                         "the definition V_ends holds coordinates or the time, which cannot occur in the initial "
                         "position of x[i]: write it with numbers and parameters (i = 1)");
}

TEST_CASE("forces act on coordinates") {
    check_error_of_chain(13, "\"y[i]\" = 1", {13, 2},
                         "'y' in [forces] is neither a coordinate nor a definition; coordinates: x.");
    check_error_of_chain(13, "a = 1", {13, 1},
                         "'a' in [forces] is neither a coordinate nor a definition; coordinates: x.");
    check_error_of_chain(13, "V_end = 1", {13, 1},
                         "'V_end' in [forces] is neither a coordinate nor a definition; coordinates: x. Did you mean "
                         "'V_ends'?");
    check_error_of_chain(13, "x = 1", {13, 1},
                         "x is an array: write \"x[i]\" for the force on each of its elements, \"x[1]\" for that on "
                         "the first");
    check_error_of_chain(13, "\"x[4]\" = 1", {13, 4}, "there is no x[4]: the array has the elements x[1] to x[3]");
    check_error_of_chain(13, "\"x[i,j]\" = 1", {13, 6}, "an array has one index: write x[i]");
    check_error_of_chain(13, "\"x[i]\" = \"x[i-1]\"", {13, 11},
                         "there is no x[0]: the array has the elements x[1] to x[3] (i = 1)");
    check_error(9, "until = 1\n[forces]\n\"q[1]\" = 2", {11, 2},
                "q is a coordinate, not an array: write q without brackets");
    check_error(9, "until = 1\n[forces]\nqq = 2", {11, 1},
                "'qq' in [forces] is neither a coordinate nor a definition; coordinates: q.");
    check_error(9, "until = 1\n[forces]\nq = \"-velocity\"", {11, 7},
                "unknown name 'velocity' in the force on q; declared: k, m, q, q'.");
    CHECK(read(oscillator).coordinates[0].force.is_zero());
}

TEST_CASE("forces act along definitions, by their work") {
    const std::string pair =
        "lagrangian = \"(x'^2 + y'^2)/2 + 0*(r + s[1] + w + T + one + mixed + d[1,1])\"\n[coordinates]\n"
        "x = { position = 1, velocity = 0 }\ny = { position = 2, velocity = 0 }\n[run]\nstep = 0.1\nuntil = 1\n"
        "[definitions]\nr = \"sqrt(x^2 + y^2)\"\n\"s[i]\" = \"x + i*y\"\nw = \"x*y'\"\nT = \"x'^2\"\n"
        "one = \"x'^2/x'^2\"\nmixed = \"x + y'\"\n\"d[i,j]\" = \"i*x + j*y\"\n";
    const auto forces = [&](const std::string& lines) {
        const Scene scene = read(pair + "[forces]\n" + lines);
        return std::vector<GiNaC::ex>{scene.coordinates[0].force, scene.coordinates[1].force,
                                      scene.coordinates[0].position, scene.coordinates[1].position,
                                      scene.coordinates[1].velocity};
    };
    const auto is = [](const GiNaC::ex& a, const GiNaC::ex& b) { return (a - b).expand().normal().is_zero(); };
    const auto central = forces("r = \"-3*r\"");
    CHECK(is(central[0], -3 * central[2]));
    CHECK(is(central[1], -3 * central[3]));
    const auto sum = forces("\"s[3]\" = \"y\"\ny = 1");
    CHECK(is(sum[0], sum[3]));
    CHECK(is(sum[1], 3 * sum[3] + 1));
    const auto two = forces("\"d[1,2]\" = 3");
    CHECK(is(two[0], 3));
    CHECK(is(two[1], 6));
    const auto power = forces("w = \"w\"");
    CHECK(power[0].is_zero());
    CHECK(is(power[1], GiNaC::pow(power[2], 2) * power[4]));
    const auto refused = [&](const std::string& line, int column, const std::string& message) {
        check_error_in(pair + "[forces]\n" + line, {17, column}, message);
    };
    refused("\"s[i]\" = 1", 4,
            "unknown name 'i' in the element s[i] (one line for each); declared: T, d[i,j], mixed, one, r, s[i], w, x, "
            "x', y, y'.");
    refused("T = 1", 1, "T is not linear in the velocities, so no force acts along it");
    refused("mixed = 1", 1,
            "mixed is no rate: it holds x without a velocity; write two lines, one for its rate and one for the rest");
    refused("one = 1", 1, "one holds no coordinate, so no force acts along it");
    refused("r = \"q\"", 6,
            "unknown name 'q' in the force on r; declared: T, d[i,j], mixed, one, r, s[i], w, x, x', y, y'.");
}

TEST_CASE("the method is Lobatto's or Gauss's") {
    const auto name = [](const std::string& lines) { return read(oscillator + "[method]\n" + lines).method.name(); };
    CHECK(name("") == "Lobatto, 4 points");
    CHECK(name("points = 12") == "Lobatto, 12 points");
    CHECK(name("family = \"gauss\"") == "Gauss, 3 stages");
    CHECK(name("family = \"gauss\"\nstages = 1") == "Gauss, 1 stage");
    check_error(9, "until = 1\n[method]\npoints = 1", {11, 10}, "points is 1; there is Lobatto with 2 to 12 points");
    check_error(9, "until = 1\n[method]\nstages = 3", {11, 1},
                "Lobatto has points, not stages: write points = 4, or add family = \"gauss\" or \"splitting\"");
    check_error(9, "until = 1\n[method]\nfamily = \"gauss\"\npoints = 3", {12, 1},
                "Gauss has stages, not points: write stages = 3");
    check_error(9, "until = 1\n[method]\nfamily = \"gauss\"\nstages = 11", {12, 10},
                "stages is 11; there is Gauss with 1 to 10 stages");
    CHECK(name("family = \"splitting\"") == "splitting, 11 stages");
    CHECK(name("family = \"splitting\"\nstages = 35") == "splitting, 35 stages");
    check_error(9, "until = 1\n[method]\nfamily = \"splitting\"\npoints = 4", {12, 1},
                "splitting methods have stages, not points: write stages = 11");
    check_error(9, "until = 1\n[method]\nfamily = \"splitting\"\nstages = 12", {12, 10},
                "there are splitting methods with 6, 11, 14, 17, 35 stages");
    check_error(9, "until = 1\n[method]\nfamily = \"splitting\"\nstages = 36", {12, 10},
                "stages is 36; there are splitting methods with 6, 11, 14, 17, 35 stages");
    check_error(9, "until = 1\n[method]\nfamily = \"splitting\"\ntolerance = 1e-9", {12, 1},
                "splitting methods iterate nothing; leave out the tolerance");
}

TEST_CASE("a tolerance is above 0 and at most 0.001; without one the iteration goes to rounding") {
    const auto tolerance = [](const std::string& lines) {
        return read(oscillator + "[method]\n" + lines).method.tolerance;
    };
    CHECK(tolerance("points = 5") == 0);
    CHECK(tolerance("tolerance = 1e-6") == 1e-6);
    CHECK(tolerance("tolerance = 0.001") == 0.001);
    CHECK(tolerance("family = \"gauss\"\nstages = 2\ntolerance = \"1/2000\"") == 1.0 / 2000);
    const auto check = [](const std::string& written, int column, const std::string& message) {
        check_error(9, "until = 1\n[method]\ntolerance = " + written, {11, column}, message);
    };
    const std::string bounds = "; it must be above 0 and at most 0.001; leave it out to iterate to rounding";
    check("0", 13, "the tolerance is 0" + bounds);
    check("-1e-6", 13, "the tolerance is -1e-06" + bounds);
    check("0.002", 13, "the tolerance is 0.002" + bounds);
    check("\"q/1000\"", 14, "the coordinate q cannot occur in the tolerance: write it with numbers and parameters");
}

TEST_CASE("events have two sides and may have a direction") {
    const auto check = [](const std::string& events, int column, const std::string& message) {
        check_error(9, "until = 1\n[output]\nevents = " + events, {11, column}, message);
    };
    check("3", 10, "events must be a list such as [\"x = 0 rising\"], not a whole number");
    check("[1]", 11, "an event must be a text such as \"x = 0 rising\", not a whole number");
    check("[\"q\"]", 13, "an event is written x = 0, x = 0 rising or x = y falling");
    check("[\"q = 0 risng\"]", 18, "'risng' is no direction: write rising or falling");
    check("[\"q = 0 fast\"]", 18, "'fast' is no direction: after an event write rising or falling, or nothing");
    check("[\"q < 0\"]", 14,
          "unexpected character '<' in the event: a comparison stands only in if(a < b, c, d); an event is "
          "written a = b falling");
    check("[\"q = 0 = m\"]", 18, "an event has one =");
    check("[\"q = 0 rising falling\"]", 25, "missing operator: write rising*falling");
    check("[\"m = 1\"]", 11, "this event never happens: it holds neither a coordinate nor the time");
    check("[\"\"]", 12, "the event is empty");
    check("[\"q = \"]", 16, "the event ends after '=': a number, a name or ( is missing");
    check_error(9, "until = 1\n[output]\ndense = 101", {11, 9},
                "dense is 101; 0 to 100 states between two steps are computed");
    check_error(9, "until = 1\n[output]\ndense = 1\nevery = 2", {11, 1},
                "dense fills the time between two steps, so all steps are kept: remove every");
    CHECK(read(oscillator + "[output]\nevents = [\"q' = m falling\", ]").outputs.events[0].direction == -1);
}

TEST_CASE("a Lagrangian may hold comments, which its text leaves out") {
    const std::string lagrangian =
        "lagrangian = '''\nm*q'^2/2   # kinetic\n  # only a comment\n - k*q^2/2 # [potential'''";
    CHECK(read(with_line(1, lagrangian)).lagrangian_text == "m*q'^2/2 - k*q^2/2");
}

TEST_CASE("4096 coordinates and 10000 parameters are read, one more is refused") {
    const auto scene_of = [](int coordinates, int parameters) {
        std::string lagrangian = "0", entries, values;
        for (int k = 0; k < coordinates; ++k) {
            lagrangian += "+q" + std::to_string(k) + "'^2";
            entries += "q" + std::to_string(k) + " = { position = 0, velocity = 0 }\n";
        }
        for (int k = 0; k < parameters; ++k) {
            lagrangian += "+a" + std::to_string(k);
            values += "a" + std::to_string(k) + " = 1\n";
        }
        return "lagrangian = \"" + lagrangian + "\"\n[run]\nstep = 1\nuntil = 1\n[coordinates]\n" + entries +
               "[parameters]\n" + values;
    };
    CHECK(read(scene_of(4096, 0)).coordinates.size() == 4096);
    CHECK(read(scene_of(1, 10000)).parameters.size() == 10000);
    CHECK(error_of(scene_of(4097, 0))
              .starts_with("some/oscillator.toml:4102:1: 4097 coordinates up to here; at most 4096\n"));
    CHECK(error_of(scene_of(1, 10001))
              .starts_with("some/oscillator.toml:10008:1: 10001 parameters up to here; at most 10000\n"));
}
