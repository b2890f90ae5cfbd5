# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""Steady turns with the wake that they leave: its helix, its loads, and that flights stay."""

import json
import math
from dataclasses import replace

import numpy as np
import pytest

from poststall_sim import cli, definition, flight_file, manoeuvre, simulation, trim, turning
from poststall_sim.aero import model as models
from poststall_sim.aero import solver, steady_motion
from poststall_sim.aero.model import Settings
from poststall_sim.coupling import placement
from poststall_sim.failures import Failure, Kind
from poststall_sim.frames import GRAVITY, euler_from_quaternion, rotation
from poststall_sim.manoeuvre import Task
from poststall_sim.state import BodyState, Status
from poststall_sim.weather import Weather

ALTITUDE = 150.0
TURN = math.radians(20.0)
DT_NS = 12_000_000
FEW = ('--panels', '2', '--strips', 'wing=8', '--strips', 'tail=4', '--strips', 'fin=2')


def trainer():
    return definition.aircraft(definition.find('aircraft', 'trainer'))


@pytest.fixture(scope='module')
def whole():
    return models.build(trainer())


@pytest.fixture(scope='module')
def few():
    surfaces = tuple(replace(surface, strips=strips)
                     for surface, strips in zip(trainer().surfaces, (8, 4, 2)))
    return models.build(replace(trainer(), surfaces=surfaces), Settings(chordwise=2))


def found_by(search, model, **asked):
    found = search.steady(model, Task(**asked), altitude=ALTITUDE)
    assert found.status is Status.CONVERGED, found.message
    assert np.abs(found.residual).max() <= trim.ACCEPTED
    return found


@pytest.fixture(scope='module')
def turn(few):
    return found_by(turning, few, airspeed=15.0, turn_rate=TURN, coordinated=True)


def body_of(found):
    return BodyState(np.array([0.0, 0.0, -ALTITUDE]), found.velocity_B, found.rates_B, found.q_NB)


def begun(model, found, dt_ns=None, **wake):
    dt_ns = simulation.automatic_dt_ns(model, found.airspeed) if dt_ns is None else dt_ns
    return simulation.Flight(model, body_of(found), found.controls, dt_ns=dt_ns,
                             delta0=found.aero.strips.delta, **{'turning': found.turning, **wake})


def unbalanced(flight, found):
    """Return what accelerates a flight beyond its turn, in g and in 1/s^2."""
    turned = np.cross(found.rates_B, found.velocity_B)
    return np.abs(flight.snapshot.acceleration_B - turned).max() / GRAVITY, \
        np.abs(flight.snapshot.rate_change_B).max()


def marched(model, found, **onset):
    air = model.atmosphere.at(ALTITUDE)
    met = replace(trim.onset_of(model, found, air.density), **onset)
    return met, air.density, steady_motion.march(
        trim.tight(model), met, placement(model.aircraft, body_of(found)),
        found.controls.deflections, density=air.density, dt=DT_NS * 1e-9,
        delta0=found.aero.strips.delta)


def test_wake_lies_on_the_helix_of_a_climbing_turn(few):
    """All rows of a node at one distance from the axis, a rate times dt and a climb apart."""
    climb = math.radians(5.0)
    found = found_by(manoeuvre, few, airspeed=15.0, turn_rate=TURN, climb_angle=climb)
    _, _, (flow, _) = marched(few, found)
    velocity = rotation(found.q_NB) @ found.velocity_B
    axis = np.cross([0.0, 0.0, 1.0], velocity) / TURN   # from the aircraft, which is at 0, 0
    nodes = flow.wake.nodes_N[:, :, :2] - axis[:2]
    distance = np.linalg.norm(nodes, axis=2)
    assert distance == pytest.approx(np.broadcast_to(distance[0], distance.shape), abs=1e-9)
    assert np.linalg.norm(axis) == pytest.approx(15.0 * math.cos(climb) / TURN)
    angle = np.unwrap(np.arctan2(nodes[:, :, 1], nodes[:, :, 0]), axis=0)
    assert np.diff(angle, axis=0) == pytest.approx(-TURN * DT_NS * 1e-9, abs=1e-9)
    step = 15.0 * math.sin(climb) * DT_NS * 1e-9
    assert np.diff(flow.wake.nodes_N[:, :, 2], axis=0) == pytest.approx(step, abs=1e-9)
    assert flow.wake.nodes_N[0] == pytest.approx(
        placement(few.aircraft, body_of(found)).to_inertial(few.lattice.wake_nodes), abs=1e-12)


def test_without_rates_the_march_has_the_loads_of_the_straight_wake(few, turn):
    """To 1e-6 of them: what the two ways of computing a wake's velocity differ by."""
    onset, density, (_, aero) = marched(few, turn, rates_G=np.zeros(3))
    straight = solver.steady(trim.tight(few), onset, turn.controls.deflections, density=density)
    assert aero.force_G == pytest.approx(straight.force_G, abs=1e-6 * abs(straight.force_G[2]))
    assert aero.moment_G == pytest.approx(straight.moment_G, abs=1e-6 * abs(straight.force_G[2]))


def test_march_is_long_enough_for_the_loads_to_settle(few, turn, monkeypatch):
    """After twice the length they differ by less than a third of what a trim may leave."""
    _, _, (_, once) = marched(few, turn)
    monkeypatch.setattr(steady_motion, 'LENGTHS', 2 * steady_motion.LENGTHS)
    _, _, (_, twice) = marched(few, turn)
    least = trim.ACCEPTED * few.aircraft.mass.mass * GRAVITY
    assert once.force_G == pytest.approx(twice.force_G, abs=0.3 * least)
    assert once.moment_G == pytest.approx(
        twice.moment_G, abs=0.3 * least * few.aircraft.reference.chord)


def test_straight_flight_is_what_straight_wakes_find_to_the_bit(few):
    for asked in ({'airspeed': 15.0}, {'airspeed': 15.0, 'beta': math.radians(5.0)}):
        same, found = (found_by(search, few, **asked) for search in (manoeuvre, turning))
        assert not found.turning and found.message == 'trimmed'
        assert np.array_equal(found.residual, same.residual)
        assert np.array_equal(found.aero.force_G, same.aero.force_G)
        assert np.array_equal(found.controls.deflections, same.controls.deflections)


def test_steady_loads_have_no_wake_that_could_curve(few):
    quasi_steady = replace(few, settings=replace(few.settings, unsteady=False))
    found = found_by(turning, quasi_steady, airspeed=15.0, turn_rate=TURN)
    assert not found.turning and found.message == 'trimmed'


def test_a_turn_to_the_left_is_that_to_the_right_in_a_mirror(few, turn):
    left = found_by(turning, few, airspeed=15.0, turn_rate=-TURN, coordinated=True)
    assert (left.bank, left.beta) == pytest.approx((-turn.bank, -turn.beta), abs=1e-6)
    assert (left.alpha, left.controls.throttle) == pytest.approx(
        (turn.alpha, turn.controls.throttle), abs=1e-6)


MANOEUVRES = {
    'neutral turn': {'airspeed': 15.0, 'turn_rate': math.radians(10.0), 'coordinated': True},
    'near the stall': {'airspeed': 9.5, 'turn_rate': TURN, 'coordinated': True},
    'slipping climb': {'airspeed': 15.0, 'turn_rate': -TURN, 'beta': math.radians(5.0),
                       'climb_angle': math.radians(2.0)},
    'pull-up': {'airspeed': 18.0, 'pull_rate': 0.5}}


@pytest.mark.parametrize('name', MANOEUVRES)
def test_nothing_but_the_turn_itself_accelerates_a_flight_that_begins(few, name):
    """
    To 1e-6 of g, as the trim asks; 1e-6 of m g c is 3e-5/s^2 about the roll axis.

    With straight wakes in the trim it is more than a hundred times as much.
    """
    found = found_by(turning, few, **MANOEUVRES[name])
    assert found.turning and found.message == 'trimmed with the wake of the turn'
    force, moment = unbalanced(begun(few, found), found)
    assert force <= 1e-6 and moment <= 3e-5
    straight = found_by(manoeuvre, few, **MANOEUVRES[name])
    force, moment = unbalanced(begun(few, straight, turning=True), straight)
    assert max(force / 1e-6, moment / 3e-5) > 100.0


def stays(flight, found, seconds):
    """Hold a flight to what a trim promises: 0.1 m/s and 0.1 deg."""
    while flight.snapshot.time < seconds:
        now = flight.step(found.controls)
        # Through the air; the wind of these tests is level and steady.
        bank, _, _ = euler_from_quaternion(now.body.q_NB)
        assert now.airspeed == pytest.approx(found.airspeed, abs=0.1)
        assert (now.alpha, now.beta, bank) == pytest.approx(
            (found.alpha, found.beta, found.bank), abs=math.radians(0.1))
    assert now.body.altitude == pytest.approx(ALTITUDE, abs=0.1)


def test_a_turn_stays_on_its_trim_for_twenty_seconds(whole):
    """Measured: 2e-5 m/s and 1e-4 deg; with straight wakes in the trim 0.4 m/s and 1.9 deg."""
    found = turning.steady(whole, Task(airspeed=15.0, turn_rate=TURN, coordinated=True),
                           altitude=ALTITUDE, dt_ns=DT_NS)
    stays(begun(whole, found, DT_NS), found, 20.0)


@pytest.mark.soak
@pytest.mark.parametrize('rate', [10.0, 20.0, 40.0])
def test_a_turn_stays_on_its_trim_for_a_minute(whole, rate):
    """At 10 deg/s hardly anything holds the bank: it stays as long as nothing disturbs it."""
    found = found_by(turning, whole, airspeed=15.0, turn_rate=math.radians(rate),
                     coordinated=True)
    stays(begun(whole, found), found, 60.0)


def test_a_turn_in_wind_stays_too(few, turn):
    """Wake and body are carried alike."""
    wind = Weather(wind_N=np.array([4.0, -3.0, 0.0]))
    body = body_of(turn)
    body = replace(body, velocity_B=body.velocity_B
                   + rotation(body.q_NB).T @ wind.mean_N(ALTITUDE))
    flight = simulation.Flight(
        few, body, turn.controls, dt_ns=simulation.automatic_dt_ns(few, 15.0), weather=wind,
        delta0=turn.aero.strips.delta, turning=True)
    stays(flight, turn, 5.0)


def test_reset_and_a_saved_flight_begin_with_the_wake_of_the_turn_again(few, turn, tmp_path):
    flight = begun(few, turn)
    first = flight.state
    for _ in range(3):
        flight.step(turn.controls)
    flight_file.save_state(flight, tmp_path / 'turn.npz')
    resumed = flight_file.load_state(few, tmp_path / 'turn.npz')
    for each in (flight, resumed):
        each.reset(time_ns=0)
        assert np.array_equal(each.state.load, first.load)
        assert np.array_equal(each.state.flow.wake.nodes_N, first.flow.wake.nodes_N)
        assert np.array_equal(each.state.flow.wake.circulation, first.flow.wake.circulation)


def test_a_balance_that_is_not_found_in_time_is_said(few, monkeypatch):
    monkeypatch.setattr(turning, 'ROUNDS', 1)
    found = turning.steady(few, Task(airspeed=15.0, turn_rate=TURN), altitude=ALTITUDE)
    assert found.status is Status.NOT_CONVERGED
    assert found.message.startswith('no balance found with the wake of the turn, residual ')
    assert np.abs(found.residual).max() > 1e-3


def test_command_line_says_whose_wake_it_was(tmp_path, capsys):
    path = tmp_path / 'trim.json'
    wakes = {}
    for words in (('--turn', '20', '--coordinated'), ('--pull-up', '2'), ('--sideslip', '5')):
        assert cli.main(['trim', *FEW, '--airspeed', '15', *words, '--json', str(path)]) == 0
        row, = json.loads(path.read_text())['trims']
        assert row['residual'] <= trim.ACCEPTED
        assert ('wake of the turn' in capsys.readouterr().out) is (row['wake'] == 'of the turn')
        wakes[words[0]] = row['wake']
    assert wakes == {'--turn': 'of the turn', '--pull-up': 'of the turn', '--sideslip': 'straight'}


def test_a_turn_with_a_jammed_aileron_is_trimmed_with_it(few):
    failed = {'aileron_right': Failure(Kind.STUCK, math.radians(5.0))}
    found = found_by(turning, few, airspeed=13.0, turn_rate=TURN, failures=failed)
    flight = simulation.trimmed(few, found, altitude=ALTITUDE, broken=failed)
    assert unbalanced(flight, found)[0] < 1e-5


def test_a_flight_begins_in_a_trim_of_the_command_line(tmp_path, capsys):
    """And stays in its turn, with an aileron jammed and nothing touched."""
    hold, saved, flown = (tmp_path / name for name in ('hold.yaml', 'turn.npz', 'flown.json'))
    hold.write_text('name: hold\nduration_s: 3.0\n'
                    'initial: {airspeed_m_s: 20.0, altitude_m: 20.0}\nchannels: {}\n')
    trim_it = ['trim', *FEW, '--airspeed', '15', '--bank', '40', '--coordinated',
               '--fail', 'aileron_right:stuck=2', '--altitude', '300', '--save', str(saved)]
    assert cli.main(trim_it) == 0
    row = capsys.readouterr().out.splitlines()
    assert row[-1] == f'saved {saved}: a flight in this trim, in steps of 13 ms'
    assert cli.main(['fly', *FEW, '--resume', str(saved), '--scenario', str(hold),
                     '--json', str(flown)]) == 0
    summary, series = (json.loads(flown.read_text())[key] for key in ('summary', 'series'))
    assert summary['steps'] == 231 and summary['altitude_lost_m'] == pytest.approx(0.0, abs=0.05)
    assert summary['failed'] == ['aileron_right:stuck=2']
    assert series['roll_deg'] and np.allclose(series['roll_deg'], 40.0, atol=0.1)


@pytest.mark.parametrize('words, said', [
    (['--airspeed', '15'], '--save at an altitude of 0 m'),
    (['--airspeed', '14:15:1', '--altitude', '9'], '--save is of one flight'),
    (['--airspeed', '15', '--alpha', '4', '--altitude', '9'], '--save is of one flight'),
    (['--airspeed', '15', '--all', '--altitude', '9'], '--save is of one flight')])
def test_a_flight_that_cannot_begin_is_refused_before_it_is_trimmed(tmp_path, capsys, words, said):
    assert cli.main(['trim', *words, '--save', str(tmp_path / 'turn.npz')]) == 2
    assert said in capsys.readouterr().err
    assert not (tmp_path / 'turn.npz').exists()
