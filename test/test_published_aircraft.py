# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""
The Navion against its published derivatives and modes: docs/published_aircraft.md in numbers.

TEPER : G. L. Teper, NASA CR-96008, 1969, at 176 ft/s at sea level, as reprinted by R. C. Nelson,
Flight Stability and Automatic Control, 2nd ed., 1998, appendix B. FLOWN : E. Seckel, J. J. Morris,
FAA-RD-71-6, 1971, cruise at 135 kt and 10000 ft. Both have fuselage and propeller, which a
lattice of lifting surfaces has not: bounds are therefore wide, and one-sided where it is known
what a fuselage does.
"""

import math
import re
from pathlib import Path

import numpy as np
import pytest

from poststall_sim import definition, polar, trim
from poststall_sim.aero import model as models
from poststall_sim.atmosphere import standard_air
from poststall_sim.polar import Condition
from poststall_sim.stability import bodies, derivatives

PAGE = Path(__file__).resolve().parents[1] / 'docs' / 'published_aircraft.md'
AIRSPEED, SEA_LEVEL = 176 * 0.3048, 0.1
TEPER = {'CL_alpha': 4.44, 'Cm_alpha': -0.683, 'Cm_q': -9.96, 'CL_elevator': 0.355,
         'Cm_elevator': -0.923, 'CY_beta': -0.564, 'Cl_beta': -0.074, 'Cn_beta': 0.071,
         'Cl_p': -0.410, 'Cn_p': -0.0575, 'Cl_r': 0.107, 'Cn_r': -0.125, 'Cl_aileron': 0.134,
         'CY_rudder': 0.157, 'Cn_rudder': -0.072}
FLOWN = {'CL_alpha': 6.04, 'Cm_alpha': -0.715, 'Cm_q': -13.39, 'CL_elevator': 0.355,
         'Cm_elevator': -1.42, 'CY_beta': -0.61, 'Cl_beta': -0.067, 'Cn_beta': 0.086,
         'Cl_p': -0.46, 'Cn_p': -0.038, 'Cl_r': 0.069, 'Cn_r': -0.088, 'Cl_aileron': 0.152,
         'CY_rudder': 0.157, 'Cn_rudder': -0.075}
MODES = {'short period': -2.49 + 2.60j, 'phugoid': -0.017 + 0.2135j, 'roll': -8.43,
         'Dutch roll': -0.486 + 2.334j, 'spiral': -0.0089}
"""Of Teper's derivatives, R. C. Nelson, chapters 4 and 5 [1/s]."""


@pytest.fixture(scope='module')
def model():
    return models.build(definition.aircraft(definition.find('aircraft', 'navion')))


@pytest.fixture(scope='module')
def flown(model):
    found = trim.straight(model, airspeed=AIRSPEED, altitude=SEA_LEVEL)
    assert found.message == 'trimmed'
    return found


@pytest.fixture(scope='module')
def ours(model, flown):
    return derivatives.quasi_steady(
        model, flown, density=standard_air(SEA_LEVEL).density)


def test_it_has_the_published_size_weight_and_inertia(model):
    reference, mass = model.aircraft.reference, model.aircraft.mass
    foot, slug = 0.3048, 14.5939
    # Entered with four digits.
    assert reference.area == pytest.approx(184 * foot ** 2, rel=1e-3)
    assert reference.span == pytest.approx(33.4 * foot, rel=1e-3)
    assert reference.chord == pytest.approx(5.7 * foot, rel=1e-3)
    assert mass.mass == pytest.approx(2750 * 0.45359, rel=1e-3)
    assert np.diag(mass.inertia_B) == pytest.approx(
        np.array([1048, 3000, 3530]) * slug * foot ** 2, rel=1e-3)
    lattice = model.lattice
    wing = lattice.grids[[grid.name for grid in lattice.grids].index('wing')].strips
    area = float(np.sum(lattice.strip_chord[wing] * lattice.strip_width[wing]))
    # Along its dihedral of 7.5 deg the wing is 0.9 % longer than its span; the rest are the
    # printed digits of its chords.
    assert area * math.cos(math.radians(7.5)) == pytest.approx(reference.area, rel=0.01)


def test_it_flies_at_the_published_lift_coefficient(model, flown):
    """CL = 0.41 is weight over dynamic pressure; there the body axes stand along the wind."""
    pressure = 0.5 * standard_air(SEA_LEVEL).density * flown.airspeed ** 2
    lift = polar.coefficients(model, flown.aero, flown.alpha, pressure).CL
    assert lift == pytest.approx(0.41, abs=0.01)
    assert abs(math.degrees(flown.alpha)) < 1.0


@pytest.mark.parametrize('name', [
    'CL_alpha', 'Cm_q', 'Cm_elevator', 'Cl_p', 'Cl_r', 'Cn_r', 'Cl_aileron', 'CY_rudder',
    'Cn_rudder'])
def test_what_wings_and_tails_make_lies_within_a_quarter_of_what_was_published(ours, name):
    """The two publications differ by as much from each other, and by up to a half."""
    low, high = sorted((TEPER[name], FLOWN[name]))
    slack = 0.25 * max(abs(low), abs(high))
    assert low - slack < ours.coefficients[name] < high + slack


def test_the_fuselage_is_missed_where_one_would_expect(ours):
    """It pushes the nose on, up and sideways, takes side force, and blankets the low wing."""
    k = ours.coefficients
    for published in (TEPER, FLOWN):
        assert -0.30 < k['Cm_alpha'] - published['Cm_alpha'] < -0.15
        assert 0.0 < k['Cn_beta'] - published['Cn_beta'] < 0.04
        assert 0.4 < k['CY_beta'] / published['CY_beta'] < 0.6
        assert -0.10 < k['Cl_beta'] - published['Cl_beta'] < -0.05


def test_the_neutral_point_is_a_few_hundredths_of_a_chord_behind_the_published_one(ours):
    """Teper's derivatives put it 15.4 % behind the centre of gravity; a fuselage, ahead."""
    margin = -ours.coefficients['Cm_alpha'] / ours.coefficients['CL_alpha']
    assert 0.01 < margin - 0.683 / 4.44 < 0.05


def test_its_modes_have_the_published_frequencies(model, flown, ours):
    """Quasi-steady; our Cm_alpha and Cl_beta are larger, so the oscillations are quicker."""
    body = bodies.free_body(
        model.aircraft, velocity_B=flown.velocity_B, pitch=flown.alpha,
        throttle=flown.controls.throttle)
    matrix = derivatives.state_matrix(body, ours.motion)
    phugoid, short = oscillations(derivatives.longitudinal(matrix))
    dutch, = oscillations(derivatives.lateral(matrix))
    spiral, roll = sorted(
        (each.real for each in np.linalg.eigvals(derivatives.lateral(matrix))
         if abs(each.imag) < 1e-9), key=abs)
    assert abs(short) == pytest.approx(1.17 * abs(MODES['short period']), rel=0.1)
    assert abs(phugoid) == pytest.approx(abs(MODES['phugoid']), rel=0.05)
    assert abs(dutch) == pytest.approx(1.16 * abs(MODES['Dutch roll']), rel=0.1)
    assert roll == pytest.approx(1.15 * MODES['roll'], rel=0.1)
    assert -0.05 < spiral < 0.0   # slow and stable, as published


def oscillations(matrix):
    """Return the oscillations of a matrix [1/s], the slowest first."""
    return sorted((each for each in np.linalg.eigvals(matrix) if each.imag > 1e-9), key=abs)


def test_it_stalls_as_a_wing_of_its_section_does(model):
    """Greatest lift with the controls neutral, flaps up: below the section's, by 20 deg or so."""
    delta, lift = None, []
    angles = np.arange(8.0, 31.0, 2.0)
    for alpha in np.radians(angles):
        found = polar.point(model, Condition(alpha), airspeed=AIRSPEED, density=1.225,
                            delta0=delta)
        delta = found.aero.strips.delta
        lift.append(found.coefficients.CL)
    assert 18.0 <= angles[np.argmax(lift)] <= 26.0
    # The section's 1.65 on 1.006 of the reference area, and a lift of the tail of 0.2.
    assert 1.6 < max(lift) < 1.9


def test_the_page_prints_these_publications(ours):
    """Every row of the page's table has the published numbers, and ours to two digits."""
    rows = {match[1]: match for match in re.finditer(
        r'^\| `(\w+)` \| (-?[\d.]+) \| (-?[\d.]+) \| (-?[\d.]+) \|',
        PAGE.read_text(encoding='utf-8'), re.MULTILINE)}
    assert sorted(rows) == sorted(TEPER)
    for name, row in rows.items():
        assert float(row[2]) == pytest.approx(ours.coefficients[name], rel=0.02, abs=6e-4)
        assert (float(row[3]), float(row[4])) == (TEPER[name], FLOWN[name])
