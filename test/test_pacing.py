# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""Simulated time beside a clock that we hold in the hand."""

import pytest

from poststall_sim.ros.pacing import Pacer

MS = 1_000_000


def pacer(dt_ms=5, factor=1.0, max_steps=10):
    return Pacer(dt_ms * MS, factor=factor, max_steps=max_steps)


@pytest.mark.parametrize('factor', [0.1, 1.0, 3.7])
def test_steps_follow_the_clock_however_it_is_looked_at(factor):
    p = pacer(factor=factor)
    now = 17 * MS
    p.due(now)
    for k in range(2000):
        now += (3 + 7 * (k % 5)) * MS // 5
        p.due(now)
    assert p.steps == int((now - 17 * MS) * factor / (5 * MS))
    assert p.lost_ns == 0
    assert p.achieved == pytest.approx(factor, rel=2e-3)


def test_debt_beyond_the_cap_is_lost_and_not_made_up_later():
    p = pacer()
    p.due(0)
    assert p.due(200 * MS) == 10      # 40 were due
    assert p.lost_ns == 150 * MS
    assert p.due(204 * MS) == 0
    assert p.due(205 * MS) == 1
    assert p.achieved == pytest.approx(11 * 5 / 205)


def test_a_step_is_late_beyond_20_ms_or_two_steps():
    p = pacer()
    p.due(0)
    p.due(25 * MS)                    # due at 5 ms, so 20 ms behind: just not late
    assert (p.late, p.lag_max_ns) == (0, 20 * MS)
    p.due(60 * MS)                    # due at 30, 35, ... 60: the first two are late
    assert p.late == 2
    slow = pacer(dt_ms=30)
    slow.due(0)
    slow.due(90 * MS)                 # due at 30 ms, 60 ms behind: two steps
    assert slow.late == 0
    slow.due(181 * MS)                # due at 120 ms
    assert slow.late == 1


def test_as_fast_as_possible_is_a_batch_at_every_wake():
    p = pacer(factor=0.0, max_steps=7)
    assert [p.due(k * MS) for k in range(3)] == [7, 7, 7]
    assert p.late == p.lost_ns == 0


def test_a_pause_is_neither_late_nor_lost():
    p = pacer()
    p.due(0)
    p.due(50 * MS)
    p.stop()
    assert p.due(9000 * MS) == 0
    assert p.due(9005 * MS) == 1
    assert (p.late, p.lost_ns) == (5, 0)   # those of the first wake: 45 ms behind and less
    assert p.achieved == pytest.approx(1.0)
