// SPDX-License-Identifier: GPL-2.0-or-later
/// Lobatto as a library: a scene, its compiled kernel, a stepper; runs, sweeps, and what is known of a scene.
///
///     namespace lob = lobatto::api;
///     const lob::Scene scene("pendulum.toml");
///     lob::Stepper stepper(lob::compile(scene));
///     stepper.advance(100);
///
/// The examples further down go on from these lines; tests compile and run them.
///
/// Units are those of the scene. Arrays of several states are row-major: state i, coordinate k is [i * n + k].
/// Every function throws Error when it cannot do what it promises; the texts are those of the command line.
/// Reading, deriving and destroying scenes takes a lock of the whole process; objects of different threads are free
/// otherwise. One object must not be used by two threads at a time, unless all that is called is const. An object that
/// was moved from may be assigned to or destroyed, and nothing else.
///
/// This header, and the library, are GPL-2.0-or-later, because GiNaC is. The C++ that `lobatto emit` writes is MIT, and
/// needs neither.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#if defined(__GNUC__)
#define LOBATTO_API __attribute__((visibility("default")))
#else
#define LOBATTO_API
#endif

namespace lobatto::api {

// --- Errors ----------------------------------------------------------------------------------------------------------

/// What went wrong, where, why, and what to try. The exit code is that of the command line.
class LOBATTO_API Error : public std::runtime_error {
public:
    Error(const std::string& text, int exit_code) : std::runtime_error(text), exit_code_(exit_code) {}
    int exit_code() const noexcept { return exit_code_; }

private:
    int exit_code_;
};
class LOBATTO_API InputError : public Error {  ///< a wrong scene, name or value
public:
    explicit InputError(const std::string& text) : Error(text, 2) {}
};
class LOBATTO_API ComputationError : public Error {  ///< steps that are not solved, motions that are not followed
public:
    explicit ComputationError(const std::string& text) : Error(text, 3) {}
};
class LOBATTO_API MachineError : public Error {  ///< the compiler, a disk, memory
public:
    explicit MachineError(const std::string& text) : Error(text, 4) {}
};

LOBATTO_API std::string version();

// --- Scenes ----------------------------------------------------------------------------------------------------------

struct Variable {
    std::string name;  ///< element 3 of an array x is x_3
    std::string unit;  ///< "" when the scene names none
    double value;      ///< a coordinate's initial position; a parameter's value
};

/// What stands in for the scene's own; what is empty is as the scene has it. The words are those of the command line.
/// A call refuses those that have no meaning for it: what is derived, emitted, checked or proved takes a method and
/// numbers alone.
struct Settings {
    std::optional<int> points, stages, splitting;          ///< of Lobatto, Gauss, a splitting method; one at most
    std::optional<double> tolerance;                       ///< of the iteration of a step, relative
    std::string arithmetic;                                ///< "plain", "clean"
    std::string numbers;                                   ///< "float", "double", "long double", "double-double", ...
    std::string clock;                                     ///< "none": equal steps; "auto" (docs/clocks.md)
    std::vector<std::pair<std::string, std::string>> set;  ///< parameters: {"omega", "2*pi"}
    std::string step, until;                               ///< formulas in the parameters: "2*pi/omega/50"
    std::optional<double> every;                           ///< keep every such state; with a clock, each such time
};

/// A mechanical system, read and checked. Copies share it.
///
///     for (const lob::Variable& coordinate : scene.coordinates())
///         std::printf("%s = %g %s\n", coordinate.name.c_str(), coordinate.value, coordinate.unit.c_str());
///     std::ofstream("pendulum.hpp") << scene.emit().second;
///
class LOBATTO_API Scene {
public:
    explicit Scene(const std::string& path);
    /// The text of a scene file. `path` stands in errors, and its stem is the name of the scene.
    static Scene from_text(const std::string& text, const std::string& path = "scene.toml");

    const std::string& path() const;
    const std::string& name() const;
    const std::string& title() const;
    const std::string& text() const;        ///< of the file
    const std::string& lagrangian() const;  ///< as written
    const std::vector<Variable>& coordinates() const;
    const std::vector<Variable>& parameters() const;  ///< inputs too
    const std::vector<Variable>& inputs() const;      ///< those that may change between steps at hardly any cost
    const std::vector<std::string>& events() const;   ///< as written: events, then stops, then impacts
    std::string method() const;                       ///< "Lobatto, 4 points"
    double step() const;
    double until() const;
    bool starts_with_momenta() const;  ///< else with velocities

    /// The derivation of its integrator: plain text, a LaTeX document, or JSON (docs/derivation.md).
    std::string derivation(const Settings& settings = {}) const;
    std::string derivation_latex(const Settings& settings = {}) const;
    std::string derivation_json(const Settings& settings = {}) const;
    /// The integrator as C++: a header that needs nothing else, or as a textbook prints it. {file name, text}
    std::pair<std::string, std::string> emit(const Settings& settings = {}) const;
    std::pair<std::string, std::string> emit_plain(const Settings& settings = {}) const;

    /// What was found in it, and what its kernel leaves out, as JSON.
    std::string check_json(const Settings& settings = {}) const;
    /// Which steps keep linear motion bounded, and what this step does, as JSON (docs/stability.md).
    std::string stability_json(const Settings& settings = {}) const;

    struct Parts;
    explicit Scene(std::shared_ptr<const Parts> parts);
    const Parts& parts() const { return *parts_; }

private:
    std::shared_ptr<const Parts> parts_;
};

// --- One trajectory, step by step ------------------------------------------------------------------------------------

/// The kernel of a scene, compiled and loaded. Copies share it.
class LOBATTO_API Kernel {
public:
    const std::string& digest() const;  ///< of its formulas
    std::string method() const;
    int order() const;
    double step() const;  ///< h; with a clock in its time
    const std::vector<Variable>& coordinates() const;
    const std::vector<Variable>& parameters() const;  ///< with the values of the settings; inputs too
    const std::vector<Variable>& inputs() const;
    const std::vector<std::string>& events() const;
    /// What is no coordinate and follows from them: eliminated coordinates and their velocities; of bodies the
    /// orientation and angular velocity, and the place of those on joints (docs/scene_format.md).
    const std::vector<std::string>& column_names() const;

    struct Parts;
    explicit Kernel(std::shared_ptr<const Parts> parts);
    const Parts& parts() const { return *parts_; }

private:
    std::shared_ptr<const Parts> parts_;
};

/// In double. A kernel that was compiled before, by any program of this user, comes from a cache.
LOBATTO_API Kernel compile(const Scene& scene, const Settings& settings = {});

struct EventHit {
    int kind;  ///< number in events()
    double t;
    std::vector<double> q, p;
};

/// A trajectory that the caller takes forward: for control loops, games, couplings.
///
///     const double q = 1, p = 0;
///     stepper.start(0, &q, &p);
///     while (stepper.t() < 10) {
///         stepper.set("omega", stepper.q()[0] > 0 ? 6 : 6.5);
///         stepper.step();
///     }
///     const auto [position, velocity] = stepper.at(stepper.t() - stepper.step_size() / 2);
///
class LOBATTO_API Stepper {
public:
    explicit Stepper(const Kernel& kernel);  ///< at the start of the scene
    Stepper(const Stepper& other);           ///< a second trajectory from here
    Stepper& operator=(const Stepper& other);
    Stepper(Stepper&&) noexcept;
    Stepper& operator=(Stepper&&) noexcept;
    ~Stepper();

    /// n: those of the scene. A clock adds the time as the last one where the energy changes (docs/clocks.md); a start
    /// sets it, and its momentum, whatever is given for them.
    std::size_t coordinates() const;
    std::size_t inputs() const;
    double step_size() const;
    /// Another place to go on from. n positions; n momenta, or n velocities. With `inputs` all of these change too,
    /// at once: where walls move with them, neither the state nor they would be taken alone.
    void start(double t, const double* q, const double* p, const double* inputs = nullptr);
    void start_from_velocity(double t, const double* q, const double* v, const double* inputs = nullptr);

    /// Takes steps; with a clock, they are arrivals at the scene's times (`[output] every`). A step that fails leaves
    /// the state where it was and throws ComputationError. Returns false where a stop of the scene ended the motion:
    /// the state is that of the stop.
    bool step() { return advance(1); }
    bool advance(std::int64_t steps);
    /// Equal steps while they fit, then a shorter one that ends at t exactly. That one is no step of the sequence of
    /// equal ones: where energy counts over many steps, take step() and look in between with at(). With a clock the
    /// sequence goes on as if nobody had asked.
    bool advance_to(double t);

    double t() const;
    double next_time() const;  ///< where step() leads to, unless a stop comes before it
    const double* q() const;   ///< n; the same place for as long as the stepper lives
    const double* p() const;
    std::vector<double> velocity() const;
    /// H(t, q, p); not a number where the scene leaves it out (energy = false) and the motion does not conserve it.
    double energy() const;
    std::vector<double> multipliers() const;  ///< of the constraints, here
    std::vector<double> columns() const;      ///< here, in the order of Kernel::column_names()
    /// Position and velocity inside the last step, on its own polynomial: t - step_size() <= t <= t(), or from where
    /// advance_to() began its last step. Positions are right at both ends, and between them to an order of points or
    /// stages + 1 at most; velocities to one order less, also at the ends, where velocity() has them right. InputError
    /// elsewhere, with a clock, after start() and set(), and in a step that an impact, a switch or a stop has cut.
    std::pair<std::vector<double>, std::vector<double>> at(double t) const;
    /// One step from here and its derivative: d(q1, p1)/d(q, p), 2n x 2n. The trajectory stays where it is. InputError
    /// with a clock, whose steps last as long as the motion makes them; ComputationError where a wall or a switch cuts
    /// the step. It is the derivative of the whole step, also where a stop would end it.
    std::vector<double> tangent() const;
    /// d(q1, p1)/d(parameter or input) of the same step, 2n, with about ten digits: by differences.
    /// Where walls or switches cut the step, the derivative is that of the step with them. ComputationError where there
    /// is none.
    std::vector<double> sensitivity(const std::string& name) const;

    /// A parameter or an input, from the next step on. Another parameter prepares the kernel anew; what controls a
    /// motion should be an input of the scene, which costs at most about a step.
    double parameter(const std::string& name) const;
    void set(const std::string& name, double value);
    /// All inputs, in the order of inputs().
    void set_inputs(const double* values);

    const std::vector<std::string>& column_names() const;  ///< of columns(), as Kernel::column_names()
    std::vector<EventHit> take_events();                   ///< until t(), since the last call
    const std::vector<std::string>& events() const;        ///< what EventHit::kind counts, as Scene::events()

private:
    struct Parts;
    std::unique_ptr<Parts> parts_;
};

// --- Runs ------------------------------------------------------------------------------------------------------------

struct Trajectory {
    std::vector<Variable> coordinates;
    std::vector<std::string> event_names;
    /// count rows. energy is empty where the scene keeps none, unless the motion conserves it.
    std::size_t count = 0;
    std::vector<double> t, q, p, energy;
    /// count x column_names: multipliers and formulas of the scene, eliminated coordinates and their velocities, the
    /// orientation and angular velocity of bodies.
    std::vector<std::string> column_names;
    std::vector<double> columns;
    std::vector<EventHit> events;
    std::int64_t steps = 0;
    double seconds = 0;          ///< of processor time in the kernel
    std::string stopped_by;      ///< the stop that ended it; "" when it went to its end
    bool reaches_end = true;     ///< else the end is no multiple of the step: it ended at the last one before
    bool interrupted = false;    ///< by `progress`
    std::string method, digest;  ///< of the kernel
    double step = 0;
    std::int64_t dense = 0;  ///< rows inside each step, on its polynomial ([output] dense)
    /// Relative to the amplitude of the motion: at the end, and the largest. Empty: not measured.
    std::optional<double> error, largest_error;
    std::optional<double> doubling;  ///< of errors that grow exponentially: the time in which they double
    std::vector<std::string> warnings;
};

/// A run that failed on its way, with what was computed.
class LOBATTO_API RunFailure : public ComputationError {
public:
    RunFailure(const std::string& text, Trajectory trajectory)
        : ComputationError(text), trajectory_(std::make_shared<const Trajectory>(std::move(trajectory))) {}
    const Trajectory& trajectory() const noexcept { return *trajectory_; }

private:
    std::shared_ptr<const Trajectory> trajectory_;
};

struct RunOptions : Settings {
    bool measure = true;          ///< the error, by a companion on another processor
    std::string companion;        ///< its numbers, such as "double-double"; empty: those of the run (docs/errors.md)
    bool beyond_horizon = false;  ///< go on when the error is as large as the motion
    /// About ten times a second, from 0 to 1; false ends the run, and what was computed is returned.
    std::function<bool(double)> progress;
};
/// To the end of the scene, judged as the command line judges it.
///
///     lob::RunOptions options;
///     options.points = 6;
///     options.until = "3";
///     const lob::Trajectory run = lob::run(scene, options);
///     std::printf("q = %g after %g, error %.1e\n", run.q.back(), run.t.back(), run.error.value());
///
LOBATTO_API Trajectory run(const Scene& scene, const RunOptions& options = {});

/// Positions and velocities at ascending times of a run: those of its rows at the ends of steps, and between two of
/// these what steps from the earlier one lead to, of which the last is shortened to end there. `stepper` is of the same
/// scene and settings; only t, q, p and dense of the run are read. Both results are times x n.
///
///     const lob::Trajectory swing = lob::run(scene);
///     const auto [positions, velocities] = lob::states_at(stepper, swing, {0.25, 0.5});
///     std::printf("q = %g and %g\n", positions[0], positions[1]);
///
LOBATTO_API std::pair<std::vector<double>, std::vector<double>> states_at(Stepper stepper, const Trajectory& run,
                                                                          const std::vector<double>& times);

// --- Sweeps ----------------------------------------------------------------------------------------------------------

/// Many starts: columns of `count` numbers by name: positions q, velocities q' or momenta p_q, parameters. What has no
/// column is as the scene has it; so are formulas of the scene that hold a parameter, with its value there.
struct Starts {
    std::size_t count = 0;
    std::map<std::string, std::vector<double>> columns;
};

/// What takes the steps of a sweep: the processor, an NVIDIA GPU (docs/gpu.md; Error where there is none), or the
/// faster of both in a trial.
enum class Device { processor, cuda, automatic };

struct SweepOptions : Settings {
    std::vector<std::string> keep;      ///< "first(b = pi)", "max(H)": instead of the last states
    std::optional<std::int64_t> steps;  ///< instead of an end time
    Device device = Device::processor;
    int threads = 0;              ///< 0: as many as the machine runs
    bool measure = true;          ///< errors by companions: 3/2 of the sweep's time, more at contacts and pulses
    bool beyond_horizon = false;  ///< trajectories of which nothing is left are no failures
    std::function<bool(double)> progress;
};

/// What becomes of trajectories. `states` is empty unless the settings say `every`.
struct Sweep {
    /// Of trajectory i the start, each `every`-th state and the last one are rows first[i], ..., first[i + 1] - 1.
    struct States {
        std::vector<std::size_t> first;    ///< count + 1 numbers
        std::vector<double> t, q, p;       ///< rows, rows x n, rows x n
        std::vector<double> energy_error;  ///< as below
    };
    std::vector<Variable> coordinates;
    std::vector<std::string> kept_names;
    std::size_t count = 0;              ///< trajectories; fewer than asked for where `progress` ended it
    std::vector<int> status;            ///< 0: reached the end, or a stop
    std::vector<std::int64_t> steps;    ///< taken
    std::vector<int> stop;              ///< number of the stop from 1 on, then of all walls (`rest`); 0: none
    std::vector<double> t, q, p;        ///< the last state; count, count x n, count x n
    std::vector<double> energy_error;   ///< H - H(0); not numbers where the scene keeps no energy
    std::vector<double> error;          ///< measured, relative to the amplitude; empty when not asked for
    std::vector<double> kept;           ///< count x kept_names
    std::vector<std::string> statuses;  ///< in words, by number
    States states;
    bool interrupted = false;
    std::vector<std::string> warnings;
};
/// All of them at once, on all processors.
///
///     lob::Starts starts;
///     starts.count = 3;
///     starts.columns["q"] = {0.5, 1, 1.5};
///     starts.columns["omega"] = {6, 6, 7};
///     lob::SweepOptions options;
///     options.until = "3";
///     options.every = 20;
///     const lob::Sweep sweep = lob::sweep(scene, starts, options);
///     for (std::size_t row = sweep.states.first[1]; row < sweep.states.first[2]; ++row)
///         std::printf("%g: q = %g\n", sweep.states.t[row], sweep.states.q[row]);
///
LOBATTO_API Sweep sweep(const Scene& scene, const Starts& starts, const SweepOptions& options = {});

/// Many trajectories of one scene that the caller takes forward together, side by side in vector registers, on the
/// thread that calls. What is done with all of them at once, to an end that is known, sweep() does on all processors.
///
///     lob::Ensemble ensemble(scene, {3, {{"q", {0.5, 1, 1.5}}}});
///     const double stiffer[] = {7, 7, 8};
///     while (ensemble.t() < 1) {
///         ensemble.advance(5);
///         ensemble.set("omega", stiffer);
///     }
///     std::printf("q = %g, %g, %g\n", ensemble.q()[0], ensemble.q()[1], ensemble.q()[2]);
///
class LOBATTO_API Ensemble {
public:
    Ensemble(const Scene& scene, const Starts& starts, const Settings& settings = {});
    Ensemble(Ensemble&&) noexcept;
    Ensemble& operator=(Ensemble&&) noexcept;
    ~Ensemble();

    std::size_t count() const;
    std::size_t coordinates() const;
    double step_size() const;
    double t() const;  ///< of all that go on

    /// A trajectory whose step fails stays where it was, and the others go on.
    void advance(std::int64_t steps);
    const std::vector<int>& status() const;  ///< 0: it goes on; else as in Sweep
    const double* q() const;                 ///< count x n; the same place for as long as the ensemble lives
    const double* p() const;
    /// A parameter or an input, a value for each trajectory, from the next step on. InputError, and nothing changes,
    /// where one of them is a value that the scene refuses.
    void set(const std::string& name, const double* values);

private:
    struct Parts;
    std::unique_ptr<Parts> parts_;
};

// --- Choosing --------------------------------------------------------------------------------------------------------

struct Choice {
    Settings settings;  ///< method and step: for run(), compile()
    std::string method;
    double step = 0, until = 0;
    double predicted_error = 0;  ///< relative to the amplitude
    double seconds = 0;          ///< what the motion costs with it
    bool complete = false;       ///< no member that was not tried can be expected to win
};
/// The cheapest member of the family, its clock and its step, that keep an error to the end. `settings` name no method,
/// no clock and no step. Where a clock is chosen that the scene does not have, `every` is left out, because it would be
/// a time then. `budget`: seconds to search, at least 1. `progress`: told what is being done; false ends the search,
/// which then throws ComputationError.
///
///     lob::Settings settings;
///     settings.until = "2";
///     const lob::Choice choice = lob::tune(scene, 1e-4, settings, 10);
///     lob::Stepper chosen(lob::compile(scene, choice.settings));
///
LOBATTO_API Choice tune(const Scene& scene, double error, const Settings& settings = {}, double budget = 20,
                        const std::function<bool(const std::string&)>& progress = {});

// --- Proving ---------------------------------------------------------------------------------------------------------

struct Claim {
    std::string claim, measured, bound;
    bool holds = false;
    std::string meaning;  ///< of a failure
};
/// Everything that can be checked of a scene, from the quadrature to the running kernel. `progress`: told what is being
/// done; false ends it, which then throws ComputationError.
///
///     for (const lob::Claim& claim : lob::verify(scene))
///         if (!claim.holds) std::printf("%s: %s\n", claim.claim.c_str(), claim.meaning.c_str());
///
LOBATTO_API std::vector<Claim> verify(const Scene& scene, const Settings& settings = {},
                                      const std::function<bool(const std::string&)>& progress = {});

}  // namespace lobatto::api
