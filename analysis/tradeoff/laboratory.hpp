// SPDX-License-Identifier: GPL-2.0-or-later
// All that measuring a scene needs, brought together: its kernels, its reference, a notebook, a clock.
#pragma once

#include <chrono>
#include <functional>
#include <limits>
#include <optional>
#include <string>

#include "analysis/tradeoff/measuring.hpp"
#include "analysis/tradeoff/notebook.hpp"
#include "analysis/tradeoff/workshop.hpp"

namespace lobatto {

constexpr double infinity = std::numeric_limits<double>::infinity();
constexpr double most_steps = 1e9;  // of a candidate to the end

struct LaboratoryRequest {
    double seconds = 20;        // of wall time
    double wanted = 1e-18;      // the disagreement of the two references that is good enough
    std::string notebook;       // its file; empty: none
    std::vector<Member> first;  // kernels that will be needed whatever is found
    const volatile int* interrupted = nullptr;
    std::function<void(const std::string&)> say = [](const std::string&) {};  // what is being done
};

class Laboratory {
public:
    // `derivation` of the scene as written, which one kernel serves; `scene` with what the command line replaces.
    // Computes the reference. Throws as its parts do; InputError when there is no time to integrate over.
    Laboratory(Derivation derivation, const Scene& scene, LaboratoryRequest request);

    const Scene& scene() const { return scene_; }
    const Reference& reference() const { return reference_; }
    Workshop& workshop() { return workshop_; }
    const Derivation& derivation() const { return workshop_.derivation(); }
    const Measurer& measurer() const { return *measurer_; }
    const Notebook& notebook() const { return notebook_; }
    bool conserves() const { return conserves_; }
    const LaboratoryRequest& request() const { return request_; }

    // Whether the two references differ by more than the errors that are of interest.
    bool is_chaotic() const { return reference_.disagreement.back() > trusted; }
    static constexpr double trusted = 1e-9;
    // What is to be small: the error; of a chaotic motion the energy error, or without energy 1/t, t the time until
    // which the true motion was followed.
    double figure(const Measurement& measurement) const;

    double until() const { return reference_.until; }
    // The numbers of steps that are tried, and the least of them.
    StepLadder ladder(double ratio) const { return {reference_.samples, ratio}; }
    double fewest_steps() const;
    double elapsed() const;
    double left() const { return request_.seconds - elapsed(); }
    // Throws Interrupted when the flag is raised.
    void check_interruption() const;

    // From the notebook, or measured now, everything or error and time only.
    Measurement measure(const Candidate& candidate, bool all = true);
    // Times it again, `repetitions` times, and keeps the least.
    Measurement time_again(const Measurement& measurement, int repetitions);

private:
    std::chrono::steady_clock::time_point began_;
    Scene scene_;
    LaboratoryRequest request_;
    ExactStart start_;
    Workshop workshop_;
    bool conserves_;
    Reference reference_;
    std::optional<Measurer> measurer_;
    Notebook notebook_;
    bool knows_symmetries_ = false;
};

// The end time of a scene, > 0; InputError.
double end_of(const Scene& scene);

}  // namespace lobatto
