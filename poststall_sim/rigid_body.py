# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""
Newton-Euler equations of a rigid body with added mass, attitude as a quaternion.

    (M + M_add) d(nu)/dt = L' + weight - (omega x m v, omega x I omega),
    d(q)/dt = q (0, omega) / 2,   d(position)/dt = R_NB v

nu = (v, omega) about the centre of gravity in B. The load L' has the added mass taken out
(L' = L + M_add d(nu)/dt), so that a light body in heavy air is integrated stably.
"""

import numpy as np
from numba import njit

from poststall_sim.frames import GRAVITY, FloatArray
from poststall_sim.state import BodyState

_EXACT = {'cache': True, 'nogil': True}


@njit(**_EXACT)
def _rates(x, load, mass, inertia, inverse, gravity, out):
    """
    Fill `out` with d/dt of x = (position, v, omega, q), (13,), for a load (6,) in B.

    inverse : (6, 6) of the mass matrix with added mass.
    """
    u, v, w, p, q, r = x[3], x[4], x[5], x[6], x[7], x[8]
    a, b, c, d = x[9], x[10], x[11], x[12]
    r00, r01, r02 = 1 - 2 * (c * c + d * d), 2 * (b * c - a * d), 2 * (b * d + a * c)
    r10, r11, r12 = 2 * (b * c + a * d), 1 - 2 * (b * b + d * d), 2 * (c * d - a * b)
    r20, r21, r22 = 2 * (b * d - a * c), 2 * (c * d + a * b), 1 - 2 * (b * b + c * c)
    out[0] = r00 * u + r01 * v + r02 * w
    out[1] = r10 * u + r11 * v + r12 * w
    out[2] = r20 * u + r21 * v + r22 * w
    hx = inertia[0, 0] * p + inertia[0, 1] * q + inertia[0, 2] * r
    hy = inertia[1, 0] * p + inertia[1, 1] * q + inertia[1, 2] * r
    hz = inertia[2, 0] * p + inertia[2, 1] * q + inertia[2, 2] * r
    f0 = load[0] + mass * (gravity * r20 - (q * w - r * v))
    f1 = load[1] + mass * (gravity * r21 - (r * u - p * w))
    f2 = load[2] + mass * (gravity * r22 - (p * v - q * u))
    f3 = load[3] - (q * hz - r * hy)
    f4 = load[4] - (r * hx - p * hz)
    f5 = load[5] - (p * hy - q * hx)
    for i in range(6):
        out[3 + i] = inverse[i, 0] * f0 + inverse[i, 1] * f1 + inverse[i, 2] * f2 \
            + inverse[i, 3] * f3 + inverse[i, 4] * f4 + inverse[i, 5] * f5
    out[9] = -0.5 * (b * p + c * q + d * r)
    out[10] = 0.5 * (a * p + c * r - d * q)
    out[11] = 0.5 * (a * q - b * r + d * p)
    out[12] = 0.5 * (a * r + b * q - c * p)


@njit(**_EXACT)
def _runge_kutta(x, start, end, dt, mass, inertia, inverse, gravity, out):
    """Fill `out` with the state one step of the classical fourth-order rule later."""
    k1, k2, k3, k4 = np.empty(13), np.empty(13), np.empty(13), np.empty(13)
    middle = 0.5 * (start + end)
    _rates(x, start, mass, inertia, inverse, gravity, k1)
    _rates(x + 0.5 * dt * k1, middle, mass, inertia, inverse, gravity, k2)
    _rates(x + 0.5 * dt * k2, middle, mass, inertia, inverse, gravity, k3)
    _rates(x + dt * k3, end, mass, inertia, inverse, gravity, k4)
    out[:] = x + dt / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4)
    out[9:] /= np.sqrt(np.sum(out[9:] ** 2))


@njit(**_EXACT)
def mass_matrix_inverse(mass, inertia_B, added_mass):
    """Return the inverse (6, 6) of the mass matrix about the centre of gravity in B."""
    matrix = added_mass.copy()
    for i in range(3):
        matrix[i, i] += mass
    matrix[3:, 3:] += inertia_B
    return np.linalg.inv(matrix)


def advance(body: BodyState, start: FloatArray, end: FloatArray, dt: float, *, mass: float,
            inertia_B: FloatArray, inverse: FloatArray, gravity: float = GRAVITY) -> BodyState:
    """
    Return the body dt [s] later, under a load (6,) that goes linearly from start to end.

    Force and moment about the centre of gravity in B [N, N m], without weight; inverse : see
    `mass_matrix_inverse`. Fourth order in dt for a given load (Hairer, Norsett & Wanner, Solving
    Ordinary Differential Equations I, 2nd ed., sec. II.1).
    """
    out = np.empty(13)
    _runge_kutta(_packed(body), start, end, dt, mass, inertia_B, inverse, gravity, out)
    return BodyState(out[:3], out[3:6], out[6:9], out[9:])


def acceleration(body: BodyState, load: FloatArray, *, mass: float, inertia_B: FloatArray,
                 inverse: FloatArray, gravity: float = GRAVITY) -> FloatArray:
    """Return d(v, omega)/dt (6,), the change of the components in B [m/s^2, rad/s^2]."""
    out = np.empty(13)
    _rates(_packed(body), load, mass, inertia_B, inverse, gravity, out)
    return out[3:9].copy()


def _packed(body: BodyState) -> FloatArray:
    return np.concatenate([body.position_N, body.velocity_B, body.rates_B, body.q_NB])
