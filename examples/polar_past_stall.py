# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""The polar of a wing through its stall, with decambering and without."""

import math

import figures
import numpy as np

from poststall_sim import definition, polar
from poststall_sim.aero import model as models
from poststall_sim.aero.model import Settings
from poststall_sim.polar import Condition

AIRSPEED, DENSITY = 15.0, 1.225


def lift(aircraft, alphas, decambering):
    """Return the lift coefficient at each angle of attack [rad]; NaN where none was found."""
    model = models.build(aircraft, Settings(decambering=decambering))
    points = polar.sweep(model, [Condition(alpha) for alpha in alphas],
                         airspeed=AIRSPEED, density=DENSITY)
    return np.array([point.coefficients.CL for point in points])


def main(arguments):
    """Sweep, print what is of interest, draw."""
    wing = definition.aircraft(definition.find('aircraft', arguments.aircraft))
    alphas = np.radians(np.arange(0.0, 41.0, 4.0 if arguments.quick else 1.0))
    real, attached = lift(wing, alphas, True), lift(wing, alphas, False)
    slope = (attached[1] - attached[0]) / (alphas[1] - alphas[0])
    aspect = wing.reference.span ** 2 / wing.reference.area
    peak = int(np.argmax(real[alphas < math.radians(25.0)]))
    print(f'aspect ratio {aspect:.2f}')
    print(f'lift slope {slope:.3f} per rad, of a lifting line with elliptic loading '
          f'{2.0 * math.pi * aspect / (aspect + 2.0):.3f}')
    print(f'greatest lift {real[peak]:.3f} at {math.degrees(alphas[peak]):.0f} deg, '
          f'without decambering {attached[peak]:.3f}')
    print(f'lift at 30 deg {np.interp(math.radians(30.0), alphas, real):.3f}, '
          f'without decambering {np.interp(math.radians(30.0), alphas, attached):.3f}')
    if arguments.figure:
        with figures.drawn(arguments.figure) as (axes,):
            axes.plot(np.degrees(alphas), attached, '--', label='attached flow')
            axes.plot(np.degrees(alphas), real, label='with decambering')
            axes.set(xlabel='alpha [deg]', ylabel='CL', title=wing.name)


if __name__ == '__main__':
    parser = figures.options(__doc__)
    parser.add_argument('--aircraft', default='free_roll_wing', help='a name or a file')
    main(parser.parse_args())
