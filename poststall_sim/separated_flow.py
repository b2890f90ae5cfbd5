# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""Sections and wings in flow that has separated, or comes from behind; angles in radians."""

import math

import numpy as np

from poststall_sim.frames import FloatArray

HIGHEST_ASPECT_RATIO = 50.0
"""Above it CDmax, 1.1 + 0.018 AR, is that of a section."""


def smoothstep(x: FloatArray) -> FloatArray:
    """Return 0 below 0, 1 above 1, and 3 x^2 - 2 x^3 between."""
    x = np.clip(x, 0.0, 1.0)
    return x ** 2 * (3.0 - 2.0 * x)


def plate(alpha: FloatArray, cd90: float) -> tuple[FloatArray, FloatArray, FloatArray]:
    """
    Return cl, cd, cm of a fully separated section, 0 <= alpha <= pi.

    CN and CT (forward) after Truong's fit to the NACA 0012; CN is scaled to reach `cd90`:

        CN = (2.08 + 0.0836 cos a + 0.406 cos^2 a) sin a
        CT = (0.09 - 0.178 cos a - 0.298 cos^3 a) sin^2 a
        cm = -CN (x_cp - 1/4),  x_cp = 0.5 - 0.1 (1 - 2 a / pi)

    References
    ----------
    K. V. Truong, An analytical model for airfoil aerodynamic characteristics over the entire
    360 deg angle of attack range, J. Renewable Sustainable Energy 12, 033303, 2020; constants as
    in AeroSandbox (MIT).

    """
    cos, sin = np.cos(alpha), np.sin(alpha)
    cn = cd90 / 2.08 * (2.08 + 0.0836 * cos + 0.406 * cos ** 2) * sin
    ct = (0.09 - 0.178 * cos - 0.298 * cos ** 3) * sin ** 2
    return cn * cos + ct * sin, cn * sin - ct * cos, _moment(alpha, cn)


def generic_plate(alpha: FloatArray) -> tuple[FloatArray, FloatArray]:
    """
    Return cl, cd of a separated plate that stands for sections nothing is known of, at any alpha.

        cl = 1.1 sin 2a,   cd = 0.01 + 1.9 sin^2 a

    1.9 is the drag of a wide plate across the stream.

    References
    ----------
    S. F. Hoerner, Fluid-Dynamic Drag, 1965, ch. 3.

    """
    return 1.1 * np.sin(2.0 * alpha), 0.01 + 1.9 * np.sin(alpha) ** 2


def viterna(alpha: FloatArray, aspect_ratio: float, alpha_stall: float, cl_stall: float,
            cd_stall: float) -> tuple[FloatArray, FloatArray, FloatArray]:
    """
    Return cl, cd, cm of a separated wing of finite aspect ratio, 0 <= alpha <= pi.

    Continuous with lift and drag at the stall, and a plate's across the flow:

        cl = (CDmax / 2) sin 2a + A2 cos^2 a / sin a,   cd = CDmax sin^2 a + B2 cos a,
        A2 = (cl_s - CDmax sin a_s cos a_s) sin a_s / cos^2 a_s,
        B2 = (cd_s - CDmax sin^2 a_s) / cos a_s,        CDmax = 1.1 + 0.018 AR

    Below the stall 1 / sin a stays that of a_s. From behind it is the mirror image, with 0.7 of
    the lift. The moment has the centre of pressure of `plate`.

    References
    ----------
    L. A. Viterna, R. D. Corrigan, Fixed pitch rotor performance of large horizontal axis wind
    turbines, DOE/NASA workshop, 1981; CDmax as fitted to C. Ostowari, D. Naik, SERI/STR-217-2559,
    1985, by users of that report.

    """
    most = 1.1 + 0.018 * min(aspect_ratio, HIGHEST_ASPECT_RATIO)
    sin_s, cos_s = math.sin(alpha_stall), math.cos(alpha_stall)
    a2 = (cl_stall - most * sin_s * cos_s) * sin_s / cos_s ** 2
    b2 = (cd_stall - most * sin_s ** 2) / cos_s
    cos, sin = np.cos(alpha), np.sin(alpha)
    across = smoothstep(2.0 * alpha / math.pi - 1.0)
    cl = (0.5 * most * np.sin(2.0 * alpha) + a2 * cos * np.abs(cos) / np.maximum(sin, sin_s)) \
        * (1.0 - 0.3 * across)
    cd = most * sin ** 2 + b2 * cos * (1.0 - 2.0 * across)
    return cl, np.maximum(cd, 0.0), _moment(alpha, cl * cos + cd * sin)


def _moment(alpha: FloatArray, normal: FloatArray) -> FloatArray:
    """Return cm of a normal force whose centre goes from 0.4 c at 0 by 0.5 to 0.6 at 180 deg."""
    place = 0.5 - 0.1 * (1.0 - 2.0 * alpha / math.pi)
    return -normal * (place - 0.25)


def reversed_flow(alpha: FloatArray, cd0: float) -> tuple[FloatArray, FloatArray, FloatArray]:
    """
    Return cl, cd, cm of a section flying tail first, attached, for alpha near pi.

    Lift 2 pi sin a at 0.75 c; twice the drag of forward flight at zero incidence, and two thirds
    of the leading-edge suction lost, 4 sin^2 a. Camber is left out.
    """
    # sin(pi - a) and not sin(a): zero to the last bit at 180 deg
    sin, cos = np.sin(math.pi - alpha), np.cos(alpha)
    cl = -2.0 * math.pi * sin
    cd = 2.0 * cd0 + 4.0 * sin ** 2
    return cl, cd, -0.5 * (cl * cos + cd * sin)
