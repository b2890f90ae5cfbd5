# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""Quasi-steady derivatives against AVL, other compositions and closed forms; the modes of them."""

import dataclasses
import math
import re

import numpy as np
import pytest
import wings

from poststall_sim import definition, polar, rigid_body, trim
from poststall_sim.aero import model as models
from poststall_sim.aero import solver
from poststall_sim.aero.decambering import Closure
from poststall_sim.aero.model import Settings
from poststall_sim.aero.schemes import Scheme
from poststall_sim.atmosphere import standard_air
from poststall_sim.frames import (
    GRAVITY,
    body_to_geometry,
    euler_from_quaternion,
    geometry_to_body,
    quaternion_from_euler,
    quaternion_rate,
)
from poststall_sim.stability import bodies, derivatives, modes
from poststall_sim.state import BodyState, Controls, Status

ALTITUDE = 300.0
DENSITY = standard_air(ALTITUDE).density
SPEED = 15.0


@pytest.fixture(scope='module')
def model():
    return models.build(definition.aircraft(definition.find('aircraft', 'trainer')))


@pytest.fixture(scope='module')
def cruise(model):
    return trim.straight(model, airspeed=SPEED, altitude=ALTITUDE)


@pytest.fixture(scope='module')
def found(model, cruise):
    return derivatives.quasi_steady(model, cruise, density=DENSITY)


@pytest.fixture(scope='module')
def stalled(model):
    """Return the glide at 20 deg, on the branch that comes from below."""
    delta0 = None
    for alpha in range(8, 21, 2):
        result = trim.glide(model, alpha=math.radians(alpha), altitude=ALTITUDE, delta0=delta0)
        delta0 = result.aero.strips.delta
    return result


def body_of(model, flown):
    return bodies.free_body(
        model.aircraft, velocity_B=flown.velocity_B, pitch=flown.alpha + flown.climb_angle,
        throttle=flown.controls.throttle, density=DENSITY)


def matrix_of(model, flown, result, **options):
    return derivatives.state_matrix(body_of(model, flown), result.motion, **options)


def modes_of(model, flown, result, **options):
    reference = model.aircraft.reference
    return modes.classify(
        *np.linalg.eig(matrix_of(model, flown, result, **options)), airspeed=flown.airspeed,
        span=reference.span, chord=reference.chord)


def held(model, alpha, airspeed=1.0, deflections=(), delta0=None):
    """Return a flight at alpha as if it were trimmed, for derivatives of a wing alone."""
    aero = wings.steady(model, airspeed, alpha, deflections=np.array(deflections), delta0=delta0)
    return trim.Trim(airspeed, alpha, 0.0, Controls(np.array(deflections)), np.zeros(3), aero,
                     Status.CONVERGED, 'held')


def test_wing_of_avl_run_11():
    """Slopes and damping in pitch, which AVL printed for one panel along the chord."""
    _, model = wings.wing_a(1)
    result = derivatives.quasi_steady(
        model, held(model, math.radians(1.0)), density=wings.DENSITY)
    assert result.status is Status.CONVERGED and result.message == 'converged'
    assert result.coefficients['CL_alpha'] == pytest.approx(4.638088, rel=0.002)
    assert result.coefficients['Cm_alpha'] == pytest.approx(-0.429247, rel=0.01)
    assert result.coefficients['Cm_q'] == pytest.approx(-0.517094, rel=0.005)


def test_wing_of_avl_run_11_in_sideslip_roll_and_yaw():
    """AVL's lateral derivatives about its stability axes, with the wake along x as there."""
    _, model = wings.wing_a(1)
    model = dataclasses.replace(model, settings=dataclasses.replace(
        model.settings, unsteady=False, axial_wake=True))
    alpha = math.radians(1.0)
    ours = derivatives.quasi_steady(
        model, held(model, alpha), density=wings.DENSITY).coefficients
    ca, sa = math.cos(alpha), math.sin(alpha)
    turn = np.array([[ca, sa], [-sa, ca]])   # roll and yaw from body to stability axes
    roll, _ = turn @ [ours['Cl_beta'], ours['Cn_beta']]
    (roll_p, roll_r), (yaw_p, yaw_r) = turn @ np.array(
        [[ours['Cl_p'], ours['Cl_r']], [ours['Cn_p'], ours['Cn_r']]]) @ turn.T
    assert roll_p == pytest.approx(-0.518725, rel=0.002)
    assert roll_r == pytest.approx(0.064243, rel=0.005)
    # The plate itself is turned by its incidence here, and its tips feel their own wash.
    assert roll == pytest.approx(-0.025749, rel=0.02)
    # The yawing moments are small differences of induced drag.
    assert yaw_p == pytest.approx(-0.019846, rel=0.02)
    assert yaw_r == pytest.approx(-0.000898, rel=0.03)


def test_coefficients_are_the_slopes_of_the_polar(model, cruise, found):
    """Each named derivative from two points of `polar`, whose angles and axes are its own."""
    exact = dataclasses.replace(model, settings=dataclasses.replace(
        model.settings, tolerance=1e-10))
    centre = {'alpha': cruise.alpha, 'beta': 0.0, 'rates': np.zeros(3),
              'deflections': np.array(cruise.controls.deflections)}

    def at(name, change):
        values = {key: np.copy(value) for key, value in centre.items()}
        if name in ('alpha', 'beta'):
            values[name] = centre[name] + change
        elif name in ('p', 'q', 'r'):
            values['rates']['pqr'.index(name)] += change
        else:
            values['deflections'][model.aircraft.control_names.index(name)] += change
        return dataclasses.asdict(polar.point(
            exact, polar.Condition(**values), airspeed=SPEED, density=DENSITY,
            delta0=cruise.aero.strips.delta).coefficients)

    names = ['alpha', 'beta', 'p', 'q', 'r', *model.aircraft.control_names]
    assert len(found.coefficients) == 6 * len(names)
    for name in names:
        high, low = at(name, 1e-4), at(name, -1e-4)
        for key in high:
            slope = (high[key] - low[key]) / 2e-4
            assert found.coefficients[f'{key}_{name}'] == pytest.approx(slope, abs=2e-6), name


def test_derivatives_have_the_signs_of_a_stable_aeroplane(found):
    value = found.coefficients
    assert 4.0 < value['CL_alpha'] < 2.0 * math.pi and value['Cm_alpha'] < 0.0
    assert value['Cm_q'] < 0.0 and value['Cl_p'] < 0.0 and value['Cn_r'] < 0.0
    assert value['CY_beta'] < 0.0 and value['Cl_beta'] < 0.0 and value['Cn_beta'] > 0.0
    assert value['Cl_r'] > 0.0 and value['Cn_p'] < 0.0
    assert value['Cm_elevator'] < 0.0 and value['Cl_aileron'] > 0.0


@pytest.mark.parametrize('flight', ['cruise', 'stalled'])
def test_loads_grow_with_the_square_of_the_airspeed(model, flight, request):
    """Euler's theorem on homogeneous functions: (dQ/dv) v = 2 Q without rates."""
    flown = request.getfixturevalue(flight)
    result = derivatives.quasi_steady(model, flown, density=DENSITY)
    assert result.status is Status.CONVERGED
    scale = np.abs(result.motion[:, :3] * flown.airspeed).max()
    # Past the stall the curves bend: the step squared, times their third derivative.
    assert result.motion[:, :3] @ flown.velocity_B == pytest.approx(
        2.0 * result.loads, abs=5e-6 * scale)


@pytest.mark.parametrize('flight', ['cruise', 'stalled'])
def test_the_step_does_not_matter(model, flight, request):
    flown = request.getfixturevalue(flight)
    one, other = (derivatives.quasi_steady(model, flown, density=DENSITY, step=step)
                  for step in (1e-4, 2e-5))
    for key, value in one.coefficients.items():
        # Halves of the table's curvature past stall, over CL_q of 7 and the like.
        assert other.coefficients[key] == pytest.approx(value, abs=2e-4 * max(1.0, abs(value)))
    assert one.max_residual <= trim.TIGHT and other.max_residual <= trim.TIGHT


def test_symmetric_flight_keeps_longitudinal_and_lateral_apart(model, cruise, stalled):
    for flown in (cruise, stalled):
        matrix = matrix_of(model, flown, derivatives.quasi_steady(model, flown, density=DENSITY))
        along, across = [*modes.LONGITUDINAL], [*modes.LATERAL, modes.HEADING]
        for rows, columns in ((along, across), (across, along)):
            assert np.abs(matrix[np.ix_(rows, columns)]).max() < 1e-8 * np.abs(matrix).max()
        assert derivatives.longitudinal(matrix)[3].tolist() == [0.0, 0.0, 1.0, 0.0]
        assert derivatives.lateral(matrix)[3, :2].tolist() == [0.0, 1.0]


def test_thrust_falls_with_airspeed_at_fixed_throttle(model, cruise):
    engine, = model.aircraft.engines
    expected = np.zeros((6, 6))
    expected[0, 0] = -cruise.controls.throttle * engine.static_thrust / engine.zero_thrust_airspeed
    # It stands at the CG's height.
    assert body_of(model, cruise).rest[:6, :3] == pytest.approx(expected[:, :3], abs=1e-9)


def test_a_body_without_air_feels_gravity_and_its_own_turning(model):
    u, w, pitch = 20.0, 3.0, 0.25
    matrix = derivatives.state_matrix(bodies.free_body(
        model.aircraft, velocity_B=np.array([u, 0.0, w]), pitch=pitch, throttle=0.0,
        density=DENSITY),
        np.zeros((6, 6)))
    expected = np.zeros((9, 9))
    expected[0, 4], expected[2, 4] = -w, u
    expected[1, 3], expected[1, 5] = w, -u
    expected[0, 7], expected[2, 7] = -GRAVITY * math.cos(pitch), -GRAVITY * math.sin(pitch)
    expected[1, 6] = GRAVITY * math.cos(pitch)
    expected[6, 3], expected[6, 5] = 1.0, math.tan(pitch)
    expected[7, 4], expected[8, 5] = 1.0, 1.0 / math.cos(pitch)
    assert matrix == pytest.approx(expected, abs=1e-13)


def test_moments_go_through_the_product_of_inertia(model):
    """Etkin's primed derivatives: L' = (Izz L + Ixz N)/(Ixx Izz - Ixz^2)."""
    mass = model.aircraft.mass
    loads = np.zeros((6, 6))
    loads[3, 1], loads[5, 1] = -3.0, 4.0
    matrix = derivatives.state_matrix(bodies.free_body(
        model.aircraft, velocity_B=np.zeros(3), pitch=0.0, throttle=0.0,
        density=DENSITY), loads)
    ixx, izz, ixz = mass.inertia_B[0, 0], mass.inertia_B[2, 2], -mass.inertia_B[0, 2]
    both = ixx * izz - ixz ** 2
    assert ixz != 0.0
    assert matrix[3, 1] == pytest.approx((izz * -3.0 + ixz * 4.0) / both, rel=1e-12)
    assert matrix[5, 1] == pytest.approx((ixz * -3.0 + ixx * 4.0) / both, rel=1e-12)


@pytest.mark.parametrize('added', [False, True])
def test_the_matrix_is_the_slope_of_the_equations_of_motion(model, added):
    """A climb, by differences of `rigid_body.acceleration` and of the quaternion's rate."""
    flown = trim.straight(model, airspeed=SPEED, altitude=ALTITUDE, climb_angle=0.05)
    mass = model.aircraft.mass
    added_mass = DENSITY * model.added_mass if added else np.zeros((6, 6))
    inverse = rigid_body.mass_matrix_inverse(mass.mass, mass.inertia_B, added_mass)
    exact = dataclasses.replace(model, settings=dataclasses.replace(
        model.settings, tolerance=1e-10))

    def rates(x):
        q_NB = quaternion_from_euler(*x[6:])
        body = BodyState(np.zeros(3), x[:3], x[3:6], q_NB)
        onset = models.Onset(body_to_geometry(-x[:3]), body_to_geometry(x[3:6]))
        aero = solver.steady(exact, onset, flown.controls.deflections, density=DENSITY,
                             delta0=flown.aero.strips.delta)
        load = np.concatenate([geometry_to_body(aero.force_G), geometry_to_body(aero.moment_G)]) \
            + wings.push(model.aircraft, x[:3], flown.controls.throttle).load
        change = rigid_body.acceleration(
            body, load, mass=mass.mass, inertia_B=mass.inertia_B, inverse=inverse)
        turn = 1e-6 * quaternion_rate(q_NB, x[3:6])
        angles = (euler_from_quaternion(q_NB + turn)
                  - euler_from_quaternion(q_NB - turn)) / 2e-6
        return np.concatenate([change, angles])

    state = np.concatenate([flown.velocity_B, np.zeros(3),
                            [0.0, flown.alpha + flown.climb_angle, 0.0]])
    assert np.abs(rates(state)[:6]).max() < 1e-4   # it is trimmed
    expected = np.column_stack([(rates(state + x) - rates(state - x)) / 2e-4
                                for x in 1e-4 * np.eye(9)])
    matrix = matrix_of(model, flown, derivatives.quasi_steady(model, flown, density=DENSITY),
                       added_mass=added_mass)
    assert matrix == pytest.approx(expected, abs=1e-5 * np.abs(expected).max())


def test_the_trainer_in_cruise_has_the_five_classical_modes(model, cruise, found):
    five = modes_of(model, cruise, found)
    assert [mode.name for mode in five] == [
        'short period', 'phugoid', 'Dutch roll', 'roll', 'spiral']
    short_period, phugoid, dutch_roll, roll, spiral = five
    assert short_period.stable and phugoid.stable and dutch_roll.stable and roll.stable
    assert abs(spiral.eigenvalue) < 0.01 * abs(roll.eigenvalue)
    aircraft, value = model.aircraft, found.coefficients
    reference, mass = aircraft.reference, aircraft.mass
    pressure = 0.5 * DENSITY * SPEED ** 2
    damping = pressure * reference.area * reference.span ** 2 * value['Cl_p'] \
        / (2.0 * SPEED * mass.inertia_B[0, 0])
    assert roll.eigenvalue.real == pytest.approx(damping, rel=0.03)
    # Lanchester's frequency is that of a path at constant angle of attack. A slow pitch rate
    # takes Cm_alpha alpha + Cm_q q c/2V = 0, and lift along with it: static over manoeuvre margin.
    light = DENSITY * reference.area * reference.chord / (4.0 * mass.mass)
    stiffness = 1.0 - light * (
        value['CL_q'] - value['CL_alpha'] * value['Cm_q'] / value['Cm_alpha'])
    lanchester = math.sqrt(2.0) * GRAVITY / SPEED
    assert phugoid.natural_frequency == pytest.approx(lanchester / math.sqrt(stiffness), rel=0.03)
    assert 0.02 < phugoid.damping_ratio < 0.2
    # Etkin & Reid, sec. 6.3 and 6.8: two degrees of freedom each, theirs to 10 %.
    a = matrix_of(model, cruise, found)
    assert short_period.natural_frequency == pytest.approx(
        math.sqrt(a[2, 2] * a[4, 4] - a[2, 4] * a[4, 2]), rel=0.1)
    assert dutch_roll.natural_frequency == pytest.approx(
        math.sqrt(a[1, 1] * a[5, 5] - a[1, 5] * a[5, 1]), rel=0.1)


def test_a_heavy_aircraft_has_lanchesters_phugoid(model, cruise, found):
    """With a small moment of inertia and stiff in pitch: omega = sqrt(2) g/V."""
    motion = np.array(found.motion)
    motion[4, 4] = motion[2, 4] = 0.0   # no pitch damping: the path alone
    motion[4, [0, 2]] *= 30.0
    stiff = dataclasses.replace(found, motion=motion)
    phugoid = modes_of(model, cruise, stiff)[1]
    assert phugoid.name == 'phugoid'
    assert phugoid.natural_frequency == pytest.approx(math.sqrt(2.0) * GRAVITY / SPEED, rel=0.02)


def test_roll_damping_goes_and_modes_are_followed_past_the_stall(model):
    """Cl_p about the body axis falls, and turns round; each branch keeps its name."""
    delta0, followed, damping = None, [], []
    for alpha in range(2, 25):
        flown = trim.glide(model, alpha=math.radians(alpha), altitude=ALTITUDE, delta0=delta0)
        delta0 = flown.aero.strips.delta
        result = derivatives.quasi_steady(model, flown, density=DENSITY)
        assert result.status is Status.CONVERGED, result.message
        damping.append(result.coefficients['Cl_p'])
        five = modes_of(model, flown, result)
        followed = modes.track(followed, five) if followed else list(five)
        assert [mode.name for mode in followed] == [
            'short period', 'phugoid', 'Dutch roll', 'roll', 'spiral']
    assert damping[0] < -0.5 and damping[-1] > 0.0
    assert not followed[4].stable and followed[4].natural_frequency > 5.0   # autorotation


def test_a_solution_that_does_not_converge_is_never_used():
    """Scheme D is given three iterations; the wing stalls, and the closure is left open."""
    model = models.build(wings.rectangular(6.0, 8, wings.stalling()), Settings(
        closure=Closure.LOCAL, scheme=Scheme.D, limit=3))
    result = derivatives.quasi_steady(
        model, held(model, math.radians(18.0)), density=wings.DENSITY)
    assert result.status is Status.NOT_CONVERGED
    assert 'w: a solution did not converge, residual ' in result.message
    assert result.max_residual > trim.TIGHT
    assert np.isnan(result.motion[:, 2]).all() and math.isnan(result.coefficients['CL_alpha'])
    assert np.isfinite(result.loads).all()
    with pytest.raises(np.linalg.LinAlgError):
        modes_of(model, held(model, math.radians(18.0)), result)


def test_a_difference_across_a_fold_is_refused():
    """A sharp stall, followed up to where its branch ends; beyond, the solver finds another."""
    model = models.build(wings.rectangular(6.0, 16, wings.stalling(0.0, 15.0, 0.25)),
                         Settings(tolerance=1e-9))
    before, after, delta0 = math.radians(17.0), math.radians(18.5), None
    while after - before > 1e-6:
        step = min(math.radians(0.1), 0.5 * (after - before))
        aero = wings.steady(model, 10.0, before + step, delta0=delta0)
        if delta0 is not None and np.abs(aero.strips.delta - delta0).max() > math.radians(5.0):
            after = before + step
        else:
            before, delta0 = before + step, aero.strips.delta
    flown = held(model, before, airspeed=10.0, delta0=delta0)
    result = derivatives.quasi_steady(model, flown, density=wings.DENSITY)
    assert result.status is Status.NOT_CONVERGED
    assert result.max_residual <= trim.TIGHT   # all solutions are
    assert re.search(r'w: the decambering changes by [\d.]+ deg more on one side than on the '
                     'other: the branch ends at a fold', result.message)
    assert np.isnan(result.motion[:, 2]).all() and math.isnan(result.coefficients['Cl_alpha'])


def test_a_trim_that_does_not_balance_is_named(model):
    flown = trim.glide(model, alpha=math.radians(35.0), altitude=ALTITUDE)
    result = derivatives.quasi_steady(model, flown, density=DENSITY)
    assert result.status is Status.NOT_CONVERGED
    assert result.message.startswith('the trim: no balance found, residual ')
