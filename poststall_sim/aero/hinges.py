# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""
How panels turn with a movable part: about its hinge line, or about the axis that it has.

With h the unit vector of the hinge a small angle turns a normal n by h x n. Along the tangent that
is a turn about the panel's own span axis, n x tangent, by its share of h; what h has along the
tangent slants the normal towards the side, and brings in the flow along the span.
"""

import math

import numpy as np

from poststall_sim.aero import plate
from poststall_sim.aircraft import Surface
from poststall_sim.controls import ACROSS, Movable
from poststall_sim.frames import FloatArray


def turned(part: Movable, surface: Surface, edges: FloatArray, corners: FloatArray,
           normal: FloatArray, tangent: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """
    Return what a part does per unit angle, nose up: to strips (n,), and to panels (rows, n) twice.

    edges (n + 1,) along the span, corners (rows + 1, n + 1, 3), normal and tangent (rows, n, 3) of
    its surface. Strips turn about the quarter chord's direction, by as much as washes alike along
    the chord; panels about their span axes, and slant about their tangents. All is 0 where
    the part is too short, or its axis turns nothing.
    """
    front, rear = corners[0], corners[-1]
    chord = 0.5 * (rear[1:] + rear[:-1] - front[1:] - front[:-1])
    quarter, line = (_unit(np.diff((1.0 - x) * front + x * rear, axis=0))
                     for x in (0.25, part.hinge))
    if part.hinge_axis is not None:
        line = np.array(part.hinge_axis) / math.hypot(*part.hinge_axis) \
            * [1.0, -1.0 if part.side < 0 else 1.0, 1.0]
    covered = _covered(part, surface, edges)
    # With k the normal and c the chord, (h x k) . c over (e x k) . c.
    upright = np.cross(chord, quarter)
    strips = covered * np.sum(np.cross(line, upright) * chord, axis=-1) \
        / np.sum(np.cross(quarter, upright) * chord, axis=-1)
    along = float(strips.sum())
    if abs(along) < ACROSS * covered.sum():
        return np.zeros_like(strips), *np.zeros((2, *normal.shape[:2]))
    # An axis has no sense of its own: a part turns the way that its hinge line would turn it.
    weights = plate.behind(len(normal), part.hinge)[:, None] * covered * np.sign(along)
    return (np.sign(along) * strips, weights * np.sum(line * np.cross(normal, tangent), axis=-1),
            weights * np.sum(line * tangent, axis=-1))


def _covered(part: Movable, surface: Surface, edges: FloatArray) -> FloatArray:
    """Return the share (strips,) of each strip's width that a movable part covers."""
    if surface.symmetric:
        half = 0.5 * edges[-1]
        low, high = sorted(half + part.side * half * share for share in part.span)
    else:
        low, high = (edges[-1] * share for share in part.span)
    share = np.clip(np.minimum(edges[1:], high) - np.maximum(edges[:-1], low), 0.0, None)
    return share / np.diff(edges)


def _unit(vectors: FloatArray) -> FloatArray:
    return vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)
