# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""What the middles of edges miss at corners: its formula, and where it is nothing."""

import math

import numpy as np
import pytest
import wings
from scipy.integrate import quad

from poststall_sim.aero import lattice as lattices
from poststall_sim.aero.corners import add_corners, missing
from poststall_sim.aero.kernels import ring_influence

FAR = 1e6
X = np.array([1.0, 0.0, 0.0])


def line(psi):
    """Return the direction of a line at an angle from x, in the plane z = 0."""
    return np.array([math.cos(psi), math.sin(psi), 0.0])


def part(psi, ratio=1.0, *, trailing=False):
    """Return what is missing along x of a line at an angle, in z."""
    return missing(X[None], line(psi)[None], np.array([ratio]), trailing=trailing)[0, 2]


@pytest.mark.parametrize('degrees', [30.0, 75.0, 90.0, 105.0, 150.0, 170.0])
def test_flow_along_a_line_is_its_logarithm_and_what_is_missing(degrees):
    """Quadrature of the kernel, whose core is in every squared distance, to 10^4 cores."""
    psi, core = math.radians(degrees), 1e-4
    down = np.array([0.0, 0.0, -FAR])
    # Out along the line, home along z: that side induces nothing in z, the others are far.
    ring = np.array([[0.0 * X, FAR * line(psi), FAR * line(psi) + down, down]])

    def per_logarithm(log):
        out = np.empty((1, 1, 3))
        ring_influence(math.exp(log) * X[None], ring, np.full((1, 1), core), out)
        return out[0, 0, 2] * math.exp(log)

    flow = quad(per_logarithm, math.log(1e-6 * core), 0.0, limit=200)[0]
    logarithm = (1.0 + math.cos(psi)) / math.sin(psi) * math.log(1.0 / core)
    # Both leave out terms of the order of the core over the distance along and across.
    assert flow == pytest.approx(part(psi) - logarithm / (4.0 * math.pi), abs=1e-5)


def test_middles_of_edges_have_a_core_of_a_seventh():
    """Sum of 1/(j + 1/2) to n is ln n + Euler's constant + 2 ln 2, but for 1/n^2."""
    n = 1000
    middles = np.sum(1.0 / (np.arange(n) + 0.5))
    assert middles == pytest.approx(math.log(7.124 * n), abs=1e-4)


def test_nothing_is_missing_at_right_angles_and_straight_on():
    """But a core of their own where edges differ, which a trailing vortex may keep."""
    for psi in (0.5 * math.pi, math.pi - 1e-9, math.pi - 1e-5):
        assert abs(part(psi)) < 1e-5
    for ratio in (0.3, 3.0):
        assert abs(part(0.5 * math.pi, ratio, trailing=True)) < 1e-15
        bent = part(2.0, ratio) - part(2.0)
        assert bent == pytest.approx(
            -(1.0 + math.cos(2.0)) / math.sin(2.0) * math.log(ratio) / (4.0 * math.pi))


@pytest.mark.parametrize('cosine', [False, True])
def test_a_straight_wing_has_no_corners(cosine):
    lattice = lattices.build(wings.rectangular(8, 12, cosine=cosine), 4)
    added = np.zeros((len(lattice.edge_vector), lattice.panels, 3))
    add_corners(lattice, added)
    assert np.abs(added).max() < 1e-12
