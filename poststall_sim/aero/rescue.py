# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""
What brings home the flows that `robust` loses: strips much narrower than their chord.

There the lift of one strip turns its own flow by more than a radian per unit of cl, so that a
strip moved alone, with its neighbours' lift held, swings into reversed flow. Here all strips move
at once. In the linear form the balance is the gradient of an energy, but for unequal strips and
sweep, and going down it ends at a solution. In the exact form the energy has no lowest point: lift
falls from 30 deg on, and the strips that give way would have to turn beyond 90 deg, where nothing
holds them. The solutions there are saddles, which least squares finds; where it stalls, a few
strips are off, and only those and their neighbours are scattered anew. Both ways begin at the
smooth solution of the non-local closure, which is right already where nothing is stalled.
"""

import math

import numpy as np
from numba import njit

from poststall_sim.aero.decambering import (
    EXACT,
    SUM,
    operating_points,
    potential_angle,
    strip_theory,
)
from poststall_sim.aero.flaps import looked_up
from poststall_sim.aero.robust import FINISH, forward_flow, hold, imbalance, settle
from poststall_sim.aero.schemes import newton

SMOOTH, SMOOTH_LIMIT = 1e-6, 50
"""Tolerance [rad] and limit of the non-local solution that is the start."""
DESCENT_LIMIT = 400
"""Steps down the energy; about half of them were used by the slowest flow on 104 strips."""
RESCUE_LIMIT = 60000
"""
Jacobians in all: some fifteen seconds on 104 strips, where they are used up.

Three in a hundred flows with exact angles on 80 and 104 strips of the wing and tail take more
than 1000, one in a thousand or two more than 6000, one in 16000 more than 20000: a search at
random, in which each further 5000 leave a third of those that are left.
"""
LONGEST_STEP = 0.5
"""No strip is turned further [rad] by one step down the energy."""
BENT = 0.9
"""Share of a step's inertia that the bend of the curves may take; below 1 it still descends."""
LITTLE, PATIENCE, MOST_STEPS = 0.15, 4, 200
"""Least squares stalls after PATIENCE steps in a row that gain less than this share of E^2."""
SCATTER = (0.05, 0.1, 0.2, 0.4, 0.8, 1.2)
"""Largest turns [rad] of scattered strips, in turn."""
REACH = (3, 3, 3, 3, 9)
"""Neighbours on each side that are scattered with a strip, in turn."""
AFRESH = 300
"""Jacobians after which the search begins again."""
ANEW = (0.1, 0.2, 0.1, 0.4)
"""How far it scatters its start [rad], in turn: near a fold a little always leads back to it."""
POWER = 3
"""Of the roots of the areas that weight the strips, in every other search from the start."""
WORST = 8
"""Every other time one of this many strips is scattered, not always the worst."""


@njit(**SUM)
def _descend(alpha, strips, curves, polar_index, inverse, area, image, force, history):
    """
    Go down the energy in the linear form, `alpha` and its imbalance `force` (n,) in place.

    With phi = cl / 2 pi the balance is E = C phi + alpha + constant, C = T pi c U - I, and
    C^-1 E the energy's gradient in the mean over the wing's area. The gradient flow is followed
    by implicit steps of 1/mu,

        (I + C (phi' + mu)) step = -E,

    kept where they begin downhill and where the curves' bend takes no more than `BENT` of
    mu step^2, so that they end downhill too. Returns the steps.
    """
    n = alpha.size
    phi, rate, bend = np.zeros(n), np.zeros(n), np.zeros(n)
    new_phi, new_rate = np.zeros(n), np.zeros(n)
    c, matrix = np.zeros((n, n)), np.empty((n, n))
    for j in range(n):
        if strips[7, j] == 0.0:     # keeps its decambering: out of the system
            c[j, j] = 1.0
            continue
        for k in range(n):
            if strips[7, k] != 0.0:
                c[j, k] = inverse[j, k] * math.pi * strips[2, k] * strips[0, k]
        c[j, j] -= 1.0
        angle, gain = looked_up(j, alpha[j], strips)
        phi[j], rate[j] = potential_angle(curves[polar_index[j]], angle, True)
        rate[j] *= gain
    gradient = np.linalg.solve(c, force)
    mu = 1.0
    for steps in range(DESCENT_LIMIT):
        history[steps] = np.abs(force).max()
        if history[steps] <= FINISH:
            return steps
        while mu < 1e6:
            for j in range(n):
                for k in range(n):
                    matrix[j, k] = c[j, k] * (rate[k] + mu)
                matrix[j, j] += 1.0
            step = np.linalg.solve(matrix, -force)
            step = 0.5 * (step + step[image])
            if np.sum(area * gradient * step) < 0.0 and np.abs(step).max() < LONGEST_STEP:
                for j in range(n):
                    if strips[7, j] != 0.0:
                        angle, gain = looked_up(j, alpha[j] + step[j], strips)
                        new_phi[j], new_rate[j] = potential_angle(
                            curves[polar_index[j]], angle, True)
                        new_rate[j] *= gain
                        bend[j] = new_phi[j] - phi[j] - rate[j] * step[j]
                share = np.sum(area * bend * step) / (mu * np.sum(area * step * step))
                if share <= BENT:
                    break
            mu *= 2.5
        else:
            return steps
        gradient = bend - mu * step
        force += step + np.dot(c, new_phi - phi)
        alpha += step
        phi[:], rate[:] = new_phi, new_rate
        mu = max(mu * (0.4 if share < 0.3 * BENT else 0.9), 1e-7)
    return DESCENT_LIMIT


@njit(**SUM)
def _fit(alpha, strips, linear, curves, polar_index, inverse, level, root, image, values, force,
         limit):
    """
    Least squares on the imbalance E by Levenberg and Marquardt, `alpha` in place.

    root (n,) of the strips' areas: narrow strips at a tip, whose angles are turned furthest, would
    count for more than all others. values (n, 6), force (n,) : filled at the end, the latter with
    root E. Returns Jacobians used, max |E| and the sum of squares, both infinite where, with exact
    angles, a strip is left turned across its flow.
    """
    n = alpha.size
    jacobian = np.empty((n, n))
    trial_values, trial_force = values.copy(), np.empty(n)
    worst = imbalance(
        alpha, strips, linear, curves, polar_index, inverse, level, values, force)
    force *= root
    square = np.dot(force, force)
    if not linear and not forward_flow(values, strips):
        worst = square = np.inf
    mu = 1e-3
    slow = used = 0
    while worst > FINISH and slow < PATIENCE and used < limit:
        used += 1
        for j in range(n):
            for k in range(n):
                jacobian[j, k] = inverse[j, k] * values[k, 5] - level[j, k] * values[k, 4]
            jacobian[j, j] -= values[j, 3]
            if strips[7, j] == 0.0:
                jacobian[j, :] = 0.0
                jacobian[j, j] = 1.0
            jacobian[j, :] *= root[j]
        normal = np.dot(jacobian.T, jacobian)
        right = np.dot(jacobian.T, force)
        before = square
        for _ in range(5):
            matrix = normal.copy()
            for j in range(n):
                matrix[j, j] += mu
            trial = alpha - np.linalg.solve(matrix, right)
            trial = 0.5 * (trial + trial[image])
            new = imbalance(trial, strips, linear, curves, polar_index, inverse, level,
                             trial_values, trial_force)
            trial_force *= root
            new_square = np.dot(trial_force, trial_force)
            if new_square < square and (linear or forward_flow(trial_values, strips)):
                alpha[:], worst, square = trial, new, new_square
                values[:], force[:] = trial_values, trial_force
                mu = max(0.2 * mu, 1e-12)
                break
            mu *= 20.0
        if square == before:
            break
        slow = slow + 1 if square > (1.0 - LITTLE) * before else 0
    return used, worst, square


@njit(**EXACT)
def _draw(seed):
    """Return the next number of Park and Miller's generator, and it as a share in -1..1."""
    seed = 16807 * seed % 2147483647
    return seed, 2.0 * seed / 2147483647.0 - 1.0


@njit(**SUM)
def _search(alpha, delta, strips, linear, curves, polar_index, inverse, level, root, image,
            enough, history):
    """
    Fit, scatter what is off, fit again: keep the better, `alpha` in place; return Jacobians.

    The numbers are the same ones every time. enough : max |E| of a solution.
    """
    n = alpha.size
    start, current = alpha.copy(), alpha.copy()
    values, force, trial_force = np.empty((n, 6)), np.empty(n), np.empty(n)
    hold(delta, strips, linear, values)
    used, best, seed, draws, rounds = 0, np.inf, 1, 0, 0
    while used < RESCUE_LIMIT:
        current[:] = start
        # A flow that is hard by one measure of the strips is easy by another.
        measure = root if rounds % 2 == 0 else root ** POWER
        rounds += 1
        if used > 0:
            for j in range(n):
                if j <= image[j]:
                    seed, share = _draw(seed)
                    current[j] += ANEW[rounds % len(ANEW)] * share
                    current[image[j]] = current[j]
        more, worst, square = _fit(
            current, strips, linear, curves, polar_index, inverse, level, measure, image,
            values, force, min(MOST_STEPS, RESCUE_LIMIT - used))
        end = min(used + AFRESH, RESCUE_LIMIT)
        history[used:used + more] = min(best, worst)
        # At least one even where the first try did not move, so that the search ends.
        used += max(more, 1)
        while worst > enough and used < end:
            order = np.argsort(-np.abs(force))
            j = order[0 if draws % 2 == 0 else draws // 2 % min(WORST, n)]
            trial = current.copy()
            reach = REACH[draws // len(SCATTER) % len(REACH)]
            for k in range(max(j - reach, 0), min(j + reach + 1, n)):
                seed, share = _draw(seed)
                trial[k] = current[k] + SCATTER[draws % len(SCATTER)] * share
                trial[image[k]] = trial[k]
            draws += 1
            more, new, new_square = _fit(
                trial, strips, linear, curves, polar_index, inverse, level, measure, image,
                values, trial_force, min(MOST_STEPS, RESCUE_LIMIT - used))
            if new_square < square:
                current[:], worst, square = trial, new, new_square
                force[:] = trial_force
            history[used:used + more] = min(best, worst)
            used += max(more, 1)
        if worst < best:
            best = worst
            alpha[:] = current
        if best <= enough:
            break
    return min(used, RESCUE_LIMIT)


@njit(**SUM)
def rescue(delta, strips, operator, inverse, level, linear, curves, polar_index, mirror, mean,
           area, tolerance, alpha, circulation, speed, residual, history):
    """
    Solve the local closure from the given delta, at any price up to a bound; return iterations.

    mean (2, n, n) : see `decambering.averaging`; area (n,) of the strips; history :
    (DESCENT_LIMIT + RESCUE_LIMIT + 1,) filled with the imbalance, in the end with the residual;
    the other arguments as for `robust.robust`. Where the start is symmetric, so is what is found.
    """
    n = delta.size
    strip_theory(delta, strips, linear, curves, polar_index)
    operating_points(delta, strips, operator, linear, alpha, circulation, speed)
    image = np.arange(n)
    if np.abs(alpha - alpha[mirror]).max() < 1e-9:
        image[:] = mirror
    enough = 1e-3 * tolerance
    current = alpha.copy()
    iterations = 0
    if np.isfinite(alpha).all():
        newton(delta, strips, operator, linear, curves, polar_index, mean, SMOOTH, SMOOTH_LIMIT,
               alpha, circulation, speed, residual, np.empty(SMOOTH_LIMIT + 1))
        start = 0.5 * (alpha + alpha[image])
        current = start.copy()
        values, force = np.empty((n, 6)), np.empty(n)
        hold(delta, strips, linear, values)
        worst = imbalance(
            current, strips, linear, curves, polar_index, inverse, level, values, force)
        if linear:
            iterations = _descend(
                current, strips, curves, polar_index, inverse, area, image, force, history)
            worst = imbalance(
                current, strips, linear, curves, polar_index, inverse, level, values, force)
        if not linear or worst > enough:
            current = start
            iterations += _search(
                current, delta, strips, linear, curves, polar_index, inverse, level,
                np.sqrt(area / area.mean()), image, enough, history[iterations:])
    history[iterations] = settle(current, delta, strips, operator, linear, curves, polar_index,
                                 alpha, circulation, speed, residual)
    return iterations
