# SPDX-License-Identifier: GPL-2.0-or-later
"""A cart balances a rod: every 10 ms a force, computed from where they are."""

import numpy

import lobatto

scene = lobatto.Lagrangian(
    "(M + m)*x'^2/2 + m*l*x'*a'*cos(a) + m*l^2*a'^2/2 - m*g*l*cos(a) + push*x", title="A rod on a cart",
    x=dict(position=0, velocity=0, unit="m"), a=dict(position=0.2, velocity=0, unit="rad"),  # from upright
    M=1, m=0.2, l=0.5, g=9.81, push=dict(value=0, unit="N"), inputs=["push"], step=0.01, method=dict(points=3))
gains = numpy.array([1.0, 35.0, 2.5, 7.0])  # on x, a and their velocities
cart = lobatto.Stepper(scene)
while cart.t < 10 - 1e-9:
    cart.set("push", float(gains @ numpy.concatenate([cart.q, cart.velocity])))
    cart.step()
print(f"after {cart.t:.1f} s: x = {cart.q[0]:.5f} m, a = {cart.q[1]:.6f} rad")
