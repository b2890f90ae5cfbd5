# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""The definition of bodies that do not lift: fuselage, gear, in geometry axes G."""

import math
from dataclasses import dataclass

from poststall_sim.records import ConfigError, require_length, require_place, require_positive

THINNEST = 1e4
"""Length over diameter, beyond which the ellipsoid's apparent mass is round-off."""


@dataclass(frozen=True, slots=True)
class NonliftingBody:
    """
    A fuselage or a gear, by its drag areas.

    drag_area : cd A in flow along x, y and z of G [m^2]. Without a length the body is bluff, and
    all of it stands at position_G [m]. With a length [m] it is slender, its axis along x and
    position_G its middle: flow along it and across it are independent of each other, and what is
    across acts along the whole length. volume [m^3], of a slender body only: brings the moment
    of Munk.
    """

    name: str
    position_G: tuple[float, float, float]
    drag_area: tuple[float, float, float]
    length: float | None = None
    volume: float | None = None

    def __post_init__(self) -> None:
        """Refuse bodies that would push the aircraft on, and spheres for slender ones."""
        require_place(f'body {self.name}: position', self.position_G)
        if not all(math.isfinite(each) for each in self.drag_area):
            raise ConfigError(f'body {self.name}: drag_area must be three finite numbers, got '
                              f'{self.drag_area}')
        if min(self.drag_area) < 0.0:
            raise ConfigError(f'body {self.name}: drag areas must not be negative, got '
                              f'{self.drag_area} m^2')
        if self.length is not None:
            require_length(f'body {self.name}: length', self.length)
        if self.volume is None:
            return
        require_positive(f'body {self.name}: volume', self.volume, 'm^3')
        if self.length is None:
            raise ConfigError(f'body {self.name}: volume goes with length, which says how slender '
                              'the body is')
        if self.fineness < 1.0:
            raise ConfigError(f'body {self.name}: a volume of {self.volume:g} m^3 in a length of '
                              f'{self.length:g} m is thicker than it is long')
        if self.fineness > THINNEST:
            raise ConfigError(f'body {self.name}: a volume of {self.volume:g} m^3 in a length of '
                              f'{self.length:g} m is a wire, it must be at most {THINNEST:g} '
                              'times as long as it is thick')

    @property
    def fineness(self) -> float:
        """Return length over diameter of the ellipsoid with this length and volume."""
        return self.length * math.sqrt(math.pi * self.length / (6.0 * self.volume))
