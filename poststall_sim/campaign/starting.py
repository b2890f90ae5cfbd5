# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""Where a flight begins: a body state thrown into the air, at the controls of a trim."""

import numpy as np

from poststall_sim import simulation, trim
from poststall_sim.aero.model import Model
from poststall_sim.campaign.case import Flying
from poststall_sim.frames import quaternion_from_euler, rotation, velocity_from_flow_angles
from poststall_sim.simulation import Flight
from poststall_sim.state import BodyState
from poststall_sim.trim import Trim


def flight(model: Model, found: Trim, task: Flying) -> Flight:
    """Return the flight of a task, ready to step; found : the trim that gives what it leaves."""
    initial = task.initial
    wind = task.weather.mean_N(initial.altitude)
    alpha = found.alpha if initial.alpha is None else initial.alpha
    pitch = trim.pitch_angle(alpha, initial.beta, initial.roll, found.climb_angle) \
        if initial.pitch is None else initial.pitch
    q_NB = quaternion_from_euler(initial.roll, pitch, initial.heading)
    body = BodyState(
        np.array([0.0, 0.0, -initial.altitude]),
        velocity_from_flow_angles(initial.airspeed, alpha, initial.beta) + rotation(q_NB).T @ wind,
        np.array(initial.rates_B), q_NB)
    fastest = max(initial.airspeed, initial.trim_airspeed)
    dt_ns = simulation.automatic_dt_ns(model, fastest) if task.dt is None else \
        round(task.dt * 1e9)
    return Flight(model, body, found.controls, dt_ns=dt_ns, weather=task.weather,
                  delta0=found.aero.strips.delta)
