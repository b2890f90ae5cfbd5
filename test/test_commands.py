# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""Who flies: priority, silence, limits."""

import numpy as np
import pytest

from poststall_sim.ros.commands import CommandDesk, OnTimeout, Source

TRIM = np.array([0.0, -0.05, 0.4])
SECOND = 1_000_000_000


@pytest.fixture
def desk():
    return CommandDesk(('aileron', 'elevator', 'throttle'),
                       ((-0.3, 0.3), (-0.5, 0.35), (0.0, 1.0)), TRIM)


def told(desk, time_s, allowed='auto', on_timeout=OnTimeout.HOLD):
    return desk.choose(round(time_s * SECOND), allowed=allowed, timeout=0.5,
                       on_timeout=on_timeout).tolist()


def test_without_a_command_the_controls_stay_at_trim(desk):
    assert told(desk, 100.0) == TRIM.tolist()
    assert desk.source is Source.NONE and desk.age(SECOND) is None


def test_what_a_message_does_not_name_holds(desk):
    desk.receive(Source.AUTOPILOT, {'elevator': -0.2}, 0)
    assert told(desk, 0.0) == [0.0, -0.2, 0.4]
    desk.receive(Source.AUTOPILOT, {'aileron': 0.1}, 0)
    assert told(desk, 0.0) == [0.1, -0.2, 0.4]


def test_the_pilot_goes_first_while_he_is_heard(desk):
    desk.receive(Source.PILOT, {'elevator': 0.1}, 0)
    desk.receive(Source.AUTOPILOT, {'elevator': -0.2}, SECOND // 2)
    assert told(desk, 0.5)[1] == 0.1 and desk.source is Source.PILOT
    assert told(desk, 0.501)[1] == -0.2 and desk.source is Source.AUTOPILOT
    assert desk.age(SECOND) == pytest.approx(0.5)


def test_what_a_silent_pilot_once_named_does_not_come_back(desk):
    """He moved the aileron long ago; the autopilot has moved it since."""
    desk.receive(Source.PILOT, {'aileron': 0.2}, 0)
    told(desk, 0.0)
    for k in range(20):
        desk.receive(Source.AUTOPILOT, {'aileron': -0.1}, k * SECOND // 10)
        told(desk, 0.1 * k)
    desk.receive(Source.PILOT, {'elevator': 0.1}, 2 * SECOND)
    assert told(desk, 2.0) == [-0.1, 0.1, 0.4]


@pytest.mark.parametrize(('allowed', 'elevator'), [('pilot', 0.1), ('autopilot', -0.2)])
def test_one_source_may_be_the_only_one(desk, allowed, elevator):
    desk.receive(Source.PILOT, {'elevator': 0.1}, 0)
    desk.receive(Source.AUTOPILOT, {'elevator': -0.2}, 0)
    assert told(desk, 0.0, allowed)[1] == elevator


@pytest.mark.parametrize(('on_timeout', 'expected'), [
    (OnTimeout.HOLD, [0.1, 0.2, 0.4]), (OnTimeout.TRIM, TRIM.tolist()),
    (OnTimeout.NEUTRAL, [0.0, 0.0, 0.0])])
def test_silence(desk, on_timeout, expected):
    desk.receive(Source.PILOT, {'aileron': 0.1, 'elevator': 0.2}, 0)
    assert told(desk, 0.5, on_timeout=on_timeout) == [0.1, 0.2, 0.4]
    assert told(desk, 0.6, on_timeout=on_timeout) == expected
    assert desk.source is Source.NONE


def test_values_beyond_limits_are_cut_and_counted(desk):
    beyond = desk.receive(Source.PILOT, {'aileron': 5.0, 'elevator': -9.0, 'throttle': 0.5}, 0)
    assert beyond == ['aileron', 'elevator']
    assert told(desk, 0.0) == [0.3, -0.5, 0.5]
    assert (desk.accepted, desk.clamped) == (1, 1)


def test_reset_forgets(desk):
    desk.receive(Source.PILOT, {'elevator': 0.2}, 0)
    told(desk, 0.0)
    desk.reset(SECOND)
    assert told(desk, 1.0) == TRIM.tolist()
