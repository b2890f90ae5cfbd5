# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""Straight flight: forces and moments balance, the trends are those of any stable aircraft."""

import dataclasses
import math
import re

import numpy as np
import pytest
import wings

from poststall_sim import definition, manoeuvre, trim
from poststall_sim.aero import model as models
from poststall_sim.aero import solver
from poststall_sim.aero.model import Settings
from poststall_sim.aircraft import ConfigError
from poststall_sim.atmosphere import standard_air
from poststall_sim.frames import (
    GRAVITY,
    body_to_geometry,
    body_to_stability,
    geometry_to_body,
    rotation,
)
from poststall_sim.state import Status

ALTITUDE = 300.0
SPEEDS = (11.0, 12.0, 13.5, 15.0, 17.0, 19.0, 22.0)
ANGLES_DEG = tuple(range(2, 25, 2))


@pytest.fixture(scope='module')
def model():
    return models.build(definition.aircraft(definition.find('aircraft', 'trainer')))


@pytest.fixture(scope='module')
def level(model):
    return [trim.straight(model, airspeed=speed, altitude=ALTITUDE) for speed in SPEEDS]


@pytest.fixture(scope='module')
def glides(model):
    """Glides from 2 to 24 deg, each started from the decambering of the one before."""
    found, delta0 = [], None
    for alpha in ANGLES_DEG:
        found.append(trim.glide(
            model, alpha=math.radians(alpha), altitude=ALTITUDE, delta0=delta0))
        delta0 = found[-1].aero.strips.delta
    return found


def elevator(model, found):
    return found.controls.deflections[model.aircraft.control_names.index('elevator')]


def imbalance(model, found):
    """Return force over weight and moment over weight times chord, put together afresh."""
    aircraft = model.aircraft
    weight = aircraft.mass.mass * GRAVITY
    onset = models.Onset(body_to_geometry(-found.velocity_B), np.zeros(3))
    aero = solver.steady(model, onset, found.controls.deflections,
                         density=standard_air(ALTITUDE).density, delta0=found.aero.strips.delta)
    engines = wings.push(aircraft, found.velocity_B, found.controls.throttle)
    push, turn = engines.force_B, engines.moment_B
    force = geometry_to_body(aero.force_G) + push \
        + rotation(found.q_NB).T @ np.array([0.0, 0.0, weight])
    moment = geometry_to_body(aero.moment_G) + turn
    return np.concatenate([force / weight, moment / (weight * aircraft.reference.chord)])


def test_level_trims_balance_all_forces_and_moments(model, level):
    for found in level:
        assert found.status is Status.CONVERGED and found.message == 'trimmed'
        assert np.abs(found.residual).max() <= 1e-6   # method.md section 7
        assert np.abs(imbalance(model, found)).max() <= 1e-6   # side force, roll, yaw too
        assert found.climb_angle == 0.0


def test_glides_balance_all_forces_and_moments(model, glides):
    for found in glides:
        assert found.status is Status.CONVERGED and found.message == 'trimmed'
        assert found.controls.throttle == 0.0
        assert np.abs(found.residual).max() <= 1e-6
        assert np.abs(imbalance(model, found)).max() <= 1e-6


def test_glide_angle_is_drag_over_lift_and_the_speed_carries_the_weight(model, glides):
    aircraft = model.aircraft
    density = standard_air(ALTITUDE).density
    for found in glides:
        x, _, z = body_to_stability(geometry_to_body(found.aero.force_G), found.alpha)
        pressure = 0.5 * density * found.airspeed**2 * aircraft.reference.area
        drag, lift = -x / pressure, -z / pressure
        assert found.climb_angle == pytest.approx(-math.atan(drag / lift), abs=1e-12)
        speed = math.sqrt(2.0 * aircraft.mass.mass * GRAVITY
                          / (density * aircraft.reference.area * math.hypot(lift, drag)))
        assert found.airspeed == pytest.approx(speed, rel=1e-6)


def test_flying_faster_takes_less_alpha_and_less_up_elevator(model, level):
    alpha = [found.alpha for found in level]
    deflection = [elevator(model, found) for found in level]
    assert np.all(np.diff(alpha) < 0.0)
    assert np.all(np.diff(deflection) > 0.0)   # a stable aircraft: trailing edge down


def test_gliding_at_more_alpha_takes_more_up_elevator(model, glides):
    deflection = np.array([elevator(model, found) for found in glides])
    assert np.all(np.diff(deflection) < 0.0)
    low = model.aircraft.controls[1].limits[0]
    assert deflection[-1] > low   # past the stall with travel to spare


def test_past_the_stall_the_glide_is_steep_and_the_speed_has_a_least(glides):
    """Reference-cases 4.2: at 20 to 25 deg the path falls at 8 to 25 deg."""
    stalled = [found.aero.strips.stalled[:20].mean() for found in glides]
    assert stalled[0] == 0.0 and stalled[-1] > 0.5   # of the wing's strips
    climb = np.degrees([found.climb_angle for found in glides])
    assert -25.0 < climb[-1] < -11.0 and climb[4] > -5.0
    speed = [found.airspeed for found in glides]
    assert 0 < np.argmin(speed) < len(speed) - 1


def test_a_climb_takes_the_throttle_of_its_weight_component(model, level):
    """Thrust grows by W sin(climb), at nearly the same loads."""
    climb = math.radians(3.0)
    found = trim.straight(model, airspeed=15.0, altitude=ALTITUDE, climb_angle=climb)
    assert found.status is Status.CONVERGED
    straight = level[SPEEDS.index(15.0)]
    pulls = [wings.push(model.aircraft, each.velocity_B, each.controls.throttle).force_B[0]
             for each in (found, straight)]
    gained = pulls[0] - pulls[1]
    # Lift, and with it the induced drag, falls by 1 - cos(3 deg) = 0.14 %; the thrust stands
    # 1.9 deg from the path.
    assert gained == pytest.approx(
        model.aircraft.mass.mass * GRAVITY * math.sin(climb), rel=0.005)


def test_the_start_of_the_search_chooses_among_the_trims(model):
    """At 9.5 m/s level flight is possible below and above the angle of maximum lift."""
    low, high = (trim.straight(model, airspeed=9.5, altitude=ALTITUDE, alpha0=math.radians(a))
                 for a in (4.0, 21.0))
    for found in (low, high):
        assert found.status is Status.CONVERGED
        assert np.abs(imbalance(model, found)).max() <= 1e-6
    assert math.degrees(low.alpha) < 14.0 and math.degrees(high.alpha) > 18.0
    assert high.controls.throttle > low.controls.throttle + 0.3   # the back of the power curve
    assert elevator(model, high) < elevator(model, low)


def test_a_throttle_that_does_not_reach_is_named(model):
    found = trim.straight(model, airspeed=28.0, altitude=ALTITUDE)
    assert found.status is Status.NOT_CONVERGED
    assert found.controls.throttle > 1.0
    # 35 N at rest and none at 30 m/s leave 2.3 N, and a little more off the thrust line.
    assert re.fullmatch(rf'the throttle would have to stand at {found.controls.throttle:.2f}, it '
                        r'goes from 0 to 1 \(2\.[34] N at full throttle and this airspeed\)',
                        found.message)
    found = trim.straight(model, airspeed=15.0, altitude=ALTITUDE,
                         climb_angle=math.radians(-10.0))
    assert found.status is Status.NOT_CONVERGED and found.controls.throttle < 0.0
    assert 'the throttle would have to stand at -' in found.message
    # Past the 30 m/s where it has no thrust left no throttle does anything.
    found = trim.straight(model, airspeed=34.0, altitude=ALTITUDE)
    assert found.status is Status.NOT_CONVERGED
    assert found.message.endswith('without any thrust at 34.0 m/s')


def test_an_elevator_that_does_not_reach_is_named(model):
    found = trim.glide(model, alpha=math.radians(35.0), altitude=ALTITUDE)
    assert found.status is Status.NOT_CONVERGED
    assert elevator(model, found) == model.aircraft.controls[1].limits[0]
    assert found.message.startswith('no balance found, residual ')
    assert found.message.endswith('with the elevator at its limit of -30 deg')
    found = trim.straight(model, airspeed=6.0, altitude=ALTITUDE)
    assert found.status is Status.NOT_CONVERGED
    assert found.message == (f'the elevator would have to stand at '
                             f'{math.degrees(elevator(model, found)):.1f} deg, '
                             f'its limits are -30 and 20')


def test_trims_do_not_depend_on_the_tolerance_of_the_decambering(level, glides):
    sharp = models.build(
        definition.aircraft(definition.find('aircraft', 'trainer')), Settings(tolerance=1e-11))
    # 1e-5 rad of decambering is 1e-5 of alpha, and some times that of the elevator past stall.
    for found, speed in zip(level, SPEEDS):
        again = trim.straight(sharp, airspeed=speed, altitude=ALTITUDE)
        assert again.alpha == pytest.approx(found.alpha, abs=5e-5)
        assert elevator(sharp, again) == pytest.approx(elevator(sharp, found), abs=5e-5)
    for found in glides[::3]:
        again = trim.glide(sharp, alpha=found.alpha, altitude=ALTITUDE,
                           delta0=found.aero.strips.delta)
        assert elevator(sharp, again) == pytest.approx(elevator(sharp, found), abs=1e-4)
        assert again.airspeed == pytest.approx(found.airspeed, rel=1e-4)


def test_without_an_elevator_there_is_no_trim(model):
    controls = tuple(c for c in model.aircraft.controls if c.name != trim.PITCH_CONTROL)
    without = models.build(dataclasses.replace(model.aircraft, controls=controls))
    with pytest.raises(ConfigError, match=r"named elevator, there are \['aileron', 'rudder'\]"):
        trim.glide(without, alpha=0.1, altitude=ALTITUDE)


@pytest.mark.parametrize('search', [
    lambda model, failed: trim.straight(model, airspeed=12.0, altitude=0.0, failed=failed),
    lambda model, failed: manoeuvre.steady(
        model, manoeuvre.Task(airspeed=12.0, failed=failed), altitude=0.0)])
def test_an_engine_that_is_not_there_cannot_fail(model, search):
    with pytest.raises(ConfigError, match="has no engine named 'engine_2'"):
        search(model, frozenset({'engine_2'}))


def test_without_an_engine_the_aircraft_glides_at_the_airspeed_asked_for(model):
    """Elevator and climb angle balance it; tan(climb_angle) = -CD / CL, as for `glide`."""
    glider = models.build(dataclasses.replace(model.aircraft, engines=()))
    found = trim.straight(glider, airspeed=12.0, altitude=ALTITUDE)
    assert found.status is Status.CONVERGED and found.controls.throttle == 0.0
    same = trim.glide(glider, alpha=found.alpha, altitude=ALTITUDE)
    # One solution by two roads, each to 1e-6 of the weight.
    assert same.airspeed == pytest.approx(12.0, abs=1e-4)
    assert same.climb_angle == pytest.approx(found.climb_angle, abs=1e-6)
