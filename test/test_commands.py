# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""Who flies: priority, silence, limits."""

import numpy as np
import pytest

from poststall_sim.ros.commands import (
    CommandDesk,
    OnTimeout,
    Refusal,
    RefusedCommand,
    Source,
    Turns,
)

TRIM = np.array([0.0, -0.05, 0.4])
SECOND = 1_000_000_000


@pytest.fixture
def desk():
    return CommandDesk(('aileron', 'elevator', 'throttle'),
                       ((-0.3, 0.3), (-0.5, 0.35), (0.0, 1.0)), TRIM)


def told(desk, time_s, allowed='auto', on_timeout=OnTimeout.HOLD, deadband=0.0):
    return desk.choose(round(time_s * SECOND), allowed=allowed, timeout=0.5,
                       on_timeout=on_timeout, deadband=deadband).tolist()


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


def test_the_sum_is_trim_and_what_both_add_to_it_within_the_limits(desk):
    desk.receive(Source.PILOT, {'elevator': -0.15, 'aileron': 0.2}, 0)
    desk.receive(Source.AUTOPILOT, {'elevator': 0.05, 'aileron': 0.2, 'throttle': 0.6}, 0)
    # elevator: -0.05 - 0.1 + 0.1; aileron: 0.4 cut to 0.3; the throttle is the autopilot's.
    assert told(desk, 0.0, 'sum') == pytest.approx([0.3, -0.05, 0.6])
    assert desk.source is Source.SUM and desk.age(SECOND // 4) == pytest.approx(0.25)
    desk.receive(Source.AUTOPILOT, {'elevator': 0.05}, SECOND)
    assert told(desk, 1.0, 'sum')[1] == pytest.approx(0.05)   # the pilot is no longer heard
    desk.engaged = False
    assert told(desk, 1.0, 'sum')[1] == pytest.approx(0.05)   # held
    assert told(desk, 2.0, 'sum', OnTimeout.TRIM) == TRIM.tolist()


def test_a_pilot_at_rest_leaves_the_controls_to_an_autopilot_who_is_there(desk):
    rest = {'aileron': 0.004, 'elevator': TRIM[1] - 0.009, 'throttle': 0.9}
    desk.receive(Source.PILOT, rest, 0)
    assert told(desk, 0.0, deadband=0.01)[1] == rest['elevator']   # nobody else is there
    assert desk.source is Source.PILOT
    desk.receive(Source.AUTOPILOT, {'elevator': -0.2}, 0)
    assert told(desk, 0.0, deadband=0.01)[1] == -0.2 and desk.source is Source.AUTOPILOT
    assert told(desk, 0.0, deadband=0.0)[1] == rest['elevator']    # a deadband of 0 is none
    desk.receive(Source.PILOT, {'aileron': 0.011}, 0)
    assert told(desk, 0.0, deadband=0.01)[0] == 0.011 and desk.source is Source.PILOT


def test_an_autopilot_that_is_not_engaged_is_not_heard(desk):
    desk.receive(Source.AUTOPILOT, {'elevator': -0.2}, 0)
    desk.engaged = False
    assert told(desk, 0.0) == told(desk, 0.0, 'autopilot') == TRIM.tolist()
    desk.engaged = True
    assert told(desk, 0.0)[1] == -0.2


def refusal(desk, stamp_s, time_s, source=Source.PILOT):
    try:
        desk.admit(source, round(stamp_s * SECOND), round(time_s * SECOND), timeout=0.5)
    except RefusedCommand as error:
        return error.refusal
    return None


def test_stale_and_out_of_order_commands_are_refused(desk):
    assert refusal(desk, 10.0, 10.5) is None
    assert refusal(desk, 10.0, 10.501) is Refusal.STALE
    assert refusal(desk, 10.3, 10.4) is refusal(desk, 10.3, 10.4) is None
    assert refusal(desk, 10.2, 10.4) is Refusal.OUT_OF_ORDER
    assert refusal(desk, 10.2, 10.4, Source.AUTOPILOT) is None     # each source by itself
    assert refusal(desk, 0.0, 10.4) is None                        # says nothing
    # Wall time says nothing of the flight's, but of its own order; and stands in nobody's way.
    assert refusal(desk, 1.7e9, 10.4) is None
    assert refusal(desk, 1.7e9 - 1.0, 10.4) is Refusal.OUT_OF_ORDER
    assert refusal(desk, 10.35, 10.4) is None
    desk.reset(0)
    assert refusal(desk, 0.1, 0.1) is None


def test_each_command_of_a_lock_step_has_one_turn():
    turns = Turns()
    assert turns.is_new(Source.PILOT, 0)
    turns.take(Source.PILOT, 0)
    assert not turns.is_new(Source.PILOT, 0)   # sent again
    assert turns.is_new(Source.AUTOPILOT, 0)   # another's answer to the same state
    assert turns.is_new(Source.PILOT, 6_000_000)
    assert turns.repeated == 1
    turns.forget()
    assert turns.is_new(Source.PILOT, 0)       # time went back to 0
