# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""
What moves a wake and what mirrors it: grids of rings, bound and shed, seen from anywhere.

The rings of a surface and those of its wake are one grid: the last row of nodes of the one is
the first of the other. From it follow

* the free wake: the velocity of everything at the wake's own nodes;
* ground effect: the same grid below a plane ground, with its circulation turned round, makes
  the flow through the plane vanish.
"""

from collections.abc import Iterator

import numpy as np

from poststall_sim.aero.kernels import grid_edges, grid_velocity
from poststall_sim.aero.lattice import Grid, Lattice
from poststall_sim.aero.wake import Placement, Wake, close, far_length
from poststall_sim.frames import FloatArray

VISCOSITY = 1.46e-5
"""Of air [m^2/s]."""
LAMB, SQUIRE = 1.25643, 2e-4
"""A core's square grows by 4 LAMB (viscosity + SQUIRE circulation) time (Bhagwat & Leishman,
AHS Forum 58, 2002)."""


def rows_of_surface(lattice: Lattice, grid: Grid) -> FloatArray:
    """Return the nodes (rows + 1, nodes, 3) of a surface's rings in geometry axes [m]."""
    strips = grid.strips.stop - grid.strips.start
    corners = lattice.ring_corners[grid.panels].reshape(grid.rows, strips, 4, 3)
    front = np.concatenate([corners[:, :, 0], corners[:, -1:, 1]], axis=1)
    rear = np.concatenate([corners[-1:, :, 3], corners[-1:, -1:, 2]], axis=1)
    return np.concatenate([front, rear])


def _grids(wake: Wake, lattice: Lattice, placement: Placement,
           circulation: FloatArray) -> Iterator[tuple[Grid, FloatArray, FloatArray, float]]:
    """Yield each surface: nodes (rows, n, 3) in N, rings and core [m], bound, shed and far."""
    shed, nodes_N = wake.circulation, np.empty((wake.rows + 2, *wake.moving_A.shape[1:]))
    nodes_N[:-1] = wake.nodes_N
    close(nodes_N, far_length(lattice))
    for grid in lattice.grids:
        strips = grid.strips.stop - grid.strips.start
        yield (grid, np.concatenate([
            placement.to_inertial(rows_of_surface(lattice, grid)[:-1]),
            nodes_N[:, grid.nodes]]), np.concatenate([
                circulation[grid.panels].reshape(grid.rows, strips), shed[:, grid.strips],
                shed[-1:, grid.strips]]),
            lattice.core * float(lattice.strip_width[grid.strips].mean()))


def _velocity(nodes: FloatArray, rings: FloatArray, cores: FloatArray,
              points: FloatArray) -> FloatArray:
    """Return the velocity (k, 3) of a grid at points (k, 3); cores (rows,) [m] of its rows."""
    width = nodes.shape[1]
    edges = np.empty((6, len(nodes) * width))
    grid_edges(nodes, rings, cores, edges)
    out = np.empty_like(points)
    grid_velocity(*edges, width, points, out)
    return out


def ground_velocity(wake: Wake, lattice: Lattice, placement: Placement, circulation: FloatArray,
                    points_N: FloatArray) -> FloatArray:
    """
    Return the velocity (k, 3) in N that a ground at altitude 0 makes at points (k, 3) in N.

    circulation : (p,) of the bound rings.
    """
    below = np.array([1.0, 1.0, -1.0])
    total = np.zeros_like(points_N)
    for _, nodes, rings, core in _grids(wake, lattice, placement, circulation):
        # Seen in a mirror, a ring turns the other way round.
        total += _velocity(nodes * below, -rings, np.full(len(nodes), core), points_N)
    return total


def own_velocity(wake: Wake, lattice: Lattice, placement: Placement, circulation: FloatArray,
                 dt: float) -> FloatArray:
    """
    Return the velocity (m - 1, nodes, 3) in N at the moving nodes behind the trailing edge.

    circulation : (p,) of the bound rings; dt [s] : between rows, by which their cores have grown.
    """
    moving = wake.moving_A[1:] + wake.drift_N
    points = np.ascontiguousarray(moving.reshape(-1, 3))
    total = np.zeros_like(points)
    for grid, nodes, rings, core in _grids(wake, lattice, placement, circulation):
        age = dt * np.maximum(np.arange(len(nodes)) - grid.rows, 0)
        spread = VISCOSITY + SQUIRE * float(np.abs(rings).max())
        cores = np.sqrt(core ** 2 + 4.0 * LAMB * spread * age)
        total += _velocity(nodes, rings, cores, points)
    return total.reshape(moving.shape)

