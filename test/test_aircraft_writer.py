# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""What is written is read as the same aircraft."""

import everything
import pytest
import yaml
from test_definition import contents
from test_engine_reader import ALL, TREE

from poststall_sim import aircraft_writer, definition
from poststall_sim.definition import Kind

SHIPPED = sorted(path.stem for path in (everything.CONFIG / 'aircraft').glob('*.yaml'))


def again(aircraft, folder):
    """Return an aircraft written into a folder and read from there."""
    files = aircraft_writer.csv_names(aircraft)
    assert len(set(files)) == len(files)
    for airfoil, name in zip(aircraft.airfoils, files):
        (folder / name).write_text(aircraft_writer.curves(airfoil))
    path = folder / 'again.yaml'
    path.write_text(aircraft_writer.text(aircraft, files))
    return definition.aircraft(path)


def flat(values):
    """Return the numbers, words and choices of nested lists and tuples, one after the other."""
    if isinstance(values, (list, tuple)):
        return [each for value in values for each in flat(value)]
    return [values]


def assert_same(one, other):
    """Hold every field of two aircraft to the twelve digits that are written."""
    ones, others = flat(contents(one)), flat(contents(other))
    assert len(ones) == len(others)
    for a, b in zip(ones, others):
        assert a == (pytest.approx(b, rel=1e-11, abs=1e-14) if isinstance(b, float) else b)


@pytest.mark.parametrize('name', SHIPPED)
def test_shipped_aircraft_are_written_and_read_again(tmp_path, name):
    aircraft = definition.aircraft(definition.find(Kind.AIRCRAFT, name))
    assert_same(again(aircraft, tmp_path), aircraft)


def test_an_aircraft_with_every_key_is_written_and_read_again(tmp_path):
    """Several tables of a section, flaps, stops, actuators, bodies, strip edges."""
    everything.write_curves(tmp_path)
    path = tmp_path / 'everything.yaml'
    path.write_text(everything.AIRCRAFT)
    aircraft = definition.aircraft(path)
    assert_same(again(aircraft, tmp_path), aircraft)


def test_the_documented_engines_are_written_and_read_again(tmp_path):
    path = tmp_path / 'plane.yaml'
    path.write_text(yaml.safe_dump({**TREE, 'engines': list(ALL)}, sort_keys=False))
    aircraft = definition.aircraft(path)
    assert_same(again(aircraft, tmp_path), aircraft)
    assert aircraft_writer.text(aircraft, aircraft_writer.csv_names(aircraft)).count('kind:') == 5
