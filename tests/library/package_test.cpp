// SPDX-License-Identifier: GPL-2.0-or-later
// What `cmake --install` writes, used by a project outside: examples/cmake, built with Ninja and with Make.
#include <doctest/doctest.h>

#include <filesystem>
#include <fstream>
#include <regex>
#include <sstream>

#include "tests/support.hpp"

namespace {

namespace fs = std::filesystem;
using namespace lobatto;

const std::string build_folder = LOBATTO_BUILD_DIR;

void install(const std::string& prefix) {
    const test::Finished installed = test::run({"cmake", "--install", build_folder, "--prefix", prefix});
    INFO(installed.err);
    REQUIRE(installed.exit_code == 0);
}

// The standard output of a command that must succeed.
std::string output_of(const std::vector<std::string>& command) {
    const test::Finished finished = test::run(command);
    INFO(command.front() << ": " << finished.out << finished.err);
    REQUIRE(finished.exit_code == 0);
    return finished.out;
}

std::string last_line(const std::string& path) {
    std::ifstream file(path);
    std::string last;
    for (std::string line; std::getline(file, line);) last = line;
    return last;
}

}  // namespace

TEST_SUITE("slow") {
    TEST_CASE("an outside project finds the installed package, also after it was moved, and computes the bits of run") {
        const test::TemporaryFolder folder;
        install(folder / "first");
        fs::rename(folder / "first", folder / "moved");
        const std::string prefix = folder / "moved";
        fs::copy(LOBATTO_SOURCE_DIR "/examples/cmake", folder / "project");
        output_of({prefix + "/bin/lobatto", "run", folder / "project/arm.toml", "--points", "6", "--quiet", "-o",
                   folder / "arm.csv"});
        const std::string wanted = last_line(folder / "arm.csv");
        for (const char* generator : {"Ninja", "Unix Makefiles"}) {
            CAPTURE(generator);
            const std::string build = folder / (std::string("build ") + generator);
            output_of(
                {"cmake", "-S", folder / "project", "-B", build, "-G", generator, "-DCMAKE_PREFIX_PATH=" + prefix});
            output_of({"cmake", "--build", build});
            std::string computed = output_of({build + "/kernel"});
            computed.pop_back();
            CHECK(wanted.starts_with(computed + ","));
            const std::string controlled = output_of({build + "/control", folder / "project/arm.toml"});
            CHECK(controlled.starts_with("t = 4.00 s: a = -0.01924"));
            CHECK(output_of({build + "/feedback"}) == controlled);
            CHECK(output_of({build + "/swing", folder / "project/arm.toml"}).find("1000 of 1000") != std::string::npos);
            // Nothing is made again, until the scene changes.
            CHECK(output_of({"cmake", "--build", build}).find("Deriving") == std::string::npos);
            std::ofstream(folder / "project/arm.toml", std::ios::app) << "# changed\n";
            CHECK(output_of({"cmake", "--build", build}).find("Deriving") != std::string::npos);
        }
    }

    TEST_CASE("lobatto_add_kernel derives again when a file of the scene's tables changes") {
        const test::TemporaryFolder folder;
        install(folder / "prefix");
        const std::string scene = folder / "2 driven.toml", build = folder / "build";
        test::write_text(folder / "push.csv", "0,0\n1,1\n2,0\n3,1\n4,0\n");
        test::write_text(
            scene,
            "time = \"t\"\nlagrangian = \"x'^2/2 - x^2/2\"\n[coordinates]\nx = { position = 1, velocity = 0 "
            "}\n[forces]\nx = '''table( \"push.csv\", t)'''\n[run]\nstep = 0.1\nuntil = 4\n");
        test::write_text(folder / "main.cpp", "#include \"2 driven.hpp\"\nint main() {}\n");
        test::write_text(
            folder / "CMakeLists.txt",
            "cmake_minimum_required(VERSION 3.25)\nproject(p LANGUAGES CXX)\nfind_package(Lobatto "
            "REQUIRED)\nadd_executable(main main.cpp)\nlobatto_add_kernel(main SCENE \"2 driven.toml\")\n");
        output_of({"cmake", "-S", folder.string(), "-B", build, "-G", "Ninja",
                   "-DCMAKE_PREFIX_PATH=" + (folder / "prefix").string()});
        const auto derives = [&] {
            return output_of({"cmake", "--build", build}).find("Deriving") != std::string::npos;
        };
        CHECK(derives());
        CHECK_FALSE(derives());
        test::write_text(folder / "push.csv", "0,0\n1,2\n2,0\n3,1\n4,0\n");
        CHECK(derives());
        CHECK_FALSE(derives());
        // Another table, named in a text of double quotes.
        test::write_text(folder / "pull.csv", "0,0\n1,2\n2,0\n3,1\n4,0\n");
        test::write_text(scene, std::regex_replace(test::read_file(scene), std::regex("'''.*'''"),
                                                   "\"table(\\\"pull.csv\\\", t)\""));
        CHECK(derives());
        test::write_text(folder / "pull.csv", "0,0\n1,1\n2,0\n3,1\n4,0\n");
        CHECK(derives());
    }

    TEST_CASE("below DESTDIR lies all that is installed: program, library, manual pages, completions, schemas") {
        const test::TemporaryFolder folder;
        {
            const test::EnvironmentVariable destination("DESTDIR", folder.string());
            install("/opt/lobatto");
        }
        CHECK(std::distance(fs::directory_iterator(folder.string()), fs::directory_iterator()) == 1);
        const std::string root = folder / "opt/lobatto";
        for (const char* file :
             {"bin/lobatto", "include/lobatto/lobatto.h", "include/lobatto/lobatto.hpp", "share/man/man1/lobatto.1",
              "share/man/man1/lobatto-run.1", "share/bash-completion/completions/lobatto",
              "share/zsh/site-functions/_lobatto", "share/fish/vendor_completions.d/lobatto.fish",
              "share/lobatto/scene.schema.json", "share/lobatto/schemas", "share/lobatto/scenes/pendulum.toml",
              "share/lobatto/examples/cmake/arm.toml", "share/doc/lobatto/copyright"})
            CHECK_MESSAGE(fs::exists(root + "/" + file), file);
        // No file names the folder that it was put below, nor the one where it was built.
        for (const std::string& path : {folder.string(), build_folder}) {
            const test::Finished found = test::run({"grep", "-rlIF", path, root});
            CHECK_MESSAGE(found.out.empty(), found.out);
        }
        const std::string moved = folder / "moved";
        fs::rename(root, moved);
        output_of({moved + "/bin/lobatto", "run", moved + "/share/lobatto/scenes/pendulum.toml", "--until", "1",
                   "--quiet", "-o", folder / "run.csv"});
        CHECK(fs::exists(folder / "run.csv"));
        CHECK(output_of({"bash", "-c",
                         "source '" + moved + "/share/bash-completion/completions/lobatto' && complete -p lobatto"})
                  .find("lobatto") != std::string::npos);
    }

    TEST_CASE("pkg-config finds the library in the folder where it lies") {
        const test::TemporaryFolder folder;
        install(folder / "prefix");
        const std::string prefix = folder / "prefix", program = folder / "version";
        std::ofstream(folder / "version.c") << "#include <lobatto/lobatto.h>\n#include <stdio.h>\n"
                                               "int main(void) { puts(lobatto_version()); return 0; }\n";
        const std::string libraries =
            fs::exists(prefix + "/lib/pkgconfig") ? prefix + "/lib" : prefix + "/lib/x86_64-linux-gnu";
        const test::EnvironmentVariable path("PKG_CONFIG_PATH", libraries + "/pkgconfig");
        const std::string flags = output_of({"pkg-config", "--cflags", "--libs", "lobatto"});
        const std::string line = "gcc -std=c99 -pedantic -Wall -Werror " + (folder / "version.c").string() + " -o " +
                                 program + " " + flags.substr(0, flags.find('\n')) + " -Wl,-rpath," + libraries;
        output_of({"sh", "-c", line});
        CHECK(output_of({program}).starts_with("0.1"));
    }

    TEST_CASE("lobatto_add_kernel says what is wrong with its arguments") {
        const test::TemporaryFolder folder;
        install(folder / "prefix");
        const auto configure = [&](const std::string& call) {
            std::ofstream(folder / "CMakeLists.txt")
                << "cmake_minimum_required(VERSION 3.25)\nproject(p LANGUAGES CXX)\nfind_package(Lobatto REQUIRED)\n"
                << "file(WRITE ${CMAKE_BINARY_DIR}/a.cpp \"int main() {}\")\nadd_executable(a "
                   "${CMAKE_BINARY_DIR}/a.cpp)\n"
                << call << '\n';
            return test::run({"cmake", "-S", folder.string(), "-B", folder / "build",
                              "-DCMAKE_PREFIX_PATH=" + (folder / "prefix").string()})
                .err;
        };
        CHECK(configure("lobatto_add_kernel(a SCENE none.toml)").find("there is no scene file") != std::string::npos);
        CHECK(configure("lobatto_add_kernel(a)").find("SCENE is missing") != std::string::npos);
        CHECK(configure("lobatto_add_kernel(b SCENE x.toml)").find("there is no target b") != std::string::npos);
        CHECK(configure("lobatto_add_kernel(a SCEN x.toml)").find("unknown argument") != std::string::npos);
        CHECK(configure("lobatto_add_kernel(a SCENE x.toml POINTS)").find("no value after POINTS") !=
              std::string::npos);
        CHECK(configure("lobatto_add_kernel(a SCENE x.toml PLAIN ENSEMBLE)").find("PLAIN has no ensembles") !=
              std::string::npos);
        // What numbers beyond long double need is linked, whoever names them.
        const auto linked = [&](const std::string& method, const std::string& call) {
            test::write_text(folder / "x.toml", "lagrangian = \"q'^2/2\"\n[method]\n" + method + "\n");
            CHECK(configure("lobatto_add_kernel(a SCENE x.toml " + call + ")") == "");
            return test::read_file(folder / "build/CMakeFiles/a.dir/link.txt");
        };
        CHECK(test::contains(linked("points = 4", "NUMBERS \"50 digits\""), "-lmpfr"));
        CHECK(test::contains(linked("numbers = \"30 digits\"", ""), "-lmpfr"));
        CHECK(test::contains(linked("numbers = 'quadruple'", ""), "-lquadmath"));
        CHECK_FALSE(test::contains(linked("numbers = \"30 digits\"", "NUMBERS double"), "-l"));
    }
}
