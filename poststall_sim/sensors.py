# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""
How sensors err: a rate, a delay, a constant bias and white noise; and what some of them measure.

Every sensor has random numbers of its own, made from a seed: the same seed and the same flight
give the same readings, whatever other sensors there are. There is no drift of the bias, no
quantisation, no misalignment and no lever arm: all stand at the centre of gravity.
"""

import math
from collections import deque
from dataclasses import dataclass

import numpy as np

from poststall_sim.aircraft import ConfigError, read_only
from poststall_sim.frames import FloatArray

EQUATOR_RADIUS = 6378137.0
"""Semi-major axis of the earth's ellipsoid [m], WGS 84."""
ECCENTRICITY_SQUARED = 6.69437999014e-3
"""First eccentricity of the ellipsoid, squared [-], WGS 84."""
LEAST_RATE = 1e-3
"""Less often than this [Hz of simulated time] nothing is sampled or shown: longer periods [ns]
leave the range of numbers."""


@dataclass(frozen=True, slots=True, eq=False)
class Errors:
    """
    What stands between a quantity and its readings.

    rate : of samples [Hz of simulated time]; delay : from a sample to its reading [s]; noise :
    (k,) standard deviation of a sample; bias : (k,); in units of the quantity's k components.
    """

    rate: float
    noise: FloatArray
    bias: FloatArray
    delay: float = 0.0

    def __post_init__(self) -> None:
        """Refuse what no sensor does."""
        for key in ('noise', 'bias'):
            object.__setattr__(self, key, read_only(getattr(self, key)))
        if not (self.rate >= LEAST_RATE and self.delay >= 0.0 and (self.noise >= 0.0).all()):
            raise ConfigError(
                f'a sensor needs a rate of {LEAST_RATE:g} Hz at least, and a delay and noise not '
                f'below 0; got {self.rate}, {self.delay} and {self.noise}')


@dataclass(frozen=True, slots=True, eq=False)
class Reading:
    """Values (k,) with their errors, and when they were sampled [ns of simulated time]."""

    time_ns: int
    values: FloatArray


class Sensor:
    """Samples of a quantity with errors, each given out when its delay is over."""

    def __init__(self, errors: Errors, seed: int, number: int) -> None:
        """Begin a stream of random numbers; number : which of the sensors of a seed it is."""
        self.errors = errors
        self._random = np.random.default_rng((seed, number))
        self._period_ns = max(1, round(1e9 / errors.rate))
        self._delay_ns = round(1e9 * errors.delay)
        self._waiting: deque[Reading] = deque()
        self._period = self._seen_ns = -1

    def step(self, time_ns: int, truth: FloatArray) -> list[Reading]:
        """
        Take a sample if a period has begun, and return the readings that are out now.

        truth : (k,) at this time. When time has been set back, what was on its way is lost.
        """
        if time_ns < self._seen_ns:
            self._waiting.clear()
            self._period = -1
        self._seen_ns = time_ns
        period = time_ns // self._period_ns
        if period != self._period:
            self._period = period
            error = self.errors.bias + self.errors.noise * self._random.standard_normal(
                len(self.errors.noise))
            self._waiting.append(Reading(time_ns, truth + error))
        out = []
        while self._waiting and self._waiting[0].time_ns + self._delay_ns <= time_ns:
            out.append(self._waiting.popleft())
        return out


@dataclass(frozen=True, slots=True)
class Origin:
    """Where on the earth the origin of the map is: latitude, longitude [deg], altitude [m]."""

    latitude: float
    longitude: float
    altitude: float


def geodetic(origin: Origin, enu: FloatArray) -> tuple[float, float, float]:
    """
    Return latitude, longitude [deg] and altitude [m] of a place (3,) east, north, up [m].

    On the radii of curvature of the WGS 84 ellipsoid at the origin: metres and turns agree to
    first order, so that 10 km away it is off by some ten metres.
    """
    east, north, up = map(float, enu)
    latitude = math.radians(origin.latitude)
    shrink = 1.0 - ECCENTRICITY_SQUARED * math.sin(latitude) ** 2
    across = EQUATOR_RADIUS / math.sqrt(shrink)
    along = across * (1.0 - ECCENTRICITY_SQUARED) / shrink
    turned = (north / (along + origin.altitude),
              east / ((across + origin.altitude) * math.cos(latitude)))
    longitude = origin.longitude + math.degrees(turned[1])
    return (origin.latitude + math.degrees(turned[0]), (longitude + 180.0) % 360.0 - 180.0,
            origin.altitude + up)


def pitot_pressure(density: float, velocity_air_B: FloatArray) -> float:
    """Return the pressure [Pa] in a tube along x over that of the air; 0 flying backwards."""
    return 0.5 * density * max(float(velocity_air_B[0]), 0.0) ** 2
