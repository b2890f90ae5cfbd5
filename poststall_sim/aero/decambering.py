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

Angles are exact: `alpha = atan2(We, Ue) - theta` holds at any attitude, and a strip in
two-dimensional flow returns its geometric angle.
"""

import enum
import math

import numpy as np
from numba import njit

from poststall_sim.aero.lattice import Lattice
from poststall_sim.aero.polars import section
from poststall_sim.frames import FloatArray

_EXACT = {'cache': True, 'nogil': True}
TWO_PI = 2.0 * math.pi


class Closure(enum.Enum):
    """Which condition the decambering satisfies."""

    NONLOCAL = 'nonlocal'
    LOCAL = 'local'


def section_decambering(cl, alpha, zero_lift):
    """
    Return the decambering [rad] of a section in two-dimensional flow, small-angle form.

        delta = (cl_visc(alpha) - 2 pi (alpha - alpha_0L)) / (2 pi)

    Paul 2015, section 2.1.
    """
    return (cl - TWO_PI * (alpha - zero_lift)) / TWO_PI


def averaging(lattice: Lattice, ell: float) -> FloatArray:
    """
    Return the weights (strips, strips) of the spanwise mean, rows adding up to 1.

    Gaussian of standard deviation ell local chords in the distance along the span, times strip
    width, over the strips of one surface; ell = 0 gives the identity.
    """
    place, chord = lattice.span_place, lattice.strip_chord
    distance = (place[None, :] - place[:, None]) / (max(ell, 1e-9) * chord[:, None])
    weight = lattice.strip_width[None, :] * np.exp(-0.5 * np.minimum(distance ** 2, 1400.0))
    weight[lattice.strip_surface[:, None] != lattice.strip_surface[None, :]] = 0.0
    return weight / weight.sum(axis=1, keepdims=True)


@njit(**_EXACT)
def wrap(angle):
    """Return an angle [rad] brought into -pi..pi."""
    return angle - TWO_PI * math.floor((angle + math.pi) / TWO_PI)


@njit(**_EXACT)
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
        for i in range(response.shape[1]):
            r = response[j, i]
            if r != 0.0:
                k = panel_strip[i]
                operator[j, k] -= r * level[i]
                operator[j, n + k] -= r * turned[i]
                operator[j, 2 * n] -= r * wash[i]


@njit(**_EXACT)
def operating_points(delta, strips, operator, alpha, circulation, speed, slope):
    """
    Fill the operating points of all strips for given decambering.

        G = f (g0 + P cos th + Q sin th) + (1 - f) pi c (W cos the + U sin the)
        We = G / (pi c),  Ue = U cos the - W sin the,  alpha = atan2(We, Ue) - the

    th = delta - alpha_0L of the plain section, the = delta - alpha_0L with the flap down. f
    fades the lattice into strip theory where the flow leaves a strip's chord by more than
    60 deg; then alpha is the geometric angle.

    strips : (8, n) rows U, W, chord, f, alpha_0L plain, alpha_0L with flap, shift of the curve by
    the flap, 1 where there is flow;
    operator : (n, 2 n + 1) columns P, Q, g0; alpha, circulation, speed : (n,) filled;
    slope : (n, n) d alpha / d delta, filled.
    """
    n = delta.size
    u, w, chord, fade, zero, zero_flapped = (
        strips[0], strips[1], strips[2], strips[3], strips[4], strips[5])
    cosine = np.cos(delta - zero)
    sine = np.sin(delta - zero)
    for j in range(n):
        the = delta[j] - zero_flapped[j]
        c, s = math.cos(the), math.sin(the)
        g = operator[j, 2 * n]
        for k in range(n):
            g += operator[j, k] * cosine[k] + operator[j, n + k] * sine[k]
        plate = math.pi * chord[j]
        g = fade[j] * g + (1.0 - fade[j]) * plate * (w[j] * c + u[j] * s)
        we = g / plate
        ue = u[j] * c - w[j] * s
        v2 = max(we * we + ue * ue, 1e-300)
        circulation[j] = g
        speed[j] = math.sqrt(v2)
        alpha[j] = wrap(math.atan2(we, ue) - the)
        a = fade[j] * ue / (v2 * plate)
        for k in range(n):
            slope[j, k] = a * (operator[j, n + k] * cosine[k] - operator[j, k] * sine[k])
        slope[j, j] += (1.0 - fade[j]) * ue * ue / v2 + we * (u[j] * s + w[j] * c) / v2 - 1.0


@njit(**_EXACT)
def nonlocal_residual(delta, strips, curves, polar_index, mean, alpha, slope, residual, jacobian):
    """
    Fill the residual of the non-local closure and its exact Jacobian.

        F_j = delta_j - D_j(abar_j),   abar_j = alpha_j + sum_k mean_jk (alpha_k - alpha_j)
        D(a) = asin(cl(a + shift) / 2 pi) - (a - alpha_0L)

    alpha (n,) and slope (n, n) from `operating_points`; residual (n,), jacobian (n, n) filled.
    Strips without flow are left out: their row asks for no change.
    """
    n = delta.size
    out = np.empty(4)
    for j in range(n):
        if strips[7, j] == 0.0:
            residual[j] = 0.0
            for k in range(n):
                jacobian[j, k] = 0.0
            jacobian[j, j] = 1.0
            continue
        abar = alpha[j]
        for k in range(n):
            if mean[j, k] != 0.0:
                abar += mean[j, k] * wrap(alpha[k] - alpha[j])
        section(curves[polar_index[j]], abar + strips[6, j], out)
        ratio = min(max(out[0] / TWO_PI, -0.999), 0.999)
        residual[j] = wrap(delta[j] - math.asin(ratio) + abar - strips[5, j])
        change = out[3] / (TWO_PI * math.sqrt(1.0 - ratio * ratio)) - 1.0
        for k in range(n):
            jacobian[j, k] = 0.0
        for i in range(n):
            if mean[j, i] != 0.0:
                a = change * mean[j, i]
                for k in range(n):
                    jacobian[j, k] -= a * slope[i, k]
        jacobian[j, j] += 1.0


@njit(**_EXACT)
def local_residual(strips, curves, polar_index, alpha, circulation, speed, residual):
    """Fill the residual (n,) of the local closure, cl_j - cl_visc,j(alpha_j) [-]."""
    out = np.empty(4)
    for j in range(alpha.size):
        if strips[7, j] == 0.0:
            residual[j] = 0.0
            continue
        section(curves[polar_index[j]], alpha[j] + strips[6, j], out)
        residual[j] = 2.0 * circulation[j] / (speed[j] * strips[2, j]) - out[0]
