# SPDX-License-Identifier: GPL-2.0-or-later
"""When does a double pendulum flip? A map over both starting angles. Usage: flip_times.py [picture.png [size]]"""

import pathlib
import sys

import matplotlib

matplotlib.use("Agg")
import numpy
from matplotlib import pyplot

import lobatto

size = int(sys.argv[2]) if len(sys.argv) > 2 else 60
scene = lobatto.Scene(str(pathlib.Path(__file__).resolve().parents[2] / "scenes" / "flips.toml"))
angles = numpy.linspace(-3, 3, size)
a, b = numpy.meshgrid(angles, angles, indexing="ij")
first, second = (variable.name for variable in scene.coordinates)
flips = lobatto.sweep(scene, {first: a, second: b}, until=20, measure=False)
times = numpy.where(flips.stop > 0, flips.t, numpy.nan).reshape(size, size)
print(f"{int(numpy.isfinite(times).sum())} of {size * size} flip within 20; the first at t = {numpy.nanmin(times):.3f}")
pyplot.imshow(times.T, origin="lower", extent=(-3, 3, -3, 3), cmap="magma_r")
pyplot.xlabel(first)
pyplot.ylabel(second)
pyplot.colorbar(label="time of the first flip")
pyplot.savefig(sys.argv[1] if len(sys.argv) > 1 else "flips.png", dpi=150)
