# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""
The non-local closure solved by a path from attached flow, for flows that Newton loses.

Where lift falls steeply the solution over alpha, rates or ell has folds, and Newton, whose
residual has to fall, stops short in front of one. The path

    H = (1 - s) (delta - delta_0) + s F(delta) = 0,   s from 0 to 1,

which with delta_0 = 0 is the closure with a share s of the sections' decambering, is followed by
pseudo-arclength instead (H. B. Keller, in Applications of Bifurcation Theory, 1977): folds are
points like others to it. It has one solution at s = 0, so that it does not come back there, and
no large one at any s, for lift is bounded and the rest of F linear with eigenvalues right of 0
(0.27 and more on the wings of the tests), so that it does not run away: it ends in a solution at
s = 1 (S. N. Chow, J. Mallet-Paret and J. A. Yorke, Math. Comp. 32, 1978). That much is sure in
the linear angle form while no strip flies backwards; the exact form behaves like it. From a wider
mean instead, where a small fin may have several solutions too, a path can be a closed loop.
"""

import numpy as np

from poststall_sim.aero.decambering import (
    alpha_slopes,
    faded_mean,
    nonlocal_jacobian,
    nonlocal_residual,
    operating_points,
)
from poststall_sim.frames import FloatArray

UNIT = 0.1
"""Decambering [rad] that counts along the path as much as all of s."""
LONGEST, SHORTEST = 1.0, 1e-7
"""Steps along the path."""
CLOSE = 1e-9
"""Residual [rad] of a point on the path."""
CORRECTIONS = 6
MOST = 1000
"""Jacobians after which a path is given up; it takes 10 to 80."""


def follow(begin: FloatArray, strips: FloatArray, operator: FloatArray, linear: bool,
           curves: FloatArray, polar_index: np.ndarray,
           mean: FloatArray) -> tuple[FloatArray | None, int]:
    """
    Return the decambering (n,), None if the path was lost, and the Jacobians evaluated.

    begin : (n,) delta_0, kept by strips without flow; the other arguments as for
    `schemes.newton`. Points on the path are (delta / UNIT, s).
    """
    n = begin.size
    weights = np.empty_like(mean)
    faded_mean(strips, mean, weights)

    def linearised(point):
        """Return H (n,) and its derivatives (n, n + 1)."""
        alpha, circulation, speed, residual, change = np.empty((5, n))
        slope, jacobian = np.empty((2, n, n))
        delta, s = UNIT * point[:n], point[n]
        operating_points(delta, strips, operator, linear, alpha, circulation, speed)
        alpha_slopes(delta, strips, operator, linear, circulation, speed, slope)
        nonlocal_residual(delta, strips, linear, curves, polar_index, weights, alpha, residual,
                          change)
        nonlocal_jacobian(weights, change, slope, jacobian)
        return (1.0 - s) * (delta - begin) + s * residual, np.column_stack([
            UNIT * ((1.0 - s) * np.eye(n) + s * jacobian), residual - (delta - begin)])

    onward = np.append(np.zeros(n), 1.0)
    point, tangent, length = np.append(begin / UNIT, 0.0), onward, LONGEST
    _, slopes = linearised(point)
    used = 1
    while used < MOST and length > SHORTEST:
        try:
            # Of the path's two directions the one that goes on, round folds too.
            direction = np.linalg.solve(np.vstack([slopes, tangent]), onward)
            direction /= np.linalg.norm(direction)
            arrives = point[n] + length * direction[n] >= 1.0
            across = onward if arrives else direction
            ahead = point + direction * (
                (1.0 - point[n]) / direction[n] if arrives else length)
            for correction in range(CORRECTIONS):
                residual, there = linearised(ahead)
                used += 1
                found, near = np.abs(residual).max() <= CLOSE, correction <= 2
                if found or not np.linalg.norm(ahead - point) <= 3.0 * length:
                    break
                ahead = ahead + np.linalg.solve(
                    np.vstack([there, across]), np.append(-residual, 0.0))
        except np.linalg.LinAlgError:
            return None, used
        if not found:
            length *= 0.5
            continue
        if arrives:
            return UNIT * ahead[:n], used
        point, tangent, slopes = ahead, direction, there
        length = min(length * (1.6 if near else 0.8), LONGEST)
    return None, used
