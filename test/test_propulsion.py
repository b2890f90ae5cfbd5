# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""Thrust: the straight line, its ends, and where it acts."""

import dataclasses
import math

import numpy as np
import propellers
import pytest
import wings

from poststall_sim import definition, propulsion
from poststall_sim.aircraft import ConfigError
from poststall_sim.engines import LinearThrust, Rotation, ThrustTable
from poststall_sim.state import EngineState

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
    (0.0, 1.0), (12.5, 0.5), (25.0, 0.0), (37.5, 0.0), (90.0, 0.0), (-10.0, 1.0)])
def test_thrust_falls_on_a_straight_line_and_is_held_at_its_ends(trainer, speed, share):
    aircraft = with_engines(trainer, engine(cg=trainer.mass.cg_G))
    force, moment = thrust(aircraft, speed * FORWARD, 1.0)
    assert force == pytest.approx(share * STATIC * FORWARD, abs=ROUND_OFF)
    assert moment == pytest.approx(np.zeros(3), abs=ROUND_OFF)


@pytest.mark.parametrize('speed', [0.0, 12.5, 24.9, 25.0, 30.0, 60.0])
def test_more_throttle_never_brakes_more(trainer, speed):
    aircraft = with_engines(trainer, engine(cg=trainer.mass.cg_G))
    forces = [thrust(aircraft, speed * FORWARD, throttle)[0][0]
              for throttle in np.linspace(0.0, 1.0, 5)]
    assert np.diff(forces).min() >= 0.0 == forces[0]


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


# --- a table


def test_a_thrust_table_is_linear_between_its_rows_and_held_beyond(trainer):
    table = ThrustTable([0.0, 0.5, 1.0], [0.0, 20.0], [[0.0, -1.0], [8.0, 4.0], [20.0, 10.0]],
                        trainer.mass.cg_G)
    for throttle, speed, expected in (
            (1.0, 0.0, 20.0), (0.5, 10.0, 6.0), (0.75, 10.0, 10.5), (0.25, 20.0, 1.5),
            (1.0, 50.0, 10.0), (1.0, -5.0, 20.0), (0.0, 20.0, -1.0)):
        force, moment = thrust(with_engines(trainer, table), speed * FORWARD, throttle)
        assert force == pytest.approx(expected * FORWARD, abs=ROUND_OFF)
        assert moment == pytest.approx(np.zeros(3), abs=ROUND_OFF)


@pytest.mark.parametrize('throttle, airspeed, rows, message', [
    ([0.0, 0.9], [0.0, 9.0], [[0.0, 0.0], [1.0, 1.0]], 'throttle must run from 0 to 1'),
    ([0.0, 1.0], [9.0, 0.0], [[0.0, 0.0], [1.0, 1.0]], 'airspeed must be at least 2 .* rise'),
    ([0.0, 1.0], [0.0, 9.0], [[0.0, 0.0]], 'a row for each of the 2 throttles'),
    ([0.0, 1.0], [0.0, 9.0], [[0.0, 0.0], [1.0, math.inf]], 'thrust must be finite')])
def test_a_thrust_table_that_is_none_is_refused(throttle, airspeed, rows, message):
    with pytest.raises(ConfigError, match=message):
        ThrustTable(throttle, airspeed, rows, (0.0, 0.0, 0.0))


# --- a propeller and what it does to the aircraft


def turning(trainer, **changes):
    """Return the trainer with a governed propeller through its centre of gravity."""
    return with_engines(trainer, propellers.propeller(
        position_G=trainer.mass.cg_G, drive=propellers.GOVERNOR, inertia=1e-3, **changes))


@pytest.mark.parametrize('rotation, side', [
    (Rotation.CLOCKWISE, -1.0), (Rotation.COUNTERCLOCKWISE, 1.0)])
def test_a_propeller_that_turns_clockwise_seen_from_behind_rolls_the_aircraft_left(
        trainer, rotation, side):
    push = wings.push(turning(trainer, rotation=rotation), np.zeros(3), 1.0)
    torque = 0.045 * wings.DENSITY * 150.0 ** 2 * 0.4 ** 5 / (2.0 * math.pi)
    assert push.moment_B == pytest.approx([side * torque, 0.0, 0.0], rel=1e-12)
    assert push.force_B[0] == pytest.approx(0.1 * wings.DENSITY * 150.0 ** 2 * 0.4 ** 4)


@pytest.mark.parametrize('rotation, sign', [
    (Rotation.CLOCKWISE, 1.0), (Rotation.COUNTERCLOCKWISE, -1.0)])
def test_a_turning_shaft_answers_a_turn_at_right_angles(trainer, rotation, sign):
    """M = -omega x h: nose up turns a clockwise one's nose right, nose right its nose down."""
    machine = turning(trainer, rotation=rotation)
    h = 1e-3 * propellers.GOVERNOR.greatest_speed
    still = wings.push(machine, np.zeros(3), 1.0).moment_B
    for rates, answer in (((0.0, 0.5, 0.0), (0.0, 0.0, 0.5 * h)),
                          ((0.0, 0.0, 0.5), (0.0, -0.5 * h, 0.0)), ((0.5, 0.0, 0.0), (0, 0, 0))):
        moment = wings.push(machine, np.zeros(3), 1.0, rates_B=rates).moment_B - still
        assert moment == pytest.approx(sign * np.array(answer), abs=ROUND_OFF)


def test_a_shaft_that_speeds_up_turns_the_aircraft_against_it(trainer):
    """What the mount feels is the drive's torque: that of the air and I d(Omega)/dt."""
    machine = turning(trainer)
    meeting = propulsion.Meeting(np.zeros(3), np.zeros(3), wings.DENSITY, np.array([1.0]))
    push = propulsion.loads(machine, EngineState([600.0], [1.0]), meeting)
    rate = (propellers.GOVERNOR.greatest_speed - 600.0) / propellers.GOVERNOR.spool_time
    assert push.moment_B[0] == pytest.approx(-(push.readings.torque[0] + 1e-3 * rate), rel=1e-12)


def test_turning_about_the_centre_of_gravity_moves_an_engine_through_the_air(trainer):
    """A yaw to the right at 1 rad/s takes 0.4 m/s from the right one, 0.4 m out."""
    cg = trainer.mass.cg_G
    pair = with_engines(trainer, engine((0, -0.4, 0), cg=cg), engine((0, 0.4, 0), cg=cg))
    push = wings.push(pair, 10.0 * FORWARD, 1.0, rates_B=(0.0, 0.0, 1.0))
    left, right = (STATIC * (1.0 - speed / ZERO_AT) for speed in (10.4, 9.6))
    assert push.readings.thrust == pytest.approx([left, right], abs=ROUND_OFF)
    assert push.moment_B == pytest.approx([0.0, 0.0, 0.4 * (left - right)], abs=ROUND_OFF)


def test_a_failed_engine_has_no_throttle(trainer):
    cg = trainer.mass.cg_G
    pair = with_engines(trainer, engine((0, -0.4, 0), cg=cg), engine((0, 0.4, 0), cg=cg))
    assert pair.engine_names == ('engine_1', 'engine_2')
    push = wings.push(pair, np.zeros(3), 0.5, failed=frozenset({'engine_2'}))
    assert push.force_B == pytest.approx([0.5 * STATIC, 0.0, 0.0], abs=ROUND_OFF)
    assert push.moment_B == pytest.approx([0.0, 0.0, 0.4 * 0.5 * STATIC], abs=ROUND_OFF)
    assert push.readings.failed.tolist() == [0.0, 1.0]
