# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""
Induced drag in the Trefftz plane, from nothing but the circulation that the strips shed.

Far behind, straight wakes are vortices of infinite length across the stream, and the energy that
they leave there in a metre of flight is the drag (Katz & Plotkin, Low-Speed Aerodynamics, 2nd
ed., sec. 8.4; Munk, NACA Report 121, 1921):

    D = -rho/2 sum G (d x l) . w

with l each strip's trailing edge from left to right, d the direction of the wake and w what all
wakes induce at the place of the strip where its flow is tangent. The sums on the lattice's edges
converge to it as strips are added; where strips are few or crowd by a cosine this one is nearer.
"""

import math

import numpy as np

from poststall_sim.aero import wake as wakes
from poststall_sim.aero.lattice import Lattice
from poststall_sim.frames import FloatArray

ON_LINE = 1e-6
"""Strip widths from a vortex, on which a place feels nothing of it, as between panels."""


def induced_drag(lattice: Lattice, shed: FloatArray, direction: FloatArray,
                 density: float) -> float:
    """
    Return the drag [N] of straight wakes along a direction (3,).

    shed (n,) : circulation of the strips' wakes [m^2/s]; density [kg/m^3].
    """
    across = np.eye(3) - np.outer(direction, direction)
    left, right = (lattice.wake_nodes[lattice.te_node + k] @ across for k in (0, 1))
    edge = np.flatnonzero(lattice.edge_wake >= 0)
    place = np.empty_like(left)
    place[lattice.edge_wake[edge]] = lattice.edge_middle[edge] @ across
    surfaces = range(len(lattice.grids))
    table = np.array([[wakes.core(lattice, s, p) for s in surfaces] for p in surfaces])
    core = table[lattice.strip_surface[:, None], lattice.strip_surface[None, :]]
    wash = np.zeros_like(place)
    for node, sign in ((right, 1.0), (left, -1.0)):
        arm = place[:, None] - node[None, :]
        square = np.sum(arm * arm, axis=-1) + core * core
        # Without cores a tail may stand in the very line of a wing's vortex.
        square[square < (ON_LINE * lattice.strip_width[:, None]) ** 2] = math.inf
        pull = sign * shed / (2.0 * math.pi * square)
        wash += np.cross(direction, np.einsum('ij,ijk->ik', pull, arm))
    return float(-0.5 * density * shed @ np.sum(np.cross(direction, right - left) * wash, axis=1))
