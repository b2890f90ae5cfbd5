# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""The definition of controls: what they move, and how far. Angles in radians."""

import math
from dataclasses import dataclass

from poststall_sim.records import ConfigError


@dataclass(frozen=True, slots=True)
class Effector:
    """
    The part of a surface that a control moves.

    span : from, to as shares of the (half) span, 0 at the root or left end, 1 at the tip.
    side : +1 starboard half, -1 port half, 0 both. hinge : share of the chord, 0 for an
    all-moving surface. gain : deflection per control deflection (mixing), signed.
    """

    surface: str
    span: tuple[float, float] = (0.0, 1.0)
    side: int = 0
    hinge: float = 0.75
    gain: float = 1.0

    def __post_init__(self) -> None:
        """Refuse spans and hinges outside the surface."""
        low, high = self.span
        if not 0.0 <= low < high <= 1.0:
            raise ConfigError(f'span must satisfy 0 <= from < to <= 1, got {self.span}')
        if not 0.0 <= self.hinge < 1.0:
            raise ConfigError(f'hinge must lie in 0 <= hinge < 1 of the chord, got {self.hinge}')
        if not math.isfinite(self.gain) or self.gain == 0.0:
            raise ConfigError(f'gain must be a finite number other than 0, got {self.gain}')


@dataclass(frozen=True, slots=True)
class Control:
    """A control by name, its limits [rad] and the effectors that it moves."""

    name: str
    limits: tuple[float, float]
    effectors: tuple[Effector, ...]

    def __post_init__(self) -> None:
        """Refuse limits that do not hold the neutral position between them."""
        low, high = self.limits
        if not (low <= 0.0 <= high and low < high and max(-low, high) <= math.pi / 2):
            raise ConfigError(
                f'control {self.name}: limits must satisfy low <= 0 <= high within +-90 deg, '
                f'got {math.degrees(low):g} to {math.degrees(high):g} deg')
        if not self.effectors:
            raise ConfigError(f'control {self.name}: moves nothing, it needs an effector')
