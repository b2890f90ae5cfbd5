# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""
The Navion against its published derivatives and modes: docs/published_aircraft.md in numbers.

TEPER : G. L. Teper, NASA CR-96008, 1969, at 176 ft/s at sea level, as reprinted by R. C. Nelson,
Flight Stability and Automatic Control, 2nd ed., 1998, appendix B. FLOWN : E. Seckel, J. J. Morris,
FAA-RD-71-6, 1971, cruise at 135 kt and 10000 ft. They differ by up to a half from each other; so
the bounds are wide, and where the fuselage matters they are two: without it, and with all of the
moment that it would have in an ideal flow.
"""

import dataclasses
import math
import re
from pathlib import Path

import numpy as np
import pytest

from poststall_sim import definition, envelope, polar, simulation, trim
from poststall_sim.aero import model as models
from poststall_sim.atmosphere import standard_air
from poststall_sim.polar import Condition
from poststall_sim.stability import bodies, derivatives
from poststall_sim.state import BodyState

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
def bare_model(model):
    return models.build(dataclasses.replace(model.aircraft, bodies=()))


def flown_by(model):
    found = trim.straight(model, airspeed=AIRSPEED, altitude=SEA_LEVEL)
    assert found.message == 'trimmed'
    return found


def derived(model):
    return derivatives.quasi_steady(
        model, flown_by(model), density=standard_air(SEA_LEVEL).density)


@pytest.fixture(scope='module')
def flown(model):
    return flown_by(model)


@pytest.fixture(scope='module')
def ours(model):
    return derived(model)


@pytest.fixture(scope='module')
def bare(bare_model):
    return derived(bare_model)


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


def test_it_flies_at_the_published_lift_and_drag(model, flown):
    """CL = 0.41 is weight over dynamic pressure; there the body axes stand along the wind."""
    pressure = 0.5 * standard_air(SEA_LEVEL).density * flown.airspeed ** 2
    found = polar.coefficients(model, flown.aero, flown.alpha, pressure)
    assert found.CL == pytest.approx(0.41, abs=0.01)
    assert found.CD == pytest.approx(0.05, abs=0.002)   # which the fuselage was given for
    assert abs(math.degrees(flown.alpha)) < 1.0


@pytest.mark.parametrize('name', [
    'CL_alpha', 'Cm_q', 'Cm_elevator', 'Cl_p', 'Cl_r', 'Cn_r', 'Cl_aileron', 'CY_rudder',
    'Cn_rudder'])
def test_what_wings_and_tails_make_lies_within_a_quarter_of_what_was_published(ours, name):
    """The two publications differ by as much from each other, and by up to a half."""
    low, high = sorted((TEPER[name], FLOWN[name]))
    slack = 0.25 * max(abs(low), abs(high))
    assert low - slack < ours.coefficients[name] < high + slack


def test_published_stability_lies_between_no_fuselage_and_one_in_ideal_flow(ours, bare):
    """Munk's moment is too large for a body behind which the flow separates."""
    for published in (TEPER, FLOWN):
        for name in ('Cm_alpha', 'Cn_beta'):
            low, high = sorted((ours.coefficients[name], bare.coefficients[name]))
            assert low < published[name] < high
    margins = [-each.coefficients['Cm_alpha'] / each.coefficients['CL_alpha']
               for each in (ours, bare)]
    assert margins[0] < 0.683 / 4.44 < margins[1]


def test_what_a_fuselage_does_to_its_wing_is_missed(ours):
    """Half of the side force, and what a low wing loses of its dihedral."""
    for published in (TEPER, FLOWN):
        assert 0.4 < ours.coefficients['CY_beta'] / published['CY_beta'] < 0.6
        assert -0.10 < ours.coefficients['Cl_beta'] - published['Cl_beta'] < -0.05


def poles(model):
    """Return the quasi-steady modes by name [1/s]."""
    found, result = flown_by(model), derived(model)
    matrix = derivatives.state_matrix(bodies.free_body(
        model.aircraft, velocity_B=found.velocity_B, pitch=found.alpha,
        throttle=found.controls.throttle, density=standard_air(SEA_LEVEL).density),
        result.motion)
    phugoid, short = oscillations(derivatives.longitudinal(matrix))
    dutch, = oscillations(derivatives.lateral(matrix))
    spiral, roll = sorted(
        (each.real for each in np.linalg.eigvals(derivatives.lateral(matrix))
         if abs(each.imag) < 1e-9), key=abs)
    return {'short period': short, 'phugoid': phugoid, 'Dutch roll': dutch, 'spiral': spiral,
            'roll': roll}


def test_its_modes_are_about_as_quick_as_published(model, bare_model):
    """Bounds as the derivatives that make them: see the page."""
    found, without = poles(model), poles(bare_model)
    size = {name: abs(value) for name, value in MODES.items()}
    assert abs(found['short period']) == pytest.approx(size['short period'], rel=0.05)
    assert abs(found['phugoid']) == pytest.approx(size['phugoid'], rel=0.15)
    assert found['roll'] == pytest.approx(1.15 * MODES['roll'], rel=0.05)
    assert 0.8 * size['Dutch roll'] < abs(found['Dutch roll']) < size['Dutch roll']
    assert size['Dutch roll'] < abs(without['Dutch roll']) < 1.2 * size['Dutch roll']
    assert -0.1 < found['spiral'] < 0.0   # slow and stable, as published


def oscillations(matrix):
    """Return the oscillations of a matrix [1/s], the slowest first."""
    return sorted((each for each in np.linalg.eigvals(matrix) if each.imag > 1e-9), key=abs)


def test_it_stalls_as_a_wing_of_its_section_does(model):
    """
    Greatest lift with the controls neutral, flaps up, is the page's, at the page's angle.

    A wing next to unswept, of little twist, stalls along most of its span at once: together its
    strips carry the section's clmax, to the few per cent that averaging over strips lets through.
    """
    lattice, delta, lift, carried = model.lattice, None, [], []
    wing = lattice.grids[[grid.name for grid in lattice.grids].index('wing')].strips
    area = (lattice.strip_chord * lattice.strip_width)[wing]
    angles = np.arange(8.0, 31.0, 2.0)
    for alpha in np.radians(angles):
        found = polar.point(model, Condition(alpha), airspeed=AIRSPEED, density=1.225,
                            delta0=delta)
        delta = found.aero.strips.delta
        lift.append(found.coefficients.CL)
        carried.append(float(found.aero.strips.cl[wing] @ area) / area.sum())
    told, at = map(float, re.search(
        r'Ours is ([\d.]+) with neutral controls at alpha (\d+) deg',
        PAGE.read_text(encoding='utf-8')).groups())
    assert angles[np.argmax(lift)] == at
    assert max(lift) == pytest.approx(told, abs=0.01)
    section = max(each.cl.max() for each in model.aircraft.airfoils if each.name == 'wing')
    assert max(carried) == pytest.approx(section, rel=0.05)


def test_level_flight_is_within_the_envelope_of_its_tables(model):
    """From just above the stall to the published airspeed no strip leaves its Reynolds numbers."""
    for airspeed in (28.0, AIRSPEED):
        at = trim.straight(model, airspeed=airspeed, altitude=SEA_LEVEL)
        body = BodyState(np.array([0.0, 0.0, -SEA_LEVEL]), at.velocity_B, np.zeros(3), at.q_NB)
        flight = simulation.Flight(model, body, at.controls, dt_ns=8_000_000)
        assert envelope.exceeded(flight.snapshot, model) == ()


def test_the_page_prints_these_publications(ours, bare):
    """Every row of the page's table has the published numbers, and ours to two per cent."""
    rows = {match[1]: match for match in re.finditer(
        r'^\| `(\w+)`' + 4 * r' \| (-?[\d.]+)' + r' \|',
        PAGE.read_text(encoding='utf-8'), re.MULTILINE)}
    assert sorted(rows) == sorted(TEPER)
    for name, row in rows.items():
        for value, result in ((row[2], ours), (row[3], bare)):
            assert float(value) == pytest.approx(result.coefficients[name], rel=0.02, abs=1e-3)
        assert (float(row[4]), float(row[5])) == (TEPER[name], FLOWN[name])
