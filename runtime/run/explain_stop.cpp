// SPDX-License-Identifier: MIT
// Why a run stopped, where, and what to try instead.
#include <fmt/format.h>

#include "runtime/run/trajectory.hpp"

namespace lobatto {

namespace {

std::string place_of_stop(const TrajectoryResult& result, const TrajectoryRequest& request) {
    return !result.started ? fmt::format("the run cannot begin at t = {:.6g}", result.time)
           : request.arrivals.interval != 0
               ? fmt::format("the run stopped in step {}, after t = {:.6g}", result.chain_steps + 1, result.time)
           : result.steps_done == 0
               ? fmt::format("the run stopped in its first step, at t = {:.6g}", result.time)
               : fmt::format("the run stopped in step {}, after t = {:.6g}", result.steps_done + 1, result.time);
}

struct Reason {
    std::string why, advice;
};

// At the start, or on the way.
Reason off_constraints(bool on_the_way) {
    if (on_the_way)
        return {
            "after an impact, a switch or a new value the motion does not keep the constraints, or is behind a wall: a "
            "reset leads elsewhere, a wall was moved past the motion, the momenta do not fit other masses, or the "
            "constraints have a corner there",
            "a reset that keeps them, a restitution, which does, a value under [inputs] instead of [parameters], "
            "inputs that change less at a time, or constraints without corners"};
    return {"the start does not keep the constraints, or is behind a wall",
            "positions and velocities that keep them, or assemble = true under [run] of a scene with constraints"};
}

Reason accumulating(const std::string& smaller) {
    return {
        "impacts accumulate within this step, or passages of a switch: more than 100 of them, or nearer to one "
        "another than can be told apart. The motion comes to rest on a wall, slides along it or is held fast "
        "by friction, which is not computed; the wall's formula jumps; a reset leaves the motion on its way "
        "through the wall; or the step is too long for a switch",
        "rest = 0.01 in the line of the wall, which ends the run at an impact as slow as this, an earlier "
        "end, stop = \"x' = 0\" where friction ends a motion, tanh(v/w) in place of sign(v), or " +
            smaller + " where many impacts belong into a step"};
}

// `smaller`: the advice of a smaller step; `more`: what else to try.
Reason reason_of(const TrajectoryResult& result, const TrajectoryRequest& request, const std::string& smaller,
                 const std::string& more) {
    std::string why, advice;
    switch (result.status) {
        case LOBATTO_OK:
        case LOBATTO_STOPPED:
        case LOBATTO_STATUSES:
            break;
        case LOBATTO_NOT_CONVERGED:
            why = fmt::format(
                "the iteration for the positions inside the step did not converge{}. The step is too long for the "
                "forces met there, or the motion runs into a singularity of the potential, to a place where a mass "
                "vanishes, or away to infinity",
                result.increment_failed > 0 ? fmt::format(": its last increment was {:.2g} of the displacement within "
                                                          "the step",
                                                          result.increment_failed)
                                            : std::string());
            advice = smaller + more + ", an earlier end, or start elsewhere";
            break;
        case LOBATTO_NOT_FINITE:
            if (!result.started) {
                why =
                    "a number computed from the parameters, the step and this start alone is infinite or not a number: "
                    "they are too large or too small together, or the start is at a singularity";
                advice = "other units, so that numbers are nearer to 1, or start elsewhere";
                break;
            }
            why =
                "a position or momentum became infinite or not a number. The motion runs into a singularity of the "
                "potential, to a place where a mass vanishes, exp overflows or a root gets a negative number, or away "
                "to infinity, or the step is too long for the method to be stable";
            advice = smaller + more + ", an earlier end, or start elsewhere";
            break;
        case LOBATTO_SINGULAR_JACOBIAN:
            why =
                "the equations for the positions inside the step have no unique solution: their Jacobian is singular. "
                "This h meets a resonance of the forces there, a body turns by a large part of a revolution in it, or "
                "constraints depend on one another, as at a dead point";
            advice = smaller + ", or a slightly different one";
            break;
        case LOBATTO_SINGULAR_MASS:
            why =
                "the mass matrix has no inverse for these parameters or at this state, so that momenta do not "
                "determine velocities";
            advice =
                "other values of the parameters that stand before the squared velocities, or start elsewhere; none of "
                "the masses may vanish";
            break;
        case LOBATTO_UNSUPPORTED:
            why =
                "the kernel was compiled without what is asked of it: states between steps, events, energies or "
                "tangent maps";
            advice = "to compile it from a scene whose [output] asks for it";
            break;
        case LOBATTO_OFF_CONSTRAINTS:
            return off_constraints(result.started);
        case LOBATTO_IMPACTS_ACCUMULATE:
            return accumulating(smaller);
        case LOBATTO_TIME_STANDS_STILL:
            if (request.arrivals.interval != 0) {
                why =
                    "the clock comes to 0 along the step, or so near to it that time stands still or the energy is "
                    "lost, as where a motion falls into a singularity; or the step leads far away";
                advice = "a clock that is positive wherever the motion goes, equal steps (--clock none), or " + smaller;
                break;
            }
            why = fmt::format("t + h equals t in the numbers of the run: h = {:.6g} is below the rounding of t",
                              request.step);
            advice = "a larger step, or a start time nearer to zero";
            break;
    }
    return {why, advice};
}

}  // namespace

std::string explain_stop(const TrajectoryResult& result, const TrajectoryRequest& request, double passing,
                         const std::string& more) {
    if (result.status == LOBATTO_OK || result.status == LOBATTO_STOPPED) return {};
    const std::string smaller =
        passing != 0 ? fmt::format("a smaller step, such as h = {:.6g}, with which the motion goes on there", passing)
                     : fmt::format("a smaller step, such as h = {:.6g}", request.step / 2);
    const auto [why, advice] = reason_of(result, request, smaller, more);
    return fmt::format("{}, from q = {}, p = {}: {}. Try {}.", place_of_stop(result, request), list_text(result.q),
                       list_text(result.p), why, advice);
}

}  // namespace lobatto
