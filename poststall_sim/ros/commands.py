# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""Who flies: commands by source, their age in simulated time, and what follows silence."""

import enum
from collections.abc import Mapping

import numpy as np

from poststall_sim.frames import FloatArray


class Source(enum.Enum):
    """Where a command comes from."""

    PILOT = 'pilot'
    AUTOPILOT = 'autopilot'
    NONE = 'none'


class OnTimeout(enum.Enum):
    """What the controls do when nobody has commanded them for the timeout."""

    HOLD = 'hold'
    TRIM = 'trim'
    NEUTRAL = 'neutral'


class CommandDesk:
    """
    Keep what each source last commanded and choose what the controls are told.

    names : what can be commanded; limits : (low, high) for each; trim : (n,) where the flight
    starts [rad; throttle 0..1]. Values that no message has named hold.
    """

    def __init__(self, names: tuple[str, ...], limits: tuple[tuple[float, float], ...],
                 trim: FloatArray) -> None:
        self._index = {name: i for i, name in enumerate(names)}
        self._limits = limits
        self._trim = np.array(trim, dtype=np.float64)
        self.accepted = 0
        self.clamped = 0
        self.reset(0)

    def reset(self, time_ns: int) -> None:
        """Forget all commands: the controls go to trim, silence counts from now [ns]."""
        self._values: dict[Source, dict[str, float]] = {Source.PILOT: {}, Source.AUTOPILOT: {}}
        self._heard_ns: dict[Source, int] = {}
        self._quiet_since_ns = time_ns
        self._told = self._trim.copy()
        self.source = Source.NONE

    def receive(self, source: Source, values: Mapping[str, float], time_ns: int) -> list[str]:
        """
        Take a command at simulated time [ns]; return the names whose values were out of limits.

        Those are brought to the nearest limit and counted.
        """
        beyond = []
        for name, value in values.items():
            low, high = self._limits[self._index[name]]
            if not low <= value <= high:
                beyond.append(name)
                value = min(max(value, low), high)
            self._values[source][name] = value
        self._heard_ns[source] = time_ns
        self.accepted += 1
        self.clamped += bool(beyond)
        return beyond

    def age(self, time_ns: int) -> float | None:
        """Return how long ago the flying source was heard [s of simulated time], if ever."""
        heard = self._heard_ns.get(self.source)
        return None if heard is None else (time_ns - heard) * 1e-9

    def choose(self, time_ns: int, *, allowed: str, timeout: float,
               on_timeout: OnTimeout) -> FloatArray:
        """
        Return what the controls are told at simulated time [ns], (n,) in the order of names.

        allowed : ``auto`` (the pilot while his commands are fresh, else the autopilot) or the
        name of the one source to listen to; timeout [s].
        """
        sources = ((Source.PILOT, Source.AUTOPILOT) if allowed == 'auto' else (Source(allowed),))
        timeout_ns = round(timeout * 1e9)
        fresh = [source for source, heard in self._heard_ns.items()
                 if time_ns - heard <= timeout_ns]
        for source in self._heard_ns.keys() - fresh:
            self._values[source].clear()   # what it named long ago is no longer its wish
        for source in sources:
            if source in fresh:
                heard = self._heard_ns[source]
                for name, value in self._values[source].items():
                    self._told[self._index[name]] = value
                self.source = source
                self._quiet_since_ns = heard
                return self._told
        if time_ns - self._quiet_since_ns > timeout_ns:
            self.source = Source.NONE
            if on_timeout is OnTimeout.TRIM:
                self._told[:] = self._trim
            elif on_timeout is OnTimeout.NEUTRAL:
                self._told[:] = 0.0
        return self._told
