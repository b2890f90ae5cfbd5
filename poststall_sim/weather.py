# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""
How the air of a flight moves: wind, its shear near the ground, discrete gusts and turbulence.

Gusts and turbulence are frozen in the air and go with it (Taylor's hypothesis): what is at a
place now was there at the flight's beginning, less the way that the wind has gone since.
"""

import enum
from dataclasses import dataclass, replace

import numpy as np

from poststall_sim.frames import FloatArray
from poststall_sim.records import ConfigError, read_only
from poststall_sim.turbulence import FOOT, Turbulence, waves

REFERENCE_HEIGHT = 20.0 * FOOT
"""At which the wind of a sheared profile is measured [m], MIL-F-8785C, 3.7.3."""
SHEARED = (3.0 * FOOT, 1000.0 * FOOT)
"""Heights between which the wind is sheared [m], same place: held below and above."""
ROUGH, SMOOTH = 2.0 * FOOT, 0.15 * FOOT
"""Roughness lengths [m], same place: the greater one but in take-off, approach and landing."""
MOST_GUSTS = 20
"""In one weather: each of them is looked at by every strip at every step."""
LEFT_BEHIND = 200.0
"""A gust whose end is so far behind is forgotten when another one comes [m]."""


class ShearLaw(enum.Enum):
    """How the wind grows with height."""

    POWER = 'power'
    LOGARITHMIC = 'logarithmic'


@dataclass(frozen=True, slots=True)
class Shear:
    """
    A profile of the wind over height h above the ground, from 3 ft to 1000 ft.

    POWER: (h / reference_height)^constant. LOGARITHMIC: ln(h / constant) over
    ln(reference_height / constant), where constant is the roughness length [m].
    """

    law: ShearLaw
    constant: float
    reference_height: float = REFERENCE_HEIGHT

    def __post_init__(self) -> None:
        """Refuse what is not a profile."""
        power = self.law is ShearLaw.POWER
        low, high = (0.0, 2.0) if power else (1e-5, 0.9 * SHEARED[0])
        if not low <= self.constant <= high:
            raise ConfigError(f'shear: {"exponent" if power else "roughness"} must be {low:g} to '
                              f'{high:.3g}{"" if power else " m"}, got {self.constant!r}')
        if not SHEARED[0] <= self.reference_height <= SHEARED[1]:
            raise ConfigError(f'shear: reference height must be {SHEARED[0]:.3g} to '
                              f'{SHEARED[1]:.4g} m, got {self.reference_height!r}')

    def share(self, altitude: FloatArray) -> FloatArray:
        """Return the wind over that at the reference height [-], at altitudes [m]."""
        height = np.clip(altitude, *SHEARED)
        if self.law is ShearLaw.POWER:
            return (height / self.reference_height) ** self.constant
        return np.log(height / self.constant) / np.log(self.reference_height / self.constant)


class GustShape(enum.Enum):
    """What a gust does after its rise."""

    ONE_MINUS_COSINE = 'one_minus_cosine'
    RISE = 'rise'


@dataclass(frozen=True, slots=True, eq=False)
class Gust:
    """
    A discrete gust: a layer of air that moves, across a direction.

    With x the way into it, each strip's own, and d its length [m],

        velocity = velocity_N 0.5 (1 - cos(pi x / d)),  0 < x < d,

    and then it stays (RISE) or goes back the way it came, until 2 d (ONE_MINUS_COSINE).

    direction_N (3,) : unit vector into the gust; begin [m] : where its edge is along it at the
    flight's beginning, from the origin; speed [m/s] : at which the edge comes against it.

    References
    ----------
    MIL-F-8785C, 3.7.1; 14 CFR 25.341(a) for the form that goes back.

    """

    velocity_N: FloatArray
    length: float
    begin: float
    direction_N: FloatArray
    shape: GustShape = GustShape.ONE_MINUS_COSINE
    speed: float = 0.0

    def __post_init__(self) -> None:
        """Refuse what is not a gust; make the arrays read-only."""
        for key in ('velocity_N', 'direction_N'):
            object.__setattr__(self, key, read_only(getattr(self, key)))
        if not (np.shape(self.velocity_N) == (3,) and np.abs(self.velocity_N).max() <= 100.0):
            raise ConfigError('gust: velocity must be three numbers of -100 to 100 m/s, got '
                              f'{self.velocity_N.tolist()}')
        if not 1e-3 <= self.length <= 1e5:
            raise ConfigError(f'gust: length must be 0.001 to 100000 m, got {self.length!r}')
        if not (abs(self.begin) <= 1e7 and 0.0 <= self.speed <= 1e4):
            raise ConfigError('gust: it must begin within 1e7 m and come at 0 to 10000 m/s, got '
                              f'{self.begin!r} m and {self.speed!r} m/s')
        if not abs(np.linalg.norm(self.direction_N) - 1.0) < 1e-9:
            raise ConfigError(f'gust: direction must be a unit vector, got {self.direction_N}')

    def share(self, way: FloatArray) -> FloatArray:
        """Return the velocity over its greatest [-] at ways into the gust [m]."""
        last = 2.0 if self.shape is GustShape.ONE_MINUS_COSINE else 1.0
        return 0.5 * (1.0 - np.cos(np.pi * np.clip(way / self.length, 0.0, last)))

    def way(self, time: float, points_N: FloatArray) -> FloatArray:
        """Return the way into the gust (k,) [m] at a time [s] and at places (k, 3) in the air."""
        return points_N @ self.direction_N - self.begin + self.speed * time

    def velocity(self, time: float, points_N: FloatArray) -> FloatArray:
        """Return the velocity (k, 3) [m/s] at a time [s] and at places (k, 3) in the air [m]."""
        return self.share(self.way(time, points_N))[:, None] * self.velocity_N


@dataclass(frozen=True, slots=True, eq=False)
class Weather:
    """
    The motion of the air.

    wind_N (3,) : where it blows to [m/s], at the shear's reference height if it is sheared.
    """

    wind_N: FloatArray
    shear: Shear | None = None
    gusts: tuple[Gust, ...] = ()
    turbulence: Turbulence | None = None

    def __post_init__(self) -> None:
        """Refuse too many gusts; make the array read-only."""
        object.__setattr__(self, 'wind_N', read_only(self.wind_N))
        if len(self.gusts) > MOST_GUSTS:
            raise ConfigError(f'there may be {MOST_GUSTS} gusts, got {len(self.gusts)}')

    @property
    def uniform(self) -> bool:
        """Whether the air moves everywhere and always alike."""
        return self.shear is None and not self.gusts and self.turbulence is None

    def mean_N(self, altitude: float) -> FloatArray:
        """Return the wind (3,) [m/s] at an altitude above the ground [m]."""
        return self.wind_N if self.shear is None else self.wind_N * self.shear.share(altitude)

    def with_gust(self, gust: Gust, time: float, place_N: FloatArray) -> 'Weather':
        """Return it with one more gust, without those that a place (3,) in the air has left."""
        kept = tuple(each for each in self.gusts if each.shape is GustShape.RISE
                     or each.way(time, place_N) < 2.0 * each.length + LEFT_BEHIND)
        return replace(self, gusts=(*kept, gust))

    def beyond_N(self, time: float, points_N: FloatArray, carried_N: FloatArray,
                 mean_N: FloatArray) -> FloatArray:
        """
        Return what the air has more than a mean wind (k, 3) [m/s] at points (k, 3) [m].

        time [s] since the flight's beginning; carried_N (3,) [m] : how far the wind has gone;
        mean_N (3,) [m/s] : that wind, see `mean_N`.
        """
        in_air = points_N - carried_N
        velocity = np.zeros_like(in_air) if self.turbulence is None \
            else waves(self.turbulence).velocity(in_air)
        if self.shear is not None:
            velocity += self.shear.share(-points_N[:, 2])[:, None] * self.wind_N - mean_N
        for gust in self.gusts:
            velocity += gust.velocity(time, in_air)
        return velocity


CALM = Weather(np.zeros(3))


def gust_ahead(velocity_N: FloatArray, length: float, place_N: FloatArray, toward_N: FloatArray,
               *, distance: float, shape: GustShape) -> Gust:
    """
    Return a gust across somebody's way.

    velocity_N (3,) [m/s], length [m] and shape : see `Gust`; place_N (3,) [m] in the air, toward_N
    (3,) : of what meets it after a distance [m].
    """
    way = float(np.linalg.norm(toward_N))
    if not way > 0.0:
        raise ConfigError('gust: only what moves through the air can meet one')
    direction = toward_N / way
    return Gust(velocity_N, length, float(direction @ place_N) + distance, direction, shape)
