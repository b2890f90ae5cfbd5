# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""What the strips of a flight or of a polar show: span loading, and points on section curves."""

from collections.abc import Mapping

import numpy as np

from poststall_sim.aero import polars
from poststall_sim.aero.lattice import Lattice
from poststall_sim.aircraft import Aircraft
from poststall_sim.atmosphere import standard_air
from poststall_sim.frames import FloatArray
from poststall_sim.plots.lookup import Pair
from poststall_sim.plots.strips import StripData, looked_up
from poststall_sim.report.page import Data, numbers

_BEYOND = 6.0
"""How far curves go on past the angles that were flown [deg]."""
_MOST_CURVES = 6


def loading(strips: StripData, chosen: np.ndarray, angle: FloatArray | None) -> Data:
    """Return the strips at the chosen instants; angle (m, k) [rad] where curves are read."""
    low, high = float(strips.cl.min()), float(strips.cl.max())
    if strips.cl_max is not None:
        high = max(high, float(strips.cl_max[strips.wing].max()))
    return {
        'y': numbers(strips.y), 'cl': numbers(strips.cl[chosen]),
        'angle': None if angle is None else numbers(np.degrees(angle[chosen])),
        'stalled': None if strips.stalled is None else
        [''.join('1' if each else '0' for each in row) for row in strips.stalled[chosen]],
        'cl_max': None if strips.cl_max is None else numbers(strips.cl_max),
        'range': [low - 0.06 * (high - low), high + 0.08 * (high - low)],
        'groups': [{'name': group.name, 'begin': group.strips.start, 'end': group.strips.stop,
                    'upright': bool(np.ptp(strips.y[group.strips]) < 1e-6)}
                   for group in strips.groups]}


def angles(strips: StripData, lattice: Lattice | None, aircraft: Aircraft | None,
           deflections: Mapping[str, Pair]) -> FloatArray | None:
    """Return the angles (m, k) [rad] at which the sections' curves are read."""
    if strips.alpha is None or lattice is None or aircraft is None:
        return strips.alpha
    return looked_up(deflections, lattice, aircraft, strips.time, strips.alpha,
                     fades=strips.averaged)


def curves(lattice: Lattice, strips: StripData, angle: FloatArray, *, airspeed: float,
           altitude: float) -> list[Data]:
    """
    Return the lift curves of the sections, those of the wing first.

    Of sections with several tables: those of one airspeed [m/s] and altitude [m], no flap down.
    """
    flown = lattice.at(airspeed, standard_air(altitude).kinematic_viscosity,
                       np.zeros(len(lattice.shift)))
    low, high = (np.degrees(value) for value in (angle.min(), angle.max()))
    alpha = np.arange(max(low - _BEYOND, -180.0), min(high + _BEYOND, 180.0), 0.25)
    found: list[Data] = []
    out = np.empty((len(alpha), 4))
    for group in strips.groups:
        own = np.unique(flown.polar_index[group.strips])
        for number, index in enumerate(own, 1):
            polars.sections(flown.curves, np.full(len(alpha), index), np.radians(alpha), out)
            cl = numbers(out[:, 0])
            if not any(curve['cl'] == cl for curve in found):
                found.append({'name': group.name if len(own) == 1 else f'{group.name} {number}',
                              'wing': group is strips.groups[0],
                              'alpha': numbers(alpha), 'cl': cl})
    return found[:_MOST_CURVES]
