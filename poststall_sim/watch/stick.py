# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""Which page holds the controls, and what it holds them at."""

from collections.abc import Hashable, Mapping

SILENCE = 2.0
"""A page that has said nothing for so long holds the controls no more [s]."""


class Stick:
    """
    The controls as one page holds them: whoever takes them last has them.

    A page says again and again where it holds them; once it is silent, closed or asleep, they are
    let go of, and the simulator does what its parameters say of a pilot who is silent.
    """

    def __init__(self) -> None:
        self.holder: Hashable | None = None
        self._values: dict[str, float] = {}
        self._heard_at = 0.0

    def hold(self, page: Hashable, values: Mapping[str, float], now: float, *,
             take: bool) -> None:
        """Hold the controls at values by name [rad; throttle 0..1]; only who takes them can."""
        if take or self.holder == page:
            self.holder, self._heard_at, self._values = page, now, dict(values)

    def release(self, page: Hashable) -> None:
        """Let go of the controls, if this page holds them."""
        if self.holder == page:
            self.holder, self._values = None, {}

    def values(self, now: float) -> dict[str, float]:
        """Return what to command now; empty when nobody holds the controls."""
        if self.holder is not None and now - self._heard_at > SILENCE:
            self.release(self.holder)
        return self._values
