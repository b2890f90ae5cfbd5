# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""
Solvers for the decambering: residual in, delta and how it went out.

`newton` for the non-local closure: exact Jacobian; a step that does not reduce the residual is
retried with pseudo-time (J + mu I), which tends to the relaxed fixed-point iteration
delta <- delta - F / mu and back to Newton as the residual falls (Kelley & Keyes, SIAM J. Numer.
Anal. 35, 1998). `scheme_d` for the local closure: Paul 2015, section 3.2.4.
"""

import math

import numpy as np
from numba import njit

from poststall_sim.aero.decambering import (
    local_residual,
    nonlocal_residual,
    operating_points,
    wrap,
)
from poststall_sim.aero.polars import section

_EXACT = {'cache': True, 'nogil': True}

LARGEST_STEP = math.radians(20.0)
"""No strip's decambering changes by more in one Newton step."""


@njit(**_EXACT)
def newton(delta, strips, operator, curves, polar_index, mean, tolerance, limit,
           alpha, circulation, speed, residual):
    """
    Solve the non-local closure from the given delta; return the iterations used.

    delta : (n,) start, overwritten by the best iterate; strips, operator : see
    `operating_points`; tolerance [rad] on max |F|; limit on the Jacobians evaluated;
    alpha, circulation, speed, residual : (n,) filled at the best iterate.
    """
    n = delta.size
    slope = np.empty((n, n))
    jacobian = np.empty((n, n))
    trial = delta.copy()
    current = delta.copy()
    operating_points(current, strips, operator, alpha, circulation, speed, slope)
    nonlocal_residual(current, strips, curves, polar_index, mean, alpha, slope, residual, jacobian)
    square = np.dot(residual, residual)
    force = residual.copy()
    best = np.abs(residual).max()
    delta[:] = current
    mu = 0.0
    iterations = 0
    while best > tolerance and iterations < limit:
        iterations += 1
        matrix = jacobian.copy()
        for j in range(n):
            matrix[j, j] += mu
        step = np.linalg.solve(matrix, -force)
        largest = np.abs(step).max()
        if not largest < 1e6:
            mu = max(4.0 * mu, 0.5)
            continue
        scale = min(1.0, LARGEST_STEP / max(largest, 1e-300))
        accepted = False
        for _ in range(3 if mu == 0.0 else 1):
            for j in range(n):
                trial[j] = current[j] + scale * step[j]
            operating_points(trial, strips, operator, alpha, circulation, speed, slope)
            nonlocal_residual(
                trial, strips, curves, polar_index, mean, alpha, slope, residual, jacobian)
            new = np.dot(residual, residual)
            # Under strong pseudo-time the residual may rise on its way round a fold.
            if new < (1.0 - 1e-3 * scale) * square or mu >= 8.0:
                accepted = True
                break
            scale *= 0.5
        if accepted:
            current[:] = trial
            force[:] = residual
            square = new
            worst = np.abs(residual).max()
            if worst < best:
                best = worst
                delta[:] = current
            mu = mu / 4.0 if mu > 0.1 else 0.0
        else:
            mu = max(4.0 * mu, 0.5)
            operating_points(current, strips, operator, alpha, circulation, speed, slope)
            nonlocal_residual(
                current, strips, curves, polar_index, mean, alpha, slope, residual, jacobian)
    operating_points(delta, strips, operator, alpha, circulation, speed, slope)
    nonlocal_residual(delta, strips, curves, polar_index, mean, alpha, slope, residual, jacobian)
    for j in range(n):
        delta[j] = wrap(delta[j])
    return iterations


SEARCH_STEP = math.radians(0.1)
"""Step of the walk along a trajectory until it crosses the lift curve."""
SEARCH_RANGE = math.radians(90.0)
LARGEST_UPDATE = math.radians(15.0)


@njit(**_EXACT)
def _target(curve, alpha, shift, cl, sigma):
    """
    Return the change of delta that brings a strip to the nearest crossing of its trajectory.

    The point moves along (alpha + (sigma / 2 pi - 1) x, cl + sigma x); the nearest crossing with
    the curve is walked to in steps and finished by bisection, on the curve itself.
    """
    out = np.empty(4)
    rate = sigma / (2.0 * math.pi) - 1.0
    section(curve, alpha + shift, out)
    start = cl - out[0]
    if start == 0.0:
        return 0.0
    step = -math.copysign(SEARCH_STEP, start / sigma)
    low = 0.0
    while abs(low) < SEARCH_RANGE:
        high = low + step
        section(curve, alpha + shift + rate * high, out)
        if (cl + sigma * high - out[0]) * start <= 0.0:
            for _ in range(50):
                middle = 0.5 * (low + high)
                section(curve, alpha + shift + rate * middle, out)
                if (cl + sigma * middle - out[0]) * start <= 0.0:
                    high = middle
                else:
                    low = middle
            return min(max(high, -LARGEST_UPDATE), LARGEST_UPDATE)
        low = high
    return -0.3 * start / sigma


@njit(**_EXACT)
def scheme_d(delta, strips, operator, curves, polar_index, sigma, damping, tolerance, limit,
             alpha, circulation, speed, residual):
    """
    Iterate scheme D on the local closure from the given delta; return the iterations used.

    Each strip moves along the trajectory of a uniform change of decambering on all strips,
    whose slope dcl/ddelta is sigma (n,) [1/rad] (Paul 2015, equations 3.10, 3.11), to the
    lift curve; damping is the under-relaxation D. tolerance on max |cl - cl_visc|; the other
    arguments as for `newton`.
    """
    n = delta.size
    slope = np.empty((n, n))
    current = delta.copy()
    best = np.inf
    iterations = 0
    while True:
        operating_points(current, strips, operator, alpha, circulation, speed, slope)
        local_residual(strips, curves, polar_index, alpha, circulation, speed, residual)
        worst = np.abs(residual).max()
        if worst < best:
            best = worst
            delta[:] = current
        if worst <= tolerance or iterations == limit:
            break
        iterations += 1
        for j in range(n):
            if strips[7, j] != 0.0:
                cl = 2.0 * circulation[j] / (speed[j] * strips[2, j])
                current[j] += damping * _target(
                    curves[polar_index[j]], alpha[j], strips[6, j], cl, sigma[j])
    operating_points(delta, strips, operator, alpha, circulation, speed, slope)
    local_residual(strips, curves, polar_index, alpha, circulation, speed, residual)
    for j in range(n):
        delta[j] = wrap(delta[j])
    return iterations
