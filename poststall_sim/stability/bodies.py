# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""
Small motions of a rigid body: everything in their equations but the load of the air.

    M dy/dt = P L + R y,   nu = N y

y (m,) are the body's states, L (6,) changes of force and moment of the air about the centre of
gravity in B, nu (6,) those of velocity and rates in B.
"""

from dataclasses import dataclass

import numpy as np

from poststall_sim.aircraft import Aircraft, MassProperties
from poststall_sim.frames import GRAVITY, FloatArray, euler_rates
from poststall_sim.propulsion import thrust

STATES = ('u', 'v', 'w', 'p', 'q', 'r', 'phi', 'theta', 'psi')
"""Of a free body: velocity and rates in B [m/s, rad/s] and Euler angles [rad]."""
_STEP = 1e-3
"""Change of velocity by which the engines' thrust, straight lines, is derived [m/s]."""


@dataclass(frozen=True, slots=True, eq=False)
class Body:
    """
    The matrices of the head of this file.

    names (m,); motion (6, m) N; mass (m, m) M; push (m, 6) P; rest (m, m) R : weight, turning
    axes and engines; throttle (m,) and wind (m, 3) : M dy/dt by the engines per unit of throttle,
    and per velocity of the air in B.
    """

    names: tuple[str, ...]
    motion: FloatArray
    mass: FloatArray
    push: FloatArray
    rest: FloatArray
    throttle: FloatArray
    wind: FloatArray


def free_body(aircraft: Aircraft, *, velocity_B: FloatArray, pitch: float,
              throttle: float) -> Body:
    """
    Return an aircraft in straight flight, wings level, free to move; states as in `STATES`.

    With the full inertia tensor in M and v0, theta0 those of the trim,

        M d(nu)/dt = L + T_v v - (omega x m v0, 0) + m g (d/dTheta)(R_BN z_N) Theta,
        d(phi)/dt = p + r tan(theta0),  d(theta)/dt = q,  d(psi)/dt = r / cos(theta0).

    velocity_B (3,) through the air [m/s], which is at rest and of one density; pitch [rad], below
    90 deg either way; throttle held. (Etkin & Reid, Dynamics of Flight, 3rd ed., 1996, sec. 4.9)
    """
    mass, steps = aircraft.mass, _STEP * np.eye(3)
    u, v, w = velocity_B
    sp, cp = np.sin(pitch), np.cos(pitch)
    rest, slope = np.zeros((9, 9)), np.zeros((9, 3))
    slope[:6] = np.column_stack([
        _engines(aircraft, velocity_B + step, throttle)
        - _engines(aircraft, velocity_B - step, throttle) for step in steps]) / (2.0 * _STEP)
    rest[:, :3] = slope
    rest[:3, 3:6] = mass.mass * np.array([[0.0, -w, v], [w, 0.0, -u], [-v, u, 0.0]])
    rest[:3, 6:8] = mass.mass * GRAVITY * np.array([[0.0, -cp], [cp, 0.0], [0.0, -sp]])
    rest[6:, 3:6] = euler_rates(0.0, pitch)
    inertia = np.eye(9)
    inertia[:3, :3] *= mass.mass
    inertia[3:6, 3:6] = mass.inertia_B
    full = _engines(aircraft, velocity_B, 1.0) - _engines(aircraft, velocity_B, 0.0)
    return Body(STATES, np.eye(6, 9), inertia, np.eye(9, 6), rest,
                np.concatenate([full, np.zeros(3)]), -slope)


def _engines(aircraft: Aircraft, velocity_B: FloatArray, throttle: float) -> FloatArray:
    return np.concatenate(thrust(aircraft, velocity_B, throttle))


def rolling_body(mass: MassProperties, velocity_B: FloatArray, axis_B: FloatArray) -> Body:
    """
    Return a body held at its centre of gravity, free to turn about an axis: y = (rate, angle).

    axis_B (3,) of unit length; velocity_B (3,) through the air [m/s], which the body sees from
    another side as it turns; about its own direction it does not, and the angle is left out.
    """
    motion, push, rest = np.zeros((6, 2)), np.zeros((2, 6)), np.zeros((2, 2))
    motion[3:, 0], motion[:3, 1] = axis_B, np.cross(velocity_B, axis_B)
    push[0, 3:], rest[1, 0] = axis_B, 1.0
    inertia = np.diag([float(axis_B @ mass.inertia_B @ axis_B), 1.0])
    kept = 2 if np.abs(motion[:3, 1]).max() > 1e-9 * np.abs(velocity_B).max() else 1
    return Body(('rate', 'angle')[:kept], motion[:, :kept], inertia[:kept, :kept], push[:kept],
                rest[:kept, :kept], np.zeros(kept), np.zeros((kept, 3)))
