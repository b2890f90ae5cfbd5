# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""What the wake's velocity costs and what the savings on it cost, each against doing without."""

import math

import numpy as np
import pytest
import wings

from poststall_sim.aero import wash
from poststall_sim.aero.kernels import ring_influence
from poststall_sim.aero.model import Settings, build
from poststall_sim.aero.skeleton import skeleton
from poststall_sim.aero.wash import Precision

SAVINGS = [
    # What is saved, and the change of lift and of pitching moment that it may make, as shares
    # of their ranges in a march through stall.
    ({'precision': Precision.FLOAT32}, 5e-6, 3e-5),
    ({'coarsen': True}, 1e-4, 1e-4),
    ({'interpolate': True}, 3e-4, 6e-4),
    ({'precision': Precision.FLOAT32, 'coarsen': True, 'interpolate': True}, 3e-4, 6e-4)]


def stalled(t):
    """Return an unsteady onset through stall with sideslip, at 40 m/s."""
    return wings.onset(40.0, 0.3 + 0.2 * math.sin(15.0 * t), 0.1 * math.cos(10.0 * t))


def ladder(length, distance, coarsen=True):
    """Return the rows at which groups begin, and the end."""
    marks = np.full(len(length) + 2, -1)
    groups = wash.ladder(length, distance, coarsen, marks)
    return marks[:groups + 1]


@pytest.fixture(scope='module')
def marched():
    """Give the loads (steps, 6) of the march without savings."""
    return through_stall(wings.EXACTLY)


def through_stall(settings):
    model = build(wings.wing_tail(), Settings(tolerance=1e-9, **settings))
    return np.array([[*result.force_G, *result.moment_G] for _, _, result in wings.march(
        model, stalled, 0.25 / 40.0, 120)])


def test_without_savings_it_is_the_velocity_of_all_rings_one_by_one():
    """On every point, those on the wake's own front edge too, and with the closing row."""
    model = build(wings.wing_tail(), Settings(**wings.EXACTLY))
    *_, (placement, flow, _) = wings.march(model, stalled, 0.25 / 40.0, 30)
    found, _ = wash.velocity(flow.wake, model.lattice, model.felt, placement, False)
    nodes = placement.to_geometry(flow.wake.nodes_N)
    along = (nodes[-1] - nodes[0]).mean(axis=0)
    far = nodes[-1:] + model.felt.far * along / np.linalg.norm(along)
    nodes = np.concatenate([nodes, far])
    circulation = np.concatenate([flow.wake.circulation, flow.wake.circulation[-1:]])
    expected, bounds = np.zeros_like(found), model.felt.bounds
    for s, source in enumerate(model.lattice.grids):
        sheet = nodes[:, source.nodes]
        corners = np.stack([sheet[:-1, :-1], sheet[:-1, 1:], sheet[1:, 1:], sheet[1:, :-1]],
                           axis=2).reshape(-1, 4, 3)
        for t in range(len(model.lattice.grids)):
            here = slice(bounds[t, 2], bounds[t + 1, 2])
            out = np.empty((bounds[t + 1, 2] - bounds[t, 2], len(corners), 3))
            ring_influence(model.felt.points[here], corners,
                           np.full(out.shape[:2], model.felt.cores[s, t]), out)
            column = 0 if s == t else 3
            expected[here, column:column + 3] += np.einsum(
                'ijk,j->ik', out, circulation[:, source.strips].ravel())
    # Round-off on the front edge, over its core; see `test_heading_and_attitude...`.
    assert np.abs(found - expected).max() < 1e-5 * np.abs(expected).max()
    panels = model.felt.panel
    assert np.abs(found - expected)[panels].max() < 1e-10 * np.abs(expected).max()


@pytest.mark.parametrize(('saving', 'lift', 'moment'), SAVINGS)
def test_savings_on_the_wake_hardly_change_the_loads(marched, saving, lift, moment):
    """Pitching of 0.4 rad and sideslip through stall, a tail in the wake of its wing."""
    loads = through_stall({**wings.EXACTLY, **saving})
    error = np.abs(loads - marched).max(axis=0) / np.ptp(marched, axis=0)
    assert error[2] < lift and error[4] < moment
    assert error[2] > 0.0   # it does something


def test_savings_hold_on_a_wing_that_is_no_plane():
    """Dihedral, taper and a fin: 5e-4 of the greatest velocity, at a quarter of the cost."""
    model = build(wings.shipped_aircraft('trainer'), Settings(**wings.EXACTLY))
    fast = build(wings.shipped_aircraft('trainer'))
    *_, (placement, flow, _) = wings.march(
        model, lambda t: wings.onset(15.0, 0.2 + 0.1 * math.sin(5.0 * t), 0.1), 0.05 / 15.0, 150)
    exact, pairs = wash.velocity(flow.wake, model.lattice, model.felt, placement, False)
    found, fewer = wash.velocity(flow.wake, fast.lattice, fast.felt, placement, True)
    assert np.abs(found - exact).max() < 5e-4 * np.abs(exact).max()
    assert fewer < 0.25 * pairs


def test_rows_are_one_by_one_near_and_an_eighth_of_their_distance_far():
    """Sixteen of equal length, then no more than eight groups for each doubling."""
    for rows in (1, 16, 17, 100, 333, 5000):
        marks = ladder(np.ones(rows), np.arange(rows + 1.0))
        assert marks[0] == 0 and marks[-1] == rows
        assert np.array_equal(marks[:17], np.arange(min(rows, 16) + 1))
        assert np.all(np.diff(marks)[16:] <= marks[16:-1] / 8.0)
        assert len(marks) - 1 <= 16 + 8 * max(0.0, math.ceil(math.log2(rows / 16.0)))
    assert np.array_equal(ladder(np.ones(100), np.arange(101.0), False), np.arange(101))


def test_rows_beside_a_tail_are_one_by_one():
    """A tail 40 rows behind the edge: groups shrink towards it and grow again behind it."""
    place = np.arange(101.0)
    marks = ladder(np.ones(100), np.abs(place - 40.0))
    assert set(range(24, 57)) <= set(marks)
    size, nearest = np.diff(marks), np.minimum(np.abs(marks[1:] - 40), np.abs(marks[:-1] - 40))
    assert np.all((size == 1) | (size <= nearest / 8.0))
    assert len(marks) - 1 == 54


def test_a_row_that_is_not_finite_is_a_group_like_any_other():
    """The march goes on to its status; what it counts with stays within its arrays."""
    length, distance = np.ones(40), np.arange(41.0)
    length[20:], distance[30:] = np.nan, np.nan
    marks = ladder(length, distance)
    assert marks[-1] == 40 and np.all(np.diff(marks) > 0)


def test_the_skeleton_returns_what_is_linear_along_its_surface():
    """Polynomials of the first degree in the place, exactly, on every surface and piece."""
    for machine in (wings.rectangular(8, 40), wings.wing_tail(strips=40),
                    wings.shipped_aircraft('trainer')):
        lattice = build(machine).lattice
        for grid in lattice.grids:
            found = skeleton(lattice, grid)
            if not len(found.points_G):
                continue
            where = np.concatenate([lattice.collocation[grid.panels],
                                    lattice.edge_middle[grid.edges]])
            field = np.array([[0.3, -0.2, 0.5], [1.0, 0.1, 0.0], [0.2, 0.4, -0.7]])
            assert found.weights.sum(axis=1) == pytest.approx(np.ones(len(where)), abs=1e-12)
            # A tapered strip is bilinear, and so is the place in its own two parameters.
            assert found.weights @ (found.points_G @ field) == pytest.approx(
                where @ field, abs=1e-3 * np.ptp(where, axis=0).max())


def test_cost_rises_with_the_logarithm_of_the_wake():
    """Ten times the rows, less than one and a half times the pairs of nodes and points."""
    pairs = {}
    for length in (20.0, 200.0):
        model = build(wings.rectangular(8, 40), Settings(wake_length=length))
        placement, flow, _ = next(iter(wings.march(
            model, lambda t: wings.onset(1.0, 0.1), 0.25, 1)))
        pairs[length] = wash.velocity(
            flow.wake, model.lattice, model.felt, placement, True)[1]
    assert pairs[200.0] < 1.5 * pairs[20.0]
