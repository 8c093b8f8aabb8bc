# SPDX-License-Identifier: GPL-2.0-or-later
"""The Python module: one trajectory, many, choosing, errors, what it costs."""

import copy
import fractions
import multiprocessing
import os
import pathlib
import pickle
import signal
import subprocess
import sys
import threading
import time
import types

import numpy
import pytest

import lobatto

ROOT = pathlib.Path(__file__).resolve().parents[2]
SCENES = ROOT / "scenes"


@pytest.fixture
def pendulum():
    return lobatto.Scene(str(SCENES / "pendulum.toml"))


def test_a_run_is_that_of_the_command_line(pendulum, tmp_path):
    run = lobatto.run(pendulum, until=5)
    program = os.environ["LOBATTO_PROGRAM"]
    subprocess.run([program, "run", pendulum.path, "--until", "5", "-o", tmp_path / "run.csv", "--quiet"], check=True)
    rows = numpy.loadtxt(tmp_path / "run.csv", delimiter=",", comments=["#", "t"]).T
    assert numpy.array_equal(rows[1], run["q"])
    assert numpy.array_equal(rows[3], run.H)
    assert run.error < 1e-6
    assert run.units == ["rad"] and run.names == ["q"]


def test_forces_act_along_definitions():
    scene = lobatto.Lagrangian("(x'^2 + y'^2)/2", x=(1, 0), y=dict(position=2, velocity=0, force="-0*y"),
                               definitions={"r": "sqrt(x^2 + y^2)"}, forces={"r": "-r"}, step=0.1, until=1)
    assert numpy.allclose(lobatto.run(scene).q[-1], [numpy.cos(1), 2 * numpy.cos(1)], rtol=1e-8)


def test_a_lagrangian_written_in_python_is_the_scene_of_the_same_text(pendulum):
    scene = lobatto.Lagrangian("m*q'^2/2 - m*omega^2*(1 - cos(q))", q=dict(position="pi/2", velocity=0, unit="rad"),
                               m=1, omega="2*pi", step=0.05, until=5, method=dict(points=4))
    assert numpy.array_equal(lobatto.run(scene).q, lobatto.run(pendulum, until=5).q)
    assert [variable.name for variable in scene.parameters] == ["m", "omega"]
    with pytest.raises(lobatto.InputError, match="'q' stands in the Lagrangian as q'"):
        lobatto.Lagrangian("q'^2/2")
    with pytest.raises(lobatto.InputError, match="unknown name 'k'"):
        lobatto.Lagrangian("q'^2/2 - k*q", q=1)


def test_a_lagrangian_may_hold_arrays_and_definitions():
    chain = lobatto.Lagrangian("sum(i = 1 .. n, x[i]'^2/2) - sum(i = 1 .. n - 1, V[i])",
                               definitions={"V[i]": "k*(x[i+1] - x[i])^2/2"}, k=2,
                               x=dict(count="n", position="i", velocity="i^2"), n=dict(value=3, constant=True),
                               step=0.01, until=1)
    run = lobatto.run(chain)
    assert numpy.array_equal(run["x[3]"], run.q[:, 2]) and numpy.array_equal(run["x"], run.q)
    assert numpy.array_equal(run["p_x[2]"], run["p_x_2"]) and run["p_x"].shape == run.p.shape
    assert numpy.allclose(run["p_x"].sum(axis=1), 14, rtol=1e-14)
    polar = lobatto.Lagrangian("T + 1/r", definitions=dict(T="(r'^2 + r^2*phi'^2)/2"), r=(1, 0), phi=(0, 1.2), until=1)
    assert numpy.allclose(lobatto.run(polar)["p_phi"], 1.2, rtol=1e-14)


def test_scenes_and_runs_go_to_other_processes(pendulum):
    assert lobatto.Scene(SCENES / "pendulum.toml").text == pendulum.text  # a pathlib.Path
    again = pickle.loads(pickle.dumps(pendulum))
    assert again.text == pendulum.text and again.path == pendulum.path
    run = lobatto.run(pendulum, until=2)
    between = run(1.234)
    other = pickle.loads(pickle.dumps(run))
    assert numpy.array_equal(other.q, run.q) and other.error == run.error
    assert numpy.array_equal(other(1.234).q, between.q)
    with multiprocessing.get_context("spawn").Pool(1) as pool:
        assert numpy.array_equal(pool.apply(lobatto.run, (pendulum,), {"until": 2}).q, run.q)


def test_a_companion_in_finer_numbers_measures_rounding(pendulum):
    run = lobatto.run(pendulum, until=5, points=10, companion="double-double")
    assert 0 < run.error < 1e-13
    with pytest.raises(lobatto.InputError, match="a companion needs finer numbers"):
        lobatto.run(pendulum, until=5, companion="float")


def test_states_between_those_that_are_kept(pendulum):
    run = lobatto.run(pendulum, until=5, points=6)
    fine = lobatto.run(pendulum, until=5, points=6, step=0.0125)
    assert numpy.max(numpy.abs(run(fine.t).q - fine.q)) < 1e-8  # measured 1.3e-10
    assert numpy.array_equal(run(run.t[7]).q, run.q[7])
    sparse = lobatto.run(pendulum, until=5, points=6, every=10)
    assert numpy.allclose(sparse(numpy.array([3.21, 0.4])).q, run(numpy.array([3.21, 0.4])).q, rtol=0, atol=1e-12)
    with pytest.raises(lobatto.InputError, match="outside the trajectory"):
        run(6.0)


OSCILLATOR = "x'^2/2 - x^2/2"
KEPLER = "(x'^2 + y'^2)/2 + 1/sqrt(x^2 + y^2)"


def exactly(run, error=1e-9):
    """Between 0 and the end of a run of cos(t): at many times, at the kept ones, at both ends."""
    times = numpy.concatenate([numpy.linspace(run.t[0], run.t[-1], 37), run.t])
    state = run(times)
    assert numpy.max(numpy.abs(state.q[:, 0] - numpy.cos(times))) < error
    assert numpy.max(numpy.abs(state.velocity[:, 0] + numpy.sin(times))) < error
    assert numpy.array_equal(run(run.t).q, run.q)


def test_states_between_are_there_for_all_kinds_of_steps():
    scene = lobatto.Lagrangian(OSCILLATOR, x=1, step=0.05, until=4)
    exactly(lobatto.run(scene, points=8, every=7))
    exactly(lobatto.run(scene, splitting=14), 1e-7)
    exactly(lobatto.run(scene, points=8, numbers="double-double"))
    exactly(lobatto.run(scene, points=8, until=0))
    exactly(lobatto.run(lobatto.Lagrangian(OSCILLATOR, x=1, step=0.05, until=4, extra='stop = "x = -0.5"'), points=8))
    exactly(lobatto.run(scene, points=8, step=0.015, until=0.33))  # whose last time is another number
    run = lobatto.run(scene, points=2)
    assert numpy.array_equal(run(run.t[-1]).velocity, run.p[-1])
    square = run([[0.11, 0.22], [1.3, 2.4]])
    assert square.q.shape == (2, 2, 1) and square.t.shape == (2, 2)
    assert numpy.array_equal(square.q.ravel(), run([0.11, 0.22, 1.3, 2.4]).q.ravel())
    assert numpy.allclose(square.q[1, 0], numpy.cos(1.3), atol=1e-3)
    with pytest.raises(lobatto.InputError, match="outside the trajectory"):
        run(4.01)
    ball = lobatto.run(str(SCENES / "bouncing_ball.toml"))
    assert numpy.isfinite(ball(numpy.linspace(0, ball.t[-1], 101)).q).all()


def comet(every):
    return lobatto.Lagrangian(KEPLER, x=0.1, y=(0, 19**0.5), step=0.02, until=7, method=dict(points=9, clock="auto"),
                              output=dict(every=every))


def test_states_between_with_a_clock():
    run, fine = (lobatto.run(comet(every)) for every in (0.5, 0.1))
    assert numpy.max(numpy.abs(run(fine.t).q - fine.q)) < 1e-8


def test_states_between_where_bodies_rest_at_walls():
    run = lobatto.run(str(SCENES / "newtons_cradle.toml"), measure=False)
    assert numpy.array_equal(run(run.t).q, run.q)
    between = run(numpy.linspace(0, run.t[-1], 1001)).q
    assert (numpy.diff(between) > -1e-12).all()  # no ball is inside another


def test_a_stepper_takes_the_steps_of_a_run():
    for name, until in ("kapitza_pendulum", 0.05), ("newtons_cradle", 2), ("wing_nut", 2):
        scene = lobatto.Scene(SCENES / f"{name}.toml")
        run, stepper = lobatto.run(scene, measure=False, until=until), lobatto.Stepper(scene, until=until)
        assert numpy.isnan(stepper.H) == (run.H is None)
        for q, p in zip(run.q, run.p):
            assert numpy.array_equal(stepper.q, q) and numpy.array_equal(stepper.p, p)
            stepper.step()


def test_an_exception_of_the_caller_ends_the_work_and_arrives(pendulum):
    class Enough(Exception):
        pass

    def progress(_):
        raise Enough("of it")

    for work in (lambda: lobatto.run(pendulum, until=1e6, measure=False, progress=progress),
                 lambda: lobatto.sweep(pendulum, {"q": numpy.linspace(0, 1, 2000)}, until=1e4, progress=progress),
                 lambda: lobatto.tune(pendulum, 1e-6, progress=progress)):
        with pytest.raises(Enough, match="of it"):
            work()
    short = lobatto.run(pendulum, until=1e6, measure=False, progress=lambda share: False)
    assert short.interrupted and short.t[-1] < 1e6 and "interrupted" in repr(short)
    with pytest.warns(UserWarning, match="not a multiple of the step: the run ends at t = 1"):
        assert not lobatto.run(pendulum, until=1.03).reaches_end
    cut = lobatto.sweep(pendulum, {"q": numpy.linspace(0, 1, 2000)}, until=1e4, progress=lambda share: share < 0.1)
    assert cut.interrupted and "interrupted" in repr(cut)


def test_others_work_with_formulas_while_a_run_waits_for_its_companion(pendulum):
    shares, found = [], []

    def progress(share):
        shares.append(share)
        if share == 1 and not found:
            other = threading.Thread(target=lambda: found.append(lobatto.check(pendulum)))
            other.start()
            other.join(60)
        return share < 1

    run = lobatto.run(pendulum, until=20000, every=1000, companion="quadruple", progress=progress)
    assert found and not run.interrupted and run.reaches_end and shares.count(1) == 1 and max(shares) == 1


def test_sweeps_warn_as_the_command_does(pendulum):
    with pytest.warns(UserWarning) as warned:
        sweep = lobatto.sweep(pendulum, {"q": [0.5, 1.0]}, step=0.03, until=5, points=2)
    told = [str(warning.message) for warning in warned]
    assert told == sweep.warnings and len(told) == 2
    assert told[0].startswith("the error of trajectory 1, q = 1, is ")
    assert told[1].startswith("the end time is not a multiple of the step")


def test_a_stepper_belongs_to_one_thread(pendulum):
    stepper, refused = lobatto.Stepper(pendulum), []

    def advance():
        try:
            stepper.advance(3_000_000)
        except lobatto.InputError as error:
            refused.append(str(error))

    threads = [threading.Thread(target=advance) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    advanced = round(stepper.t / stepper.step_size)
    assert advanced == 3_000_000 * (4 - len(refused))
    assert refused and all("is taking steps; give each thread one of its own" in text for text in refused)


def test_arrays_are_not_copied_and_outlive_what_made_them(pendulum):
    run = lobatto.run(pendulum, until=1)
    q = run.q
    first = q.copy()
    del run
    assert numpy.array_equal(q, first)
    stepper = lobatto.Stepper(pendulum)
    view = stepper.q
    stepper.step()
    assert view[0] == stepper.q[0]
    assert not view.flags.writeable and not view.flags.owndata
    del stepper
    assert numpy.isfinite(view[0])


def test_a_step_costs_less_than_a_microsecond_beyond_its_kernel(pendulum):
    # No time is asserted: a machine may be busy. The figure is printed, for docs/python.md.
    stepper = lobatto.Stepper(pendulum)
    begin = time.perf_counter()
    for _ in range(20000):
        stepper.step()
    print(f"{(time.perf_counter() - begin) / 20000 * 1e9:.0f} ns a step")
    assert stepper.t == pytest.approx(1000)


def test_inputs_are_set_before_steps():
    scene = lobatto.Lagrangian("x'^2/2 - x^2/2 + u*x", x=1, u=0.5, inputs=["u"], step=0.1, method=dict(points=9))
    assert [one.name for one in scene.inputs] == ["u"]
    stepper = lobatto.Stepper(scene)
    stepper.set_inputs([1])  # then x = 1 stays
    stepper.advance(10)
    assert abs(stepper.q[0] - 1) < 1e-12 and stepper.parameter("u") == 1
    with pytest.raises(lobatto.InputError, match="needs 1 numbers, one for each input"):
        stepper.set_inputs([1, 2])
    with pytest.raises(lobatto.InputError, match="'v' is to be an input"):
        lobatto.Lagrangian("x'^2/2 - x^2/2 + u*x", x=1, u=0.5, inputs=["v"])


def test_a_stepper_goes_where_it_is_sent(pendulum):
    stepper = lobatto.Stepper(pendulum, points=6)
    stepper.start(1.0, [0.3], velocity=[0.5])
    assert stepper.velocity[0] == pytest.approx(0.5, abs=1e-15)
    stepper.advance_to(1.23)
    assert stepper.t == 1.23
    other = stepper.copy()
    stepper.set("omega", 3.0)
    stepper.step()
    other.step()
    assert stepper.q[0] != other.q[0]
    assert stepper.parameter("omega") == 3
    tangent = other.tangent()
    assert abs(numpy.linalg.det(tangent) - 1) < 1e-13
    with pytest.raises(lobatto.InputError, match="is a list of 1 number, such as"):
        stepper.start(0, [1, 2], [0, 0])


def test_a_sweep_takes_and_gives_arrays(pendulum):
    starts = numpy.linspace(0.1, 2, 50)
    sweep = lobatto.sweep(pendulum, {"q": starts, "omega": 6.0}, until=3)
    assert sweep.q.shape == (50, 1) and sweep.ok.all()
    run = lobatto.run(pendulum, until=3, set={"omega": 6.0, "q": 0.25, "q'": "omega/10"})
    assert run.q[0, 0] == 0.25 and run.p[0, 0] == pytest.approx(0.6, rel=1e-15)
    run = lobatto.run(pendulum, until=3, set={"omega": 6.0})
    close = lobatto.sweep(pendulum, {"q": [numpy.pi / 2], "omega": [6.0]}, until=3)
    assert close.q[0, 0] == pytest.approx(run.q[-1, 0], abs=1e-12)
    kept = lobatto.sweep(pendulum, {"q": starts}, keep=["max(q)"], until=3, measure=True)
    assert numpy.allclose(kept["max(q)"], starts, atol=0.05)
    assert kept.error.max() < 1e-3
    with pytest.raises(lobatto.InputError, match="unknown column 'quux'"):
        lobatto.sweep(pendulum, {"quux": starts})
    with pytest.raises(KeyError, match=r"no column 'H'; there are t, energy_error, q, p_q, max\(q\)"):
        kept["H"]
    with pytest.raises(KeyError, match="no column 0"):
        run[0]


def test_a_sweep_broadcasts_as_numpy_does(pendulum):
    angles, rates = numpy.meshgrid([0.5, 1, 1.5], [4.0, 6], indexing="ij", sparse=True)
    grid = lobatto.sweep(pendulum, {"q": angles, "omega": rates, "m": 1}, until=1)
    assert numpy.array_equal(grid["q"].reshape(3, 2),
                             [[lobatto.sweep(pendulum, {"q": q, "omega": omega}, until=1)["q"][0] for omega in (4.0, 6)]
                              for q in (0.5, 1, 1.5)])
    with pytest.raises(lobatto.InputError, match=r"do not go together: q has \(2,\), omega has \(3,\)"):
        lobatto.sweep(pendulum, {"q": [1, 2], "omega": [1, 2, 3]})
    with pytest.raises(lobatto.InputError, match="q has masked values"):
        lobatto.sweep(pendulum, {"q": numpy.ma.masked_less([0.5, 1], 0.7)})


def test_a_sweep_keeps_states_on_the_way(pendulum):
    sweep = lobatto.sweep(pendulum, {"q": [0.5, 1.0]}, until=1, every=8)
    run = lobatto.run(pendulum, until=1, every=8)
    states = sweep.states(1)
    assert numpy.array_equal(states.t, run.t) and len(states) == 4  # 20 steps: 0, 8, 16, 20
    assert states["q"][0] == 1 and states["p_q"][-1] == sweep.p[1, 0] and states.q[-1, 0] == sweep.q[1, 0]
    assert numpy.array_equal(sweep.states(-1).q, states.q)
    with pytest.raises(IndexError, match="there are 2"):
        sweep.states(2)
    with pytest.raises(lobatto.InputError, match="every=10"):
        lobatto.sweep(pendulum, {"q": [0.5]}, until=1).states(0)


def test_what_is_chosen_keeps_its_promise(pendulum):
    choice = lobatto.tune(pendulum, 1e-8, budget=3, until=10)
    run = lobatto.run(pendulum, **choice.settings)
    assert run.error < 3e-8
    assert "predicted error" in choice._repr_html_()


def test_scenes_are_derived_checked_and_proved(pendulum):
    derivation = lobatto.derive(pendulum)
    assert derivation._repr_latex_().count("$$") > 20
    assert derivation.data["scene"] == "pendulum"
    assert lobatto.check(pendulum)["step"]["order"] == 6
    assert lobatto.stability(pendulum)["step"]
    assert lobatto.verify(pendulum).ok


def test_errors_are_exceptions_with_the_texts_of_the_command_line(pendulum):
    with pytest.raises(lobatto.RunFailure, match="did not converge") as failure:
        lobatto.run(pendulum, step=2.9, until=100)
    assert len(failure.value.trajectory) >= 2
    assert isinstance(failure.value, lobatto.ComputationError) and isinstance(failure.value, ArithmeticError)
    with pytest.raises(lobatto.InputError, match="no such file"):
        lobatto.run("nowhere.toml")
    with pytest.raises(TypeError, match="unknown setting 'stepp'"):
        lobatto.run(pendulum, stepp=1)
    with pytest.raises(ValueError, match="unknown parameter 'omga'"):
        lobatto.run(pendulum, set={"omga": 1})


def test_values_of_another_kind_are_refused(pendulum):
    for settings, message in ((dict(points=4.5), "points needs a whole number, not 4.5"),
                              (dict(every=[1]), "every needs a number"), (dict(set={"m": None}), "m needs a number"),
                              (dict(tolerance="x"), "tolerance needs a number")):
        with pytest.raises(TypeError, match=message):
            lobatto.run(pendulum, **settings)
    with pytest.raises(lobatto.InputError, match="step: nan is no value"):
        lobatto.run(pendulum, step=float("nan"))
    with pytest.raises(lobatto.InputError, match="no value: give a number"):
        lobatto.Lagrangian(OSCILLATOR + " + m", x=1, m=None)
    for starts in ({}, {"q": []}):
        with pytest.raises(lobatto.InputError, match="a sweep needs a start"):
            lobatto.sweep(pendulum, starts)
    orbit = lobatto.Lagrangian(KEPLER, x="1 - e", y=(0, "sqrt((1 + e)/(1 - e))"), e=0.5)
    with pytest.warns(UserWarning, match="2 of 2 trajectories failed: 2 a formula has no value there"):
        assert not lobatto.sweep(orbit, {"e": [numpy.nan, numpy.inf]}, until=1).ok.any()
    assert lobatto.sweep(orbit, {"e": [1e-310, 0.1]}, until=1).ok.all()
    third = lobatto.Lagrangian("m*x'^2/2 - x^2/2", x=numpy.float64(1), m=fractions.Fraction(1, 3))
    assert third.parameters[0].value == 1 / 3
    ball = lobatto.Stepper(lobatto.Scene(str(SCENES / "bouncing_ball.toml")))
    before = ball.parameter("e")
    with pytest.raises(lobatto.InputError, match="restitution"):
        ball.set("e", -1)
    assert ball.parameter("e") == before and ball.step()


def test_a_state_is_taken_with_its_inputs():
    slot = lobatto.Stepper(lobatto.Scene.from_text(
        'lagrangian = "y\'^2/2"\n[coordinates]\ny = { position = 0.5, velocity = 0 }\n[inputs]\nlo = 0\nhi = 1\n'
        '[impacts]\nfloor = { when = "y = lo falling" }\nceiling = { when = "y = hi rising" }\n'
        '[run]\nstep = 0.01\nuntil = 1\n'))
    with pytest.raises(lobatto.ComputationError, match="behind the wall"):
        slot.start(7, [2.5], [0.25])
    slot.start(7, [2.5], [0.25], inputs=[2, 3])
    assert slot.t == 7 and slot.q[0] == 2.5 and slot.parameter("hi") == 3
    with pytest.raises(lobatto.InputError, match="inputs is a list of 2 numbers"):
        slot.start(7, [2.5], [0.25], inputs=[2])


def test_states_between_dense_rows_begin_at_steps():
    text = ('lagrangian = "x\'^2/2 - x^2/2 - x^4/4"\n[coordinates]\nx = { position = 1, velocity = 0 }\n'
            '[method]\nfamily = "gauss"\nstages = 4\n[run]\nstep = 0.4\nuntil = 20\n')
    times = numpy.linspace(0, 20, 201)
    plain = lobatto.run(lobatto.Scene.from_text(text))(times)
    dense = lobatto.run(lobatto.Scene.from_text(text + "[output]\ndense = 3\ncolumns = { v = \"x'\" }\n"))
    assert (dense(times).q == plain.q).all() and (dense(times).velocity == plain.velocity).all()
    assert dense["v"] == pytest.approx(dense["p_x"])


def test_warnings_are_warnings(pendulum):
    with pytest.warns(UserWarning, match="the error is"):
        lobatto.run(pendulum, step=0.25, points=3, until=5)


def test_ctrl_c_ends_a_long_run(pendulum):
    threading.Timer(0.5, os.kill, (os.getpid(), signal.SIGINT)).start()
    with pytest.raises(KeyboardInterrupt):
        lobatto.run(pendulum, until=1e9, every=10**6, measure=False)


def test_ctrl_c_ends_verify():
    scene = lobatto.Scene(str(SCENES / "double_pendulum.toml"))
    threading.Timer(0.2, os.kill, (os.getpid(), signal.SIGINT)).start()
    with pytest.raises(KeyboardInterrupt):
        lobatto.verify(scene)


def test_wrong_types_are_wrong_input():
    oscillator = lobatto.Lagrangian("q'^2/2 - q^2/2", q=1, until=1)
    for wrong, match in ((lambda: lobatto.Lagrangian("q'^2/2", q=1, method="gauss"), "method is a table"),
                         (lambda: lobatto.Lagrangian("φ'^2/2", φ=1), "'φ' is no name"),
                         (lambda: lobatto.Scene("lagrangian = 1\nstep = 1"), "write Scene.from_text"),
                         (lambda: lobatto.run(oscillator, until=1e12), "states of the run would need"),
                         (lambda: lobatto.Lagrangian(b"q'^2/2", q=1), "the Lagrangian is a text"),
                         (lambda: lobatto.Lagrangian("q'^2/2 + push*q", q=1, push=0, inputs="push"), "a list of names"),
                         (lambda: lobatto.sweep(oscillator, (x for x in [1, 2])), "columns with their names"),
                         (lambda: lobatto.sweep(oscillator, {"r": [1, 2]}), "can be varied: q, q'"),
                         (lambda: lobatto.sweep(oscillator, {"q": [1]}, threads=10**9), "1024 are the most"),
                         (lambda: lobatto.tune(oscillator, 1e-6, budget=float("inf")), "too much; give 1s to 24h")):
        with pytest.raises(lobatto.InputError, match=match):
            wrong()


def test_steps_tell_what_they_met():
    scene = lobatto.Scene(str(SCENES / "bouncing_ball.toml"))
    ball, run, met = lobatto.Stepper(scene), lobatto.run(scene), []
    while ball.t < run.t[-1] - 1e-9:
        ball.step()
        met += ball.take_events()
    assert ball.take_events() == [] and len(met) == len(run.events) > 3
    for one, other in zip(met, run.events):
        assert one[0] == other[0] == scene.events[0] and one[1] == other[1] and numpy.array_equal(one[3], other[3])


def test_dollars_in_titles_are_no_mathematics(tmp_path):
    matplotlib = pytest.importorskip("matplotlib")
    matplotlib.use("Agg")
    run = lobatto.run(lobatto.Lagrangian("q'^2/2 - q^2/2", q=dict(position=1, unit="US$/m^$"), title="$5, then $6_"))
    axes = run.plot()
    axes.figure.savefig(tmp_path / "a.png")
    assert axes.get_title() == r"\$5, then \$6_"


def test_ctrl_c_ends_long_steps(pendulum):
    for goes_on in lambda stepper: stepper.advance(10**12), lambda stepper: stepper.advance_to(1e9):
        stepper = lobatto.Stepper(pendulum)
        threading.Timer(0.5, os.kill, (os.getpid(), signal.SIGINT)).start()
        with pytest.raises(KeyboardInterrupt):
            goes_on(stepper)
        assert stepper.t > 0 and stepper.step()
    parts, whole = lobatto.Stepper(pendulum), lobatto.Stepper(pendulum)
    parts.advance_to(3000.01)
    for _ in range(60000):
        whole.step()
    assert numpy.array_equal(parts.at(whole.t)[0], whole.q)
    whole.advance_to(3000.01)
    assert numpy.array_equal(parts.q, whole.q)
    far = lobatto.Stepper(pendulum, step=1e-4)  # whose times are rounded to a millionth of a step
    far.start(1e6, [0.3], [0.5])
    assert far.advance_to(1e6 + 100) and far.t == 1e6 + 100
    clocked = lobatto.Stepper(comet(0.5), until=400)
    assert clocked.advance_to(0.4999) and clocked.advance_to(333.3) and clocked.t == 333.3
    whole = lobatto.Stepper(comet(0.5), until=400)
    for _ in range(666):
        whole.step()
    whole.advance_to(333.3)
    assert numpy.array_equal(clocked.q, whole.q)


def test_other_threads_run_meanwhile(pendulum):
    counted = []

    def count():
        while not done.is_set():
            counted.append(1)
            time.sleep(0.001)

    done = threading.Event()
    thread = threading.Thread(target=count)
    thread.start()
    lobatto.run(pendulum, until=1e5, every=1000, measure=False)
    done.set()
    thread.join()
    assert len(counted) > 20


def test_a_run_keeps_its_own_settings():
    scene = lobatto.Lagrangian("m*q'^2/2 - k*q^2/2", q=(1, 0), m=1, k=1, step=0.1, until=10, output=dict(every=10))
    values = {"k": 1}
    first = lobatto.run(scene, set=values)
    values["k"] = 4
    assert first(5.5).q == pytest.approx(numpy.cos(5.5), abs=1e-6)
    assert lobatto.run(scene, set=values)(5.5).q == pytest.approx(numpy.cos(11), abs=1e-3)


def test_a_lagrangian_may_hold_the_time_and_comments():
    driven = lobatto.Lagrangian("x'^2/2 - x^2/2 + a*x*cos(2*t) # the spring's energy", time="t", x=(0, 0), a=1, step=0.05,
                                until=3)
    assert [variable.name for variable in driven.coordinates] == ["x"]
    assert lobatto.run(driven, points=6).q[-1, 0] == pytest.approx((numpy.cos(3) - numpy.cos(6)) / 3, abs=1e-9)
    with pytest.raises(lobatto.InputError, match="leave splitting or stages out"):
        lobatto.Lagrangian("x'^2/2 - x^2/2", x=1, method=dict(splitting=11, stages=2))
    with pytest.raises(lobatto.InputError, match="is no number of threads"):
        lobatto.sweep(driven, {"x": [1, 2]}, threads=-1)


def test_solve_ivp_agrees_with_scipy(pendulum):
    integrate = pytest.importorskip("scipy.integrate")
    omega = 2 * numpy.pi
    times = numpy.linspace(0, 3, 31)
    wanted = integrate.solve_ivp(lambda t, y: [y[1], -omega**2 * numpy.sin(y[0])], (0, 3), [1, 0.5], rtol=1e-11,
                                 atol=1e-12, t_eval=times).y
    found = lobatto.solve_ivp(pendulum, (0, 3), [1, 0.5], t_eval=times, dense_output=True, step=0.05, points=8)
    assert numpy.max(numpy.abs(found.y[0] - wanted[0])) < 1e-8
    assert found.success and found.sol(1.0).shape == (2,)
    with pytest.raises(lobatto.InputError, match="t_span"):
        lobatto.solve_ivp(pendulum, (1, 3))


def test_solve_ivp_ends_where_it_should():
    for step, end in ((0.015, 0.9), (0.015, 0.33), (1 / 49, 1), (0.05, 1.03)):
        scene = lobatto.Lagrangian(OSCILLATOR, x=1, step=step, until=9)
        solution = lobatto.solve_ivp(scene, (0, end), points=6, dense_output=True)
        assert solution.t[-1] == end and solution.success
        assert numpy.array_equal(lobatto.solve_ivp(scene, (0, end), points=6, t_eval=[end]).y[:, 0], solution.y[:, -1])
        assert solution.sol(end / 3) == pytest.approx([numpy.cos(end / 3), -numpy.sin(end / 3)], abs=1e-9)
        assert solution.sol([[0, end]]).shape == (2, 1, 2)
    assert lobatto.run(scene)([]).q.shape == (0, 1) and lobatto.solve_ivp(scene, (0, 1), t_eval=[]).y.shape == (2, 0)
    assert not hasattr(solution, "t_events")
    for wrong in (dict(t_eval=[0.5, 2]), dict(t_eval=[0.5, 0.2]), dict(t_eval=[0, numpy.nan, 1]), dict(until=3)):
        with pytest.raises(lobatto.InputError, match="t_eval needs ascending times from 0 to 1|the end stands in t_span"):
            lobatto.solve_ivp(scene, (0, 1), **wrong)
    solution = lobatto.solve_ivp(comet(0.5), (0, 2.2))
    assert numpy.allclose(solution.t, [0, 0.5, 1, 1.5, 2, 2.2], atol=1e-14)


def test_a_notebook_shows_a_table_and_nothing_is_injected():
    scene = lobatto.Lagrangian("x'^2/2 - x^2/2", title="<script>alert(1)</script>", x=1, until=3)
    shown = lobatto.run(scene)._repr_html_()
    assert "<script>" not in shown and "measured error" in shown


@pytest.mark.parametrize("name, wanted", [("first_pendulum", "measured error"), ("fit_parameters", "l = 0.8"),
                                          ("control_loop", "after 10.0 s: x = "), ("flip_times", "flip within 20")])
def test_examples(name, wanted, tmp_path):
    script = ROOT / "examples" / "python" / f"{name}.py"
    arguments = ["picture.png"] if name in ("first_pendulum", "flip_times") else []
    environment = {**os.environ, "PYTHONPATH": str(pathlib.Path(lobatto.__file__).parents[1])}
    ran = subprocess.run([sys.executable, script, *arguments], cwd=tmp_path, env=environment, capture_output=True,
                         text=True)
    assert ran.returncode == 0, ran.stderr
    assert wanted in ran.stdout
    if arguments:
        assert (tmp_path / "picture.png").stat().st_size > 5000


def test_a_thread_that_tunes_does_not_hold_up_those_that_read_scenes():
    code = ("import lobatto, pickle, threading\n"
            "scene = lobatto.Scene(%r)\n"
            "tuning = threading.Thread(target=lobatto.tune, args=(scene, 1e-8), kwargs=dict(until=20, budget=3))\n"
            "tuning.start()\n"
            "while tuning.is_alive():\n"
            "    other = lobatto.Scene(%r)\n"
            "    other.emit()\n"
            "    pickle.loads(pickle.dumps(other))\n"
            "    del other\n"
            "tuning.join()\n"
            "print('done')\n") % ((str(SCENES / "pendulum.toml"),) * 2)
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=300, check=False)
    assert done.returncode == 0 and done.stdout == "done\n", done.stderr


def test_a_lagrangian_without_velocities_or_without_its_time_is_told_in_words_of_python():
    with pytest.raises(lobatto.InputError, match="the velocity of x is written x'"):
        lobatto.Lagrangian("m*xdot^2/2 - k*x^2/2", x=(1, 0), m=1, k=2)
    with pytest.raises(lobatto.InputError, match='say Lagrangian.*time="t"'):
        lobatto.Lagrangian("x'^2/2 - x^2/2 + x*cos(t)", x=(1, 0))
    with pytest.raises(lobatto.InputError, match="give the parameter another name"):
        lobatto.Lagrangian("x'^2/2 - t*x^2/2", x=(1, 0), t=2)

def test_a_stepper_is_linearised_and_knows_what_follows(tmp_path):
    cart = lobatto.Lagrangian("x'^2/2 - 2*x^2 + u*x", x=(1, 0.3), u=0, inputs=["u"], step=0.05, method=dict(points=6))
    stepper = lobatto.Stepper(cart)
    assert abs(stepper.sensitivity("u")[0] - (1 - numpy.cos(0.1))/4) < 1e-13
    assert stepper.columns == {} and stepper.next_time == 0.05
    other = copy.deepcopy(stepper)
    other.step()
    assert other.t == 0.05 and stepper.t == 0 and copy.copy(other).q[0] == other.q[0]
    with pytest.raises(lobatto.InputError, match="'x' is a coordinate"):
        lobatto.Lagrangian("x'^2/2", x=(1, 0), inputs=["x"])
    scene = tmp_path/"arm.toml"
    scene.write_text("""lagrangian = "-9.81*arm.y"
[bodies]
arm = { mass = 1, inertia = 0.1, position = [0.5, 0] }
[joints]
s = { type = "hinge", bodies = ["ground", "arm"], point = [0, 0], angle = 0.4 }
[run]
step = 0.01
until = 0.1
""")
    stepper = lobatto.Stepper(str(scene), points=3)
    run = lobatto.run(str(scene), points=3)
    assert stepper.columns["arm_y"] == run["arm.y"][0] and numpy.array_equal(run["s.angle"], run["s_angle"])


def test_the_linearised_steps_of_the_documents_balance_a_rod():
    linalg = pytest.importorskip("scipy.linalg")
    text = (pathlib.Path(__file__).parents[2]/"docs"/"python.md").read_text()
    blocks = [block.split("```")[0] for block in text.split("```python\n")[1:]]
    written = [next(block for block in blocks if part in block) for part in ("A rod on a cart", "solve_discrete_are")]
    known = {"lobatto": lobatto, "numpy": numpy, "scipy": types.SimpleNamespace(linalg=linalg)}
    for block in written:
        exec(block, known)  # pylint: disable=exec-used
    closed = known["A"] - known["B"] @ known["gains"][None]
    assert 0.9 < abs(numpy.linalg.eigvals(closed)).max() < 1 < abs(numpy.linalg.eigvals(known["A"])).max()
    cart = lobatto.Stepper(known["scene"])
    while cart.t < 10:
        cart.set("push", float(-known["gains"] @ numpy.concatenate([cart.q, cart.p])))
        cart.step()
    assert abs(cart.q).max() < 1e-3
