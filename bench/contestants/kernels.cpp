// SPDX-License-Identifier: GPL-2.0-or-later
#include "bench/contestants/kernels.hpp"

#include <fmt/format.h>

#include <atomic>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <future>
#include <limits>
#include <map>
#include <thread>

#include "analysis/gradients.hpp"
#include "analysis/kernel/kernel_of.hpp"
#include "analysis/stability/limit.hpp"
#include "bench/reference.hpp"
#include "generator/pipeline.hpp"
#include "runtime/error.hpp"

namespace lobatto::bench {

namespace {

std::string scene_path(const Problem& problem) {
    return std::string(LOBATTO_SOURCE_DIR) + "/bench/scenes/" + problem.scene;
}

// `together`: as in kernels_of; clean arithmetic is for one trajectory alone.
std::vector<Method> methods_in_race(const Problem& problem, bool few, bool separable, std::int64_t together) {
    std::vector<Method> methods;
    // Equal steps have little chance there, but where a run is so long that rounding decides.
    if (problem.positions_only) {
        methods = {{Family::lobatto, 9}, {Family::lobatto, 12}, {Family::gauss, 10}};
        if (problem.is_long() && together == 0)
            for (const int points : {9, 10, 12}) methods.push_back({Family::lobatto, points, 0, StepArithmetic::clean});
        return methods;
    }
    for (const int points : {3, 4, 5, 6, 7, 8, 9, 10, 12})
        if (!few || points % 4 == 1) methods.push_back({Family::lobatto, points});
    for (const int stages : {2, 3, 4, 6, 8, 10})
        if (!few || stages == 8) methods.push_back({Family::gauss, stages});
    if (separable)
        for (const int stages : sizes_of(Family::splitting))
            if (!few || stages == 11) methods.push_back({Family::splitting, stages});
    return methods;
}

bool is_clean(const Method& method) {  // such a step is always iterated to rounding
    return method.arithmetic == StepArithmetic::clean;
}

long evaluations_of(const lobatto_kernel& kernel, const lobatto_advance& call) {
    return static_cast<long>(
        gradients_of(kernel, static_cast<double>(call.iterations), static_cast<double>(call.steps_done)));
}

Effort run_one(LoadedStepper<double>& stepper, std::int64_t steps, double tolerance, Trajectory& trajectory) {
    if (stepper.start(0, trajectory.q, trajectory.p) != LOBATTO_OK) return {};
    lobatto_advance call{};
    call.steps = steps;
    call.tolerance = tolerance;
    const lobatto_status status = stepper.advance(call);
    double time;
    stepper.state(time, trajectory.q, trajectory.p);
    return {status == LOBATTO_OK && call.steps_done == steps, static_cast<long>(call.steps_done),
            evaluations_of(stepper.kernel().table(), call)};
}

// Side by side, `lanes` at a time; lanes left over in the last group stand still.
Effort run_lanes(const lobatto_kernel& kernel, double h, std::int64_t steps, double tolerance,
                 std::vector<Trajectory>& trajectories) {
    const std::size_t lanes = static_cast<std::size_t>(kernel.lanes), n = static_cast<std::size_t>(kernel.coordinates);
    const std::size_t alignment = static_cast<std::size_t>(kernel.ensemble_alignment);
    const std::size_t bytes = (static_cast<std::size_t>(kernel.ensemble_bytes) + alignment - 1) / alignment * alignment;
    const std::unique_ptr<void, void (*)(void*)> ensemble(std::aligned_alloc(alignment, bytes), std::free);
    const double time = 0;
    std::vector<double> q(lanes * n), p(lanes * n);
    std::vector<std::int64_t> steps_done(lanes), iterations(lanes);
    Effort all{true, 0, 0};
    for (std::size_t first = 0; first < trajectories.size(); first += lanes) {
        const std::size_t used = std::min(lanes, trajectories.size() - first);
        std::vector<std::int32_t> status(lanes, LOBATTO_OK);
        for (std::size_t lane = 0; lane < lanes; ++lane) {
            const Trajectory& start = trajectories[first + std::min(lane, used - 1)];
            std::copy(start.q.begin(), start.q.end(), q.begin() + static_cast<std::ptrdiff_t>(lane * n));
            std::copy(start.p.begin(), start.p.end(), p.begin() + static_cast<std::ptrdiff_t>(lane * n));
        }
        kernel.ensemble_prepare(ensemble.get(), nullptr, &h, status.data());
        std::fill(status.begin() + static_cast<std::ptrdiff_t>(used), status.end(), LOBATTO_UNSUPPORTED);
        kernel.ensemble_start(ensemble.get(), &time, q.data(), p.data(), status.data());
        kernel.ensemble_advance(ensemble.get(), steps, tolerance, status.data(), steps_done.data(), iterations.data());
        kernel.ensemble_state(ensemble.get(), q.data(), p.data());
        for (std::size_t lane = 0; lane < used; ++lane) {
            Trajectory& end = trajectories[first + lane];
            std::copy_n(q.begin() + static_cast<std::ptrdiff_t>(lane * n), n, end.q.begin());
            std::copy_n(p.begin() + static_cast<std::ptrdiff_t>(lane * n), n, end.p.begin());
            lobatto_advance call{};
            call.steps_done = steps_done[lane];
            call.iterations = iterations[lane];
            all.good = all.good && status[lane] == LOBATTO_OK && steps_done[lane] == steps;
            all.steps += static_cast<long>(call.steps_done);
            all.evaluations += evaluations_of(kernel, call);
        }
    }
    return all;
}

// Where the iteration of a step ends, relative to the displacement in it; 0: at rounding.
const std::vector<double>& tolerances_of(const Problem& problem) {
    static const std::vector all = {0.0, 1e-13, 1e-12, 1e-11, 1e-10, 1e-9, 1e-8, 1e-7}, few = {0.0, 1e-13, 1e-11};
    return problem.positions_only ? few : all;
}

// `steps` steps of h of each trajectory.
using Run = std::function<Effort(double h, std::int64_t steps, std::vector<Trajectory>& trajectories)>;

Run run_of(const Problem& problem, const Kernel& kernel, double tolerance) {
    const auto stepper = std::make_shared<LoadedStepper<double>>(kernel);
    const auto run = [stepper, tolerance](double h, std::int64_t steps,
                                          std::vector<Trajectory>& trajectories) -> Effort {
        const lobatto_kernel& table = stepper->kernel().table();
        if (table.lanes > 0) return run_lanes(table, h, steps, tolerance, trajectories);
        if (stepper->prepare({}, h) != LOBATTO_OK) return {};
        return one_by_one(trajectories,
                          [&](Trajectory& trajectory) { return run_one(*stepper, steps, tolerance, trajectory); });
    };
    return [run, masses = masses_of(problem)](double h, std::int64_t steps, std::vector<Trajectory>& trajectories) {
        change_momenta(masses, trajectories, std::multiplies<>());
        const Effort effort = run(h, steps, trajectories);
        change_momenta(masses, trajectories, std::divides<>());
        return effort;
    };
}

// Whether the energy error of a run a hundred times as long stays within ten times that of the run: a step beyond the
// linear stability limit may look good at T and be lost at 3 T.
bool endures(const Problem& problem, const Run& run, std::int64_t steps, const Trajectory& start) {
    constexpr std::int64_t looks = 16, times = 100;
    constexpr double rounding = 1e-13;
    const double h = problem.until / static_cast<double>(steps), H0 = energy_of(problem, start);
    std::vector<Trajectory> one = {start};
    const auto error_after = [&](std::int64_t count) {
        if (!run(h, count, one).good) return std::numeric_limits<double>::infinity();
        return std::fabs(energy_of(problem, one.front()) / H0 - 1);
    };
    double largest = rounding;
    for (std::int64_t look = 0; look < looks; ++look) {
        const double error = error_after((look + 1) * steps / looks - look * steps / looks);
        if (!(error < 1)) return false;
        largest = std::fmax(largest, error);
    }
    for (std::int64_t time = 1; time < times; ++time)
        if (!(error_after(steps) <= 10 * largest)) return false;
    return true;
}

Contestant contestant_of(const Problem& problem, Method method, double tolerance, const Kernel& kernel,
                         std::int64_t together) {
    const Run run = run_of(problem, kernel, tolerance);
    // Beyond this, of which `lobatto run` warns, a step must prove itself.
    const double longest = stability_limit(quadrature_of(method)) / problem.frequency;
    const auto proven = std::make_shared<std::map<std::int64_t, bool>>();
    const auto race = [run, longest, proven, &problem](double setting,
                                                       std::vector<Trajectory>& trajectories) -> Effort {
        const double h = problem.until / setting;
        const auto steps = static_cast<std::int64_t>(setting);
        if (h > longest) {
            if (!problem.clocks.empty()) return {};  // no time to prove it: steps with a clock are there
            const auto [place, is_new] = proven->try_emplace(steps, false);
            if (is_new) place->second = endures(problem, run, steps, trajectories.front());
            if (!place->second) return {};
        }
        return run(h, steps, trajectories);
    };
    const std::string name = method.name() + (tolerance > 0 ? fmt::format(", to {:.0e}", tolerance) : "");
    Contestant contestant{name, method.order(), true, true, Ladder::steps, race};
    contestant.cold_start = [&problem, method, together] { return cold_start_seconds(problem, method, together, ""); };
    return contestant;
}

Kernel kernel_for(const KernelSource& source, std::int64_t together) {
    return together > 0 ? ensemble_kernel_of(source, Precision::double_, together)
                        : kernel_of(source, Precision::double_);
}

}  // namespace

std::vector<double> masses_of(const Problem& problem) {
    return with_type_of(problem, [](auto type) {
        std::vector<double> masses;
        for (int k = 0; k < decltype(type)::coordinates; ++k) masses.push_back(type.mass(k));
        return masses;
    });
}

KernelSource source_of(const Problem& problem, Method method, const std::string& clock) {
    const Source file = Source::read(scene_path(problem));
    const std::string with_clock = clock.empty() ? "" : fmt::format("\n[method]\nclock = \"{}\"\n", clock);
    Scene scene = read_scene(Source(file.path(), file.content() + with_clock));
    scene.method = method;
    return emit(derive(scene));
}

std::vector<Kernel> kernels_of(const Problem& problem, const std::vector<Method>& methods, std::int64_t together,
                               const std::string& clock) {
    std::vector<KernelSource> sources;
    for (const Method& method : methods) sources.push_back(source_of(problem, method, clock));
    // Compilers side by side; the generator itself is for one thread.
    std::atomic<std::size_t> next = 0;
    std::vector<std::future<void>> workers;
    for (unsigned i = 0; i < std::max(1u, std::thread::hardware_concurrency()); ++i)
        workers.push_back(std::async(std::launch::async, [&] {
            for (std::size_t j; (j = next++) < sources.size();)
                compile(translation_of(sources[j], Precision::double_, together));
        }));
    for (std::future<void>& worker : workers) worker.get();
    std::vector<Kernel> kernels;
    for (const KernelSource& source : sources) kernels.push_back(kernel_for(source, together));
    return kernels;
}

Contestants kernel_contestants(const Problem& problem, bool few, std::int64_t together) {
    const bool separable = derive(read_scene(scene_path(problem))).system.separable;
    const std::vector<Method> methods = methods_in_race(problem, few, separable, together);
    const std::vector<Kernel> kernels = kernels_of(problem, methods, together, "");
    Contestants contestants;
    for (std::size_t i = 0; i < methods.size(); ++i)
        for (const double tolerance : tolerances_of(problem))
            if (tolerance == 0 || (methods[i].family != Family::splitting && !is_clean(methods[i])))
                contestants.push_back(contestant_of(problem, methods[i], tolerance, kernels[i], together));
    return contestants;
}

double cold_start_seconds(const Problem& problem, Method method, std::int64_t together, const std::string& clock) {
    const char* const variable = "LOBATTO_CACHE_DIR";
    const char* const before = std::getenv(variable);
    const std::string saved = before == nullptr ? "" : before;
    double best = std::numeric_limits<double>::infinity();
    for (int repetition = 0; repetition < 3; ++repetition) {
        std::string folder = (std::filesystem::temp_directory_path() / "lobatto-bench-XXXXXX").string();
        if (mkdtemp(folder.data()) == nullptr) throw MachineError("cannot create a folder in the temporary folder");
        setenv(variable, folder.c_str(), 1);
        const auto start = std::chrono::steady_clock::now();
        kernel_for(source_of(problem, method, clock), together);
        best = std::min(best, std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count());
        std::filesystem::remove_all(folder);
    }
    if (before == nullptr)
        unsetenv(variable);
    else
        setenv(variable, saved.c_str(), 1);
    return best;
}

}  // namespace lobatto::bench
