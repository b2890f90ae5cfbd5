# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""
The wake: rows of vortex rings shed at the trailing edges, kept in the air in float64.

Prescribed wake: nodes stay where they were shed and drift with the wind. Free wake: the first
rows also move with what all vortices induce at them. Frozen wake: rows behind the body as it
flew at the start, whatever it does since, as in a linearised model. A row carries the
circulation that the trailing edge had when it was shed (Kelvin's theorem, Kutta condition), and
the last row is closed by one that reaches far on, so that a wake of finite length does not end
in an artificial starting vortex.

Axes A are those of N, carried along by the wind: in them a shed node does not move.
"""

import enum
import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numba import njit

from poststall_sim.aero.history import History
from poststall_sim.aero.lattice import Lattice
from poststall_sim.frames import FloatArray

SHORTEST_ROW = 0.1
"""Below this share of a panel the newest row takes the next one in: at rest none pile up."""
OWN_CORE = 1e-5
"""Guard against 0/0 between a surface and its own wake, in chords."""
EVERY = 8
"""Rows of a wake from one whose drift in uneven air is asked for to the next."""


class Shape(enum.Enum):
    """Where the rows of a wake go once they are shed."""

    PRESCRIBED = 'prescribed'
    FREE = 'free'
    FROZEN = 'frozen'


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
    """
    Rows of nodes and, between each and the next, of rings, the newest first.

    moving_A (m, nodes, 3) [m], moving_rings (m, strips) [m^2/s] : the first rows, which a step
    may still change, the trailing edge among them; settled : where the others are, from slot
    `first` on; rows : of rings, one less than there are of nodes; drift_N (3,) [m] : how far the
    wind has carried A.
    """

    moving_A: FloatArray
    moving_rings: FloatArray
    settled: History
    first: int
    rows: int
    drift_N: FloatArray

    @property
    def settled_A(self) -> FloatArray:
        """The nodes (rows + 1 - m, nodes, 3) that stay where they are."""
        return self.settled.nodes[self.first:self.first + self.rows + 1 - len(self.moving_A)]

    @property
    def nodes_N(self) -> FloatArray:
        """All nodes (rows + 1, nodes, 3) in N [m]: a copy."""
        return np.concatenate([self.moving_A, self.settled_A]) + self.drift_N

    @property
    def circulation(self) -> FloatArray:
        """Circulation (rows, strips) of all rings [m^2/s]: a copy."""
        settled = self.rows - len(self.moving_rings)
        return np.concatenate(
            [self.moving_rings, self.settled.rings[self.first:self.first + settled]])

    def row(self, i: int) -> FloatArray:
        """Return row i of the nodes (nodes, 3) in A [m]."""
        moving = len(self.moving_A)
        return self.moving_A[i] if i < moving else self.settled.nodes[self.first + i - moving]

    def newest_length(self) -> FloatArray:
        """Return the length (nodes,) of the newest row at each of its nodes [m]."""
        found = np.empty(self.moving_A.shape[1])
        _apart(self.moving_A[0], self.row(1), found)
        return found

    def alone(self) -> 'Wake':
        """Return the wake with a store of its own rows and no others."""
        kept = slice(self.first, self.first + len(self.settled_A))
        settled = History(self.settled.nodes[kept], self.settled.rings[kept])
        return replace(self, settled=settled, first=settled.first)

    def carried(self, step_at: Callable[[FloatArray], FloatArray]) -> 'Wake':
        """
        Return the wake with nodes behind the first row displaced by step_at(nodes) [m] in N.

        Asked for every `EVERY`-th row and the last; between them the steps are linear.
        """
        asked = np.array([*range(1, self.rows, EVERY), self.rows])
        moving, before = self.moving_A.copy(), len(self.moving_A)
        first = int(np.searchsorted(asked, before))
        nodes_N = np.concatenate(
            [moving[asked[:first]], self.settled_A[asked[first:] - before]]) + self.drift_N
        step = step_at(nodes_N.reshape(-1, 3)).reshape(nodes_N.shape)
        rings = self.settled.rings[self.first:self.first + len(self.settled_A)]
        settled = History(self.settled_A, rings)
        _carry(moving, settled.nodes[settled.first:], asked, step)
        return Wake(moving, self.moving_rings, settled, settled.first, self.rows, self.drift_N)

    def moved(self, step_N: FloatArray) -> 'Wake':
        """Return the wake with its moving nodes, but the first row, displaced by step_N [m]."""
        return replace(
            self, moving_A=np.concatenate([self.moving_A[:1], self.moving_A[1:] + step_N]))


def straight(lattice: Lattice, placement: Placement, row_G: FloatArray, rows: int,
             circulation: FloatArray, moving: int = 1) -> Wake:
    """
    Return a straight wake of equal rows, each displaced by row_G (3,) [m] from the one before.

    circulation : (strips,) of every row; that of the steady solution starts a march in
    equilibrium, zeros start it from rest. moving : rows of nodes that a step may change.
    """
    shift = np.arange(rows + 1)[:, None, None] * row_G
    nodes = placement.to_inertial(lattice.wake_nodes[None] + shift)
    rings = np.tile(circulation, (rows + 1, 1))
    moving = min(moving, rows)
    settled = History(nodes[moving:], rings[moving:])
    return Wake(nodes[:moving], rings[:moving], settled, settled.first, rows, np.zeros(3))


def shed(wake: Wake, lattice: Lattice, placement: Placement, te_circulation: FloatArray,
         drift_N: FloatArray) -> Wake:
    """
    Return the wake one step later.

    All nodes drift by drift_N (3,) [m]; a new row reaches from the trailing edge, now at
    ``placement``, to where it was, with te_circulation (strips,) of the step before. The
    oldest row is dropped.
    """
    drift = wake.drift_N + drift_N
    front = placement.to_inertial(lattice.wake_nodes) - drift
    before = wake.moving_A[0]
    newest = _farthest(before, wake.row(1))
    if newest < SHORTEST_ROW * lattice.mean_panel:
        added = _farthest(front, before)
        share = added / (added + newest) if added > 0.0 else 0.0
        rings = wake.moving_rings.copy()
        rings[0] += share * (te_circulation - rings[0])
        return replace(wake, moving_A=np.concatenate([front[None], wake.moving_A[1:]]),
                       moving_rings=rings, drift_N=drift)
    settled, first = wake.settled.with_row(
        wake.first, len(wake.settled_A) - 1, wake.moving_A[-1], wake.moving_rings[-1])
    return Wake(np.concatenate([front[None], wake.moving_A[:-1]]),
                np.concatenate([te_circulation[None], wake.moving_rings[:-1]]),
                settled, first, wake.rows, drift)


@njit(cache=True, nogil=True)
def _apart(a, b, out):
    """Fill `out` (n,) with the distances between nodes (n, 3) of two rows."""
    for k in range(a.shape[0]):
        x, y, z = b[k, 0] - a[k, 0], b[k, 1] - a[k, 1], b[k, 2] - a[k, 2]
        out[k] = math.sqrt(x * x + y * y + z * z)


@njit(cache=True, nogil=True)
def _farthest(a, b):
    """Return the greatest distance between nodes (n, 3) of two rows."""
    apart = np.empty(a.shape[0])
    _apart(a, b, apart)
    return apart.max()


@njit(cache=True, nogil=True)
def _carry(moving, settled, asked, step):
    """Add steps (k, n, 3) at asked rows (k,), and between them, to all rows (m, n, 3) of nodes."""
    for k in range(asked.size):
        last = asked[k]
        first = asked[k - 1] if k > 0 else last - 1
        for row in range(first + 1, last + 1):
            share = (row - first) / (last - first)
            nodes = moving[row] if row < moving.shape[0] else settled[row - moving.shape[0]]
            before, after = step[max(k - 1, 0)], step[k]
            for j in range(nodes.shape[0]):
                for c in range(3):
                    nodes[j, c] += before[j, c] + share * (after[j, c] - before[j, c])


@njit(cache=True, nogil=True)
def close(nodes, far):
    """Fill the last row of nodes: the one before, moved on by `far` [m] the way the wake goes."""
    last, width = nodes.shape[0] - 2, nodes.shape[1]
    along = np.zeros(3)
    for k in range(width):
        along += nodes[last, k] - nodes[0, k]
    length = np.sqrt(np.sum(along * along))
    if length > 0.0:
        along *= far / length
    else:
        along[0] = far
    nodes[last + 1] = nodes[last] + along


def far_length(lattice: Lattice) -> float:
    """Return how far the closing row reaches [m]: a thousand spans of the whole lattice."""
    return 1000.0 * float(np.ptp(lattice.wake_nodes, axis=0).max())


def core(lattice: Lattice, source: int, target: int) -> float:
    """Return the core [m] of a surface's vortices where they meet a surface's points."""
    strips = lattice.grids[source].strips
    if source == target:
        return OWN_CORE * float(lattice.strip_chord[strips].mean())
    return lattice.core * float(lattice.strip_width[strips].mean())
