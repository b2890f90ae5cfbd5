# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""
Steady flight with the wake of the turn: what `manoeuvre` finds with straight wakes, made to stay.

The wake of a turn or a pull-up lies along its path, and its loads are had by marching the flow
along that (`steady_motion`). What they differ by from those with straight wakes hardly changes
with the flight: it is added to them, and the balance is looked for again, until the marched loads
themselves balance. A flight begun `turning` has that wake, and stays on its trim if it is stable:
the trainer at 15 m/s in turns of 10 to 40 deg/s, flown for a minute with its controls held, within
2e-4 m/s and 1e-3 deg of alpha, sideslip and bank. A free wake is moved at every `free_every`-th
step, and its loads go up and down with that: the bank goes by 0.2 deg in 20 s.
"""

from dataclasses import replace

import numpy as np

from poststall_sim import manoeuvre
from poststall_sim import trim as trims
from poststall_sim.aero import steady_motion
from poststall_sim.aero.model import Model
from poststall_sim.aero.solver import AeroResult
from poststall_sim.aero.wake import Shape
from poststall_sim.coupling import placement
from poststall_sim.frames import FloatArray
from poststall_sim.manoeuvre import Task
from poststall_sim.simulation import automatic_dt_ns
from poststall_sim.state import BodyState, Status
from poststall_sim.trim import ACCEPTED, Trim, balance

ROUNDS = 10
"""How often the loads are marched: what is left falls by 10 (at the stall) to 200 each time."""


def steady(model: Model, task: Task, *, altitude: float, start: Trim | None = None,
           dt_ns: int | None = None) -> Trim:
    """
    Return the steady flight that a task asks for, where it turns with the wake of the turn.

    See `manoeuvre.steady`; what is straight is what that returns, as is all in steps of steady
    flow or with a frozen wake. dt_ns : the step of the flight to come, None for
    `automatic_dt_ns`: the rows of the wake are that long.
    """
    found = manoeuvre.steady(model, task, altitude=altitude, start=start)
    settings = model.settings
    if found.status is not Status.CONVERGED or not found.rates_B.any() \
            or not settings.unsteady or settings.wake is Shape.FROZEN:
        return found
    dt = 1e-9 * (automatic_dt_ns(model, found.airspeed) if dt_ns is None else dt_ns)
    more = np.zeros(6)
    for _ in range(ROUNDS):
        marched = _marched(model, found, altitude, dt)
        residual, side = balance(model, marched)
        marched = replace(marched, turning=True, residual=np.append(residual, side)
                          if task.coordinated else residual)
        worst = float(np.abs(marched.residual).max())
        if marched.aero.status is not Status.CONVERGED:
            return _missed(marched, 'the aerodynamics did not converge with the wake of the turn, '
                           f'residual {marched.aero.max_residual:.1e}')
        if worst <= ACCEPTED:
            return replace(marched, message='trimmed with the wake of the turn')
        more = more + _load(marched.aero) - _load(found.aero)
        found = manoeuvre.steady(model, task, altitude=altitude, start=found, more=more)
        if found.status is not Status.CONVERGED:
            return _missed(found, f'with the wake of the turn {found.message}')
    return _missed(marched, f'no balance found with the wake of the turn, residual {worst:.1e}')


def _marched(model: Model, found: Trim, altitude: float, dt: float) -> Trim:
    """Return a flight with the loads of the wake that it leaves behind."""
    air = model.atmosphere.at(altitude)
    body = BodyState(np.array([0.0, 0.0, -altitude]), found.velocity_B, found.rates_B, found.q_NB)
    flown = trims.tight(model).at(
        found.airspeed, air.kinematic_viscosity, found.controls.deflections, found.angles)
    _, aero = steady_motion.march(
        flown, trims.onset_of(model, found, air.density), placement(model.aircraft, body),
        found.controls.deflections, density=air.density, dt=dt, delta0=found.aero.strips.delta,
        angles=found.angles)
    return replace(found, aero=aero)


def _load(aero: AeroResult) -> FloatArray:
    return np.concatenate([aero.force_G, aero.moment_G])


def _missed(found: Trim, message: str) -> Trim:
    return replace(found, status=Status.NOT_CONVERGED, message=message)
