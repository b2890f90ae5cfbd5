# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""How many steps are due: beside a steady clock or a foreign one, and how well that goes."""

import math


class Pacer:
    """
    Tell at each wake how many steps of dt are due, and count what came late or never.

    Steps are due at wall times one dt / factor apart. A wake gets all that are due, up to
    max_steps; debt beyond that is forgiven (the schedule moves on) and counted as lost time,
    so that simulated time only ever advances by dt. A factor of 0 means as fast as possible:
    max_steps at every wake. A step is late when it runs more than max(2 dt, 20 ms) after it
    was due. Only steps that were taken, as `stepped` is told, are counted. Parts of a step that
    are owed are never lost but for a `stop`.
    """

    LATE_NS = 20_000_000
    """Lag that is never late [ns]: what a desktop's scheduler does anyhow."""

    def __init__(self, dt_ns: int, *, factor: float, max_steps: int) -> None:
        self.dt_ns = dt_ns
        self.factor = factor
        self.max_steps = max_steps
        self.steps = 0
        self.late = 0
        self.lost_ns = 0        # of simulated time, and of wall time
        self.lost_wall_ns = 0
        self.lag_max_ns = 0
        self.running_ns = 0
        self._late_ns = max(2 * dt_ns, self.LATE_NS)
        self._start_ns: int | None = None
        self._done = 0      # of the schedule, taken or forgiven
        self._taken = 0     # of the schedule, up to the latest step taken
        self._seen_ns = 0

    def stop(self) -> None:
        """Stop counting wall time; the first wake after this starts a new schedule."""
        self._start_ns = None

    def forgive(self, now_ns: int) -> None:
        """Count what is owed at a wall time as lost, instead of making it up."""
        if self._start_ns is not None and self.factor > 0.0:
            self._done += self._lose(math.floor(self._owed(now_ns)))

    def change(self, factor: float, now_ns: int) -> None:
        """Go on at another factor; what is owed at this wall time stays so."""
        if self._start_ns is None or 0.0 in (self.factor, factor):
            self.stop()
        else:
            self._start_ns = now_ns - round(self._owed(now_ns) * self.dt_ns / factor)
            self._done = self._taken = 0
        self.factor = factor

    def _owed(self, now_ns: int) -> float:
        """Return how many steps the schedule is behind a wall time."""
        return (now_ns - self._start_ns) / (self.dt_ns / self.factor) - self._done

    def _lose(self, steps: int) -> int:
        """Count steps as lost and return how many."""
        self.lost_ns += steps * self.dt_ns
        self.lost_wall_ns += round(steps * self.dt_ns / self.factor)
        return steps

    def due(self, now_ns: int) -> int:
        """Return how many steps to take at wall time [ns of a steady clock]."""
        if self._start_ns is None:
            self._start_ns = self._seen_ns = now_ns
            self._done = 0
        self.running_ns += now_ns - self._seen_ns
        self._seen_ns = now_ns
        if self.factor == 0.0:
            return self.max_steps
        owed = math.floor(self._owed(now_ns))
        granted = min(owed, self.max_steps)
        self._lose(owed - granted)
        self._taken = self._done
        self._done += owed
        return granted

    def stepped(self) -> None:
        """Count one of the steps that were due as taken, and how late it came."""
        self.steps += 1
        if self.factor > 0.0 and self._start_ns is not None:
            self._taken += 1
            lag_ns = self._seen_ns - self._start_ns - self._taken * self.dt_ns / self.factor
            self.lag_max_ns = max(self.lag_max_ns, round(lag_ns))
            self.late += lag_ns > self._late_ns

    @property
    def achieved(self) -> float:
        """Simulated time over wall time since the start, pauses left out [-]."""
        return self.steps * self.dt_ns / self.running_ns if self.running_ns else 0.0


class Follower:
    """
    Tell how many steps of dt are due to reach the time of a clock that somebody else sets.

    Steps that are behind are all caught up with, max_steps at each look, but those of a pause:
    after it, as at the start, the flight takes on the time of the clock, in whole dt.
    """

    def __init__(self, dt_ns: int, *, max_steps: int) -> None:
        self.dt_ns = dt_ns
        self.max_steps = max_steps
        self.clock_ns: int | None = None
        self.jumps_back = 0
        self.lost_ns = 0
        self._joining = True
        self._joined = False

    def stop(self) -> None:
        """Take on the time of the clock at the next `joined`."""
        self._joining = True

    def heard(self, clock_ns: int) -> bool:
        """Take note of the clock [ns] and tell whether it has jumped back."""
        back = self.clock_ns is not None and clock_ns < self.clock_ns
        self.clock_ns = clock_ns
        self.jumps_back += back
        return back

    @property
    def whole_ns(self) -> int:
        """Time of the clock in whole dt [ns]."""
        return self.clock_ns // self.dt_ns * self.dt_ns

    def joined(self, time_ns: int) -> int:
        """Return the time that a flight at a time [ns] goes on from."""
        if not self._joining or self.clock_ns is None:
            return time_ns
        self._joining = False
        began = max(time_ns, self.whole_ns)
        self.lost_ns += self._joined * (began - time_ns)
        self._joined = True
        return began

    def lag_ns(self, time_ns: int) -> int:
        """Return how far a flight at a time [ns] is behind the clock, 0 before there is one."""
        return 0 if self.clock_ns is None else max(0, self.clock_ns - time_ns)

    def due(self, time_ns: int) -> int:
        """Return how many steps a flight at a time [ns] is to take."""
        return min(self.lag_ns(time_ns) // self.dt_ns, self.max_steps)
