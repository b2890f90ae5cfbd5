# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""
The atmosphere: the standard one, and those that are warmer, of another pressure or of one density.

The offsets stand at sea level and the column above is in hydrostatic balance again: warmer air
loses less pressure with height.
"""

import math
from dataclasses import dataclass

from poststall_sim.frames import GRAVITY
from poststall_sim.records import ConfigError

SEA_LEVEL_TEMPERATURE = 288.15
"""[K], U.S. Standard Atmosphere, 1976."""
SEA_LEVEL_PRESSURE = 101325.0
"""[Pa], U.S. Standard Atmosphere, 1976."""
LAPSE_RATE = 0.0065
"""Fall of temperature with geopotential height below 11 km [K/m], same source."""
TROPOPAUSE = 11000.0
"""Geopotential height [m], same source."""
GAS_CONSTANT = 287.05287
"""Of dry air [J/(kg K)], ISO 2533:1975."""
SEA_LEVEL_DENSITY = 1.225
"""[kg/m^3], same source."""
HEAT_RATIO = 1.4
"""Of the specific heats of air [-], U.S. Standard Atmosphere, 1976."""
EARTH_RADIUS = 6356766.0
"""For geopotential height [m], U.S. Standard Atmosphere, 1976."""


@dataclass(frozen=True, slots=True)
class Air:
    """Air at one place: density [kg/m^3], kinematic viscosity [m^2/s], pressure [Pa], [K]."""

    density: float
    kinematic_viscosity: float
    pressure: float
    temperature: float

    @property
    def speed_of_sound(self) -> float:
        """Speed of sound [m/s]."""
        return math.sqrt(HEAT_RATIO * GAS_CONSTANT * self.temperature)


@dataclass(frozen=True, slots=True)
class Atmosphere:
    """
    How air changes with altitude; without arguments the standard atmosphere.

    temperature_offset : warmer than standard by so much at every height [K];
    sea_level_pressure [Pa] : an altimeter's setting (QNH); density [kg/m^3] : one for every
    altitude instead of the one that follows, or None. Temperature and pressure stay then.
    """

    temperature_offset: float = 0.0
    sea_level_pressure: float = SEA_LEVEL_PRESSURE
    density: float | None = None

    def __post_init__(self) -> None:
        """Refuse air that nobody has flown in."""
        for name, value, low, high, unit in (
                ('temperature offset', self.temperature_offset, -80.0, 80.0, 'K'),
                ('sea level pressure', self.sea_level_pressure, 50e3, 150e3, 'Pa'),
                ('density', SEA_LEVEL_DENSITY if self.density is None else self.density,
                 1e-3, 10.0, 'kg/m^3')):
            if not low <= value <= high:
                raise ConfigError(f'{name} must be {low:g} to {high:g} {unit}, got {value!r}')

    def at(self, altitude: float) -> Air:
        """
        Return the air at a geometric altitude [m], up to 20 km.

        Outside -5..20 km the nearest end is returned: a flight that leaves the table goes on.

        References
        ----------
        U.S. Standard Atmosphere, 1976, equations 18, 33a, 33b, 51.

        """
        altitude = min(max(altitude, -5000.0), 20000.0)
        height = EARTH_RADIUS * altitude / (EARTH_RADIUS + altitude)
        exponent = GRAVITY / (GAS_CONSTANT * LAPSE_RATE)
        below = min(height, TROPOPAUSE)
        ground = SEA_LEVEL_TEMPERATURE + self.temperature_offset
        temperature = ground - LAPSE_RATE * below
        pressure = self.sea_level_pressure * (temperature / ground) ** exponent
        if height > TROPOPAUSE:
            pressure *= math.exp(-GRAVITY * (height - TROPOPAUSE) / (GAS_CONSTANT * temperature))
        density = pressure / (GAS_CONSTANT * temperature) if self.density is None \
            else self.density
        viscosity = 1.458e-6 * temperature ** 1.5 / (temperature + 110.4)
        return Air(density, viscosity / density, pressure, temperature)


STANDARD = Atmosphere()


def standard_air(altitude: float) -> Air:
    """Return the standard atmosphere at a geometric altitude [m], see `Atmosphere.at`."""
    return STANDARD.at(altitude)
