# SPDX-License-Identifier: GPL-2.0-or-later
"""Scenes written in Python."""

import json
import re

from ._lobatto import InputError, Scene


def _value(value):
    """As TOML has it: numbers with all their digits, formulas in quotes."""
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, str):
        return json.dumps(value, ensure_ascii=False)
    if isinstance(value, (list, tuple)):
        return "[" + ", ".join(_value(item) for item in value) + "]"
    if isinstance(value, dict):
        return "{ " + ", ".join(f"{key} = {_value(item)}" for key, item in value.items()) + " }"
    if hasattr(value, "tolist"):  # of NumPy
        return _value(value.tolist())
    if isinstance(value, int):
        return repr(value)
    try:
        return repr(float(value))  # fractions and decimals too
    except (TypeError, ValueError):
        raise InputError(f"{value!r} is no value: give a number, or a formula in a string") from None


def _coordinate(name, value):
    if isinstance(value, dict):
        table = dict(value)
    elif isinstance(value, (list, tuple)):
        if len(value) != 2:
            raise InputError(f"coordinate {name}: expected (position, velocity), not {len(value)} values")
        table = {"position": value[0], "velocity": value[1]}
    else:
        table = {"position": value}
    if "position" in table and "velocity" not in table and "momentum" not in table:
        table["velocity"] = 0
    return table


def Lagrangian(lagrangian, *, title="", time="", step=0.01, until=10, method=None, output=None, inputs=(),
               definitions=None, forces=None, extra="", **variables):
    """A scene from a Lagrangian and the values of its names.

    A name that stands in the Lagrangian with a prime, as q in ``m*q'^2/2``, is a coordinate. Its value is its initial
    position, ``(position, velocity)``, or a table: ``dict(position=1, momentum=0, unit="m", force="-c*q'")``. An array
    ``x[1]', x[2]', ...`` is a table with a count: ``dict(count=64, position="sin(i)", velocity=0)``, or with lists. Every
    other name is a parameter: a number, a formula in a string (``"2*pi"``), or ``dict(value=1, unit="kg")``. A table
    with a position is a coordinate, too, whose prime stands in a definition.

    ``time``: its name where it stands in the Lagrangian or a force, such as "t". ``method``: a table such as
    ``dict(points=6)`` or ``dict(stages=4, clock="auto")``. ``output``: as [output] in a scene file. ``inputs``: names of
    parameters that ``Stepper.set`` may change before each step. ``definitions``: names of formulas, such as
    ``{"r": "sqrt(x^2 + y^2)", "V[i]": "x[i]^4"}``. ``forces``: on coordinates or along definitions, such as
    ``{"r": "-k*r"}``. ``extra``: more of a scene file, as text; ``Scene.from_text`` takes a whole one.
    """
    if not isinstance(lagrangian, str):
        raise InputError(f"the Lagrangian is a text, such as \"m*q'^2/2 - k*q^2/2\", not {lagrangian!r}")
    examples = {"method": "points=4", "output": "every=10", "definitions": "r='sqrt(x^2 + y^2)'", "forces": "x=\"-c*x'\""}
    for name, table in ("method", method), ("output", output), ("definitions", definitions), ("forces", forces):
        if table is not None and not hasattr(table, "items"):
            raise InputError(f"{name} is a table, such as {name}=dict({examples[name]}), "
                             f"not {table!r}")
    for name, value in variables.items():
        is_table = isinstance(value, (dict, list)) and not ({"value", "position"} & set(value))
        if is_table and name in ("constraints", "impacts", "bodies", "joints", "events", "stop", "view", "run"):
            raise InputError(f"{name} has no argument of its own; write it as text, as in a scene file: "
                             f'extra="[constraints]\\nrod = \\"x^2 + y^2 = 1\\""')
    formulas = [lagrangian, *(str(formula) for formula in (definitions or {}).values())]
    for name in variables:
        if not name.isascii():
            raise InputError(f"'{name}' is no name: names have the letters a to z, digits and _, such as theta")
    moving = {name for formula in formulas
              for name in re.findall(r"([A-Za-z_]\w*)(?:\[[^\]]*\])?'", re.sub("#[^\n]*", "", formula))}  # no comments
    moving -= set(definitions or {})
    moving |= {name for name, value in variables.items() if isinstance(value, dict) and "position" in value}
    lines = []
    if title:
        lines.append(f"title = {_value(title)}")
    if time:
        lines.append(f"time = {_value(time)}")
    lines.append(f"lagrangian = {_value(lagrangian)}")
    coordinates = {name: value for name, value in variables.items() if name in moving}
    missing = sorted(moving - set(coordinates))
    if missing:
        raise InputError(f"'{missing[0]}' stands in the Lagrangian as {missing[0]}', so it is a coordinate; give its "
                         f"start: Lagrangian(..., {missing[0]}=(position, velocity))")
    if not coordinates:
        raise InputError("no velocity stands in the Lagrangian: the velocity of x is written x', as in m*x'^2/2")
    stands = r"(?<![A-Za-z0-9_])t(?![A-Za-z0-9_'\[]|\s*=[^=])"
    if not time and "t" not in {*variables, *(definitions or {})} and not extra and any(
            re.search(stands, plain) for plain in (re.sub("#[^\n]*", "", f) for f in formulas)
            if not re.search(r"\bt\s*=[^=]", plain)):
        raise InputError("t stands in a formula: if it is the time, say Lagrangian(..., time=\"t\")")
    coordinates = {name: _coordinate(name, value) for name, value in coordinates.items()}
    if definitions:
        lines.append("[definitions]")
        lines += [f"{_value(name)} = {_value(value)}" for name, value in definitions.items()]  # V[i] needs quotes
    forces = {**{name: table.pop("force") for name, table in coordinates.items() if "force" in table}, **(forces or {})}
    for heading, table in ("coordinates", coordinates), ("forces", forces):
        if table:
            lines.append(f"[{heading}]")
            lines += [f"{_value(name)} = {_value(value)}" for name, value in table.items()]
    if isinstance(inputs, str):
        raise InputError(f"inputs is a list of names: inputs=[{inputs!r}]")
    inputs = list(inputs)
    for name in inputs:
        if name in moving:
            raise InputError(f"'{name}' is a coordinate, which stands in the Lagrangian with a prime; inputs are "
                             f"parameters")
        if name not in variables:
            raise InputError(f"'{name}' is to be an input; give its value: Lagrangian(..., {name}=0, "
                             f"inputs=[{name!r}])")
    lines.append("[parameters]")
    lines += [f"{name} = {_value(value)}" for name, value in variables.items()
              if name not in moving and name not in inputs]
    if inputs:
        lines.append("[inputs]")
        lines += [f"{name} = {_value(variables[name])}" for name in inputs]
    lines.append("[run]")
    lines += [f"step = {_value(step)}", f"until = {_value(until)}"]
    if method:
        method = dict(method)
        if "stages" in method and "splitting" in method:
            raise InputError("method: stages are those of Gauss's method; leave splitting or stages out")
        for family, size in (("gauss", "stages"), ("splitting", "splitting")):
            if size in method:
                method = {"family": family, "stages": method.pop(size), **method}
        lines.append("[method]")
        lines += [f"{name} = {_value(value)}" for name, value in method.items()]
    if output:
        lines.append("[output]")
        lines += [f"{name} = {_value(value)}" for name, value in output.items()]
    return Scene.from_text("\n".join(lines) + "\n" + extra, "Lagrangian.toml")
