# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""Modes along the angle of attack: branches, names, folds, trims that are not there."""

import math

import curves
import numpy as np
import pytest
import wings

from poststall_sim import trim as trims
from poststall_sim.aero.model import Settings, build
from poststall_sim.aircraft import ConfigError
from poststall_sim.frames import GRAVITY, quaternion_from_euler, rotation
from poststall_sim.stability import flight
from poststall_sim.stability.motion import Decambering
from poststall_sim.state import Status

ALTITUDE = 300.0
CLASSICAL = ['short period', 'phugoid', 'Dutch roll', 'roll', 'spiral']


def few_strips(foil=None):
    machine = wings.shipped_aircraft('trainer')
    machine = machine if foil is None else curves.with_airfoil(machine, foil)
    return curves.with_strips(machine, wing=10, tail=4, fin=3)


@pytest.fixture(scope='module')
def model():
    return build(few_strips(), Settings(chordwise=2, wake_length=2.0))


def along(model, degrees, decamberings=(Decambering.VARIABLE,), **options):
    flown = flight.trims_along(model, np.radians(degrees), altitude=ALTITUDE)
    return list(flight.modes_along(
        model, flown, altitude=ALTITUDE, decamberings=decamberings, **options))


def test_names_follow_the_branches_into_the_stall(model):
    """
    From 2 to 23 deg, every model: the same five names, and each branch moves in steps.

    With the decambering that follows, the spiral leaves to the right past the stall, quicker than
    anything else, and is not taken for the roll; with the fixed one it does not.
    """
    points = along(model, range(2, 24), tuple(Decambering), quasi_steady=True)
    for found in points:
        assert [each.model for each in found] == ['fixed', 'variable', 'lagged', 'quasi-steady']
        for each in found:
            assert each.status is Status.CONVERGED and not each.departed
            assert each.residual < 1e-10
            assert [mode.name for mode in each.modes][:5] == CLASSICAL
            assert all(mode.name.startswith('wake') for mode in each.modes[5:])
    fixed, variable, lagged, plain = (
        np.array([[mode.eigenvalue for mode in each.modes[:5]] for each in column])
        for column in zip(*points))
    spiral = CLASSICAL.index('spiral')
    assert variable[-1, spiral].real > 5.0 > 1.0 > fixed[-1, spiral].real
    assert lagged[-1, spiral].real < variable[-1, spiral].real
    for slow in (CLASSICAL.index(name) for name in ('phugoid', 'Dutch roll')):
        for branch in (fixed, variable, lagged, plain):
            step = np.abs(np.diff(branch[:, slow]))
            assert np.all(step < 0.3 * np.abs(branch[1:, slow]))


def test_shares_tell_modes_of_the_body_from_those_of_the_wake(model):
    """Slow modes are the body's alone; those that die as fast as the wake are shared with it."""
    (found,), = along(model, [6])
    share = dict(zip((mode.name for mode in found.modes), found.shares))
    assert all(share[name] > 0.98 for name in ('phugoid', 'Dutch roll', 'spiral'))
    assert share['roll'] < 0.7
    assert all(flight.OWN <= each <= 1.0 for each in found.shares)


def test_a_fold_is_reported_and_nothing_is_where_there_is_none():
    """Averaged over 0.3 chords the sharp stall has several solutions, over one chord one."""
    for ell, folds in ((0.3, True), (1.0, False)):
        model = build(few_strips(curves.airfoil('sharp')), Settings(
            chordwise=2, ell=ell, wake_length=2.0))
        points = [found for found, in along(model, range(12, 21))]
        assert any(found.departed for found in points) == folds
        for found in points:
            assert ('fold' in found.message) == found.departed


def test_a_trim_that_is_not_there_has_a_message_instead_of_modes(model):
    points = [found for found, in along(model, [20, 40, 20])]
    assert [found.status for found in points] == [
        Status.CONVERGED, Status.NOT_CONVERGED, Status.CONVERGED]
    assert points[1].modes == () and 'elevator at its limit' in points[1].message
    assert [mode.name for mode in points[2].modes][:5] == CLASSICAL   # the names go on


@pytest.mark.parametrize(('degrees', 'climb'), [
    (4.0, 0.0), (4.0, 0.1), (16.0, 0.0), (20.0, -0.05)])
def test_powered_flight_at_an_angle_of_attack_is_in_balance(model, degrees, climb):
    """Forces and moments added up here from the loads that the trim reports."""
    trim = trims.powered(model, alpha=math.radians(degrees), altitude=ALTITUDE, climb_angle=climb)
    assert trim.status is Status.CONVERGED and trim.climb_angle == climb
    assert trim.alpha == math.radians(degrees) and 0.0 < trim.controls.throttle < 1.0
    engines = wings.push(model.aircraft, trim.velocity_B, trim.controls.throttle)
    push, turn = engines.force_B, engines.moment_B
    weight = model.aircraft.mass.mass * GRAVITY
    x, y, z = trim.aero.force_G
    down_B = rotation(quaternion_from_euler(0.0, trim.alpha + climb, 0.0))[2]
    assert np.array([-x, y, -z]) + push + weight * down_B == pytest.approx(
        np.zeros(3), abs=2e-6 * weight)
    roll, pitch, yaw = trim.aero.moment_G
    assert np.array([-roll, pitch, -yaw]) + turn == pytest.approx(
        np.zeros(3), abs=2e-6 * weight * 0.4)


def test_powered_flight_needs_an_engine():
    wing_tail = build(curves.with_strips(wings.wing_tail(), wing=8, tail=4), Settings(chordwise=1))
    with pytest.raises(ConfigError, match='no engine'):
        trims.powered(wing_tail, alpha=0.1, altitude=ALTITUDE)
