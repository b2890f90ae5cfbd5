# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""Campaign files: what is refused before the first flight, how values spread, what a row is."""

import dataclasses
import math

import campaigns
import numpy as np
import pytest
import yaml
from scipy import stats

from poststall_sim import (
    aircraft_writer,
    autopilot_law,
    avl_mass,
    avl_writer,
    definition,
    jobs,
    simulation,
)
from poststall_sim.aircraft import ConfigError
from poststall_sim.campaign import case as records
from poststall_sim.campaign import cases, compute, measures, pilots, sampling
from poststall_sim.campaign import definition as files
from poststall_sim.campaign.case import Outcome
from poststall_sim.campaign.sampling import Distribution, Method, Samples, Variable
from poststall_sim.frames import rotation
from poststall_sim.scenario import Channel, Scenario


def campaign(tmp_path, text=campaigns.BRIEF, **changes):
    for old, new in changes.items():
        text = text.replace(old.replace('_', ' '), new)
    return files.campaign(campaigns.written(tmp_path, text))


def varied(vary, more=''):
    """Return a campaign that varies something else."""
    head, _, _ = campaigns.BRIEF.partition('vary:')
    return f'{head}{more}vary:\n  - {vary}\n'


@pytest.mark.parametrize('vary, message', [
    ('{key: aircraft.mass.mas_kg, values: [8, 9]}', r'unknown key mas_kg.*did you mean mass_kg'),
    ('{key: aircraft.surface.wing.strips, values: [8, 9]}',
     r"key aircraft.surface.wing.strips: there is no 'surface'.*did you mean surfaces"),
    ('{key: aircraft.surfaces.wing.sections.7.chord_m, values: [0.3, 0.4]}',
     r"sections.7.chord_m: there is no '7', there are 0, 1"),
    ('{key: aircraft.name.first, values: [a, b]}', "name is 'trainer', there is nothing below"),
    ('{key: intial.alpha_deg, values: [2, 4]}', 'there is no intial.*did you mean initial'),
    ('{key: initial.alfa_deg, values: [2, 4]}', r'initial: unknown key alfa_deg.*alpha_deg'),
    ('{key: duration, values: [2, 4]}', 'there is no duration here.*did you mean duration_s'),
    ('{key: scenario.duration_s, values: [2, 4]}', 'there is no scenario here'),
    ('{key: aircraft.mass.mass_kg, values: [9, -1]}',
     r'case 1 \(aircraft.mass.mass_kg = -1\).*mass.mass_kg: must be above 0, got -1'),
    ('{key: initial.alpha_deg, grid: {from: 0, to: 400, count: 3}}',
     r'initial.alpha_deg: must be within -180.0 to 180.0'),
    ('{key: initial.alpha_deg, uniform: {from: 9, to: 3}}', 'must go up, got from 9 to 3'),
    ('{key: initial.alpha_deg, normal: {mean: 9, deviation: 0}}', 'deviation must be above 0'),
    ('{key: initial.alpha_deg, values: [3]}', 'does not vary'),
    ('{key: initial.alpha_deg, values: [3, 4, 3]}', 'one value twice'),
    ('{key: initial.alpha_deg, values: [3, 3.0]}', 'one value twice'),
    ('{key: initial.alpha_deg, values: [3, high]}', 'values of one kind'),
    ('{key: initial.alpha_deg, distribution: {name: linregress, x: 1.0}}',
     r'vary\[0\].distribution: scipy.stats has no distribution linregress'),
    ('{key: initial.alpha_deg, distribution: {name: rv_histogram, histogram: 1.0}}',
     'scipy.stats has no distribution rv_histogram'),
    ('{key: initial.alpha_deg, distribution: {name: norm, scael: 1.0}}',
     'norm is no distribution of these parameters.*scael'),
    ('{key: aircraft, values: [trainer, glider]}', 'aircraft'),
    ('{key: initial, values: [1, 2]}', 'initial'),
    ('{key: initial.alpha_deg}', 'must have one of values, grid'),
    ('{key: aircraft.description, values: [a, b]}',
     r'vary\[0\].key: aircraft.description changes nothing'),
    ('{key: aircraft.name, values: [a, b]}', 'aircraft.name changes nothing'),
    ('{key: law.stall_alpha, values: [0.2, 0.3]}', 'law.stall_alpha changes nothing'),
    ('{key: initial.alpha_deg, values: []}', r'does not vary: it is given \[\]'),
    ('{key: autopilot, values: [none, exmaple]}', 'autopilot exmaple'),
    ('{key: autopilot, values: [none, "math:pi"]}', 'math:pi: expected a function, got 3.14'),
])
def test_what_cannot_be_flown_is_refused_with_its_key(tmp_path, vary, message):
    text = varied(vary)
    if any(word in vary for word in ('uniform', 'normal', 'distribution')):
        text += 'samples: {count: 2}\n'
    with pytest.raises(ConfigError, match=message) as caught:
        cases.check(campaign(tmp_path, text))
    assert '\n' not in str(caught.value)


@pytest.mark.parametrize('more, message', [
    ('samples: {count: 2}\n', 'samples: nothing is drawn'),
    ('law: {stall_alfa: 0.2}\nautopilot: example\n', 'unknown key stall_alfa'),
    ('stop: {recoverd: true}\n', 'unknown key recoverd'),
    ('keep: {quantities: [height_lost]}\n', 'did you mean height_lost_m'),
    ('settings: {panels: 40}\n', 'panels'),
    ('scenario: stall_and_recovery\nlaw: {stall_alpha: 0.2}\n', 'scenario: flies alone'),
    ('law: {stall_alpha: 0.2}\n', 'law: changes nothing, the autopilot is never example'),
    ('sed: 3\n', 'unknown key sed'),
    ('seed: 1.5\n', 'seed: must be a whole number, got 1.5'),
])
def test_what_is_wrong_elsewhere_is_refused(tmp_path, more, message):
    with pytest.raises(ConfigError, match=message):
        cases.check(campaign(tmp_path, varied('{key: initial.alpha_deg, values: [3, 4]}', more)))


def test_what_is_drawn_from_few_values_acts_by_them_and_not_by_quartiles(tmp_path):
    """Both quartiles of a coin that falls on one side of five are the other side."""
    text = varied('{key: initial.roll_deg, distribution: {name: bernoulli, p: 0.2}}')
    assert cases.check(campaign(tmp_path, f'{text}samples: {{count: 10}}\n')) == 10


def test_a_law_that_flies_in_some_cases_only_may_vary(tmp_path):
    text = varied('{key: autopilot, values: [none, example]}\n'
                  '  - {key: law.stall_alpha, values: [0.2, 0.3]}')
    assert cases.check(campaign(tmp_path, text)) == 4


def test_a_scenario_whose_airspeed_the_campaign_sets_itself_may_not_vary_it(tmp_path):
    vary = '{key: scenario.initial.airspeed_m_s, values: [11.0, 12.0]}'
    text = varied(vary, 'scenario: stall_and_recovery\n')
    with pytest.raises(ConfigError, match='scenario.initial.airspeed_m_s changes nothing'):
        cases.check(campaign(tmp_path, text))
    without = text.replace('airspeed_m_s: 12.0, altitude_m: 150.0', 'altitude_m: 150.0')
    assert cases.check(campaign(tmp_path, without)) == 2


def test_values_reach_what_they_name(tmp_path):
    text = varied('{key: aircraft.surfaces.tail.incidence_deg, values: [0.0, -2.0]}\n'
                  '  - {key: aircraft.surfaces.wing.sections.1.chord_m, values: [0.4, 0.3]}\n'
                  '  - {key: air.wind_enu_m_s.2, values: [0.0, 2.0]}',
                  'air: {wind_enu_m_s: [0, 0, 0]}\n')
    made = list(cases.Builder(campaign(tmp_path, text)).cases())
    last = made[-1]
    assert len(made) == 8
    tail = next(each for each in last.aircraft.surfaces if each.name == 'tail')
    wing = next(each for each in last.aircraft.surfaces if each.name == 'wing')
    assert tail.sections[0].twist == pytest.approx(math.radians(-2.0))
    assert [section.chord for section in wing.sections] == [0.4, 0.3]
    assert last.task.weather.wind_N.tolist() == [0.0, 0.0, -2.0]
    first = made[0].aircraft   # and what they were set over stayed as it was
    assert first.surfaces == definition.aircraft(
        definition.find('aircraft', 'trainer')).surfaces


def test_turbulence_is_another_one_in_each_case_and_its_own_seed_changes_nothing(tmp_path):
    rough = 'air: {turbulence: {level: light}}\n'
    made = list(cases.Builder(campaign(tmp_path, varied(
        '{key: initial.alpha_deg, values: [2, 3, 4]}', rough))).cases())
    assert len({case.task.weather.turbulence.seed for case in made}) == 3
    with pytest.raises(ConfigError, match='air.turbulence.seed changes nothing'):
        cases.check(campaign(tmp_path, varied(
            '{key: air.turbulence.seed, values: [1, 2]}', rough)))


def test_grids_are_crossed_and_each_of_their_points_has_the_same_samples():
    variables = (Variable('a', (1.0, 2.0, 3.0)), Variable('x', Distribution('norm', {})),
                 Variable('b', ('p', 'q')), Variable('y', Distribution('uniform', {})))
    rows = sampling.Design(variables, Samples(Method.LATIN_HYPERCUBE, 5), seed=1)
    assert len(rows) == 3 * 2 * 5
    assert len({(a, b) for a, _, b, _ in rows}) == 6
    drawn = {(a, b): [(x, y) for a2, x, b2, y in rows if (a2, b2) == (a, b)]
             for a, _, b, _ in rows}
    assert len({tuple(each) for each in drawn.values()}) == 1


@pytest.mark.parametrize('method', [Method.LATIN_HYPERCUBE, Method.SOBOL])
def test_samples_fall_once_into_each_stratum(method):
    # What both are for: of n samples each n-th of a distribution has one, in every dimension.
    variables = (Variable('x', Distribution('norm', {'loc': 9.0, 'scale': 0.3})),
                 Variable('y', Distribution('uniform', {})))
    rows = np.array(sampling.Design(variables, Samples(method, 64), seed=4))
    shares = stats.norm(9.0, 0.3).cdf(rows[:, 0]), rows[:, 1]
    for share in shares:
        assert sorted(np.floor(64 * share).astype(int)) == list(range(64))


def test_sobol_wants_a_power_of_two():
    with pytest.raises(ConfigError, match='powers of two'):
        Samples(Method.SOBOL, 100)


def test_seeds_of_cases_differ_and_depend_on_nothing_but_their_number():
    seeds = [sampling.case_seed(7, index) for index in range(2000)]
    assert len(set(seeds)) == 2000 and max(seeds) < 2 ** 63
    assert sampling.case_seed(7, 1999) == seeds[-1] != sampling.case_seed(8, 1999)


def _same(one, other):
    assert one.outcome is other.outcome and one.quantities == other.quantities
    np.testing.assert_array_equal(one.history, other.history)


def test_a_case_is_the_same_whatever_was_computed_before(tmp_path):
    text = campaigns.BRIEF + 'keep: {history_every_s: 0.02}\n'
    made = list(cases.Builder(campaign(tmp_path, text)).cases())
    forwards = [compute.compute(case) for case in made]
    compute._models.items.clear()
    compute._trims.items.clear()
    for case, found in list(zip(made, forwards))[::-3]:
        _same(compute.compute(case), found)
    assert len(compute._models.items) <= compute.KEPT
    assert len({found.quantities['final_alpha_deg'] for found in forwards}) == len(made)


def test_a_scenario_flies_in_a_campaign_as_it_does_alone(tmp_path):
    text = varied('{key: scenario.initial.airspeed_m_s, values: [11.0, 12.0]}',
                  'scenario: stall_and_recovery\n')
    text = text.replace('initial: {airspeed_m_s: 12.0, altitude_m: 150.0}\n', '').replace(
        'duration_s: 0.1', 'duration_s: 3.0')
    case = list(cases.Builder(campaign(tmp_path, text)).cases())[1]
    found = compute.compute(case)
    scenario = definition.scenario(definition.find('scenarios', 'stall_and_recovery'))
    flight = simulation.start(case.aircraft, airspeed=12.0, altitude=150.0)
    log = jobs.FlightLog(flight)
    for snapshot in jobs.fly(flight, scenario, 3.0):
        log.add(snapshot)
    alone = log.summary(flight)
    assert found.outcome is Outcome.DONE and found.quantities['steps'] == alone['steps']
    # The pitch of a trim goes through the climb angle here: the last digits may differ.
    assert found.quantities['height_lost_m'] == pytest.approx(alone['altitude_lost_m'], abs=1e-6)
    assert found.quantities['final_alpha_deg'] == pytest.approx(
        math.degrees(flight.snapshot.alpha), abs=1e-6)


def test_a_jump_of_a_scenario_comes_in_the_same_step_as_alone(tmp_path):
    """Its time is compared with those of steps: rounded in another way it would be missed."""
    text = varied('{key: scenario.initial.airspeed_m_s, values: [11.0, 12.0]}',
                  'scenario: stall_and_recovery\n').replace('airspeed_m_s: 12.0, ', '')
    case = next(cases.Builder(campaign(tmp_path, text)).cases())
    flight = compute._started(compute._built(case), case.model_key, case.task)
    dt = flight.dt_ns
    steps = next(k for k in range(10_000) if 1e-9 * (k * dt) + 1e-9 * dt < (k + 1) * dt * 1e-9)
    at = (steps + 1) * dt * 1e-9
    jump = Scenario('jump', 99.0, 11.0, 150.0, (
        Channel('elevator', ((at, 0.0), (at, 0.1)), relative=False),))
    command = pilots.commanding(flight, dataclasses.replace(case.task, scenario=jump), 0)
    commanded = [dict(zip(flight.model.aircraft.control_names, command(dataclasses.replace(
        flight.snapshot, time_ns=k * dt)).deflections.tolist()))['elevator']
        for k in (steps - 1, steps)]
    assert commanded == [0.0, 0.1] == [
        jump.commands((k + 1) * dt * 1e-9, {})['elevator'] for k in (steps - 1, steps)]


def test_turns_are_counted_from_the_first_step_on(tmp_path):
    text = campaigns.BRIEF.replace('altitude_m: 150.0', 'altitude_m: 150.0, yaw_rate_deg_s: 200.0')
    case = list(cases.Builder(campaign(tmp_path, text)).cases())[-1]   # 30 deg, beyond 16
    flight = compute._started(compute._built(case), case.model_key, case.task)
    seen = measures.Measures(flight, case.task)
    assert seen.quantities()['stalled_turn_deg'] == 0.0
    seen.add(flight.step(flight.trim))
    body = flight.snapshot.body
    assert seen.quantities()['stalled_turn_deg'] == pytest.approx(abs(
        math.degrees((rotation(body.q_NB) @ body.rates_B)[2]) * flight.dt_ns * 1e-9), rel=1e-12)


def test_the_example_law_opens_the_throttle_in_a_stall_and_nobody_does_not(tmp_path):
    text = varied('{key: autopilot, values: [none, example]}').replace(
        'altitude_m: 150.0', 'altitude_m: 150.0, alpha_deg: 25.0').replace('0.1', '0.3')
    nobody, law = (compute.compute(case) for case in
                   cases.Builder(campaign(tmp_path, text)).cases())
    # At trim a seventh of the power, some 3 N of 21: 0.3 s of the rest are 0.6 m/s for 9 kg.
    gained = law.quantities['final_airspeed_m_s'] - nobody.quantities['final_airspeed_m_s']
    assert 0.3 < gained < 0.9


def test_what_the_example_law_sees_is_what_is_flown(tmp_path):
    case = next(cases.Builder(campaign(tmp_path)).cases())
    initial = dataclasses.replace(case.task.initial, roll=0.4, beta=0.1, alpha=0.2,
                                  rates_B=(0.3, -0.2, 0.1))
    flight = compute._started(compute._built(case), case.model_key,
                              dataclasses.replace(case.task, initial=initial))
    seen = pilots.seen(flight.snapshot)
    assert isinstance(seen, autopilot_law.Seen)
    assert (seen.roll, seen.alpha, seen.beta, seen.airspeed) == pytest.approx(
        (0.4, 0.2, 0.1, 12.0), abs=1e-12)
    assert (seen.p, seen.q, seen.r) == (0.3, -0.2, 0.1)


def test_a_flight_that_cannot_begin_or_takes_too_long_is_a_row(tmp_path):
    text = varied('{key: initial.airspeed_m_s, values: [2.0, 12.0]}', 'cpu_limit_s: 0.001\n')
    slow, good = (compute.compute(case) for case in
                  cases.Builder(campaign(tmp_path, text.replace('0.1\n', '0.5\n'))).cases())
    assert slow.outcome is Outcome.NO_RESULT and 'no trim at 2 m/s' in slow.reason
    assert good.outcome is Outcome.TIMED_OUT and good.quantities == {}


@pytest.mark.parametrize('kind, condition, quantity', [
    ('polar', 'airspeed_m_s: 12.0', 'CL'), ('trim', 'altitude_m: 100.0', 'elevator_deg')])
def test_steady_flight_is_mapped_too(tmp_path, kind, condition, quantity):
    text = (f'name: brief\nkind: {kind}\naircraft: trainer\ncondition: {{{condition}}}\nvary:\n'
            '  - {key: condition.alpha_deg, values: [2.0, 6.0]}\n'
            '  - {key: aircraft.mass.cg_m.0, values: [0.17, 0.19]}\n'
            f'keep: {{quantities: [{quantity}]}}\n')
    if kind == 'polar':   # loads about another point, the same lift
        text = text.replace('mass.cg_m.0, values: [0.17, 0.19]',
                            'surfaces.tail.incidence_deg, values: [2.0, 0.0]')
    read = campaign(tmp_path, text)
    assert cases.check(read) == 4
    found = [compute.compute(case) for case in cases.Builder(read).cases()]
    assert {each.outcome for each in found} == {Outcome.DONE}
    values = [each.quantities[quantity] for each in found]
    if kind == 'polar':
        assert values[2] > values[0] > values[1]
    else:   # the further ahead the balance, the more up elevator, and the more so at more lift
        assert values[1] > values[0] and values[1] - values[0] < values[3] - values[2]


@pytest.mark.parametrize('vary, message', [
    ('controls_deg.elevatr, values: [0.0, 2.0]',
     r"condition.controls_deg: trainer has no control 'elevatr', it has aileron, elevator"),
    ('controls_deg.elevator, values: [0.0, 80.0]',
     r'controls_deg.elevator = 80.0.*condition.controls_deg: elevator goes from')])
def test_a_control_of_a_polar_that_is_not_there_is_refused(tmp_path, vary, message):
    text = ('name: brief\nkind: polar\naircraft: trainer\n'
            'condition: {alpha_deg: 5.0, airspeed_m_s: 12.0, controls_deg: {}}\n'
            f'vary:\n  - {{key: condition.{vary}}}\n')
    with pytest.raises(ConfigError, match=message):
        cases.check(campaign(tmp_path, text))


def test_steady_flight_has_the_air_it_is_given_and_that_does_not_move(tmp_path):
    """Dynamic pressure goes with density, and at one weight the airspeed with its root."""
    text = ('name: brief\nkind: trim\naircraft: trainer\ncondition: {alpha_deg: 5.0}\n'
            'air: {density_kg_m3: 1.2}\nvary:\n'
            '  - {key: air.density_kg_m3, values: [1.2, 0.6]}\n')
    read = campaign(tmp_path, text)
    assert cases.check(read) == 2
    dense, thin = (compute.compute(case).quantities['airspeed_m_s']
                   for case in cases.Builder(read).cases())
    # Reynolds numbers change nothing: the trainer has one table a section.
    assert thin / dense == pytest.approx(math.sqrt(2.0), rel=1e-6)
    with pytest.raises(ConfigError, match='air: steady flight is in still air.*turbulence'):
        cases.check(campaign(tmp_path, text.replace(
            'density_kg_m3: 1.2}', 'turbulence: {level: light}}')))


def test_an_aircraft_of_avl_flies_and_nothing_of_it_varies(tmp_path):
    trainer = definition.aircraft(definition.find('aircraft', 'trainer'))
    (tmp_path / 'plane.avl').write_text(avl_writer.text(trainer, 4))
    (tmp_path / 'plane.mass').write_text(avl_mass.text(trainer.mass, trainer.name))
    text = ('name: brief\nkind: polar\naircraft: plane.avl\ncondition: {airspeed_m_s: 12.0}\n'
            'vary:\n  - {key: condition.alpha_deg, values: [2.0, 6.0]}\n')
    read = campaign(tmp_path, text)
    assert cases.check(read) == 2
    low, high = (compute.compute(case).quantities['CL'] for case in cases.Builder(read).cases())
    assert 0.2 < high - low < 0.5   # 4 deg at a slope between 3 and 7 per rad
    with pytest.raises(ConfigError, match='nothing of plane.avl can vary, it is a file of AVL'):
        campaign(tmp_path, text + '  - {key: aircraft.mass.mass_kg, values: [8.0, 9.0]}\n')


def test_a_function_of_the_users_goes_by_its_module(tmp_path, monkeypatch):
    """It may be anything that can be called; a module that cannot be read is one line."""
    monkeypatch.syspath_prepend(tmp_path)
    (tmp_path / 'partial_pilot.py').write_text(
        'import functools\n\n\ndef hold(gain, **given):\n    return lambda snapshot: {}\n\n\n'
        'make = functools.partial(hold, 2.0)\n')
    (tmp_path / 'broken_pilot.py').write_text('def make(:\n')
    assert pilots.source('partial_pilot:make') == tmp_path / 'partial_pilot.py'
    with pytest.raises(ConfigError, match=r'autopilot broken_pilot:make: .*line 1'):
        pilots.source('broken_pilot:make')
    with pytest.raises(ConfigError, match='autopilot sys:exit: its module has no file'):
        pilots.source('sys:exit')


def test_a_curve_that_a_later_case_names_is_part_of_what_the_campaign_is(tmp_path):
    """Else rows of before and after its file changed would stand in one table."""
    trainer = definition.find('aircraft', 'trainer')
    curves = aircraft_writer.curves(definition.aircraft(trainer).airfoils[0])
    for name in ('one.csv', 'two.csv'):
        (tmp_path / name).write_text(curves)
    tree = yaml.safe_load(trainer.read_text())
    section = next(iter(tree['airfoils']))
    tree['airfoils'][section] = 'one.csv'
    (tmp_path / 'plane.yaml').write_text(yaml.safe_dump(tree))
    text = varied(f'{{key: aircraft.airfoils.{section}, values: [one.csv, two.csv]}}').replace(
        'aircraft: trainer', 'aircraft: plane.yaml')
    before = cases.files_read(campaign(tmp_path, text))
    rows = curves.splitlines()
    rows[20] = ','.join([*rows[20].split(',')[:2], '0.5', rows[20].split(',')[3]])
    (tmp_path / 'two.csv').write_text('\n'.join([*rows, '']))
    after = cases.files_read(campaign(tmp_path, text))
    assert [name for name in before if before[name] != after[name]] == [
        f'aircraft.airfoils.{section} two.csv']


def test_a_design_of_millions_is_not_laid_out_in_memory():
    variables = (Variable('a', tuple(range(1000))), Variable('b', tuple(range(1000))),
                 Variable('x', Distribution('uniform', {})))
    design = sampling.Design(variables, Samples(Method.RANDOM, 10), seed=1)
    assert len(design) == 10_000_000
    assert design[0][:2] == (0, 0) and design[9_999_999][:2] == (999, 999)
    assert design[10][:2] == (0, 1) and design[10][2] == design[0][2]
    with pytest.raises(IndexError):
        design[10_000_000]


def test_a_row_has_no_number_that_is_none(tmp_path):
    case = next(cases.Builder(campaign(tmp_path)).cases())
    result = records.Result(Outcome.DIVERGED, 'x', {'height_lost_m': math.nan, 'steps': 3})
    row = records.row(case, result, {'numpy': '2'})
    assert row['height_lost_m'] is None and row['steps'] == 3 and row['spun'] is None
    assert list(row)[:5] == ['case', 'seed', 'initial.alpha_deg', 'aircraft.mass.mass_kg',
                             'status']


def test_the_shipped_campaigns_can_be_flown():
    assert definition.names('campaigns')
    for name in definition.names('campaigns'):
        assert cases.check(files.campaign(definition.find('campaigns', name))) > 100
