# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""Flight behind propellers: trimmed, flown, saved, linearised, on one engine of two."""

import dataclasses
import math

import numpy as np
import propellers
import pytest

from poststall_sim import (
    manoeuvre,
    propulsion,
    rigid_body,
    simulation,
    slipstream,
    state_space_file,
    trim,
)
from poststall_sim.aero import model as models
from poststall_sim.aero import solver
from poststall_sim.aero.wash import Precision
from poststall_sim.aircraft import ConfigError
from poststall_sim.atmosphere import standard_air
from poststall_sim.engines import ElectricMotor, LinearThrust, Rotation
from poststall_sim.flight_file import load_state, save_state
from poststall_sim.frames import (
    body_to_geometry,
    euler_from_quaternion,
    geometry_to_body,
    quaternion_from_euler,
    quaternion_rate,
)
from poststall_sim.stability import bodies, derivatives, flight, motion
from poststall_sim.stability.motion import Decambering, factorised
from poststall_sim.state import BodyState, EngineState, Status

SPEED, ALTITUDE = 14.0, 100.0
DENSITY = standard_air(ALTITUDE).density
COARSE = models.Settings(chordwise=2)


@pytest.fixture(scope='module')
def blown():
    """Return a flight of the trainer behind a propeller, with slipstream and swirl."""
    return simulation.start(propellers.at_nose(slipstream=True, swirl=True, diameter=0.5),
                            COARSE, airspeed=SPEED, altitude=ALTITUDE)


def fresh(flight):
    return simulation.Flight.resumed(flight.model, flight.saved())


def test_trimmed_flight_behind_a_propeller_stays_trimmed(blown):
    """Two seconds: nothing but round-off, the closure's tolerance and the falling thrust move."""
    flown = fresh(blown)
    first = flown.snapshot
    for _ in range(80):
        last = flown.step(flown.trim)
    assert last.status is Status.CONVERGED
    assert np.abs(last.body.rates_B).max() < 1e-3
    # The march in float32 and its wake of finite length differ from steady flow by as much.
    assert last.body.velocity_B == pytest.approx(first.body.velocity_B, abs=0.01)
    assert last.engines.speed == pytest.approx(first.engines.speed, rel=1e-3)
    assert last.engines.charge[0] < first.engines.charge[0]


def test_bank_aileron_and_rudder_balance_what_a_propeller_turns():
    """Six equations; against the torque of a clockwise one the right aileron goes down."""
    for rotation, sign in ((Rotation.CLOCKWISE, 1.0), (Rotation.COUNTERCLOCKWISE, -1.0)):
        machine = propellers.at_nose(rotation=rotation)
        found = trim.straight(models.build(machine, COARSE), airspeed=SPEED, altitude=ALTITUDE)
        assert found.status is Status.CONVERGED and found.residual.shape == (6,)
        assert np.abs(found.residual).max() <= trim.ACCEPTED
        aileron = found.controls.deflections[machine.control_names.index('aileron')]
        assert sign * aileron > 1e-4
        # The flight path is what was asked for, through the banked attitude.
        down = -found.velocity_B @ simulation.rotation(found.q_NB)[2]
        assert down == pytest.approx(0.0, abs=1e-9)


def test_a_glide_has_its_propeller_braking():
    machine = propellers.at_nose()
    model = models.build(machine, COARSE)
    alpha = math.radians(5.0)
    plain = trim.glide(models.build(propellers.trainer(), COARSE), alpha=alpha,
                       altitude=ALTITUDE)
    found = trim.glide(model, alpha=alpha, altitude=ALTITUDE)
    assert found.status is plain.status is Status.CONVERGED
    assert found.climb_angle < plain.climb_angle - 1e-3   # steeper


def test_a_flight_with_shafts_goes_on_from_its_file_to_the_bit(blown, tmp_path):
    flown = fresh(blown)
    flown.failed_engines = frozenset()
    pulled = dataclasses.replace(flown.trim, throttle=0.9)
    for _ in range(5):
        flown.step(pulled)
    save_state(flown, tmp_path / 'flight.npz')
    again = load_state(flown.model, tmp_path / 'flight.npz')
    assert again.state.engines.speed[0] > 1.05 * blown.snapshot.engines.speed[0]
    for _ in range(5):
        one, other = flown.step(pulled), again.step(pulled)
    for key in ('velocity_B', 'rates_B', 'q_NB', 'position_N'):
        assert getattr(one.body, key).tobytes() == getattr(other.body, key).tobytes()
    for field in dataclasses.fields(one.engines):
        assert getattr(one.engines, field.name).tobytes() \
            == getattr(other.engines, field.name).tobytes()


def test_an_engine_that_fails_stays_failed_in_the_file_and_after_a_reset(blown, tmp_path):
    flown = fresh(blown)
    flown.failed_engines = frozenset({'engine_1'})
    speeds = [flown.step(flown.trim).engines.speed[0] for _ in range(8)]
    assert speeds[-1] < 0.9 * blown.snapshot.engines.speed[0] and flown.snapshot.engines.failed[0]
    assert flown.snapshot.engines.current[0] == 0.0
    save_state(flown, tmp_path / 'flight.npz')
    again = load_state(flown.model, tmp_path / 'flight.npz')
    assert again.failed_engines == {'engine_1'}
    # The air turns it now; the battery is full again.
    assert flown.reset().engines.thrust[0] < 0.0 and flown.snapshot.engines.charge[0] == 1.0


def test_slipstream_changes_the_trim_and_none_leaves_it_as_it_was(blown):
    calm = trim.straight(models.build(propellers.at_nose(diameter=0.5), COARSE),
                         airspeed=SPEED, altitude=ALTITUDE)
    with_stream = trim.straight(blown.model, airspeed=SPEED, altitude=ALTITUDE)
    assert calm.status is with_stream.status is Status.CONVERGED
    # Faster air over the middle of the wing: the same lift at less incidence.
    assert with_stream.alpha < calm.alpha - math.radians(0.05)


def test_a_turn_behind_a_propeller_is_in_balance_with_its_gyroscopic_moment():
    """Newton's and Euler's laws as the simulation has them; h is 1.5 kg m^2/s here."""
    model = models.build(propellers.at_nose(inertia=4e-3, slipstream=True),
                         dataclasses.replace(COARSE, unsteady=False, tolerance=1e-9))
    found = manoeuvre.steady(model, manoeuvre.Task(airspeed=SPEED, turn_rate=0.4),
                             altitude=ALTITUDE)
    assert found.status is Status.CONVERGED
    body = BodyState(np.array([0.0, 0.0, -ALTITUDE]), found.velocity_B, found.rates_B, found.q_NB)
    begun = simulation.Flight(model, body, found.controls, dt_ns=10_000_000,
                              delta0=found.aero.strips.delta).snapshot
    assert begun.engines.speed[0] * 4e-3 > 1.0
    assert begun.rate_change_B == pytest.approx(np.zeros(3), abs=1e-4)
    assert begun.acceleration_B == pytest.approx(
        np.cross(found.rates_B, found.velocity_B), abs=1e-4)


# --- one engine of two


def test_on_one_engine_of_two_rudder_and_bank_hold_the_heading():
    """The right one fails: the left pulls the nose right, the rudder goes left and holds it."""
    pair = propellers.trainer(*(LinearThrust(17.5, 30.0, (-0.1, side * 0.4, -0.05))
                                for side in (-1.0, 1.0)))
    model = models.build(pair, COARSE)
    both = trim.straight(model, airspeed=SPEED, altitude=ALTITUDE)
    alone = trim.straight(model, airspeed=SPEED, altitude=ALTITUDE,
                          failed=frozenset({'engine_2'}))
    assert both.status is alone.status is Status.CONVERGED
    assert both.bank == 0.0 and both.residual.shape == (3,)
    rudder = alone.controls.deflections[pair.control_names.index('rudder')]
    assert rudder > 0.01    # trailing edge left: nose left
    assert alone.controls.throttle > 1.9 * both.controls.throttle
    assert np.abs(alone.residual).max() <= trim.ACCEPTED
    none = trim.straight(model, airspeed=SPEED, altitude=ALTITUDE,
                         failed=frozenset(pair.engine_names))
    assert none.status is Status.CONVERGED and none.climb_angle < -0.02


def test_a_flight_begins_on_one_engine_and_stays_trimmed():
    pair = propellers.trainer(*(LinearThrust(17.5, 30.0, (-0.1, side * 0.4, -0.05), name=name)
                                for side, name in ((-1.0, 'left'), (1.0, 'right'))))
    flown = simulation.start(pair, COARSE, airspeed=SPEED, altitude=ALTITUDE,
                             failed=frozenset({'right'}))
    first = flown.snapshot
    for _ in range(40):
        last = flown.step(flown.trim)
    assert last.engines.thrust[0] > 3.0 and last.engines.thrust[1] == 0.0
    assert np.abs(last.body.rates_B).max() < 1e-3
    assert last.body.velocity_B == pytest.approx(first.body.velocity_B, abs=0.01)
    middle, message = frozenset({'middle'}), r"no engine named 'middle', there are \['left', 'rig"
    with pytest.raises(ConfigError, match=message):
        simulation.start(pair, COARSE, airspeed=SPEED, altitude=ALTITUDE, failed=middle)
    with pytest.raises(ConfigError, match=message):
        flown.failed_engines = middle


# --- linear


@pytest.mark.parametrize('drive', [propellers.MOTOR, propellers.GOVERNOR],
                         ids=['motor', 'governor'])
def test_the_matrix_is_the_slope_of_the_equations_of_motion_and_of_the_shaft(drive):
    """Banked by the torque, off the centre line; by differences of the flight's own equations."""
    engine = propellers.propeller(position_G=(-0.45, 0.1, 0.02), drive=drive, inertia=2e-3)
    machine = propellers.trainer(engine)
    model = models.build(machine, dataclasses.replace(COARSE, tolerance=1e-10))
    flown = trim.straight(model, airspeed=SPEED, altitude=ALTITUDE, climb_angle=0.05)
    assert flown.status is Status.CONVERGED and abs(flown.bank) > 1e-5
    mass, throttle = machine.mass, flown.controls.throttle
    inverse = rigid_body.mass_matrix_inverse(mass.mass, mass.inertia_B, np.zeros((6, 6)))

    def rates(x, throttle=throttle):
        body = BodyState(np.zeros(3), x[:3], x[3:6], quaternion_from_euler(*x[6:9]))
        onset = models.Onset(body_to_geometry(-x[:3]), body_to_geometry(x[3:6]))
        aero = solver.steady(model, onset, flown.controls.deflections, density=DENSITY,
                             delta0=flown.aero.strips.delta)
        state = EngineState(x[9:], [1.0])
        meeting = propulsion.Meeting(x[:3], x[3:6], DENSITY, np.array([throttle]))
        load = np.concatenate([geometry_to_body(aero.force_G), geometry_to_body(aero.moment_G)]) \
            + propulsion.loads(machine, state, meeting).load
        change = rigid_body.acceleration(
            body, load, mass=mass.mass, inertia_B=mass.inertia_B, inverse=inverse)
        turn = 1e-6 * quaternion_rate(body.q_NB, x[3:6])
        angles = (euler_from_quaternion(body.q_NB + turn)
                  - euler_from_quaternion(body.q_NB - turn)) / 2e-6
        later = propulsion.advance(machine, state, meeting, 1e-5).speed
        return np.concatenate([change, angles, (later - x[9:]) / 1e-5])

    settled = propulsion.settled(machine, propulsion.Meeting(
        flown.velocity_B, np.zeros(3), DENSITY, np.array([throttle])))
    state = np.concatenate([flown.velocity_B, np.zeros(3), [flown.bank, flown.pitch, 0.0],
                            settled.speed])
    body = bodies.free_body(machine, velocity_B=flown.velocity_B, pitch=flown.pitch,
                            bank=flown.bank, throttle=throttle, density=DENSITY)
    assert body.names == (*bodies.STATES, 'shaft[engine_1]')
    matrix = derivatives.state_matrix(
        body, derivatives.quasi_steady(model, flown, density=DENSITY).motion)
    steps = np.diag([1e-4] * 9 + [1e-1])
    expected = np.column_stack([(rates(state + x) - rates(state - x)) / (2.0 * x.sum())
                                for x in steps])
    # Rows of the airframe and of the shaft, whose time constant of 0.1 s is 1e4 of its steps here.
    for rows, part in ((slice(0, 9), 2e-5), (slice(9, 10), 1e-4)):
        scale = np.abs(expected[rows]).max()
        assert matrix[rows] == pytest.approx(expected[rows], abs=part * scale)
    by_throttle = (rates(state, throttle + 1e-4) - rates(state, throttle - 1e-4)) / 2e-4
    found = np.linalg.solve(body.mass, body.throttle)
    for rows in (slice(0, 9), slice(9, 10)):
        assert found[rows] == pytest.approx(
            by_throttle[rows], abs=1e-4 * np.abs(by_throttle[rows]).max() + 1e-9)
    if isinstance(drive, ElectricMotor):
        assert matrix[9, 0] > 1.0    # more airspeed, less torque, more turns
    else:
        assert not matrix[9, :9].any() and matrix[9, 9] == pytest.approx(-1.0 / 0.3, rel=1e-7)


def test_a_throttle_moves_the_linear_system_as_it_moves_the_flight():
    """
    Half the difference of flights with a little more and a little less, over 60 steps.

    Speeds, pitching and the shaft's speed within 0.5 % of their largest; sideways a flight feels
    half of the first step's reaction, as its loads go along straight lines from step to step.
    """
    exactly = dataclasses.replace(COARSE, precision=Precision.FLOAT64, coarsen=False,
                                  interpolate=False, tolerance=1e-9)
    model = models.build(propellers.at_nose(), exactly)
    level = trim.straight(model, airspeed=SPEED, altitude=ALTITUDE)
    system = flight.linearise(model, level, altitude=ALTITUDE,
                              decamberings=(Decambering.VARIABLE,)).systems[Decambering.VARIABLE]
    dt_ns, steps, change = round(system.flow.dt * 1e9), 60, 1e-3

    def flown(throttle):
        body = BodyState(np.array([0.0, 0.0, -ALTITUDE]), level.velocity_B, np.zeros(3),
                         level.q_NB)
        state, _ = simulation.begin(model, body, level.controls, dt_ns=dt_ns,
                                    delta0=level.aero.strips.delta)
        controls = dataclasses.replace(level.controls, throttle=throttle)
        for _ in range(steps):
            state, _ = simulation.step(model, state, controls, dt_ns=dt_ns)
            body = state.body
            yield np.concatenate([body.velocity_B, body.rates_B,
                                  euler_from_quaternion(body.q_NB), state.engines.speed])

    throttle = level.controls.throttle
    more, less = (np.array(list(flown(throttle + each))) for each in (change, -change))
    simulated = 0.5 * (more - less) / change
    factors, x, linear = factorised(system.e), np.zeros(system.size), []
    for _ in range(steps):
        x = factors.solve(system.a @ x + system.b[:, system.inputs.index('throttle')])
        linear.append(x[system.own])
    along = [0, 2, 4, 7, 9]
    error = np.abs(simulated - linear).max(axis=0) / np.abs(simulated).max(axis=0)
    assert system.body.names[9] == 'shaft[engine_1]' and simulated[-1, 9] > 100.0
    assert error[along].max() < 5e-3


@pytest.mark.parametrize('order', [None, 12])
def test_a_shaft_is_a_state_with_a_unit_in_the_file(tmp_path, order):
    model = models.build(propellers.at_nose(), COARSE)
    level = trim.straight(model, airspeed=SPEED, altitude=ALTITUDE)
    at = flight.linearise(model, level, altitude=ALTITUDE, rows=20,
                          decamberings=(Decambering.VARIABLE,))
    written = state_space_file.export(tmp_path / 'system.npz', model, at, altitude=ALTITUDE,
                                      decambering=Decambering.VARIABLE, order=order).space
    with np.load(tmp_path / 'system.npz') as file:
        units = dict(zip(file['states'].tolist(), file['state_units'].tolist()))
    assert units['shaft[engine_1]'] == 'rad/s'
    # More turns, more thrust: the airspeed of the next step.
    rows = [written.states.index(name) for name in ('u', 'shaft[engine_1]')]
    assert written.a[rows[0], rows[1]] > 0.0 and 0.5 < written.a[rows[1], rows[1]] < 1.0


def test_modes_keep_their_names_beside_a_shaft():
    """A propeller's shaft is one eigenvalue more; the classical modes are there as ever."""
    model = models.build(propellers.at_nose(), COARSE)
    flown = trim.straight(model, airspeed=SPEED, altitude=ALTITUDE)
    found = flight.quasi_steady_modes(model, flown, altitude=ALTITUDE)
    assert found.status is Status.CONVERGED
    names = [mode.name for mode in found.modes]
    assert {'short period', 'phugoid', 'Dutch roll', 'roll', 'spiral'} <= set(names)
    shaft, = (mode for mode in found.modes if mode.name not in (
        'short period', 'phugoid', 'Dutch roll', 'roll', 'spiral'))
    assert shaft.stable and not shaft.oscillates


def test_linear_models_keep_the_slipstream_of_their_trim(blown):
    """
    The lattice at rest is that of steady air in the same stream, and the stream is felt.

    A wake of twenty chords leaves 1e-4, as without a stream. The tail stands in most of 2 w more
    than the airspeed; on the part of it that does, elevator has as the square of that.
    """
    model = dataclasses.replace(
        blown.model, settings=dataclasses.replace(COARSE, wake_length=8.0))
    flown = trim.straight(model, airspeed=SPEED, altitude=ALTITUDE)
    steady = derivatives.quasi_steady(model, flown, density=DENSITY)
    assert steady.loads == pytest.approx(np.concatenate([
        geometry_to_body(flown.aero.force_G), geometry_to_body(flown.aero.moment_G)]), abs=1e-4)
    system = flight.linearise(model, flown, altitude=ALTITUDE, decamberings=(
        Decambering.VARIABLE,)).systems[Decambering.VARIABLE]
    still = motion.response(system, 1.0).real
    assert np.abs(still[:, :3] - steady.motion[:, :3]).max() \
        < 5e-4 * np.abs(steady.motion[:, :3]).max()
    calm = derivatives.quasi_steady(
        model, dataclasses.replace(flown, push=None), density=DENSITY)
    stream, = slipstream.streams(model.aircraft, model.lattice, flown.push.readings, DENSITY)
    most = (1.0 + 2.0 * stream.induced / SPEED) ** 2
    assert 1.05 < steady.coefficients['Cm_elevator'] / calm.coefficients['Cm_elevator'] < most
