# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""
Section curves over a full turn from what is known of them near zero incidence.

Each half, alpha >= 0 and alpha <= 0, is put together from three pieces:

* attached: the points given, up to an angle, then levelling off exponentially to a plateau;
* separated: a plate's normal and axial force, fitted to a NACA 0012 (`plate`), or those of a
  wing of finite aspect ratio (`viterna`);
* reversed: a thin section with its sharp edge first, near 180 deg (`reversed_flow`).

The weight that leads from attached to separated is a smoothstep, widened by a Gaussian: the
softness of the stall. Plateau and start of the smoothstep can be solved for, so that the finished
curve meets targets: clmax and either its angle or a given decambering at a given angle.

All angles in radians.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.ndimage import gaussian_filter1d
from scipy.optimize import least_squares

from poststall_sim.aircraft import Airfoil, ConfigError, read_only
from poststall_sim.frames import FloatArray
from poststall_sim.separated_flow import plate, reversed_flow, smoothstep, viterna

STEPS = 3600
"""Of the working grid over half a turn: a twentieth of a degree each, every row is one of them."""
STEP = math.pi / STEPS
PEAK_WITHIN = math.radians(20.0)
"""A stall is looked for within this of zero; a second peak, separated, lies near 45 deg."""
FINE_WITHIN, FINE, COARSE = math.radians(40.0), 10, 20
"""Rows of the finished table: every half degree within 40 deg, every degree beyond."""


@dataclass(frozen=True, slots=True, eq=False)
class Points:
    """
    What is known of a section: alpha (n,) increasing [rad], cl, cd, cm (n,).

    trusted : the lowest and the highest angle to which drag and moment are used [rad].
    """

    alpha: FloatArray
    cl: FloatArray
    cd: FloatArray
    cm: FloatArray
    trusted: tuple[float, float]

    def __post_init__(self) -> None:
        """Refuse points that no curve can begin with."""
        for key in ('alpha', 'cl', 'cd', 'cm'):
            object.__setattr__(self, key, read_only(getattr(self, key)))
        if len(self.alpha) < 5 or not np.all(np.diff(self.alpha) > 0.0):
            raise ConfigError(f'a section needs at least 5 points with rising alpha, got '
                              f'{len(self.alpha)}')
        if not all(np.isfinite(getattr(self, key)).all() for key in ('alpha', 'cl', 'cd', 'cm')):
            raise ConfigError('points of a section must be finite numbers')
        if self.cd.min() < 0.0:
            raise ConfigError(f'cd must not be negative, got {self.cd.min():g}')

    @property
    def upside_down(self) -> 'Points':
        """Return the section upside down: cl and cm odd, cd even."""
        low, high = self.trusted
        return Points(-self.alpha[::-1], -self.cl[::-1], self.cd[::-1], -self.cm[::-1],
                      (-high, -low))

    @property
    def symmetric(self) -> 'Points':
        """Return the mean of it and of the section upside down."""
        other = self.upside_down
        alpha = np.union1d(self.alpha, other.alpha)
        alpha = alpha[np.append(np.diff(alpha) > 1e-9, True)]
        alpha = 0.5 * (alpha - alpha[::-1])
        curves = []
        for key in ('cl', 'cd', 'cm'):
            both = [np.interp(alpha, p.alpha, getattr(p, key), left=np.nan, right=np.nan)
                    for p in (self, other)]
            curves.append(np.nanmean(both, axis=0))
        end = max(abs(each) for each in self.trusted)
        return Points(alpha, *curves, (-end, end))

    @property
    def zero_lift(self) -> float:
        """Return the angle of zero lift within 10 deg of zero [rad]."""
        near = np.abs(self.alpha) <= math.radians(10.0)
        lift = self.cl[near]
        if not near.any() or lift[0] > 0.0 or lift[-1] < 0.0:
            raise ConfigError('cl must rise through zero between -10 and 10 deg')
        return float(np.interp(0.0, lift, self.alpha[near]))


@dataclass(frozen=True, slots=True)
class Stall:
    """
    What the curve has to do on one side of zero incidence; all signs as on the positive side.

    attached_to : the points are taken to this angle; separated_from : the plate alone from this
    one; softness : standard deviation of the Gaussian. clmax with either alpha_clmax or
    decambering, a pair of alpha and d in the linear form, cl(alpha) = 2 pi (alpha - alpha_0L + d):
    targets that are solved for. Without clmax the curve levels off over `levelling` and leaves at
    attached_to.
    """

    attached_to: float
    separated_from: float
    softness: float
    clmax: float | None = None
    alpha_clmax: float | None = None
    decambering: tuple[float, float] | None = None
    levelling: float = math.radians(3.0)

    def __post_init__(self) -> None:
        """Refuse a stall that is none, or asks too much."""
        if not STEP <= self.attached_to < self.separated_from - math.radians(2.0):
            raise ConfigError(
                'a stall needs points on its side of zero incidence and 2 deg at least from there '
                f'to separated flow, got {math.degrees(self.attached_to):g} and '
                f'{math.degrees(self.separated_from):g} deg')
        if self.softness < 0.0:
            raise ConfigError(f'softness must not be negative, got {self.softness!r}')
        if self.clmax is not None and (self.alpha_clmax is None) == (self.decambering is None):
            raise ConfigError('clmax goes with its angle or with a decambering, one of them')


@dataclass(frozen=True, slots=True)
class Separated:
    """
    Flow past stall and from behind.

    cd90 : drag coefficient across the flow, of the section; aspect_ratio : of a wing whose finite
    span is to be in the curves, see `viterna`, None for the section's own; from behind the flow
    is attached within reversed_attached of 180 deg and separated beyond reversed_separated.
    """

    cd90: float = 2.02
    aspect_ratio: float | None = None
    reversed_attached: float = math.radians(6.0)
    reversed_separated: float = math.radians(18.0)


SECTION = Separated()


BEYOND, WIDTH = math.radians(2.0), math.radians(14.0)
"""Of `stall_of` without targets: points are taken so far beyond their stall, and the plate alone
so much later."""
LIFT_LEFT, BEHIND = (0.87, 0.8, 0.93), tuple(math.radians(each) for each in (11.0, 8.0, 15.0))
"""With targets: points are left at this share of clmax, and the plate alone begins so far behind
clmax; the first pair that meets the targets."""


def stall_of(points: Points, *, softness: float, separated: Separated = SECTION,
             clmax: float | None = None, alpha_clmax: float | None = None) -> Stall:
    """
    Return a stall on the positive side for points of which no more is known.

    Without targets, that of the points themselves: they are taken to 2 deg beyond their greatest
    lift, or to their end. Where one target is given the points say the other. Raises `ConfigError`
    where no curve meets the targets.
    """
    end = points.trusted[1]
    inside = (points.alpha >= 0.0) & (points.alpha <= min(end, PEAK_WITHIN) + 0.5 * STEP)
    if not inside.any():
        raise ConfigError('the points of a section must reach both sides of zero incidence')
    alpha, lift = points.alpha[inside], points.cl[inside]
    best = int(np.argmax(lift))
    peak = float(alpha[best])
    if clmax is None and alpha_clmax is None:
        attached_to = min(end, peak + BEYOND)
        return Stall(attached_to, attached_to + WIDTH, softness)
    at = peak if alpha_clmax is None else alpha_clmax
    clmax = float(lift[best]) if clmax is None else clmax
    for share in LIFT_LEFT:
        above = np.flatnonzero(lift >= share * clmax)
        left = min(float(alpha[above[0]]) if above.size else end, end, at - math.radians(1.0))
        for behind in BEHIND:
            try:
                stall = Stall(left, at + behind, softness, clmax=clmax, alpha_clmax=at)
                _half(points, stall, separated)
                return stall
            except ConfigError as error:
                failed = error
    raise failed


@dataclass(frozen=True, slots=True, eq=False)
class Extended:
    """A finished table, and (levelling, start of the blend) [rad] of either side, low and high."""

    airfoil: Airfoil
    solved: tuple[tuple[float, float], tuple[float, float]]


def extend(points: Points, positive: Stall, negative: Stall | None = None, *,
           separated: Separated = SECTION, name: str = 'section',
           reynolds: float | None = None) -> Extended:
    """
    Return the curves over a full turn.

    Without `negative` the section is symmetric: the points' mean with the section upside down is
    extended, and the table is odd and even to the last bit. Raises `ConfigError` where no curve
    meets the targets.
    """
    if negative is None:
        points = points.symmetric
    alpha, upper, high = _half(points, positive, separated)
    lower, low = upper, high
    if negative is not None:
        _, lower, low = _half(points.upside_down, negative, separated)
    spacing = np.where(alpha < FINE_WITHIN + 0.5 * STEP, FINE, COARSE)
    rows = np.flatnonzero(np.arange(STEPS + 1) % spacing == 0)
    cl, cd, cm = (np.concatenate([sign * down[rows][:0:-1], up[rows]])
                  for sign, down, up in zip((-1.0, 1.0, -1.0), lower, upper))
    if negative is None:
        cl[len(rows) - 1] = cm[len(rows) - 1] = 0.0
    # Camber is left out from behind, and both sides meet at 180 deg but for the sign of zero.
    for values in (cl, cd, cm):
        values[0] = values[-1] = 0.5 * (values[0] + values[-1])
    angles = np.concatenate([-alpha[rows][:0:-1], alpha[rows]])
    return Extended(Airfoil(name, angles, cl, cd, cm, reynolds), (low, high))


def _half(points: Points, stall: Stall, separated: Separated,
          ) -> tuple[FloatArray, list[FloatArray], tuple[float, float]]:
    """Return alpha, (cl, cd, cm) from 0 to pi, and what was solved for."""
    alpha = STEP * np.arange(STEPS + 1)
    end = points.trusted[1]
    if stall.attached_to > end + 0.5 * STEP:
        raise ConfigError(f'attached flow to {math.degrees(stall.attached_to):g} deg is asked '
                          f'for, but the points hold to {math.degrees(end):.1f} deg only')
    lift, drag, moment = (np.interp(alpha, points.alpha, values)
                          for values in (points.cl, points.cd, points.cm))
    # Beyond trust drag goes on rising and the moment stays; the blend soon takes over both.
    drag = _level_off(alpha, drag, end, math.radians(20.0))
    moment = _level_off(alpha, moment, end, math.radians(2.0))
    back = reversed_flow(alpha, drag[0])
    back_weight = smoothstep((alpha - math.pi + separated.reversed_separated)
                              / (separated.reversed_separated - separated.reversed_attached))

    def curves(unknowns: FloatArray) -> list[FloatArray]:
        length, begin = unknowns
        attached = _level_off(alpha, lift, stall.attached_to, length), drag, moment
        weight = smoothstep((alpha - begin) / (stall.separated_from - begin))
        if stall.softness > 0.0:
            weight = gaussian_filter1d(weight, stall.softness / STEP, mode='nearest')
        forward = [a + weight * (s - a) for a, s in zip(
            attached, _separated_flow(alpha, separated, attached, stall))]
        return [f + back_weight * (b - f) for f, b in zip(forward, back)]

    unknowns = np.array([stall.levelling, stall.attached_to])
    if stall.clmax is not None:
        unknowns = _solve(alpha, curves, stall, points.zero_lift)
    return alpha, curves(unknowns), (float(unknowns[0]), float(unknowns[1]))


def _solve(alpha: FloatArray, curves: Callable[[FloatArray], list[FloatArray]], stall: Stall,
           zero_lift: float) -> FloatArray:
    """Return levelling and start of the blend with which the curves meet a stall's targets."""
    def misses(unknowns: FloatArray) -> tuple[float, float]:
        cl = curves(unknowns)[0]
        clmax, alpha_clmax = _peak(alpha, cl)
        if stall.decambering is None:
            return clmax - stall.clmax, 0.1 * math.degrees(alpha_clmax - stall.alpha_clmax)
        at, turn = stall.decambering
        return (clmax - stall.clmax,
                np.interp(at, alpha, cl) - 2.0 * math.pi * (at - zero_lift + turn))

    deg = math.radians(1.0)
    begin = stall.alpha_clmax if stall.decambering is None else stall.decambering[0]
    low = (0.3 * deg, stall.attached_to - 4.0 * deg)
    high = (100.0 * deg, stall.separated_from - deg)
    if not low[1] < begin < high[1]:
        raise ConfigError(
            f'the target at {math.degrees(begin):g} deg must lie between '
            f'{math.degrees(low[1]):g} and {math.degrees(high[1]):g} deg, where flow separates')
    # Short lengths first: they keep the drag low until the lift falls.
    for length in (2.0, 5.0, 20.0):
        found = least_squares(
            misses, (length * deg, begin), diff_step=1e-4, x_scale=(5.0 * deg, deg),
            xtol=1e-12, ftol=1e-12, bounds=(low, high))
        if np.abs(found.fun).max() < 1e-5:
            return found.x
    raise ConfigError(
        f'no curve meets clmax {stall.clmax:g} with its other target: the last attempt is off by '
        f'{found.fun[0]:.3f} and {found.fun[1]:.3f}, levelling off over '
        f'{math.degrees(found.x[0]):.2f} deg and leaving at {math.degrees(found.x[1]):.2f} deg')


def _level_off(alpha: FloatArray, values: FloatArray, limit: float, length: float) -> FloatArray:
    """
    Keep `values` up to `limit` and let them run into a plateau beyond, with continuous slope.

        y = y_limit + y'_limit length (1 - exp(-(alpha - limit) / length))

    """
    i = round(limit / STEP)
    ahead = i + 1 if values[i + 1] != values[i] else i   # the points may end here
    slope = (values[ahead] - values[i - 1]) / ((ahead - i + 1) * STEP)
    beyond = np.maximum(alpha - alpha[i], 0.0)
    return np.where(alpha <= alpha[i], values, values[i] - slope * length * np.expm1(
        -beyond / length))


def _peak(alpha: FloatArray, cl: FloatArray) -> tuple[float, float]:
    """Return clmax and its angle, by a parabola through the three highest points."""
    i = int(np.argmax(np.where(alpha < PEAK_WITHIN, cl, -np.inf)))
    i = min(max(i, 1), len(cl) - 2)
    left, mid, right = cl[i - 1:i + 2]
    shift = 0.5 * (left - right) / (left - 2.0 * mid + right)
    return mid - 0.25 * (left - right) * shift, alpha[i] + shift * STEP


def _separated_flow(alpha: FloatArray, separated: Separated, attached: tuple[FloatArray, ...],
                    stall: Stall) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return cl, cd, cm (n,) past stall, the finite wing's from the end of the plateau on."""
    if separated.aspect_ratio is None:
        return plate(alpha, separated.cd90)
    at = stall.alpha_clmax or stall.attached_to
    i = round(at / STEP)
    return viterna(alpha, separated.aspect_ratio, alpha[i], attached[0][i], attached[1][i])
