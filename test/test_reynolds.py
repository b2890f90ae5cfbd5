# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""Several tables of a section: which one a strip flies, and that nothing jumps or is forgotten."""

import dataclasses
import math

import numpy as np
import pytest
import wings

from poststall_sim import definition, envelope, flight_file, jobs, manoeuvre, simulation, trim
from poststall_sim.aero import model as models
from poststall_sim.aero.polars import section_polar
from poststall_sim.aircraft import Airfoil, ConfigError
from poststall_sim.atmosphere import standard_air
from poststall_sim.frames import body_to_geometry, velocity_from_flow_angles
from poststall_sim.stability import flight as flight_modes
from poststall_sim.stability.motion import Decambering
from poststall_sim.state import Controls, Status

VISCOSITY = 1.5e-5
LOW, HIGH = 1e5, 1e6
NO_FLAPS = np.zeros(0)


def table(name, reynolds, stall_deg, camber_deg=-4.0):
    """Return a section by formula that stalls at an angle, as the table of a Reynolds number."""
    made = wings.stalling(zero_lift_deg=camber_deg, stall_deg=stall_deg)
    return dataclasses.replace(made, name=name, reynolds=reynolds)


def trainer(*tables):
    """Return the trainer with other tables for its wing."""
    machine = wings.shipped_aircraft('trainer')
    return dataclasses.replace(machine, airfoils=(
        *(dataclasses.replace(each, name='wing') for each in tables),
        *(each for each in machine.airfoils if each.name != 'wing')))


@pytest.fixture(scope='module')
def pair():
    """Return the tables of a section that stalls later at a higher Reynolds number."""
    return table('wing', LOW, 12.0), table('wing', HIGH, 16.0, camber_deg=-3.6)


@pytest.fixture(scope='module')
def tapered(pair):
    """Return the model of a wing whose chord falls from 1 m to 0.4 m, with both tables."""
    wing = wings.panel_wing(pair[0], [(0, 0, 0), (0.1, 3, 0)], [1.0, 0.4], 12, symmetric=True)
    machine = wings.aircraft([wing], pair[0], area=4.2, chord=0.7, span=6.0)
    return models.build(dataclasses.replace(machine, airfoils=pair))


def curves(model):
    """Return the curves (n, 3, 2, grid) of the strips."""
    return model.lattice.curves[model.lattice.polar_index]


def test_aircraft_of_single_tables_is_left_as_it_is():
    """No copy, no work: what has one table a section flies exactly what it flew before."""
    model = models.build(wings.shipped_aircraft('trainer'))
    assert model.at(9.0, VISCOSITY, np.zeros(3)) is model
    assert model.lattice.tables is None


def test_curves_are_linear_in_the_logarithm_of_the_reynolds_number_of_each_strip(tapered, pair):
    low, high = (section_polar(each) for each in pair)
    chord = tapered.lattice.strip_chord
    for airspeed in (5.0, 7.0, 9.0):
        flown = tapered.at(airspeed, VISCOSITY, NO_FLAPS)
        share = np.log(airspeed * chord / VISCOSITY / LOW) / math.log(HIGH / LOW)
        assert 0.0 < share.min() < share.max() - 0.3 < 0.7
        expected = (1.0 - share)[:, None, None, None] * low.curve \
            + share[:, None, None, None] * high.curve
        assert np.abs(curves(flown) - expected).max() < 1e-13
        zero_lift = (1.0 - share) * low.zero_lift + share * high.zero_lift
        assert np.abs(flown.lattice.zero_lift - zero_lift).max() < 1e-13


def test_beyond_the_tables_the_last_one_is_held(tapered, pair):
    for airspeed, polar in ((0.0, pair[0]), (1e-3, pair[0]), (1.0, pair[0]), (500.0, pair[1])):
        flown = tapered.at(airspeed, VISCOSITY, NO_FLAPS)
        assert np.abs(curves(flown) - section_polar(polar).curve).max() < 1e-13


def test_strips_beyond_their_tables_are_told_by_how_much(tapered):
    """Three times beyond is the edge: for the least chord if slow, for the greatest if fast."""
    lattice, air = tapered.lattice, standard_air(0.0)
    assert np.array_equal(lattice.reynolds_range, np.broadcast_to([LOW, HIGH], (12, 2)))
    slow = LOW / 3.0 * air.kinematic_viscosity / float(lattice.strip_chord.min())
    fast = 3.0 * HIGH * air.kinematic_viscosity / float(lattice.strip_chord.max())
    for airspeed in (1.01 * slow, 0.99 * fast, 0.0):
        assert envelope.reynolds(airspeed, air, lattice) == ()
    for airspeed in (0.5 * slow, 2.0 * fast):
        excess, = envelope.reynolds(airspeed, air, lattice)
        assert excess.beyond == pytest.approx(2.0)
        assert 'tables are of 1e+05 to 1e+06' in excess.text
    silent = models.build(wings.rectangular(4.0, 4)).lattice
    assert envelope.reynolds(1e-3, air, silent) == ()


def test_loads_follow_the_airspeed_without_a_jump(tapered):
    """
    Past the stall, where the tables differ most, through a node of the tables and within.

    Steps of 1e-3 in V change the force coefficients by less than 1e-3 each; two tables of which
    one was switched to would make a jump of some 0.1.
    """
    alpha = math.radians(16.0)
    for middle in (5.0, VISCOSITY * HIGH / float(tapered.lattice.strip_chord.max())):
        forces, delta0 = [], None
        for airspeed in middle * (1.0 + 1e-3 * np.arange(-3, 4)):
            result = wings.steady(tapered.at(airspeed, VISCOSITY, NO_FLAPS), airspeed, alpha,
                                  delta0=delta0)
            assert result.status is Status.CONVERGED
            delta0 = result.strips.delta
            forces.append(result.force_G / (0.5 * wings.DENSITY * airspeed ** 2 * 4.2))
        forces = np.array(forces)
        assert np.abs(np.diff(forces, axis=0)).max() < 1e-3
        assert np.abs(forces[-1] - forces[0]).max() > 1e-6


def test_more_reynolds_number_gives_more_lift_past_the_stall(tapered):
    def lift(airspeed):
        flown = tapered.at(airspeed, VISCOSITY, NO_FLAPS)
        result = wings.steady(flown, airspeed, math.radians(16.0))
        return result.force_G[2] / airspeed ** 2

    assert lift(2.0) < 0.97 * lift(6.0) < 0.95 * lift(20.0)


def test_strip_between_two_sections_has_both_at_its_own_reynolds_number(pair):
    """Root and tip of different sections, one of which has a single table."""
    tip = dataclasses.replace(wings.stalling(0.0, 14.0), name='tip')
    wing = wings.panel_wing(pair[0], [(0, 0, 0), (0, 3, 0)], [1.0, 1.0], 12, symmetric=True)
    machine = wings.aircraft([wing], pair[0], area=6.0, chord=1.0, span=6.0)
    wing = dataclasses.replace(wing, sections=(
        wing.sections[0], dataclasses.replace(wing.sections[1], airfoil='tip')))
    model = models.build(
        dataclasses.replace(machine, surfaces=(wing,), airfoils=(*pair, tip)))
    airspeed = 6.0
    share = math.log(airspeed / VISCOSITY / LOW) / math.log(HIGH / LOW)
    low, high, end = (section_polar(each).curve for each in (*pair, tip))
    root = (1.0 - share) * low + share * high
    flown = model.at(airspeed, VISCOSITY, NO_FLAPS)
    place = np.abs(flown.lattice.quarter_chord[:, 1]) / 3.0
    expected = (1.0 - place)[:, None, None, None] * root + place[:, None, None, None] * end
    assert np.abs(curves(flown) - expected).max() < 1e-13
    # Port and starboard alike, or symmetric flow would roll.
    assert np.abs(curves(flown) - curves(flown)[::-1]).max() < 1e-13


def test_two_alike_tables_fly_as_one():
    """Through trim, flight and linear system: all of them look at the same curves."""
    one = wings.shipped('naca4415_re4e5')
    single = trainer(dataclasses.replace(one, reynolds=2e5))
    double = trainer(dataclasses.replace(one, reynolds=2e5),
                     dataclasses.replace(one, reynolds=8e5))
    ends, values = [], []
    for machine in (single, double):
        flight = simulation.start(machine, airspeed=13.0, altitude=200.0)
        for _ in range(30):
            deflections = flight.trim.deflections.copy()
            deflections[1] -= math.radians(15.0)
            flight.step(Controls(deflections, 0.0))
        ends.append(np.concatenate([flight.snapshot.force_B, flight.snapshot.body.velocity_B,
                                    flight.snapshot.strips.alpha]))
        found = trim.glide(flight.model, alpha=math.radians(14.0), altitude=200.0)
        at = flight_modes.linearise(flight.model, found, altitude=200.0, rows=8,
                                    decamberings=(Decambering.VARIABLE,))
        values.append(np.append(at.systems[Decambering.VARIABLE].flow.load_nu.ravel(),
                                found.airspeed))
    assert ends[0] == pytest.approx(ends[1], rel=1e-9, abs=1e-9)
    assert values[0] == pytest.approx(values[1], rel=1e-7, abs=1e-7)


@pytest.fixture(scope='module')
def soft():
    """Return the trainer with tables between which it flies, and its model."""
    low, high = (table('wing', each, stall) for each, stall in ((2e5, 11.0), (8e5, 15.0)))
    machine = trainer(low, high)
    return machine, models.build(machine)


def test_glide_is_trimmed_with_the_curves_of_its_own_airspeed(soft):
    machine, model = soft
    alpha, altitude = math.radians(11.0), 100.0
    found = trim.glide(model, alpha=alpha, altitude=altitude)
    assert found.status is Status.CONVERGED
    air = standard_air(altitude)
    onset = models.Onset(
        body_to_geometry(-velocity_from_flow_angles(found.airspeed, alpha, 0.0)), np.zeros(3))
    own = wings.solver.steady(
        model.at(found.airspeed, air.kinematic_viscosity, found.controls.deflections), onset,
        found.controls.deflections,
        density=air.density, delta0=found.aero.strips.delta)
    # The solver's tolerance of 1e-5 rad leaves about as much of the force.
    assert own.force_G == pytest.approx(found.aero.force_G, rel=1e-4, abs=1e-3)
    alone = [trim.glide(models.build(trainer(each)), alpha=alpha, altitude=altitude).airspeed
             for each in machine.airfoils[:2]]
    assert min(alone) < found.airspeed < max(alone)
    assert max(alone) / min(alone) > 1.005


def test_powered_trim_at_an_angle_of_attack_finds_its_airspeed_too(soft):
    model = soft[1]
    found = trim.powered(model, alpha=math.radians(8.0), altitude=100.0)
    assert found.status is Status.CONVERGED
    again = trim.straight(model, airspeed=found.airspeed, altitude=100.0,
                          alpha0=math.radians(8.0))
    assert again.alpha == pytest.approx(found.alpha, abs=1e-6)


def test_polar_is_that_of_its_airspeed(soft):
    model = soft[1]
    lift = [next(jobs.polar(model, jobs.conditions(
        [math.radians(14.0)], beta=0.0, rates=(0.0, 0.0, 0.0), deflected=np.zeros(3)),
        airspeed=airspeed, altitude=0.0))['CL'] for airspeed in (8.0, 16.0, 29.0)]
    assert lift[0] < lift[1] < lift[2]
    assert lift[2] - lift[0] > 0.1


def test_flight_goes_on_from_a_file_to_the_bit(soft, tmp_path):
    """The Reynolds number is made from the present state: there is nothing to forget."""
    flight = simulation.start(soft[0], airspeed=12.0, altitude=200.0)

    def dive(flown, steps):
        for _ in range(steps):
            deflections = flown.trim.deflections.copy()
            deflections[1] -= math.radians(14.0)
            flown.step(Controls(deflections, 0.0))
        return dict(flight_file._arrays('', flown.saved()))

    dive(flight, 20)
    flight_file.save_state(flight, tmp_path / 'a.npz')
    resumed = flight_file.load_state(flight.model, tmp_path / 'a.npz')
    here, there = dive(flight, 20), dive(resumed, 20)
    assert all(value.tobytes() == there[key].tobytes() for key, value in here.items())
    # Another Reynolds number is another aircraft.
    other = dataclasses.replace(soft[0].airfoils[0], reynolds=2.1e5)
    machine = dataclasses.replace(soft[0], airfoils=(other, *soft[0].airfoils[1:]))
    with pytest.raises(ConfigError, match='another aircraft'):
        flight_file.load_state(models.build(machine), tmp_path / 'a.npz')


CSV = 'alpha_deg,cl,cd,cm\n' + '\n'.join(
    f'{a},{math.sin(2 * math.radians(a)):.6f},{0.01 + math.sin(math.radians(a)) ** 2:.6f},0'
    if abs(a) < 180 else f'{a},0,0.01,0' for a in range(-180, 181, 5)) + '\n'


@pytest.fixture
def read(tmp_path):
    """Return a reader of the trainer with other airfoils, in a folder with three tables."""
    for name, head in (('a', '# reynolds: 2e5\n'), ('b', '#reynolds : 800000\n'), ('c', '')):
        (tmp_path / f'{name}.csv').write_text(head + CSV)
    text = (wings.CONFIG / 'aircraft' / 'trainer.yaml').read_text()

    def reader(wing):
        (tmp_path / 'plane.yaml').write_text(text.replace('wing: naca4415_re4e5.csv', wing))
        return definition.aircraft(tmp_path / 'plane.yaml')
    return reader


@pytest.mark.parametrize(('wing', 'numbers'), [
    ('wing: [a, b]', [2e5, 8e5]), ('wing: a.csv', [2e5]), ('wing: c', [None]),
    ('wing: {file: c, reynolds: 5e5}', [5e5]),
    ('wing: [b, {file: c, reynolds: 1e5}]', [8e5, 1e5]),
    ('wing: [{file: a, reynolds: 200000}, {file: b}]', [2e5, 8e5])])
def test_tables_and_their_reynolds_numbers_are_read(read, wing, numbers):
    machine = read(wing)
    assert [each.reynolds for each in machine.airfoils if each.name == 'wing'] == numbers
    assert all(isinstance(each, Airfoil) for each in machine.airfoils)


@pytest.mark.parametrize(('wing', 'message'), [
    ('wing: [a, c]', r'plane.yaml: two airfoils are named wing: .* got 200000, none'),
    ('wing: [a, {file: c, reynolds: 2e5}]', 'need a Reynolds number each, got 200000, 200000'),
    ('wing: {file: a, reynolds: 4e5}', r'a.csv: line 1.reynolds: is 200000 here, but .* 400000'),
    ('wing: [a, a]', r'airfoils.wing: names a file twice'),
    ('wing: []', r'airfoils.wing: must be a file or a list of files'),
    ('wing: [a, 7]', r'airfoils.wing\[1\]: must be a mapping'),
    ('wing: [a, {file: c, reynolds: -1}]', r'airfoils.wing\[1\].reynolds: must be within'),
    ('wing: [a, {file: c, re: 1e5}]', r'airfoils.wing\[1\]: unknown key re'),
    ('wing: [a, gone]', r'airfoils.wing\[1\]: must be a file with curves')])
def test_tables_that_say_no_or_two_reynolds_numbers_are_refused(read, wing, message):
    with pytest.raises(ConfigError, match=message) as caught:
        read(wing)
    assert '\n' not in str(caught.value)


@pytest.mark.parametrize('head', ['# reynolds: fast\n', '# reynolds:\n', '# reynolds: 12\n'])
def test_reynolds_number_of_a_file_that_is_none(tmp_path, head):
    (tmp_path / 'd.csv').write_text(head + CSV)
    with pytest.raises(ConfigError, match=r'd.csv: line 1.reynolds: must be'):
        definition.airfoil(tmp_path / 'd.csv')


def test_a_turn_is_trimmed_with_the_curves_of_its_own_airspeed(soft):
    """The search for any steady flight and the one for straight flight see the same sections."""
    model = soft[1]
    for airspeed in (11.0, 20.0):
        straight = trim.straight(model, airspeed=airspeed, altitude=100.0)
        found = manoeuvre.steady(model, manoeuvre.Task(airspeed=airspeed), altitude=100.0)
        assert found.status is straight.status is Status.CONVERGED
        assert found.alpha == pytest.approx(straight.alpha, abs=1e-6)
