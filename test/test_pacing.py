# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""Simulated time beside a clock that we hold in the hand."""

import pytest

from poststall_sim.ros.pacing import Follower, Pacer

MS = 1_000_000


def pacer(dt_ms=5, factor=1.0, max_steps=10):
    return Pacer(dt_ms * MS, factor=factor, max_steps=max_steps)


def wake(p, now_ns):
    """Take all the steps that are due; return how many."""
    due = p.due(now_ns)
    for _ in range(due):
        p.stepped()
    return due


@pytest.mark.parametrize('factor', [0.1, 1.0, 3.7])
def test_steps_follow_the_clock_however_it_is_looked_at(factor):
    p = pacer(factor=factor)
    now = 17 * MS
    wake(p, now)
    for k in range(2000):
        now += (3 + 7 * (k % 5)) * MS // 5
        wake(p, now)
    assert p.steps == int((now - 17 * MS) * factor / (5 * MS))
    assert p.lost_ns == 0
    assert p.achieved == pytest.approx(factor, rel=2e-3)


def test_debt_beyond_the_cap_is_lost_and_not_made_up_later():
    p = pacer()
    wake(p, 0)
    assert wake(p, 200 * MS) == 10      # 40 were due
    assert p.lost_ns == 150 * MS
    assert wake(p, 204 * MS) == 0
    assert wake(p, 205 * MS) == 1
    assert p.achieved == pytest.approx(11 * 5 / 205)


def test_a_step_is_late_beyond_20_ms_or_two_steps():
    p = pacer()
    wake(p, 0)
    wake(p, 25 * MS)                    # due at 5 ms, so 20 ms behind: just not late
    assert (p.late, p.lag_max_ns) == (0, 20 * MS)
    wake(p, 60 * MS)                    # due at 30, 35, ... 60: the first two are late
    assert p.late == 2
    slow = pacer(dt_ms=30)
    wake(slow, 0)
    wake(slow, 90 * MS)                 # due at 30 ms, 60 ms behind: two steps
    assert slow.late == 0
    wake(slow, 181 * MS)                # due at 120 ms
    assert slow.late == 1


def test_as_fast_as_possible_is_a_batch_at_every_wake():
    p = pacer(factor=0.0, max_steps=7)
    assert [wake(p, k * MS) for k in range(3)] == [7, 7, 7]
    assert p.late == p.lost_ns == 0 and p.steps == 21


def test_a_pause_is_neither_late_nor_lost():
    p = pacer()
    wake(p, 0)
    wake(p, 50 * MS)
    p.stop()
    assert wake(p, 9000 * MS) == 0
    assert wake(p, 9005 * MS) == 1
    assert (p.late, p.lost_ns) == (5, 0)   # those of the first wake: 45 ms behind and less
    assert p.achieved == pytest.approx(1.0)


def test_steps_that_were_due_and_not_taken_do_not_count():
    """A flight that ends in the middle of a batch, after two of its eight steps."""
    p = pacer()
    p.due(0)
    assert p.due(40 * MS) == 8
    p.stepped()
    p.stepped()
    p.stop()
    assert p.steps == 2 and p.late == 2           # due at 5 and 10 ms: 35 and 30 ms behind
    assert p.achieved == pytest.approx(2 * 5 / 40)
    assert wake(p, 1000 * MS) == 0
    assert wake(p, 1005 * MS) == 1
    assert (p.steps, p.late, p.lost_ns) == (3, 2, 0)


def test_what_is_forgiven_is_counted_and_the_schedule_stays():
    """A trim of 103 ms: 20 steps are lost, and 3 ms of the next one stay."""
    p = pacer()
    wake(p, 0)
    wake(p, 50 * MS)
    p.forgive(153 * MS)
    assert (p.steps, p.lost_ns, p.lost_wall_ns) == (10, 100 * MS, 100 * MS)
    assert wake(p, 154 * MS) == 0 and wake(p, 155 * MS) == 1
    p.stop()
    p.forgive(500 * MS)     # nothing is owed in a pause
    assert p.lost_ns == 100 * MS
    assert p.achieved == pytest.approx(11 * 5 / 155)


def test_30_changes_of_the_factor_lose_no_time():
    """Simulated time is what the factors add up to, to the step that is not yet due."""
    p, now, asked_ns, factor = pacer(), 0, 0.0, 1.0
    wake(p, now)
    for k in range(30):
        for _ in range(3):
            now += 7 * MS + k
            asked_ns += factor * (7 * MS + k)
            wake(p, now)
        factor = (0.3, 1.0, 2.7)[k % 3]
        p.change(factor, now)
    assert p.lost_ns == 0
    assert 0 <= asked_ns - p.steps * p.dt_ns < p.dt_ns
    assert p.late == 0
    p.change(0.0, now)
    assert wake(p, now) == 10
    p.change(1.0, now)
    assert wake(p, now + 5 * MS) == 0    # as fast as it can go owes nothing
    assert wake(p, now + 10 * MS) == 1


def test_a_follower_takes_on_the_clock_and_then_every_step_up_to_it():
    follower = Follower(7, max_steps=4)
    assert follower.joined(0) == 0 and follower.due(0) == 0     # there is no clock yet
    assert not follower.heard(100)
    assert follower.joined(0) == 98 and follower.due(98) == 0   # whole steps
    assert follower.joined(98) == 98
    follower.heard(98 + 3 * 7 + 6)
    assert follower.due(98) == 3 and follower.lag_ns(98) == 27
    follower.heard(98 + 50 * 7)
    assert follower.due(98) == 4                                # the others at the next look
    assert follower.lost_ns == 0
    follower.stop()                                             # a pause is not caught up with
    assert follower.joined(98) == 98 + 50 * 7 and follower.lost_ns == 50 * 7
    assert follower.heard(70) and follower.whole_ns == 70 and follower.jumps_back == 1
    assert follower.due(98) == 0
