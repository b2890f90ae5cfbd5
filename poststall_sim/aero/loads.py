# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""
Forces and moments of a lattice with its sections' drag and moment: one function for all.

Three parts are added: the lattice force (Kutta-Joukowski on every edge of the rings, the
trailing edge against its wake included), the added mass (rho times the rate of circulation), and
what potential flow has not: section drag along the local flow and section moment. The lattice
is flat, so its own section moment about the quarter chord is zero and that of a flap stays in.
Past stall the lattice force keeps the full leading-edge suction of the reduced circulation; the
section's cd carries the pressure drag, so nothing counts twice.
"""

import math

from numba import njit

_EXACT = {'cache': True, 'nogil': True}


@njit(**_EXACT)
def edge_flow(passing, induced, bound, fade, edge_strip, circulation, row, plus, minus, wake,
              velocity, strength):
    """
    Fill velocity (s, 3) of the air at the edges' middles and strength (s,) of the edges.

    passing, induced : (s, 3) of the onset and of the wake; bound (3 s,) of the rings; fade (n,)
    share of the lattice in each strip, edge_strip (s, 2) those beside an edge; circulation (p,)
    of rings and row (n,) of the wake row at the trailing edge: G[plus] - G[minus] + row[wake],
    with index -1 for none.
    """
    for i in range(strength.size):
        share = 0.5 * (fade[edge_strip[i, 0]] + fade[edge_strip[i, 1]])
        for c in range(3):
            velocity[i, c] = passing[i, c] + share * (induced[i, c] + bound[3 * i + c])
        total = 0.0
        if plus[i] >= 0:
            total += circulation[plus[i]]
        if minus[i] >= 0:
            total -= circulation[minus[i]]
        if wake[i] >= 0:
            total += row[wake[i]]
        strength[i] = total


@njit(**_EXACT)
def lattice_force(density, strength, velocity, vector, place, total):
    """
    Add the Joukowski force rho G V x l of straight vortex edges, and its moment.

    strength : (s,) [m^2/s]; velocity (s, 3) of the air at the edges' middles, induced flow
    included [m/s]; vector (s, 3) [m]; place (s, 3) middles from the moment reference [m];
    total : (6,) force [N] and moment [N m], added to in place.
    """
    for i in range(strength.size):
        g = density * strength[i]
        fx = g * (velocity[i, 1] * vector[i, 2] - velocity[i, 2] * vector[i, 1])
        fy = g * (velocity[i, 2] * vector[i, 0] - velocity[i, 0] * vector[i, 2])
        fz = g * (velocity[i, 0] * vector[i, 1] - velocity[i, 1] * vector[i, 0])
        _add(fx, fy, fz, place[i], total)


@njit(**_EXACT)
def added_mass_force(density, rate, area, normal, place, total):
    """
    Add the unsteady pressure rho A n dG/dt of all panels, and its moment.

    rate : (p,) [m^2/s^2]; area (p,) [m^2]; normal, place (p, 3); total (6,) added to in place.
    """
    for i in range(rate.size):
        g = density * area[i] * rate[i]
        _add(g * normal[i, 0], g * normal[i, 1], g * normal[i, 2], place[i], total)


@njit(**_EXACT)
def section_force(density, alpha, speed, cd, cm, chord, width, chord_axis, strip_normal,
                  moment_axis, place, total):
    """
    Add section drag along the local flow and section moment about the moment axis.

    alpha [rad], speed [m/s], cd, cm (n,) of the operating points; chord, width (n,) [m]; axes and
    place (n, 3), place of the quarter chords; total (6,) added to in place.
    """
    for j in range(alpha.size):
        pressure = 0.5 * density * speed[j] * speed[j] * chord[j] * width[j]
        drag = pressure * cd[j]
        c, s = drag * math.cos(alpha[j]), drag * math.sin(alpha[j])
        _add(c * chord_axis[j, 0] + s * strip_normal[j, 0],
             c * chord_axis[j, 1] + s * strip_normal[j, 1],
             c * chord_axis[j, 2] + s * strip_normal[j, 2], place[j], total)
        moment = pressure * chord[j] * cm[j]
        for k in range(3):
            total[3 + k] += moment * moment_axis[j, k]


@njit(**_EXACT)
def _add(fx, fy, fz, place, total):
    total[0] += fx
    total[1] += fy
    total[2] += fz
    total[3] += place[1] * fz - place[2] * fy
    total[4] += place[2] * fx - place[0] * fz
    total[5] += place[0] * fy - place[1] * fx
