# SPDX-License-Identifier: GPL-2.0-or-later
"""A first pendulum: its Lagrangian, a run, a picture of its phase space. Usage: first_pendulum.py [picture.png]"""

import sys

import matplotlib

matplotlib.use("Agg")
import lobatto

scene = lobatto.Lagrangian("m*l^2*theta'^2/2 + m*g*l*cos(theta)", title="A pendulum",
                           theta=dict(position="170*pi/180", velocity=0, unit="rad"), m=1,
                           l=dict(value=1, unit="m"), g=9.81, step=0.05, until=20, method=dict(points=5))
run = lobatto.run(scene)
print(run)
axes = run.plot("p_theta", x="theta")
axes.figure.savefig(sys.argv[1] if len(sys.argv) > 1 else "pendulum.png")
