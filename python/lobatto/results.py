# SPDX-License-Identifier: GPL-2.0-or-later
"""What runs, sweeps and searches return."""

import html
import json
import re
from typing import NamedTuple

import numpy

from ._lobatto import InputError, Stepper


class State(NamedTuple):
    """Positions and velocities at some times, times x n (n alone for one time)."""

    t: numpy.ndarray
    q: numpy.ndarray
    velocity: numpy.ndarray


def _states_at(stepper, t, q, p, dense, times):
    """Positions and velocities at times of any shape, of a trajectory with these kept states: that shape x n.

    ``dense`` of them lie inside each step, on its polynomial."""
    order = numpy.argsort(times, axis=None, kind="stable")
    back = numpy.argsort(order, kind="stable")
    return (rows[back].reshape(times.shape + q.shape[1:]) for rows in stepper._states_at(t, q, p, dense, times.ravel()[order]))


def _table(rows):
    cells = "".join(f"<tr><th style='text-align:left'>{html.escape(str(name))}</th>"
                    f"<td style='text-align:left'>{html.escape(str(value))}</td></tr>" for name, value in rows)
    return f"<table>{cells}</table>"


class _Rows:
    """Columns by name: x, p_x; of an array x[3], which is also x_3, or all of it, x; arm.angle, which is arm_angle."""

    def _index(self, name):
        names = [variable.name for variable in self.coordinates]
        rows, name = self.q, re.sub(r"\[(\d+)\]$", r"_\1", name).replace(".", "_")
        if name not in names and name.startswith("p_"):
            rows, name = self.p, name[2:]
        if name in names:
            return rows, names.index(name)
        elements = [i for i, one in enumerate(names) if re.fullmatch(re.escape(name) + r"_\d+", one)]
        return (rows, elements) if elements else None

    def __getitem__(self, name):
        found = self._index(name) if isinstance(name, str) else None
        if found is not None:
            return found[0][:, found[1]]
        own = [column for column in ("t", "H", "energy_error") if getattr(self, column, None) is not None]
        if isinstance(name, str) and name in own:
            return getattr(self, name)
        names = self.names
        beside = [*getattr(self, "column_names", []), *getattr(self, "kept", [])]
        raise KeyError(f"there is no column {name!r}; there are "
                       f"{', '.join([*own, *names, *('p_' + name for name in names), *beside])}")

    @property
    def names(self):
        """Of the coordinates."""
        return [variable.name for variable in self.coordinates]

    @property
    def units(self):
        """Of the coordinates; "" where the scene names none."""
        return [variable.unit for variable in self.coordinates]


class Trajectory(_Rows):
    """A run: t (count), q and p (count x n), H (count, or None), and what is known of it.

    ``run["x"]`` is a column by its name, also of ``columns`` (count x ``column_names``): multipliers that the scene asks
    for, eliminated coordinates and their velocities, the orientation and angular velocity of bodies.

    ``events``: what happened, a list of (what, t, q, p), with ``what`` one of ``event_names``: events, stops and
    impacts as the scene writes them; of an impact the momenta after it.
    ``error``: measured at the end, relative to the amplitude of the motion; None where it was not measured.
    ``run(t)`` gives states at any times in between, by steps from the state before that end there.
    ``reaches_end``: False where the end is no multiple of the step, and the run ended at the last one before.
    ``interrupted``: by ``progress``. ``stopped_by``: the stop of the scene that ended it, or "".
    """

    def __init__(self, scene, settings, values):
        self.scene = scene
        self._settings = settings
        self._stepper = None
        self.__dict__.update(values)

    def __getstate__(self):
        return {**self.__dict__, "_stepper": None}

    def _index(self, name):
        name = name.replace(".", "_")
        if name in self.column_names:
            return self.columns, self.column_names.index(name)
        return super()._index(name)

    def __len__(self):
        return len(self.t)

    def __call__(self, t):
        """Position and velocity at a time, or at an array of times, inside the run."""
        if self._stepper is None:
            self._stepper = Stepper(self.scene, **{**self._settings, "every": None, "numbers": "double"})
        times = numpy.asarray(t, dtype=float)
        q, velocity = _states_at(self._stepper, self.t, self.q, self.p, self.dense, times)
        return State(float(t) if times.ndim == 0 else times, q, velocity)

    def plot(self, *names, x="t", ax=None, **options):
        """Draws columns (all coordinates where none is named) over x by matplotlib; returns the axes."""
        from matplotlib import pyplot

        def text(words):  # what stands between two $ would be read as mathematics
            return words.replace("$", r"\$")

        ax = ax or pyplot.figure().gca()
        units = dict(zip(self.names, self.units))
        for name in names or self.names:
            unit = units.get(name, "")
            ax.plot(self[x], self[name], label=text(f"{name} ({unit})" if unit else name), **options)
        ax.set_xlabel(text(f"{x} ({units[x]})" if units.get(x) else x))
        if len(names or self.names) == 1:
            ax.set_ylabel(ax.get_lines()[-1].get_label())
        else:
            ax.legend()
        ax.set_title(text(self.scene.title))
        return ax

    def _facts(self):
        facts = [("scene", self.scene.title or self.scene.name), ("method", f"{self.method}, h = {self.step:g}"),
                 ("steps", f"{self.steps}, to t = {self.t[-1]:g}"), ("states", len(self))]
        if self.error is not None:
            facts.append(("measured error", f"{self.error:.1e} of the amplitude at the end"))
        if self.H is not None and len(self.H):
            facts.append(("energy", f"{self.H[0]:g}, changes by {numpy.max(numpy.abs(self.H - self.H[0])):.1e} at most"))
        if self.stopped_by:
            facts.append(("stopped by", self.stopped_by))
        if not self.reaches_end:
            facts.append(("end", "no multiple of the step; the run ended at the last one before"))
        if self.interrupted:
            facts.append(("interrupted", "before its end"))
        facts += [("warning", warning) for warning in self.warnings]
        return facts

    def __repr__(self):
        return "Trajectory(" + "; ".join(f"{name}: {value}" for name, value in self._facts()) + ")"

    def _repr_html_(self):
        return _table(self._facts())


class States(_Rows):
    """What a sweep kept of one trajectory: t and energy_error (count), q and p (count x n)."""

    def __init__(self, coordinates, kept, rows):
        self.coordinates = coordinates
        self.t, self.q, self.p, self.energy_error = (kept[name][rows] for name in ("t", "q", "p", "energy_error"))

    def __len__(self):
        return len(self.t)


class Sweep(_Rows):
    """The last states of many trajectories: status, steps, t (count), q and p (count x n), kept by name.

    ``status`` 0: it reached the end or a stop; ``statuses[i]`` says what i means. ``ok`` is the mask of these.
    ``states(i)``: where ``every`` was given, the start of trajectory i, each such state, and the last one.
    """

    def __init__(self, scene, values):
        self.scene = scene
        self.__dict__.update(values)
        self.ok = self.status == 0

    def __len__(self):
        return len(self.status)

    def __getitem__(self, name):
        return self.kept[name] if name in self.kept else super().__getitem__(name)

    def states(self, index):
        if self._states is None:
            raise InputError("this sweep kept the last states alone; every=10 keeps each tenth too")
        first = self._states["first"]
        if index < 0:  # from the end
            index += len(self)
        if not 0 <= index < len(self):
            raise IndexError(f"there is no trajectory {index}; there are {len(self)}, counted from 0")
        return States(self.coordinates, self._states, slice(int(first[index]), int(first[index + 1])))

    def __repr__(self):
        cut = ", interrupted before the others" if self.interrupted else ""
        return f"Sweep({len(self)} trajectories, {int(self.ok.sum())} reached their end{cut})"


class Choice:
    """What tune chose. ``run(scene, **choice.settings)`` keeps the promise."""

    def __init__(self, scene, values):
        self.scene = scene
        self.__dict__.update(values)

    def _facts(self):
        return [("method", f"{self.method}, h = {self.step:g}"), ("until", f"t = {self.until:g}"),
                ("predicted error", f"{self.predicted_error:.1e} of the amplitude"), ("cost", f"{self.seconds:.2g} s")]

    def __repr__(self):
        return "Choice(" + "; ".join(f"{name}: {value}" for name, value in self._facts()) + ")"

    def _repr_html_(self):
        return _table(self._facts())


class Derivation:
    """How the integrator follows from the Lagrangian: text, a LaTeX document, and data (docs/derivation.md)."""

    def __init__(self, text, latex, data):
        self.text = text
        self.latex = latex
        self.data = json.loads(data)

    def __repr__(self):
        return self.text

    def _repr_latex_(self):
        """Its formulas, one after another, for a notebook."""
        formulas = re.findall(r"\\\[\n\\fit\{(.*?)\}\n\\\]\n", self.latex, re.DOTALL)
        return "\n\n".join(f"$$ {formula} $$" for formula in formulas)


class Claims(list):
    """What verify looked at: (claim, measured, bound, holds)."""

    @property
    def ok(self):
        return all(holds for _, _, _, holds in self)

    def _repr_html_(self):
        rows = "".join("<tr>" + "".join(f"<td style='text-align:left'>{html.escape(str(cell))}</td>" for cell in row) +
                       "</tr>" for row in self)
        return f"<table><tr><th>claim</th><th>measured</th><th>bound</th><th>holds</th></tr>{rows}</table>"
