# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""The section curves between and at the points of their tables: smooth, periodic, honest."""

import math

import numpy as np
import pytest
import wings

from poststall_sim.aero import polars
from poststall_sim.aero.polars import GRID, mixture, section, section_polar
from poststall_sim.aircraft import Airfoil, ConfigError

NAMES = ('naca0012_re3e5', 'naca0012_re3e6', 'naca4415_re3e6', 'naca4415_re4e5')
STEP = 2.0 * math.pi / GRID


@pytest.fixture(params=[*NAMES, 'stalling'])
def airfoil(request):
    """Visit every shipped section and one by formula."""
    return wings.stalling() if request.param == 'stalling' else wings.shipped(request.param)


def table(airfoil):
    """Return the coefficients (n, 3) of a section's table."""
    return np.column_stack([airfoil.cl, airfoil.cd, airfoil.cm])


def test_curve_passes_through_every_point_of_its_table(airfoil):
    """All tables stand on whole, half or quarter degrees, where the grid has its points."""
    quarters = np.degrees(airfoil.alpha) * 4.0
    assert np.abs(quarters - np.round(quarters)).max() < 1e-9
    values = section_polar(airfoil).at(airfoil.alpha)
    assert np.abs(values[:, :3] - table(airfoil)).max() < 1e-12


def test_curve_of_a_table_off_the_grid_stays_near_its_points():
    """Where the grid has none of the table's points, cubics of a quarter degree lose little."""
    fine = wings.stalling()
    alpha = np.radians(np.concatenate([[-180.0], np.arange(-179.63, 179.9, 0.7), [180.0]]))
    polar = section_polar(fine)
    values = polar.at(alpha)
    values[-1] = values[0]
    odd = section_polar(Airfoil('off the grid', alpha, *values[:, :3].T))
    # The change of slope over one step of a curve that falls within 2.5 deg: h^2 cl''/8.
    bend = np.abs(np.diff(polar.at(np.linspace(-math.pi, math.pi, GRID + 1))[:, 3])).max() / STEP
    assert np.abs(odd.at(alpha)[:, :3] - values[:, :3]).max() < STEP ** 2 * bend / 8.0


def test_curve_does_not_overshoot_between_the_points_of_its_table(airfoil):
    """Between two points every coefficient stays between their values: no stall is invented."""
    polar, points = section_polar(airfoil), table(airfoil)
    share = np.linspace(0.0, 1.0, 41)[:, None]
    inside = polar.at(airfoil.alpha[:-1] * (1.0 - share) + airfoil.alpha[1:] * share)[..., :3]
    low, high = np.minimum(points[:-1], points[1:]), np.maximum(points[:-1], points[1:])
    assert np.all(inside >= low - 1e-12) and np.all(inside <= high + 1e-12)


def test_slope_is_that_of_the_curve(airfoil):
    """The reported slope is the derivative, by central differences of the curve itself."""
    polar = section_polar(airfoil)
    rng = np.random.default_rng(0)
    cell = np.arange(GRID)   # one angle inside each cell, where the curve is one cubic
    alpha = -math.pi + STEP * (cell + rng.uniform(0.1, 0.9, GRID))
    h = 0.02 * STEP
    difference = (polar.at(alpha + h)[:, 0] - polar.at(alpha - h)[:, 0]) / (2.0 * h)
    # A cubic's central difference is off by h^2 f'''/6; f''' of a cell is at most 12 d/STEP^2
    # with d the change of its slopes.
    slopes = polar.curve[0, 1]
    rise = np.diff(polar.curve[0, 0]) / STEP
    third = 6.0 * np.abs(slopes[1:] + slopes[:-1] - 2.0 * rise) / STEP ** 2
    assert np.all(np.abs(difference - polar.at(alpha)[:, 3]) < h ** 2 * third / 6.0 + 1e-9)


def test_value_and_slope_are_continuous_at_every_joint(airfoil):
    """C1: from both sides of each grid point, +-180 deg among them, all three coefficients."""
    polar = section_polar(airfoil)
    joints = np.linspace(-math.pi, math.pi, GRID + 1)
    tiny = 1e-9
    left, right = polar.at(joints - tiny), polar.at(joints + tiny)
    # Two nanoradians apart: the curve moves by its slope, the slope by its own.
    steepest = np.abs(polar.curve[:, 1]).max()
    assert np.abs(right[:, :3] - left[:, :3]).max() < 2.5 * tiny * max(steepest, 1.0)
    assert np.abs(right[:, 3] - left[:, 3]).max() < 1e-5
    for c in range(3):   # cd and cm report no slope: one-sided differences of second order
        h = 1e-4 * STEP
        one, two = polar.at(joints + h)[:, c], polar.at(joints + 2 * h)[:, c]
        forward = (4.0 * one - two - 3.0 * polar.at(joints)[:, c]) / (2.0 * h)
        one, two = polar.at(joints - h)[:, c], polar.at(joints - 2 * h)[:, c]
        backward = (3.0 * polar.at(joints)[:, c] - 4.0 * one + two) / (2.0 * h)
        assert np.abs(forward - backward).max() < 1e-6 * max(1.0, steepest)


def test_curve_repeats_after_a_full_turn(airfoil):
    """Any angle may be asked for; turns make no difference, and 180 deg is -180 deg."""
    polar = section_polar(airfoil)
    alpha = np.random.default_rng(1).uniform(-math.pi, math.pi, 500)
    for turns in (-3, -1, 1, 2):
        again = polar.at(alpha + 2.0 * math.pi * turns)
        assert np.abs(again - polar.at(alpha)).max() < 1e-11
    assert np.array_equal(polar.at(math.pi), polar.at(-math.pi))
    assert np.array_equal(polar.curve[:, :, 0], polar.curve[:, :, -1])


def test_symmetric_section_is_odd_in_lift_and_moment_and_even_in_drag():
    """Its table is mirrored to the last digit, and so is what is made of it."""
    polar = section_polar(wings.shipped('naca0012_re3e5'))
    alpha = np.random.default_rng(2).uniform(0.0, math.pi, 500)
    up, down = polar.at(alpha), polar.at(-alpha)
    # To round-off only: (pi + a) and (pi - a) fall on the grid with different last bits; a
    # slope is a difference over the grid's step and loses as many digits more.
    off = np.abs(up * [1, -1, 1, -1] + down).max(axis=0)
    assert np.all(off[:3] < 1e-14) and off[3] < 1e-11
    assert polar.zero_lift == pytest.approx(0.0, abs=1e-15)
    assert polar.stall_low == pytest.approx(-polar.stall_high, abs=1e-12)


def test_landmarks_are_roots_of_the_curve_that_is_flown(airfoil):
    """No lift at zero_lift; between the stalls lift rises from one extreme to the other."""
    polar = section_polar(airfoil)
    assert abs(polar.at(polar.zero_lift)[0]) < 1e-13
    assert polar.stall_low < polar.zero_lift < polar.stall_high
    for angle, sign in ((polar.stall_high, 1.0), (polar.stall_low, -1.0)):
        assert abs(polar.at(angle)[3]) < 1e-9
        # An extreme: on both sides it falls off, first of all towards zero lift.
        around = sign * polar.at(angle + np.radians([-1.0, -0.5, 0.0, 0.5, 1.0]))[:, 0]
        assert np.all(np.diff(around[:3]) > 0.0) and np.all(np.diff(around[2:]) < 0.0)
    attached = polar.at(np.linspace(polar.stall_low, polar.stall_high, 2001))
    assert np.all(np.diff(attached[:, 0]) > 0.0)


def test_stall_is_the_first_loss_of_lift_even_where_a_separated_plate_lifts_more():
    """
    A thick cambered section upside down stalls at -15 deg and has more lift again at -30 deg.

    A dip of less than 3 % on the way up, of which computed curves have some, is no stall.
    """
    polar = section_polar(wings.shipped('naca4415_re4e5'))
    assert polar.at(math.radians(-30.0))[0] < polar.at(polar.stall_low)[0]
    assert math.degrees(polar.stall_low) == pytest.approx(-15.0, abs=0.3)   # the file's header
    alpha = np.radians(np.linspace(-180.0, 180.0, 1441))
    dipped = np.sin(2.0 * alpha) - 0.03 * np.exp(-(np.degrees(alpha) - 12.0) ** 2)
    assert np.diff(dipped).min() < 0.0
    dipped[-1] = dipped[0]
    airfoil = Airfoil('dipped', alpha, dipped, 0.0 * alpha, 0.0 * alpha)
    assert section_polar(airfoil).stall_high == pytest.approx(math.radians(30.0), abs=1e-12)


def test_attached_potential_section_has_the_slope_of_thin_airfoil_theory():
    """The table of 2 pi sin(a - a0) is interpolated to a few parts in 1e8."""
    polar = section_polar(wings.potential(-4.0))
    alpha = np.radians(np.linspace(-60.0, 60.0, 997))
    lift, slope = polar.at(alpha)[:, [0, 3]].T
    # PCHIP's slopes are off by h^2 times curvature over slope: (0.0044 tan)^2/4 of 2 pi.
    assert np.abs(lift - 2.0 * np.pi * np.sin(alpha + math.radians(4.0))).max() < 1e-6
    assert np.abs(slope - 2.0 * np.pi * np.cos(alpha + math.radians(4.0))).max() < 2e-4
    assert math.degrees(polar.zero_lift) == pytest.approx(-4.0, abs=1e-9)


def test_section_between_two_others_is_their_mean_by_span():
    """A strip between two sections flies the curve in proportion, ends included."""
    first, second = (section_polar(wings.shipped(name)) for name in NAMES[:2])
    between = mixture(first, second, 0.25)
    alpha = np.linspace(-math.pi, math.pi, 313)
    expected = 0.75 * first.at(alpha) + 0.25 * second.at(alpha)
    assert np.abs(between.at(alpha) - expected).max() < 1e-13
    assert abs(between.at(between.zero_lift)[0]) < 1e-13
    assert mixture(first, second, 0.0) is first and mixture(first, first, 0.4) is first


def test_curve_without_lift_is_refused():
    """A section whose lift does not rise through zero cannot be flown, and is named."""
    alpha = np.radians(np.linspace(-180.0, 180.0, 73))
    nothing = 0.0 * alpha
    with pytest.raises(ConfigError, match='airfoil brick: cl must rise through zero'):
        section_polar(Airfoil('brick', alpha, nothing + 1.0, nothing, nothing))


def test_compiled_section_is_its_python_source(airfoil):
    """One strip or many, compiled or not: the same numbers."""
    polar = section_polar(airfoil)
    alpha = np.random.default_rng(3).uniform(-7.0, 7.0, 50)
    python = np.empty((50, 4))
    for angle, out in zip(alpha, python):
        getattr(section, 'py_func', section)(polar.curve, angle, out)
    assert np.abs(polar.at(alpha) - python).max() < 1e-13
    curves = np.stack([polar.curve, 2.0 * polar.curve])
    both, index = np.empty((50, 4)), np.arange(50) % 2
    polars.sections(curves, index, alpha, both)
    assert np.abs(both - python * (1.0 + index[:, None])).max() < 1e-12
