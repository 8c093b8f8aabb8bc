// SPDX-License-Identifier: GPL-2.0-or-later
// lobatto_bench: our kernels against every peer, on the problems of docs/benchmarks.md.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <filesystem>

#include "bench/device.hpp"
#include "bench/growth.hpp"
#include "bench/instructions.hpp"
#include "bench/reference.hpp"
#include "bench/report.hpp"
#include "runtime/error.hpp"

namespace {

using namespace lobatto;
using namespace lobatto::bench;

struct Options {
    std::vector<std::string> problems;
    std::string output = "out/bench";
    bool ensemble = false, single = false;
    bool references = false;
    bool device = false, growth = false, instructions = false, store = false;
    RaceOptions race;
};

void run(const Options& options) {
    std::filesystem::create_directories(options.output);
    std::vector<Race> single, ensemble;
    for (const Problem& problem : problems()) {
        const auto& wanted = options.problems;
        if (!wanted.empty() && std::find(wanted.begin(), wanted.end(), problem.name) == wanted.end()) continue;
        if (!options.ensemble) single.push_back(run_race(problem, 1, options.race));
        if (!options.single) ensemble.push_back(run_race(problem, ensemble_size, options.race));
    }
    fill_cold_starts(single);
    fill_cold_starts(ensemble);
    print_machine();
    // Equal time scales and varying ones apart.
    for (const std::vector<Race>* races : {&single, &ensemble})
        for (const bool varying : {false, true}) {
            std::vector<Race> alike;
            std::copy_if(races->begin(), races->end(), std::back_inserter(alike),
                         [&](const Race& race) { return race.problem->positions_only == varying; });
            print_tables(alike);
        }
    std::vector<Race> all = single;
    all.insert(all.end(), ensemble.begin(), ensemble.end());
    write_csv(options.output + "/measurements.csv", all);
    for (const Race& race : all) draw_diagram(options.output, race);
    fmt::print("\nAll measurements and the work-precision diagrams: {}/measurements.csv, {}/P1.svg …\n", options.output,
               options.output);
}

}  // namespace

int main(int argc, char** argv) {
    CLI::App program("The race", "lobatto bench");
    program.set_help_flag();  // the launcher shows bench/help.txt, without building this
    Options options;
    std::vector<std::string> names;
    for (const Problem& problem : problems()) names.push_back(problem.name);
    program.add_option("--problem", options.problems, "Only this problem; may be given again")
        ->check(CLI::IsMember(names));
    program.add_option("--output", options.output, "Folder of the CSV file and the diagrams")->capture_default_str();
    CLI::Option* ensemble = program.add_flag("--ensemble", options.ensemble, "Only the ensembles");
    program.add_flag("--single", options.single, "Only one trajectory")->excludes(ensemble);
    program.add_flag("--peers-only", options.race.peers_only, "Without our kernels");
    program.add_option("--method", options.race.methods, "Only methods whose names hold this word; may be given again");
    program.add_flag("--quick", options.race.quick, "Fewer kernels, coarser steps and fewer repetitions");
    program.add_flag("--references", options.references,
                     "No race: how far the references of the problems move with shorter steps");
    program.add_flag("--device", options.device, "No race: sweeps of P1 to P4 on a GPU, beside the processor");
    program.add_flag("--growth", options.growth, "No race: chains of 8 to 4096 masses, linear systems");
    CLI::Option* instructions = program.add_flag("--instructions", options.instructions,
                                                 "No race: count the instructions a step, compare with the stored");
    program.add_flag("--store", options.store, "Store the counts instead")->needs(instructions);
    try {
        program.parse(argc, argv);
        if (options.instructions) return check_instructions(options.store);
        if (options.references) {
            print_references(options.problems);
        } else if (options.device) {
            print_machine();
            print_device_rates();
        } else if (options.growth) {
            print_machine();
            print_growth();
        } else {
            run(options);
        }
        return 0;
    } catch (const CLI::ParseError& error) {
        return program.exit(error) == 0 ? 0 : 2;
    } catch (const MachineError& error) {
        fmt::print(stderr, "lobatto bench: {}\n", error.what());
        return 4;
    } catch (const std::exception& error) {
        fmt::print(stderr, "lobatto bench: {}\n", error.what());
        return 3;
    }
}
