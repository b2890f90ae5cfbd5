# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""Engines in aircraft files: the documented ones, every key, every mistake in one line."""

import copy
import dataclasses
import json
import re
from pathlib import Path

import numpy as np
import pytest
import wings
import yaml
from test_definition import contents

from poststall_sim import cli, definition, engine_reader
from poststall_sim.aircraft import ConfigError
from poststall_sim.engines import Governor, LinearThrust, Propeller, Rotation, ThrustTable
from poststall_sim.reader import Place, Reader

ROOT = Path(__file__).resolve().parents[1]
TREE = yaml.safe_load((ROOT / 'config/aircraft/trainer.yaml').read_text(encoding='utf-8'))
BLOCKS = [yaml.safe_load(block) for block in re.findall(
    r'^```yaml\n(.*?)^```', (ROOT / 'docs/propulsion.md').read_text(encoding='utf-8'),
    re.MULTILINE | re.DOTALL)]
LINEAR, TABLE, ELECTRIC, PITCHED, STATIONS = (block[0] for block in BLOCKS)


ALL = (LINEAR, TABLE, ELECTRIC, PITCHED, STATIONS)
AIRFOILS = wings.shipped_aircraft('trainer').airfoils


def aircraft(tmp_path, *engines):
    path = tmp_path / 'plane.yaml'
    path.write_text(yaml.safe_dump({**TREE, 'engines': list(engines)}, sort_keys=False))
    return definition.aircraft(path)


def read(engine):
    return engine_reader.engine(Reader(engine, Place('plane.yaml', 'engines[0]')), AIRFOILS)


def test_the_documented_engines_are_read(tmp_path):
    machine = aircraft(tmp_path, *ALL)
    assert machine.engine_names == ('engine_1', 'engine_2', 'nose', 'engine_4', 'engine_5')
    linear, table, electric, pitched, stations = machine.engines
    assert isinstance(linear, LinearThrust) and isinstance(table, ThrustTable)
    assert all(isinstance(each, Propeller) for each in (electric, pitched, stations))
    assert electric.name == 'nose' and electric.rotation is Rotation.CLOCKWISE
    assert electric.drive.speed_constant == pytest.approx(400.0 * np.pi / 30.0)
    assert electric.drive.battery.capacity == pytest.approx(5.0 * 3600.0)
    assert isinstance(pitched.drive, Governor)
    assert pitched.drive.greatest_speed == pytest.approx(300.0 * np.pi)
    # Two blades 3 cm wide of NACA 4415 pull more at rest than narrower ones, and brake later.
    for made in (pitched, stations):
        assert 0.05 < made.coefficients.thrust[0] < 0.2
        assert made.coefficients.thrust[-1] < 0.0


def leaves(tree, path=()):
    if isinstance(tree, dict):
        items = tree.items()
    elif isinstance(tree, list):
        items = enumerate(tree)
    else:
        return [path]
    return [leaf for key, value in items for leaf in leaves(value, (*path, key))]


def replaced(tree, path, value):
    result = copy.deepcopy(tree)
    branch = result
    for key in path[:-1]:
        branch = branch[key]
    branch[path[-1]] = value
    return result


CASES = [(number, path) for number, engine in enumerate(
    ALL) for path in leaves(engine) if path != ('kind',)]
WORDS = {'clockwise': 'counterclockwise', 'wing': 'tail', 'nose': 'tail'}


@pytest.mark.parametrize('number, path', CASES,
                         ids=[f'{n}-{".".join(map(str, path))}' for n, path in CASES])
def test_each_key_of_an_engine_changes_the_record(number, path):
    engine = ALL[number]
    value = engine
    for key in path:
        value = value[key]
    other = not value if isinstance(value, bool) else WORDS[value] if isinstance(value, str) \
        else 3 if path[-1] == 'count' else 0.99 * value if value else 0.01
    try:
        changed = read(replaced(engine, path, other))
    except ConfigError:
        # Throttles end at 0 and 1, swirl needs a slipstream, stations end at the tip.
        assert path[:1] == ('throttle',) or path == ('slipstream',) \
            or (number == 4 and path in (('diameter_m',), ('blades', 'stations', 2, 0)))
    else:
        assert contents(changed) != contents(read(engine))


def without(engine, *path):
    *way, last = path
    result = replaced(engine, path, None)
    branch = result
    for key in way:
        branch = branch[key]
    del branch[last]
    return result


@pytest.mark.parametrize('engine, path', [
    (ELECTRIC, ('rotation',)), (ELECTRIC, ('name',)), (ELECTRIC, ('swirl',)),
    (ELECTRIC, ('motor', 'gear')), (ELECTRIC, ('motor', 'no_load_current_A')),
    (ELECTRIC, ('battery', 'empty_voltage_V')), (ELECTRIC, ('battery', 'resistance_Ohm')),
    (PITCHED, ('blades', 'hub_radius_m'))])
def test_a_key_with_a_default_may_be_left_out(engine, path):
    assert isinstance(read(without(engine, *path)), Propeller)


MISTAKES = {
    'unknown kind': (LINEAR, ('kind',), 'jet', r'engines\[0\].kind: must be one of linear, table'),
    'key of another kind': (LINEAR, ('diameter_m',), 0.4, r'unknown key diameter_m'),
    'rows of two': (ELECTRIC, ('coefficients', 1), [0.4, 0.06],
                    r'coefficients\[1\]: must be a list of 3 numbers'),
    'falling ratios': (ELECTRIC, ('coefficients', 1, 0), 0.9,
                       r'engines\[0\].coefficients: advance ratio must be .* rise'),
    'free power': (ELECTRIC, ('coefficients', 1, 2), 0.02,
                   r'coefficients: the thrust must not do more work than the shaft.* J = 0.4'),
    'both tables': (ELECTRIC, ('blades',), {}, r'expected either blades or coefficients'),
    'no inertia': (ELECTRIC, ('inertia_kgm2',), 0.0, r'inertia_kgm2: must be above 0, got 0.0'),
    'a governor with a battery': (PITCHED, ('battery',), {'voltage_V': 25.2, 'capacity_Ah': 5.0},
                                  r'battery: is of a motor: expected the key motor beside'),
    'swirl alone': (ELECTRIC, ('slipstream',), False, r'swirl is of a slipstream: it needs'),
    'a motor and a governor': (ELECTRIC, ('rpm',), 9000.0,
                               r'\].rpm: expected either a motor, .*got both: motor and 9000.0'),
    'a motor with a time': (ELECTRIC, ('spool_time_s',), 0.3, r'\].spool_time_s: expected eith'),
    'battery that fills': (ELECTRIC, ('battery', 'empty_voltage_V'), 26.0,
                           r'engines\[0\].battery: empty_voltage must be above 0 and at most'),
    'capacity in mAh': (ELECTRIC, ('battery', 'capacity_mAh'), 5000.0,
                        r'battery: unknown key capacity_mAh .*did you mean capacity_Ah'),
    'sideways': (ELECTRIC, ('rotation',), 'left', r'rotation: must be one of clockwise, counter'),
    'a name of two words': (ELECTRIC, ('name',), 'the nose', r'name: must be a name of letters'),
    'pitch and stations': (PITCHED, ('blades', 'stations'), [],
                           'blades: expected either pitch_m'),
    'hub beyond the tip': (PITCHED, ('blades', 'hub_radius_m'), 0.3,
                           r'blades.hub_radius_m: must be below the radius of 0.2 m'),
    'no such airfoil': (PITCHED, ('blades', 'airfoil'), 'clark_y',
                        r'blades.airfoil: must be one of wing, tail, got .clark_y'),
    'angles that do not fit': (STATIONS, ('blades', 'stations', 0, 2), 95.0,
                               r'blades: angle must be within -90 to 90 deg'),
    'short of the tip': (STATIONS, ('diameter_m',), 0.5,
                         r'blades.stations: must end at the radius of 0.25 m'),
    'backward blades': (STATIONS, ('blades', 'stations'), [[0.03, 0.02, -20.0], [0.2, 0.02, -20]],
                        r'blades: the blades must pull at rest'),
    'no time': (PITCHED, ('spool_time_s',), 0.0, r'spool_time_s: must be above 0'),
    'ragged table': (TABLE, ('thrust_N', 1), [15.0, 8.0], r'thrust_N\[1\]: must be a list of 3'),
    'rows missing': (TABLE, ('thrust_N',), [[1.0, 1.0, 1.0]], r'a row for each of the 3 thrott'),
}


@pytest.mark.parametrize('case', MISTAKES)
def test_a_mistake_is_said_in_one_line_that_names_its_place(case):
    engine, path, value, message = MISTAKES[case]
    with pytest.raises(ConfigError, match=message) as caught:
        read(replaced({**engine, path[0]: engine.get(path[0])}, path, value))
    assert str(caught.value).startswith('plane.yaml: engines[0]')
    assert '\n' not in str(caught.value)


@pytest.mark.parametrize('engine, gone, message', [
    (ELECTRIC, 'inertia_kgm2', r'inertia_kgm2: must be there where a motor turns'),
    (ELECTRIC, 'battery', r'motor: expected the key battery beside a motor'),
    (PITCHED, 'rpm', r'engines\[0\]: expected what turns the propeller: motor and batte'),
    (PITCHED, 'spool_time_s', r'engines\[0\]: key spool_time_s must be there')])
def test_what_a_propeller_cannot_do_without_is_named(engine, gone, message):
    with pytest.raises(ConfigError, match=message):
        read(without(engine, gone))


def test_blades_take_the_section_of_the_least_reynolds_number_without_a_flap():
    def with_tables(*tables):
        return engine_reader.engine(Reader(PITCHED, Place('plane.yaml')), [
            dataclasses.replace(AIRFOILS[0], cl=share * AIRFOILS[0].cl, reynolds=reynolds,
                                deflection=deflection)
            for share, reynolds, deflection in tables]).coefficients.thrust[0]

    several = with_tables((1.0, 4e5, 0.0), (0.8, 1e5, 0.0), (1.2, 5e4, 0.2))
    assert several == with_tables((0.8, None, 0.0)) != with_tables((1.0, None, 0.0))


def test_two_engines_must_not_have_one_name(tmp_path):
    with pytest.raises(ConfigError, match='plane.yaml: two engines are named nose'):
        aircraft(tmp_path, ELECTRIC, ELECTRIC)


def test_the_command_trims_on_what_is_left_and_names_what_there_is(tmp_path, capsys):
    pair = [{**LINEAR, 'name': name, 'position_m': [-0.1, side, -0.05]}
            for name, side in (('left', -0.4), ('right', 0.4))]
    aircraft(tmp_path, *pair)
    path = ['trim', '--aircraft', str(tmp_path / 'plane.yaml'), '--panels', '1']
    out = tmp_path / 'trim.json'
    assert cli.main([*path, '--airspeed', '14', '--failed', 'right', '--json', str(out)]) == 0
    found, = json.loads(out.read_text())['trims']
    assert found['kind'] == 'powered' and found['controls']['rudder_deg'] > 0.5
    assert cli.main([*path, '--airspeed', '14', '--failed', 'left,right']) == 0
    for wrong, message in ((['--airspeed', '14', '--failed', 'tail'], "no engine named 'tail'"),
                           (['--alpha', '4', '--failed', 'left'], '--failed is of flight at an')):
        capsys.readouterr()
        assert cli.main([*path, *wrong]) == 2
        assert message in capsys.readouterr().err
