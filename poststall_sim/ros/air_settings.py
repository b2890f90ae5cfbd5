# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""The parameters of the air: a standard day, calm, unless they say otherwise."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from poststall_sim.air_reader import SEVERITIES, SHAPES, SPECTRA
from poststall_sim.atmosphere import SEA_LEVEL_PRESSURE, Atmosphere
from poststall_sim.frames import FloatArray, swap_ned_enu
from poststall_sim.ros.parameters import entry
from poststall_sim.turbulence import Turbulence, intensity, military
from poststall_sim.weather import (
    REFERENCE_HEIGHT,
    ROUGH,
    Gust,
    GustShape,
    Shear,
    ShearLaw,
    Weather,
    gust_ahead,
)

_NONE = 'none'


@dataclass(frozen=True, slots=True)
class AirSettings:
    """Parameters of atmosphere, wind, shear, gusts and turbulence."""

    temperature_offset: float = entry(
        'atmosphere.temperature_offset', 0.0, 'Warmer than the standard atmosphere [K]',
        low=-80.0, high=80.0)
    sea_level_pressure: float = entry(
        'atmosphere.sea_level_pressure', SEA_LEVEL_PRESSURE, 'Pressure at altitude 0 [Pa]',
        low=50e3, high=150e3)
    density: float = entry(
        'atmosphere.density', 0.0, 'Density at every altitude [kg/m^3]; 0 = by altitude',
        low=0.0, high=10.0)
    wind_velocity: tuple[float, ...] = entry(
        'wind.velocity', (0.0, 0.0, 0.0), 'Velocity of the air, where it blows TO: east, north, '
        'up [m/s]; of a sheared wind, that at the reference height', low=-100.0, high=100.0,
        writable=True)
    shear_law: str = entry(
        'wind.shear.law', _NONE, 'How the wind grows from 3 to 1000 ft above the ground',
        choices=(_NONE, *(law.value for law in ShearLaw)), writable=True)
    shear_exponent: float = entry(
        'wind.shear.exponent', 0.143, 'Exponent of height under power [-]', low=0.0, high=2.0,
        writable=True)
    shear_roughness: float = entry(
        'wind.shear.roughness', ROUGH, 'Roughness length under logarithmic [m]; MIL-F-8785C: '
        '0.61, and 0.046 in take-off, approach and landing', low=1e-5, high=0.8, writable=True)
    shear_reference_height: float = entry(
        'wind.shear.reference_height', REFERENCE_HEIGHT, 'Height at which the wind is '
        'wind.velocity [m]', low=1.0, high=300.0, writable=True)
    gust_velocity: tuple[float, ...] = entry(
        'wind.gust.velocity', (0.0, 0.0, 2.0), 'Greatest velocity of the gust that the service '
        'gust puts ahead: east, north, up [m/s]', low=-100.0, high=100.0, writable=True)
    gust_length: float = entry(
        'wind.gust.length', 10.0, 'Way from the edge of that gust to its greatest [m]',
        low=0.001, high=1e5, writable=True)
    gust_distance: float = entry(
        'wind.gust.distance', 5.0, 'Way ahead of the centre of gravity to its edge [m]',
        low=0.0, high=1e5, writable=True)
    gust_shape: str = entry(
        'wind.gust.shape', GustShape.ONE_MINUS_COSINE.value, 'Whether it ends as it begins or '
        'stays', choices=tuple(SHAPES), writable=True)
    turbulence_intensity: str = entry(
        'wind.turbulence.intensity', _NONE, 'Intensity by MIL-F-8785C at initial.altitude',
        choices=(_NONE, *SEVERITIES), writable=True)
    turbulence_sigma: float = entry(
        'wind.turbulence.sigma', 0.0, 'Root mean square of the vertical part [m/s]; 0 = that of '
        'wind.turbulence.intensity', low=0.0, high=100.0, writable=True)
    turbulence_model: str = entry(
        'wind.turbulence.model', 'dryden', 'Spectrum of the turbulence',
        choices=tuple(SPECTRA), writable=True)
    turbulence_seed: int = entry(
        'wind.turbulence.seed', 0, 'Seed: the same one, the same flight [-]',
        low=0, high=2**31 - 1, writable=True)

    @property
    def atmosphere(self) -> Atmosphere:
        """The atmosphere."""
        return Atmosphere(self.temperature_offset, self.sea_level_pressure, self.density or None)

    @property
    def wind_N(self) -> FloatArray:
        """The wind (3,) in N [m/s]."""
        return swap_ned_enu(np.array(self.wind_velocity))

    @property
    def shear(self) -> Shear | None:
        """The profile of the wind."""
        if self.shear_law == _NONE:
            return None
        law = ShearLaw(self.shear_law)
        return Shear(law, self.shear_exponent if law is ShearLaw.POWER else self.shear_roughness,
                     self.shear_reference_height)

    def turbulence(self, altitude: float) -> Turbulence | None:
        """Return the turbulence, scaled for an altitude [m]."""
        vertical = self.turbulence_sigma
        if vertical == 0.0 and self.turbulence_intensity != _NONE:
            vertical = intensity(SEVERITIES[self.turbulence_intensity], altitude)
        if vertical == 0.0:
            return None
        return military(SPECTRA[self.turbulence_model], vertical, altitude=altitude,
                        seed=self.turbulence_seed)

    def weather(self, altitude: float) -> Weather:
        """Return the weather of a flight that begins at an altitude [m]."""
        return Weather(self.wind_N, self.shear, turbulence=self.turbulence(altitude))

    def asked(self, named: frozenset[str], altitude: float) -> dict:
        """
        Return the fields of a weather that parameters ask for, by the names of their fields.

        Also where they are as before: a message or a flight file may have set another.
        """
        made = {'wind_': ('wind_N', lambda: self.wind_N), 'shear_': ('shear', lambda: self.shear),
                'turbulence_': ('turbulence', lambda: self.turbulence(altitude))}
        return {field: make() for begin, (field, make) in made.items()
                if any(name.startswith(begin) for name in named)}

    def unsaid(self, weather: Weather, altitude: float) -> dict[str, Any]:
        """
        Return what the parameters would have to be, by name, to ask for a weather.

        Only those that have to change. Of turbulence scaled for another altitude [m] they can
        say the vertical part alone.
        """
        values: dict[str, Any] = {}
        if not np.array_equal(self.wind_N, weather.wind_N):
            values['wind.velocity'] = swap_ned_enu(weather.wind_N).tolist()
        shear, turbulence = weather.shear, weather.turbulence
        if self.shear != shear:
            values['wind.shear.law'] = _NONE if shear is None else shear.law.value
            if shear is not None:
                constant = 'exponent' if shear.law is ShearLaw.POWER else 'roughness'
                values |= {f'wind.shear.{constant}': shear.constant,
                           'wind.shear.reference_height': shear.reference_height}
        if self.turbulence(altitude) != turbulence:
            values |= {'wind.turbulence.intensity': _NONE, 'wind.turbulence.sigma': 0.0}
            if turbulence is not None:
                model, = (name for name, spectrum in SPECTRA.items()
                          if spectrum is turbulence.spectrum)
                values |= {'wind.turbulence.sigma': turbulence.vertical,
                           'wind.turbulence.model': model,
                           'wind.turbulence.seed': turbulence.seed}
        return values

    def gust(self, place_N: FloatArray, toward_N: FloatArray) -> Gust:
        """Return the gust ahead of who is at a place in the air and moves so, see `gust_ahead`."""
        return gust_ahead(
            swap_ned_enu(np.array(self.gust_velocity)), self.gust_length, place_N, toward_N,
            distance=self.gust_distance, shape=SHAPES[self.gust_shape])
