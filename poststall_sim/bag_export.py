# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""
The flight in a bag as time series for files.

Names and units are those of a flight that is flown, see `flight_export`; angles in degrees.
"""

from pathlib import Path

import numpy as np

from poststall_sim import recording, topics
from poststall_sim.aircraft import Aircraft
from poststall_sim.flight_export import OF_STRIPS, by_name
from poststall_sim.frames import FloatArray, swap_body_flu, swap_ned_enu
from poststall_sim.plots import bag as bags
from poststall_sim.plots.bag import FlightData
from poststall_sim.plots.lookup import Lookup, onto
from poststall_sim.plots.strips import StripData
from poststall_sim.time_series import FlightSeries, Series, Strips

_VECTORS = (('odom', 'twist.twist.linear', 'velocity', 'm_s'),
            ('wrench', 'wrench.force', 'force', 'N'),
            ('wrench', 'wrench.torque', 'moment', 'N_m'),
            ('wrench/propulsion', 'wrench.force', 'thrust', 'N'),
            ('wrench/propulsion', 'wrench.torque', 'thrust_moment', 'N_m'),
            ('accel', 'accel.linear', 'acceleration', 'm_s2'))
"""Topic, field, name and unit of what stands in base_link."""


def of_bag(path: Path,
           aircraft: Aircraft | None = None) -> tuple[FlightSeries, tuple[str, ...]]:
    """Return the flight in a bag as far as its topics are there, and notes on what is not."""
    bag = Lookup(recording.read(path))
    flight = bags.of_topics(bag, path.resolve().name, aircraft)
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
    columns |= _vectors(bag, flight.time)
    strips = None if flight.strips is None else _strips(bag, flight.strips)
    return FlightSeries(flight.name, by_name(columns), strips), flight.notes


def _vectors(bag: Lookup, time: FloatArray) -> dict[str, FloatArray]:
    """Return velocity, loads and acceleration along the axes of B, and the wind."""
    columns: dict[str, FloatArray] = {}
    for topic, prefix, name, unit in _VECTORS:
        found = bag.column(topic, *(f'{prefix}.{axis}' for axis in 'xyz'))
        if found is not None:
            vector = swap_body_flu(onto(time, found))
            columns |= {f'{name}_{axis}_{unit}': vector[:, i] for i, axis in enumerate('xyz')}
    wind = bag.column('wind/applied', *(f'vector.{axis}' for axis in 'xyz'))
    if wind is not None:
        columns |= dict(zip(('wind_east_m_s', 'wind_north_m_s', 'wind_up_m_s'),
                            onto(time, wind).T))
    return columns


def _euler(flight: FlightData) -> dict[str, FloatArray]:
    """Return roll, pitch and yaw [deg], yaw from north, of base_link in map."""
    # Columns are the axes of base_link in map: of B in N by the same swaps as any vector.
    x = swap_ned_enu(flight.attitude[:, :, 0])
    y, z = (-swap_ned_enu(flight.attitude[:, :, i]) for i in (1, 2))
    return {'roll_deg': np.degrees(np.arctan2(y[:, 2], z[:, 2])),
            'pitch_deg': np.degrees(flight.pitch),
            'yaw_deg': np.degrees(np.arctan2(x[:, 1], x[:, 0]))}


def _strips(bag: Lookup, found: StripData) -> Strips:
    names = np.full(len(found.y), '', dtype=object)
    for group in found.groups:
        names[group.strips] = group.name
    series = {'cl': found.cl}
    for name, topic in (('cd', 'strip_cd'), ('cm', 'strip_cm'), ('circulation', 'strip_gamma')):
        pair = bag.column(topic, 'data')
        if pair is not None and pair[1].shape[1:] == found.y.shape:
            series[name] = onto(found.time, pair)
    series |= {name: np.degrees(values) for name, values in (
        ('alpha', found.alpha), ('decambering', found.delta)) if values is not None}
    if found.stalled is not None:
        series['stalled'] = found.stalled.astype(float)
    return Strips(found.time, found.y, tuple(names), found.chord,
                  {name: Series(values, OF_STRIPS[name]) for name, values in series.items()})
