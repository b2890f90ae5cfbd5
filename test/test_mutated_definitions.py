# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""Something wrong at every key: a valid aircraft or scenario, or an error that names the place."""

import itertools
import math
import random
import re

import everything
import numpy as np
import pytest
import test_every_field as rows
from everything import AIRCRAFT_TREE, GONE, OTHER_SCENARIO_TREE, SCENARIO_TREE, changed

from poststall_sim import definition, propulsion
from poststall_sim.aero import model as models
from poststall_sim.aircraft import ConfigError
from poststall_sim.propulsion import Meeting
from poststall_sim.simulation import Flight
from poststall_sim.state import BodyState, Controls, Status

pytestmark = pytest.mark.filterwarnings('error::RuntimeWarning')   # no NaN on the way either

VALUES = (None, True, 'word', '', [], {}, [1.0], {'file': 3}, math.nan, math.inf, 1e300, -1e300,
          1e-300, 0, 1, -1.0, 1e6, 10 ** 400, [[1.0, 2.0, 3.0]], '1e3', '\x07\n\u202e')
ENGINES = AIRCRAFT_TREE['engines']


def alone(engine):
    """Return a small aircraft with one engine, which takes less time to read."""
    controls = {'aileron': AIRCRAFT_TREE['controls']['aileron']}
    return {**AIRCRAFT_TREE, 'surfaces': AIRCRAFT_TREE['surfaces'][:1], 'controls': controls,
            'bodies': [], 'engines': [engine]}


def nodes(tree, path=()):
    """Return the paths of every node but the root."""
    items = tree.items() if isinstance(tree, dict) else \
        enumerate(tree) if isinstance(tree, list) else ()
    return [node for key, value in items
            for node in [(*path, key), *nodes(value, (*path, key))]]


def mutations(tree, seed, only=''):
    """Yield one mutation of every node, of all the kinds in turn: the tree, path, new value."""
    chance = random.Random(seed)
    kinds = itertools.cycle(['value', 'scale', 'value', 'gone', 'value', 'other'])
    for path in nodes(tree):
        if only and path[0] != only:
            continue
        here, kind = tree, next(kinds)
        for key in path:
            here = here[key]
        if kind == 'scale' and isinstance(here, (int, float)):
            value = here * chance.choice([-1, 1e-6, 1e6]) + chance.choice([0, 1e-9])
        elif kind == 'scale' and isinstance(here, list) and len(here) > 1:
            value = here[::-1]
        elif kind == 'other' and isinstance(here, dict):
            value = {**here, 'colour': 3}
        elif kind == 'other' and isinstance(here, list):
            value = [*here, chance.choice([*here, *VALUES])]
        elif kind == 'gone':
            value = GONE
        else:
            value = chance.choice(VALUES)
        yield tree, path, value


FEW = {**AIRCRAFT_TREE, 'engines': ENGINES[:1]}
AIRCRAFT = list(mutations(FEW, 1))
PROPULSION = [each for number, engine in enumerate(ENGINES[1:])
              for each in mutations(alone(engine), number, 'engines')]
SCENARIO = [*mutations(SCENARIO_TREE, 2), *mutations(OTHER_SCENARIO_TREE, 3, 'air')]


def dotted(path):
    return ''.join(f'[{key}]' if isinstance(key, int) else f'.{key}' for key in path)[1:]


def case(value):
    if isinstance(value, tuple):
        return dotted(value)
    return 'gone' if value is GONE else '' if isinstance(value, dict) and 'name' in value \
        else repr(value)[:30]


def refused(error, path):
    """Check that an error is one line with the file and the place of what was changed."""
    line = str(error)
    assert '\n' not in line and line.isprintable()
    file, place, *_ = *line.split(': '), ''
    assert file.endswith('file.yaml')
    words = re.findall(r'[^.\[\]]+', place)
    named = [str(key) for key in path]
    last = next(key for key in reversed(path) if isinstance(key, str))
    # A reference that points nowhere, lengths that do not fit: told at the other end.
    elsewhere = {'surfaces': 'effectors', 'airspeed_m_s': 'thrust_N', 'diameter_m': 'blades',
                 'airfoils': 'airfoil', 'name': 'surface'}
    assert last.lower() in line.lower() or words == named[:len(words)] \
        or elsewhere.get(last, 'nowhere') in place, line


@pytest.fixture(scope='module')
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp('mutated')
    everything.write_curves(folder)
    return folder


def test_there_are_200_mutations_of_aircraft_and_every_key_of_the_tables_has_one():
    assert len(AIRCRAFT) + len(PROPULSION) >= 200
    mutated = {key for _, path, _ in (*AIRCRAFT, *PROPULSION, *SCENARIO) for key in path}
    known = {key for row in (*rows.AIRCRAFT, *rows.ENGINES, *rows.SCENARIO)
             for key in everything.keys(row[0])}
    assert {key for key in known | set(rows.LABELS) if str(key).isidentifier()} <= mutated


@pytest.mark.parametrize('tree, path, value', AIRCRAFT, ids=case)
def test_a_mutated_aircraft_can_fly_or_is_refused(folder, tree, path, value):
    try:
        aircraft = everything.load(folder, changed(tree, {path: value}), definition.aircraft)
    except ConfigError as error:
        refused(error, path)
        return
    try:
        model = models.build(aircraft, models.Settings(chordwise=1))
    except ConfigError as error:
        assert '\n' not in str(error)
        assert re.search('surface|strip|control', str(error))
        return
    body = BodyState(np.array([0.0, 0.0, -50.0]), np.array([20.0, 0.0, 1.0]), np.zeros(3),
                     np.array([1.0, 0.0, 0.0, 0.0]))
    flight = Flight(model, body, Controls(np.zeros(len(aircraft.controls)), 0.5),
                    dt_ns=10_000_000)
    assert flight.snapshot.status is not Status.DIVERGED


@pytest.mark.parametrize('tree, path, value', PROPULSION, ids=case)
def test_a_mutated_engine_works_or_is_refused(folder, tree, path, value):
    try:
        aircraft = everything.load(folder, changed(tree, {path: value}), definition.aircraft)
    except ConfigError as error:
        refused(error, path)
    else:
        push = propulsion.balanced(aircraft, Meeting(
            np.array([15.0, 0.0, 0.0]), np.zeros(3), 1.2, np.full(len(aircraft.engines), 0.5)))
        assert np.isfinite(push.load).all()


@pytest.mark.parametrize('tree, path, value', SCENARIO, ids=case)
def test_a_mutated_scenario_can_be_flown_or_is_refused(folder, tree, path, value):
    try:
        scenario = everything.load(folder, changed(tree, {path: value}), definition.scenario)
    except ConfigError as error:
        refused(error, path)
    else:
        points = np.array([[1.0, 2.0, -50.0]])
        beyond = scenario.weather.beyond_N(0.1, points, np.zeros(3), scenario.weather.mean_N(50.0))
        assert np.isfinite(beyond).all()
        assert scenario.atmosphere.at(scenario.altitude).density > 0.0
        assert all(map(math.isfinite, scenario.commands(0.5, {}).values()))
