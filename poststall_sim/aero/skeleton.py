# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""
Few points of a surface from which a smooth velocity follows at all of its points.

What lies some chords away induces a velocity that varies over a surface as slowly as the
distance is large. It is computed at Chebyshev points of the surface and interpolated by the
polynomial through them, along the span and along the chord of the surface's own grid of rings:
a curved or twisted surface is as straight as any in these. Where its edges have a kink (dihedral,
sweep, taper) the polynomial of one side says nothing of the other, and each side has its own.
"""

import math
from dataclasses import dataclass

import numpy as np

from poststall_sim.aero.lattice import Grid, Lattice
from poststall_sim.frames import FloatArray

PER_CHORD = 1.0
"""Points along the span per mean chord, and `AT_LEAST` on a piece."""
AT_LEAST = 5
ALONG_CHORD = 4
"""With two, what begins `wash.NEAR` away would be wrong by a thousandth."""
KINK = 0.02
"""Turn of an edge [rad] at which a surface is cut into pieces."""
WORTH = 0.3
"""A skeleton of more points than this share of all saves nothing."""


@dataclass(frozen=True, slots=True, eq=False)
class Skeleton:
    """points_G (m, 3) [m], and weights (points felt, m): what is felt is weights @ velocity."""

    points_G: FloatArray
    weights: FloatArray


def skeleton(lattice: Lattice, grid: Grid) -> Skeleton:
    """
    Return the skeleton of a surface, for its collocation points and then its edges' middles.

    Without a point, and with weights (points felt, 0), where there are too few to save any.
    """
    rows, strips = grid.rows, grid.strips.stop - grid.strips.start
    corners = lattice.ring_corners[grid.panels].reshape(rows, strips, 4, 3)
    left = np.concatenate([corners[:, :, 0], corners[-1:, :, 3]])
    right = np.concatenate([corners[:, :, 1], corners[-1:, :, 2]])
    place = np.concatenate([[0.0], np.cumsum(lattice.strip_width[grid.strips])])
    # Strips feel where their flow is tangent, in the middle unless they say otherwise.
    begin, end = (0.5 * (side[0] + side[1]) for side in (left, right))
    across = end - begin
    there = lattice.collocation[grid.panels][:strips] - begin
    share = np.sum(there * across, axis=-1) / np.sum(across ** 2, axis=-1)
    middle = place[:-1] + share * np.diff(place)

    # Where the points are felt: (place along the span, place along the chord in rings). The sides
    # of the last rings are felt as far as the trailing edge, a quarter of a ring from their end.
    at, half = np.arange(rows + 1.0), np.arange(rows) + 0.5
    sides = np.append(half[:-1], rows - 1 + 0.375)
    felt = np.concatenate([
        _table(middle, half), _table(middle, at), _table(place, sides)])
    cuts = _cuts(left, right)
    chord = lattice.strip_chord[grid.strips]
    counts = [max(AT_LEAST, math.ceil(PER_CHORD * (place[end] - place[begin])
                                      / chord[begin:end].mean()))
              for begin, end in zip(cuts, cuts[1:])]
    if ALONG_CHORD * sum(counts) > WORTH * len(felt):
        return Skeleton(np.empty((0, 3)), np.empty((len(felt), 0)))
    along = _chebyshev(ALONG_CHORD, 0.0, float(rows))
    points, weights = [], []
    for begin, end, count in zip(cuts, cuts[1:], counts):
        low, high = place[begin], place[end]
        span = _chebyshev(count, low, high)
        for y, x in _table(span, along):
            points.append(_place(left, right, place, y, x))
        inside = (felt[:, 0] >= low) & ((felt[:, 0] < high) | (end == cuts[-1]))
        product = _lagrange(along, felt[:, 1])[:, :, None] \
            * _lagrange(span, felt[:, 0])[:, None, :]
        weights.append(np.where(inside[:, None], product.reshape(len(felt), -1), 0.0))
    return Skeleton(np.array(points), np.hstack(weights))


def _table(span: FloatArray, chord: FloatArray) -> FloatArray:
    """Return all pairs (n, 2), row by row along the chord, each row along the span."""
    return np.column_stack([np.tile(span, len(chord)), np.repeat(chord, len(span))])


def _cuts(left: FloatArray, right: FloatArray) -> list[int]:
    """Return the strips at which pieces begin, and the end; left, right (rows + 1, strips, 3)."""
    edges = (right - left)[[0, -1]]
    edges = edges / np.linalg.norm(edges, axis=-1, keepdims=True)
    turn = np.linalg.norm(np.diff(edges, axis=1), axis=-1).max(axis=0)
    return [0, *(np.flatnonzero(turn > KINK) + 1).tolist(), left.shape[1]]


def _place(left: FloatArray, right: FloatArray, place: FloatArray, y: float,
           x: float) -> FloatArray:
    """Return the point (3,) of a grid of rings at y along the span, x rings along the chord."""
    j = min(max(int(np.searchsorted(place, y)) - 1, 0), left.shape[1] - 1)
    i = min(int(x), len(left) - 2)
    share = (y - place[j]) / (place[j + 1] - place[j])
    front = (1.0 - share) * left[i, j] + share * right[i, j]
    rear = (1.0 - share) * left[i + 1, j] + share * right[i + 1, j]
    return front + (x - i) * (rear - front)


def _chebyshev(count: int, low: float, high: float) -> FloatArray:
    """Return Chebyshev points of the first kind (count,) between low and high."""
    angle = math.pi * (np.arange(count) + 0.5) / count
    return 0.5 * (low + high) - 0.5 * (high - low) * np.cos(angle)


def _lagrange(nodes: FloatArray, at: FloatArray) -> FloatArray:
    """Return the weights (len(at), len(nodes)) of the polynomial through nodes, at places."""
    weights = np.ones((len(at), len(nodes)))
    for i, node in enumerate(nodes):
        for other in np.delete(nodes, i):
            weights[:, i] *= (at - other) / (node - other)
    return weights
