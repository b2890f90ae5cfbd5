# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""Engines out of the mappings of an aircraft file."""

import math

from poststall_sim.engines import Engine
from poststall_sim.reader import Reader


def engine(read: Reader) -> Engine:
    """Read an engine."""
    direction = read.vector('direction', 3, default=[-1.0, 0.0, 0.0])
    length = math.hypot(*direction)
    if not 0.0 < length < math.inf:
        raise read.where.key('direction').error(f'must point somewhere, got {direction}')
    return read.build(
        Engine, static_thrust=read.number('static_thrust_N', above=0),
        zero_thrust_airspeed=read.number('zero_thrust_airspeed_m_s', above=0),
        position_G=read.vector('position_m', 3),
        direction_G=tuple(component / length for component in direction))
