# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""How many steps are due: simulated time kept beside a steady clock, and how well that goes."""

import math


class Pacer:
    """
    Tell at each wake how many steps of dt are due, and count what came late or never.

    Steps are due at wall times one dt / factor apart. A wake gets all that are due, up to
    max_steps; debt beyond that is forgiven (the schedule moves on) and counted as lost time,
    so that simulated time only ever advances by dt. A factor of 0 means as fast as possible:
    max_steps at every wake. A step is late when it runs more than max(2 dt, 20 ms) after it
    was due. Only steps that were taken, as `stepped` is told, are counted.
    """

    LATE_NS = 20_000_000
    """Lag that is never late [ns]: what a desktop's scheduler does anyhow."""

    def __init__(self, dt_ns: int, *, factor: float, max_steps: int) -> None:
        self.dt_ns = dt_ns
        self.factor = factor
        self.max_steps = max_steps
        self.steps = 0
        self.late = 0
        self.lost_ns = 0
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

    def due(self, now_ns: int) -> int:
        """Return how many steps to take at wall time [ns of a steady clock]."""
        if self._start_ns is None:
            self._start_ns = self._seen_ns = now_ns
            self._done = 0
        self.running_ns += now_ns - self._seen_ns
        self._seen_ns = now_ns
        if self.factor == 0.0:
            return self.max_steps
        owed = math.floor((now_ns - self._start_ns) / (self.dt_ns / self.factor)) - self._done
        granted = min(owed, self.max_steps)
        self.lost_ns += (owed - granted) * self.dt_ns
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
