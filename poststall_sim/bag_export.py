# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""
The flight in a bag as time series for files.

Names and units are those of a flight that is flown, see `flight_export`; angles in degrees.
"""

from pathlib import Path

import numpy as np

from poststall_sim import topics
from poststall_sim.aircraft import Aircraft
from poststall_sim.flight_export import OF_STRIPS, by_name
from poststall_sim.frames import FloatArray, swap_ned_enu
from poststall_sim.plots import bag as bags
from poststall_sim.plots.bag import FlightData
from poststall_sim.plots.strips import StripData
from poststall_sim.time_series import FlightSeries, Series, Strips


def of_bag(path: Path,
           aircraft: Aircraft | None = None) -> tuple[FlightSeries, tuple[str, ...]]:
    """Return the flight in a bag as far as its topics are there, and notes on what is not."""
    flight = bags.flight_data(path, aircraft)
    columns: dict[str, FloatArray] = {'time_s': flight.time}
    if flight.position is not None:
        columns |= {'north_m': flight.position[:, 1], 'east_m': flight.position[:, 0],
                    'altitude_m': flight.position[:, 2]}
    for key, values in (('airspeed_m_s', flight.airspeed), ('sink_rate_m_s', flight.sink_rate)):
        if values is not None:
            columns[key] = values
    for key, values in (('alpha_deg', flight.alpha), ('beta_deg', flight.beta)):
        if values is not None:
            columns[key] = np.degrees(values)
    if flight.attitude is not None:
        columns |= _euler(flight)
    if flight.rates is not None:
        columns |= dict(zip(('roll_rate_deg_s', 'pitch_rate_deg_s', 'yaw_rate_deg_s'),
                            np.degrees(flight.rates).T))
    for key, values in (('load_factor', flight.load_factor), ('CL', flight.lift)):
        if values is not None:
            columns[key] = values
    for name, values in flight.deflections.items():
        columns[name if name == topics.THROTTLE else f'{name}_deg'] = \
            values if name == topics.THROTTLE else np.degrees(values)
    strips = None if flight.strips is None else _strips(flight.strips)
    return FlightSeries(flight.name, by_name(columns), strips), flight.notes


def _euler(flight: FlightData) -> dict[str, FloatArray]:
    """Return roll, pitch and yaw [deg], yaw from north, of base_link in map."""
    # Columns are the axes of base_link in map: of B in N by the same swaps as any vector.
    x = swap_ned_enu(flight.attitude[:, :, 0])
    y, z = (-swap_ned_enu(flight.attitude[:, :, i]) for i in (1, 2))
    return {'roll_deg': np.degrees(np.arctan2(y[:, 2], z[:, 2])),
            'pitch_deg': np.degrees(flight.pitch),
            'yaw_deg': np.degrees(np.arctan2(x[:, 1], x[:, 0]))}


def _strips(found: StripData) -> Strips:
    names = np.full(len(found.y), '', dtype=object)
    for group in found.groups:
        names[group.strips] = group.name
    series = {'cl': found.cl}
    series |= {name: np.degrees(values) for name, values in (
        ('alpha', found.alpha), ('decambering', found.delta)) if values is not None}
    if found.stalled is not None:
        series['stalled'] = found.stalled.astype(float)
    return Strips(found.time, found.y, tuple(names), found.chord,
                  {name: Series(values, OF_STRIPS[name]) for name, values in series.items()})
