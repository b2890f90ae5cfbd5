# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""
The wake: rows of vortex rings shed at the trailing edges, kept in inertial axes.

Prescribed wake: nodes stay where they were shed and drift with the wind. A row carries the
circulation that the trailing edge had when it was shed (Kelvin's theorem, Kutta condition), and
the last row is closed by one that reaches `FAR` metres on, so that a wake of finite length does
not end in an artificial starting vortex.
"""

from dataclasses import dataclass

import numpy as np

from poststall_sim.aero.kernels import grid_edges, grid_velocity
from poststall_sim.aero.lattice import Lattice
from poststall_sim.frames import FloatArray

SINGLE_ROWS = 16
"""Rows behind the trailing edge that are evaluated one by one."""
ROWS_PER_LEVEL = 8
"""Rows of each doubled length after that: a ring is about an eighth of its distance."""
SHORTEST_ROW = 0.1
"""Below this share of a panel the newest row takes the next one in: at rest none pile up."""
OWN_CORE = 1e-5
"""Guard against 0/0 between a surface and its own wake, in chords."""
OTHER_CORE = 0.05
"""Core of wakes and rings of other surfaces, in strip widths."""


@dataclass(frozen=True, slots=True, eq=False)
class Placement:
    """Where geometry axes are: origin_N (3,) [m] and rotation_NG (3, 3), N = origin + R G."""

    origin_N: FloatArray
    rotation_NG: FloatArray

    def to_inertial(self, points_G: FloatArray) -> FloatArray:
        """Return points (..., 3) of geometry axes in N."""
        return self.origin_N + points_G @ self.rotation_NG.T

    def to_geometry(self, points_N: FloatArray) -> FloatArray:
        """Return points (..., 3) of N in geometry axes."""
        return (points_N - self.origin_N) @ self.rotation_NG


@dataclass(frozen=True, slots=True, eq=False)
class Wake:
    """nodes_N (rows + 1, nodes, 3) [m], newest first, and circulation (rows, strips) [m^2/s]."""

    nodes_N: FloatArray
    circulation: FloatArray


def straight(lattice: Lattice, placement: Placement, row_G: FloatArray, rows: int,
             circulation: FloatArray) -> Wake:
    """
    Return a straight wake of equal rows, each displaced by row_G (3,) [m] from the one before.

    circulation : (strips,) of every row; that of the steady solution starts a march in
    equilibrium, zeros start it from rest.
    """
    shift = np.arange(rows + 1)[:, None, None] * row_G
    nodes = placement.to_inertial(lattice.wake_nodes[None] + shift)
    return Wake(nodes, np.tile(circulation, (rows, 1)))


def shed(wake: Wake, lattice: Lattice, placement: Placement, te_circulation: FloatArray,
         drift_N: FloatArray) -> Wake:
    """
    Return the wake one step later.

    All nodes drift by drift_N (3,) [m]; a new row reaches from the trailing edge, now at
    ``placement``, to where it was, with te_circulation (strips,) of the step before. The
    oldest row is dropped.
    """
    nodes = wake.nodes_N + drift_N
    front = placement.to_inertial(lattice.wake_nodes)
    newest = np.linalg.norm(nodes[0] - nodes[1], axis=-1).max()
    panel = lattice.strip_chord.mean() / lattice.grids[0].rows
    if newest < SHORTEST_ROW * panel:
        added = np.linalg.norm(front - nodes[0], axis=-1).max()
        share = added / (added + newest) if added > 0.0 else 0.0
        nodes[0] = front
        circulation = wake.circulation.copy()
        circulation[0] += share * (te_circulation - circulation[0])
        return Wake(nodes, circulation)
    return Wake(np.concatenate([front[None], nodes[:-1]]),
                np.concatenate([te_circulation[None], wake.circulation[:-1]]))


def ladder(rows: int) -> np.ndarray:
    """
    Return the rows at which evaluated rings begin, and the end: single, double, fourfold ...

    Rings grow with their distance, so that the cost rises with the logarithm of the length.
    """
    marks, length = list(range(min(rows, SINGLE_ROWS) + 1)), 2
    while marks[-1] < rows:
        for _ in range(ROWS_PER_LEVEL):
            if marks[-1] < rows:
                marks.append(min(marks[-1] + length, rows))
        length *= 2
    return np.array(marks)


def far_length(lattice: Lattice) -> float:
    """Return how far the closing row reaches [m]: a thousand spans of the whole lattice."""
    return 1000.0 * float(np.ptp(lattice.wake_nodes, axis=0).max())


def velocity(wake: Wake, lattice: Lattice, placement: Placement, marks: np.ndarray,
             points: tuple[FloatArray, ...]) -> tuple[list[FloatArray], list[FloatArray]]:
    """
    Return the velocity that the wake induces, in geometry axes [m/s].

    marks : see `ladder`, or every row. points : (n, 3) per surface [m]. Two lists of (n, 3),
    one entry a surface: from the surface's own wake, and from the wakes of the others.
    """
    nodes = placement.to_geometry(wake.nodes_N[marks])
    along = (nodes[-1] - nodes[0]).mean(axis=0)
    length = np.linalg.norm(along)
    far = along / length if length > 0.0 else np.array([1.0, 0.0, 0.0])
    nodes = np.concatenate([nodes, nodes[-1:] + far_length(lattice) * far])
    sizes = np.diff(marks)[:, None]
    ring = np.add.reduceat(wake.circulation, marks[:-1], axis=0) / sizes
    ring = np.concatenate([ring, wake.circulation[-1:]])
    own = [np.empty_like(p) for p in points]
    other = [np.zeros_like(p) for p in points]
    for s, grid in enumerate(lattice.grids):
        edges = np.empty((7, len(nodes) * (grid.nodes.stop - grid.nodes.start)))
        grid_edges(nodes[:, grid.nodes], ring[:, grid.strips], edges)
        for p, target in enumerate(points):
            out = own[p] if p == s else np.empty_like(target)
            grid_velocity(*edges, grid.nodes.stop - grid.nodes.start, core(lattice, s, p),
                          target, out)
            if p != s:
                other[p] += out
    return own, other


def core(lattice: Lattice, source: int, target: int) -> float:
    """Return the core [m] of a surface's vortices where they meet a surface's points."""
    strips = lattice.grids[source].strips
    if source == target:
        return OWN_CORE * float(lattice.strip_chord[strips].mean())
    return OTHER_CORE * float(lattice.strip_width[strips].mean())
