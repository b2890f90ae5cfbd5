# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""
Decambering: the two closures that say how stall turns a strip's boundary condition.

Each strip has one extra unknown, the decambering angle delta, which turns its normals in the
onset flow (R. C. Paul, Low-Order Post-Stall Aerodynamics Modeling, NC State University, 2015,
chapter 2). From the strip's circulation follows the angle at which its section works; a closure
asks that this point and the section's curve agree:

* LOCAL, the dissertation's: ``cl_j = cl_visc,j(alpha_j)`` on every strip. Past stall it has many
  solutions, most of them saw-toothed along the span.
* NONLOCAL, the default: delta_j is the section's own two-dimensional decambering, read at the
  mean of the operating angles over about ``ell`` chords of span. Separation is as wide as a
  chord, so a section does not stall independently of what happens a tenth of a chord away.

Angles are exact by default: `alpha = atan2(We, Ue) - theta` holds at any attitude, and a strip in
two-dimensional flow returns its geometric angle. The dissertation's small-angle form,
`alpha = cl / 2 pi + alpha_0L - delta`, is there to reproduce it; the two agree to third order.
"""

import enum
import math

import numpy as np
from numba import njit

from poststall_sim.aero.flaps import INLINE, looked_up
from poststall_sim.aero.lattice import Lattice
from poststall_sim.aero.polars import lift
from poststall_sim.frames import FloatArray

EXACT = {'cache': True, 'nogil': True, 'error_model': 'numpy'}
"""A division by zero gives what is not finite and shows in the residual. One that may raise makes
compiled code count references to the arrays around it: a quarter of a residual's time."""
SUM = {'fastmath': {'reassoc', 'contract'}, **EXACT}
"""Sums may be reordered so that they vectorise; NaN and infinity keep their meaning."""
TWO_PI, PER_TWO_PI = 2.0 * math.pi, 0.5 / math.pi
"""A constant's division is not turned into a product where sums are to be exact."""
ATTACHED = 1e-4
"""Decambering [rad] below which a section counts as a potential line where a start is chosen."""


class Closure(enum.Enum):
    """Which condition the decambering satisfies."""

    NONLOCAL = 'nonlocal'
    LOCAL = 'local'


class AngleForm(enum.Enum):
    """Whether sines are sines: EXACT at any attitude, LINEAR as in the dissertation."""

    EXACT = 'exact'
    LINEAR = 'linear'


def section_decambering(cl, alpha, zero_lift):
    """
    Return the decambering [rad] of a section in two-dimensional flow, small-angle form.

        delta = (cl_visc(alpha) - 2 pi (alpha - alpha_0L)) / (2 pi)

    Paul 2015, section 2.1.
    """
    return (cl - TWO_PI * (alpha - zero_lift)) / TWO_PI


def averaging(lattice: Lattice, ell: float | tuple[float, ...]) -> FloatArray:
    """
    Return the weights (2, strips, strips) of the spanwise mean, a strip's adding up to 1.

    Gaussian of standard deviation ell local chords in the distance along the span, times strip
    width, over the strips of one surface; one ell for all surfaces or one for each; ell = 0
    gives the identity. weights[0] are those of the strips' angles.

    The strips' load is that of a wing that reaches a quarter of a strip beyond its tips, and the
    mean has to reach as far. weights[1] are those of these quarters, and zero but at tips. All
    the load is in the strips' sum already, so the quarter beside a strip counts with the angle at
    which that strip has no lift. Without it the mean at a tip is too great in proportion to the
    strip's width over the chord, and the tips of a coarse lattice stall too early.
    """
    place, half = lattice.span_place, 0.5 * lattice.strip_width
    sigma = np.broadcast_to(ell, len(lattice.grids))[lattice.strip_surface] * lattice.strip_chord
    weights = np.zeros((2, lattice.strips, lattice.strips))
    left, right = tip_reach(lattice)
    for weight, middle, width in (
            (weights[0], place, lattice.strip_width),
            (weights[1], place - half - 0.5 * left, left),
            (weights[1], place + half + 0.5 * right, right)):
        distance = (middle[None, :] - place[:, None]) / np.maximum(sigma, 1e-9)[:, None]
        weight += width[None, :] * np.exp(-0.5 * np.minimum(distance ** 2, 1400.0))
    weights[:, lattice.strip_surface[:, None] != lattice.strip_surface[None, :]] = 0.0
    weights[weights < 1e-12 * weights.max(axis=(0, 2))[:, None]] = 0.0
    return weights / weights.sum(axis=(0, 2))[:, None]


def tip_reach(lattice: Lattice) -> FloatArray:
    """
    Return how far (2, n) the lattice's load reaches beyond a strip's left and right edge [m].

    A quarter of its width at a tip: n equal strips have the lift of a wing n + 1/2 strips wide
    (the tip inset of G. R. Hough, J. Aircraft 10, 1973, read the other way round). An end closer
    to another surface's trailing edge than the strip is wide is no tip: the lattice does not
    resolve the gap, and load goes over.
    """
    nodes, width = lattice.wake_nodes, lattice.strip_width
    reach = np.zeros((2, len(width)))
    for grid in lattice.grids:
        own = nodes[grid.nodes]
        for side, strip, end in ((0, grid.strips.start, own[0]),
                                 (1, grid.strips.stop - 1, own[-1])):
            gap = min((_distance(end, nodes[other.nodes]) for other in lattice.grids
                       if other is not grid), default=math.inf)
            if gap >= width[strip]:
                reach[side, strip] = 0.25 * width[strip]
    return reach


def _distance(point: FloatArray, line: FloatArray) -> float:
    """Return the distance of a point (3,) from a line through points (k, 3)."""
    along, to = np.diff(line, axis=0), point - line[:-1]
    share = np.sum(to * along, axis=1) / np.sum(along ** 2, axis=1)
    return float(np.linalg.norm(to - np.clip(share, 0.0, 1.0)[:, None] * along, axis=1).min())


@njit(**EXACT)
def wrap(angle):
    """Return an angle or angles [rad] brought into -pi..pi."""
    return angle - TWO_PI * np.floor((angle + math.pi) * PER_TWO_PI)


@njit(**EXACT)
def strip_operator(response, level, turned, wash, panel_strip, operator):
    """
    Fill the map from decambering to strip circulation, see `operating_points`.

    response : (n, panels) circulation at the trailing edge per unit normalwash, with its sign
    such that G = -response @ w; level, turned : (panels,) onset velocity along the normals and
    the tangents, so that w = level cos th + turned sin th; wash : (panels,) normalwash that
    decambering does not turn; operator : (n, 2 n + 1) overwritten.
    """
    n = response.shape[0]
    operator[:] = 0.0
    for j in range(n):
        rest = 0.0
        for i in range(response.shape[1]):
            r = response[j, i]
            if r != 0.0:
                k = panel_strip[i]
                operator[j, k] -= r * level[i]
                operator[j, n + k] -= r * turned[i]
                rest -= r * wash[i]
        operator[j, 2 * n] = rest


@njit(**SUM)
def operating_points(delta, strips, operator, linear, alpha, circulation, speed):
    """
    Fill the operating points of all strips for given decambering.

        G = f (g0 + P cos th + Q sin th) + (1 - f) pi c (W cos the + U sin the)
        We = G / (pi c),  Ue = U cos the - W sin the,  alpha = atan2(We, Ue) - the

    th = delta - alpha_0L of the plain section, the = delta - alpha_0L with the flap down. f
    fades the lattice into strip theory where the flow leaves a strip's chord by more than
    60 deg; then alpha is the geometric angle. In the linear form

        G = g0 + P + Q th,   alpha = G / (pi c U) - the

    strips : (16, n) rows U, W, chord, f, alpha_0L plain, alpha_0L with flap, shift of the curve
    by the flap, 1 where there is flow, cosine and sine of alpha_0L with flap less plain, speed,
    share of the attached lift or NaN for the static curve, greatest angle of attached flow and
    where a flap's effect ends past it, least and likewise, see `flaps`; operator : (n, 2 n + 1)
    columns P, Q, g0; alpha, circulation, speed : (n,) filled.
    """
    n = delta.size
    turned = np.empty(2 * n)
    for k in range(n):
        th = delta[k] - strips[4, k]
        turned[k] = 1.0 if linear else math.cos(th)
        turned[n + k] = th if linear else math.sin(th)
    for j in range(n):
        g = operator[j, 2 * n]
        for k in range(2 * n):
            g += operator[j, k] * turned[k]
        circulation[j] = g
    for j in range(n):
        u, w, fade, plate = strips[0, j], strips[1, j], strips[3, j], math.pi * strips[2, j]
        if linear:
            speed[j] = u
            alpha[j] = circulation[j] / (plate * u) - (delta[j] - strips[5, j])
            continue
        c = turned[j] * strips[8, j] + turned[n + j] * strips[9, j]
        s = turned[n + j] * strips[8, j] - turned[j] * strips[9, j]
        g = fade * circulation[j] + (1.0 - fade) * plate * (w * c + u * s)
        we = g / plate
        ue = u * c - w * s
        circulation[j] = g
        speed[j] = math.sqrt(max(we * we + ue * ue, 1e-300))
        alpha[j] = wrap(math.atan2(we, ue) - (delta[j] - strips[5, j]))


@njit(**SUM)
def alpha_slopes(delta, strips, operator, linear, circulation, speed, slope):
    """
    Fill `slope` (n, n) with d alpha / d delta at the points of `operating_points`.

    circulation, speed : (n,) of those points; the other arguments as there.
    """
    n = delta.size
    cosine, sine = np.empty(n), np.empty(n)
    for k in range(n):
        th = delta[k] - strips[4, k]
        cosine[k] = 1.0 if linear else math.cos(th)
        sine[k] = 0.0 if linear else math.sin(th)
    for j in range(n):
        u, w, chord, fade = strips[0, j], strips[1, j], strips[2, j], strips[3, j]
        plate = math.pi * chord
        c = cosine[j] * strips[8, j] + sine[j] * strips[9, j]
        s = sine[j] * strips[8, j] - cosine[j] * strips[9, j]
        ue = u * c - w * s
        v2 = speed[j] * speed[j]
        a = 1.0 / (plate * u) if linear else fade * ue / (v2 * plate)
        for k in range(n):
            slope[j, k] = a * (operator[j, n + k] * cosine[k] - operator[j, k] * sine[k])
        slope[j, j] -= 1.0
        if not linear:
            slope[j, j] += (1.0 - fade) * ue * ue / v2 \
                + circulation[j] / plate * (u * s + w * c) / v2


@njit(**INLINE)
def potential_angle(curve, alpha, linear):
    """
    Return the angle at which potential flow has a section's cl, and its slope.

    asin(cl(alpha) / 2 pi), or cl / 2 pi in the linear form.
    """
    cl, slope = lift(curve, alpha)
    ratio, rate = cl * PER_TWO_PI, slope * PER_TWO_PI
    if linear:
        return ratio, rate
    if abs(ratio) > 0.999:
        ratio = math.copysign(0.999, ratio)
    return math.asin(ratio), rate / math.sqrt(1.0 - ratio * ratio)


@njit(**EXACT)
def separated_angle(share, angle):
    """Return `potential_angle` of a section with a share of the attached lift 2 pi sin(angle)."""
    ratio = share * math.sin(angle)
    if abs(ratio) > 0.999:
        ratio = math.copysign(0.999, ratio)
    return math.asin(ratio), share * math.cos(angle) / math.sqrt(1.0 - ratio * ratio)


@njit(**EXACT)
def _larger(worst, value):
    """Return the larger of a maximum and |value|; NaN, once met, stays."""
    return worst if abs(value) <= worst or math.isnan(worst) else abs(value)


@njit(**SUM)
def faded_mean(strips, mean, weights):
    """
    Fill the weights (2, n, n) of the spanwise mean at an onset, a strip's adding up to 1.

    mean : (2, n, n) see `averaging`. A strip that has faded into strip theory neither reads its
    neighbours nor is read: between a strip in forward and one in reversed flow there is no mean.
    """
    n = mean.shape[1]
    for j in range(n):
        left = 1.0
        for i in range(2):
            for k in range(n):
                weights[i, j, k] = strips[3, j] * mean[i, j, k] * strips[3, k]
                left -= weights[i, j, k]
        weights[0, j, j] += left


@njit(forceinline=True, **SUM)     # a call would count references to its arrays
def mean_angles(delta, strips, alpha, weights, mean):
    """
    Fill the spanwise means (n,) of the sections' angles alpha (n,) [rad].

        mean_j = alpha_j + sum_k (weights_0jk (alpha_k - alpha_j) + weights_1jk (idle_k - alpha_j))

    idle = alpha_0L - delta, the angle of a strip without lift; weights (2, n, n) from
    `faded_mean`.
    """
    n = alpha.size
    low = high = alpha[0]
    for k in range(n):
        low, high = min(low, alpha[k]), max(high, alpha[k])
        if weights[1, k, k] != 0.0:
            idle = strips[5, k] - delta[k]
            low, high = min(low, idle), max(high, idle)
    for j in range(n):
        total = 0.0
        if high - low < math.pi:
            for k in range(n):
                total += weights[0, j, k] * alpha[k]
        else:     # a difference may cross +-180 deg
            total = alpha[j]
            for k in range(n):
                total += weights[0, j, k] * wrap(alpha[k] - alpha[j])
        mean[j] = total
    for k in range(n):
        if weights[1, k, k] == 0.0:     # no tip
            continue
        idle = strips[5, k] - delta[k]
        for j in range(n):
            if high - low < math.pi:
                mean[j] += weights[1, j, k] * idle
            else:
                mean[j] += weights[1, j, k] * wrap(idle - alpha[j])


@njit(**SUM)
def nonlocal_residual(delta, strips, linear, curves, polar_index, weights, alpha, residual,
                      change):
    """
    Fill the residual of the non-local closure and the section decambering's slope; return max |F|.

        F_j = delta_j - D_j(abar_j),   abar from `mean_angles`
        D(a) = asin(cl(x(a)) / 2 pi) - (a - alpha_0L),  linear: cl / 2 pi for the asin

    With row 11 of strips a number, D is that of a section with this share of its attached lift,
    see `separation`. weights (2, n, n) from `faded_mean`; alpha (n,) from `operating_points`;
    residual (n,) F and change (n,) dD/da filled. Strips without flow are left out: they keep
    their decambering.
    """
    n = delta.size
    mean_angles(delta, strips, alpha, weights, residual)
    worst = 0.0
    for j in range(n):
        if strips[7, j] == 0.0:
            residual[j] = 0.0
            change[j] = 0.0
            continue
        mean = residual[j]
        if math.isnan(strips[11, j]):
            angle, gain = looked_up(j, mean, strips)
            phi, rate = potential_angle(curves[polar_index[j]], angle, linear)
            rate *= gain
        else:
            phi, rate = separated_angle(strips[11, j], mean - strips[5, j])
        residual[j] = wrap(delta[j] - phi + mean - strips[5, j])
        change[j] = rate - 1.0
        worst = _larger(worst, residual[j])
    return worst


@njit(**EXACT)
def strip_theory(delta, strips, linear, curves, polar_index):
    """
    Put strips that have faded into strip theory (f = 0) at their decambering, in place.

    All of them where delta is zero throughout, which stands for no start given: a section's own
    decambering at its geometric angle is a better one, and its lift nearly right. A section
    that is a potential line, but for its interpolation, stays at exactly zero.
    """
    cold = np.abs(delta).max() == 0.0
    for j in range(delta.size):
        if (cold or strips[3, j] == 0.0) and strips[7, j] != 0.0:
            alpha = math.atan2(strips[1, j], strips[0, j])
            if linear:
                alpha = strips[1, j] / strips[0, j]
            angle = looked_up(j, alpha, strips)[0]
            phi = potential_angle(curves[polar_index[j]], angle, linear)[0]
            own = wrap(phi - alpha + strips[5, j])
            if abs(own) > ATTACHED or strips[3, j] == 0.0:
                delta[j] = own


@njit(**SUM)
def nonlocal_jacobian(weights, change, slope, jacobian):
    """Fill dF/d delta = I - diag(dD/da) (weights_0 (d alpha / d delta) - weights_1), (n, n)."""
    n = change.size
    np.dot(weights[0], slope, jacobian)
    for j in range(n):
        for k in range(n):
            jacobian[j, k] = change[j] * (weights[1, j, k] - jacobian[j, k])
        jacobian[j, j] += 1.0


@njit(**EXACT)
def local_residual(strips, curves, polar_index, alpha, circulation, speed, residual):
    """Fill the residual (n,) of the local closure, cl_j - cl_visc,j(alpha_j) [-]; return max."""
    worst = 0.0
    for j in range(alpha.size):
        if strips[7, j] == 0.0:
            residual[j] = 0.0
            continue
        residual[j] = 2.0 * circulation[j] / (speed[j] * strips[2, j]) \
            - lift(curves[polar_index[j]], looked_up(j, alpha[j], strips)[0])[0]
        worst = _larger(worst, residual[j])
    return worst
