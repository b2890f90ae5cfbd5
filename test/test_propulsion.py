# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""Thrust: the straight line, its ends, and where it acts."""

import dataclasses
import math

import numpy as np
import pytest
import wings

from poststall_sim import definition
from poststall_sim.engines import LinearThrust

STATIC, ZERO_AT = 20.0, 25.0
FORWARD = np.array([1.0, 0.0, 0.0])
# Sums of a few products.
ROUND_OFF = 1e-12


@pytest.fixture(scope='module')
def trainer():
    return definition.aircraft(definition.find('aircraft', 'trainer'))


def with_engines(aircraft, *engines):
    return dataclasses.replace(aircraft, engines=engines)


def thrust(aircraft, velocity_B, throttle):
    push = wings.push(aircraft, velocity_B, throttle)
    return push.force_B, push.moment_B


def engine(offset=(0.0, 0.0, 0.0), direction=(-1.0, 0.0, 0.0), cg=(0.0, 0.0, 0.0)):
    return LinearThrust(STATIC, ZERO_AT, tuple(np.add(cg, offset)), direction)


@pytest.mark.parametrize('speed, share', [
    (0.0, 1.0), (12.5, 0.5), (25.0, 0.0), (37.5, -0.5), (50.0, -1.0), (90.0, -1.0), (-10.0, 1.0)])
def test_thrust_falls_on_a_straight_line_and_is_held_at_its_ends(trainer, speed, share):
    aircraft = with_engines(trainer, engine(cg=trainer.mass.cg_G))
    force, moment = thrust(aircraft, speed * FORWARD, 1.0)
    assert force == pytest.approx(share * STATIC * FORWARD, abs=ROUND_OFF)
    assert moment == pytest.approx(np.zeros(3), abs=ROUND_OFF)


def test_throttle_scales_the_thrust(trainer):
    aircraft = with_engines(trainer, engine(cg=trainer.mass.cg_G))
    forces = [thrust(aircraft, 10.0 * FORWARD, throttle)[0][0] for throttle in (0.0, 0.25, 1.0)]
    assert forces == pytest.approx([0.0, 0.25 * 12.0, 12.0], abs=ROUND_OFF)


@pytest.mark.parametrize('offset_G, moment_B', [
    ((0, 0.3, 0), (0, 0, -0.3 * STATIC)),    # on the right wing: the nose goes left
    ((0, 0, 0.2), (0, -0.2 * STATIC, 0)),    # above: the nose goes down
    ((0.5, 0, 0), (0, 0, 0)),                # along its own line
])
def test_moment_about_the_centre_of_gravity(trainer, offset_G, moment_B):
    aircraft = with_engines(trainer, engine(offset_G, cg=trainer.mass.cg_G))
    assert thrust(aircraft, np.zeros(3), 1.0)[1] == pytest.approx(moment_B, abs=ROUND_OFF)


def test_only_the_air_along_the_line_of_thrust_counts(trainer):
    """A line tilted 30 deg up meets cos 30 deg of the airspeed, and none from the side."""
    c, s = math.cos(math.radians(30.0)), math.sin(math.radians(30.0))
    aircraft = with_engines(trainer, engine(direction=(-c, 0.0, s), cg=trainer.mass.cg_G))
    force, _ = thrust(aircraft, np.array([10.0, 7.0, 0.0]), 1.0)
    push = STATIC * (1.0 - 10.0 * c / ZERO_AT)
    assert force == pytest.approx([push * c, 0.0, -push * s], abs=ROUND_OFF)


def test_engines_add_up_and_a_glider_has_none(trainer):
    cg = trainer.mass.cg_G
    left, right = engine((0, -0.4, 0), cg=cg), engine((0, 0.4, 0), cg=cg)
    force, moment = thrust(with_engines(trainer, left, right), np.zeros(3), 1.0)
    assert force == pytest.approx(2.0 * STATIC * FORWARD, abs=ROUND_OFF)
    assert moment == pytest.approx(np.zeros(3), abs=ROUND_OFF)
    force, moment = thrust(with_engines(trainer), 10.0 * FORWARD, 1.0)
    assert not force.any() and not moment.any()
