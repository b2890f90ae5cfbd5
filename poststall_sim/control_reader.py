# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""Controls out of the mappings of an aircraft file."""

import math
from collections.abc import Mapping

from poststall_sim.actuators import Actuator
from poststall_sim.aircraft import Surface
from poststall_sim.controls import Control, Effector
from poststall_sim.reader import Reader

SIDES = {'both': 0, 'right': 1, 'left': -1}


def control(read: Reader, name: str, surfaces: tuple[Surface, ...]) -> Control:
    """Read a control of surfaces that are known."""
    low, high = read.vector('limits_deg', 2, within=(-90, 90))
    by_name = {surface.name: surface for surface in surfaces}
    return read.build(
        Control, name=name, limits=(math.radians(low), math.radians(high)),
        effectors=tuple(_effector(item, by_name) for item in read.mappings('effectors')),
        actuator=_actuator(read.mapping('actuator', default={})))


def _actuator(read: Reader) -> Actuator:
    limit, lag = {}, {}
    if read.has('rate_limit_deg_s'):
        limit = {'rate_limit': math.radians(read.number('rate_limit_deg_s', above=0))}
    if read.has('natural_frequency_rad_s'):
        lag = {'natural_frequency': read.number('natural_frequency_rad_s', above=0),
               'damping': read.number('damping', above=0)}
    return read.build(
        Actuator, time_constant=read.number('time_constant_s', default=0.0, at_least=0),
        dead_time=read.number('dead_time_s', default=0.0, at_least=0), **limit, **lag)


def _stops(read: Reader) -> tuple[float, float]:
    if not read.has('limits_deg'):
        return -math.inf, math.inf
    low, high = read.vector('limits_deg', 2, within=(-90, 90))
    return math.radians(low), math.radians(high)


def _effector(read: Reader, surfaces: Mapping[str, Surface]) -> Effector:
    surface = read.choice('surface', surfaces)
    side = read.choice('side', SIDES, default='both')
    if side and not surface.symmetric:
        raise read.where.key('side').error(f'must be both, for surface {surface.name} is not '
                                           f'symmetric, got {"right" if side > 0 else "left"}')
    return read.build(
        Effector, surface=surface.name, side=side, hinge=read.number('hinge'),
        span=read.vector('span', 2, default=[0.0, 1.0]), gain=read.number('gain', default=1.0),
        stops=_stops(read),
        hinge_axis=read.vector('hinge_axis', 3) if read.has('hinge_axis') else None)
