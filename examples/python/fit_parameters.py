# SPDX-License-Identifier: GPL-2.0-or-later
"""Length and damping of a pendulum from noisy measurements of its angle, by scipy's least squares."""

import numpy
from scipy.optimize import least_squares

import lobatto

scene = lobatto.Lagrangian("l^2*theta'^2/2 + 9.81*l*cos(theta)", l=1, c=0, step=0.05, until=10,
                           theta=dict(position=1.2, velocity=0, force="-c*theta'"))
times = numpy.linspace(0, 10, 60)


def angles(l, c):
    return lobatto.run(scene, set={"l": l, "c": c}, measure=False)(times).q[:, 0]


true = (0.85, 0.12)
measured = angles(*true) + numpy.random.default_rng(7).normal(0, 0.02, len(times))
found = least_squares(lambda x: angles(*x) - measured, (0.9, 0.05), x_scale=(1, 0.1), diff_step=1e-6)
deviation = numpy.sqrt(numpy.diag(numpy.linalg.inv(found.jac.T @ found.jac)) * 2 * found.cost / (len(times) - 2))
for name, value, error, wanted in zip(("l", "c"), found.x, deviation, true):
    print(f"{name} = {value:.4f} +- {error:.4f} (true: {wanted})")
