# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""
Drag and moment of bodies that do not lift: fuselage and gear.

With V the velocity of the air past a place of the body, A the drag areas and rho the density:

* a bluff body (no length): F = rho/2 |V| (A_x V_x, A_y V_y, A_z V_z);
* a slender body: F_x = rho/2 A_x |V_x| V_x at its middle, and across it the crossflow drag of
  Allen and Jorgensen, F = rho/2 |V_c| (0, A_y V_y, A_z V_z) with V_c = (0, V_y, V_z), spread
  evenly over its length and made with the velocity at each place, so that it damps turning;
* with a volume besides, the moment of Munk, M = rho volume (k V) x V with the coefficients k of
  apparent mass of an ellipsoid along and across its axis: nose-up with alpha, nose away from the
  wind with sideslip. A closed body has no force of that kind, only the moment.

Left out: what wing and body do to each other, the body's apparent mass, the loss of the moment
where flow over the back of the body separates, and wash on wing and tail.

References
----------
M. M. Munk, NACA Report 184, 1924. H. J. Allen, E. W. Perkins, NACA Report 1048, 1951.
L. H. Jorgensen, NASA TR R-474, 1977. H. Lamb, Hydrodynamics, 6th ed., 1932, art. 114 and 115.

"""

import math
from collections.abc import Callable, Sequence

import numpy as np

from poststall_sim.frames import FloatArray, body_to_geometry, cross
from poststall_sim.nonlifting import NonliftingBody

_PLACES, _SHARES = np.polynomial.legendre.leggauss(5)
"""Along a slender body: exact for what is a polynomial of degree 9 in the place."""
_STEP = 1e-4
"""Change of velocity [m/s] and rate [rad/s] for derivatives: the loads bend where flow across
vanishes, and are of second order else."""

Air = Callable[[FloatArray], FloatArray]
"""Velocity (k, 3) of the air past points at arms (k, 3) from the centre of gravity, both in G."""


def apparent_mass(fineness: float) -> tuple[float, float]:
    """
    Return k along and across the axis of a prolate ellipsoid, of length over diameter >= 1.

    The mass of air that moves with it, in masses of the air it displaces: both 1/2 for a sphere,
    0 and 1 for a needle.
    """
    flat = 1.0 / fineness ** 2
    if 1.0 - flat < 1e-4:
        return 0.5, 0.5
    e = math.sqrt(1.0 - flat)
    long = math.log((1.0 + e) / (1.0 - e))
    along = 2.0 * flat / e ** 3 * (0.5 * long - e)
    across = 1.0 / e ** 2 - flat / (2.0 * e ** 3) * long
    return along / (2.0 - along), across / (2.0 - across)


def load(bodies: Sequence[NonliftingBody], cg_G: Sequence[float], air: Air,
         density: float) -> FloatArray:
    """Return force [N] and moment about the centre of gravity [N m] of all bodies, (6,) in G."""
    total = np.zeros(6)
    for body in bodies:
        middle, area = np.array(body.position_G) - cg_G, np.array(body.drag_area)
        here = air(middle[None])[0]
        if body.length is None:
            _add(total, middle, 0.5 * density * float(np.linalg.norm(here)) * area * here)
            continue
        _add(total, middle,
             np.array([0.5 * density * area[0] * abs(here[0]) * here[0], 0.0, 0.0]))
        arms = middle + 0.5 * body.length * _PLACES[:, None] * np.array([1.0, 0.0, 0.0])
        for arm, share, flow in zip(arms, 0.5 * _SHARES, air(arms)):
            across = flow * np.array([0.0, 1.0, 1.0])
            _add(total, arm,
                 0.5 * density * share * math.hypot(*across[1:]) * area * across)
        if body.volume is not None:
            along, beside = apparent_mass(body.fineness)
            momentum = np.array([along, beside, beside]) * here
            total[3:] += density * body.volume * cross(momentum, here)
    return total


def load_slope(bodies: Sequence[NonliftingBody], cg_G: Sequence[float], velocity_G: FloatArray,
               rates_G: FloatArray, density: float) -> FloatArray:
    """
    Return the derivative (6, 6) in G of `load` by velocity and rates of the aircraft in B.

    velocity_G : of the air past the centre of gravity, rates_G : of the aircraft, (3,) in G.
    """
    out = np.zeros((6, 6))
    if not bodies:
        return out
    for i, change in enumerate(_STEP * np.eye(6)):
        moved, turned = body_to_geometry(change[:3]), body_to_geometry(change[3:])
        ends = []
        for way in (1.0, -1.0):
            velocity, rates = velocity_G - way * moved, rates_G + way * turned

            def air(arm: FloatArray, velocity=velocity, rates=rates) -> FloatArray:
                return velocity - np.cross(rates, arm)
            ends.append(load(bodies, cg_G, air, density))
        out[:, i] = (ends[0] - ends[1]) / (2.0 * _STEP)
    return out


def _add(total: FloatArray, arm: FloatArray, force: FloatArray) -> None:
    total[:3] += force
    total[3:] += cross(arm, force)
