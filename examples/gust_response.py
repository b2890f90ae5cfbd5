# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""A trimmed aircraft flies into a gust from below: load factor, against the estimate of Pratt."""

import figures
import numpy as np

from poststall_sim import definition, polar, simulation
from poststall_sim.frames import GRAVITY
from poststall_sim.polar import Condition
from poststall_sim.weather import Gust, Weather

AIRSPEED, ALTITUDE, AHEAD = 15.0, 100.0, 5.0


def slope(flight):
    """Return the lift slope of the aircraft at its trim [1/rad]."""
    alpha, density = flight.snapshot.alpha, flight.snapshot.density
    points = polar.sweep(flight.model, [Condition(alpha - 0.01), Condition(alpha + 0.01)],
                         airspeed=AIRSPEED, density=density)
    low, high = (point.coefficients.CL for point in points)
    return (high - low) / 0.02


def main(arguments):
    """Fly through the gust, print the greatest load factor, draw its history."""
    trainer = definition.aircraft(definition.find('aircraft', 'trainer'))
    chord = trainer.reference.chord
    gust = Gust(velocity_N=np.array([0.0, 0.0, -arguments.speed]), length=12.5 * chord,
                begin=AHEAD, direction_N=np.array([1.0, 0.0, 0.0]))
    flight = simulation.start(trainer, airspeed=AIRSPEED, altitude=ALTITUDE,
                              weather=Weather(np.zeros(3), gusts=(gust,)))
    seen = [flight.snapshot]
    while flight.snapshot.time < 1.5:
        seen.append(flight.step(flight.trim))
    time = np.array([snapshot.time for snapshot in seen])
    load = np.array([snapshot.load_factor for snapshot in seen])
    stalled = max(float(np.mean(snapshot.strips.stalled)) for snapshot in seen)
    # K. G. Pratt, W. G. Walker, NACA Report 1206, 1954: a gust of 25 chords in all.
    density, area = seen[0].density, trainer.reference.area
    lift_slope = slope(flight)
    ratio = 2.0 * trainer.mass.mass / (density * chord * lift_slope * area)
    sharp = density * AIRSPEED * arguments.speed * lift_slope * area / (
        2.0 * trainer.mass.mass * GRAVITY)
    expected = sharp * 0.88 * ratio / (5.3 + ratio)
    print(f'gust of {arguments.speed:g} m/s over {2.0 * gust.length:.1f} m')
    print(f'greatest load factor {load.max():.3f}, by Pratt {1.0 + expected:.3f}, '
          f'at once and without alleviation {1.0 + sharp:.3f}')
    print(f'share of strips stalled at most {stalled:.2f}')
    if arguments.figure:
        with figures.drawn(arguments.figure) as (axes,):
            axes.plot(time, load, label='simulated')
            axes.axhline(1.0 + expected, linestyle='--', label='peak by Pratt')
            axes.set(xlabel='time [s]', ylabel='load factor', title='gust from below')


if __name__ == '__main__':
    parser = figures.options(__doc__)
    parser.add_argument('--speed', type=float, default=2.0, help='of the gust [m/s]')
    main(parser.parse_args())
