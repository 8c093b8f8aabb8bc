// SPDX-License-Identifier: GPL-2.0-or-later
#include "analysis/accuracy/roundoff_growth.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <exception>
#include <limits>
#include <mutex>
#include <optional>
#include <thread>

#include "analysis/exact_start.hpp"
#include "analysis/kernel/kernel_of.hpp"
#include "generator/pipeline.hpp"
#include "runtime/error.hpp"
#include "runtime/stopwatch.hpp"

namespace lobatto {

namespace {

using Quad = __float128;

constexpr double lost = 0.5;                   // of the energy
constexpr std::int64_t steps_at_once = 10000;  // between two looks at the interruption

std::vector<std::int64_t> checkpoints(std::int64_t steps) {
    std::vector<std::int64_t> result;
    for (std::int64_t decade = 10; decade < steps; decade *= 10)
        for (const std::int64_t factor : {1, 2, 5})
            if (factor * decade < steps) result.push_back(factor * decade);
    result.push_back(steps);
    return result;
}

Kernel kernel_in(const Scene& scene, StepArithmetic arithmetic, Precision precision) {
    Scene same = scene;
    same.method.arithmetic = arithmetic;
    same.method.tolerance = 0;
    EmitOptions options;
    options.precision = precision;
    return kernel_of(emit(derive(same), options), precision);
}

struct Kernels {
    Kernel plain, clean;             // double
    std::optional<Kernel> extended;  // long double; none: energies are compared with the first
    Kernel exact;                    // quadruple
};

// One trajectory in one arithmetic; its state in quadruple precision.
template <class real>
class Runner {
public:
    Runner(const char* name, const Kernel& kernel, const std::vector<real>& parameters, double step,
           const std::vector<real>& q, const std::vector<real>& p)
        : name_(name), stepper_(kernel), n_(q.size()), step_(step) {
        succeed(stepper_.prepare(parameters, static_cast<real>(step)));
        succeed(stepper_.start(0, q, p));
    }

    void advance(std::int64_t steps) {
        lobatto_advance call{};
        call.steps = steps;
        const Stopwatch watch;
        succeed(stepper_.advance(call));
        seconds += watch.seconds();
        iterations += call.iterations;
        taken += steps;
    }

    // Position, and momentum from the velocity where that has two numbers.
    void state(const LoadedStepper<Quad>& exact, std::vector<Quad>& q, std::vector<Quad>& p) const {
        std::vector<real> value(n_), rest(n_), rate(n_), rate_rest(n_);
        if (stepper_.two_fold_state(value, rest, rate, rate_rest)) {
            q = sum(value, rest);
            p = exact.momentum(time(), q, sum(rate, rate_rest));
        } else {
            real time;
            stepper_.state(time, value, rate);
            q = sum(value, rest);
            p = sum(rate, rest);
        }
    }

    Quad time() const { return static_cast<Quad>(static_cast<double>(taken)) * static_cast<Quad>(step_); }

    double seconds = 0;
    std::int64_t iterations = 0, taken = 0;

private:
    void succeed(lobatto_status status) const {
        if (status != LOBATTO_OK)
            throw ComputationError(
                fmt::format("in {}, a step after {} fails; `lobatto run` with the same options and "
                            "--arithmetic says why",
                            name_, taken));
    }
    std::vector<Quad> sum(const std::vector<real>& value, const std::vector<real>& rest) const {
        std::vector<Quad> result;
        for (std::size_t k = 0; k < n_; ++k) result.push_back(static_cast<Quad>(value[k]) + static_cast<Quad>(rest[k]));
        return result;
    }

    const char* name_;
    LoadedStepper<real> stepper_;
    std::size_t n_;
    double step_;
};

struct Difference {
    double energy = 0, position = 0;
};

// All checkpoints of one trajectory.
struct Course {
    std::vector<Difference> plain, clean;
    double energy_scale = 0;  // |H(0)|, or half of the largest kinetic energy met where that is larger
    double plain_seconds = 0, clean_seconds = 0;
    std::int64_t plain_iterations = 0, clean_iterations = 0;
};

Course follow(const Kernels& kernels, StartIn<double> in_double, double step, int number,
              const std::vector<std::int64_t>& looks, const volatile int* interrupted,
              const std::function<void(std::int64_t)>& taken) {
    const double factor = 1 + number * 0x1p-20;
    for (double& q : in_double.q) q *= factor;
    for (double& p : in_double.p) p *= factor;
    const auto quad_of = [](const std::vector<double>& values) {
        return std::vector<Quad>(values.begin(), values.end());
    };
    const std::vector<Quad> parameters = quad_of(in_double.parameters);
    LoadedStepper<Quad> exact(kernels.exact);
    exact.prepare(parameters, static_cast<Quad>(step));
    Runner<double> plain("plain arithmetic", kernels.plain, in_double.parameters, step, in_double.q, in_double.p);
    Runner<double> clean("clean arithmetic", kernels.clean, in_double.parameters, step, in_double.q, in_double.p);

    // The reference begins where the clean steps do: at momenta that give the velocity in double.
    std::vector<Quad> q, p, q_exact, p_exact;
    clean.state(exact, q, p);
    const auto extended_of = [](const std::vector<Quad>& values) {
        std::vector<long double> result;
        for (const Quad value : values) result.push_back(static_cast<long double>(value));
        return result;
    };
    std::optional<Runner<long double>> reference;
    if (kernels.extended)
        reference.emplace("long double", *kernels.extended, extended_of(parameters), step, extended_of(q),
                          extended_of(p));
    Quad H0 = 0, H = 0, H_exact = 0, V = 0;
    exact.energy(0, q, p, H0);
    H_exact = H0;
    const std::vector<Quad> at_rest(p.size(), Quad(0));
    double largest = 0;
    Course course;
    course.energy_scale = std::fabs(static_cast<double>(H0));
    for (const std::int64_t look : looks) {
        while (plain.taken < look && *interrupted == 0) {
            const std::int64_t more = std::min(look - plain.taken, steps_at_once);
            plain.advance(more);
            clean.advance(more);
            if (reference) reference->advance(more);
            taken(more);
        }
        if (plain.taken < look) break;
        if (reference) {
            reference->state(exact, q_exact, p_exact);
            exact.energy(reference->time(), q_exact, p_exact, H_exact);
            for (const Quad value : q_exact) largest = std::max(largest, std::fabs(static_cast<double>(value)));
        }
        const auto compare = [&](const Runner<double>& runner) {
            runner.state(exact, q, p);
            exact.energy(runner.time(), q, p, H);
            Difference difference;
            difference.energy = static_cast<double>(H - H_exact);
            exact.energy(runner.time(), q, at_rest, V);
            course.energy_scale = std::max(course.energy_scale, std::fabs(static_cast<double>(H - V)) / 2);
            if (!reference) difference.position = std::numeric_limits<double>::quiet_NaN();
            for (std::size_t k = 0; k < q_exact.size(); ++k)
                difference.position =
                    std::max(difference.position, std::fabs(static_cast<double>(q[k] - q_exact[k])) / largest);
            return difference;
        };
        course.plain.push_back(compare(plain));
        course.clean.push_back(compare(clean));
    }
    course.plain_seconds = plain.seconds;
    course.clean_seconds = clean.seconds;
    course.plain_iterations = plain.iterations;
    course.clean_iterations = clean.iterations;
    return course;
}

double exponent(const std::vector<RoundoffRow>& rows, double RoundoffRow::*value) {
    double count = 0, sx = 0, sy = 0, sxx = 0, sxy = 0;
    for (const RoundoffRow& row : rows) {
        if (row.steps < 1000 || !(row.*value > 0)) continue;  // or not a number
        const double x = std::log(static_cast<double>(row.steps)), y = std::log(row.*value);
        count += 1;
        sx += x;
        sy += y;
        sxx += x * x;
        sxy += x * y;
    }
    return count < 3 ? std::numeric_limits<double>::quiet_NaN() : (count * sxy - sx * sy) / (count * sxx - sx * sx);
}

RoundoffGrowth growth_of(const std::vector<Course>& courses, std::vector<Difference> Course::*differences,
                         double Course::*seconds, std::int64_t Course::*iterations,
                         const std::vector<std::int64_t>& looks, std::size_t count) {
    RoundoffGrowth growth;
    const auto trajectories = static_cast<double>(courses.size());
    for (std::size_t i = 0; i < count; ++i) {
        RoundoffRow row{looks[i], 0, 0, 0};
        for (const Course& course : courses) {
            const Difference& difference = (course.*differences)[i];
            const double energy = course.energy_scale > 0 ? difference.energy / course.energy_scale : difference.energy;
            row.energy_mean += energy / trajectories;
            row.energy_rms += energy * energy / trajectories;
            row.position_rms += difference.position * difference.position / trajectories;
        }
        row.energy_rms = std::sqrt(row.energy_rms);
        row.position_rms = std::sqrt(row.position_rms);
        growth.rows.push_back(row);
    }
    if (count == 0) return growth;
    growth.energy_exponent = exponent(growth.rows, &RoundoffRow::energy_rms);
    growth.position_exponent = exponent(growth.rows, &RoundoffRow::position_rms);
    double least = std::numeric_limits<double>::infinity();
    for (const Course& course : courses) {
        const auto steps = static_cast<double>(looks[(course.*differences).size() - 1]);
        least = std::min(least, course.*seconds / steps);
        growth.iterations += static_cast<double>(course.*iterations) / steps / trajectories;
    }
    growth.nanoseconds = 1e9 * least;
    return growth;
}

}  // namespace

RoundoffResult roundoff_growth(Scene scene, std::int64_t steps, int trajectories, bool reference,
                               const volatile int* interrupted, const std::function<void(std::int64_t)>& progress) {
    scene.outputs.energy = true;
    scene.outputs.tangent = false;
    scene.outputs.dense = 0;
    scene.outputs.events.clear();
    if (!reference) {
        const Derivation derivation = derive(scene);
        if (!derivation.conserves_energy())
            throw InputError(
                fmt::format("{}: --no-reference compares energies with the first, and a force or the time changes this "
                            "one's; leave --no-reference away",
                            scene.path));
    }
    const ExactStart start(scene);
    const double step = scene.evaluate(scene.run.step, "the step").to_double();
    Kernels kernels = {kernel_in(scene, StepArithmetic::plain, Precision::double_),
                       kernel_in(scene, StepArithmetic::clean, Precision::double_),
                       {},
                       kernel_in(scene, StepArithmetic::plain, Precision::quadruple)};
    if (reference) kernels.extended = kernel_in(scene, StepArithmetic::clean, Precision::extended);
    const std::vector<std::int64_t> looks = checkpoints(steps);
    const StartIn<double> in_double = start_in(start, kernels.plain, step);
    std::vector<Course> courses(static_cast<std::size_t>(trajectories));
    std::atomic<int> next = 0;
    std::mutex guard;
    std::exception_ptr failure;
    std::int64_t done = 0;
    const auto taken = [&](std::int64_t more) {
        const std::lock_guard lock(guard);
        progress(done += more);
    };
    {
        std::vector<std::jthread> workers;
        const int count =
            std::min<int>(trajectories, static_cast<int>(std::max(1u, std::thread::hardware_concurrency())));
        for (int worker = 0; worker < count; ++worker)
            workers.emplace_back([&] {
                for (int i = next++; i < trajectories; i = next++) try {
                        courses[static_cast<std::size_t>(i)] =
                            follow(kernels, in_double, step, i, looks, interrupted, taken);
                    } catch (...) {
                        const std::lock_guard lock(guard);
                        if (!failure) failure = std::current_exception();
                        next = trajectories;
                    }
            });
    }
    if (failure) std::rethrow_exception(failure);
    // Those at their end, or else those that have begun.
    const bool any_ended = std::any_of(courses.begin(), courses.end(),
                                       [&](const Course& course) { return course.plain.size() == looks.size(); });
    std::erase_if(courses, [&](const Course& course) { return course.plain.size() < (any_ended ? looks.size() : 1); });
    std::size_t common = courses.empty() ? 0 : looks.size();
    for (const Course& course : courses) common = std::min(common, course.plain.size());
    RoundoffResult result;
    result.trajectories = static_cast<int>(courses.size());
    result.interrupted = result.trajectories < trajectories || common < looks.size();
    result.steps = common > 0 ? looks[common - 1] : 0;
    result.plain = growth_of(courses, &Course::plain, &Course::plain_seconds, &Course::plain_iterations, looks, common);
    result.clean = growth_of(courses, &Course::clean, &Course::clean_seconds, &Course::clean_iterations, looks, common);
    for (const RoundoffGrowth& growth : {result.plain, result.clean})
        for (const RoundoffRow& row : growth.rows) result.lost = result.lost || !(row.energy_rms < lost);
    return result;
}

}  // namespace lobatto
