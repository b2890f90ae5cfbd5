# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""Steady flight of any kind: held to Newton's laws as the simulation has them, and to flight."""

import json
import math
from dataclasses import replace

import numpy as np
import propellers
import pytest

from poststall_sim import (
    cli,
    definition,
    manoeuvre,
    propulsion,
    simulation,
    trim,
    trim_jobs,
)
from poststall_sim.aero import model as models
from poststall_sim.aero.model import Settings
from poststall_sim.aircraft import ConfigError
from poststall_sim.failures import Failure, Kind
from poststall_sim.frames import GRAVITY, euler_from_quaternion, quaternion_rate, rotation
from poststall_sim.manoeuvre import Task
from poststall_sim.state import BodyState, Status

ALTITUDE = 150.0
FEW = ('--panels', '2', '--strips', 'wing=8', '--strips', 'tail=4', '--strips', 'fin=2')
TURN = math.radians(20.0)


def trainer():
    return definition.aircraft(definition.find('aircraft', 'trainer'))


@pytest.fixture(scope='module')
def model():
    """Return the trainer on few panels; quasi-steady, so that a turn's wake is that of a trim."""
    surfaces = tuple(replace(surface, strips=strips)
                     for surface, strips in zip(trainer().surfaces, (8, 4, 2)))
    return models.build(replace(trainer(), surfaces=surfaces),
                        Settings(chordwise=2, unsteady=False, tolerance=1e-9))


def steady(model, **asked):
    found = manoeuvre.steady(model, Task(**asked), altitude=ALTITUDE)
    assert found.status is Status.CONVERGED, found.message
    assert found.message == 'trimmed' and np.abs(found.residual).max() <= trim.ACCEPTED
    return found


def begun(model, found, dt_ns=10_000_000):
    """Return a flight that begins as it was trimmed."""
    body = BodyState(np.array([0.0, 0.0, -ALTITUDE]), found.velocity_B, found.rates_B, found.q_NB)
    return simulation.Flight(model, body, found.controls, dt_ns=dt_ns,
                             delta0=found.aero.strips.delta)


def deflection(model, found, name):
    return math.degrees(found.controls.deflections[model.aircraft.control_names.index(name)])


MANOEUVRES = {
    'level': {'airspeed': 15.0},
    'climb': {'airspeed': 13.0, 'climb_angle': math.radians(6.0)},
    'full throttle': {'alpha': math.radians(5.0), 'climb_angle': None, 'throttle': 1.0},
    'glide past the stall': {'alpha': math.radians(21.0), 'climb_angle': None, 'throttle': 0.0},
    'turn': {'airspeed': 15.0, 'turn_rate': TURN},
    'coordinated descent': {'airspeed': 15.0, 'bank': math.radians(-45.0), 'turn_rate': None,
                            'climb_angle': math.radians(-3.0), 'coordinated': True},
    'sideslip': {'airspeed': 15.0, 'beta': math.radians(8.0)},
    'pull-up': {'airspeed': 18.0, 'pull_rate': 0.5},
    'stuck rudder': {'airspeed': 15.0, 'held': {'rudder': math.radians(5.0)}},
    'stuck elevator': {'held': {'elevator': math.radians(-3.0)}}}


@pytest.mark.parametrize('name', MANOEUVRES)
def test_nothing_but_the_turn_itself_accelerates_the_aircraft(model, name):
    """Newton's and Euler's laws, as the simulation has them: to 1e-5 of g, the trim asks 1e-6."""
    found = steady(model, **MANOEUVRES[name])
    snapshot = begun(model, found).snapshot
    turning = np.cross(found.rates_B, found.velocity_B)
    assert snapshot.acceleration_B == pytest.approx(turning, abs=1e-5 * GRAVITY)
    assert snapshot.rate_change_B == pytest.approx(np.zeros(3), abs=1e-4)
    climbing = -(rotation(found.q_NB) @ found.velocity_B)[2] / found.airspeed
    assert climbing == pytest.approx(math.sin(found.climb_angle), abs=1e-12)


def test_attitude_of_a_turn_stays_but_for_the_heading(model):
    found = steady(model, airspeed=15.0, turn_rate=TURN)
    later = found.q_NB + 1e-4 * quaternion_rate(found.q_NB, found.rates_B)
    roll, pitch, yaw = euler_from_quaternion(later / np.linalg.norm(later))
    first = euler_from_quaternion(found.q_NB)
    assert (roll, pitch) == pytest.approx(first[:2], abs=1e-8)
    assert yaw == pytest.approx(1e-4 * TURN, rel=1e-4)


def test_coordinated_turn_has_the_bank_and_the_load_factor_of_its_circle(model):
    """
    No side force is felt, so gravity and lift alone make the circle: tan(bank) = V rate/g.

    To 1 %: bank is of the body, whose y axis a sideslip of 1 deg turns out of the circle.
    """
    found = steady(model, airspeed=15.0, turn_rate=TURN, coordinated=True)
    assert math.tan(found.bank) == pytest.approx(15.0 * TURN / GRAVITY, rel=0.02)
    snapshot = begun(model, found).snapshot
    assert snapshot.specific_force_B[1] == pytest.approx(0.0, abs=1e-5 * GRAVITY)
    assert snapshot.load_factor == pytest.approx(1.0 / math.cos(found.bank), rel=0.01)
    other = steady(model, airspeed=15.0, turn_rate=-TURN, coordinated=True)
    assert other.bank == pytest.approx(-found.bank, abs=1e-6)
    assert other.alpha == pytest.approx(found.alpha, abs=1e-6)


def test_bank_given_finds_the_turn_that_has_it(model):
    turn = steady(model, airspeed=15.0, turn_rate=TURN)
    found = steady(model, airspeed=15.0, bank=turn.bank, turn_rate=None)
    assert found.turn_rate == pytest.approx(TURN, rel=1e-5)


def test_rudder_held_where_a_sideslip_needs_it_gives_that_sideslip(model):
    slipping = steady(model, airspeed=15.0, beta=math.radians(8.0))
    rudder = deflection(model, slipping, 'rudder')
    assert rudder > 1.0   # trailing edge left holds the nose left of a wind from the right
    assert deflection(model, slipping, 'aileron') > 0.5   # against the dihedral
    found = steady(model, airspeed=15.0, held={'rudder': math.radians(rudder)})
    assert math.degrees(found.beta) == pytest.approx(8.0, abs=1e-3)


def test_elevator_held_where_an_airspeed_needs_it_gives_that_airspeed(model):
    level = steady(model, airspeed=12.0)
    found = steady(model, held={'elevator': math.radians(deflection(model, level, 'elevator'))})
    assert found.airspeed == pytest.approx(12.0, abs=1e-3)


def test_symmetric_flight_is_that_of_three_balances_and_moves_nothing_sideways(model):
    for asked, same in (
            ({'airspeed': 15.0}, trim.straight(model, airspeed=15.0, altitude=ALTITUDE)),
            ({'alpha': 0.35, 'climb_angle': None, 'throttle': 0.0},
             trim.glide(model, alpha=0.35, altitude=ALTITUDE)),
            ({'alpha': 0.3}, trim.powered(model, alpha=0.3, altitude=ALTITUDE))):
        found = steady(model, **asked)
        assert (found.airspeed, found.alpha, found.climb_angle, found.controls.throttle) == \
            pytest.approx((same.airspeed, same.alpha, same.climb_angle, same.controls.throttle),
                          abs=1e-6)
        assert found.beta == found.bank == 0.0
        assert deflection(model, found, 'aileron') == deflection(model, found, 'rudder') == 0.0


def test_what_the_controls_do_not_reach_is_said_with_the_nearest_flight(model):
    task = Task(airspeed=15.0, beta=math.radians(33.0))
    found = manoeuvre.steady(model, task, altitude=ALTITUDE)
    assert found.status is Status.NOT_CONVERGED
    assert 'rudder 25 deg at the limit' in found.message and '(yawing)' in found.message
    assert np.abs(found.residual).max() > 0.01
    limits = dict(zip(model.aircraft.control_names, model.aircraft.controls))['rudder'].limits
    assert math.radians(deflection(model, found, 'rudder')) <= limits[1]


def test_too_many_and_too_few_unknowns_are_named(model):
    for asked, said in (
            ({}, 'here airspeed, alpha, throttle, elevator: give another'),
            ({'airspeed': 15.0, 'alpha': 0.1}, 'here throttle, elevator: leave another open'),
            ({'airspeed': 15.0, 'turn_rate': None}, 'here bank, turn_rate, aileron, rudder: give'),
            ({'airspeed': 15.0, 'held': {'flap': 0.1}}, "no control 'flap' to hold")):
        with pytest.raises(ConfigError, match=said):
            manoeuvre.steady(model, Task(**asked), altitude=ALTITUDE)


def test_an_airspeed_near_the_stall_has_two_trims_and_both_are_found(model):
    told = []
    low, high = manoeuvre.branches(
        model, airspeed=9.0, altitude=ALTITUDE, alphas=np.radians([10.0, 17.0, 22.0]),
        told=lambda: told.append(1))
    assert len(told) == 6
    for found, alpha in ((low, 13.0), (high, 20.0)):
        assert found.status is Status.CONVERGED and found.airspeed == pytest.approx(9.0, abs=1e-9)
        assert math.degrees(found.alpha) == pytest.approx(alpha, abs=1.5)
        straight = trim.straight(model, airspeed=9.0, altitude=ALTITUDE, alpha0=found.alpha)
        assert straight.alpha == pytest.approx(found.alpha, abs=1e-6)
    assert manoeuvre.branches(model, airspeed=7.0, altitude=ALTITUDE,
                              alphas=np.radians([5.0, 17.0])) == []


@pytest.mark.parametrize('airspeed, alphas, found', [
    (8.81, (14.0, 16.0, 18.0, 20.0), (16.95, 17.95)),    # no angle of the search is below it
    (9.5, (10.0, 12.0, 22.0, 24.0), (10.89, 23.54))])    # 1.06 of the throttle at 24 deg
def test_no_trim_is_missed_between_two_angles_of_the_search(airspeed, alphas, found):
    """
    Near the least airspeed the two trims of one interval; and one beside a limit.

    At 17 and at 18 deg level flight has 8.809 and 8.811 m/s, at 17.5 less: 8.81 is passed twice.
    """
    built = models.build(trainer())
    trims = manoeuvre.branches(built, airspeed=airspeed, altitude=0.0, alphas=np.radians(alphas))
    assert np.degrees([each.alpha for each in trims]) == pytest.approx(found, abs=0.01)
    for each in trims:
        assert each.status is Status.CONVERGED and 0.0 <= each.controls.throttle <= 1.0
        level = trim.powered(built, alpha=each.alpha, altitude=0.0)
        assert level.airspeed == pytest.approx(airspeed, abs=1e-6)


def only_from_above(alpha, before):
    """Return an airspeed, but for 20 deg on the way up."""
    return math.nan if alpha == 20.0 and not before >= 20.0 else 12.0 - 0.1 * alpha


def a_little_off(alpha, before):
    """Return an airspeed as much below from its own flow as it is above from another."""
    return 12.0 - 0.1 * alpha + (-1e-12 if before == alpha else 1e-12)


def broken_off(alpha, before):
    """Return the airspeed of a branch that ends at 19 deg, and of another that goes on."""
    return 11.0 if alpha < 19.0 else 9.0


@pytest.mark.parametrize('flown, airspeed, found', [
    (only_from_above, 10.1, [19.0]), (a_little_off, 10.2, [18.0]), (broken_off, 10.0, [])])
def test_branches_are_followed_where_they_are_and_no_further(
        model, monkeypatch, flown, airspeed, found):
    """Flights by formula of the angle and of that of the flow it starts from, both in deg."""
    level = trim.straight(model, airspeed=12.0, altitude=ALTITUDE)

    def powered(model, *, alpha, altitude, climb_angle, delta0):
        angle = round(math.degrees(alpha), 9)
        speed = flown(angle, -math.inf if delta0 is None else float(delta0[0]))
        strips = replace(level.aero.strips, delta=np.full(model.lattice.strips, angle))
        status = Status.NOT_CONVERGED if math.isnan(speed) else Status.CONVERGED
        return replace(level, alpha=alpha, airspeed=speed, status=status,
                       aero=replace(level.aero, status=status, strips=strips))

    monkeypatch.setattr(trim, 'powered', powered)
    alphas = np.radians([16.0, 18.0, 20.0, 22.0, 24.0])
    trims = manoeuvre.branches(model, airspeed=airspeed, altitude=ALTITUDE, alphas=alphas)
    assert np.degrees([each.alpha for each in trims]) == pytest.approx(found, abs=1e-6)


@pytest.mark.parametrize('arm, aileron, message', [
    (0.3, 7.0, 'trimmed'), (0.5, 8.0, '(forward), with rudder 25 deg at the limit')])
def test_a_search_does_not_end_where_the_propellers_answer_to_no_throttle(
        model, arm, aileron, message):
    """Air turns a motor's propeller with any small throttle: no change tells which way to go."""
    engines = tuple(propellers.propeller(
        name=name, position_G=(-0.1, side * arm, 0.0), diameter=0.35, slipstream=True, swirl=True)
        for name, side in (('left', -1.0), ('right', 1.0)))
    twin = models.build(replace(model.aircraft, engines=engines), model.settings)
    failed = frozenset({'right'})
    density = twin.atmosphere.at(0.0).density
    idle = propulsion.idle_throttle(twin.aircraft, 12.0, density, failed)
    assert 0.1 < idle < trim.first_throttle(twin, 12.0, density, failed)
    found = manoeuvre.steady(twin, Task(
        airspeed=12.0, held={'aileron': math.radians(aileron)}, failed=failed), altitude=0.0)
    assert found.message.endswith(message)
    assert found.controls.throttle > idle + 0.1


def stays(flight, found, seconds):
    while flight.snapshot.time < seconds:
        flight.step(found.controls)
        assert flight.snapshot.airspeed == pytest.approx(found.airspeed, abs=0.1)
        assert flight.snapshot.alpha == pytest.approx(found.alpha, abs=math.radians(0.1))


def test_a_minute_of_level_flight_stays_on_its_trim():
    """With its wake in the air; measured: 1e-3 m/s and 4e-4 deg."""
    unsteady = models.build(trainer())
    found = steady(unsteady, airspeed=15.0)
    stays(begun(unsteady, found, dt_ns=12_000_000), found, 60.0)


def test_a_turn_stays_on_its_trim_where_its_wake_is_straight(model):
    """As in the trim; for one that lies in the air see `test_turning`."""
    found = steady(model, airspeed=15.0, turn_rate=TURN, coordinated=True)
    stays(begun(model, found, dt_ns=20_000_000), found, 6.0)


@pytest.mark.parametrize('failed', [
    {'aileron_right': Failure(Kind.STUCK, math.radians(5.0))},
    {'elevator_left': Failure(Kind.LOST)}, {'rudder': Failure(Kind.STUCK, math.radians(3.0))}],
    ids=['jammed aileron', 'half an elevator', 'jammed rudder'])
def test_what_has_failed_is_trimmed_with_the_other_controls(model, failed):
    """The flight that has failed so stays: to 1e-5 of g, as any trim."""
    found = steady(model, airspeed=12.0, failures=failed)
    flight = begun(model, found)
    flight.failures = failed
    snapshot = flight.reset()
    assert np.degrees(snapshot.angles) == pytest.approx(np.degrees(found.angles), abs=1e-9)
    assert snapshot.acceleration_B == pytest.approx(np.zeros(3), abs=1e-5 * GRAVITY)
    assert snapshot.rate_change_B == pytest.approx(np.zeros(3), abs=1e-4)
    whole = steady(model, airspeed=12.0)
    assert np.abs(found.controls.deflections - whole.controls.deflections).max() > 1e-3


def test_a_part_that_floats_stands_where_the_flight_lets_it_float(model):
    failed = {'aileron_right': Failure(Kind.FLOATING)}
    found = steady(model, airspeed=12.0, failures=failed)
    right, left = found.angles[:2]
    assert right == pytest.approx(left, abs=1e-6)   # nothing else keeps it from rolling
    flight = begun(model, found)
    flight.failures = failed
    flight.reset()
    for _ in range(6):
        snapshot = flight.step(found.controls)
    assert snapshot.angles == pytest.approx(found.angles, abs=math.radians(0.02))


def test_a_dead_elevator_leaves_one_airspeed_and_shows_where_it_stands(model):
    jammed = {'elevator': Failure(Kind.STUCK, math.radians(-3.0))}
    found, held = steady(model, failures=jammed), steady(
        model, held={'elevator': math.radians(-3.0)})
    assert found.airspeed == pytest.approx(held.airspeed, rel=1e-9)
    assert deflection(model, found, 'elevator') == pytest.approx(-3.0)
    free = steady(model, failures={'elevator': Failure(Kind.FLOATING)})
    assert deflection(model, free, 'elevator') == pytest.approx(math.degrees(free.angles[-2]))
    for failed, held, said in (
            ({'rudder': Failure(Kind.STUCK)}, {}, 'rudder:stuck stays where it is'),
            (jammed, {'elevator': 0.0}, 'elevator has failed and is held: give one')):
        with pytest.raises(ConfigError, match=said):
            manoeuvre.steady(model, Task(failures=failed, held=held), altitude=ALTITUDE)


def test_dead_controls_of_the_same_parts_show_together_what_these_do(model):
    """Flaps that are differential ailerons too: the flap stands at 5 deg, the aileron at 0."""
    aileron, *others = model.aircraft.controls
    right, left = aileron.effectors
    wing = models.build(replace(model.aircraft, controls=(
        replace(aileron, effectors=(right, replace(left, gain=0.5 * left.gain))), *others,
        replace(aileron, name='flap', effectors=(
            replace(right, gain=1.0), replace(left, gain=1.0))))), model.settings)
    found = steady(wing, airspeed=12.0, failures={'flap': Failure(Kind.STUCK, math.radians(5.0))})
    assert np.degrees(found.angles[:2]) == pytest.approx([5.0, 5.0])
    assert deflection(wing, found, 'flap') == pytest.approx(5.0)
    assert deflection(wing, found, 'aileron') == pytest.approx(0.0, abs=1e-9)


def result(tmp_path, *words, code=0):
    path = tmp_path / 'trim.json'
    assert cli.main(['trim', *FEW, *words, '--json', str(path)]) == code
    return json.loads(path.read_text())['trims']


def test_command_line_asks_for_all_of_them(tmp_path, capsys, monkeypatch):
    monkeypatch.setattr(trim_jobs, 'SEARCHED', np.radians([9.0, 16.0]))
    turn, = result(tmp_path, '--airspeed', '15', '--turn', '20', '--coordinated')
    assert turn['turn_rate_deg_s'] == pytest.approx(20.0) and 25.0 < turn['bank_deg'] < 32.0
    banked, = result(tmp_path, '--airspeed', '15', '--bank', '-30')
    assert banked['turn_rate_deg_s'] < -15.0
    slipping, = result(tmp_path, '--airspeed', '15', '--sideslip', '5')
    assert slipping['beta_deg'] == pytest.approx(5.0) and slipping['turn_rate_deg_s'] == 0.0
    pulled, = result(tmp_path, '--airspeed', '15', '--pull-up', '2')
    assert math.radians(pulled['pull_rate_deg_s']) == pytest.approx(GRAVITY / 15.0)
    stuck, = result(tmp_path, '--hold', 'elevator=-3')
    assert stuck['controls']['elevator_deg'] == pytest.approx(-3.0)
    climbing, = result(tmp_path, '--alpha', '4', '--throttle', '1')
    assert climbing['climb_angle_deg'] > 5.0 and climbing['throttle'] == 1.0
    jammed, = result(tmp_path, '--airspeed', '12', '--fail', 'aileron_right:stuck=5')
    assert jammed['failed'] == ['aileron_right:stuck=5'] and jammed['trimmed']
    assert jammed['failed_parts'] == {'aileron_right_deg': pytest.approx(5.0)}
    assert jammed['controls']['aileron_deg'] > 4.0   # the left one goes down as well
    gliding, = result(tmp_path, '--airspeed', '12', '--fail', 'engine_1:off')
    assert gliding['throttle'] == 0.0 and gliding['climb_angle_deg'] < -2.0
    level = result(tmp_path, '--alpha', '4:20:8', '--climb', '0')
    assert [each['kind'] for each in level] == ['at alpha'] * 3
    assert all(each['sink_rate_m_s'] == pytest.approx(0.0, abs=1e-9) for each in level)
    both = result(tmp_path, '--airspeed', '9', '--all')
    assert [each['trimmed'] for each in both] == [True] and 9.0 < both[0]['alpha_deg'] < 16.0
    assert 'bank' not in capsys.readouterr().out.splitlines()[-3]


def test_a_stuck_elevator_at_a_given_airspeed_opens_the_climb_angle(tmp_path):
    """
    The moments leave it one angle of attack, the weight W cos(climb) then hardly an airspeed.

    What the thrust takes of the weight moves that a little: from level flight to half throttle.
    """
    level, = result(tmp_path, '--hold', 'elevator=-3')
    climbing, = result(tmp_path, '--hold', 'elevator=-3', '--throttle', '0.5')
    slow, fast = climbing['airspeed_m_s'], level['airspeed_m_s']
    middle, = result(tmp_path, '--hold', 'elevator=-3', '--airspeed', str(0.5 * (slow + fast)))
    assert middle['trimmed'] and middle['controls']['elevator_deg'] == pytest.approx(-3.0)
    assert 0.5 < middle['climb_angle_deg'] < climbing['climb_angle_deg'] - 0.5
    assert level['throttle'] < middle['throttle'] < 0.5
    beyond, = result(tmp_path, '--hold', 'elevator=-3', '--airspeed', '15', code=1)
    assert beyond['message'].endswith('leave both open to find them, or bank')


@pytest.mark.parametrize('words, said', [
    (['--airspeed', '15', '--all', '--turn', '5'], '--all is of straight flight'),
    (['--alpha', '4', '--pull-up', '2'], '--pull-up is of an airspeed'),
    (['--airspeed', '15', '--climb', '2', '--throttle', '1'], 'give one, the other is found'),
    (['--airspeed', '15', '--alpha', '4', '--turn', '5'], 'give one of them'),
    (['--airspeed', '15', '--hold', 'rudder=40'], 'rudder goes from -25 to 25 deg, got 40'),
    (['--airspeed', '15', '--hold', 'elevator=0', '--climb', '2'], 'leave another open'),
    (['--airspeed', '15', '--hold', 'aileron_right=5'], '--fail aileron_right:stuck=5'),
    (['--airspeed', '15', '--fail', 'engine_1:lost'], 'it fails as engine_1:off'),
    (['--airspeed', '15', '--fail', 'rudder:lost', '--fail', 'rudder:float'], 'fails twice'),
    (['--airspeed', '15', '--hold', 'throttle=1'], 'is --throttle X, 0 to 1')])
def test_options_that_do_not_go_together_are_refused(words, said, capsys):
    assert cli.main(['trim', *FEW, *words]) == 2
    assert said in capsys.readouterr().err
