# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""
Flights as time series for files, while they are flown.

Names and units are those of `jobs.FlightLog`, whose keys end in their unit; angles in degrees.
"""

import numpy as np

from poststall_sim import topics
from poststall_sim.aero.lattice import Lattice
from poststall_sim.frames import FloatArray, swap_ned_enu
from poststall_sim.jobs import FlightLog
from poststall_sim.simulation import Flight
from poststall_sim.state import Snapshot
from poststall_sim.time_series import FlightSeries, Series, Strips

_SUFFIXES = {'_deg_s': 'deg/s', '_m_s': 'm/s', '_m_s2': 'm/s^2', '_kg_m3': 'kg/m^3', '_N_m': 'N m',
             '_deg': 'deg', '_N': 'N', '_m': 'm', '_s': 's'}
OF_STRIPS = {'cl': '-', 'cd': '-', 'cm': '-', 'alpha': 'deg', 'decambering': 'deg',
              'circulation': 'm^2/s', 'stalled': '-'}
"""Units of the strips' series, by name in the order in which they are gathered."""


def named(key: str) -> tuple[str, str]:
    """Return the name and the unit of a key that ends in one: alpha_deg, deg."""
    for suffix, unit in _SUFFIXES.items():
        if key.endswith(suffix):
            return key.removesuffix(suffix), unit
    return key, 'rad' if key == 'residual' else '-'


class Collector:
    """Gathers a flight as it is flown, at the rate of the state, strips and all."""

    def __init__(self, flight: Flight, log: FlightLog) -> None:
        self._name, self._lattice = flight.model.aircraft.name, flight.model.lattice
        self._log = log
        self._schedule = topics.Schedule({})
        self._rows: list[dict[str, float]] = []
        self._strips: list[list[FloatArray]] = []
        self.add(flight.snapshot)

    def add(self, snapshot: Snapshot) -> None:
        """Take note of a step."""
        if all(topic.rate is not topics.Rate.STATE
               for topic in self._schedule.due(snapshot.time_ns)):
            return
        self._rows.append(self._log.row(snapshot) | _loads(snapshot))
        strips = snapshot.strips
        self._strips.append([
            strips.cl, strips.cd, strips.cm, np.degrees(strips.alpha), np.degrees(strips.delta),
            strips.circulation, np.asarray(strips.stalled, dtype=float)])

    def series(self) -> FlightSeries:
        """Return what has been gathered."""
        columns = {key: np.array([row[key] for row in self._rows]) for key in self._rows[0]}
        by_kind = np.array(self._strips).transpose(1, 0, 2)
        strips = Strips(
            columns['time_s'], -self._lattice.quarter_chord[:, 1], _surfaces(self._lattice),
            np.array(self._lattice.strip_chord),
            {name: Series(values, unit)
             for (name, unit), values in zip(OF_STRIPS.items(), by_kind)})
        return FlightSeries(self._name, by_name(columns), strips)


def _loads(snapshot: Snapshot) -> dict[str, float]:
    """Return velocities and loads in body axes, and the air, beyond what a log has."""
    result = {}
    for name, vector, unit in (
            ('velocity', snapshot.body.velocity_B, 'm_s'), ('force', snapshot.force_B, 'N'),
            ('moment', snapshot.moment_B, 'N_m'), ('thrust', snapshot.thrust_B, 'N'),
            ('thrust_moment', snapshot.thrust_moment_B, 'N_m'),
            ('acceleration', snapshot.acceleration_B, 'm_s2')):
        result |= {f'{name}_{axis}_{unit}': float(x) for axis, x in zip('xyz', vector)}
    east, north, up = swap_ned_enu(snapshot.wind_N)
    return result | {'wind_east_m_s': float(east), 'wind_north_m_s': float(north),
                     'wind_up_m_s': float(up), 'density_kg_m3': float(snapshot.density)}


def by_name(columns: dict[str, FloatArray]) -> dict[str, Series]:
    """Return columns, whose keys end in their unit, as series by name."""
    result = {}
    for key, values in columns.items():
        name, unit = named(key)
        result[name] = Series(values, unit)
    return result


def _surfaces(lattice: Lattice) -> tuple[str, ...]:
    return tuple(grid.name for grid in lattice.grids
                 for _ in range(grid.strips.start, grid.strips.stop))
