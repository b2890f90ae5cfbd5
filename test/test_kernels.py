# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""
The Biot-Savart kernels against closed forms, each other, and their own uncompiled selves.

Nothing of `exact` is shared with the product: `exact.segment_velocity` is written with angles.
"""

import exact
import numba
import numpy as np
import pytest

from poststall_sim.aero.kernels import _segment, grid_edges, grid_velocity, ring_influence

# Of sums of some hundred terms of order one: a thousand times the round-off of one of them.
ROUND_OFF = 1e-12


@pytest.fixture
def rng():
    """Give every test the same numbers, so that a failure can be looked at again."""
    return np.random.default_rng(20260701)


def segment(points, start, end, core=0.0):
    """Return the velocity (n, 3) of one unit segment at points."""
    return np.array([_segment(*p, *start, *end, core) for p in np.atleast_2d(points)])


def rings(points, corners, circulation, core=0.0):
    """Return the velocity (n, 3) of rings (k, 4, 3) with circulation (k,)."""
    out = np.empty((len(points), len(corners), 3))
    ring_influence(points, corners, np.full(out.shape[:2], core), out)
    return np.einsum('ijk,j->ik', out, circulation)


def grid(points, nodes, circulation, core=1e-5, kernel=grid_velocity, edges=grid_edges,
         real=np.float64):
    """Return the velocity (n, 3) of a grid of nodes (r + 1, c + 1, 3) of rings (r, c)."""
    arrays = np.empty((6, nodes.shape[0] * nodes.shape[1]), dtype=real)
    edges(nodes, circulation, np.full(len(nodes), core), arrays)
    out = np.full((len(points), 3), np.nan, dtype=real)
    kernel(*arrays, nodes.shape[1], points.astype(real), out)
    return out


def ring_corners(nodes):
    """Return the corners (rings, 4, 3) of a grid of nodes, in the lattice's order."""
    return np.stack([nodes[:-1, :-1], nodes[:-1, 1:], nodes[1:, 1:], nodes[1:, :-1]],
                    axis=2).reshape(-1, 4, 3)


def warped(rng, rows, columns):
    """Return a random warped sheet of nodes (rows + 1, columns + 1, 3), ring size about 1."""
    x, y = np.meshgrid(np.arange(rows + 1.0), np.arange(columns + 1.0), indexing='ij')
    return np.stack([x, y, 0.1 * x], axis=-1) + rng.uniform(-0.3, 0.3, (rows + 1, columns + 1, 3))


def test_segment_equals_the_law_of_biot_and_savart_with_its_angles(rng):
    """The form without a branch is the textbook's with the two angles at the ends."""
    start, end = np.array([0.3, -1.0, 0.2]), np.array([-0.4, 1.5, 0.7])
    points = rng.normal(scale=2.0, size=(200, 3))
    reference = exact.segment_velocity(points, start, end, 1.0)
    assert np.abs(segment(points, start, end) - reference).max() < ROUND_OFF


def test_circular_ring_matches_the_analytic_axis_velocity():
    """On its axis, a ring of radius R induces gamma R^2 / (2 (R^2 + z^2)^(3/2))."""
    gamma, radius, z = 3.0, 0.7, np.array([0.0, 0.4, 1.3])
    reference = exact.ring_axis_velocity(z, gamma, radius)
    points = np.column_stack([np.zeros_like(z), np.zeros_like(z), z])
    errors = []
    for n in (40, 80, 160):
        angle = np.linspace(0.0, 2.0 * np.pi, n + 1)
        corner = radius * np.column_stack([np.cos(angle), np.sin(angle), np.zeros(n + 1)])
        velocity = gamma * sum(segment(points, a, b) for a, b in zip(corner, corner[1:]))
        assert np.abs(velocity[:, :2]).max() < ROUND_OFF   # symmetry
        errors.append(np.abs(velocity[:, 2] - reference).max())
    # A polygon of n sides approaches its circle as 1/n^2.
    order = np.log2(np.array(errors[:-1]) / np.array(errors[1:]))
    assert order == pytest.approx([2.0, 2.0], abs=0.02)


def test_long_segment_tends_to_an_infinite_line_vortex(rng):
    """A segment cut off at +-L lacks h^2/(2 L^2) of the line's velocity at its middle."""
    points = rng.normal(size=(20, 3))
    direction = np.array([0.6, 0.0, 0.8])
    line = exact.line_vortex_velocity(points, np.zeros(3), direction, 1.0)
    errors = []
    for half in (200.0, 400.0):
        velocity = segment(points, -half * direction, half * direction)
        errors.append(np.abs(velocity - line).max())
    assert errors[0] < 1e-4 and np.log2(errors[0] / errors[1]) == pytest.approx(2.0, abs=0.01)


def test_ring_is_positive_from_left_to_right_in_front():
    """Circulation to starboard in front lifts: seen from above the ring pushes air down."""
    corners = np.array([[[0, -1, 0], [0, 1, 0], [2, 1, 0], [2, -1, 0]]], dtype=float)
    inside, ahead = rings(np.array([[1.0, 0, 0], [-1.0, 0, 0]]), corners, [1.0])
    # Four sides of a square of half side 1: sqrt(2)/pi, von Karman's and Biot's own example.
    assert inside == pytest.approx([0.0, 0.0, -np.sqrt(2.0) / np.pi], abs=ROUND_OFF)
    assert ahead[2] > 0.0


def test_grid_of_rings_is_the_sum_of_its_rings(rng):
    """Edges counted once with net strength, streamed in blocks, are the rings one by one."""
    # (140, 5) and (3, 600): many blocks of 512 nodes, and one row longer than a block.
    for rows, columns in ((1, 1), (1, 7), (6, 1), (9, 4), (140, 5), (3, 600)):
        nodes = warped(rng, rows, columns)
        circulation = rng.normal(size=(rows, columns))
        points = rng.uniform([-1, -1, -2], [rows + 1, columns + 1, 2], (40, 3))
        # Same core: a softened segment is the same function of its two ends in both kernels.
        for core in (1e-5, 0.2):
            together = grid(points, nodes, circulation, core)
            one_by_one = rings(points, ring_corners(nodes), circulation.ravel(), core)
            assert np.abs(together - one_by_one).max() < ROUND_OFF * max(
                1.0, np.abs(one_by_one).max()), (rows, columns, core)


def test_grid_leaves_out_the_line_from_the_end_of_a_row_to_the_next():
    """A point exactly between a row's last node and the next row's first is like any other."""
    # A body in level flight puts its tail there: its wing's wake lies in the tail's own plane.
    for half, length in ((1.0, 1.0), (2.0, 3.0), (3.0, 4.0), (6.0, 0.25), (0.5, 2.0)):
        y = np.linspace(-half, half, 5)
        nodes = np.stack([np.column_stack([np.full(5, k * length), y, 0.0 * y])
                          for k in range(4)])
        share = np.arange(1, 8)[:, None] / 8.0
        points = nodes[1, -1] * (1.0 - share) + nodes[2, 0] * share
        circulation = np.ones((3, 4))
        velocity = grid(points, nodes, circulation)
        reference = rings(points, ring_corners(nodes), circulation.ravel(), 1e-5)
        assert np.abs(velocity - reference).max() < 1e-9, (half, length)


def test_single_precision_is_right_to_a_few_millionths(rng):
    """A float32 grid away from its points: 3e-6 of the largest velocity, on any lattice."""
    for rows, columns in ((1, 7), (9, 4), (140, 5), (60, 40)):
        nodes = warped(rng, rows, columns)
        circulation = rng.normal(size=(rows, columns))
        # Near the origin, as a lattice is: the grid of a float shrinks with its numbers.
        points = rng.uniform([-1, -1, 0.7], [min(rows, 9) + 1, columns + 1, 2], (100, 3))
        points[:, 2] += 0.1 * points[:, 0]
        double = grid(points, nodes, circulation)
        single = grid(points, nodes, circulation, real=np.float32)
        assert np.abs(single - double).max() < 3e-6 * np.abs(double).max(), (rows, columns)


@pytest.mark.skipif(numba.config.DISABLE_JIT, reason='nothing is compiled')
def test_nothing_in_the_single_precision_kernel_is_double():
    """One constant without a type would lift the loop to float64, at half the speed."""
    # Compiled here: an overload loaded from the cache has forgotten its types.
    kernel = numba.njit(fastmath=True, error_model='numpy')(grid_velocity.py_func)
    array, table = numba.float32[::1], numba.float32[:, ::1]
    kernel.compile((*[array] * 6, numba.int64, table, table))
    types = kernel.overloads[kernel.signatures[0]].type_annotation.typemap
    double = {name for name, kind in types.items() if kind == numba.float64
              and not name.startswith('$')}
    assert not double


def circulation_around(velocity, corners, order=40, pieces=12):
    """Return the integral of velocity . dl around a closed path of straight sides."""
    place, weight = np.polynomial.legendre.leggauss(order)
    total = 0.0
    for a, b in zip(corners, np.roll(corners, -1, axis=0)):
        for i in range(pieces):
            start, step = a + (b - a) * i / pieces, (b - a) / pieces
            points = start + 0.5 * (1.0 + place[:, None]) * step
            total += 0.5 * np.sum(weight * (velocity(points) @ step))
    return total


def test_velocity_of_a_closed_ring_has_circulation_only_through_it(rng):
    """Around a path outside none, around one of its sides its own, with the sign (Stokes)."""
    nodes = warped(rng, 1, 1)
    corners = ring_corners(nodes)

    def velocity(points):
        return rings(points, corners, [2.5])

    outside = np.array([[-1, -2, 1.5], [3, -2, 1.0], [3, 4, 2.0], [-1, 3, 1.5]], dtype=float)
    assert abs(circulation_around(velocity, outside)) < 1e-9
    # In a plane across the front side, right-handed about +y: z turns towards x.
    middle = 0.5 * (corners[0, 0] + corners[0, 1])
    around = middle + 0.3 * np.array([[-1, 0, -1], [-1, 0, 1], [1, 0, 1], [1, 0, -1]])
    # Gauss-Legendre of order 40 on twelve pieces is exact to far below this.
    assert circulation_around(velocity, around) == pytest.approx(2.5, abs=1e-8)


def test_mirrored_rings_induce_the_mirrored_velocity(rng):
    """Mirrored in y = 0, left and right corners change places and the circulation stays."""
    flip = np.array([1.0, -1.0, 1.0])
    corners = ring_corners(warped(rng, 3, 2))
    points = rng.normal(size=(30, 3))
    gamma = rng.normal(size=6)
    here = rings(points, corners, gamma)
    there = rings(points * flip, corners[:, [1, 0, 3, 2]] * flip, gamma)
    # The four sides add up in another order, so the last bits may differ.
    assert np.abs(there - here * flip).max() < ROUND_OFF
    # One segment has no sum: its mirror image, run through backwards, is exact.
    a, b = corners[0, :2]
    assert np.array_equal(segment(points * flip, b * flip, a * flip), segment(points, a, b) * flip)


def test_velocity_of_a_segment_falls_to_zero_inside_its_core_and_is_whole_outside():
    """The core acts like a radius: nothing on the line, most a core away, all far from it."""
    start, end, core = np.array([0.0, -1.0, 0.0]), np.array([0.0, 1.0, 0.0]), 0.05
    distance = core * np.array([0.0, 1e-6, 0.1, 0.5, 1.0, 2.0, 10.0, 40.0])
    points = np.column_stack([distance, 0.0 * distance, 0.0 * distance])
    soft = np.linalg.norm(segment(points, start, end, core), axis=1)
    hard = np.linalg.norm(exact.segment_velocity(points[1:], start, end, 1.0), axis=1)
    ratio = soft[1:] / hard
    assert soft[0] == 0.0
    assert np.all(np.diff(ratio) > 0.0)   # from none to all of it
    # Near the middle of a long segment the law is h^2/(h^2 + core^2), as Scully's vortex.
    h = distance[1:-2]
    assert ratio[:-2] == pytest.approx(h ** 2 / (h ** 2 + core ** 2), rel=0.01)
    assert ratio[-1] > 0.999
    # It is greatest about one core away, at half of what a bare filament has there.
    assert soft.max() == soft[4] == pytest.approx(0.5 / (2.0 * np.pi * core), rel=0.01)


def test_points_on_a_segment_its_line_and_its_ends_give_finite_values():
    """Without a core the line itself, ahead and behind, has no velocity; the ends neither."""
    start, end = np.array([0.0, -1.0, 0.0]), np.array([0.0, 1.0, 0.0])
    points = np.array([[0, y, 0] for y in (-5.0, -1.0, -0.3, 0.0, 0.3, 1.0, 5.0)])
    for core in (0.0, 1e-5, 0.1):
        assert np.array_equal(segment(points, start, end, core), np.zeros((7, 3)))
    assert np.array_equal(segment(points, start, start, 1e-5), np.zeros((7, 3)))   # no length


def test_compiled_kernels_return_what_their_python_source_returns(rng):
    """What is tested uncompiled, for coverage, is what flies."""
    nodes = warped(rng, 40, 14)   # 615 nodes: more than one block
    circulation = rng.normal(size=(40, 14))
    points = rng.uniform(-1.0, 15.0, (4, 3))
    fast = grid(points, nodes, circulation)
    source = getattr(grid_velocity, 'py_func', grid_velocity)
    slow = grid(points, nodes, circulation, kernel=source,
                edges=getattr(grid_edges, 'py_func', grid_edges))
    assert np.abs(fast - slow).max() < ROUND_OFF

    corners = ring_corners(nodes)[:9]
    core = np.full((4, 9), 0.01)
    compiled, python = np.empty((4, 9, 3)), np.empty((4, 9, 3))
    ring_influence(points, corners, core, compiled)
    getattr(ring_influence, 'py_func', ring_influence)(points, corners, core, python)
    # The same operations in the same order; contraction to fused steps is all that may differ.
    assert np.abs(compiled - python).max() < 1e-15


@pytest.mark.parametrize('real', [np.float32, np.float64])
def test_points_on_segments_and_on_nodes_get_numbers(real):
    """In the plane of a sheet, on its edges' middles, its nodes and the lines beyond them."""
    nodes = np.stack([*np.meshgrid(0.25 * np.arange(5.0), np.arange(4.0), indexing='ij'),
                      np.zeros((5, 4))], axis=-1)
    x, y = np.meshgrid(0.125 * np.arange(-2.0, 11.0), 0.5 * np.arange(-1.0, 8.0))
    points = np.column_stack([x.ravel(), y.ravel(), np.zeros(x.size)])
    for core in (1e-5, 0.05):
        velocity = grid(points, nodes, np.ones((4, 3)), core, real=real)
        assert np.isfinite(velocity).all()
        # Nothing in the plane but across it, and no more than rings an eighth of a panel away.
        assert np.abs(velocity[:, :2]).max() < 1e-5 and np.abs(velocity[:, 2]).max() < 10.0
