# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""The definition of engines, in geometry axes G (x aft, y right, z up)."""

import math
from dataclasses import dataclass

from poststall_sim.records import ConfigError, require_positive


@dataclass(frozen=True, slots=True)
class Engine:
    """
    A propeller as a straight line of thrust over airspeed.

    static_thrust [N] at full throttle at rest, falling linearly to none at
    zero_thrust_airspeed [m/s]; it acts at position_G [m] along direction_G (unit, the way the
    thrust pushes). Throttle scales it linearly; there is no torque and no slipstream.
    """

    static_thrust: float
    zero_thrust_airspeed: float
    position_G: tuple[float, float, float]
    direction_G: tuple[float, float, float] = (-1.0, 0.0, 0.0)

    def __post_init__(self) -> None:
        """Refuse engines that push nowhere."""
        require_positive('static_thrust', self.static_thrust, 'N')
        require_positive('zero_thrust_airspeed', self.zero_thrust_airspeed, 'm/s')
        if abs(math.hypot(*self.direction_G) - 1.0) > 1e-6:
            raise ConfigError(f'direction must be a unit vector, got {self.direction_G}')
