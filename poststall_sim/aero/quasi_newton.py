# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""
One factorised Jacobian for several steps: what Newton's method costs is its linear systems.

LAPACK, as compiled code reaches it here, solves a system and throws its factors away. These are
kept: a further step from them, turned by Broyden's rule, costs a substitution in place of a new
Jacobian, and converges superlinearly (Kelley, Iterative Methods for Linear and Nonlinear
Equations, SIAM 1995, sec. 7.3).
"""

import numpy as np
from numba import njit

_SUM = {'cache': True, 'nogil': True, 'error_model': 'numpy',
        'fastmath': {'reassoc', 'contract'}}

MOST_STEPS = 6
"""Steps from one Jacobian, Newton's included."""


@njit(**_SUM)
def factor(matrix):
    """
    Replace a matrix (n, n) by its factors L (below the diagonal, unit) and U.

    Without pivoting: the Jacobians here are near diagonal ones, and their steps are judged by
    the residual they lead to. A pivot of zero gives steps that are not finite. Two columns at a
    time, so that each row is read half as often, and what is left of a row as an array of its
    own, whose index cannot be negative: asking costs a third of the time.
    """
    n = matrix.shape[0]
    for k in range(0, n - 1, 2):
        inverse = 1.0 / matrix[k, k]
        share = matrix[k + 1, k] * inverse
        matrix[k + 1, k] = share
        upper, lower = matrix[k, k + 1:], matrix[k + 1, k + 1:]
        for j in range(upper.size):
            lower[j] -= share * upper[j]
        beside, below = matrix[k, k + 1], 1.0 / matrix[k + 1, k + 1]
        upper, lower = matrix[k, k + 2:], matrix[k + 1, k + 2:]
        for i in range(k + 2, n):
            first = matrix[i, k] * inverse
            second = (matrix[i, k + 1] - first * beside) * below
            matrix[i, k], matrix[i, k + 1] = first, second
            row = matrix[i, k + 2:]
            for j in range(row.size):
                row[j] -= first * upper[j] + second * lower[j]


@njit(**_SUM)
def newton_step(factors, residual, step):
    """Fill `step` (n,) with -J^-1 residual, the Jacobian being given by its factors."""
    n = residual.size
    for i in range(n):
        total = -residual[i]
        for j in range(i):
            total -= factors[i, j] * step[j]
        step[i] = total
    for i in range(n - 1, -1, -1):
        total = step[i]
        for j in range(i + 1, n):
            total -= factors[i, j] * step[j]
        step[i] = total / factors[i, i]


@njit(**_SUM)
def broyden_step(factors, residual, steps, count):
    """
    Fill row `count` of `steps` (MOST_STEPS, n) with Broyden's step from a residual.

    The rows before it are the steps taken since the Jacobian, the first one Newton's.
    """
    z = steps[count]
    newton_step(factors, residual, z)
    for i in range(count):
        square = np.dot(steps[i], steps[i])
        along = np.dot(steps[i], z) / square
        # The last step's share turns the new step by itself, the earlier ones by their followers.
        follower = steps[i + 1]
        if i + 1 == count:
            along /= 1.0 - along
            follower = z
        for j in range(z.size):
            z[j] += along * follower[j]
