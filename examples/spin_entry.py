# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""A spin entered from a stall with full rudder: how fast it turns, how far it is stalled."""

import math

import figures
import numpy as np
from scipy.integrate import trapezoid

from poststall_sim import definition, jobs, simulation
from poststall_sim.frames import rotation


def main(arguments):
    """Fly the shipped scenario until it spins, print what it does, draw it."""
    trainer = definition.aircraft(definition.find('aircraft', 'trainer'))
    scenario = definition.scenario(definition.find('scenarios', 'spin'))
    flight = simulation.start(trainer, airspeed=scenario.airspeed, altitude=scenario.altitude)
    duration = 9.0 if arguments.quick else 14.0   # the recovery begins at 14 s
    seen = list(jobs.fly(flight, scenario, duration))
    time = np.array([snapshot.time for snapshot in seen])
    alpha = np.degrees([snapshot.alpha for snapshot in seen])
    turning = np.array([(rotation(snapshot.body.q_NB) @ snapshot.body.rates_B)[2]
                        for snapshot in seen])
    wing = flight.model.lattice.grids[0].strips
    y = flight.model.lattice.quarter_chord[wing, 1]
    stalled = np.array([snapshot.strips.stalled[wing] for snapshot in seen[-100:]])
    spinning = time > 5.0
    turns = trapezoid(turning[spinning], time[spinning]) / (2.0 * math.pi)
    print(f'turns {turns:.2f} to the right since the rudder, in {time[-1] - 5.0:.1f} s')
    print(f'rate of turn at the end {math.degrees(turning[-100:].mean()):.0f} deg/s')
    print(f'alpha at the end {alpha[-100:].mean():.1f} deg')
    print(f'share of strips stalled: left {stalled[:, y < 0.0].mean():.2f}, '
          f'right {stalled[:, y > 0.0].mean():.2f}')
    if arguments.figure:
        with figures.drawn(arguments.figure, rows=2) as (above, below):
            above.plot(time, alpha)
            above.set(ylabel='alpha [deg]', title='spin to the left')
            below.plot(time, np.degrees(turning))
            below.set(xlabel='time [s]', ylabel='turn to the right [deg/s]')


if __name__ == '__main__':
    main(figures.options(__doc__).parse_args())
