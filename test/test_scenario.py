# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""What the pilot does: straight lines between points, held at the ends."""

import pytest

from poststall_sim.aircraft import ConfigError
from poststall_sim.scenario import Channel, Scenario

RAMP = ((2.0, 0.0), (4.0, -0.2), (6.0, -0.2), (6.0, 0.1))


def flight(*channels):
    return Scenario('test', duration=10.0, airspeed=15.0, altitude=100.0, channels=channels)


@pytest.mark.parametrize('time, value', [
    (0.0, 0.0), (2.0, 0.0), (3.0, -0.1), (4.0, -0.2), (5.5, -0.2), (7.0, 0.1), (99.0, 0.1)])
def test_straight_lines_between_points_and_held_ends(time, value):
    assert Channel('elevator', RAMP).value(time) == pytest.approx(value, abs=1e-15)


def test_a_step_is_two_points_at_one_time():
    channel = Channel('elevator', RAMP)
    assert channel.value(6.0 - 1e-9) == pytest.approx(-0.2, abs=1e-12)
    assert channel.value(6.0 + 1e-9) == pytest.approx(0.1, abs=1e-12)


def test_relative_channels_add_the_trim_and_absolute_ones_do_not():
    scenario = flight(Channel('elevator', ((0.0, -0.1),)),
                      Channel('throttle', ((0.0, 0.6),), relative=False))
    commands = scenario.commands(1.0, {'elevator': 0.02, 'throttle': 0.3, 'rudder': 0.5})
    assert commands == pytest.approx({'elevator': -0.08, 'throttle': 0.6})


def test_without_a_trim_a_relative_channel_starts_from_neutral():
    assert flight(Channel('rudder', ((0.0, 0.1),))).commands(5.0, {}) == {'rudder': 0.1}


def test_controls_without_a_channel_are_left_alone():
    assert flight().commands(1.0, {'elevator': 0.02}) == {}


@pytest.mark.parametrize('make, message', [
    (lambda: Channel('rudder', ()), 'channel rudder: needs at least one point'),
    (lambda: Channel('rudder', ((1.0, 0.0), (0.5, 0.1))), 'channel rudder: times must not fall'),
    (lambda: Scenario('s', 0.0, 15.0, 100.0), 'scenario s: duration and airspeed must be above'),
    (lambda: Scenario('s', 5.0, -1.0, 100.0), 'got 5.0 s and -1.0 m/s'),
    (lambda: Scenario('s', float('nan'), 15.0, 100.0), 'got nan s'),
    (lambda: flight(Channel('rudder', RAMP), Channel('rudder', RAMP)),
     'two channels move one control'),
])
def test_refusals(make, message):
    with pytest.raises(ConfigError, match=message):
        make()
