# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""
Solvers for the decambering: residual in, delta and how it went out.

* `newton`, for the non-local closure: exact Jacobian, which serves for a few more steps by
  Broyden's rule; a step that does not reduce the residual is retried with pseudo-time (J + mu I),
  which tends to the relaxed fixed-point iteration delta <- delta - F / mu and back to Newton as
  the residual falls (Kelley & Keyes, SIAM J. Numer. Anal. 35, 1998).
* `relaxation`, for the local closure: schemes A, B, C and D of the dissertation (section 3.2),
  which move each strip along an assumed trajectory to the lift curve. The robust solver of the
  same closure is in `robust`.
"""

import enum
import math

import numpy as np
from numba import njit

from poststall_sim.aero.decambering import (
    EXACT,
    TWO_PI,
    alpha_slopes,
    faded_mean,
    local_residual,
    nonlocal_jacobian,
    nonlocal_residual,
    operating_points,
    strip_theory,
    wrap,
)
from poststall_sim.aero.flaps import looked_up
from poststall_sim.aero.polars import lift
from poststall_sim.aero.quasi_newton import MOST_STEPS, broyden_step, factor, newton_step


class Scheme(enum.Enum):
    """How the local closure is solved; the non-local one is always solved by Newton."""

    A = 'A'
    B = 'B'
    C = 'C'
    D = 'D'
    ROBUST = 'robust'


class Start(enum.Enum):
    """Where the iteration starts: the given decambering, none, or one iteration of scheme A."""

    GIVEN = 'given'
    ZERO = 'zero'
    SCHEME_A = 'schemeA1'


LARGEST_STEP = math.radians(20.0)
"""No strip's decambering changes by more in one Newton step."""
GAIN = 0.25
"""Broyden's steps go on while each brings the sum of squares down to this share."""


@njit(**EXACT)
def newton(delta, strips, operator, linear, curves, polar_index, mean, tolerance, limit,
           alpha, circulation, speed, residual, history):
    """
    Solve the non-local closure from the given delta; return the iterations used.

    delta : (n,) start, overwritten by the best iterate; strips, operator, linear : see
    `operating_points`; tolerance [rad] on max |F|; limit on the Jacobians evaluated;
    alpha, circulation, speed, residual : (n,) filled at the best iterate; history : (limit + 1,)
    filled with max |F| at the start and after each iteration, which is a Newton step and the
    Broyden steps that its Jacobian serves for.
    """
    n = delta.size
    slope, jacobian, change = np.empty((n, n)), np.empty((n, n)), np.empty(n)
    steps = np.empty((MOST_STEPS, n))
    step = steps[0]
    weights = mean
    if strips[3].min() < 1.0:
        weights = np.empty_like(mean)
        faded_mean(strips, mean, weights)
    strip_theory(delta, strips, linear, curves, polar_index)
    current, trial = delta.copy(), delta.copy()
    operating_points(current, strips, operator, linear, alpha, circulation, speed)
    best = worst = nonlocal_residual(
        current, strips, linear, curves, polar_index, weights, alpha, residual, change)
    square = np.dot(residual, residual)
    history[0] = best
    mu = 0.0
    iterations = 0
    while best > tolerance and iterations < limit:
        iterations += 1
        alpha_slopes(current, strips, operator, linear, circulation, speed, slope)
        while True:
            nonlocal_jacobian(weights, change, slope, jacobian)
            for j in range(n):
                jacobian[j, j] += mu
            factor(jacobian)
            newton_step(jacobian, residual, step)
            largest = np.abs(step).max()
            if largest < 1e6 or mu > 1e6:
                break
            mu = max(4.0 * mu, 0.5)
        scale = min(1.0, LARGEST_STEP / max(largest, 1e-300))
        accepted = False
        for _ in range(3 if mu == 0.0 else 1):
            for j in range(n):
                trial[j] = current[j] + scale * step[j]
            operating_points(trial, strips, operator, linear, alpha, circulation, speed)
            worst = nonlocal_residual(
                trial, strips, linear, curves, polar_index, weights, alpha, residual, change)
            new = np.dot(residual, residual)
            # Under strong pseudo-time the residual may rise on its way round a fold.
            if new < (1.0 - 1e-3 * scale) * square or mu >= 8.0:
                accepted = True
                break
            scale *= 0.5
        full = accepted and mu == 0.0 and scale == 1.0
        if accepted:
            current[:] = trial
            square = new
            mu = mu / 4.0 if mu > 0.1 else 0.0
            count = 1
            while full and worst > tolerance and count < MOST_STEPS:
                broyden_step(jacobian, residual, steps, count)
                for j in range(n):
                    trial[j] = current[j] + steps[count, j]
                operating_points(trial, strips, operator, linear, alpha, circulation, speed)
                worst = nonlocal_residual(
                    trial, strips, linear, curves, polar_index, weights, alpha, residual, change)
                new = np.dot(residual, residual)
                accepted = new < square
                if not accepted:
                    break
                current[:] = trial
                full = new < GAIN * square
                square = new
                count += 1
        else:
            mu = max(4.0 * mu, 0.5)
        if not accepted:
            operating_points(current, strips, operator, linear, alpha, circulation, speed)
            worst = nonlocal_residual(
                current, strips, linear, curves, polar_index, weights, alpha, residual, change)
        if worst < best:
            best = worst
            delta[:] = current
        history[iterations] = best
    if worst > best:   # the last point evaluated is not the best one
        operating_points(delta, strips, operator, linear, alpha, circulation, speed)
        nonlocal_residual(
            delta, strips, linear, curves, polar_index, weights, alpha, residual, change)
    for j in range(n if not linear else 0):     # small angles do not come round
        delta[j] = wrap(delta[j])
    return iterations


SEARCH_STEP = math.radians(0.1)
"""Step of the walk along a trajectory until it crosses the lift curve."""
SEARCH_RANGE = math.radians(90.0)
LARGEST_UPDATE = math.radians(15.0)


@njit(**EXACT)
def _target(j, curve, alpha, strips, cl, sigma):
    """
    Return the change of delta that brings strip j to the nearest crossing of its trajectory.

    The point moves along (alpha + (sigma / 2 pi - 1) x, cl + sigma x); the nearest crossing with
    the curve is walked to in steps and finished by bisection, on the curve itself.
    """
    rate = sigma / TWO_PI - 1.0
    start = cl - lift(curve, looked_up(j, alpha, strips)[0])[0]
    if start == 0.0:
        return 0.0
    step = -math.copysign(SEARCH_STEP, start / sigma)
    low, at_low = 0.0, start
    while abs(low) < SEARCH_RANGE:
        high = low + step
        at_high = cl + sigma * high - lift(
            curve, looked_up(j, alpha + rate * high, strips)[0])[0]
        if at_high * start <= 0.0:
            middle = high
            for _ in range(50):
                share = min(max(at_low / (at_low - at_high), 0.02), 0.98)
                middle = low + share * (high - low)
                at_middle = cl + sigma * middle - lift(
                    curve, looked_up(j, alpha + rate * middle, strips)[0])[0]
                if at_middle * start <= 0.0:
                    high, at_high = middle, at_middle
                else:
                    low, at_low = middle, at_middle
                if abs(at_middle) < 1e-12 or abs(high - low) < 1e-13:
                    break
            return min(max(middle, -LARGEST_UPDATE), LARGEST_UPDATE)
        low, at_low = high, at_high
    return -0.3 * start / sigma


@njit(**EXACT)
def relaxation(delta, strips, operator, linear, curves, polar_index, sigma, secant, damping,
               first_by_a, mirror, tolerance, limit, alpha, circulation, speed, residual, history,
               path):
    """
    Iterate scheme A, B, C or D on the local closure; return the iterations used.

    sigma : (n,) d cl / d delta along each strip's trajectory [1/rad]: 2 pi for A, see
    `superposition.trajectory_slopes` for B and D (equations 3.5, 3.7, 3.11); secant : scheme C,
    whose slopes are those of the first two iterates, the first being one of scheme A (equations
    3.8, 3.9); damping : the under-relaxation D; first_by_a : begin with one iteration of scheme
    A whatever the scheme; mirror : (n,) the strip across the plane of symmetry, its changes
    averaged with the strip's own, or each strip itself; tolerance on max |cl - cl_visc|;
    history : (limit + 1,) and path : (limit + 1, 2 n) filled with max |R| and with the points
    (alpha, cl) of all strips, path may have no rows; the other arguments as for `newton`.
    """
    n = delta.size
    current = delta.copy()
    change = np.zeros(n)
    before = np.empty(n)
    sigma = sigma.copy()
    best = np.inf
    iterations = 0
    while True:
        operating_points(current, strips, operator, linear, alpha, circulation, speed)
        worst = local_residual(
            strips, curves, polar_index, alpha, circulation, speed, residual)
        if secant and iterations == 1:
            for j in range(n):
                cl = 2.0 * circulation[j] / (speed[j] * strips[2, j])
                if change[j] != 0.0:
                    sigma[j] = (cl - before[j]) / change[j]
                if abs(sigma[j]) < 1e-6:
                    sigma[j] = math.copysign(1e-6, sigma[j])
        history[iterations] = worst
        if iterations < path.shape[0]:
            for j in range(n):
                path[iterations, j] = alpha[j]
                path[iterations, n + j] = 2.0 * circulation[j] / (speed[j] * strips[2, j])
        if worst < best:
            best = worst
            delta[:] = current
        # Not finite, or far beyond any lift coefficient: it has run away.
        if not tolerance < worst < 1e6 or iterations == limit:
            break
        by_a = iterations == 0 and (secant or first_by_a)
        iterations += 1
        for j in range(n):
            change[j] = 0.0
            before[j] = 2.0 * circulation[j] / (speed[j] * strips[2, j])
            if strips[7, j] != 0.0:
                change[j] = damping * _target(
                    j, curves[polar_index[j]], alpha[j], strips, before[j],
                    TWO_PI if by_a else sigma[j])
        for j in range(n):
            current[j] += 0.5 * (change[j] + change[mirror[j]])
    operating_points(delta, strips, operator, linear, alpha, circulation, speed)
    local_residual(strips, curves, polar_index, alpha, circulation, speed, residual)
    for j in range(n if not linear else 0):     # small angles do not come round
        delta[j] = wrap(delta[j])
    return iterations
