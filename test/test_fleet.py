# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""All aircraft that are shipped: they load, trim, stay in trim, are stable, and stall."""

import dataclasses
import math
import re
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from poststall_sim import definition, jobs, polar, simulation, trim
from poststall_sim.aero import model as models
from poststall_sim.aircraft import ConfigError
from poststall_sim.atmosphere import standard_air
from poststall_sim.polar import Condition
from poststall_sim.state import Status

FOLDER = Path(__file__).resolve().parents[1] / 'config' / 'aircraft'
AIRSPEED = {'trainer': 15.0, 'wing_tail': 33.0, 'free_roll_wing': 30.0, 'flying_wing': 14.0,
            'glider': 28.0, 'canard': 15.0, 't_tail': 15.0, 'navion': 53.64}
"""That each was designed for [m/s]."""
ALTITUDE = 150.0
NAMES = sorted(path.stem for path in FOLDER.glob('*.yaml'))


@cache
def built(name):
    return models.build(definition.aircraft(definition.find('aircraft', name)))


@cache
def trimmed(name):
    return trim.straight(built(name), airspeed=AIRSPEED[name], altitude=ALTITUDE)


def loads(name, alpha, deflections):
    return polar.point(built(name), Condition(alpha, deflections=deflections),
                       airspeed=AIRSPEED[name], density=standard_air(ALTITUDE).density)


def static_margin(name):
    """Return -dCm/dCL about the trim, with the controls as they stand there."""
    found = trimmed(name)
    low, high = (loads(name, found.alpha + step, found.controls.deflections).coefficients
                 for step in (-0.01, 0.01))
    return (low.Cm - high.Cm) / (high.CL - low.CL)


def test_every_shipped_aircraft_is_tested():
    assert sorted(AIRSPEED) == NAMES


@pytest.mark.parametrize('name', NAMES)
def test_trims_inside_the_limits_of_its_controls_with_all_flow_attached(name):
    found = trimmed(name)
    assert found.status is Status.CONVERGED and found.message == 'trimmed'
    assert not found.aero.strips.stalled.any()
    for control, value in zip(built(name).aircraft.controls, found.controls.deflections):
        low, high = control.limits
        assert 0.9 * low < value < 0.9 * high or value == 0.0
    assert (found.climb_angle == 0.0) == bool(built(name).aircraft.engines)
    assert found.controls.throttle < 0.8
    assert found.climb_angle > math.radians(-5.0)


@pytest.mark.parametrize('name', NAMES)
def test_static_margin_is_positive_and_what_the_definition_says(name):
    """The definitions print it to a tenth of a per cent or to one."""
    text = (FOLDER / f'{name}.yaml').read_text(encoding='utf-8')
    stated = re.search(r'static margin(?: of)?\s(?:#\s+)?([\d.]+) %', text)
    margin = 100.0 * static_margin(name)
    assert margin > 3.0
    assert margin == pytest.approx(float(stated[1]), abs=0.6)


@pytest.mark.parametrize('name', NAMES)
@pytest.mark.parametrize('seconds', [2.0, pytest.param(10.0, marks=pytest.mark.soak)])
def test_stays_in_trim(name, seconds):
    """Trim and flight ask for the same balance: what is left over is 1e-6 of the weight."""
    flight = simulation.start(
        built(name).aircraft, airspeed=AIRSPEED[name], altitude=ALTITUDE)
    first = flight.snapshot
    for _ in range(round(seconds * 1e9 / flight.dt_ns)):
        last = flight.step(flight.trim)
    assert last.status is Status.CONVERGED
    assert last.airspeed == pytest.approx(first.airspeed, rel=2e-3)
    assert math.degrees(last.alpha - first.alpha) == pytest.approx(0.0, abs=0.1)
    assert math.degrees(last.beta) == pytest.approx(0.0, abs=0.01)
    assert np.degrees(last.body.rates_B) == pytest.approx(np.zeros(3), abs=0.1)


@pytest.mark.parametrize('name', NAMES)
def test_the_wing_stalls_and_lift_has_a_greatest_value(name):
    """From 4 to 32 deg with the controls as in trim: more than half of the wing is stalled."""
    deflections, delta, found = trimmed(name).controls.deflections, None, []
    for alpha in np.radians(np.arange(4.0, 33.0, 4.0)):
        found.append(polar.point(
            built(name), Condition(alpha, deflections=deflections), airspeed=AIRSPEED[name],
            density=standard_air(ALTITUDE).density, delta0=delta))
        delta = found[-1].aero.strips.delta
    lift = [each.coefficients.CL for each in found]
    wing = built(name).lattice.grids[
        [grid.name for grid in built(name).lattice.grids].index('wing')].strips
    assert all(each.aero.status is Status.CONVERGED for each in found)
    assert 0 < np.argmax(lift) < len(lift) - 1
    assert found[-1].aero.strips.stalled[wing].mean() > 0.5
    assert not found[0].aero.strips.stalled.any()


def test_the_foreplane_of_the_canard_stalls_before_its_wing():
    """At neutral controls and 16 deg most of the foreplane is stalled and nothing of the wing."""
    stalled = loads('canard', math.radians(16.0), np.zeros(3)).aero.strips.stalled
    share = {grid.name: stalled[grid.strips].mean() for grid in built('canard').lattice.grids}
    assert share['foreplane'] > 0.5 and share['wing'] == 0.0


def test_a_negative_elevator_lifts_the_nose_of_every_aircraft():
    """The canard's too, whose foreplane has to turn the other way for it."""
    for name in NAMES:
        model, found = built(name), trimmed(name)
        moved = np.array([control.name == trim.PITCH_CONTROL
                          for control in model.aircraft.controls])
        up = loads(name, found.alpha, found.controls.deflections - 0.01 * moved)
        assert up.coefficients.Cm > loads(
            name, found.alpha, found.controls.deflections).coefficients.Cm + 1e-3


def test_elevons_are_two_controls_of_the_same_flaps():
    """Elevator and aileron together turn one flap by their sum and the other by the difference."""
    model, alpha = built('flying_wing'), math.radians(5.0)
    names = model.aircraft.control_names
    both, one = np.zeros(len(names)), np.zeros(len(names))
    both[names.index('elevator')] = both[names.index('aileron')] = math.radians(2.0)
    left_only = dataclasses.replace(
        model.aircraft.controls[names.index('aileron')], name='flap', effectors=tuple(
            each for each in model.aircraft.controls[names.index('aileron')].effectors
            if each.side == -1))
    other = models.build(dataclasses.replace(
        model.aircraft, controls=(left_only, *model.aircraft.controls[1:])))
    one[0] = math.radians(4.0)
    assert np.allclose(
        polar.point(model, Condition(alpha, deflections=both), airspeed=14.0,
                    density=1.2).aero.strips.cl,
        polar.point(other, Condition(alpha, deflections=one), airspeed=14.0,
                    density=1.2).aero.strips.cl, atol=1e-6)


def test_an_aircraft_without_rudder_refuses_a_scenario_that_moves_it():
    spin = definition.scenario(definition.find('scenarios', 'spin'))
    with pytest.raises(ConfigError, match='scenario spin moves throttle, rudder: free_roll_wing'):
        jobs.require_controls(built('free_roll_wing'), spin)
