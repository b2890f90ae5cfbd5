# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""
Solvers for the decambering: residual in, delta and how it went out.

* `newton`, for the non-local closure: exact Jacobian; a step that does not reduce the residual is
  retried with pseudo-time (J + mu I), which tends to the relaxed fixed-point iteration
  delta <- delta - F / mu and back to Newton as the residual falls (Kelley & Keyes, SIAM J.
  Numer. Anal. 35, 1998).
* `relaxation`, for the local closure: schemes A, B, C and D of the dissertation (section 3.2),
  which move each strip along an assumed trajectory to the lift curve.
* `robust`, for the local closure: Newton, and where that fails nonlinear Gauss-Seidel over
  mirrored strips, each moved to the first root met going downhill.
"""

import enum
import math

import numpy as np
from numba import njit

from poststall_sim.aero.decambering import (
    alpha_slopes,
    local_residual,
    nonlocal_jacobian,
    nonlocal_residual,
    operating_points,
    potential_angle,
    strip_theory,
    wrap,
)
from poststall_sim.aero.polars import section

_EXACT = {'cache': True, 'nogil': True}
_SUM = {'cache': True, 'nogil': True, 'error_model': 'numpy',
        'fastmath': {'reassoc', 'contract'}}
TWO_PI = 2.0 * math.pi


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


@njit(**_EXACT)
def newton(delta, strips, operator, linear, curves, polar_index, mean, tolerance, limit,
           alpha, circulation, speed, residual, history):
    """
    Solve the non-local closure from the given delta; return the iterations used.

    delta : (n,) start, overwritten by the best iterate; strips, operator, linear : see
    `operating_points`; tolerance [rad] on max |F|; limit on the Jacobians evaluated;
    alpha, circulation, speed, residual : (n,) filled at the best iterate; history : (limit + 1,)
    filled with max |F| at the start and after each iteration.
    """
    n = delta.size
    slope, jacobian, change = np.empty((n, n)), np.empty((n, n)), np.empty(n)
    strip_theory(delta, strips, linear, curves, polar_index)
    current, trial = delta.copy(), delta.copy()
    operating_points(current, strips, operator, linear, alpha, circulation, speed)
    nonlocal_residual(
        current, strips, linear, curves, polar_index, mean, alpha, residual, change)
    square = np.dot(residual, residual)
    worst = np.abs(residual).max()
    best = worst
    history[0] = best
    mu = 0.0
    iterations = 0
    while best > tolerance and iterations < limit:
        iterations += 1
        alpha_slopes(current, strips, operator, linear, circulation, speed, slope)
        nonlocal_jacobian(strips, mean, change, slope, jacobian)
        while True:
            matrix = jacobian
            if mu > 0.0:
                matrix = jacobian.copy()
                for j in range(n):
                    matrix[j, j] += mu
            step = np.linalg.solve(matrix, -residual)
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
            nonlocal_residual(
                trial, strips, linear, curves, polar_index, mean, alpha, residual, change)
            new = np.dot(residual, residual)
            # Under strong pseudo-time the residual may rise on its way round a fold.
            if new < (1.0 - 1e-3 * scale) * square or mu >= 8.0:
                accepted = True
                break
            scale *= 0.5
        if accepted:
            current[:] = trial
            square = new
            mu = mu / 4.0 if mu > 0.1 else 0.0
        else:
            mu = max(4.0 * mu, 0.5)
            operating_points(current, strips, operator, linear, alpha, circulation, speed)
            nonlocal_residual(
                current, strips, linear, curves, polar_index, mean, alpha, residual, change)
        worst = np.abs(residual).max()
        if worst < best:
            best = worst
            delta[:] = current
        history[iterations] = best
    if worst > best:   # the last point evaluated is not the best one
        operating_points(delta, strips, operator, linear, alpha, circulation, speed)
        nonlocal_residual(
            delta, strips, linear, curves, polar_index, mean, alpha, residual, change)
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
    rate = sigma / TWO_PI - 1.0
    section(curve, alpha + shift, out)
    start = cl - out[0]
    if start == 0.0:
        return 0.0
    step = -math.copysign(SEARCH_STEP, start / sigma)
    low, at_low = 0.0, start
    while abs(low) < SEARCH_RANGE:
        high = low + step
        section(curve, alpha + shift + rate * high, out)
        at_high = cl + sigma * high - out[0]
        if at_high * start <= 0.0:
            middle = high
            for _ in range(50):
                share = min(max(at_low / (at_low - at_high), 0.02), 0.98)
                middle = low + share * (high - low)
                section(curve, alpha + shift + rate * middle, out)
                at_middle = cl + sigma * middle - out[0]
                if at_middle * start <= 0.0:
                    high, at_high = middle, at_middle
                else:
                    low, at_low = middle, at_middle
                if abs(at_middle) < 1e-12 or abs(high - low) < 1e-13:
                    break
            return min(max(middle, -LARGEST_UPDATE), LARGEST_UPDATE)
        low, at_low = high, at_high
    return -0.3 * start / sigma


@njit(**_EXACT)
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
        local_residual(strips, curves, polar_index, alpha, circulation, speed, residual)
        if secant and iterations == 1:
            for j in range(n):
                cl = 2.0 * circulation[j] / (speed[j] * strips[2, j])
                if change[j] != 0.0:
                    sigma[j] = (cl - before[j]) / change[j]
                if abs(sigma[j]) < 1e-6:
                    sigma[j] = math.copysign(1e-6, sigma[j])
        worst = np.abs(residual).max()
        history[iterations] = worst
        if iterations < path.shape[0]:
            for j in range(n):
                path[iterations, j] = alpha[j]
                path[iterations, n + j] = 2.0 * circulation[j] / (speed[j] * strips[2, j])
        if worst < best:
            best = worst
            delta[:] = current
        if not worst > tolerance or iterations == limit:
            break
        by_a = iterations == 0 and (secant or first_by_a)
        iterations += 1
        for j in range(n):
            change[j] = 0.0
            before[j] = 2.0 * circulation[j] / (speed[j] * strips[2, j])
            if strips[7, j] != 0.0:
                change[j] = damping * _target(
                    curves[polar_index[j]], alpha[j], strips[6, j], before[j],
                    TWO_PI if by_a else sigma[j])
        for j in range(n):
            current[j] += 0.5 * (change[j] + change[mirror[j]])
    operating_points(delta, strips, operator, linear, alpha, circulation, speed)
    local_residual(strips, curves, polar_index, alpha, circulation, speed, residual)
    for j in range(n):
        delta[j] = wrap(delta[j])
    return iterations


MOST_SWEEPS = 64
"""Gauss-Seidel sweeps between two trials of Newton, at most: they double while they gain little,
so that the iteration gets through the narrows beside a fold, where Newton would turn it back."""
LEAST_DAMPING = 0.3
"""Sweeps that gain little are damped down to this: the two strips of a pair move at once, and
would else change places for ever where they are neighbours."""
FINISH = 1e-10
"""A solution below the tolerance is brought here by Newton: loose ones are passing states."""


@njit(**_EXACT)
def prepare(strips, operator, linear, inverse, level):
    """
    Fill what `robust` needs of a lattice: its operator solved for the turn of the strips.

    With the angle beta = alpha_geo + th between a strip's flow and its turned chord, the lattice
    reads G = g0' + P' cos beta + Q' sin beta, where P' is small, and

        inverse = Q'^-1 (n, n),   level = Q'^-1 (P', g0') (n, n + 1).

    Strip theory (f < 1) is folded in; in the linear form beta = th, cos = 1 and sin = beta.
    """
    n = strips.shape[1]
    q = np.empty((n, n))
    right = np.empty((n, n + 1))
    for k in range(n):
        c = 1.0 if linear else strips[0, k] / strips[10, k]
        s = 0.0 if linear else strips[1, k] / strips[10, k]
        cs, sn = strips[8, k], -strips[9, k]
        for j in range(n):
            f = strips[3, j]
            a, b = f * operator[j, k], f * operator[j, n + k]
            if j == k and f < 1.0:
                plate = (1.0 - f) * math.pi * strips[2, j]
                a += plate * (strips[1, j] * cs + strips[0, j] * sn)
                b += plate * (strips[0, j] * cs - strips[1, j] * sn)
            right[j, k] = a * c - b * s
            q[j, k] = b * c + a * s
        right[k, n] = strips[3, k] * operator[k, 2 * n]
    for k in range(n):
        if strips[7, k] == 0.0:
            q[k, :] = 0.0
            right[k, :] = 0.0
            q[k, k] = 1.0
    inverse[:] = np.linalg.inv(q)
    level[:] = np.dot(inverse, right)


@njit(**_EXACT)
def _strip(j, alpha, strips, linear, curve, out, value):
    """
    Fill `value` with sin beta, cos beta, q and their slopes over alpha for a strip on its curve.

    On the curve the lattice has to carry q = pi c Ue tan(phi), phi from `potential_angle`, with
    the chord turned by phi - alpha.
    """
    phi, rate = potential_angle(curve, alpha + strips[6, j], linear, out)
    u, w, plate = strips[0, j], strips[1, j], math.pi * strips[2, j]
    turn = rate - 1.0
    the = phi - alpha
    if linear:
        value[0], value[3] = the + strips[5, j] - strips[4, j], turn
        value[1], value[4] = 1.0, 0.0
        value[2], value[5] = plate * u * phi, plate * u * rate
        return
    c, s = math.cos(the), math.sin(the)
    ue, we = u * c - w * s, w * c + u * s
    # beta = alpha_geo + the + shift, and (ue, we) / v are cosine and sine of alpha_geo + the.
    cs, sn, v = strips[8, j], strips[9, j], strips[10, j]
    value[0] = (we * cs + ue * sn) / v
    value[1] = (ue * cs - we * sn) / v
    value[3], value[4] = value[1] * turn, -value[0] * turn
    sine = min(max(out[0] / TWO_PI, -0.999), 0.999)
    tangent = sine / math.sqrt(1.0 - sine * sine)
    value[2] = plate * ue * tangent
    value[5] = plate * ((1.0 + tangent * tangent) * rate * ue - tangent * we * turn)


@njit(**_SUM)
def _imbalance(alpha, strips, linear, curves, polar_index, inverse, level, out, values, residual):
    """Fill E = T q - sin beta - L cos beta - l0, (n,), and the strips' values; return max |E|."""
    n = alpha.size
    for j in range(n):
        _strip(j, alpha[j], strips, linear, curves[polar_index[j]], out, values[j])
    worst = 0.0
    for j in range(n):
        e = -level[j, n] - values[j, 0]
        for k in range(n):
            e += inverse[j, k] * values[k, 2] - level[j, k] * values[k, 1]
        if strips[7, j] == 0.0:
            e = 0.0
        residual[j] = e
        worst = max(worst, abs(e))
    return worst


STEEPEST = 2.5
"""No strip's own balance is steeper: a step of its value over this cannot miss a root."""
SMALLEST_STEP = math.radians(0.25)


@njit(**_SUM)
def _first_root(j, alpha, rest, strips, linear, curve, inverse, level, out, value):
    """
    Return the root of strip j's own balance met first going downhill from alpha.

    rest : what the other strips add. `value` (6,) is left at the root.
    """
    t, small = inverse[j, j], level[j, j]
    _strip(j, alpha, strips, linear, curve, out, value)
    at = t * value[2] - value[0] - small * value[1] + rest
    if at == 0.0:
        return alpha
    sign = math.copysign(1.0, at)
    low, at_low = alpha, at
    for _ in range(400):
        slope = t * value[5] - value[3] - small * value[4]
        step = max(abs(at_low) / STEEPEST, SMALLEST_STEP)
        if slope > 0.3 and abs(at_low) / slope < 0.05:
            step = abs(at_low) / slope * 1.02
        high = low - sign * step
        _strip(j, high, strips, linear, curve, out, value)
        at_high = t * value[2] - value[0] - small * value[1] + rest
        if at_high * sign <= 0.0:
            middle = high
            for _ in range(60):
                if abs(at_high - at_low) < 1e-300:
                    break
                share = min(max(at_low / (at_low - at_high), 0.02), 0.98)
                middle = low + (high - low) * share
                _strip(j, middle, strips, linear, curve, out, value)
                at = t * value[2] - value[0] - small * value[1] + rest
                if abs(at) < 1e-8:
                    break
                if at * sign <= 0.0:
                    high, at_high = middle, at
                else:
                    low, at_low = middle, at
            return middle
        low, at_low = high, at_high
    return low


@njit(**_SUM)
def _rest(j, inverse, level, values):
    """Return what all other strips add to strip j's balance."""
    n = values.shape[0]
    rest = -level[j, n]
    for k in range(n):
        rest += inverse[j, k] * values[k, 2] - level[j, k] * values[k, 1]
    return rest - inverse[j, j] * values[j, 2] + level[j, j] * values[j, 1]


@njit(**_SUM)
def robust(delta, strips, operator, inverse, level, linear, curves, polar_index, mirror, tolerance,
           limit, alpha, circulation, speed, residual, history):
    """
    Solve the local closure from the given delta; return the iterations used.

    The unknowns are the angles at which the sections work, every strip on its own curve
    throughout; what is left is the lattice's balance E, see `_imbalance`. Newton is tried and
    kept if it halves E; else Gauss-Seidel sweeps, each strip to the first root of its
    own balance met going downhill, together with its mirror image, or symmetric flow would grow
    a rolling moment. inverse, level : see `prepare`; tolerance on max |cl - cl_visc|; the other
    arguments as for `newton` and `relaxation`.
    """
    n = delta.size
    values, trial_values = np.empty((n, 6)), np.empty((n, 6))
    force, trial_force = np.empty(n), np.empty(n)
    out = np.empty(4)
    jacobian = np.empty((n, n))
    operating_points(delta, strips, operator, linear, alpha, circulation, speed)
    local_residual(strips, curves, polar_index, alpha, circulation, speed, residual)
    history[0] = np.abs(residual).max()
    current = alpha.copy()
    worst = _imbalance(
        current, strips, linear, curves, polar_index, inverse, level, out, values, force)
    best = worst
    sweeps = 1
    damping = 1.0
    forward = True
    iterations = 0
    while worst > FINISH and iterations < limit:
        iterations += 1
        for j in range(n):
            for k in range(n):
                jacobian[j, k] = inverse[j, k] * values[k, 5] - level[j, k] * values[k, 4]
            jacobian[j, j] -= values[j, 3]
            if strips[7, j] == 0.0:
                jacobian[j, :] = 0.0
                jacobian[j, j] = 1.0
        step = np.linalg.solve(jacobian, -force)
        if np.abs(step).max() < LARGEST_STEP:
            trial = current + step
            new = _imbalance(trial, strips, linear, curves, polar_index, inverse, level, out,
                             trial_values, trial_force)
            if new <= 0.5 * worst:
                current, worst = trial, new
                values, trial_values = trial_values, values
                force, trial_force = trial_force, force
                history[iterations] = worst
                continue
        if worst < 1e-3 * tolerance:    # round-off: no better to be had
            break
        for _ in range(sweeps):
            for i in range(n):
                j = i if forward else n - 1 - i
                m = mirror[j]
                if m < j or strips[7, j] == 0.0:
                    continue
                here, there = _rest(j, inverse, level, values), _rest(m, inverse, level, values)
                root = _first_root(j, current[j], here, strips, linear, curves[polar_index[j]],
                                   inverse, level, out, values[j])
                current[j] += damping * (root - current[j])
                if m != j:
                    root = _first_root(
                        m, current[m], there, strips, linear, curves[polar_index[m]], inverse,
                        level, out, values[m])
                    current[m] += damping * (root - current[m])
                if damping < 1.0:
                    _strip(j, current[j], strips, linear, curves[polar_index[j]], out, values[j])
                    _strip(m, current[m], strips, linear, curves[polar_index[m]], out, values[m])
            forward = not forward
        worst = _imbalance(
            current, strips, linear, curves, polar_index, inverse, level, out, values, force)
        history[iterations] = worst
        if worst < 0.7 * best:
            best = worst
            sweeps = 1
            damping = 1.0
        else:
            sweeps = min(2 * sweeps, MOST_SWEEPS)
            damping = max(0.8 * damping, LEAST_DAMPING)
    for j in range(n):
        if strips[7, j] != 0.0:
            phi = potential_angle(
                curves[polar_index[j]], current[j] + strips[6, j], linear, out)[0]
            delta[j] = wrap(phi - current[j] + strips[5, j])
    operating_points(delta, strips, operator, linear, alpha, circulation, speed)
    local_residual(strips, curves, polar_index, alpha, circulation, speed, residual)
    history[iterations] = np.abs(residual).max()
    return iterations
