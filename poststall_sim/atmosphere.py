# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""The standard atmosphere and the wind."""

import math
from dataclasses import dataclass

from poststall_sim.frames import GRAVITY

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
EARTH_RADIUS = 6356766.0
"""For geopotential height [m], U.S. Standard Atmosphere, 1976."""


@dataclass(frozen=True, slots=True)
class Air:
    """Air at one place: density [kg/m^3], kinematic viscosity [m^2/s], pressure [Pa], [K]."""

    density: float
    kinematic_viscosity: float
    pressure: float
    temperature: float


def standard_air(altitude: float) -> Air:
    """
    Return the standard atmosphere at a geometric altitude [m], up to 20 km.

    Outside -5..20 km the nearest end is returned: a flight that leaves the table goes on.

    References
    ----------
    U.S. Standard Atmosphere, 1976, equations 18, 33a, 33b, 51.

    """
    altitude = min(max(altitude, -5000.0), 20000.0)
    height = EARTH_RADIUS * altitude / (EARTH_RADIUS + altitude)
    exponent = GRAVITY / (GAS_CONSTANT * LAPSE_RATE)
    below = min(height, TROPOPAUSE)
    temperature = SEA_LEVEL_TEMPERATURE - LAPSE_RATE * below
    pressure = SEA_LEVEL_PRESSURE * (temperature / SEA_LEVEL_TEMPERATURE) ** exponent
    if height > TROPOPAUSE:
        pressure *= math.exp(-GRAVITY * (height - TROPOPAUSE) / (GAS_CONSTANT * temperature))
    density = pressure / (GAS_CONSTANT * temperature)
    viscosity = 1.458e-6 * temperature ** 1.5 / (temperature + 110.4)
    return Air(density, viscosity / density, pressure, temperature)
