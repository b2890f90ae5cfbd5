# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""
Section curves: cl, cd, cm of the angle of attack, over a full turn, continuous with slope.

The table of an airfoil is interpolated once by PCHIP (monotone between points, so that no
stall is invented) and put on a uniform grid of values and slopes. What is evaluated from then
on, by residuals and loads alike, is the cubic Hermite interpolant of that grid: C1, periodic.
"""

import math
from dataclasses import dataclass

import numpy as np
from numba import njit
from scipy.interpolate import PchipInterpolator
from scipy.optimize import brentq

from poststall_sim.aero.flaps import LEFT
from poststall_sim.aircraft import Airfoil, ConfigError
from poststall_sim.frames import FloatArray

_EXACT = {'cache': True, 'nogil': True, 'error_model': 'numpy'}

GRID = 1440
"""Intervals of the uniform grid over a full turn: a quarter of a degree each."""

_TURN = 1.0 / (2.0 * math.pi)
_STEP, _PER_STEP = 2.0 * math.pi / GRID, GRID / (2.0 * math.pi)

CL, CD, CM = 0, 1, 2
"""Index of a coefficient in a curve."""

NEVER = 1e9
"""An angle past all others [rad], finite so that it can be mixed."""
_NARROWEST = math.radians(1.0)
"""No flap loses its effect within less."""
_ATTACHED = math.radians(30.0)
"""The zero-lift angle and the stall angles are looked for within this of zero."""


@njit(**_EXACT)
def lift(curve, alpha):
    """Return the first coefficient of a curve (k, 2, GRID + 1), cl, and its slope at an angle."""
    if not abs(alpha) < 1e9:     # an iteration that ran away: there is no place in the table
        return math.nan, math.nan
    turns = alpha * _TURN + 0.5
    place = (turns - math.floor(turns)) * GRID
    i = int(place)
    if i == GRID:     # a hair below +180 deg, rounded up
        i -= 1
    t = place - i
    y0, y1, m0, m1 = (
        curve[0, 0, i], curve[0, 0, i + 1], _STEP * curve[0, 1, i], _STEP * curve[0, 1, i + 1])
    a = 2.0 * (y0 - y1) + m0 + m1
    b = 3.0 * (y1 - y0) - 2.0 * m0 - m1
    return y0 + t * (m0 + t * (b + t * a)), (m0 + t * (2.0 * b + 3.0 * t * a)) * _PER_STEP


@njit(**_EXACT)
def section(curve, alpha, out):
    """
    Fill `out` with (cl, cd, cm, dcl/dalpha) at one angle [rad], any angle.

    curve : (3, 2, GRID + 1) values and slopes [1/rad] of cl, cd, cm from -pi to pi.
    """
    out[0], out[3] = lift(curve[0:1], alpha)
    out[1] = lift(curve[1:2], alpha)[0]
    out[2] = lift(curve[2:3], alpha)[0]


@njit(**_EXACT)
def sections(curves, index, alpha, out):
    """
    Fill `out` (n, 4) with `section` of many strips.

    curves : (k, 3, 2, GRID + 1); index : (n,) the curve of each; alpha : (n,) [rad].
    """
    for j in range(alpha.size):
        section(curves[index[j]], alpha[j], out[j])


@dataclass(frozen=True, slots=True, eq=False)
class SectionPolar:
    """
    The curves of one airfoil, or of a mixture of two.

    curve : (3, 2, GRID + 1), see `section`; zero_lift, stall_high, stall_low : angles of zero,
    greatest and least lift in the attached range [rad]; separated_high, separated_low : past
    these, where a quarter of the attached lift is left, `NEVER` if it never is, see `flaps`.
    """

    curve: FloatArray
    zero_lift: float
    stall_high: float
    stall_low: float
    separated_high: float
    separated_low: float

    def at(self, alpha: FloatArray) -> FloatArray:
        """Return cl, cd, cm, dcl/dalpha, (..., 4), at angles [rad]."""
        alpha = np.asarray(alpha, dtype=np.float64)
        out = np.empty((alpha.size, 4))
        sections(self.curve[None], np.zeros(alpha.size, dtype=np.int64), alpha.ravel(), out)
        return out.reshape(alpha.shape + (4,))


def section_polar(airfoil: Airfoil) -> SectionPolar:
    """Return the curves of an airfoil's table."""
    curve = np.empty((3, 2, GRID + 1))
    grid = np.linspace(-math.pi, math.pi, GRID + 1)
    alpha = airfoil.alpha
    # Two intervals from the other end on either side, so that slope is continuous at +-180 deg.
    around = np.concatenate(
        [alpha[-3:-1] - 2.0 * math.pi, alpha, alpha[1:3] + 2.0 * math.pi])
    for c, values in enumerate((airfoil.cl, airfoil.cd, airfoil.cm)):
        pchip = PchipInterpolator(around, np.concatenate([values[-3:-1], values, values[1:3]]))
        curve[c, 0] = pchip(grid)
        curve[c, 1] = pchip(grid, 1)
        curve[c, :, -1] = curve[c, :, 0]
    return _polar(curve, airfoil.name)


def moved(polar: SectionPolar, by: float, cm: float = 0.0) -> SectionPolar:
    """Return the curves at alpha - by [rad], with cm more of the moment."""
    if by == 0.0 and cm == 0.0:
        return polar
    curve = np.empty((3, 2, GRID + 1))
    for c in range(3):
        for i, alpha in enumerate(np.linspace(-math.pi, math.pi, GRID + 1)):
            curve[c, :, i] = lift(polar.curve[c:c + 1], alpha - by)
        curve[c, :, -1] = curve[c, :, 0]
    curve[CM, 0] += cm
    return _polar(curve, 'with its flap down')


def mixture(first: SectionPolar, second: SectionPolar, share: float) -> SectionPolar:
    """Return the curves (1 - share) first + share second, for a strip between two sections."""
    if share == 0.0 or first is second:
        return first
    return _polar((1.0 - share) * first.curve + share * second.curve, 'between two sections')


def _polar(curve: FloatArray, name: str) -> SectionPolar:
    """Return the polar of a curve with its landmarks found on the curve itself."""
    curve.setflags(write=False)
    out = np.empty(4)

    def cl(alpha: float) -> float:
        section(curve, alpha, out)
        return out[0]

    def slope(alpha: float) -> float:
        section(curve, alpha, out)
        return out[3]

    angles = np.linspace(-_ATTACHED, _ATTACHED, 241)
    lift = np.array([cl(a) for a in angles])
    rising = np.flatnonzero((lift[:-1] <= 0.0) & (lift[1:] > 0.0))
    if rising.size == 0:
        raise ConfigError(f'airfoil {name}: cl must rise through zero between -30 and 30 deg')
    i = rising[np.argmin(np.abs(angles[rising]))]
    zero_lift = brentq(cl, angles[i], angles[i + 1], xtol=1e-14)

    def stall(side: int) -> float:
        # From zero lift outwards, to the best lift before it falls by 3 %: further on a
        # separated section may lift more than it did at its stall.
        k = best = i + (side > 0)
        while 0 <= k < len(angles) and side * lift[k] >= 0.97 * side * lift[best]:
            best = k if side * lift[k] > side * lift[best] else best
            k += side
        low, high = angles[max(best - 1, 0)], angles[min(best + 1, len(angles) - 1)]
        if slope(low) * slope(high) < 0.0:
            return brentq(slope, low, high, xtol=1e-12)
        return angles[best]

    def separated(begin: float, side: int) -> float:
        def left(angle: float) -> float:
            return side * (cl(angle) - LEFT * 2.0 * math.pi * math.sin(angle - zero_lift))

        past = begin + side * np.linspace(_NARROWEST, math.pi / 2.0, 361)
        below = np.flatnonzero([left(angle) <= 0.0 for angle in past])
        if not below.size:
            return side * NEVER
        return brentq(left, past[below[0] - 1], past[below[0]], xtol=1e-14) if below[0] \
            else float(past[0])

    high, low = stall(1), stall(-1)
    return SectionPolar(
        curve, zero_lift, high, low, separated(high, 1), separated(low, -1))
