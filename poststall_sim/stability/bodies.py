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

from poststall_sim import propulsion
from poststall_sim.aircraft import Aircraft, MassProperties
from poststall_sim.engines import Propeller
from poststall_sim.frames import GRAVITY, FloatArray, euler_rates
from poststall_sim.propulsion import Meeting
from poststall_sim.state import EngineState

STATES = ('u', 'v', 'w', 'p', 'q', 'r', 'phi', 'theta', 'psi')
"""Of a free body: velocity and rates in B [m/s, rad/s] and Euler angles [rad]."""
_STEPS = {'velocity': 1e-3, 'rate': 1e-3, 'speed': 1e-2, 'throttle': 1e-4}
"""Changes by which the engines' loads are derived [m/s, rad/s, rad/s of a shaft, -]."""


@dataclass(frozen=True, slots=True, eq=False)
class Body:
    """
    The matrices of the head of this file.

    names (m,); motion (6, m) N; mass (m, m) M; push (m, 6) P; rest (m, m) R : weight, turning
    axes, engines and shafts; throttle (m,) and wind (m, 3) : M dy/dt by the engines per unit of
    throttle, and per velocity of the air in B.
    """

    names: tuple[str, ...]
    motion: FloatArray
    mass: FloatArray
    push: FloatArray
    rest: FloatArray
    throttle: FloatArray
    wind: FloatArray


def free_body(aircraft: Aircraft, *, velocity_B: FloatArray, pitch: float, throttle: float,
              density: float, bank: float = 0.0) -> Body:
    """
    Return an aircraft in straight flight, free to move; states as in `STATES`, then shafts.

    With the full inertia tensor in M and v0, phi0, theta0 those of the trim,

        M d(nu)/dt = L + d(T)/d(nu) nu + d(T)/d(Omega) Omega - (omega x m v0, 0)
                     + m g (d/dTheta)(R_BN z_N) Theta,
        d(Theta)/dt = W(phi0, theta0) omega,
        d(Omega)/dt = as in `propulsion`, of each propeller; the charge of its battery is held.

    velocity_B (3,) through the air [m/s], which is at rest and of one density [kg/m^3]; pitch
    [rad], below 90 deg either way; throttle held. (Etkin & Reid, Dynamics of Flight, 3rd ed.,
    1996, sec. 4.9)
    """
    shafts = [i for i, engine in enumerate(aircraft.engines) if isinstance(engine, Propeller)]
    states = 9 + len(shafts)
    names = (*STATES, *(f'shaft[{aircraft.engine_names[i]}]' for i in shafts))
    engines = _Engines(aircraft, velocity_B, throttle, density, shafts)
    by_motion, by_speed, by_throttle = engines.slopes()
    u, v, w = velocity_B
    sf, cf, sp, cp = np.sin(bank), np.cos(bank), np.sin(pitch), np.cos(pitch)
    rows = [*range(6), *range(9, states)]
    rest = np.zeros((states, states))
    rest[rows, :6], rest[np.ix_(rows, range(9, states))] = by_motion, by_speed
    mass = aircraft.mass
    rest[:3, 3:6] += mass.mass * np.array([[0.0, -w, v], [w, 0.0, -u], [-v, u, 0.0]])
    rest[:3, 6:8] = mass.mass * GRAVITY * np.array(
        [[0.0, -cp], [cf * cp, -sf * sp], [-sf * cp, -cf * sp]])
    rest[6:9, 3:6] = euler_rates(bank, pitch)
    inertia = np.eye(states)
    inertia[:3, :3] *= mass.mass
    inertia[3:6, 3:6] = mass.inertia_B
    by_control, wind = np.zeros(states), np.zeros((states, 3))
    by_control[rows], wind[rows] = by_throttle, -by_motion[:, :3]
    return Body(names, np.eye(6, states), inertia, np.eye(states, 6), rest, by_control, wind)


class _Engines:
    """The load (6,) of the engines and d(Omega)/dt of their shafts, and how they change."""

    def __init__(self, aircraft: Aircraft, velocity_B: FloatArray, throttle: float,
                 density: float, shafts: list[int]) -> None:
        self._aircraft, self._density, self._shafts = aircraft, density, shafts
        self._motion, self._throttle = np.concatenate([velocity_B, np.zeros(3)]), throttle
        self._state = propulsion.settled(aircraft, self._met(self._motion, throttle))

    def _met(self, motion: FloatArray, throttle: float) -> Meeting:
        asked = propulsion.throttles(self._aircraft, throttle, frozenset())
        return Meeting(motion[:3], motion[3:], self._density, asked)

    def _at(self, motion: FloatArray, speed: FloatArray, throttle: float) -> FloatArray:
        state = EngineState(speed, self._state.charge)
        met = self._met(motion, throttle)
        return np.concatenate([
            propulsion.loads(self._aircraft, state, met).load,
            propulsion.spins(self._aircraft, state, met)[self._shafts]])

    def slopes(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return d/d(nu) (6 + k, 6), d/d(Omega) (6 + k, k) and d/d(throttle) (6 + k,)."""
        motion, speed, throttle = self._motion, self._state.speed, self._throttle
        steps = np.diag([_STEPS['velocity']] * 3 + [_STEPS['rate']] * 3)
        by_motion = np.column_stack([
            (self._at(motion + step, speed, throttle) - self._at(motion - step, speed, throttle))
            / (2.0 * step.sum()) for step in steps])
        by_speed = np.zeros((len(by_motion), len(self._shafts)))
        for column, i in enumerate(self._shafts):
            step = _STEPS['speed'] * np.eye(len(speed))[i]
            low, high = np.maximum(speed - step, 0.0), speed + step
            by_speed[:, column] = (self._at(motion, high, throttle)
                                   - self._at(motion, low, throttle)) / (high - low).sum()
        less, more = (min(max(throttle + change, 0.0), 1.0)
                      for change in (-_STEPS['throttle'], _STEPS['throttle']))
        by_throttle = (self._at(motion, speed, more) - self._at(motion, speed, less)) \
            / (more - less)
        return by_motion, by_speed, by_throttle


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
