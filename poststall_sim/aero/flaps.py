# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""
Flaps in two-dimensional flow: what one does to a plate, to a section's curve, and to its hinge.

A flap turns the normals of the panels behind its hinge, so that its effect in attached flow is
the lattice's own, see `plate`. The section's curve is moved by as much: a strip at alpha
with the shift s = effectiveness x deflection works where the plain section does at

    x = alpha + s eta(alpha + s).

eta is 1 between the stall angles, as if the section were cambered, and falls past them by a
smooth step to 0 at the angle where the section is left with a quarter of its attached lift: that
is what Kirchhoff's flow behind a plate leaves of it, ((1 + sqrt f)/2)^2 of the place f of the
separation point, once it has reached the leading edge (as in Leishman & Beddoes, J. AHS 34(3),
1989). Then all of the flap lies in the wake and the section works as the plain one does. That
ailerons lose their effect as the stall goes on was measured by Weick & Wenzinger, NACA TR 419,
1932; the way it falls between those two angles is our own. Lift, drag and moment are all read at
x, and the moment of the flap itself about the quarter chord, which the lattice has, fades with
eta. A section with tables of its flap has all that in them, and eta is 1, as it is under the
local closure, the dissertation's own.
"""

import math

from numba import njit

_EXACT = {'cache': True, 'nogil': True, 'error_model': 'numpy'}
"""A division that may raise makes compiled code count references to arrays, at every strip."""
INLINE = {'forceinline': True, **_EXACT}
"""For what residuals ask strip by strip: left to itself LLVM makes a call of it, which costs as
much as what is asked, some 6 % of a decambering in all."""

LEFT = 0.25
"""Share of the attached lift that Kirchhoff's flow has with separation at the leading edge."""


def floating_ratio(hinge: float) -> float:
    """
    Return the flap angle -d(deflection)/d(alpha) at which the hinge carries no moment.

    Thin-airfoil theory of a flap without balance (H. Glauert, ARC R&M 1095, 1927): with cos t =
    1 - 2 hinge the moments by incidence and by deflection are, up to one factor,

        a = (pi - t)(cos t - 1/2) + sin t (1 - cos t / 2)
        b = ((pi - t) a + sin t ((pi - t) cos t + sin t) / 2) / pi.

    1 at hinge 0: an all-moving surface, hinged ahead of its load, goes with the flow.
    """
    cosine = 1.0 - 2.0 * hinge
    sine, rest = math.sqrt(1.0 - cosine * cosine), math.pi - math.acos(cosine)
    by_alpha = rest * (cosine - 0.5) + sine * (1.0 - 0.5 * cosine)
    by_deflection = (rest * by_alpha + 0.5 * sine * (rest * cosine + sine)) / math.pi
    return by_alpha / by_deflection


@njit(**_EXACT)
def effect_left(j, alpha, strips):
    """
    Return eta and d(eta)/d(alpha) of a strip whose section works at alpha [rad].

    strips : see `decambering.operating_points`, whose rows 12 to 15 are the stall angles and
    those where a flap's effect ends.
    """
    angle = alpha + strips[6, j]
    if angle > strips[12, j]:
        begin, way = strips[12, j], strips[13, j] - strips[12, j]
    elif angle < strips[14, j]:
        begin, way = strips[14, j], strips[15, j] - strips[14, j]
    else:
        return 1.0, 0.0
    t = (angle - begin) / way
    if t >= 1.0:
        return 0.0, 0.0
    return 1.0 - t * t * (3.0 - 2.0 * t), -6.0 * t * (1.0 - t) / way


@njit(**INLINE)
def looked_up(j, alpha, strips):
    """Return the angle x at which strip j's curve is read for alpha [rad], and dx/d(alpha)."""
    shift = strips[6, j]
    if shift == 0.0:
        return alpha, 1.0
    left, slope = effect_left(j, alpha, strips)
    return alpha + shift - shift * (1.0 - left), 1.0 + shift * slope


@njit(**_EXACT)
def look_up(alpha, strips, angles, left, slope):
    """Fill (n,) the angles at which the curves are read, eta and d(eta)/d(alpha)."""
    for j in range(alpha.size):
        angles[j] = looked_up(j, alpha[j], strips)[0]
        left[j], slope[j] = effect_left(j, alpha[j], strips)
