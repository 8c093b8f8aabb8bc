// SPDX-License-Identifier: GPL-2.0-or-later
// lobatto derive and lobatto emit as commands: what they print, in every notation, and how they fail.
#include <doctest/doctest.h>

#include <nlohmann/json.hpp>
#include <set>

#include "analysis/kernel/support_text.hpp"
#include "generator/describe/describe.hpp"
#include "generator/pipeline.hpp"
#include "tests/support.hpp"

using namespace lobatto;

namespace {

const std::string tree = LOBATTO_SOURCE_DIR;

test::Finished lobatto_program(std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), LOBATTO_PROGRAM);
    return test::run(arguments);
}

std::string scene_with(const std::string& lagrangian, const std::string& coordinates, const std::string& parameters) {
    return "lagrangian = \"" + lagrangian + "\"\n[coordinates]\n" + coordinates + "[parameters]\n" + parameters +
           "[method]\nfamily = \"lobatto\"\npoints = 4\n[run]\nstep = 0.1\nuntil = 1\n";
}

Description description_of(const std::string& text) {
    return describe(derive(read_scene(Source("scene.toml", text))));
}

}  // namespace

TEST_CASE("derive shows the paper's K, its four polynomials and its system for the pendulum, exactly") {
    const test::Finished shown = lobatto_program({"derive", tree + "/scenes/pendulum.toml"});
    CHECK(shown.exit_code == 0);
    CHECK(shown.err == "");
    for (const char* line : {
             "    K = [                 13/3  -5*sqrt(5)/4 - 25/12   5*sqrt(5)/4 - 25/12                  -1/6 ]\n",
             "    c_2 = 1/2 - sqrt(5)/10\n",
             "    l_4 = theta - 5*theta^2 + 5*theta^3\n",
             "    V = m*omega^2*(1 - cos(q))\n",
             "    W = omega^2*sin(q)\n",
             "    S = [ omega^2*cos(q) ]\n",
             "    dF_L[1,1] = 1 - h^2*omega^2*cos(q_2)/15\n",
             "    yes solution in closed form: q'' = -w2*sin(q), by Jacobi elliptic functions with w2 = omega^2",
         }) {
        INFO(line);
        CHECK(test::contains(shown.out, line));
    }
    for (const char* number : {"(D1)", "(D2)", "(D3)", "(D4)", "(D5)", "(D6)", "(D7)", "(D8)", "(D9)", "(D10)", "(D11)",
                               "(D12)", "(D13)", "(D16)", "(D17)", "(D19)", "(D22)"}) {
        INFO(number);
        CHECK(test::contains(shown.out, number));
    }
}

TEST_CASE("derive shows the closed form of the harmonic oscillator: the paper's Phi in z") {
    const test::Finished shown = lobatto_program({"derive", tree + "/scenes/harmonic_oscillator.toml"});
    CHECK(test::contains(shown.out,
                         "    delta = z/30 + z^2/1800 + 1\n"
                         "    a = 23*z^2/900 - 7*z/15 - z^3/3600 + 1\n"
                         "    b = 2*z^2/15 - z - z^3/300 + z^4/43200\n"
                         "    c = z^2/300 - 2*z/15 + 1\n"));
    CHECK(test::contains(shown.out, "    z = h^2*omega^2\n"));
}

TEST_CASE("derive prints the same bytes in every process, in every notation" * doctest::test_suite("slow")) {
    const test::TemporaryFolder folder;
    // Products of sums, whose signs GiNaC orders by address.
    test::write_text(folder / "signs.toml",
                     scene_with("(a-b)*x'^2/2 + (b-c)*x'*y' + (a+c)*y'^2 - (x-y)*(y-a)*(x-c)^3/(a-b)",
                                "x = { position = 1, velocity = 0 }\ny = { position = 1, velocity = 0 }\n",
                                "a = 4\nb = 2\nc = 3\n"));
    // Numbers, which it takes in and out of sums in an order of addresses, too.
    const std::string numbers = LOBATTO_SOURCE_DIR "/scenes/gyroscopic_pendulum.toml";
    for (const auto& [option, scene] : {std::pair<std::string, std::string>("", folder / "signs.toml"),
                                        {"--latex", folder / "signs.toml"},
                                        {"--json", folder / "signs.toml"},
                                        {"--json", numbers}}) {
        std::set<std::string> outputs;
        for (int process = 0; process < 4; ++process) {
            std::vector<std::string> arguments = {"derive", scene};
            if (!option.empty()) arguments.push_back(option);
            const test::Finished shown = lobatto_program(arguments);
            CHECK(shown.exit_code == 0);
            outputs.insert(shown.out);
        }
        CHECK(outputs.size() == 1);
        CHECK(outputs.begin()->size() > 5000);
    }
}

TEST_CASE("of a splitting method the nodes, kicks and drifts are shown, and nothing is solved") {
    const test::Finished shown = lobatto_program({"derive", tree + "/scenes/pendulum.toml", "--splitting", "6"});
    REQUIRE(shown.exit_code == 0);
    for (const char* const text : {"splitting, 6 stages: order 4", "kick u -> u - h b_i W(q) at node i",
                                   "0.24529895718427", "0.08298440641740", "W = omega^2*sin(q)"}) {
        INFO(text);
        CHECK(shown.out.find(text) != std::string::npos);
    }
    CHECK(shown.out.find("F_1") == std::string::npos);
}

TEST_CASE("--json lists every formula with its shape, in a fixed order of keys") {
    const test::Finished shown = lobatto_program({"derive", tree + "/scenes/pendulum.toml", "--json", "--points", "3"});
    REQUIRE(shown.exit_code == 0);
    const auto document = nlohmann::ordered_json::parse(shown.out);
    std::vector<std::string> keys;
    for (const auto& [key, value] : document.items()) keys.push_back(key);
    CHECK(keys == std::vector<std::string>{"format", "scene", "title", "facts", "formulas", "structure"});
    CHECK(document["scene"] == "pendulum");
    std::set<std::string> ids;
    for (const auto& formula : document["formulas"]) {
        INFO(formula["id"].get<std::string>());
        CHECK(ids.insert(formula["id"]).second);
        const std::vector<std::size_t> shape = formula["shape"];
        if (shape.empty()) CHECK(formula["value"].is_string());
        if (!shape.empty()) CHECK(formula["value"].size() == shape[0]);
        if (shape.size() == 1) CHECK(formula["left"].size() == shape[0]);
        if (shape.size() == 2)
            for (const auto& row : formula["value"]) CHECK(row.size() == shape[1]);
    }
    for (const char* id : {"nodes", "weights", "basis", "differentiation", "rigidity", "discrete_lagrangian",
                           "interior_equations", "border_equations", "full_system", "full_jacobian", "reduced_system",
                           "reduced_jacobian", "arrival_position", "arrival_momentum"})
        CHECK(ids.count(id) == 1);
    CHECK(document["formulas"][4]["value"][0] == std::vector<std::string>{"7/3", "-8/3", "1/3"});  // K, Simpson
}

TEST_CASE("--latex writes two names of one document differently: x1 beside the node x_1, x_2 beside x_2_") {
    const std::string wells = latex_of(description_of(
        scene_with("x'^2/2 - (x - x1)^2*(x - x_2)^2", "x = { position = 1, velocity = 0 }\n", "x1 = 1\nx_2 = 2\n")));
    CHECK(test::contains(wells, "V = {\\left(\\mathrm{x1} - x\\right)}^{2} \\, {\\left(x - x_{2}\\right)}^{2}"));
    CHECK(test::contains(wells, "\\mathrm{x\\_2\\_} - x_{2}"));  // at the second node
    CHECK(test::contains(wells, "\\mathrm{x1} - x_{1}"));
    const std::string numbered = latex_of(
        description_of(scene_with("x12'^2/2 + x3'^2/2 - cos(x12 - x3)",
                                  "x12 = { position = 1, velocity = 0 }\nx3 = { position = 1, velocity = 0 }\n", "")));
    CHECK(test::contains(numbered, "\\cos\\left(x_{12} - x_{3}\\right)"));
    CHECK(test::contains(numbered, "\\cos\\left(x_{12,1} - x_{3,1}\\right)"));
    CHECK(!test::contains(numbered, "mathrm{x"));
}

TEST_CASE("--latex is a whole document in which nothing of the scene is markup") {
    Derivation derivation = derive(read_scene(tree + "/scenes/pendulum.toml"));
    derivation.scene.title = "50 % of $x_1 & \\input{secret} {#} ~ ^ \xCE\xA9";
    const std::string text = latex_of(describe(derivation));
    CHECK(text.rfind("\\documentclass", 0) == 0);
    CHECK(text.substr(text.size() - 15) == "\\end{document}\n");
    CHECK(
        test::contains(text,
                       "\\title{50 \\% of \\$x\\_1 \\& \\textbackslash{}input\\{secret\\} \\{\\#\\} \\textasciitilde{} "
                       "\\textasciicircum{} U+03A9}\n"));
    CHECK(test::contains(text, "p_{\\mathrm{left}}"));
    CHECK(test::contains(text, "\\begin{bmatrix}"));
    long depth = 0;
    for (std::size_t i = 0; i < text.size(); ++i) {
        if (i > 0 && text[i - 1] == '\\') continue;
        depth += text[i] == '{' ? 1 : text[i] == '}' ? -1 : 0;
    }
    CHECK(depth == 0);
}

TEST_CASE("any other Lagrangian shows its momenta, forces, second derivatives and its step in blocks") {
    const std::string text = text_of(
        description_of("lagrangian = \"(theta'^2 + sin(theta)^2*phi'^2)/2 + cos(theta)\"\n[coordinates]\n"
                       "theta = { position = 1, velocity = 0 }\nphi = { position = 0, velocity = 1 }\n[forces]\n"
                       "theta = \"-theta'/4\"\n[method]\npoints = 3\n[run]\nstep = 0.1\nuntil = 1\n"));
    INFO(text);
    for (const char* line : {
             "Forces       theta: -theta'/4\n",
             "    p_phi = phi'*sin(theta)^2\n",
             "    f_theta = phi'^2*sin(theta)*cos(theta) - theta'/4 - sin(theta)\n",
             "    theta_2' = -(theta_1 - theta_3)/h\n",
             "    phi' = P_phi/sin(theta)^2\n",
             "    R_kappa = g_P_1*h/6 - g_P_2*h/3 + g_P_3*h/6\n",
             "(D30) R = 0",
         }) {
        INFO(line);
        CHECK(test::contains(text, line));
    }
}

TEST_CASE("what derive says of the system begins with its equations of motion, as worked out by hand") {
    const auto text = [](const std::string& scene) { return text_of(description_of(scene)); };
    const auto holds = [](const std::string& text, const std::string& line) {
        INFO(text);
        INFO(line);
        CHECK(test::contains(text, line));
    };
    holds(text(scene_with("m*x'^2/2 - k*x^2/2 - b*x^4/4", "x = { position = 1, velocity = 0 }\n",
                          "m = 2\nk = 3\nb = 1\n")),
          "(D25) equations of motion (Euler-Lagrange)\n    0 = b*x^3 + k*x + m*x''\n");
    // A bead on a turning wire, a force and an explicit time: Coriolis' terms cancel where they should.
    const std::string driven = text(
        "lagrangian = \"m*(r'^2 + r^2*(phi' + w*t)^2)/2\"\ntime = \"t\"\n[coordinates]\n"
        "r = { position = 1, velocity = 0 }\nphi = { position = 0, velocity = 1 }\n[parameters]\nm = 1\n"
        "w = 2\n[forces]\nr = \"-r'/4\"\n[run]\nstep = 0.1\nuntil = 1\n");
    holds(driven, "    0 = r'/4 - m*r*(phi' + t*w)^2 + m*r''\n");
    holds(driven, "    0 = m*phi''*r^2 + 2*m*r*r'*(phi' + t*w) + m*r^2*w\n");
    const std::string double_pendulum =
        text(scene_with("a'^2 + b'^2/2 + a'*b'*cos(a - b) + 2*g*cos(a) + g*cos(b)",
                        "a = { position = 1, velocity = 0 }\nb = { position = 0, velocity = 1 }\n", "g = 9.81\n"));
    holds(double_pendulum, "    0 = 2*a'' + b'^2*sin(a - b) + b''*cos(a - b) + 2*g*sin(a)\n");
    holds(double_pendulum, "    0 = b'' - a'^2*sin(a - b) + a''*cos(a - b) + g*sin(b)\n");
    holds(double_pendulum, "    H = a'^2 + b'^2/2 + a'*b'*cos(a - b) - 2*g*cos(a) - g*cos(b)\n");
    const std::string rod = text(
        "lagrangian = \"m*(x'^2 + y'^2)/2 - m*g*y\"\n[constraints]\nrod = \"x^2 + y^2 = 1\"\n[coordinates]\n"
        "x = { position = 1, velocity = 0 }\ny = { position = 0, velocity = 0 }\n[parameters]\nm = 1\ng = 9.81\n"
        "[run]\nstep = 0.1\nuntil = 1\n");
    holds(rod,
          "(D44) equations of motion (Euler-Lagrange), with the multipliers of the constraints\n"
          "    0 = m*x'' - 2*lambda_rod*x\n    0 = g*m - 2*lambda_rod*y + m*y''\n");
}

TEST_CASE("a large system is derived without the equations of all nodes, and says so") {
    const Description chain = description_of(
        "lagrangian = \"sum(i = 1 .. 40, x[i]'^2/2) - sum(i = 2 .. 40, (x[i] - x[i-1])^4/4)\"\n[coordinates]\n"
        "x = { count = 40, position = \"sin(i)\", velocity = 0 }\n[method]\npoints = 4\n[run]\nstep = 0.1\nuntil = "
        "1\n");
    const std::string text = text_of(chain);
    CHECK(test::contains(
        text,
        "Equations    not written out: 40 coordinates at 4 points of a step are 160 positions, more than 60; "
        "the kernel assembles them from the formulas of one node\n"));
    CHECK(test::contains(text, "    S_1_2 = -3*(x_1 - x_2)^2\n"));
    CHECK(!test::contains(text, "L_d"));
    CHECK(nlohmann::json::parse(json_of(chain))["formulas"].size() == 13);
}

TEST_CASE("names of the scene that the derivation uses too stay apart") {
    // A parameter named as the second node's position, another as the drift velocity.
    const std::string text =
        text_of(description_of(scene_with("q'^2/2 - q_2*cos(q) - v*q^4 - p_left*q",
                                          "q = { position = 1, velocity = 0 }\n", "q_2 = 4\nv = 2\np_left = 1\n")));
    CHECK(test::contains(text, "q_1, q_2_, q_3, q_4 at the nodes of one step"));
    CHECK(test::contains(text, "    v_ = p_left_ - h*(p_left + 4*q_1^3*v - q_2*sin(q_1))/12"));
}

TEST_CASE("long sums are cut before their signs, and only there") {
    CHECK(cut_at_signs("a + b*(c - d) - e", 8) == std::vector<std::string>{"a", "+ b*(c - d)", "- e"});
    CHECK(cut_at_signs("a + b", 80) == std::vector<std::string>{"a + b"});
    CHECK(cut_at_signs("f(a + b)", 2) == std::vector<std::string>{"f(a + b)"});
    CHECK(cut_at_signs("-a - b", 3) == std::vector<std::string>{"-a", "- b"});
}

TEST_CASE("emit writes the header and its support, says what each pass saved and how to use it") {
    const test::TemporaryFolder folder;
    const test::Finished emitted =
        lobatto_program({"emit", tree + "/scenes/pendulum.toml", "-o", folder / "new" / "folder"});
    CHECK(emitted.exit_code == 0);
    CHECK(emitted.err == "");
    const std::string path = (folder / "new" / "folder").string();
    CHECK(test::read_file(path + "/kernel.hpp") == support_text());
    CHECK(test::read_file(path + "/pendulum.hpp") == test::read_file(tree + "/generated/pendulum.hpp"));
    CHECK(test::contains(emitted.out, "\nWrote " + path + "/pendulum.hpp and " + path + "/kernel.hpp\n"));
    for (const char* pass : {"as derived ", "fold constants ", "factor sums (Horner) ", "powers by multiplication ",
                             "group by phase ", "share common parts ", "sums of angles ", "pair sines and cosines "})
        CHECK(test::contains(emitted.out, pass));
    CHECK(test::contains(emitted.out, "  lobatto::Stepper<lobatto::kernels::pendulum> stepper;\n"));
    CHECK(test::contains(emitted.out, " -I " + path + " program.cpp\n"));
    const std::string spaced = folder / "it's new";
    CHECK(test::contains(lobatto_program({"emit", tree + "/scenes/pendulum.toml", "-o", spaced}).out,
                         " -I '" + (folder / "it'\\''s new").string() + "' program.cpp\n"));
    int files = 0;
    for (const auto& entry : std::filesystem::directory_iterator(path)) files += entry.is_regular_file() ? 1 : 0;
    CHECK(files == 2);  // no temporary file is left
}

TEST_CASE("emit prints one file where it is asked to") {
    const test::TemporaryFolder folder;
    const std::string scene = tree + "/scenes/pendulum.toml";
    for (const char* kind : {"--plain", "--standalone", "--no-support"}) {
        const test::Finished printed = lobatto_program({"emit", scene, kind, "-o", "-"});
        CHECK(printed.exit_code == 0);
        const std::string into = folder / kind;
        REQUIRE(lobatto_program({"emit", scene, kind, "-o", into}).exit_code == 0);
        CHECK(printed.out == test::read_file(into + "/pendulum.hpp"));
    }
    const test::Finished two = lobatto_program({"emit", scene, "-o", "-"});
    CHECK(two.exit_code == 2);
    CHECK(test::contains(two.err, "standard output takes one file"));
    CHECK(test::contains(lobatto_program({"gallery", tree + "/scenes", "-o", "-"}).err, "name a folder for them"));
}

TEST_CASE("emit that cannot write says where and why, with exit code 4, and leaves the old file") {
    const test::TemporaryFolder folder;
    test::write_text(folder / "file", "not a folder");
    const std::string path = folder / "file";
    const test::Finished failed = lobatto_program({"emit", tree + "/scenes/pendulum.toml", "-o", path});
    CHECK(failed.exit_code == 4);
    CHECK(failed.err ==
          "lobatto: cannot write the header to " + path + ": Not a directory. Choose another place with -o\n");
    CHECK(test::read_file(path) == "not a folder");
    const std::string kernels = folder / "kernels";
    const test::Finished modest =
        test::run({"sh", "-c",
                   "umask 077; '" LOBATTO_PROGRAM "' emit '" + tree + "/scenes/pendulum.toml' --plain -o '" + kernels +
                       "' && stat -c %a '" + kernels + "/pendulum.hpp'"});
    CHECK(modest.out.ends_with("\n600\n"));
}

TEST_CASE("emit and derive refuse what they cannot do with exit code 2") {
    const std::string scene = tree + "/scenes/pendulum.toml";
    CHECK(lobatto_program({"derive", scene, "--latex", "--json"}).exit_code == 2);
    CHECK(lobatto_program({"derive", scene, "--points", "13"}).exit_code == 2);
    CHECK(lobatto_program({"derive", "no/such/scene.toml"}).exit_code == 2);
    CHECK(lobatto_program({"emit", scene}).exit_code == 2);
    CHECK(lobatto_program({"emit", scene, "-o", "x", "--numbers", "half"}).exit_code == 2);
    CHECK(lobatto_program({"emit", scene, "-o", "x", "--standalone", "--no-support"}).exit_code == 2);
}
