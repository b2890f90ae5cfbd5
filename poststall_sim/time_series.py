# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""
A flight as time series in files that need nothing of this package: CSV, or MATLAB's (.mat).

Both have the same series; only the second has the strips. In a CSV each head has its unit,
``alpha [deg]``. In a .mat each series is a column by its name, the struct ``units`` has theirs;
``strips`` is a struct of ``time`` (m,), ``y``, ``chord`` (k,), ``surface`` and what happens there,
(m, k), with ``units`` of its own.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from scipy import io

from poststall_sim import atomic_file
from poststall_sim.frames import FloatArray

AXES = ('north, east, altitude from the start of the map; roll, pitch, yaw from north-east-down '
        'to body axes x forward, y right, z down at the centre of gravity; rates about those; '
        'alpha, beta of the velocity through the air; deflections positive trailing edge down; '
        'strip y to the left')


@dataclass(frozen=True, slots=True, eq=False)
class Series:
    """Values over time, (n,) or (m, k), with their unit."""

    values: FloatArray
    unit: str


@dataclass(frozen=True, slots=True, eq=False)
class Strips:
    """Series (m, k) over their own times (m,) [s], on strips at y (k,) [m] to the left."""

    time: FloatArray
    y: FloatArray
    surface: tuple[str, ...]
    chord: FloatArray | None = None
    series: Mapping[str, Series] = field(default_factory=dict)


@dataclass(frozen=True, slots=True, eq=False)
class FlightSeries:
    """A flight: its name, series by name, all of one length and the time first, and strips."""

    name: str
    series: Mapping[str, Series]
    strips: Strips | None = None


def write_csv(path: Path, flight: FlightSeries) -> None:
    """Write the series as CSV, whole or not at all; blank what is not known."""
    lines = [[f'{name} [{each.unit}]' for name, each in flight.series.items()]]
    lines += [['' if math.isnan(value) else f'{value:.10g}' for value in row]
              for row in zip(*(each.values for each in flight.series.values()))]
    with atomic_file.writing(path) as file:
        file.write(''.join(','.join(cells) + '\n' for cells in lines).encode())


def write_mat(path: Path, flight: FlightSeries) -> None:
    """Write series and strips for MATLAB, whole or not at all."""
    fields = {name: each.values for name, each in flight.series.items()}
    fields |= {'units': {name: each.unit for name, each in flight.series.items()},
               'aircraft': flight.name, 'axes': AXES}
    if flight.strips is not None:
        strips = flight.strips
        fields['strips'] = {
            'time': strips.time, 'y': strips.y,
            'surface': np.array(strips.surface, dtype=object),
            **({} if strips.chord is None else {'chord': strips.chord}),
            **{name: each.values for name, each in strips.series.items()},
            'units': {'time': 's', 'y': 'm', 'chord': 'm',
                      **{name: each.unit for name, each in strips.series.items()}}}
    with atomic_file.writing(path) as file:
        io.savemat(file, fields, do_compression=True, oned_as='column', long_field_names=True)

