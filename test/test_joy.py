# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""A stick as the pilot: signs, deadband, what is refused, buttons."""

import dataclasses
import math

import pytest

pytest.importorskip('rclpy', reason='rclpy is not installed')

from sensor_msgs.msg import Joy

from poststall_sim.ros import joy
from poststall_sim.ros.commands import Refusal, RefusedCommand
from poststall_sim.ros.joy import Buttons, Lever
from poststall_sim.ros.parameters import SimulatorSettings

TRIM = {'aileron': 0.0, 'elevator': -0.05, 'rudder': 0.0, 'throttle': 0.4}
SETTINGS = SimulatorSettings()


def moved():
    """Return a lever that has been moved."""
    lever = Lever()
    assert not lever.moved(0.0, 0.05) and lever.moved(1.0, 0.05)
    return lever


def commands(settings=SETTINGS, trim=TRIM, lever=None, **axes):
    """Return the commands with some axes of a usual pad moved, left and up positive."""
    message = Joy(axes=[0.0] * 8)
    for name, value in axes.items():
        message.axes[{'rudder': 0, 'throttle': 1, 'aileron': 3, 'elevator': 4}[name]] = value
    return joy.commands(
        joy.positions(message, settings, trim), settings, trim, lever or moved())


def test_a_stick_in_the_middle_is_trim():
    assert commands() == pytest.approx(TRIM)
    assert commands(aileron=0.04, elevator=-0.05) == pytest.approx(TRIM)


@pytest.mark.parametrize('rest', [0.0, -1.0, 0.3])
def test_a_lever_that_nobody_has_touched_says_nothing_of_the_throttle(rest):
    """Wherever it stands, a hair to and fro, and with the stick in use."""
    lever = Lever()
    for way in (rest, rest + 0.04, rest - 0.04):
        assert 'throttle' not in commands(lever=lever, throttle=way, elevator=0.5)
    assert commands(lever=lever, throttle=0.8)['throttle'] > TRIM['throttle']
    assert commands(lever=lever, throttle=rest)['throttle'] == commands(
        throttle=rest)['throttle']   # from now on it is obeyed there too


def test_the_throttle_rises_from_none_through_trim_to_all():
    found = [commands(throttle=0.1 * way)['throttle'] for way in range(-10, 11)]
    assert (found[0], found[10], found[20]) == pytest.approx((0.0, 0.4, 1.0))
    assert found == sorted(found) and len(set(found)) == 21


def test_stick_right_rolls_right_stick_back_pulls_pedal_left_yaws_left():
    """Signs as in the README: aileron to the right, elevator up and rudder left."""
    assert commands(aileron=-1.0)['aileron'] == pytest.approx(0.35)
    assert commands(elevator=-1.0)['elevator'] == pytest.approx(-0.40)
    assert commands(rudder=1.0)['rudder'] == pytest.approx(0.35)
    assert commands(throttle=1.0)['throttle'] == 1.0
    assert commands(throttle=-1.0)['throttle'] == 0.0


def test_beyond_the_deadband_a_stick_begins_at_nothing_and_ends_at_all():
    found = dataclasses.replace(SETTINGS, joy_deadband=0.2, joy_rudder_scale=0.1)
    for way, expected in ((0.2, 0.0), (0.2001, 0.0), (0.6, 0.05), (-0.6, -0.05), (1.0, 0.1)):
        assert commands(found, rudder=way)['rudder'] == pytest.approx(expected, abs=2e-5)


def test_axes_that_are_off_and_controls_that_are_not_there_are_left_out():
    found = dataclasses.replace(SETTINGS, joy_rudder=-1)
    assert set(commands(found)) == {'aileron', 'elevator', 'throttle'}
    assert commands(trim={'elevator': 0.1}, elevator=1.0) == pytest.approx({'elevator': 0.45})


@pytest.mark.parametrize(('axes', 'refusal'), [
    ([0.0, 0.0, 0.0, 0.0], Refusal.LENGTH), ([0.0, 0.0, 0.0, math.nan, 0.0], Refusal.NOT_FINITE)])
def test_a_stick_with_too_few_axes_or_no_number_is_refused(axes, refusal):
    with pytest.raises(RefusedCommand) as caught:
        joy.positions(Joy(axes=axes), SETTINGS, TRIM)
    assert caught.value.refusal is refusal


def test_a_button_acts_when_it_goes_down():
    buttons = Buttons()

    def pressed(*down):
        return buttons.pressed(
            Joy(buttons=[int(index in down) for index in range(8)]), SETTINGS)
    assert pressed(7) == []          # held from the start
    assert pressed() == []
    assert pressed(7) == ['pause']
    assert pressed(7) == []
    assert pressed(6, 0) == ['reset', 'trim']
    assert buttons.pressed(Joy(), SETTINGS) == []
