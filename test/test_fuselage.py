# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""Fuselage and gear: closed forms, signs, and what they take from a flight and never give it."""

import dataclasses
import math

import numpy as np
import pytest
import wings
import yaml
from scipy.integrate import quad

from poststall_sim import definition, fuselage, simulation, trim
from poststall_sim import polar as polars
from poststall_sim.aero import model as models
from poststall_sim.aircraft import ConfigError
from poststall_sim.frames import body_to_geometry, geometry_to_body
from poststall_sim.nonlifting import NonliftingBody
from poststall_sim.polar import Condition
from poststall_sim.stability import derivatives, linear
from poststall_sim.state import Controls, Status

RHO = 1.2
GEAR = NonliftingBody('gear', (0.3, 0.0, -0.4), (0.02, 0.03, 0.01))
TUBE = NonliftingBody('tube', (0.3, 0.0, 0.1), (0.01, 0.2, 0.2), length=2.0)
SHIP = NonliftingBody('ship', (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), length=2.0, volume=0.05)


def load(body, velocity_B, rates_B=(0.0, 0.0, 0.0), cg=(0.0, 0.0, 0.0)):
    """Return force and moment (6,) in B on a body of an aircraft that moves through the air."""
    velocity, rates = (body_to_geometry(np.array(each)) for each in (velocity_B, rates_B))
    total = fuselage.load([body], cg, lambda arm: -velocity - np.cross(rates, arm), RHO)
    return np.concatenate([geometry_to_body(total[:3]), geometry_to_body(total[3:])])


@pytest.mark.parametrize(('fineness', 'along', 'across'), [
    (1.0, 0.5, 0.5), (1.5, 0.305, 0.621), (2.0, 0.209, 0.702), (2.99, 0.122, 0.803),
    (3.99, 0.082, 0.860), (4.99, 0.059, 0.895), (6.01, 0.045, 0.918), (6.97, 0.036, 0.933),
    (8.01, 0.029, 0.945), (9.02, 0.024, 0.954), (9.97, 0.021, 0.960)])
def test_apparent_mass_is_that_of_lambs_table(fineness, along, across):
    """As printed with three digits, up to 0.0025 off the integrals that are held below."""
    assert fuselage.apparent_mass(fineness) == pytest.approx((along, across), abs=2.5e-3)


@pytest.mark.parametrize('fineness', [1.01, 2.0, 7.5, 40.0])
def test_apparent_mass_is_that_of_lambs_integrals(fineness):
    """With a0 = a b^2 int_0^inf dx/((s^2 + x) (a^2 + x)^1/2 (b^2 + x)): a0/(2 - a0), s = a, b."""
    a, b = fineness, 1.0
    for squared, found in zip((a * a, b * b), fuselage.apparent_mass(fineness)):
        value, _ = quad(lambda x, s=squared: a * b * b / (
            (s + x) * math.sqrt(a * a + x) * (b * b + x)), 0.0, math.inf, epsabs=1e-12)
        assert found == pytest.approx(value / (2.0 - value), abs=1e-8)


def test_apparent_mass_goes_from_sphere_to_needle_without_a_jump():
    values = np.array([fuselage.apparent_mass(x) for x in np.geomspace(1.0, 1e3, 4000)])
    # The slope at the sphere is 0.6 or so per unit of fineness, which grows by 0.2 % a step.
    assert np.abs(np.diff(values, axis=0)).max() < 2e-3
    assert np.all(np.diff(values[10:, 0]) < 0.0) and np.all(np.diff(values[10:, 1]) > 0.0)
    assert values[-1] == pytest.approx([0.0, 1.0], abs=2e-5)


def test_munks_moment_is_twice_the_dynamic_pressure_times_the_volume_and_turns_away():
    """2 q volume (k2 - k1) sin a cos a: nose-up with alpha, nose left with wind from the right."""
    k1, k2 = fuselage.apparent_mass(SHIP.fineness)
    speed, angle = 30.0, math.radians(7.0)
    size = RHO * speed ** 2 * SHIP.volume * (k2 - k1) * math.sin(angle) * math.cos(angle)
    along, across = speed * math.cos(angle), speed * math.sin(angle)
    assert load(SHIP, (along, 0.0, across)) == pytest.approx([0, 0, 0, 0, size, 0], abs=1e-9)
    assert load(SHIP, (along, across, 0.0)) == pytest.approx([0, 0, 0, 0, 0, -size], abs=1e-9)
    assert load(SHIP, (along, 0.0, -across))[4] == pytest.approx(-size)
    # Backwards it turns further away as well: the stable position is across the flow.
    assert load(SHIP, (-along, 0.0, across))[4] == pytest.approx(-size)
    ball = NonliftingBody('ball', (0, 0, 0), (0, 0, 0), length=1.0, volume=math.pi / 6.0)
    assert ball.fineness == pytest.approx(1.0)
    assert np.abs(load(ball, (along, across, across))).max() < 1e-12


def test_drag_of_a_gear_is_along_the_flow_where_its_areas_are_alike():
    gear = dataclasses.replace(GEAR, drag_area=(0.02, 0.02, 0.02))
    velocity = np.array([12.0, -5.0, 8.0])
    force = load(gear, velocity)[:3]
    assert force == pytest.approx(-0.5 * RHO * 0.02 * np.linalg.norm(velocity) * velocity)
    # In level flight its drag below the centre of gravity pitches the nose down.
    below = load(gear, (20.0, 0.0, 0.0))
    assert below[4] == pytest.approx(-0.5 * RHO * 0.02 * 400.0 * 0.4)


def test_crossflow_drag_of_a_slender_body_is_independent_of_what_flows_along_it():
    """Allen and Jorgensen: q cd A sin^2 alpha across, q cd A cos^2 alpha along."""
    speed = 20.0
    for angle in np.radians([0.0, 10.0, 50.0, 90.0, 130.0]):
        along, across = speed * math.cos(angle), speed * math.sin(angle)
        x, y, z = load(TUBE, (along, 0.0, across))[:3]
        pressure = 0.5 * RHO * speed ** 2
        assert x == pytest.approx(-pressure * 0.01 * math.cos(angle) * abs(math.cos(angle)))
        assert z == pytest.approx(-pressure * 0.2 * math.sin(angle) ** 2)
        assert abs(y) < 1e-12
    # Across it there is one flow, whatever its direction.
    _, y, z = load(TUBE, (5.0, 3.0, 4.0))[:3]
    assert (y, z) == pytest.approx((-0.5 * RHO * 0.2 * 5.0 * 3.0, -0.5 * RHO * 0.2 * 5.0 * 4.0))


def test_a_turning_slender_body_is_damped_along_its_length():
    """
    Turned at r about its middle: -rho/2 cd A r |r| L^3 / 32, the integral of |x| x^2 r |r|/L.

    Five places of Gauss's rule take |x|^3 within 2 %.
    """
    tube = dataclasses.replace(TUBE, position_G=(0.0, 0.0, 0.0))
    for rate in (0.5, -2.0):
        expected = -0.5 * RHO * 0.2 * rate * abs(rate) * 2.0 ** 3 / 32.0
        moment = load(tube, np.zeros(3), (0.0, rate, 0.0))[4], \
            load(tube, np.zeros(3), (0.0, 0.0, rate))[5]
        assert moment == pytest.approx((expected, expected), rel=0.02)


def test_drag_takes_energy_away_in_any_motion():
    rng = np.random.default_rng(1)
    for body in (GEAR, TUBE):
        for _ in range(300):
            velocity, rates = rng.normal(0.0, 10.0, 3), rng.normal(0.0, 3.0, 3)
            power = load(body, velocity, rates, cg=rng.normal(0.0, 0.3, 3))
            assert power[:3] @ velocity + power[3:] @ rates < 0.0


def test_slope_is_the_derivative_by_motion_in_body_axes():
    """Against differences of loads made with the whole chain of `load` here, in B."""
    velocity, rates = np.array([18.0, 1.5, 3.0]), np.array([0.3, -0.2, 0.4])
    body = dataclasses.replace(TUBE, volume=0.05)
    cg = (0.19, 0.0, -0.05)
    found = fuselage.load_slope([body, GEAR], cg, body_to_geometry(-velocity),
                                body_to_geometry(rates), RHO)
    flip = np.concatenate([geometry_to_body(np.ones(3))] * 2)
    step = 1e-5
    for i, change in enumerate(step * np.eye(6)):
        ends = [sum(load(each, velocity + way * change[:3], rates + way * change[3:], cg)
                    for each in (body, GEAR)) for way in (1.0, -1.0)]
        assert flip * found[:, i] == pytest.approx((ends[0] - ends[1]) / (2.0 * step), abs=1e-6)
    assert not fuselage.load_slope([], cg, velocity, rates, RHO).any()


@pytest.fixture(scope='module')
def machines():
    """Return the trainer as it is, and with a fuselage and a gear."""
    plain = wings.shipped_aircraft('trainer')
    return plain, dataclasses.replace(plain, bodies=(
        NonliftingBody('fuselage', (0.45, 0.0, -0.06), (0.006, 0.12, 0.12), length=1.7,
                       volume=0.02),
        NonliftingBody('gear', (0.15, 0.0, -0.2), (0.004, 0.004, 0.004))))


def test_fuselage_and_gear_enter_polar_trim_and_derivatives(machines):
    """Drag by its area, the neutral point forward by Munk's moment, less speed for the power."""
    plain, whole = (models.build(each, models.Settings(chordwise=2)) for each in machines)
    at = {'airspeed': 15.0, 'density': RHO}
    zero, up = Condition(0.0), Condition(math.radians(4.0))
    drag = [polars.point(each, zero, **at).coefficients for each in (plain, whole)]
    assert drag[1].CD - drag[0].CD == pytest.approx(0.010 / 1.28, rel=1e-9)
    assert drag[1].CL == pytest.approx(drag[0].CL, abs=1e-12)
    slope = [polars.point(each, up, **at).coefficients.Cm
             - polars.point(each, zero, **at).coefficients.Cm for each in (plain, whole)]
    assert slope[0] < slope[1] < 0.0
    found = [trim.straight(each, airspeed=15.0, altitude=100.0) for each in (plain, whole)]
    assert all(each.status is Status.CONVERGED for each in found)
    assert found[1].controls.throttle > found[0].controls.throttle + 0.02
    by = [derivatives.quasi_steady(each, at, density=RHO).coefficients
          for each, at in zip((plain, whole), found)]
    assert by[0]['Cm_alpha'] < by[1]['Cm_alpha'] and by[0]['Cn_beta'] > by[1]['Cn_beta'] > 0.0


def test_linear_flow_has_the_slope_of_the_bodies(machines):
    plain, whole = (models.build(each, models.Settings(chordwise=2)) for each in machines)
    found = trim.straight(plain, airspeed=15.0, altitude=100.0)
    onset = models.Onset(body_to_geometry(-found.velocity_B), np.zeros(3))
    deflections = found.controls.deflections
    both = [linear.linearise(each, onset, deflections, found.aero, density=RHO, dt=0.01, rows=4)
            for each in (plain, whole)]
    cg = plain.aircraft.mass.cg_G
    expected = [
        sum(load(body, found.velocity_B + way * change[:3], way * change[3:], cg)
            for body in whole.aircraft.bodies)
        for change in 1e-4 * np.eye(6) for way in (1.0, -1.0)]
    slope = (np.array(expected[::2]) - np.array(expected[1::2])).T / 2e-4
    assert both[1].load_nu - both[0].load_nu == pytest.approx(slope, abs=1e-6)
    assert np.array_equal(both[0].load_bound, both[1].load_bound)


def test_a_flight_with_bodies_is_slowed_and_one_without_is_left_alone(machines):
    speeds = []
    for machine in machines:
        flight = simulation.start(machine, airspeed=16.0, altitude=200.0)
        start = flight.snapshot
        # In trim already at the start: the step and the trim have the same loads.
        assert np.abs(start.acceleration_B).max() < 2e-3
        for _ in range(40):
            flight.step(Controls(flight.trim.deflections, 0.0))
        speeds.append(flight.snapshot.airspeed - start.airspeed)
    assert speeds[1] < speeds[0] < 0.0


BODIES = """
bodies:
  - {name: gear, position_m: [0.1, 0, -0.3], drag_area_m2: [0.01, 0.02, 0.01]}
  - {name: hull, position_m: [0.4, 0, 0], drag_area_m2: [0.01, 0.1, 0.1], length_m: 1.5,
     volume_m3: 0.02}
"""


def test_bodies_are_read_and_none_is_the_default(tmp_path):
    text = (wings.CONFIG / 'aircraft' / 'trainer.yaml').read_text()
    path = tmp_path / 'plane.yaml'
    path.write_text(text + BODIES)
    gear, hull = definition.aircraft(path).bodies
    assert gear == NonliftingBody('gear', (0.1, 0.0, -0.3), (0.01, 0.02, 0.01))
    assert (hull.length, hull.volume) == (1.5, 0.02)
    path.write_text(text)
    assert definition.aircraft(path).bodies == ()


@pytest.mark.parametrize(('change', 'message'), [
    ({'drag_area_m2': [0.01, -0.1, 0.0]}, r'bodies\[1\].drag_area_m2\[1\]: must be at least 0'),
    ({'length_m': None}, r'bodies\[1\]: body hull: volume goes with length'),
    ({'volume_m3': 3.0}, r'bodies\[1\]: body hull: .* thicker than it is long'),
    ({'volume_m3': 1e-12}, r'bodies\[1\]: body hull: a volume of 1e-12 m\^3 .* is a wire'),
    ({'name': 'gear'}, 'two bodies are named gear'),
    ({'lenght_m': 1.0}, r'bodies\[1\]: unknown key lenght_m'),
    ({'position_m': [0.0, 1.0]}, 'list of 3 numbers')])
def test_bodies_that_cannot_be_are_refused(tmp_path, change, message):
    text = (wings.CONFIG / 'aircraft' / 'trainer.yaml').read_text()
    bodies = yaml.safe_load(BODIES)['bodies']
    bodies[1] = {key: value for key, value in {**bodies[1], **change}.items()
                 if value is not None}
    path = tmp_path / 'plane.yaml'
    path.write_text(text + '\n' + yaml.safe_dump({'bodies': bodies}))
    with pytest.raises(ConfigError, match=message):
        definition.aircraft(path)
