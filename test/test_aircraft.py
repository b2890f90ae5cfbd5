# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""The records of an aircraft: what they refuse, and in which words."""

import dataclasses
import math

import numpy as np
import pytest

from poststall_sim import definition
from poststall_sim.aircraft import (
    Airfoil,
    ConfigError,
    MassProperties,
    Reference,
    Section,
    Surface,
    read_only,
)
from poststall_sim.controls import Control, Effector
from poststall_sim.engines import LinearThrust

ROOT = Section((0.0, 0.0, 0.0), 0.4, 'wing')
TIP = Section((0.0, 1.5, 0.0), 0.3, 'wing')
CG = (0.1, 0.0, 0.0)


@pytest.fixture(scope='module')
def trainer():
    return definition.aircraft(definition.find('aircraft', 'trainer'))


def curve(n=37, **changes):
    alpha = np.linspace(-math.pi, math.pi, n)
    table = {'alpha': alpha, 'cl': np.sin(2.0 * alpha), 'cd': 0.01 + np.sin(alpha) ** 2,
             'cm': np.zeros(n)}
    table['cl'][-1] = table['cl'][0]
    for key, change in changes.items():
        table[key] = change(table[key])
    return Airfoil('a', **table)


def put(row, value):
    def change(values):
        values = values.copy()
        values[row] = value
        return values
    return change


@pytest.mark.parametrize('make, message', [
    (lambda: curve(7), 'airfoil a: .* at least 8 rows, got 7'),
    (lambda: curve(cl=lambda v: v[:-1]), 'airfoil a: alpha, cl, cd and cm need one length'),
    (lambda: curve(cd=put(4, np.nan)), 'cd is not a finite number in data row 5'),
    (lambda: curve(alpha=put(3, -3.0)), 'alpha must increase .* row 4 has -171.887 deg'),
    (lambda: curve(alpha=lambda v: 0.5 * v), 'from -180 to 180 deg, got -90 to 90'),
    (lambda: curve(alpha=np.degrees), 'from -180 to 180 deg, got -10313'),
    (lambda: curve(cm=put(-1, 0.1)), 'cm must be the same at -180 and 180 deg, got 0 and 0.1'),
    (lambda: curve(cd=put(10, -0.01)), 'cd must not be negative, got -0.01'),
])
def test_airfoils_that_are_no_curve(make, message):
    with pytest.raises(ConfigError, match=message):
        make()


@pytest.mark.parametrize('make, message', [
    (lambda: Section((0, 0, 0), 0.0, 'wing'), 'chord must be above 0 m, got 0.0'),
    (lambda: Section((0, math.inf, 0), 0.4, 'wing'), 'leading edge must be three finite lengths'),
    (lambda: Section((0, 2e4, 0), 0.4, 'wing'), r'leading edge must be .* within \+-5000 m'),
    (lambda: Section((0, 0, 0), 1e-50, 'wing'), 'chord must be 1e-06 to 5000 m, got 1e-50'),
    (lambda: Section((0, 0, 0), 0.4, 'wing', twist=3.0),
     r'twist is in radians .* \(did you mean 0\.0524, from degrees\?\)'),
    (lambda: Surface('wing', (ROOT,), 4), 'surface wing: needs at least 2 sections, got 1'),
    (lambda: Surface('wing', (ROOT, TIP), 0), 'strips must be a positive number'),
    (lambda: Surface('wing', (ROOT, TIP), 5, symmetric=True), 'even on a symmetric surface'),
    (lambda: Surface('wing', (ROOT, ROOT), 4), 'two neighbouring sections stand at the same'),
    (lambda: Surface('wing', (ROOT, TIP, Section((0, 2, 0), 0.3, 'wing')), 2, symmetric=True),
     '2 strips are fewer than its 4 trapezoids'),
    (lambda: Surface('wing', (TIP, Section((0, 2, 0), 0.3, 'wing')), 4, symmetric=True),
     'starts at y = 0, got y = 1.5 m'),
    (lambda: Effector('wing', span=(0.5, 0.2)), '0 <= from < to <= 1'),
    (lambda: Effector('wing', hinge=1.0), 'hinge must lie in 0 <= hinge < 1'),
    (lambda: Effector('wing', hinge_axis=(0.0, 0.0, 0.0)),
     'hinge_axis must be three finite numbers that are not all 0, got 0, 0, 0'),
    (lambda: Effector('wing', hinge_axis=(0.0, math.nan, 1.0)), 'not all 0, got 0, nan, 1'),
    (lambda: Effector('wing', gain=0.0), 'gain must be a finite number other than 0'),
    (lambda: Control('flap', (0.1, 0.5), (Effector('wing'),)),
     'low <= 0 <= high .* got 5.72958 to 28.6479 deg'),
    (lambda: Control('flap', (-20.0, 20.0), (Effector('wing'),)), r'within \+-90 deg'),
    (lambda: Control('flap', (-0.3, 0.3), ()), 'control flap: moves nothing'),
    (lambda: LinearThrust(-1.0, 20.0, CG), 'static_thrust must be above 0 N'),
    (lambda: LinearThrust(10.0, 0.0, CG), 'zero_thrust_airspeed must be above 0 m/s'),
    (lambda: LinearThrust(10.0, 20.0, (0, 0, math.nan)), 'position must be three finite lengths'),
    (lambda: LinearThrust(10.0, 20.0, CG, (1.0, 1.0, 0.0)), 'direction must be a unit vector'),
    (lambda: Reference(0.0, 1.0, 1.0), r'reference area must be above 0 m\^2'),
    (lambda: Reference(1.0, math.nan, 1.0), 'reference chord must be above 0 m, got nan'),
])
def test_parts_that_cannot_be_built(make, message):
    with pytest.raises(ConfigError, match=message):
        make()


@pytest.mark.parametrize('mass, inertia, message', [
    (0.0, np.eye(3), 'mass must be above 0 kg, got 0.0'),
    (1.0, np.eye(2), 'inertia must be a symmetric 3 x 3 tensor'),
    (1.0, np.diag([1.0, math.nan, 1.0]), 'inertia must be a symmetric 3 x 3 tensor'),
    (1.0, np.eye(3) + np.eye(3, k=1), 'inertia must be a symmetric 3 x 3 tensor'),
    (1.0, np.diag([1.0, -1.0, 1.0]), 'inertia must be positive in every direction'),
    (1.0, np.diag([1.0, 1.0, 2.1]), 'breaks the triangle inequality'),
    # The moments themselves pass, the principal ones do not.
    (1.0, np.array([[1.0, 0.0, 0.9], [0.0, 1.0, 0.0], [0.9, 0.0, 1.5]]), 'triangle inequality'),
])
def test_bodies_that_cannot_exist(mass, inertia, message):
    with pytest.raises(ConfigError, match=message):
        MassProperties(mass, CG, inertia)


def test_a_flat_body_is_the_limit_of_what_can_exist():
    assert MassProperties(1.0, CG, np.diag([1.0, 1.0, 2.0])).inertia_B[2, 2] == 2.0


@pytest.mark.parametrize('change, message', [
    (lambda a: {'surfaces': ()}, 'needs at least one surface'),
    (lambda a: {'surfaces': a.surfaces * 2}, 'two surfaces are named wing'),
    (lambda a: {'airfoils': a.airfoils * 2}, 'two airfoils are named wing'),
    (lambda a: {'controls': a.controls * 2}, 'two controls are named aileron'),
    (lambda a: {'controls': (dataclasses.replace(a.controls[0], name='throttle'),)},
     'must not be named throttle'),
    (lambda a: {'airfoils': a.airfoils[:1]}, r"no airfoil named tail, there are \['wing'\]"),
    (lambda a: {'surfaces': a.surfaces[:1]}, 'control elevator: no surface named tail'),
    (lambda a: {'controls': (Control('rudder', (-0.3, 0.3), (Effector('fin', side=1),)),)},
     'surface fin is not symmetric, so it has no left or right side'),
])
def test_names_that_point_nowhere_or_twice(trainer, change, message):
    with pytest.raises(ConfigError, match=message):
        dataclasses.replace(trainer, **change(trainer))


def test_a_record_cannot_change_behind_its_user():
    values = np.arange(3.0)
    kept = read_only(values)
    values[0] = 9.0
    assert kept[0] == 0.0
    with pytest.raises(ValueError, match='read-only'):
        kept[0] = 1.0


@pytest.mark.parametrize('places, symmetric, message', [
    ([(0, 0, 0), (0, -2, 0)], True, 'from the root to the starboard tip, y rising'),
    ([(0, 2, 0), (0, -2, 0)], False, 'from left to right, y rising'),
])
def test_a_surface_drawn_the_wrong_way_round_is_refused(places, symmetric, message):
    """Its normals would point down and its camber would be inverted."""
    with pytest.raises(ConfigError, match=message):
        Surface('wing', tuple(Section(place, 1.0, 'a') for place in places), 4,
                symmetric=symmetric)


def test_a_fin_may_lean_to_either_side():
    for lean in (-0.3, 0.3):
        Surface('fin', (Section((0, 0, 0), 1.0, 'a'), Section((0, lean, 1.0), 1.0, 'a')), 4)
