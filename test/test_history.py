# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""Rows of a wake: kept without copying, and never changed under whoever still reads them."""

import numpy as np
import wings

from poststall_sim.aero import history, wake
from poststall_sim.aero.history import History
from poststall_sim.aero.model import build
from poststall_sim.aero.wake import Placement

ROWS = 12


def row(k):
    """Return nodes and rings of a row that says which one it is."""
    return np.full((3, 3), float(k)), np.full(2, float(k))


def store(rows=ROWS):
    """Return a store of rows 0, -1, -2 ..., the newest first."""
    nodes, rings = zip(*(row(-k) for k in range(rows)))
    return History(np.array(nodes), np.array(rings))


def test_rows_are_read_newest_first_whatever_has_passed():
    """Three times as many steps as slots: always the last rows, in order."""
    kept = store()
    first = kept.first
    for k in range(1, 3 * history.ROOM * ROWS):
        kept, first = kept.with_row(first, ROWS - 1, *row(k))
        expected = np.arange(k, k - ROWS, -1.0)
        assert np.array_equal(kept.nodes[first:first + ROWS, 0, 0], expected)
        assert np.array_equal(kept.rings[first:first + ROWS, 1], expected)
        assert len(kept.nodes) <= history.ROOM * ROWS + 1


def test_stores_are_made_once_in_as_many_steps_as_there_are_rows():
    """No copying per step: the same memory is written until it is full."""
    kept = store()
    first, made = kept.first, 0
    for k in range(1, 20 * ROWS + 1):
        before = kept
        kept, first = kept.with_row(first, ROWS - 1, *row(k))
        made += kept is not before
    assert made == 20 - 1   # the first had the room already


def test_two_steps_from_one_wake_do_not_see_each_other():
    """The second one gets a store of its own; the wake that both started from stays."""
    begin = store()
    one, at_one = begin.with_row(begin.first, ROWS - 1, *row(1))
    other, at_other = begin.with_row(begin.first + 1, ROWS - 1, *row(2))
    assert one is begin and other is not begin
    assert one.nodes[at_one, 0, 0] == 1.0 and other.nodes[at_other, 0, 0] == 2.0
    assert np.array_equal(begin.nodes[at_one + 1:at_one + 1 + ROWS, 0, 0], -np.arange(12.0))


def test_a_wake_stays_what_it_was_while_later_ones_are_shed():
    """Bit for bit, over several stores, with a step taken twice and rows that merge."""
    lattice = build(wings.rectangular(4, 6)).lattice
    before = wake.straight(lattice, Placement(np.zeros(3), wings.LEVEL),
                           np.array([0.25, 0.0, 0.0]), ROWS, np.ones(6))
    kept = []
    for k in range(5 * ROWS):
        kept.append((before, before.nodes_N, before.circulation))
        # Every fifth step is a short one, whose row takes in the next; some are taken twice.
        north = 0.25 * (k - k // 5 + 0.02 * (k % 5 == 0)) + 0.25
        for _ in range(1 + (k % 7 == 0)):
            after = wake.shed(before, lattice, Placement(np.array([north, 0.0, 0.0]), wings.LEVEL),
                              np.full(6, float(k)), np.array([0.0, 0.01, 0.0]))
        before = after
    for old, nodes, circulation in kept:
        assert np.array_equal(old.nodes_N, nodes)
        assert np.array_equal(old.circulation, circulation)
        assert len(nodes) == ROWS + 1 and len(circulation) == ROWS


def test_wind_moves_all_rows_without_touching_them():
    """What is stored stays; where it is in N moves on with the air."""
    lattice = build(wings.rectangular(4, 6)).lattice
    before = wake.straight(lattice, Placement(np.zeros(3), wings.LEVEL),
                           np.array([0.25, 0.0, 0.0]), ROWS, np.ones(6))
    drift = np.array([1.0, -2.0, 0.5])
    after = wake.shed(before, lattice, Placement(np.array([0.3, 0.0, 0.0]) + drift, wings.LEVEL),
                      np.ones(6), drift)
    assert after.settled is before.settled
    assert np.abs(after.nodes_N[1:] - before.nodes_N[:-1] - drift).max() < 1e-15
