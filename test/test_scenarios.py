# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""
Stalls, a wing drop, spins, a deep stall and a jammed aileron: what must happen in each.

The scenarios are those of config/scenarios, flown through the same function as `poststall fly`.
Numbers are those of a flight, rounded to what another integration of it would give as well.
"""

import dataclasses
import json
import math
from dataclasses import dataclass
from functools import cache

import numpy as np
import pytest

from poststall_sim import cli, definition, jobs, polar, simulation, trim
from poststall_sim.aero import model as models
from poststall_sim.frames import euler_from_quaternion, rotation
from poststall_sim.polar import Condition
from poststall_sim.scenario import Channel, Scenario
from poststall_sim.simulation import Flight, SavedFlight

NAMES = ('aileron_loss', 'deep_stall', 'spin', 'spin_incipient', 'stall_and_recovery',
         'stall_straight', 'wing_drop')
FLOWN_BY = {'deep_stall': 't_tail'}
SPUN = 13.9
"""When the spin is steady and not yet recovered from [s]."""
AIRSPEED = {'t_tail': 15.0, 'glider': 28.0, 'navion': 47.0, 'flying_wing': 14.0, 'canard': 15.0}


@dataclass(frozen=True, slots=True, eq=False)
class Flown:
    """
    A flight over time (k,): angles and rates in degrees, lengths in metres.

    rates (k, 3) : in B; roll, pitch; sink : velocity down [m/s]; turns about the vertical, to the
    right; left, right : stalled share of each half of the wing. saved : the flight at a time that
    was asked for, for another one to branch off.
    """

    time: np.ndarray
    alpha: np.ndarray
    beta: np.ndarray
    rates: np.ndarray
    roll: np.ndarray
    pitch: np.ndarray
    sink: np.ndarray
    altitude: np.ndarray
    turns: np.ndarray
    left: np.ndarray
    right: np.ndarray
    saved: SavedFlight | None

    def at(self, time):
        """Return the index of the first step at or after a time [s]."""
        return int(np.searchsorted(self.time, time - 1e-9))

    def over(self, start, end):
        """Return the steps between two times [s]."""
        return slice(self.at(start), self.at(end))

    @property
    def stalled(self):
        """The stalled share of the wing (k,)."""
        return 0.5 * (self.left + self.right)


def read(name):
    return definition.scenario(definition.find('scenarios', name))


@cache
def aircraft(name):
    return definition.aircraft(definition.find('aircraft', name))


def with_channels(scenario, duration, **points_deg):
    """Return a scenario cut to a duration [s] with other points in channels; None drops one."""
    channels = []
    for channel in scenario.channels:
        points = points_deg.get(channel.control, channel.points)
        if points is not None and points is not channel.points:
            points = tuple((time, math.radians(value)) for time, value in points)
        if points:
            channels.append(dataclasses.replace(channel, points=points))
    return dataclasses.replace(scenario, duration=duration, channels=tuple(channels))


def fly(scenario, name='trainer', save_at=None, branch=None):
    """Fly a scenario, from its start or on from a saved flight, and return its history."""
    if branch is None:
        flight = simulation.start(
            aircraft(name), airspeed=scenario.airspeed, altitude=scenario.altitude)
    else:
        flight = Flight.resumed(models.build(aircraft(name)), branch)
    saved = None
    wing = next(grid.strips for grid in flight.model.lattice.grids if grid.name == 'wing')
    rows, turned, dt = [], 0.0, flight.dt_ns * 1e-9
    for snapshot in jobs.fly(flight, scenario, scenario.duration):
        if save_at is not None and saved is None and snapshot.time >= save_at:
            saved = flight.saved()
        body = snapshot.body
        to_earth = rotation(body.q_NB)
        turned += (to_earth @ body.rates_B)[2] * dt
        roll, pitch, _ = euler_from_quaternion(body.q_NB)
        stalled = snapshot.strips.stalled[wing]
        half = stalled.size // 2
        rows.append((snapshot.time, *np.degrees([snapshot.alpha, snapshot.beta]),
                     *np.degrees(body.rates_B), *np.degrees([roll, pitch]),
                     (to_earth @ body.velocity_B)[2], body.altitude, turned / (2.0 * math.pi),
                     stalled[:half].mean(), stalled[half:].mean()))
    assert flight.paused_reason is None
    table = np.array(rows).T
    return Flown(*table[:3], table[3:6].T, *table[6:], saved)


@cache
def flown(name):
    return fly(read(name), FLOWN_BY.get(name, 'trainer'), save_at=SPUN)


def test_every_shipped_scenario_is_tested():
    assert tuple(definition.names('scenarios')) == NAMES


@pytest.mark.parametrize('name', NAMES)
def test_scenarios_move_what_their_aircraft_has_and_tell_their_own_name(name):
    scenario = read(name)
    model = models.build(aircraft(FLOWN_BY.get(name, 'trainer')))
    jobs.require_controls(model.aircraft, scenario)
    assert scenario.name == name


def test_a_straight_stall_keeps_its_wings_level_and_ends_with_the_stick():
    flight = flown('stall_straight')
    held = flight.over(7.5, 8.6)   # the elevator stands
    assert np.all(flight.alpha[held] > 18.0) and np.all(flight.stalled[held] >= 0.6)
    # Nothing excites the departure but rounding; it has a second and a half to grow.
    assert np.abs(flight.roll).max() < 0.5
    assert np.abs(flight.left - flight.right).mean() < 0.01
    assert np.all(flight.stalled[flight.at(9.1):] == 0.0)   # half a second after the stick
    assert flight.alpha[-1] < 8.0 and np.abs(flight.sink[-1]) < 2.0
    assert 5.0 < flight.altitude.max() - flight.altitude[flight.at(8.0):].min() < 20.0


def test_the_stall_break_sinks_and_lowers_the_nose():
    """Past greatest lift: alpha rises while the nose comes down and the flight path steepens."""
    flight = flown('stall_straight')
    broken = flight.over(5.5, 6.5)
    assert np.all(flight.rates[broken, 1] < 0.0)
    assert flight.alpha[broken][-1] > flight.alpha[broken][0]
    assert flight.sink[flight.at(7.5)] > flight.sink[flight.at(5.5)] + 2.0


def test_a_wing_drops_against_the_aileron_and_is_recovered():
    """Right aileron, left wing: past the stall the aileron that goes down stalls its wing."""
    flight = flown('wing_drop')
    assert np.all(flight.rates[flight.over(7.15, 8.4), 0] < 0.0)
    assert flight.roll[flight.at(8.4)] < -60.0
    assert flight.rates[flight.at(8.2), 2] < -40.0   # and the nose goes to the same side
    drop = flight.over(7.7, 8.4)
    assert np.all(flight.left[drop] == 1.0) and np.all(flight.right[drop] < 0.5)
    assert np.all(flight.stalled[flight.at(8.9):] == 0.0)
    assert np.abs(flight.roll[flight.at(10.5):]).max() < 5.0


def test_the_wing_drop_follows_the_sign_of_the_aileron():
    """The other way round the other wing drops: mirror images but for rounding, which grows."""
    scenario = read('wing_drop')
    other = fly(with_channels(
        scenario, 8.4, aileron=((7.0, 0.0), (7.1, -3.0), (7.5, -3.0), (7.6, 0.0))))
    flight = flown('wing_drop')
    same = slice(0, other.time.size)
    assert other.roll == pytest.approx(-flight.roll[same], abs=0.1)
    assert other.alpha == pytest.approx(flight.alpha[same], abs=0.1)
    assert np.abs(other.left - flight.right[same]).mean() < 0.01


def test_before_the_stall_the_same_aileron_rolls_the_way_it_is_meant_to():
    """At 12 m/s in trim, alpha 5 deg, right aileron rolls to the right."""
    scenario = with_channels(read('wing_drop'), 1.5, elevator=None, rudder=None, aileron=(
        (0.5, 0.0), (0.6, 3.0)))
    assert fly(scenario).rates[-1, 0] > 8.0


def test_a_spin_develops_and_is_steady():
    """Two turns from 9.5 to 14 s: rates, descent and alpha within a few per cent of each other."""
    flight = flown('spin')
    steady = flight.over(9.5, 14.0)
    roll_rate, _, yaw_rate = flight.rates[steady].T
    assert flight.turns[steady][0] - flight.turns[steady][-1] > 2.0   # to the left
    assert np.all(roll_rate < -120.0) and np.all(yaw_rate < -80.0)
    assert np.all(flight.alpha[steady] > 25.0) and np.all(flight.alpha[steady] < 35.0)
    assert np.all(flight.beta[steady] > 5.0)   # outward: wind from the right in a left spin
    assert np.all(flight.left[steady] == 1.0)
    assert np.all((flight.right[steady] > 0.3) & (flight.right[steady] < 0.8))
    last = flight.over(12.0, 14.0)
    for value in (flight.sink, flight.rates[:, 0], flight.rates[:, 2], flight.alpha):
        assert np.ptp(value[last]) < 0.05 * np.abs(value[last].mean())
    # The yaw rate about the vertical: a turn in about two seconds.
    turning = (flight.turns[last][-1] - flight.turns[last][0]) / 2.0
    assert -0.6 < turning < -0.4


def test_the_spin_is_incipient_for_a_turn_and_a_half():
    """Until it is steady: the rates grow, and alpha comes down from the pull-up."""
    flight = flown('spin')
    first = flight.over(5.0, 7.0)
    assert flight.rates[first][-1, 0] < -100.0 < flight.rates[first][0, 0]
    assert -0.7 < flight.turns[flight.at(7.0)] < -0.2
    late = flight.rates[flight.over(12.0, 14.0), 0].mean()
    early = flight.rates[flight.over(6.0, 7.0), 0].mean()
    assert abs(early) < 0.9 * abs(late)


def test_an_incipient_spin_ends_when_everything_is_let_go():
    flight = flown('spin_incipient')
    inputs, out = flight.at(7.0), flight.at(7.5)
    assert flight.rates[inputs, 0] < -100.0 and flight.left[inputs] == 1.0
    assert abs(flight.turns[out] - flight.turns[inputs]) < 0.2
    assert np.all(flight.stalled[out:] == 0.0)
    assert np.abs(flight.rates[flight.at(8.6):, [0, 2]]).max() < 15.0
    assert flight.altitude[inputs] - flight.altitude[inputs:].min() < 50.0


def test_opposite_rudder_and_stick_forward_end_the_spin_within_half_a_turn():
    flight = flown('spin')
    inputs, out = flight.at(14.0), flight.at(14.9)   # 0.3 s after the stick
    assert abs(flight.turns[out] - flight.turns[inputs]) < 0.5
    assert np.all(flight.stalled[out:] == 0.0)
    assert np.abs(flight.rates[flight.at(15.8):, [0, 2]]).max() < 30.0
    # The dive is pulled out: level again, for less than 60 m in all.
    assert flight.altitude[inputs] - flight.altitude[inputs:].min() < 60.0
    assert np.abs(flight.roll[flight.at(17.0):]).max() < 20.0 and flight.sink[-1] < 0.0


def test_the_rudder_alone_does_not_end_the_spin_but_the_stick_does():
    """With the elevator held up the wing goes on autorotating, at a smaller alpha."""
    scenario, end = read('spin'), 16.5
    spun = flown('spin').saved
    up = fly(with_channels(scenario, end, aileron=None,
                           elevator=((2.0, -0.1), (5.0, -30.0))), branch=spun)
    late = up.over(15.5, end)
    assert np.all(up.rates[late, 0] < -60.0) and np.all(up.rates[late, 2] < -40.0)
    assert np.all(up.alpha[late] > 18.0) and np.all(up.left[late] == 1.0)
    held = fly(with_channels(scenario, end, aileron=None,
                             rudder=((4.8, 0.0), (5.0, 25.0))), branch=spun)
    assert np.all(held.stalled[held.at(15.0):] == 0.0)
    assert np.all(held.beta[held.over(15.0, end)] > 10.0)   # what the rudder still holds


def held_into_a_spin(name, duration, recovered_from):
    """Return a flight with full up elevator and left rudder, recovered at a time [s]."""
    limits = {each.name: each.limits for each in aircraft(name).controls}
    up, left = limits['elevator'][0], limits['rudder'][1]
    end, down = recovered_from, math.radians(2.0)
    channels = [
        Channel('elevator', ((2.0, 0.0), (5.0, up), (end + 0.5, up), (end + 1.0, down)), False),
        Channel('rudder', ((4.8, 0.0), (5.1, left), (end, left), (end + 0.3, -left),
                           (end + 1.3, -left), (end + 1.5, 0.0)), False)]
    if aircraft(name).engines:
        channels.append(Channel('throttle', ((1.0, 0.2), (2.0, 0.0)), False))
    return fly(Scenario('held', duration, 0.85 * AIRSPEED[name], 1500.0, tuple(channels)), name)


@pytest.mark.parametrize('name, duration, alpha', [
    ('stall_straight', 12.0, 20.0), ('spin', 9.0, 35.0)])
def test_a_glider_flies_the_scenarios_without_the_throttle_that_it_has_not(
        name, duration, alpha, tmp_path, capsys):
    """On few panels: nine tenths of its wing stall, and after the straight stall it flies."""
    path = tmp_path / 'flight.json'
    assert cli.main(['fly', '--aircraft', 'glider', '--scenario', name, '--airspeed', '28',
                     '--altitude', '1000', '--panels', '2', '--duration', str(duration),
                     '--json', str(path)]) == 0
    assert f'glider has no engine: the throttle of {name} is left out' in capsys.readouterr().err
    summary = json.loads(path.read_text())['summary']
    deepest, strips = summary['deepest_stall'], summary['wing_strips']
    assert deepest['stalled_wing_strips'] > 0.9 * strips
    assert alpha < deepest['alpha_deg'] < alpha + 10.0
    assert (summary['stalled_strips_at_end'] == 0) == (name == 'stall_straight')


def test_a_canard_does_not_spin_because_its_wing_does_not_stall():
    """The inputs of a spin: the foreplane stalls, and the rudder makes a spiral of it."""
    flight = held_into_a_spin('canard', 9.0, 20.0)
    assert np.all(flight.stalled == 0.0) and flight.alpha.max() < 15.0
    assert flight.turns[-1] < -0.3


@pytest.mark.soak
@pytest.mark.parametrize('name, deepest, most_stalled', [
    ('t_tail', 25.0, 1.0), ('glider', 30.0, 1.0), ('navion', 20.0, 0.9),
    ('flying_wing', 20.0, 0.6)])
def test_others_held_into_a_spin_come_out_by_the_same_recovery(name, deepest, most_stalled):
    """Those that spin stall their inner half to the tip; the flying wing's tips never stall."""
    flight = held_into_a_spin(name, 19.0, 15.5)
    late = flight.over(13.0, 15.5)
    assert flight.alpha[late].mean() > deepest - 2.0
    assert flight.turns[late][-1] < flight.turns[late][0] - 0.2   # to the left
    assert flight.left[late].max() >= most_stalled if most_stalled > 0.8 \
        else flight.left[late].max() <= most_stalled
    assert np.all(flight.stalled[flight.at(17.5):] == 0.0)


def test_the_t_tail_is_not_locked_in_its_deep_stall():
    """Its elevator ends a stall from tip to tip, in which the wake stood over the tail."""
    flight = flown('deep_stall')
    deep = flight.over(3.0, 4.3)
    assert np.all(flight.stalled[deep] > 0.95) and np.all(flight.alpha[deep] > 24.0)
    assert flight.alpha.max() > 30.0
    assert np.all(flight.stalled[flight.at(5.4):flight.at(9.0)] == 0.0)
    assert np.abs(flight.roll).max() < 1.0


def lowered(aircraft):
    """Return the T-tail aircraft with its tail where the trainer has it, and no rudder."""
    wing, tail, _ = aircraft.surfaces
    sections = tuple(dataclasses.replace(
        each, leading_edge_G=(*each.leading_edge_G[:2], -0.12)) for each in tail.sections)
    return dataclasses.replace(
        aircraft, surfaces=(wing, dataclasses.replace(tail, sections=sections)),
        controls=tuple(each for each in aircraft.controls if each.name != 'rudder'))


def centre_of_pressure(model, degrees):
    """Return where the normal force attacks with the elevator fully down, x in metres."""
    deflections = np.array([each.limits[1] if each.name == trim.PITCH_CONTROL else 0.0
                            for each in model.aircraft.controls])
    alpha, reference = math.radians(degrees), model.aircraft.reference
    found = polar.point(model, Condition(alpha, deflections=deflections), airspeed=12.0,
                        density=1.2).coefficients
    normal = found.CL * math.cos(alpha) + found.CD * math.sin(alpha)
    return model.aircraft.mass.cg_G[0] - reference.chord * found.Cm / normal


def test_why_there_is_no_locked_deep_stall():
    """
    With the elevator down the normal force attacks far behind any centre of gravity to fly with.

    A locked stall needs it ahead. Past the stall the wing's own force moves back to 0.44 of its
    chord; the tail's share is not taken by the wake, which costs the T-tail less than 0.02 m
    against the low tail at all angles. The neutral point is at x = 0.1725 m.
    """
    t_tail = aircraft('t_tail')
    high, low = models.build(t_tail), models.build(lowered(t_tail))
    for degrees in (30.0, 40.0, 50.0):
        there = centre_of_pressure(high, degrees)
        assert 0.27 < there < 0.31
        assert centre_of_pressure(low, degrees) - there == pytest.approx(0.0, abs=0.02)


def test_one_aileron_holds_the_wings_level_that_the_other_has_jammed():
    flight = flown('aileron_loss')
    assert flight.roll[flight.at(4.5)] > 20.0   # before the pilot does anything
    late = flight.over(7.0, 14.0)
    assert np.abs(flight.roll[late]).max() < 10.0
    assert flight.altitude[late] == pytest.approx(297.0, abs=6.0)
    assert np.abs(flight.beta[late]).max() < 2.0   # the rudder is not needed


def test_untouched_the_jammed_aileron_rolls_the_aircraft_over():
    alone = fly(with_channels(read('aileron_loss'), 9.0, aileron=None))
    assert alone.roll[-1] > 60.0 and alone.sink[-1] > 8.0
    assert np.all(alone.rates[alone.over(3.3, 9.0), 0] > 0.0)   # to the right, throughout
