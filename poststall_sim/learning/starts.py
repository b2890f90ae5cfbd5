# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""Where episodes begin, drawn at random: ranges of a state and of the air it is in."""

import dataclasses
import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from poststall_sim.campaign.case import Initial
from poststall_sim.records import ConfigError
from poststall_sim.turbulence import Spectrum, military
from poststall_sim.weather import Weather

Range = tuple[float, float]

_TURN = (-math.pi, math.pi)
_RATE = (-20.0, 20.0)
_LIMITS: dict[str, Range] = {
    'airspeed': (0.1, 400.0), 'alpha': _TURN, 'beta': (-math.pi / 2, math.pi / 2),
    'roll': _TURN, 'heading': _TURN, 'roll_rate': _RATE, 'pitch_rate': _RATE, 'yaw_rate': _RATE,
    'altitude': (0.1, 20_000.0), 'wind': (0.0, 100.0), 'wind_heading': _TURN,
    'turbulence': (0.0, 20.0)}


@dataclass(frozen=True, slots=True)
class Starts:
    """
    Ranges (low, high) of where episodes begin, evenly drawn; a number alone is always that.

    airspeed [m/s]; alpha, beta, roll, heading [rad]; roll_rate, pitch_rate, yaw_rate [rad/s];
    altitude [m]; wind [m/s], and wind_heading [rad], where it blows to; turbulence : root mean
    square of its vertical component [m/s], Dryden's by MIL-F-8785C. The path through the air
    goes the way of the trim that gives the controls, as far as alpha and roll allow.
    """

    airspeed: Range = (8.0, 11.0)
    alpha: Range = (0.25, 0.6)
    beta: Range = (-0.1, 0.1)
    roll: Range = (-0.8, 0.8)
    heading: Range = _TURN
    roll_rate: Range = (-1.0, 1.0)
    pitch_rate: Range = (-0.5, 0.5)
    yaw_rate: Range = (-0.5, 0.5)
    altitude: Range = (100.0, 150.0)
    wind: Range = (0.0, 3.0)
    wind_heading: Range = _TURN
    turbulence: Range = (0.0, 0.5)

    def __post_init__(self) -> None:
        """Refuse what is no range, or leaves what can be flown."""
        for name, limits in _LIMITS.items():
            object.__setattr__(self, name, _range(name, getattr(self, name), limits))

    def changed(self, changes: Mapping[str, Any] | None) -> 'Starts':
        """Return starts with other ranges, by name."""
        for name in changes or {}:
            if name not in _LIMITS:
                raise ConfigError(f'unknown start {name!r}, there are {", ".join(_LIMITS)}')
        return dataclasses.replace(self, **(changes or {}))

    def drawn(self, generator: np.random.Generator,
              trim_airspeed: float) -> tuple[Initial, Weather]:
        """Return a start and its air; what is drawn of one does not depend on another's range."""
        shares = generator.random(len(_LIMITS))
        seed = int(generator.integers(2 ** 53))
        # By shares: low and high themselves are met, also where they are the same.
        at = {name: low + share * (high - low) for share, (name, (low, high)) in
              zip(shares.tolist(), ((name, getattr(self, name)) for name in _LIMITS))}
        rough = military(Spectrum.DRYDEN, at['turbulence'], altitude=at['altitude'], seed=seed) \
            if at['turbulence'] > 0.0 else None
        to = at['wind_heading']
        weather = Weather(at['wind'] * np.array([math.cos(to), math.sin(to), 0.0]),
                          turbulence=rough)
        return Initial(
            trim_airspeed=trim_airspeed, altitude=at['altitude'], airspeed=at['airspeed'],
            alpha=at['alpha'], beta=at['beta'], roll=at['roll'], heading=at['heading'],
            rates_B=(at['roll_rate'], at['pitch_rate'], at['yaw_rate'])), weather


def _range(name: str, given: Any, limits: Range) -> Range:
    try:
        low, high = (given, given) if np.ndim(given) == 0 else given
        low, high = float(low), float(high)
    except (TypeError, ValueError):
        low, high = math.nan, math.nan
    if not limits[0] <= low <= high <= limits[1]:
        raise ConfigError(f'start {name} must be a number, or (low, high), from {limits[0]:.4g} '
                          f'to {limits[1]:.4g}, got {given!r}')
    return low, high
