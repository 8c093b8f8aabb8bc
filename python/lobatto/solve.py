# SPDX-License-Identifier: GPL-2.0-or-later
"""What is done with a scene."""

import copy
import json
import warnings

import numpy

from . import _lobatto
from ._lobatto import InputError, RunFailure, Scene, Stepper
from .results import Choice, Claims, Derivation, Sweep, Trajectory, _states_at


def _scene(scene):
    return scene if isinstance(scene, Scene) else Scene(str(scene))


def run(scene, *, measure=True, companion="", beyond_horizon=False, progress=None, **settings):
    """Runs a scene (or the path of one) to its end. Returns a Trajectory.

    ``measure``: its error, by a companion on another processor. ``companion``: the numbers of that one, such as
    "double-double", which measure the error to two digits where rounding decides it, too. ``beyond_horizon``: go on
    when the error is as large as the motion, for the statistics of chaos. ``progress(share)`` is called about ten times
    a second; False ends the run. Raises RunFailure where it fails on its way, with what was computed as its ``trajectory``.
    """
    scene = _scene(scene)
    settings = copy.deepcopy(settings)  # states between those that are kept are computed later, with these
    try:
        values = _lobatto.run(scene, measure, companion, beyond_horizon, progress, **settings)
    except RunFailure as failure:
        failure.trajectory = Trajectory(scene, settings, failure.trajectory)
        raise
    for warning in values["warnings"]:
        warnings.warn(warning, stacklevel=2)
    if not values["reaches_end"]:
        warnings.warn(f"the end time is not a multiple of the step: the run ends at t = {values['t'][-1]:g}", stacklevel=2)
    return Trajectory(scene, settings, values)


def _columns(starts):
    """Arrays of one length."""
    if not hasattr(starts, "items"):
        raise InputError("starts are columns with their names, such as {\"q\": [0.1, 0.2]}, not " + repr(starts))
    for name, values in starts.items():
        if numpy.ma.is_masked(values):
            raise InputError(f"starts: {name} has masked values; leave these trajectories out (.compressed())")
    arrays = [numpy.asarray(values, dtype=float) for values in starts.values()]
    try:
        shape = numpy.broadcast_shapes(*(array.shape for array in arrays))
    except ValueError:
        shapes = ", ".join(f"{name} has {array.shape}" for name, array in zip(starts, arrays))
        raise InputError(f"starts: these shapes do not go together: {shapes}") from None
    return {name: numpy.broadcast_to(array, shape).ravel() for name, array in zip(starts, arrays)}


def sweep(scene, starts, *, keep=(), threads=0, measure=True, beyond_horizon=False, progress=None, **settings):
    """Runs a scene from many starts at once. Returns a Sweep.

    ``starts``: numbers or arrays by name: positions "q", velocities "q'" or momenta "p_q", parameters. Arrays are
    broadcast as NumPy does it, then flattened in C order: a sparse grid of 3 x 1 and 1 x 4 makes 12 trajectories.
    ``keep``: formulas such as "first(b = pi)", "max(H)", in place of the last states. ``every``: keep each such state of
    all trajectories too; ``states(i)`` of the Sweep returns them. ``measure``: errors by companions, which take 3/2 of
    the sweep's time. ``beyond_horizon``: trajectories of which nothing is left are no failures.
    """
    scene = _scene(scene)
    columns = _columns(starts)
    kept = [keep] if isinstance(keep, str) else list(keep)
    values = _lobatto.sweep(scene, columns, kept, threads, measure, beyond_horizon, progress, **settings)
    for warning in values["warnings"]:
        warnings.warn(warning, stacklevel=2)
    result = Sweep(scene, values)
    if not result.ok.all():
        reasons = ", ".join(f"{(result.status == one).sum()} {result.statuses[one]}"
                            for one in numpy.unique(result.status) if one != 0)
        warnings.warn(f"{(~result.ok).sum()} of {len(result)} trajectories failed: {reasons}; .ok is the mask of the others",
                      stacklevel=2)
    return result


def tune(scene, error, *, budget=20, progress=None, **settings):
    """The cheapest method and step that keep an error to the end, relative to the amplitude. Returns a Choice.

    ``budget``: seconds to search.
    """
    scene = _scene(scene)
    return Choice(scene, _lobatto.tune(scene, float(error), float(budget), progress, **settings))


def derive(scene, **settings):
    """How the integrator of a scene follows from its Lagrangian. A notebook shows its formulas."""
    scene = _scene(scene)
    return Derivation(scene._derivation_text(**settings), scene._derivation_latex(**settings),
                      scene._derivation_json(**settings))


def check(scene, **settings):
    """What was found in a scene, and what its kernel leaves out, as a dictionary."""
    return json.loads(_scene(scene)._check_json(**settings))


def stability(scene, **settings):
    """Which steps keep linear motion bounded, and what the scene's step does, as a dictionary (docs/stability.md)."""
    return json.loads(_scene(scene)._stability_json(**settings))


def verify(scene, **settings):
    """Everything that can be checked of a scene: a list of (claim, measured, bound, holds); ``.ok`` where all hold."""
    return Claims(_lobatto.verify(_scene(scene), **settings))


class Solution(dict):
    """As scipy's: fields are attributes."""

    def __getattr__(self, name):
        try:
            return self[name]
        except KeyError:
            raise AttributeError(name) from None

    def __repr__(self):
        return "\n".join(f"{name:>8}: {value!r}" for name, value in self.items())


def solve_ivp(scene, t_span, y0=None, *, t_eval=None, dense_output=False, **settings):
    """For users of scipy.integrate.solve_ivp: y holds positions, then velocities, 2n x times.

    ``t_span`` begins where the scene begins, at 0, and ends later. ``y0``: positions and velocities; None: those of the
    scene. With a clock where the energy changes, the time is one coordinate more, the last; a start sets it. Steps are equal (setting ``step``); there is no tolerance: tune chooses a step for an error. Returns t, y, sol
    (with ``dense_output``), status, message, success, nfev (0: not counted). ``success`` says that all steps were taken.
    Whether the motion is right is what ``run`` measures and tells.
    """
    scene = _scene(scene)
    begin, end = (float(time) for time in t_span)
    if begin != 0 or end < 0:
        raise InputError(f"t_span: a scene begins at t = 0 and goes on to later times, not from {begin:g} to {end:g}")
    if "until" in settings:
        raise InputError("until: the end stands in t_span")
    if t_eval is not None:
        t_eval = numpy.asarray(t_eval, dtype=float)
        if t_eval.ndim != 1 or not ((begin <= t_eval) & (t_eval <= end)).all() or (numpy.diff(t_eval) < 0).any():
            raise InputError(f"t_eval needs ascending times from {begin:g} to {end:g}")
    stepper = Stepper(scene, until=end, **settings)
    n = len(stepper.q)
    if y0 is not None:
        y0 = numpy.asarray(y0, dtype=float)
        if y0.shape != (2 * n,):
            more = y0.ndim == 1 and len(y0) == 2 * n - 2
            raise InputError(f"y0 needs {2 * n} numbers: {n} positions, then {n} velocities"
                             + ("; the last of each is that of the time, and any number will do" if more else ""))
        stepper.start(0.0, y0[:n], velocity=y0[n:])
    times, q, p, velocities, status, message = [0.0], [stepper.q.copy()], [stepper.p.copy()], [stepper.velocity], 0, ""
    try:
        while stepper.t < end:
            going = stepper.step() if stepper.next_time < end * (1 - 1e-12) else stepper.advance_to(end)
            times.append(stepper.t)
            q.append(stepper.q.copy())
            p.append(stepper.p.copy())
            velocities.append(stepper.velocity)
            if not going:
                status, message = 1, "a stop of the scene ended the motion"
                break
    except _lobatto.ComputationError as error:
        status, message = -1, str(error)
    t = numpy.array(times)
    y = numpy.vstack([numpy.array(q).T, numpy.array(velocities).T])

    def sol(at):
        at = numpy.asarray(at, dtype=float)
        states = _states_at(stepper.copy(), t, numpy.array(q), numpy.array(p), 0, at)
        return numpy.concatenate([numpy.moveaxis(rows, -1, 0) for rows in states])

    if t_eval is not None:
        t_eval = t_eval[t_eval <= t[-1]]  # a stop or a failure may have ended the motion before
        y, t_kept = sol(t_eval), t_eval
    else:
        t_kept = t
    return Solution(t=t_kept, y=y, sol=sol if dense_output else None, status=status,
                    message=message or "The solver successfully reached the end of the integration interval.",
                    success=status >= 0, nfev=0)
