# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""A scenario: what the pilot does, as straight lines between points in simulated time."""

from dataclasses import dataclass, replace

import numpy as np

from poststall_sim.aircraft import ConfigError
from poststall_sim.atmosphere import STANDARD, Atmosphere
from poststall_sim.failures import Failure
from poststall_sim.weather import CALM, Weather


@dataclass(frozen=True, slots=True)
class Channel:
    """
    One control over time: (time [s], value) points joined by straight lines, ends held.

    Values are deflections [rad], or 0..1 for the throttle; relative ones are added to the
    trimmed value that the flight starts from.
    """

    control: str
    points: tuple[tuple[float, float], ...]
    relative: bool = True

    def __post_init__(self) -> None:
        """Refuse a channel whose time runs backwards."""
        if not self.points:
            raise ConfigError(f'channel {self.control}: needs at least one point')
        times = [time for time, _ in self.points]
        if any(b < a for a, b in zip(times, times[1:])):
            raise ConfigError(f'channel {self.control}: times must not fall, got {times}')

    def value(self, time: float) -> float:
        """Return the value at a simulated time [s]."""
        times, values = zip(*self.points)
        return float(np.interp(time, times, values))


@dataclass(frozen=True, slots=True)
class Fault:
    """What fails at a time [s], by the name of a part, a control or an engine, and how."""

    time: float
    name: str
    failure: Failure


@dataclass(frozen=True, slots=True)
class Scenario:
    """
    A named flight: its length [s], where it starts, what the pilot moves, in which air.

    faults : what fails in it, and when; a later one of the same name takes an earlier one's place.
    """

    name: str
    duration: float
    airspeed: float
    altitude: float
    channels: tuple[Channel, ...] = ()
    atmosphere: Atmosphere = STANDARD
    weather: Weather = CALM
    faults: tuple[Fault, ...] = ()

    def __post_init__(self) -> None:
        """Refuse a flight that takes no time or goes nowhere."""
        if not self.duration > 0.0 or not self.airspeed > 0.0:
            raise ConfigError(f'scenario {self.name}: duration and airspeed must be above 0, '
                              f'got {self.duration!r} s and {self.airspeed!r} m/s')
        names = [channel.control for channel in self.channels]
        if len(set(names)) < len(names):
            raise ConfigError(f'scenario {self.name}: two channels move one control, {names}')

    def moves(self, name: str) -> bool:
        """Tell whether a control has a channel."""
        return any(channel.control == name for channel in self.channels)

    def without(self, name: str) -> 'Scenario':
        """Return it without the channel of a control."""
        return replace(self, channels=tuple(
            channel for channel in self.channels if channel.control != name))

    def failures(self, time: float) -> dict[str, Failure]:
        """Return what has failed by a time [s], by name."""
        return {fault.name: fault.failure
                for fault in sorted(self.faults, key=lambda each: each.time)
                if fault.time <= time + 1e-9}

    def commands(self, time: float, trim: dict[str, float]) -> dict[str, float]:
        """
        Return the commanded deflections [rad] and throttle [-] by name at a time [s].

        ``trim`` holds the trimmed values by name; controls without a channel are left out.
        """
        return {
            channel.control: channel.value(time)
            + (trim.get(channel.control, 0.0) if channel.relative else 0.0)
            for channel in self.channels}
