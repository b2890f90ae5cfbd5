# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""A flat plate and its flap in two-dimensional flow, by the vortices of a lattice's rows."""

import math

import numpy as np

from poststall_sim.frames import FloatArray


def flat_plate_share(rows: int) -> FloatArray:
    """
    Return the circulation (rows,) of the rings of a two-dimensional plate, 1 at the last.

    Rings carry the sum of the bound vortices ahead of them; the vortices at the quarter points
    of equal panels under unit normalwash at the three-quarter points.
    """
    return np.cumsum(plate_vortices(np.ones(rows))) / plate_vortices(np.ones(rows)).sum()


def flap_effectiveness(rows: int, hinge: float) -> float:
    """
    Return the lattice's own two-dimensional flap effectiveness -d(alpha_0L)/d(deflection).

    Panels behind the hinge (share of the chord) turn whole, the panel cut by it by the share
    of its chord behind it. Thin-airfoil theory is approached as rows grow.
    """
    return float(plate_vortices(behind(rows, hinge)).sum()
                 / plate_vortices(np.ones(rows)).sum())


def flap_moment(rows: int, hinge: float) -> float:
    """
    Return the lattice's own dcm/d(deflection) about the quarter chord of a flap [1/rad].

    Of vortices at the quarter points, cm = -2 sum gamma (x - 1/4). Thin-airfoil theory,
    -sin th (1 - cos th)/2 with cos th = 1 - 2 hinge, is approached as rows grow.
    """
    place = (np.arange(rows) + 0.25) / rows
    return float(-2.0 * np.sum(plate_vortices(behind(rows, hinge)) * (place - 0.25)))


def plate_vortices(normalwash: FloatArray) -> FloatArray:
    """Return bound vortices (rows,) of a unit plate that cancel a normalwash (rows,)."""
    rows = len(normalwash)
    place = np.arange(rows) / rows
    distance = (place + 0.75 / rows)[:, None] - (place + 0.25 / rows)[None, :]
    return np.linalg.solve(1.0 / (2.0 * math.pi * distance), normalwash)


def behind(rows: int, hinge: float) -> FloatArray:
    """Return the share (rows,) of each panel's chord that lies behind a hinge."""
    return np.clip(np.arange(1, rows + 1) - hinge * rows, 0.0, 1.0)
