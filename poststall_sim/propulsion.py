# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""Thrust of the engines: a straight line over airspeed, scaled by the throttle."""

import numpy as np

from poststall_sim.aircraft import Aircraft
from poststall_sim.frames import FloatArray, cross, geometry_to_body


def thrust(aircraft: Aircraft, velocity_air_B: FloatArray,
           throttle: float) -> tuple[FloatArray, FloatArray]:
    """
    Return force [N] and moment about the centre of gravity [N m] of all engines, (3,) in B.

    velocity_air_B (3,) through the air [m/s]; throttle 0..1. A propeller that is pushed faster
    than its zero-thrust airspeed brakes no more than it pulls at rest.
    """
    force, moment = np.zeros(3), np.zeros(3)
    for engine in aircraft.engines:
        direction_B = geometry_to_body(np.array(engine.direction_G))
        along = float(velocity_air_B @ direction_B)
        share = min(max(1.0 - along / engine.zero_thrust_airspeed, -1.0), 1.0)
        push = throttle * engine.static_thrust * share * direction_B
        arm = np.array(engine.position_G) - np.array(aircraft.mass.cg_G)
        force += push
        moment += cross(geometry_to_body(arm), push)
    return force, moment
