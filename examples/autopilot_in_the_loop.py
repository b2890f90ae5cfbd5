# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""A law in the loop, without ROS: thrown past the stall, with the example law and with nobody."""

import math

import figures
import numpy as np

from poststall_sim import autopilot_law, definition, simulation
from poststall_sim.autopilot_law import Law, Memory, Seen
from poststall_sim.frames import (
    euler_from_quaternion,
    quaternion_from_euler,
    velocity_from_flow_angles,
)
from poststall_sim.state import BodyState, Controls


def thrown(aircraft):
    """Return a flight at 8 m/s, alpha 45 deg and a bank of 40 deg, at the controls of its trim."""
    flight = simulation.start(aircraft, airspeed=12.0, altitude=150.0)
    flight.place(BodyState(
        np.array([0.0, 0.0, -150.0]), velocity_from_flow_angles(8.0, math.radians(45.0), 0.0),
        np.array([0.5, 0.0, 0.0]),
        quaternion_from_euler(math.radians(40.0), math.radians(35.0), 0.0)), flight.trim)
    return flight


def flown(flight, duration, law=None):
    """Fly with a law, or at the controls of the trim; return snapshots."""
    names, seen = flight.model.aircraft.control_names, [flight.snapshot]
    trim = dict(zip(names, flight.trim.deflections.tolist()))
    memory = Memory(trim['aileron'], trim['elevator'], flight.trim.throttle)
    while flight.snapshot.time < duration and flight.paused_reason is None:
        controls = flight.trim
        if law is not None:
            now = flight.snapshot
            roll, pitch, _ = euler_from_quaternion(now.body.q_NB)
            told, memory = autopilot_law.answer(law, memory, Seen(
                float(roll), float(pitch), *now.body.rates_B.tolist(), now.airspeed, now.alpha,
                now.beta, float(np.mean(now.strips.stalled))), flight.dt_ns * 1e-9)
            controls = Controls([getattr(told, name) for name in names], told.throttle)
        seen.append(flight.step(controls))
    return seen


def main(arguments):
    """Fly both, print what they cost, draw."""
    trainer = definition.aircraft(definition.find('aircraft', 'trainer'))
    duration = 4.0 if arguments.quick else 8.0
    flights = {name: flown(thrown(trainer), duration, law)
               for name, law in (('nobody', None), ('law', Law()))}
    for name, seen in flights.items():
        heights = [snapshot.body.altitude for snapshot in seen]
        roll = math.degrees(euler_from_quaternion(seen[-1].body.q_NB)[0])
        print(f'{name}: lost {max(heights) - min(heights):.1f} m, bank at the end {roll:.1f} deg, '
              f'alpha {math.degrees(seen[-1].alpha):.1f} deg')
    if arguments.figure:
        with figures.drawn(arguments.figure, rows=2) as (above, below):
            for name, seen in flights.items():
                time = [snapshot.time for snapshot in seen]
                above.plot(time, [snapshot.body.altitude for snapshot in seen], label=name)
                below.plot(time, np.degrees([snapshot.alpha for snapshot in seen]), label=name)
            above.set(ylabel='altitude [m]')
            below.set(xlabel='time [s]', ylabel='alpha [deg]')


if __name__ == '__main__':
    main(figures.options(__doc__).parse_args())
