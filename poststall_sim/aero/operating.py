# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""From an onset to the operating points of all strips: boundary, operator, decambering."""

import math
from dataclasses import dataclass, replace

import numpy as np
from numba import njit
from scipy.linalg import lu_factor, lu_solve

from poststall_sim.aero import continuation, rescue, robust, schemes
from poststall_sim.aero.decambering import (
    EXACT,
    TWO_PI,
    AngleForm,
    Closure,
    alpha_slopes,
    faded_mean,
    nonlocal_jacobian,
    nonlocal_residual,
    operating_points,
    strip_operator,
    wrap,
)
from poststall_sim.aero.flaps import look_up
from poststall_sim.aero.model import Model, Onset, far_normalwash, wake_direction
from poststall_sim.aero.polars import sections
from poststall_sim.aero.schemes import Scheme, Start
from poststall_sim.frames import FloatArray

FADE_BEGIN, FADE_END = math.cos(math.radians(60.0)), math.cos(math.radians(75.0))
"""A strip whose flow leaves the chord by more fades from the lattice into strip theory."""
SLOWEST_SHARE, SLOWEST_SPEED = 0.05, 0.5
"""A strip below this share of the airspeed, or of 0.5 m/s, keeps its decambering."""
ROBUST_LIMIT = 20
"""
Iterations of the robust solver before a flow is left to `rescue`.

On the wing and tail with 26 strips thousands of random flows took 15 at most; on narrow strips it
goes on sweeping for a second and more where the rescue takes a tenth of one.
"""
NEWTON_LIMIT = 40
"""
Iterations of Newton's method before a flow is left to `continuation`.

With the sharpest stall one in a hundred random flows takes more than 12; those that it never
brings home take 10 to 110 on the path.
"""
NO_PATH = np.empty((0, 0))


@dataclass(frozen=True, slots=True, eq=False)
class Boundary:
    """
    The onset at the lattice with controls set.

    level, turned (p,) : w = level cos th + turned sin th; strips (16, n) : see
    `operating_points`; angles (k,) of the movable parts [rad]; pivot (n,) by which all-moving
    parts have turned the strips' chords [rad]; fade (n,).
    """

    level: FloatArray
    turned: FloatArray
    strips: FloatArray
    angles: FloatArray
    pivot: FloatArray

    @property
    def fade(self) -> FloatArray:
        """Share of the lattice in each strip, against strip theory (n,)."""
        return self.strips[3]


def boundary_condition(model: Model, onset: Onset, deflections: FloatArray,
                       angles: FloatArray | None = None) -> Boundary:
    """
    Return the onset of a lattice with its controls deflected (controls,) [rad].

    angles (k,) : of the movable parts [rad], where they are not where the controls put them.
    """
    lattice = model.lattice
    angles = lattice.angles(deflections) if angles is None else angles
    linear = model.settings.angle_form is AngleForm.LINEAR
    level, turned = np.empty(lattice.panels), np.empty(lattice.panels)
    _panels(onset.at(model.collocation_arm), lattice.normal, lattice.tangent,
            angles[:0] if linear else angles, lattice.turn, lattice.slant, level, turned)
    strips = np.empty((16, lattice.strips))
    _along(onset.at(model.quarter_arm), lattice.chord_axis, lattice.strip_normal, strips[0],
           strips[1])
    pivot = angles @ lattice.pivot
    if pivot.any():
        cosine, sine = np.cos(pivot), np.sin(pivot)
        strips[:2] = strips[0] * cosine - strips[1] * sine, strips[1] * cosine + strips[0] * sine
    airspeed = onset.airspeed
    _strips(airspeed, lattice.strip_chord, lattice.zero_lift, angles @ lattice.shift, strips)
    strips[12], strips[14] = lattice.stall_high, lattice.stall_low
    strips[13], strips[15] = lattice.separated_high, lattice.separated_low
    # Attached at any angle; or the local closure, whose search on narrow strips does not find its
    # way where a curve that fades is read at one angle twice.
    if not model.settings.decambering or model.settings.closure is Closure.LOCAL:
        strips[13], strips[15] = math.inf, -math.inf
    if linear:
        # w = V (alpha + theta), V that of a stream along x at zero incidence.
        stream = airspeed * lattice.tangent[:, 0]
        sideways = airspeed * np.cross(lattice.normal, lattice.tangent)[:, 0]
        # Small angles say nothing of a strip that flies backwards: it keeps its decambering.
        strips[7] *= strips[0] > 0.0
        strips[1] = np.arctan2(strips[1], strips[0]) * airspeed * lattice.chord_axis[:, 0]
        strips[0], strips[3] = airspeed * lattice.chord_axis[:, 0], 1.0
        return Boundary(
            stream * (np.arctan2(level, turned) + angles @ lattice.turn)
            - sideways * (angles @ lattice.slant), stream, strips, angles, pivot)
    return Boundary(level, turned, strips, angles, pivot)


@njit(**EXACT)
def _panels(velocity, normal, tangent, angles, turn, slant, level, turned):
    """
    Fill level and turned (p,) by velocities (p, 3) at panels whose parts (k,) have moved.

    The normals slant about the tangents first and turn about the span axes n x t then:
    n' = cos slant (n cos turn + t sin turn) - n x t sin slant. Decambering goes on turning them.
    """
    for i in range(level.size):
        x, y, z = velocity[i, 0], velocity[i, 1], velocity[i, 2]
        a, b, c = normal[i, 0], normal[i, 1], normal[i, 2]
        d, e, f = tangent[i, 0], tangent[i, 1], tangent[i, 2]
        across, along = x * a + y * b + z * c, x * d + y * e + z * f
        about, aslant = 0.0, 0.0
        for k in range(angles.size):
            about += angles[k] * turn[k, i]
            aslant += angles[k] * slant[k, i]
        if about != 0.0:
            cosine, sine = math.cos(about), math.sin(about)
            across, along = across * cosine + along * sine, along * cosine - across * sine
        if aslant != 0.0:
            upright = math.cos(aslant)
            aside = x * (b * f - c * e) + y * (c * d - a * f) + z * (a * e - b * d)
            across, along = upright * across - aside * math.sin(aslant), upright * along
        level[i], turned[i] = across, along


@njit(**EXACT)
def _along(velocity, first, second, one, other):
    """Fill one and other (n,) with the components of velocities (n, 3) along axes (n, 3)."""
    for i in range(one.size):
        one[i] = velocity[i, 0] * first[i, 0] + velocity[i, 1] * first[i, 1] \
            + velocity[i, 2] * first[i, 2]
        other[i] = velocity[i, 0] * second[i, 0] + velocity[i, 1] * second[i, 1] \
            + velocity[i, 2] * second[i, 2]


@njit(**EXACT)
def _strips(airspeed, chord, zero_lift, shift, strips):
    """Fill the rows of `strips` below the components of the onset, see `operating_points`."""
    for j in range(chord.size):
        speed = math.hypot(strips[0, j], strips[1, j])
        ramp = (strips[0, j] / max(speed, 1e-12) - FADE_END) / (FADE_BEGIN - FADE_END)
        ramp = min(max(ramp, 0.0), 1.0)
        strips[2, j] = chord[j]
        strips[3, j] = ramp * ramp * (3.0 - 2.0 * ramp)
        strips[4, j] = zero_lift[j]
        strips[5, j] = zero_lift[j] - shift[j]
        strips[6, j] = shift[j]
        strips[7, j] = speed > SLOWEST_SHARE * max(airspeed, SLOWEST_SPEED)
        strips[8, j], strips[9, j] = math.cos(-shift[j]), math.sin(-shift[j])
        strips[10, j] = max(speed, 1e-12)
        strips[11, j] = math.nan


@dataclass(frozen=True, slots=True, eq=False)
class Operating:
    """Converged (or best) decambering and operating points of all strips."""

    delta: FloatArray
    alpha: FloatArray
    circulation: FloatArray
    speed: FloatArray
    residual: FloatArray
    iterations: int
    history: FloatArray


def decamber(model: Model, boundary: Boundary, operator: FloatArray,
             start: FloatArray, path: FloatArray) -> Operating:
    """
    Return the operating points by the closure in the settings.

    operator (n, 2 n + 1) : see `operating_points`; start (n,) : delta where Start.GIVEN begins;
    path (k, 2 n) : filled with the points (alpha, cl) of the first k iterates of schemes A to D.
    """
    lattice, settings = model.lattice, model.settings
    n = lattice.strips
    linear = settings.angle_form is AngleForm.LINEAR
    alpha, circulation, speed, residual = (np.zeros(n) for _ in range(4))
    delta = np.array(start) if settings.start is Start.GIVEN else np.zeros(n)
    curves = (lattice.curves, lattice.polar_index)
    found = (alpha, circulation, speed, residual)
    history = np.zeros(settings.limit + 1)
    iterations = 0
    if not settings.decambering:
        delta[:] = 0.0
        operating_points(delta, boundary.strips, operator, linear, alpha, circulation, speed)
    elif settings.closure is Closure.NONLOCAL:
        problem = (boundary.strips, operator, linear, *curves)
        iterations = first = schemes.newton(
            delta, *problem, model.mean, settings.tolerance, min(settings.limit, NEWTON_LIMIT),
            *found, history)
        if not np.abs(residual).max() <= settings.tolerance:
            # Near a fold: go round it, on the path from attached flow.
            best = [array.copy() for array in (delta, *found)]
            led, used = continuation.follow(
                np.where(boundary.strips[7] == 0.0, delta, 0.0), *problem, model.mean)
            iterations += used
            if led is not None:
                delta[:] = led
                iterations += schemes.newton(
                    delta, *problem, model.mean, settings.tolerance, settings.limit, *found,
                    np.zeros(settings.limit + 1))
                _keep_better(best, (delta, *found))
            history = np.append(history[:first + 1], np.abs(residual).max())
    elif settings.scheme is Scheme.ROBUST:
        inverse, level = np.empty((n, n)), np.empty((n, n + 1))
        robust.prepare(boundary.strips, operator, linear, inverse, level)
        iterations = first = robust.robust(
            delta, boundary.strips, operator, inverse, level, linear, *curves, lattice.mirror,
            settings.tolerance, min(settings.limit, ROBUST_LIMIT), *found, history)
        if not np.abs(residual).max() <= settings.tolerance:
            best = [array.copy() for array in (delta, *found)]
            delta[:] = start if settings.start is Start.GIVEN else 0.0
            history = np.concatenate([
                history[:first], np.zeros(rescue.DESCENT_LIMIT + rescue.RESCUE_LIMIT + 1)])
            iterations += rescue.rescue(
                delta, boundary.strips, operator, inverse, level, linear, *curves,
                lattice.mirror, model.mean, lattice.strip_chord * lattice.strip_width,
                settings.tolerance, *found, history[first:])
            _keep_better(best, (delta, *found))
    else:
        iterations = schemes.relaxation(
            delta, boundary.strips, operator, linear, *curves,
            model.trajectory[settings.scheme], settings.scheme is Scheme.C, settings.damping,
            settings.start is Start.SCHEME_A,
            lattice.mirror if settings.symmetric else np.arange(n),
            settings.tolerance, settings.limit, *found, history, path)
    return Operating(delta, *found, iterations, history[:iterations + 1])


def lagging(model: Model, boundary: Boundary, operator: FloatArray, solved: Operating,
            before: FloatArray, chords: FloatArray) -> Operating:
    """
    Return the operating points on the way from a decambering (n,) to the one solved for.

    chords (n,) : travelled since. Residual and iterations are those of the solution.
    """
    gone = 1.0 - np.exp(-chords / model.settings.lag)
    delta = before + gone * wrap(solved.delta - before)
    alpha, circulation, speed = (np.empty_like(delta) for _ in range(3))
    operating_points(delta, boundary.strips, operator, False, alpha, circulation, speed)
    return replace(solved, delta=delta, alpha=alpha, circulation=circulation, speed=speed)


def _keep_better(first: list[FloatArray], second: tuple[FloatArray, ...]) -> None:
    """Put the first iterate back into the second's arrays if its residual, the last, is less."""
    if not np.abs(second[-1]).max() <= np.abs(first[-1]).max():
        for kept, array in zip(first, second):
            array[:] = kept


def lattice_operator(model: Model, boundary: Boundary, response: FloatArray,
                     wash: FloatArray) -> FloatArray:
    """Return the map (n, 2 n + 1) from decambering to circulation, see `operating_points`."""
    n = model.lattice.strips
    operator = np.empty((n, 2 * n + 1))
    strip_operator(response, boundary.level, boundary.turned, wash, model.lattice.panel_strip,
                   operator)
    return operator


def normalwash(model: Model, boundary: Boundary, delta: FloatArray) -> FloatArray:
    """Return the onset's normalwash w (p,) on panels turned by delta, controls and camber."""
    theta = delta - model.lattice.zero_lift
    strip = model.lattice.panel_strip
    if model.settings.angle_form is AngleForm.LINEAR:
        return boundary.level + boundary.turned * theta[strip]
    return boundary.level * np.cos(theta)[strip] + boundary.turned * np.sin(theta)[strip]


def with_strip_theory(model: Model, boundary: Boundary, delta: FloatArray,
                  circulation: FloatArray) -> FloatArray:
    """
    Return circulation (p,) with faded strips brought to that of their section alone.

    A plate at theta in a stream U, W carries G = pi c (W cos theta + U sin theta).
    """
    u, w, chord, fade, _, zero = boundary.strips[:6]
    if (fade == 1.0).all():
        return circulation
    theta = delta - zero
    plate = math.pi * chord * (w * np.cos(theta) + u * np.sin(theta))
    strip = model.lattice.panel_strip
    return fade[strip] * circulation \
        + ((1.0 - fade) * plate)[strip] * model.lattice.panel_share


@dataclass(frozen=True, slots=True, eq=False)
class SteadyProblem:
    """
    The decambering of one steady onset, before it is solved.

    strips (16, n), operator (n, 2 n + 1) : see `operating_points`; factors : of the steady matrix;
    direction (3,) of the straight wake.
    """

    boundary: Boundary
    operator: FloatArray
    factors: tuple
    direction: FloatArray


def steady_wake(model: Model, onset: Onset) -> FloatArray:
    """Return the direction (3,) of the straight wakes of the steady problem."""
    return np.array([1.0, 0.0, 0.0]) if model.settings.axial_wake or model.settings.as_avl \
        else wake_direction(onset.velocity_G)


def steady_problem(model: Model, onset: Onset, deflections: FloatArray,
                   angles: FloatArray | None = None) -> SteadyProblem:
    """Return the decambering problem of all surfaces and their straight wakes at once."""
    direction = steady_wake(model, onset)
    far = far_normalwash(model.lattice, direction)
    # A value that is not finite goes through to the status; a step never raises.
    factors = lu_factor(model.bound + far @ model.te_rows, check_finite=False)
    response = lu_solve(factors, model.te_rows.T, trans=1, check_finite=False).T
    boundary = boundary_condition(model, onset, deflections, angles)
    operator = lattice_operator(
        model, boundary, np.ascontiguousarray(response), np.zeros(model.lattice.panels))
    return SteadyProblem(boundary, operator, factors, direction)


def uniqueness(model: Model, problem: SteadyProblem, delta: FloatArray) -> float:
    """
    Return how far a solution stands from a fold: below 0 it may not be the only one.

    Non-local closure: min Re eig(dF/d delta). Local closure: min Re eig(I + W diag(a_v)) with W
    the induced angles and a_v the slopes of the sections' curves; below 0 no relaxation,
    however damped, stays there.
    """
    lattice, n = model.lattice, model.lattice.strips
    strips = problem.boundary.strips
    linear = model.settings.angle_form is AngleForm.LINEAR
    alpha, circulation, speed, residual = (np.empty(n) for _ in range(4))
    slope, jacobian = np.empty((n, n)), np.empty((n, n))
    operating_points(delta, strips, problem.operator, linear, alpha, circulation, speed)
    alpha_slopes(delta, strips, problem.operator, linear, circulation, speed, slope)
    if model.settings.closure is Closure.NONLOCAL:
        change, weights = np.empty(n), np.empty((2, n, n))
        faded_mean(strips, model.mean, weights)
        nonlocal_residual(delta, strips, linear, lattice.curves, lattice.polar_index, weights,
                          alpha, residual, change)
        nonlocal_jacobian(weights, change, slope, jacobian)
    else:
        values = np.empty((n, 4))
        looked_at, left, fall = np.empty((3, n))
        look_up(alpha, strips, looked_at, left, fall)
        sections(lattice.curves, lattice.polar_index, looked_at, values)
        ratio = 0.0 if linear else np.clip(values[:, 0] / TWO_PI, -0.999, 0.999)
        rate = values[:, 3] * (1.0 + strips[6] * fall) / np.sqrt(1.0 - ratio ** 2)
        induced = -np.linalg.solve((np.eye(n) + slope).T, slope.T).T / TWO_PI
        jacobian = np.eye(n) + induced * rate
    if not np.isfinite(jacobian).all():
        return math.nan
    return float(np.linalg.eigvals(jacobian).real.min())
