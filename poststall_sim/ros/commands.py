# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""Who flies: commands by source, their age in simulated time, and what follows silence."""

import enum
from collections.abc import Mapping

import numpy as np

from poststall_sim.frames import FloatArray
from poststall_sim.topics import THROTTLE


class Source(enum.Enum):
    """Where a command comes from."""

    PILOT = 'pilot'
    AUTOPILOT = 'autopilot'
    SUM = 'sum'
    NONE = 'none'


class OnTimeout(enum.Enum):
    """What the controls do when nobody has commanded them for the timeout."""

    HOLD = 'hold'
    TRIM = 'trim'
    NEUTRAL = 'neutral'


class Refusal(enum.Enum):
    """Why a command was not obeyed, as diagnostics count it."""

    NOT_FINITE = 'refused_not_finite'
    LENGTH = 'refused_wrong_length'
    DUPLICATE = 'refused_duplicate_name'
    STALE = 'refused_stale'
    OUT_OF_ORDER = 'refused_out_of_order'
    AHEAD = 'refused_ahead_of_time'


class RefusedCommand(ValueError):
    """A command message that is refused as a whole."""

    def __init__(self, refusal: Refusal, text: str) -> None:
        super().__init__(text)
        self.refusal = refusal


class Turns:
    """
    Which commands of a lock-step are new: each is heard once, however often it is sent.

    A client sends its command, stamped with the time of the state that it answers, again and
    again until it sees the next state. Of several sources the first to answer a state makes the
    flight advance; what the others say of it is heard, and acts from the next step on.
    """

    def __init__(self) -> None:
        self.repeated = 0
        self._last_ns: dict[Source, int] = {}

    def is_new(self, source: Source, stamp_ns: int) -> bool:
        """Tell whether a source has not answered this state yet, and count it where it has."""
        new = stamp_ns > self._last_ns.get(source, -1)
        self.repeated += not new
        return new

    def take(self, source: Source, stamp_ns: int) -> None:
        """Take note of a command that is heard."""
        self._last_ns[source] = stamp_ns

    def forget(self) -> None:
        """Begin again: the flight was put elsewhere, or time has jumped."""
        self._last_ns.clear()


class CommandDesk:
    """
    Keep what each source last commanded and choose what the controls are told.

    names : what can be commanded; limits : (low, high) for each; trim : (n,) where the flight
    starts [rad; throttle 0..1]. Values that no message has named hold. ``engaged`` : whether the
    autopilot is listened to.
    """

    def __init__(self, names: tuple[str, ...], limits: tuple[tuple[float, float], ...],
                 trim: FloatArray) -> None:
        self._index = {name: i for i, name in enumerate(names)}
        self._limits = limits
        self._trim = np.array(trim, dtype=np.float64)
        self.engaged = True
        self.accepted = 0
        self.clamped = 0
        self.reset(0)

    def reset(self, time_ns: int, *, trim: FloatArray | None = None,
              told: FloatArray | None = None) -> None:
        """
        Forget all commands: silence counts from now [ns].

        The controls go to trim, (n,), another one from now on if given, or are told (n,).
        """
        if trim is not None:
            self._trim = np.array(trim, dtype=np.float64)
        self._values: dict[Source, dict[str, float]] = {Source.PILOT: {}, Source.AUTOPILOT: {}}
        self._heard_ns: dict[Source, int] = {}
        self._stamp_ns: dict[tuple[Source, bool], int] = {}
        self._quiet_since_ns = time_ns
        self._told = np.array(self._trim if told is None else told, dtype=np.float64)
        self.source = Source.NONE

    @property
    def trim(self) -> dict[str, float]:
        """Where the flight starts, by name [rad; throttle 0..1]."""
        return dict(zip(self._index, self._trim.tolist()))

    def admit(self, source: Source, stamp_ns: int, time_ns: int, *, timeout: float) -> None:
        """
        Refuse a command that is too old at simulated time [ns], or older than one heard before.

        A stamp of 0 says nothing. One that is ahead of simulated time by more than the timeout
        is of another clock, such as wall time: it is compared only with its like.

        Raises
        ------
        RefusedCommand
            When the command is not to be obeyed.

        """
        if stamp_ns == 0:
            return
        age = (time_ns - stamp_ns) * 1e-9
        if age > timeout:
            raise RefusedCommand(Refusal.STALE, f'stamped {age:.3f} s ago, more than '
                                 f'command.timeout ({timeout:g} s)')
        clock = (source, age < -timeout)
        behind = (self._stamp_ns.get(clock, 0) - stamp_ns) * 1e-9
        if behind > 0.0:
            raise RefusedCommand(Refusal.OUT_OF_ORDER,
                                 f'stamped {behind:.3f} s before the latest one')
        self._stamp_ns[clock] = stamp_ns

    def listens_to(self, source: Source, allowed: str) -> bool:
        """Tell whether commands of a source may fly, as command.source has it."""
        return (allowed in ('auto', 'sum', source.value)
                and (self.engaged or source is not Source.AUTOPILOT))

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
        """Return how long ago who flies was heard [s of simulated time], if anybody does."""
        return None if self.source is Source.NONE else (time_ns - self._quiet_since_ns) * 1e-9

    def choose(self, time_ns: int, *, allowed: str, timeout: float,
               on_timeout: OnTimeout, deadband: float = 0.0) -> FloatArray:
        """
        Return what the controls are told at simulated time [ns], (n,) in the order of names.

        allowed : ``auto`` (the pilot while his commands are fresh, else the autopilot), ``sum``
        (trim and what both add to it) or the name of the one source to listen to; timeout [s];
        deadband : within so much of trim a pilot is at rest, and leaves the controls to an
        autopilot who is there [rad].
        """
        timeout_ns = round(timeout * 1e9)
        fresh = [source for source, heard in self._heard_ns.items()
                 if time_ns - heard <= timeout_ns]
        for source in self._heard_ns.keys() - fresh:
            self._values[source].clear()   # what it named long ago is no longer its wish
        flying = [source for source in (Source.PILOT, Source.AUTOPILOT)
                  if source in fresh and self.listens_to(source, allowed)]
        if allowed == Source.SUM.value and flying:
            self._add_up(flying)
            return self._told
        if len(flying) == 2 and self._at_rest(deadband):
            flying.remove(Source.PILOT)
        if flying:
            self.source = flying[0]
            self._quiet_since_ns = self._heard_ns[self.source]
            for name, value in self._values[self.source].items():
                self._told[self._index[name]] = value
        elif time_ns - self._quiet_since_ns > timeout_ns:
            self.source = Source.NONE
            if on_timeout is OnTimeout.TRIM:
                self._told[:] = self._trim
            elif on_timeout is OnTimeout.NEUTRAL:
                self._told[:] = 0.0
        return self._told

    def _at_rest(self, deadband: float) -> bool:
        """Tell whether the pilot's deflections are those of trim; a throttle lever stays."""
        return deadband > 0.0 and all(
            abs(value - self._trim[self._index[name]]) <= deadband
            for name, value in self._values[Source.PILOT].items() if name != THROTTLE)

    def _add_up(self, sources: list[Source]) -> None:
        """Tell the controls trim and what each source wants beyond it, within the limits."""
        self.source = Source.SUM
        self._quiet_since_ns = max(self._heard_ns[source] for source in sources)
        for name in {name for source in sources for name in self._values[source]}:
            i = self._index[name]
            low, high = self._limits[i]
            told = self._trim[i] + sum(self._values[source][name] - self._trim[i]
                                       for source in sources if name in self._values[source])
            self._told[i] = min(max(told, low), high)
