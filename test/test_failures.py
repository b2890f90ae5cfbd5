# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""Parts that stick, float or are lost in flight, with and without actuators between."""

import dataclasses
import math

import numpy as np
import pytest
import wings

from poststall_sim import flight_file, jobs, simulation
from poststall_sim.actuators import Actuator
from poststall_sim.aero.flaps import floating_ratio
from poststall_sim.aircraft import ConfigError
from poststall_sim.controls import Control, Effector
from poststall_sim.failures import Failure, Kind
from poststall_sim.scenario import Channel, Fault, Scenario
from poststall_sim.simulation import Flight
from poststall_sim.state import Controls

DEG = math.radians(1.0)
STUCK, FLOATING, LOST, OFF = (Failure(kind) for kind in Kind)
SERVO = Actuator(rate_limit=2.0, natural_frequency=40.0, damping=0.8, dead_time=0.017)


@pytest.fixture(scope='module')
def started():
    return simulation.start(wings.shipped_aircraft('trainer'), airspeed=12.0, altitude=100.0)


@pytest.fixture
def flight(started):
    """Return the trainer in level trim."""
    return Flight.resumed(started.model, started.saved())


def with_servos(started, actuator=SERVO):
    """Return the same flight of an aircraft with actuators."""
    aircraft = started.model.aircraft
    controls = tuple(dataclasses.replace(each, actuator=actuator) for each in aircraft.controls)
    model = dataclasses.replace(
        started.model, aircraft=dataclasses.replace(aircraft, controls=controls))
    flight = Flight.resumed(model, started.saved())
    flight.reset(time_ns=0)
    return flight


def told(flight, **deflections):
    """Return trim with some deflections [deg] instead."""
    names = flight.model.aircraft.control_names
    values = dict(zip(names, flight.trim.deflections)) | {
        name: DEG * value for name, value in deflections.items()}
    return Controls(np.array([values[name] for name in names]), flight.trim.throttle)


def angles(snapshot, flight):
    """Return the parts' angles [deg] by name."""
    return {part.name: angle / DEG
            for part, angle in zip(flight.model.aircraft.movables, snapshot.angles)}


def shown(snapshot, flight):
    """Return the controls' deflections [deg] by name."""
    return dict(zip(flight.model.aircraft.control_names, snapshot.controls.deflections / DEG))


def test_aileron_that_sticks_on_one_side_leaves_half_of_the_roll(flight):
    """The right one stays, the left one goes down: half the moment, and half of it is shown."""
    sound = flight.step(told(flight, aileron=6.0))
    roll = sound.moment_B[0]
    flight.reset()
    flight.failures = {'aileron_right': STUCK}
    snapshot = flight.step(told(flight, aileron=6.0))
    found = angles(snapshot, flight)
    assert found['aileron_right'] == 0.0 and found['aileron_left'] == pytest.approx(6.0)
    assert shown(snapshot, flight)['aileron'] == pytest.approx(3.0)
    assert snapshot.commanded.deflections / DEG == pytest.approx(
        told(flight, aileron=6.0).deflections / DEG)
    # Each wing has its downwash on the other.
    assert snapshot.moment_B[0] == pytest.approx(0.5 * roll, rel=0.05) and roll > 0.0


def test_control_that_sticks_at_an_angle_is_there_and_shows_it(flight):
    """By a control's name it is the control's own deflection, whatever the parts' signs are."""
    flight.failures = {'elevator': Failure(Kind.STUCK, -5.0 * DEG),
                       'aileron': Failure(Kind.STUCK, 4.0 * DEG)}
    snapshot = flight.step(flight.trim)
    assert shown(snapshot, flight)['elevator'] == pytest.approx(-5.0)
    assert shown(snapshot, flight)['aileron'] == pytest.approx(4.0)
    assert angles(snapshot, flight)['aileron_right'] == pytest.approx(-4.0)
    assert np.array_equal(snapshot.commanded.deflections, flight.trim.deflections)
    # Repaired, it is where it is told at once.
    flight.failures = {}
    assert shown(flight.step(flight.trim), flight)['elevator'] == pytest.approx(
        flight.trim.deflections[flight.model.aircraft.control_names.index('elevator')] / DEG)


def test_elevator_that_sticks_in_the_middle_of_a_pull_stays_there(flight):
    flight.step(told(flight, elevator=-7.0))
    flight.failures = {'elevator': STUCK}
    for _ in range(3):
        snapshot = flight.step(told(flight, elevator=2.0))
    assert shown(snapshot, flight)['elevator'] == pytest.approx(-7.0)
    flight.reset()   # the failure is still there, and trim is where it sticks now
    assert flight.step(told(flight, elevator=2.0)).controls.deflections == pytest.approx(
        flight.trim.deflections)


def test_free_elevator_floats_with_the_flow_at_the_tail(flight):
    """-ratio times the tail's angle of attack a step before, within its travel."""
    machine = flight.model.aircraft
    index = next(k for k, part in enumerate(machine.movables)
                 if 'elevator' in part.name and part.side >= 0)
    part = machine.movables[index]
    flight.failures = {'elevator': FLOATING}
    for _ in range(20):
        before = flight.snapshot
        snapshot = flight.step(flight.trim)
    lattice = flight.model.lattice
    strips = np.flatnonzero(lattice.shift[index])
    width = lattice.strip_width[strips]
    alpha = before.strips.alpha[strips] @ width / width.sum()
    assert snapshot.angles[index] == pytest.approx(-floating_ratio(part.hinge) * alpha, rel=1e-9)
    assert part.travel[0] < snapshot.angles[index] < part.travel[1]
    # Nose up it goes trailing edge up: the smaller restoring moment of a free elevator.
    assert np.sign(snapshot.angles[index]) == -np.sign(alpha)


def test_lost_rudder_has_no_effect(flight):
    flight.failures = {'rudder': LOST}
    kicked = flight.step(told(flight, rudder=15.0))
    flight.failures = {}
    flight.reset()
    still = flight.step(flight.trim)
    assert kicked.moment_B == pytest.approx(still.moment_B, rel=1e-12)
    assert kicked.commanded.deflections[-1] != kicked.controls.deflections[-1]


@pytest.mark.parametrize(('failures', 'message'), [
    ({'aileron_middle': STUCK}, "nothing is named 'aileron_middle' that could fail, there are"),
    ({'throttle': STUCK}, "nothing is named 'throttle'"),
    ({'aileron': STUCK, 'aileron_left': LOST}, 'aileron_left: aileron_left has failed already')])
def test_failures_of_nothing_or_twice_are_refused(flight, failures, message):
    with pytest.raises(ConfigError, match=message):
        flight.failures = failures
    assert not flight.failures
    with pytest.raises(ConfigError, match='float has no angle'):
        Failure(Kind.FLOATING, 0.1)


def test_elevon_fails_under_either_name(started):
    """Elevator and aileron on one part: what jams is the part."""
    half = {'surface': 'wing', 'span': (0.5, 1.0), 'hinge': 0.75}
    foil = wings.potential()
    wing = wings.panel_wing(foil, [(0, 0, 0), (0, 3, 0)], [1, 1], 4, symmetric=True)
    machine = wings.aircraft([wing], foil, area=6.0, chord=1.0, span=6.0, controls=(
        Control('elevator', (-0.3, 0.3), (Effector(**half),)),
        Control('aileron', (-0.3, 0.3), (Effector(**half, side=1, gain=-1.0),
                                         Effector(**half, side=-1)))))
    from poststall_sim import failures
    for name in ('elevator_left', 'aileron_left'):
        assert failures.of_parts(machine, {name: LOST}) == (None, LOST)


def test_actuators_are_between_command_and_surface(started):
    """Nothing within the dead time, then the closed form of a step that is held."""
    flight = with_servos(started)
    index = flight.model.aircraft.control_names.index('aileron')
    snapshots = [flight.step(told(flight, aileron=3.0)) for _ in range(30)]
    found = np.array([each.controls.deflections[index] for each in snapshots]) / DEG
    assert all(each.commanded.deflections[index] == 3.0 * DEG for each in snapshots)
    late = flight.dt_ns * 1e-9 * np.arange(1, 31) - SERVO.dead_time
    wave = 40.0 * math.sqrt(1.0 - 0.8 ** 2)
    expected = 3.0 * (1.0 - np.exp(-32.0 * late) * (
        np.cos(wave * late) + 32.0 / wave * np.sin(wave * late)))
    assert found == pytest.approx(np.where(late > 0.0, expected, 0.0), abs=1e-9)
    rates = np.array([each.control_rates.deflections[index] for each in snapshots]) / DEG
    assert rates[1:] == pytest.approx(np.diff(found) / (flight.dt_ns * 1e-9), abs=1e-6)


def test_flight_with_actuators_and_failures_goes_on_from_a_file_to_the_bit(started, tmp_path):
    flight = with_servos(started)
    flight.failures = {'aileron_right': STUCK, 'rudder': FLOATING,
                       'elevator': Failure(Kind.STUCK, -3.0 * DEG)}
    for _ in range(7):
        flight.step(told(flight, aileron=5.0))
    flight_file.save_state(flight, tmp_path / 'flight.npz')
    resumed = flight_file.load_state(flight.model, tmp_path / 'flight.npz')
    assert resumed.failures.keys() == {
        'aileron_right', 'rudder', *(part.name for part in flight.model.aircraft.movables
                                     if 'elevator' in part.name)}
    for _ in range(10):
        ours, theirs = (each.step(told(flight, aileron=-5.0)) for each in (flight, resumed))
        for key in ('force_B', 'angles', 'angle_rates'):
            assert np.array_equal(getattr(ours, key), getattr(theirs, key))
        assert np.array_equal(ours.controls.deflections, theirs.controls.deflections)
    with pytest.raises(ConfigError, match='written with another aircraft'):
        flight_file.load_state(started.model, tmp_path / 'flight.npz')


def test_scenario_fails_what_it_says_when_it_says(flight):
    dt = flight.dt_ns * 1e-9
    scenario = Scenario('faulty', 1.0, 12.0, 100.0, (
        Channel('elevator', ((0.0, 0.0), (1.0, -10.0 * DEG))),), faults=(
            Fault(8 * dt, 'elevator', LOST), Fault(4 * dt, 'elevator', STUCK)))
    jobs.require_controls(flight.model.aircraft, scenario)
    trim = shown(flight.snapshot, flight)['elevator']
    found = [shown(snapshot, flight)['elevator'] - trim
             for snapshot in jobs.fly(flight, scenario, 12 * dt)]
    told_then = -10.0 * dt * np.arange(1, 13)
    assert found[:4] == pytest.approx(told_then[:4])
    assert found[4:8] == pytest.approx([told_then[3]] * 4)
    assert found[8:] == pytest.approx([-trim] * 4)
    wrong = dataclasses.replace(scenario, faults=(Fault(0.0, 'flap', LOST),))
    with pytest.raises(ConfigError, match="scenario faulty: nothing is named 'flap'"):
        jobs.require_controls(flight.model.aircraft, wrong)


def test_scenario_turns_an_engine_off_when_it_says(started):
    """As `failed_engines` does from then on, and no other engine's name or failure will do."""
    dt = started.dt_ns * 1e-9
    scenario = Scenario('engine out', 1.0, 12.0, 100.0,
                        faults=(Fault(3 * dt, 'engine_1', OFF), Fault(5 * dt, 'rudder', LOST)))
    jobs.require_controls(started.model.aircraft, scenario)
    flight, other = (Flight.resumed(started.model, started.saved()) for _ in range(2))
    thrust = []
    for snapshot in jobs.fly(flight, scenario, 6 * dt):
        if len(thrust) == 3:
            other.failed_engines = frozenset({'engine_1'})
        thrust.append(float(snapshot.thrust_B[0]))
        assert np.array_equal(snapshot.thrust_B, other.step(other.trim).thrust_B)
    assert min(thrust[:3]) > 1.0 and thrust[3:] == [0.0] * 3
    assert flight.failed_engines == {'engine_1'} and set(flight.failures) == {'engine_1', 'rudder'}
    again = Flight.resumed(flight.model, flight.saved())
    assert again.failed_engines == {'engine_1'} and again.step(again.trim).thrust_B[0] == 0.0
    assert again.failures == flight.failures
    for each in (flight, again):
        each.failures = {}
        assert not each.failed_engines
    other = Flight.resumed(other.model, other.saved())
    assert not other.failures and other.failed_engines == {'engine_1'}
    for name, failure, said in (('engine_1', LOST, 'an engine: it fails as engine_1:off'),
                                ('rudder', OFF, "has no engine named 'rudder'")):
        wrong = dataclasses.replace(scenario, faults=(Fault(0.0, name, failure),))
        with pytest.raises(ConfigError, match=said):
            jobs.require_controls(flight.model.aircraft, wrong)
