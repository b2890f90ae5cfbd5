# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""
Superposition of basic and additional loadings: the lattice as a linear map, small angles.

    Cl = CL Cl_a1 + Cl_b0 + sum_j Cl_bj delta_j
    CL = a (alpha - alpha_b0 - sum_j alpha_bj delta_j),   a = 1 / alpha_a1

(R. C. Paul 2015, equations 3.1 to 3.4.) The additional loading Cl_a1 is that of incidence at
CL = 1, a basic loading that of a twist at CL = 0; decambering is a twist. Any of our lattices
gives the map: one chordwise panel is the Weissinger arrangement.
"""

import math
from dataclasses import dataclass

import numpy as np

from poststall_sim.aero.lattice import Lattice
from poststall_sim.frames import FloatArray

TWO_PI = 2.0 * math.pi


def lift_slopes(lattice: Lattice, response: FloatArray) -> FloatArray:
    """
    Return M (n, n), d cl_j / d delta_k [1/rad], in a stream along x at zero incidence.

    response : (n, panels) strip circulation per unit normalwash, G = -response w, of a steady
    operator. cl is made with the speed normal to each strip's span, so that sweep cancels.
    """
    stream = lattice.tangent[:, 0]
    by_strip = np.zeros((lattice.strips, lattice.strips))
    for k in range(lattice.strips):
        panels = lattice.panel_strip == k
        by_strip[:, k] = -response[:, panels] @ stream[panels]
    speed = lattice.chord_axis[:, 0]
    return 2.0 * by_strip / (lattice.strip_chord * speed)[:, None]


@dataclass(frozen=True, slots=True, eq=False)
class Loadings:
    """
    Elementary loadings of a configuration.

    additional (n,) : Cl_a1; slope : a, dCL/dalpha [1/rad]; basic (n, n) : column j is Cl_bj per
    unit twist of strip j [1/rad]; basic_angle (n,) : alpha_bj [-]; area (n,) : share of each
    strip in CL.
    """

    additional: FloatArray
    slope: float
    basic: FloatArray
    basic_angle: FloatArray
    area: FloatArray

    def lift(self, alpha: float, twist: FloatArray) -> tuple[FloatArray, float]:
        """
        Return strip cl (n,) and CL at an incidence [rad] with a twist (n,) of the strips [rad].

        The twist adds up geometric and aerodynamic twist, decambering and what roll makes of the
        local incidence.
        """
        CL = self.slope * (alpha - float(self.basic_angle @ twist))
        return CL * self.additional + self.basic @ twist, CL


def loadings(lattice: Lattice, slopes: FloatArray, reference_area: float) -> Loadings:
    """
    Return the elementary loadings of a lattice from its map (n, n), see `lift_slopes`.

    CL counts the lift of all strips over the reference area [m^2].
    """
    area = lattice.strip_chord * lattice.strip_width / reference_area
    by_alpha = slopes.sum(axis=1)
    a = float(area @ by_alpha)
    additional = by_alpha / a
    by_strip = area @ slopes
    return Loadings(additional=additional, slope=a, area=area,
                    basic=slopes - np.outer(additional, by_strip), basic_angle=-by_strip / a)


def trajectory_slopes(parts: Loadings) -> tuple[FloatArray, FloatArray]:
    """
    Return d cl_j / d delta (n,) of schemes B and D [1/rad].

    B, only strip j changed: Cl_b,jj - a alpha_bj Cl_a1,j (equation 3.7; its first factor is the
    configuration's lift slope a, or it would not agree with 3.6). D, all strips alike:
    Cl_a1,j a (equation 3.11).
    """
    single = np.diag(parts.basic) - parts.slope * parts.basic_angle * parts.additional
    return single, parts.additional * parts.slope


def trajectory_line(sigma: FloatArray) -> FloatArray:
    """
    Return the slope dcl/dalpha of a trajectory in the (alpha, cl) plane [1/rad].

    From alpha = cl / 2 pi + alpha_0L - delta: m = sigma / (sigma / 2 pi - 1), equations 3.6 and
    3.10; infinite for scheme A, sigma = 2 pi.
    """
    with np.errstate(divide='ignore'):
        return sigma / (sigma / TWO_PI - 1.0)


def induced_angles(slopes: FloatArray) -> FloatArray:
    """
    Return W (n, n), the angle [rad] that unit cl of strip k takes from strip j.

        W = inv(M) - I / 2 pi

    With it both conditions read alpha - alpha_g + W cl_visc(alpha) = 0.
    """
    return np.linalg.inv(slopes) - np.eye(len(slopes)) / TWO_PI
