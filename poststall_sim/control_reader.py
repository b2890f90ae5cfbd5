# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""Controls out of the mappings of an aircraft file."""

import math
from collections.abc import Mapping

from poststall_sim.aircraft import Surface
from poststall_sim.controls import Control, Effector
from poststall_sim.reader import Reader

_SIDES = {'both': 0, 'right': 1, 'left': -1}


def control(read: Reader, name: str, surfaces: tuple[Surface, ...]) -> Control:
    """Read a control of surfaces that are known."""
    low, high = read.vector('limits_deg', 2, within=(-90, 90))
    by_name = {surface.name: surface for surface in surfaces}
    return read.build(
        Control, name=name, limits=(math.radians(low), math.radians(high)),
        effectors=tuple(_effector(item, by_name) for item in read.mappings('effectors')))


def _effector(read: Reader, surfaces: Mapping[str, Surface]) -> Effector:
    surface = read.choice('surface', surfaces)
    side = read.choice('side', _SIDES, default='both')
    if side and not surface.symmetric:
        raise read.where.key('side').error(f'must be both, for surface {surface.name} is not '
                                           f'symmetric, got {"right" if side > 0 else "left"}')
    return read.build(
        Effector, surface=surface.name, side=side, hinge=read.number('hinge'),
        span=read.vector('span', 2, default=[0.0, 1.0]), gain=read.number('gain', default=1.0))
