# SPDX-License-Identifier: GPL-2.0-or-later
"""Lobatto, a compiler for mechanics: from a Lagrangian to its variational integrator, compiled and run.

    import lobatto
    scene = lobatto.Lagrangian("m*q'^2/2 - m*omega^2*(1 - cos(q))", q=(1.5, 0), m=1, omega="2*pi", step=0.05, until=10)
    run = lobatto.run(scene)
    run.q[:, 0], run.error, run(3.21).q

Units are those of the scene. The first call with a new Lagrangian compiles its kernel (g++, about a second); later
ones find it in a cache. Settings have the names of the command line: points, stages, splitting, tolerance, arithmetic,
numbers, clock, step, until, every, set={name: value} of parameters and of the start (q, q' or p_q).
"""

from ._lobatto import (ComputationError, Error, InputError, MachineError, RunFailure, Scene, Stepper, Variable,
                       __version__)
from .lagrangian import Lagrangian
from .results import Choice, Claims, Derivation, State, Sweep, Trajectory
from .solve import check, derive, run, solve_ivp, stability, sweep, tune, verify

__all__ = [
    "Choice", "Claims", "ComputationError", "Derivation", "Error", "InputError", "Lagrangian", "MachineError",
    "RunFailure", "Scene", "State", "Stepper", "Sweep", "Trajectory", "Variable", "check", "derive", "run", "solve_ivp",
    "stability", "sweep", "tune", "verify",
]
