# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""
The definition of engines, in geometry axes G (x aft, y right, z up).

Every kind acts at position_G [m] along direction_G (unit, the way the thrust pushes) and has a
name, by default that of its place in the aircraft's list.
"""

import enum
import math
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from poststall_sim.frames import FloatArray
from poststall_sim.records import ConfigError, read_only, require_place, require_positive

AHEAD = (-1.0, 0.0, 0.0)
_GREATEST = 100.0
"""No propeller is larger [m], no coefficient of one is [-]."""


class Rotation(enum.Enum):
    """Which way a propeller turns, seen from behind; the value is the sign about its thrust."""

    CLOCKWISE = 1.0
    COUNTERCLOCKWISE = -1.0


@dataclass(frozen=True, slots=True)
class LinearThrust:
    """
    A propeller as a straight line of thrust over airspeed.

    static_thrust [N] at full throttle at rest, falling linearly to none at
    zero_thrust_airspeed [m/s] and staying none beyond: it does not brake. Throttle scales it
    linearly; there is no torque and no slipstream.
    """

    static_thrust: float
    zero_thrust_airspeed: float
    position_G: tuple[float, float, float]
    direction_G: tuple[float, float, float] = AHEAD
    name: str = ''

    def __post_init__(self) -> None:
        """Refuse engines that push nowhere."""
        require_positive('static_thrust', self.static_thrust, 'N')
        require_positive('zero_thrust_airspeed', self.zero_thrust_airspeed, 'm/s')
        require_place('position', self.position_G)
        _require_unit(self.direction_G)


@dataclass(frozen=True, slots=True, eq=False)
class ThrustTable:
    """
    Thrust (t, v) [N] at throttles (t,) from 0 to 1 and airspeeds (v,) [m/s], linear in between.

    Beyond the first and the last airspeed it stays what it is there. No torque, no slipstream.
    """

    throttle: FloatArray
    airspeed: FloatArray
    thrust: FloatArray
    position_G: tuple[float, float, float]
    direction_G: tuple[float, float, float] = AHEAD
    name: str = ''

    def __post_init__(self) -> None:
        """Refuse tables that are not one thrust for each throttle and airspeed."""
        for key in ('throttle', 'airspeed', 'thrust'):
            object.__setattr__(self, key, read_only(getattr(self, key)))
        _require_rising('throttle', self.throttle)
        _require_rising('airspeed', self.airspeed)
        if self.throttle[0] != 0.0 or self.throttle[-1] != 1.0:
            raise ConfigError(f'throttle must run from 0 to 1, got {self.throttle[0]:g} to '
                              f'{self.throttle[-1]:g}')
        if self.thrust.shape != (self.throttle.size, self.airspeed.size) \
                or not np.isfinite(self.thrust).all():
            raise ConfigError(
                f'thrust must be finite, a row for each of the {self.throttle.size} throttles '
                f'with a value for each of the {self.airspeed.size} airspeeds')
        require_place('position', self.position_G)
        _require_unit(self.direction_G)


@dataclass(frozen=True, slots=True, eq=False)
class Coefficients:
    """
    Thrust and power coefficients (k,) of a propeller over its advance ratio (k,) [-].

        J = V/(n D),  CT = T/(rho n^2 D^4),  CP = P/(rho n^3 D^5),  n in turns per second

    Linear between the rows. Below the first row both stay what they are there; beyond the last
    they go on as the straight lines through the last two, on which a propeller that stands still
    in the stream has neither thrust nor torque.
    """

    advance_ratio: FloatArray
    thrust: FloatArray
    power: FloatArray

    def __post_init__(self) -> None:
        """Refuse tables that would make power of nothing."""
        for key in ('advance_ratio', 'thrust', 'power'):
            object.__setattr__(self, key, read_only(getattr(self, key)))
        ratio, thrust, power = self.advance_ratio, self.thrust, self.power
        _require_rising('advance ratio', ratio)
        if not (thrust.shape == power.shape == ratio.shape
                and (np.abs(np.concatenate([thrust, power])) <= _GREATEST).all()):
            raise ConfigError(f'CT and CP must be within +-{_GREATEST:g}, one of each for every '
                              'advance ratio')
        if not power[0] > 0.0:
            raise ConfigError(f'CP must be above 0 in the first row, got {power[0]:g}')
        if not thrust[-1] < thrust[-2]:
            raise ConfigError(f'CT must fall from the last row but one to the last, got '
                              f'{thrust[-2]:g} and {thrust[-1]:g}')
        for j, ct, cp in zip(ratio, thrust, power):
            if j * ct > cp:
                raise ConfigError(f'the thrust must not do more work than the shaft, J CT <= CP, '
                                  f'got {j * ct:g} > {cp:g} at J = {j:g}')


@dataclass(frozen=True, slots=True)
class Governor:
    """A shaft whose speed goes to throttle times a greatest one [rad/s], with a time lag [s]."""

    greatest_speed: float
    spool_time: float

    def __post_init__(self) -> None:
        """Refuse shafts that do not turn."""
        require_positive('greatest_speed', self.greatest_speed, 'rad/s')
        require_positive('spool_time', self.spool_time, 's')


@dataclass(frozen=True, slots=True)
class Battery:
    """
    A source of voltage [V], a straight line from full to empty, behind a resistance [Ohm].

    capacity [A s]; an empty battery gives nothing.
    """

    voltage: float
    empty_voltage: float
    resistance: float
    capacity: float

    def __post_init__(self) -> None:
        """Refuse batteries that give nothing or more as they empty."""
        require_positive('voltage', self.voltage, 'V')
        require_positive('capacity', self.capacity, 'A s')
        if not 0.0 < self.empty_voltage <= self.voltage:
            raise ConfigError(f'empty_voltage must be above 0 and at most the {self.voltage:g} V '
                              f'of the full battery, got {self.empty_voltage!r}')
        _require_none_or_more('resistance', self.resistance, 'Ohm')


@dataclass(frozen=True, slots=True)
class ElectricMotor:
    """
    A direct-current motor with its battery, on a gear of so many turns to one of the propeller.

    speed_constant [rad/s/V] of the motor without load; resistance [Ohm] of motor and controller;
    no_load_current [A]. The throttle is the share of the battery's voltage that the controller
    gives on; it passes no current back.
    """

    speed_constant: float
    resistance: float
    no_load_current: float
    battery: Battery
    gear: float = 1.0

    def __post_init__(self) -> None:
        """Refuse motors that do not turn."""
        require_positive('speed_constant', self.speed_constant, 'rad/s/V')
        require_positive('resistance', self.resistance, 'Ohm')
        require_positive('gear', self.gear, 'turns a turn')
        _require_none_or_more('no_load_current', self.no_load_current, 'A')


@dataclass(frozen=True, slots=True)
class Propeller:
    """
    A propeller of a diameter [m] on a shaft, with what turns it.

    inertia [kg m^2] of all that turns, as felt at the propeller; slipstream : whether what stands
    in it feels it, swirl : whether it turns there.
    """

    diameter: float
    coefficients: Coefficients
    drive: Governor | ElectricMotor
    position_G: tuple[float, float, float]
    direction_G: tuple[float, float, float] = AHEAD
    rotation: Rotation = Rotation.CLOCKWISE
    inertia: float = 0.0
    slipstream: bool = False
    swirl: bool = False
    name: str = ''

    def __post_init__(self) -> None:
        """Refuse propellers that push nowhere."""
        require_positive('diameter', self.diameter, 'm')
        if self.diameter > _GREATEST:
            raise ConfigError(f'diameter must be at most {_GREATEST:g} m, got {self.diameter!r}')
        _require_none_or_more('inertia', self.inertia, 'kg m^2')
        if isinstance(self.drive, ElectricMotor):
            require_positive('inertia of what a motor turns', self.inertia, 'kg m^2')
        if self.swirl and not self.slipstream:
            raise ConfigError('swirl is of a slipstream: it needs slipstream true')
        require_place('position', self.position_G)
        _require_unit(self.direction_G)


Engine: TypeAlias = LinearThrust | ThrustTable | Propeller


def _require_unit(direction: tuple[float, float, float]) -> None:
    if not abs(math.hypot(*direction) - 1.0) <= 1e-6:
        raise ConfigError(f'direction must be a unit vector, got {direction}')


def _require_none_or_more(key: str, value: float, unit: str) -> None:
    if not 0.0 <= value < math.inf:
        raise ConfigError(f'{key} must be at least 0 {unit}, got {value!r}')


def _require_rising(key: str, values: FloatArray) -> None:
    if values.ndim != 1 or values.size < 2 or not np.isfinite(values).all() \
            or not (np.diff(values) > 0.0).all():
        raise ConfigError(f'{key} must be at least 2 finite numbers that rise from one to the '
                          f'next, got {np.array2string(values, threshold=8)}')
