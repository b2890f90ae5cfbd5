# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""
A solver of the local closure that does not fail: every strip on its curve, the lattice balanced.

The schemes of the dissertation leave a strip's curve and come back to it; here the unknowns are
the angles at which the sections work, so that each strip is on its curve throughout, and what is
solved is the lattice's balance between them. Newton where it helps, nonlinear Gauss-Seidel over
mirrored strips where it does not.
"""

import math

import numpy as np
from numba import njit

from poststall_sim.aero.decambering import (
    EXACT,
    PER_TWO_PI,
    SUM,
    local_residual,
    operating_points,
    potential_angle,
    strip_theory,
    wrap,
)
from poststall_sim.aero.flaps import looked_up
from poststall_sim.aero.polars import lift
from poststall_sim.aero.quasi_newton import MOST_STEPS, broyden_step, factor, newton_step
from poststall_sim.aero.schemes import LARGEST_STEP

MOST_SWEEPS = 64
"""Gauss-Seidel sweeps between two trials of Newton, at most: they double while they gain little,
so that the iteration gets through the narrows beside a fold, where Newton would turn it back."""
LEAST_DAMPING = 0.3
"""Sweeps that gain little are damped down to this: the two strips of a pair move at once, and
would else change places for ever where they are neighbours."""
GAIN = 0.2
"""A Jacobian serves for Broyden's steps as long as each leaves no more than this share of E."""
FINISH = 1e-10
"""A solution below the tolerance is brought here by Newton: loose ones are passing states."""


@njit(**EXACT)
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


@njit(**EXACT)
def _strip(j, alpha, strips, linear, curve, value):
    """
    Fill `value` with sin beta, cos beta, q and their slopes over alpha for a strip on its curve.

    On the curve the lattice has to carry q = pi c Ue tan(phi), phi of `potential_angle`, here by
    its sine, with the chord turned by phi - alpha.
    """
    angle, gain = looked_up(j, alpha, strips)
    cl, slope = lift(curve, angle)
    slope *= gain
    u, w, plate = strips[0, j], strips[1, j], math.pi * strips[2, j]
    sine, rate = cl * PER_TWO_PI, slope * PER_TWO_PI
    if linear:
        value[0], value[3] = sine - alpha + strips[5, j] - strips[4, j], rate - 1.0
        value[1], value[4] = 1.0, 0.0
        value[2], value[5] = plate * u * sine, plate * u * rate
        return
    if abs(sine) > 0.999:
        sine = math.copysign(0.999, sine)
    cosine = math.sqrt(1.0 - sine * sine)
    rate /= cosine
    turn = rate - 1.0
    ca, sa = math.cos(alpha), math.sin(alpha)
    c, s = cosine * ca + sine * sa, sine * ca - cosine * sa     # of phi - alpha
    ue, we = u * c - w * s, w * c + u * s
    # beta = alpha_geo + phi - alpha + shift; (ue, we) / v : cosine and sine of it without shift.
    cs, sn, v = strips[8, j], strips[9, j], 1.0 / strips[10, j]
    value[0] = (we * cs + ue * sn) * v
    value[1] = (ue * cs - we * sn) * v
    value[3], value[4] = value[1] * turn, -value[0] * turn
    tangent = sine / cosine
    value[2] = plate * ue * tangent
    value[5] = plate * ((1.0 + tangent * tangent) * rate * ue - tangent * we * turn)


@njit(**EXACT)
def hold(delta, strips, linear, values):
    """
    Fill the values (n, 6) of strips without flow, which keep their decambering.

    Their row of Q' is the identity, so what they 'carry' is the sine they are held at.
    """
    for j in range(delta.size):
        if strips[7, j] == 0.0:
            th = delta[j] - strips[4, j]
            beta = th if linear else th + math.atan2(strips[1, j], strips[0, j])
            values[j, 0] = beta if linear else math.sin(beta)
            values[j, 1] = 1.0 if linear else math.cos(beta)
            values[j, 2] = values[j, 0]
            values[j, 3:] = 0.0


@njit(**SUM)
def imbalance(alpha, strips, linear, curves, polar_index, inverse, level, values, residual):
    """Fill E = T q - sin beta - L cos beta - l0, (n,), and the strips' values; return max |E|."""
    n = alpha.size
    for j in range(n):
        if strips[7, j] != 0.0:
            _strip(j, alpha[j], strips, linear, curves[polar_index[j]], values[j])
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


NEWTON_RANGE = 0.05
"""Imbalance [rad] from which on Newton is worth a trial."""
ROUGH = 1e-3
"""Imbalance [rad] that a strip is left with in a sweep: Newton finishes."""
LEAST_COSINE = 0.05
"""A strip is not turned further across its flow: beyond 90 deg its balance has false roots."""
STEEPEST = 2.5
"""No strip's own balance is steeper: a step of its value over this cannot miss a root."""
SMALLEST_STEP = math.radians(0.25)


@njit(**SUM)
def _first_root(j, alpha, rest, strips, linear, curve, inverse, level, value):
    """
    Return the root of strip j's own balance met first going downhill from alpha.

    rest : what the other strips add. `value` (6,) is left at the root.
    """
    t, small = inverse[j, j], level[j, j]
    _strip(j, alpha, strips, linear, curve, value)
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
        _strip(j, high, strips, linear, curve, value)
        if value[1] < LEAST_COSINE:
            break
        at_high = t * value[2] - value[0] - small * value[1] + rest
        if at_high * sign <= 0.0:
            middle = high
            for _ in range(60):
                if abs(at_high - at_low) < 1e-300:
                    break
                share = min(max(at_low / (at_low - at_high), 0.02), 0.98)
                middle = low + (high - low) * share
                _strip(j, middle, strips, linear, curve, value)
                at = t * value[2] - value[0] - small * value[1] + rest
                if abs(at) < ROUGH:
                    break
                if at * sign <= 0.0:
                    high, at_high = middle, at
                else:
                    low, at_low = middle, at
            return middle
        low, at_low = high, at_high
    _strip(j, low, strips, linear, curve, value)
    return low


@njit(**SUM)
def _rest(j, inverse, level, values):
    """Return what all other strips add to strip j's balance."""
    n = values.shape[0]
    rest = -level[j, n]
    for k in range(n):
        rest += inverse[j, k] * values[k, 2] - level[j, k] * values[k, 1]
    return rest - inverse[j, j] * values[j, 2] + level[j, j] * values[j, 1]


@njit(**EXACT)
def forward_flow(values, strips):
    """
    Tell whether the flow along every turned chord is forward, see `LEAST_COSINE`.

    That flow is Ue; beta, with its sine and cosine in `values`, leads it by the flap's shift, and
    where Ue is reversed a balance is no solution whatever beta is.
    """
    for j in range(values.shape[0]):
        along = values[j, 1] * strips[8, j] + values[j, 0] * strips[9, j]
        if strips[7, j] != 0.0 and along < LEAST_COSINE:
            return False
    return True


@njit(**EXACT)
def settle(current, delta, strips, operator, linear, curves, polar_index, alpha, circulation,
           speed, residual):
    """
    Put strips at the decambering of working at angles (n,) on their curves; return max |residual|.

    Strips without flow keep theirs; the other arguments as for `robust`.
    """
    for j in range(delta.size):
        if strips[7, j] != 0.0:
            phi = potential_angle(
                curves[polar_index[j]], looked_up(j, current[j], strips)[0], linear)[0]
            delta[j] = phi - current[j] + strips[5, j]
            if not linear:
                delta[j] = wrap(delta[j])
    operating_points(delta, strips, operator, linear, alpha, circulation, speed)
    return local_residual(strips, curves, polar_index, alpha, circulation, speed, residual)


@njit(**SUM)
def robust(delta, strips, operator, inverse, level, linear, curves, polar_index, mirror, tolerance,
           limit, alpha, circulation, speed, residual, history):
    """
    Solve the local closure from the given delta; return the iterations used.

    The unknowns are the angles at which the sections work, every strip on its own curve
    throughout; what is left is the lattice's balance E, see `imbalance`. Newton is tried and
    kept if it halves E; else Gauss-Seidel sweeps, each strip to the first root of its
    own balance met going downhill, together with its mirror image, or symmetric flow would grow
    a rolling moment. inverse, level : see `prepare`; tolerance on max |cl - cl_visc|; the other
    arguments as for `newton` and `relaxation`.
    """
    n = delta.size
    values, trial_values = np.empty((n, 6)), np.empty((n, 6))
    force, trial_force = np.empty(n), np.empty(n)
    jacobian, steps = np.empty((n, n)), np.empty((MOST_STEPS, n))
    strip_theory(delta, strips, linear, curves, polar_index)
    operating_points(delta, strips, operator, linear, alpha, circulation, speed)
    history[0] = local_residual(
        strips, curves, polar_index, alpha, circulation, speed, residual)
    if history[0] <= 1e-3 * tolerance:
        return 0
    current = alpha.copy()
    hold(delta, strips, linear, values)
    hold(delta, strips, linear, trial_values)
    worst = imbalance(
        current, strips, linear, curves, polar_index, inverse, level, values, force)
    best = worst
    sweeps = 1
    damping = 1.0
    forward = True
    iterations = 0
    while worst > FINISH and iterations < limit:
        iterations += 1
        if worst < NEWTON_RANGE or sweeps > 1:
            for j in range(n):
                for k in range(n):
                    jacobian[j, k] = inverse[j, k] * values[k, 5] - level[j, k] * values[k, 4]
                jacobian[j, j] -= values[j, 3]
                if strips[7, j] == 0.0:
                    jacobian[j, :] = 0.0
                    jacobian[j, j] = 1.0
            factor(jacobian)
            newton_step(jacobian, force, steps[0])
            count, gain = 0, 0.5
            while np.abs(steps[count]).max() < LARGEST_STEP:
                trial = current + steps[count]
                new = imbalance(trial, strips, linear, curves, polar_index, inverse, level,
                                 trial_values, trial_force)
                if not (new <= gain * worst
                        and (linear or forward_flow(trial_values, strips))):
                    break
                current, worst = trial, new
                values, trial_values = trial_values, values
                force, trial_force = trial_force, force
                count, gain = count + 1, GAIN
                if worst <= FINISH or count == MOST_STEPS:
                    break
                broyden_step(jacobian, force, steps, count)
            if count > 0:
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
                                   inverse, level, values[j])
                current[j] += damping * (root - current[j])
                if m != j:
                    root = _first_root(
                        m, current[m], there, strips, linear, curves[polar_index[m]], inverse,
                        level, values[m])
                    current[m] += damping * (root - current[m])
                if damping < 1.0:
                    _strip(j, current[j], strips, linear, curves[polar_index[j]], values[j])
                    _strip(m, current[m], strips, linear, curves[polar_index[m]], values[m])
            forward = not forward
        worst = imbalance(
            current, strips, linear, curves, polar_index, inverse, level, values, force)
        history[iterations] = worst
        if worst < 0.7 * best:
            best = worst
            sweeps = 1
            damping = 1.0
        else:
            sweeps = min(2 * sweeps, MOST_SWEEPS)
            damping = max(0.8 * damping, LEAST_DAMPING)
    history[iterations] = settle(current, delta, strips, operator, linear, curves, polar_index,
                                 alpha, circulation, speed, residual)
    return iterations
