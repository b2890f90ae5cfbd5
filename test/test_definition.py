# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""Definitions: what the shipped files say, and what every wrong file gets to hear."""

import dataclasses
import math
import os
import re
import shutil
import sys
import types
from pathlib import Path

import numpy as np
import pytest
import yaml
from hypothesis import given, settings
from hypothesis import strategies as st

from poststall_sim import definition
from poststall_sim.aircraft import ConfigError, Section
from poststall_sim.campaign import definition as campaigns
from poststall_sim.definition import Kind

CONFIG = Path(__file__).resolve().parents[1] / 'config'
TREE = yaml.safe_load((CONFIG / 'aircraft' / 'trainer.yaml').read_text(encoding='utf-8'))

PLANE = """\
name: plane
description: An early draft of the trainer, kept here so that tuning the real one breaks nothing.
airfoils:
  wing: wing.csv
  tail: tail.csv
reference: {area_m2: 1.28, chord_m: 0.4, span_m: 3.2}
surfaces:
  - name: wing
    symmetric: true
    strips: 20
    spacing: uniform
    incidence_deg: 0.0
    sections:
      - {leading_edge_m: [0.0, 0.0, 0.0], chord_m: 0.4, twist_deg: 0.0, airfoil: wing}
      - {leading_edge_m: [0.0, 1.6, 0.070], chord_m: 0.4, twist_deg: 0.0, airfoil: wing}
  - name: tail
    symmetric: true
    strips: 8
    spacing: uniform
    incidence_deg: 0.0
    sections:
      - {leading_edge_m: [1.195, 0.0, -0.12], chord_m: 0.26, twist_deg: 0.0, airfoil: tail}
      - {leading_edge_m: [1.195, 0.52, -0.12], chord_m: 0.26, twist_deg: 0.0, airfoil: tail}
  - name: fin
    symmetric: false
    strips: 5
    spacing: uniform
    incidence_deg: 0.0
    sections:
      - {leading_edge_m: [1.11, 0.0, -0.10], chord_m: 0.36, twist_deg: 0.0, airfoil: tail}
      - {leading_edge_m: [1.23, 0.0, 0.40], chord_m: 0.26, twist_deg: 0.0, airfoil: tail}
controls:
  aileron:
    limits_deg: [-20.0, 20.0]
    effectors:
      - {surface: wing, side: right, span: [0.6, 1.0], hinge: 0.75, gain: -1.0}
      - {surface: wing, side: left, span: [0.6, 1.0], hinge: 0.75, gain: 1.0}
  elevator:
    limits_deg: [-30.0, 20.0]
    effectors:
      - {surface: tail, side: both, span: [0.0, 1.0], hinge: 0.6, gain: 1.0}
  rudder:
    limits_deg: [-25.0, 25.0]
    effectors:
      - {surface: fin, side: both, span: [0.0, 1.0], hinge: 0.55, gain: 1.0}
mass:
  mass_kg: 9.0
  cg_m: [0.19, 0.0, -0.05]
  inertia_kgm2: {xx: 1.2, yy: 1.4, zz: 2.5, xy: 0.0, yz: 0.0, xz: 0.03}
engines:
  - static_thrust_N: 35.0
    zero_thrust_airspeed_m_s: 30.0
    position_m: [-0.45, 0.0, -0.05]
    direction: [-1.0, 0.0, 0.0]
"""

STALL = """\
name: stall_and_recovery
description: Elevator ramp into the stall near 7 s, rudder kick, recovery to trimmed flight.
duration_s: 25.0
initial:
  airspeed_m_s: 15.0
  altitude_m: 150.0
channels:
  throttle:
    relative: true
    points: [[1.0, 0.0], [1.5, -0.3], [10.5, -0.3], [12.0, 0.1], [20.0, 0.1], [21.0, 0.0]]
  elevator:
    relative: true
    points_deg: [[2.0, 0.0], [7.0, -12.0], [9.5, -12.0], [10.3, 3.0], [11.3, 3.0], [14.0, 0.0]]
  rudder:
    relative: true
    points_deg: [[8.0, 0.0], [8.1, 12.0], [8.9, 12.0], [9.0, 0.0]]
"""


def curves(clmax=1.4):
    """Return a CSV of a section that is periodic and passes every check."""
    lines = ['# a made-up section', 'alpha_deg,cl,cd,cm']
    for alpha in range(-180, 181, 10):
        a = math.radians(alpha)
        row = clmax * math.sin(2 * a), 0.01 + math.sin(a) ** 2, -0.1 * math.sin(a)
        lines.append(f'{alpha},' + ','.join(f'{round(value, 6) + 0.0:.6f}' for value in row))
    return '\n'.join(lines) + '\n'


@pytest.fixture(scope='module')
def folder(tmp_path_factory):
    """Return a folder with the section curves that the aircraft name, and one more."""
    folder = tmp_path_factory.mktemp('aircraft')
    shipped = TREE['airfoils'].values()
    for number, name in enumerate(sorted({'wing.csv', 'tail.csv', 'other.csv', *shipped})):
        (folder / name).write_text(curves(1.3 + 0.1 * number))
    return folder


def load(folder, text, reader=definition.aircraft, name='plane.yaml'):
    path = folder / name
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return reader(path)


def refuses(folder, text, message, reader=definition.aircraft, name='plane.yaml'):
    """Check that a text is refused in one line that names the file and matches the message."""
    with pytest.raises(ConfigError, match=message) as caught:
        load(folder, text, reader, name)
    line = str(caught.value)
    assert '\n' not in line
    assert line.isprintable()
    assert Path(line.split(': ')[0]).name == name
    assert re.search('must|need|expected|did you mean|is not YAML|starts at|stand at', line)


# ------------------------------------------------------------------------------ shipped files


@pytest.mark.parametrize('name', ['trainer', 'wing_tail'])
def test_a_shipped_aircraft_has_the_reference_area_and_span_of_its_wing(name):
    aircraft = definition.aircraft(definition.find(Kind.AIRCRAFT, name))
    wing = aircraft.surfaces[0]
    root, tip = wing.sections
    assert aircraft.reference.span == pytest.approx(2.0 * tip.leading_edge_G[1])
    assert aircraft.reference.area == pytest.approx(aircraft.reference.span * root.chord)
    assert aircraft.reference.chord == root.chord == tip.chord


def test_wing_tail_is_the_configuration_of_figure_2_2():
    """Wing c = 1, AR 12, 20 strips; tail c = 0.67, AR 5, LE at x = 7.5, 6 strips; flat."""
    aircraft = definition.aircraft(definition.find('aircraft', 'wing_tail'))
    wing, tail = aircraft.surfaces
    assert (wing.strips, tail.strips) == (20, 6)
    assert 2.0 * wing.sections[1].leading_edge_G[1] / wing.sections[1].chord == 12.0
    assert 2.0 * tail.sections[1].leading_edge_G[1] / tail.sections[1].chord == pytest.approx(5.0)
    assert tail.sections[0].chord == 0.67
    assert [section.leading_edge_G[::2] for surface in (wing, tail)
            for section in surface.sections] == [(0.0, 0.0)] * 2 + [(7.5, 0.0)] * 2
    assert {section.twist for surface in (wing, tail) for section in surface.sections} == {0.0}


def test_the_trainer_keeps_to_the_rules_of_its_header():
    """Wing loading, tail volumes and radii of gyration of an ordinary aircraft."""
    aircraft = definition.aircraft(definition.find(Kind.AIRCRAFT, 'trainer'))
    tail, fin = aircraft.surfaces[1:]
    cg, ref, mass = aircraft.mass.cg_G, aircraft.reference, aircraft.mass.mass
    assert mass * 9.80665 / (0.5 * 1.225 * 15.0**2 * ref.area) == pytest.approx(0.50, abs=0.05)
    root, tip = tail.sections
    area = (root.chord + tip.chord) * tip.leading_edge_G[1]
    arm = root.leading_edge_G[0] + 0.25 * root.chord - cg[0]
    assert 0.5 < area * arm / (ref.area * ref.chord) < 0.65
    root, tip = fin.sections
    area = 0.5 * (root.chord + tip.chord) * (tip.leading_edge_G[2] - root.leading_edge_G[2])
    arm = 0.5 * (root.leading_edge_G[0] + tip.leading_edge_G[0]) + 0.125 * (
        root.chord + tip.chord) - cg[0]
    assert 0.035 < area * arm / (ref.area * ref.span) < 0.045
    roll, pitch, yaw = np.sqrt(np.diag(aircraft.mass.inertia_B) / mass)
    assert 0.10 < roll / ref.span < 0.13
    assert 0.18 < pitch / 2.0 < 0.22
    assert 0.9 < yaw / math.hypot(roll, pitch) <= 1.0   # a nearly flat body


def test_the_shipped_scenario_leads_past_seven_seconds_and_back():
    scenario = definition.scenario(definition.find(Kind.SCENARIO, 'stall_and_recovery'))
    aircraft = definition.aircraft(definition.find(Kind.AIRCRAFT, 'trainer'))
    assert scenario.duration == 25.0
    channels = {channel.control: channel for channel in scenario.channels}
    assert set(channels) <= {*aircraft.control_names, 'throttle'}
    elevator = channels['elevator']
    assert elevator.value(0.0) == 0.0
    assert elevator.value(25.0) == pytest.approx(0.0, abs=math.radians(1.5))   # near the trim
    assert elevator.value(7.0) < math.radians(-5.0)   # radians, or this would be rounding


@pytest.mark.parametrize('kind', Kind)
def test_every_shipped_file_can_be_read(kind):
    read = {Kind.AIRCRAFT: definition.aircraft, Kind.AIRFOIL: definition.airfoil,
            Kind.SCENARIO: definition.scenario, Kind.CAMPAIGN: campaigns.campaign}[kind]
    assert definition.names(kind)
    for name in definition.names(kind):
        assert read(definition.find(kind, name)).name == name


# ------------------------------------------------------------------ units, axes, conventions


def test_degrees_become_radians_once(folder):
    aircraft = load(folder, PLANE.replace('incidence_deg: 0.0', 'incidence_deg: 2.0', 1)
                    .replace('twist_deg: 0.0', 'twist_deg: -3.0', 1))
    root, tip = aircraft.surfaces[0].sections
    assert math.degrees(root.twist) == pytest.approx(-1.0)
    assert math.degrees(tip.twist) == pytest.approx(2.0)
    low, high = aircraft.controls[1].limits
    assert (math.degrees(low), math.degrees(high)) == pytest.approx((-30.0, 20.0))
    assert aircraft.airfoils[0].alpha[[0, -1]] == pytest.approx([-math.pi, math.pi], abs=1e-12)


def test_products_of_inertia_are_integrals_and_enter_the_tensor_with_a_minus(folder):
    """A mass m at (x, 0, z) has xz = m x z; turning about z it has -m x z r about x."""
    aircraft = load(folder, PLANE.replace('xy: 0.0, yz: 0.0', 'xy: 0.01, yz: 0.02'))
    assert aircraft.mass.inertia_B == pytest.approx(np.array(
        [[1.2, -0.01, -0.03], [-0.01, 1.4, -0.02], [-0.03, -0.02, 2.5]]))


def test_a_direction_of_thrust_is_made_a_unit_vector(folder):
    aircraft = load(folder, PLANE.replace('direction: [-1.0, 0.0, 0.0]',
                                            'direction: [-3.0, 0.0, 4.0]'))
    assert aircraft.engines[0].direction_G == pytest.approx((-0.6, 0.0, 0.8))


@pytest.mark.parametrize(('written', 'mass'), [
    ('9e0', 9.0), ('90E-1', 9.0), ('+9', 9.0), ('9.', 9.0), ('.9e1', 9.0), ('009', 9.0)])
def test_numbers_are_read_as_yaml_1_2_writes_them(folder, written, mass):
    """PyYAML alone takes 9e0 for a word (YAML 1.1 asks for a point) and 011 for octal."""
    assert load(folder, PLANE.replace('mass_kg: 9.0', f'mass_kg: {written}')).mass.mass == mass


def test_aliases_and_a_byte_order_mark_are_allowed(folder):
    text = PLANE.replace('reference: {', 'reference: &r {')
    assert load(folder, b'\xef\xbb\xbf' + text.encode()).reference.area == 1.28
    text = text.replace('incidence_deg: 0.0', 'incidence_deg: &zero 0.0', 1).replace(
        'twist_deg: 0.0', 'twist_deg: *zero', 1)
    assert load(folder, text).surfaces[0].sections[0].twist == 0.0


# --------------------------------------------------------------------------- what may be left out


def contents(record):
    """Return a record as nested tuples and lists that compare by value."""
    if dataclasses.is_dataclass(record):
        return [contents(getattr(record, field.name)) for field in dataclasses.fields(record)]
    if isinstance(record, tuple):
        return [contents(item) for item in record]
    return record.tolist() if isinstance(record, np.ndarray) else record


@pytest.mark.parametrize('piece', [
    '    spacing: uniform\n', '    incidence_deg: 0.0\n', ', twist_deg: 0.0', ', side: both',
    ', span: [0.0, 1.0]', ', gain: 1.0', ', xy: 0.0, yz: 0.0',
    '    direction: [-1.0, 0.0, 0.0]\n'])
def test_a_key_with_a_natural_default_may_be_left_out(folder, piece):
    assert piece in PLANE
    short = load(folder, PLANE.replace(piece, ''))
    assert contents(short) == contents(load(folder, PLANE))


def test_controls_and_engines_may_be_left_out(folder):
    glider = load(folder, PLANE[:PLANE.index('controls:')] + PLANE[
        PLANE.index('mass:'):PLANE.index('engines:')])
    assert (glider.control_names, glider.engines) == ((), ())


# ------------------------------------------------------------------------- what is refused


WING = '- name: wing'
SECTION = '{leading_edge_m: [0.0, 0.0, 0.0], chord_m: 0.4, twist_deg: 0.0, airfoil: wing}'
MUTATIONS = {
    # an old piece of the trainer's file, the new one, and what the error says
    'unknown key': ('mass_kg: 9.0', 'mass_kg: 9.0\n  colour: red',
                    r'plane.yaml: mass: unknown key colour with value .red.; expected '),
    'unknown key at the top': ('name: plane', 'name: plane\nwingspan_m: 3.2',
                               r'plane.yaml: unknown key wingspan_m with value 3.2; expected '),
    'nearest key': ('spacing: uniform', 'spaceing: uniform',
                    r'surfaces\[0\]: unknown key spaceing .*; did you mean spacing\?'),
    'millimetres': (SECTION, SECTION.replace('chord_m: 0.4', 'chord_mm: 400'),
                    r'surfaces\[0\]\.sections\[0\]: unknown key chord_mm with value 400; '
                    r'did you mean chord_m\?'),
    'feet': (SECTION, SECTION.replace('chord_m: 0.4', 'chord_ft: 1.3'),
             r'sections\[0\]: unknown key chord_ft with value 1.3; did you mean chord_m\?'),
    'a key in radians': ('limits_deg: [-30.0, 20.0]', 'limits_rad: [-0.5, 0.3]',
                         r'elevator: unknown key limits_rad .*; did you mean limits_deg\?'),
    'a key in pounds': ('mass_kg: 9.0', 'mass_lb: 20.0',
                        r'mass: unknown key mass_lb with value 20.0; did you mean mass_kg\?'),
    'a key without unit': ('area_m2: 1.28', 'area: 1.28',
                           r'reference: unknown key area .*did you mean area_m2\?'),
    'missing key': ('cg_m: [0.19, 0.0, -0.05]', '',
                    r'plane.yaml: mass: key cg_m must be there, got only mass_kg, '
                    r'inertia_kgm2'),
    'missing block': ('reference: {area_m2: 1.28, chord_m: 0.4, span_m: 3.2}', '',
                      r'plane.yaml: key reference must be there, got only name, description'),
    'no value': ('mass_kg: 9.0', 'mass_kg:',
                 r'plane.yaml: mass.mass_kg: must be a number, got None'),
    'a word': ('mass_kg: 9.0', 'mass_kg: heavy', r"mass.mass_kg: must be a number, got 'heavy'"),
    'a quoted number': ('mass_kg: 9.0', "mass_kg: '9.0'",
                        r"mass.mass_kg: must be a number, got '9.0'"),
    'decimal comma': ('mass_kg: 9.0', 'mass_kg: 9,0', r"mass_kg: must be a number, got '9,0'"),
    'a boolean': ('mass_kg: 9.0', 'mass_kg: true', r'mass.mass_kg: must be a number, got True'),
    'NaN': ('mass_kg: 9.0', 'mass_kg: .nan', r'mass_kg: must be a finite number, got nan'),
    'infinity': ('chord_m: 0.4, span_m', 'chord_m: .inf, span_m',
                 r'plane.yaml: reference.chord_m: must be a finite number, got inf'),
    'overflow': ('mass_kg: 9.0', 'mass_kg: 1e999', r'mass_kg: must be a finite number, got inf'),
    'NaN in a vector': ('cg_m: [0.19, 0.0, -0.05]', 'cg_m: [0.19, .NaN, -0.05]',
                        r'mass.cg_m\[1\]: must be a finite number, got nan'),
    'negative mass': ('mass_kg: 9.0', 'mass_kg: -9.0',
                      r'plane.yaml: mass.mass_kg: must be above 0, got -9.0'),
    'no mass': ('mass_kg: 9.0', 'mass_kg: 0', r'mass.mass_kg: must be above 0, got 0'),
    'negative inertia': ('yy: 1.4', 'yy: -1.4',
                         r'plane.yaml: mass.inertia_kgm2.yy: must be above 0, got -1.4'),
    'triangle inequality': ('zz: 2.5', 'zz: 2.7',
                            r'plane.yaml: mass: inertia breaks the triangle inequality: .* must '
                            r'add up to at least the largest, 2.701 kg'),
    'indefinite tensor': ('xy: 0.0', 'xy: 1.5',
                          r'plane.yaml: mass: inertia must be positive in every direction'),
    'short vector': ('cg_m: [0.19, 0.0, -0.05]', 'cg_m: [0.19, 0.0]',
                     r'mass.cg_m: must be a list of 3 numbers, got \[0.19, 0.0\]'),
    'number for a vector': ('cg_m: [0.19, 0.0, -0.05]', 'cg_m: 0.19',
                            r'mass.cg_m: must be a list of 3 numbers, got 0.19'),
    'list for a mapping': ('reference: {area_m2: 1.28, chord_m: 0.4, span_m: 3.2}',
                           'reference: [1.28, 0.4, 3.2]',
                           r'plane.yaml: reference: must be a mapping of keys to values, got \['),
    'mapping for a list': ('effectors:\n      - {surface: tail',
                           'effectors:\n        {surface: tail',
                           r'plane.yaml: controls.elevator.effectors: must be a list, got \{'),
    'duplicate key': ('mass_kg: 9.0', 'mass_kg: 9.0\n  mass_kg: 10.0',
                      r'plane.yaml: line \d+: key mass_kg must be there once, got it twice'),
    'duplicate control': ('  rudder:', '  elevator:',
                          r'plane.yaml: line \d+: key elevator must be there once'),
    'tab': ('  mass_kg: 9.0', '\tmass_kg: 9.0',
            r'plane.yaml: line \d+: is not YAML: .*; indent with blanks, not tabs'),
    'open bracket': ('cg_m: [0.19, 0.0, -0.05]', 'cg_m: [0.19, 0.0, -0.05',
                     r'plane.yaml: line \d+: is not YAML: while parsing a flow sequence'),
    'control character': ('name: plane', 'name: pla\x07ne',
                          r'plane.yaml: is not YAML: unacceptable character #x0007'),
    'two documents': ('name: plane', 'name: plane\n---\nname: other', r'is not YAML'),
    'python object': ('name: plane', 'name: !!python/object/apply:os.getcwd []',
                      r"plane.yaml: line \d+: must have no tag, got 'tag:yaml.org,2002:python/"),
    'alias to itself': ('airfoils:', 'airfoils: &a\n  loop: *a',
                        r'plane.yaml: line \d+: an alias must not stand for the very list'),
    'key that is a list': ('name: plane', '? [name]\n: plane',
                           r'plane.yaml: line \d+: a key must be a word, got a list'),
    'list of names': ('name: plane', 'name: [plane]',
                      r"plane.yaml: name: must be a text of one line, got \['plane'\]"),
    'empty name': ('name: plane', "name: ''", r"name: must be a text of one line, got ''"),
    'name with blanks': (WING, '- name: main wing',
                         r"surfaces\[0\].name: must be a name of letters, digits and _ that .*, "
                         r"got 'main wing'"),
    'control with a slash': ('  rudder:', '  rud/der:',
                             r"controls: must be a name of .*'rud/der'"),
    'throttle as control': ('  rudder:', '  throttle:',
                            r'plane.yaml: a control must not be named throttle'),
    'two surfaces of one name': ('- name: fin', '- name: tail',
                                r'surfaces\[2\].name: must be a name of its own, '
                                r'got tail for the second time'),
    'unknown surface': ('{surface: tail,', '{surface: tial,',
                        r"controls.elevator.effectors\[0\].surface: must be one of wing, tail, "
                        r"fin, got 'tial'; did you mean tail\?"),
    'unknown side': ('side: right', 'side: starboard',
                     r"aileron.effectors\[0\].side: must be one of both, right, left, got 'star"),
    'side of a fin': ('{surface: fin, side: both', '{surface: fin, side: left',
                      r'rudder.effectors\[0\].side: must be both, for surface fin is not '
                      r'symmetric, got left'),
    'unknown airfoil': (SECTION, SECTION.replace('airfoil: wing', 'airfoil: winf'),
                        r"surfaces\[0\].sections\[0\].airfoil: must be one of wing, tail, got "
                        r"'winf'; did you mean wing\?"),
    'unknown spacing': ('spacing: uniform', 'spacing: sine',
                        r"surfaces\[0\].spacing: must be one of uniform, cosine, got 'sine'"),
    'yes for true': ('symmetric: true', 'symmetric: yes',
                     r"surfaces\[0\].symmetric: must be true or false, got 'yes'"),
    'missing file': ('wing: wing.csv', 'wing: naca4416_re4e5.csv',
                     r"plane.yaml: airfoils.wing: must be a file .*'naca4416_re4e5.csv' .*looked "
                     r'in .*did you mean naca4415_re4e5\?'),
    'missing file in a mapping': ('wing: wing.csv', 'wing: {file: gone.csv}',
                                  r"plane.yaml: airfoils.wing.file: must be a file .*'gone.csv'"),
    'odd strips': ('strips: 20', 'strips: 21',
                   r'plane.yaml: surfaces\[0\]: surface wing: strips must be a positive number, '
                   r'even on a symmetric surface, got 21'),
    'no strips': ('strips: 20', 'strips: 0',
                  r'surfaces\[0\].strips: must be a whole number from 1 to 1000, got 0'),
    'part of a strip': ('strips: 20', 'strips: 20.5', r'strips: must be a whole .*got 20.5'),
    'strips as boolean': ('strips: 20', 'strips: true', r'strips: must be a whole .*got True'),
    'one section': (f'      - {SECTION}\n', '',
                    r'plane.yaml: surfaces\[0\]: surface wing: needs at least 2 sections'),
    'sections in one place': ('[0.0, 1.6, 0.070]', '[0.0, 0.0, 0.0]',
                              r'surfaces\[0\]: surface wing: two neighbouring sections'),
    'a gap in the middle': (SECTION, SECTION.replace('[0.0, 0.0, 0.0]', '[0.0, 0.1, 0.0]'),
                            r'surfaces\[0\]: .*a symmetric surface starts at y = 0, got y = 0.1'),
    'negative chord': (SECTION, SECTION.replace('0.4', '-0.4'),
                       r'sections\[0\].chord_m: must be above 0, got -0.4'),
    'twist of minutes': (SECTION, SECTION.replace('twist_deg: 0.0', 'twist_deg: 120.0'),
                         r'sections\[0\].twist_deg: must be within -45 to 45, got 120.0'),
    'limits in the wrong order': ('limits_deg: [-30.0, 20.0]', 'limits_deg: [20.0, -30.0]',
                                  r'controls.elevator: control elevator: limits must satisfy low '
                                  r'<= 0 <= high .*got 20 to -30 deg'),
    'limits without neutral': ('limits_deg: [-30.0, 20.0]', 'limits_deg: [5.0, 20.0]',
                               r'controls.elevator: .*low <= 0 <= high .*got 5 to 20 deg'),
    'degrees made of degrees': ('limits_deg: [-30.0, 20.0]', 'limits_deg: [-1718.9, 20.0]',
                                r'elevator.limits_deg\[0\]: must be within -90 to 90, got -1718'),
    'span reversed': ('side: right, span: [0.6, 1.0]', 'side: right, span: [1.0, 0.6]',
                      r'controls.aileron.effectors\[0\]: span must satisfy 0 <= from < to <= 1'),
    'span in metres': ('side: right, span: [0.6, 1.0]', 'side: right, span: [0.96, 1.6]',
                       r'effectors\[0\]: span must satisfy .*got \(0.96, 1.6\)'),
    'hinge behind the trailing edge': ('hinge: 0.6,', 'hinge: 1.6,',
                                       r'elevator.effectors\[0\]: hinge must lie in 0 <= hinge < 1'
                                       r' of the chord, got 1.6'),
    'hinge about nothing': ('hinge: 0.6,', 'hinge: 0.6, hinge_axis: [0, 0, 0],',
                            r'elevator.effectors\[0\]: hinge_axis must be three finite numbers '
                            'that are not all 0, got 0, 0, 0'),
    'hinge about a word': ('hinge: 0.6,', 'hinge: 0.6, hinge_axis: y,',
                           r'elevator.effectors\[0\].hinge_axis: must be a list of 3 numbers'),
    'hinge to infinity': ('hinge: 0.6,', 'hinge: 0.6, hinge_axis: [0, .inf, 0],',
                          r'elevator.effectors\[0\].hinge_axis\[1\]: must be a finite number'),
    'gain zero': ('gain: -1.0', 'gain: 0',
                  r'aileron.effectors\[0\]: gain must be a finite number other than 0, got 0.0'),
    'no effectors': ('effectors:\n      - {surface: tail, side: both, span: [0.0, 1.0], '
                     'hinge: 0.6, gain: 1.0}', 'effectors: []',
                     r'controls.elevator: control elevator: .*needs an effector'),
    'no surfaces': (PLANE[PLANE.index('surfaces:'):PLANE.index('controls:')],
                    'surfaces: []\n', r'surfaces: must be a list of at least one surface, got'),
    'thrust of nothing': ('static_thrust_N: 35.0', 'static_thrust_N: 0.0',
                          r'engines\[0\].static_thrust_N: must be above 0, got 0.0'),
    'thrust to nowhere': ('direction: [-1.0, 0.0, 0.0]', 'direction: [0, 0, 0]',
                          r'engines\[0\].direction: must point somewhere, got \(0.0, 0.0, 0.0\)'),
}


@pytest.mark.parametrize('case', MUTATIONS)
def test_a_wrong_aircraft_is_refused(folder, case):
    old, new, message = MUTATIONS[case]
    assert old in PLANE   # or the mutation would test nothing
    refuses(folder, PLANE.replace(old, new, 1), message)


@pytest.mark.parametrize(('text', 'message'), [
    ('', r'plane.yaml: is empty, expected a mapping of keys to values'),
    ('# only a comment\n', r'plane.yaml: is empty, expected a mapping'),
    ('- name: trainer\n', r"plane.yaml: must be a mapping of keys to values, got \[\{'name'"),
    ('trainer\n', r"plane.yaml: must be a mapping of keys to values, got 'trainer'"),
    ('#' * 1_000_001, r'plane.yaml: is too large .*: expected at most 1000000 bytes, got 1000001'),
    (b'\x7fELF\x02\x01\x01\x00\xff\xfe', r'plane.yaml: must be UTF-8 text, got byte 0xff at'),
    ('name: é\n'.encode('latin-1'), r'must be UTF-8 text, got byte 0xe9 at position 6'),
    (b'PK\x03\x04\x00\x00', r'plane.yaml: is not YAML: unacceptable character #x0003'),
    ('[' * 100_000, r'plane.yaml: must not be nested so deeply'),
    ('\n'.join(f'k{i}: 0' for i in range(99)),
     r'plane.yaml: key name must be there, got only k0, k1, .*, k19 and 79 more$'),
    ('a: ' + '[' * 300 + ']' * 300, r'plane.yaml: (must not be nested so deeply|unknown key|key)'),
])
def test_a_file_that_is_no_definition_is_refused(folder, text, message):
    refuses(folder, text, message)


def test_a_folder_a_missing_file_and_a_device_are_refused(tmp_path):
    with pytest.raises(ConfigError, match=r'is a folder, expected a definition file'):
        definition.aircraft(tmp_path)
    with pytest.raises(ConfigError, match=r'gone.yaml: does not exist, expected a definition'):
        definition.scenario(tmp_path / 'gone.yaml')
    if os.path.exists('/dev/zero'):
        with pytest.raises(ConfigError, match=r'/dev/zero: is not a regular file, expected'):
            definition.airfoil('/dev/zero')


def test_a_file_that_may_not_be_read_is_refused(folder, monkeypatch):
    def forbidden(self):
        raise PermissionError(13, 'Permission denied')
    monkeypatch.setattr(Path, 'read_bytes', forbidden)
    (folder / 'plane.yaml').write_text(PLANE)
    with pytest.raises(ConfigError, match=r'plane.yaml: must be readable, got Permission denied'):
        definition.aircraft(folder / 'plane.yaml')


def test_many_aliases_do_not_grow(folder):
    """Nine levels of nine aliases each would be 4e8 items if anything copied or printed them."""
    lines = ['a0: &a0 [x, x, x, x, x, x, x, x, x]']
    lines += [f'a{i}: &a{i} [{", ".join([f"*a{i - 1}"] * 9)}]' for i in range(1, 10)]
    refuses(folder, PLANE + '\n'.join(lines) + '\n', r'unknown key a0')
    refuses(folder, '\n'.join(lines) + '\nname: *a9\n', r'name: must be a text of one line, got')


def test_a_constructor_names_degrees_where_they_are_likely():
    with pytest.raises(ConfigError, match=r'did you mean 0.0873, from degrees\?'):
        Section((0.0, 0.0, 0.0), 1.0, 'wing', twist=5.0)


# ------------------------------------------------------------------------- section curves


CURVES = curves()


@pytest.mark.parametrize(('old', 'new', 'message'), [
    (CURVES, '', r'foil.csv: is empty, expected the columns alpha_deg,cl,cd,cm'),
    (CURVES, '# nothing but comments\n', r'foil.csv: is empty, expected the columns'),
    ('cl,cd,cm', 'cl,cd', r'foil.csv: line 2: column cm is missing, expected alpha_deg,cl,cd,cm, '
                          r"got 'alpha_deg,cl,cd'"),
    ('alpha_deg,', 'alpha_rad,', r"line 2: column 'alpha_rad' is unknown, expected "
                                 r'alpha_deg,cl,cd,cm; did you mean alpha_deg\?'),
    ('cl,cd,cm', 'cl,cd,cd', r"line 2: column 'cd' is there twice, expected alpha_deg,cl,cd,cm"),
    ('alpha_deg,cl,cd,cm\n', '', r"line 2: column '-180' is unknown, expected alpha_deg,cl,cd,cm"),
    ('\n-170,', '\n-190,', r'foil.csv: line 4.alpha_deg: must increase from row to row, got -190 '
                           r'after -180'),
    ('\n-170,', '\n-180,', r'line 4.alpha_deg: must increase .*, got -180 after -180'),
    ('\n-170,', '\n-17O,', r"foil.csv: line 4.alpha_deg: must be a number, got '-17O'"),
    ('\n-170,', '\n,', r"foil.csv: line 4.alpha_deg: must be a number, got ''"),
    ('\n-170,', '\nnan,', r"line 4.alpha_deg: must be a number, got 'nan'"),
    ('\n-170,', '\n.inf,', r'line 4.alpha_deg: must be a finite number, got inf'),
    ('\n-170,', '\n1e999,', r'line 4.alpha_deg: must be a finite number, got inf'),
    ('\n-170,', '\n-170;', r'line 4: must have 4 values, got 3'),
    ('\n0,', '\n0,0,', r'foil.csv: line 21: must have 4 values, got 5'),
    ('\n180,', '\n175,', r'foil.csv: airfoil foil: alpha must run from -180 to 180 deg, got -180 '
                         r'to 175'),
    ('\n-180,0.000000,', '\n-180,0.3,', r'foil: cl must be the same at -180 and 180 deg, got 0.3'),
    ('\n0,0.000000,0.01', '\n0,0.000000,-0.01', r'foil.csv: airfoil foil: cd must not be neg'),
    (CURVES, 'alpha_deg,cl,cd,cm\n-180,0,0,0\n180,0,0,0\n', r'foil: .*at least 8 rows, got 2'),
    (CURVES, 'alpha_deg,cl,cd,cm\n', r'foil.csv: airfoil foil: .* at least 8 rows, got 0'),
    (CURVES, 'alpha_deg,cl,cd,cm\n-3.14159,0,0,0\n0,0,0,0\n3.14159,0,0,0\n',
     r'foil.csv: alpha_deg must run from -180 to 180 deg, got -3.14159 to 3.14159 \(are these '
     r'radians\?\)'),
])
def test_a_wrong_table_is_refused(folder, old, new, message):
    assert old in CURVES
    refuses(folder, CURVES.replace(old, new, 1), message, definition.airfoil, 'foil.csv')


def test_a_table_may_order_its_columns_and_hold_blank_lines(folder):
    rows = [line.split(',') for line in CURVES.splitlines()[1:]]
    text = '\r\n\r\n'.join(', '.join(row[::-1]) for row in rows)
    straight = load(folder, CURVES, definition.airfoil, 'foil.csv')
    assert contents(load(folder, text, definition.airfoil, 'foil.csv')) == contents(straight)
    assert straight.cd[18] == 0.01   # at alpha = 0


# ----------------------------------------------------------------------------- scenarios


@pytest.mark.parametrize(('old', 'new', 'message'), [
    ('duration_s: 25.0', 'duration_s: 0', r'stall.yaml: duration_s: must be above 0, got 0'),
    ('duration_s: 25.0', 'duration_s: 1e9', r'duration_s: must be at most 86400, got 1000000'),
    ('duration_s', 'duration_min', r'unknown key duration_min .*did you mean duration_s\?'),
    ('airspeed_m_s: 15.0', 'airspeed_kt: 30', r'initial: unknown key airspeed_kt with value 30; '
                                             r'did you mean airspeed_m_s\?'),
    ('altitude_m: 150.0', 'altitude_m: -1', r'initial.altitude_m: must be above 0, got -1'),
    ('[7.0, -12.0]', '[7.0, -120.0]',
     r'channels.elevator.points_deg\[1\]\[1\]: must be within -90 to 90, got -120.0'),
    ('[7.0, -12.0]', '[1.0, -12.0]', r'channels.elevator: channel elevator: times must not fall'),
    ('[7.0, -12.0]', '[-7.0, -12.0]', r'points_deg\[1\]\[0\]: must be at least 0, got -7.0'),
    ('[7.0, -12.0]', '[7.0]', r'points_deg\[1\]: must be a list of 2 numbers, got \[7.0\]'),
    ('[7.0, -12.0]', '[7.0, .nan]', r'points_deg\[1\]\[1\]: must be a finite number, got nan'),
    ('[7.0, -12.0]', '7.0', r'points_deg\[1\]: must be a list of 2 numbers, got 7.0'),
    ('points:', 'points_deg:', r'channels.throttle: unknown key points_deg .*did you mean points'),
    ('points_deg:', 'points:', r'channels.elevator: unknown key points .*mean points_deg\?'),
    ('[1.5, -0.3]', '[1.5, -30]', r'channels.throttle.points\[1\]\[1\]: must be within -1 to 1, '
                                  r'got -30'),
    ('relative: true', 'relative: 1', r'throttle.relative: must be true or false, got 1'),
    ('relative: true', 'relative: false', r'throttle.points\[1\]\[1\]: must be within 0 to 1, got '
                                          r'-0.3'),
    ('points: [[1.0', 'points: [] #', r'throttle: channel throttle: needs at least one point'),
    ('channels:', 'channels: [] #', r'stall.yaml: '),
])
def test_a_wrong_scenario_is_refused(folder, old, new, message):
    assert old in STALL
    refuses(folder, STALL.replace(old, new, 1), message, definition.scenario, 'stall.yaml')


def test_a_scenario_gives_radians_and_a_plain_throttle(folder):
    text = ('name: step\nduration_s: 2\ninitial: {airspeed_m_s: 15, altitude_m: 100}\nchannels:\n'
            '  rudder: {relative: false, points_deg: [[0, 0], [1, 18]]}\n'
            '  throttle: {relative: true, points: [[0, 0.25]]}\n')
    scenario = load(folder, text, definition.scenario)
    commands = scenario.commands(0.5, {'rudder': 1.0, 'throttle': 0.5})
    assert commands == pytest.approx({'rudder': math.radians(9.0), 'throttle': 0.75})


# --------------------------------------------------------------------------------- places


def test_a_name_means_the_source_tree_and_a_path_means_itself(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert definition.find('aircraft', 'trainer') == CONFIG / 'aircraft' / 'trainer.yaml'
    assert definition.find('aircraft', 'trainer.yaml') == CONFIG / 'aircraft' / 'trainer.yaml'
    shutil.copy(CONFIG / 'aircraft' / 'trainer.yaml', tmp_path / 'mine.yaml')
    assert definition.find('aircraft', 'mine').samefile(tmp_path / 'mine.yaml')
    assert definition.find('aircraft', tmp_path / 'mine.yaml') == tmp_path / 'mine.yaml'


@pytest.mark.parametrize('name', ['', 'trainr', 'a\nb', 'a\x00b', '../' * 40 + 'gone', 'x' * 5000])
def test_a_name_that_is_nowhere_lists_names_and_places(name):
    with pytest.raises(ConfigError, match=r'available: .*trainer, wing_tail; looked ') as caught:
        definition.find(Kind.AIRCRAFT, name)
    message = str(caught.value)
    assert str(CONFIG / 'aircraft') in message
    assert str(Path(sys.prefix) / 'share' / 'poststall_sim' / 'config' / 'aircraft') in message
    assert '\n' not in message
    assert message.endswith('did you mean trainer?') == (name == 'trainr')


@pytest.mark.skipif(os.name != 'posix', reason='Windows keeps a directory that someone stands in')
def test_a_deleted_working_directory_is_no_crash(tmp_path, monkeypatch):
    (tmp_path / 'gone').mkdir()
    monkeypatch.chdir(tmp_path / 'gone')
    (tmp_path / 'gone').rmdir()
    assert definition.find('aircraft', 'trainer').is_file()
    with pytest.raises(ConfigError, match=r'available: .*trainer, wing_tail; looked in \., /'):
        definition.find('aircraft', 'trainr')
    with pytest.raises(ConfigError, match=r'x.yaml: does not exist, expected a definition file'):
        definition.aircraft('x.yaml')


def test_a_folder_is_not_an_aircraft(tmp_path):
    with pytest.raises(ConfigError, match=r'is a folder, expected a .yaml file'):
        definition.find(Kind.AIRCRAFT, tmp_path)


def ament(monkeypatch, answer):
    package = types.ModuleType('ament_index_python')
    module = types.ModuleType('ament_index_python.packages')
    module.get_package_share_directory = answer
    monkeypatch.setitem(sys.modules, 'ament_index_python', package)
    monkeypatch.setitem(sys.modules, 'ament_index_python.packages', module)


def test_the_ament_index_is_asked_last(monkeypatch, tmp_path):
    ament(monkeypatch, lambda name: str(tmp_path / name))
    place = tmp_path / 'poststall_sim' / 'config' / 'aircraft'
    assert definition.folders('aircraft')[-1] == place
    place.mkdir(parents=True)
    shutil.copy(CONFIG / 'aircraft' / 'trainer.yaml', place / 'only_here.yaml')
    shutil.copy(CONFIG / 'aircraft' / 'trainer.yaml', place / 'trainer.yaml')
    assert definition.find('aircraft', 'only_here') == place / 'only_here.yaml'
    assert definition.find('aircraft', 'trainer') == CONFIG / 'aircraft' / 'trainer.yaml'
    assert 'only_here' in definition.names('aircraft')


@pytest.mark.parametrize('error', [LookupError, KeyError, OSError, ImportError])
def test_a_missing_ament_index_is_no_error(monkeypatch, error):
    """Outside a ROS environment it raises OSError, in one without this package a LookupError."""
    def answer(name):
        raise error(name)
    ament(monkeypatch, answer)
    assert definition.find('aircraft', 'trainer').is_file()


@pytest.mark.parametrize('site', ['lib/python3.12/site-packages', 'local/lib/x/dist-packages'])
def test_an_installed_package_looks_below_its_own_prefix(monkeypatch, tmp_path, site):
    """With pip --user, a colcon workspace or Debian's /usr/local that is not sys.prefix."""
    monkeypatch.setattr(definition, '__file__', str(tmp_path / site / 'poststall_sim' / 'd.py'))
    prefix = (tmp_path / site).parents[2]
    assert definition.folders(Kind.SCENARIO)[0] == \
        prefix.resolve() / 'share' / 'poststall_sim' / 'config' / 'scenarios'


def test_curves_beside_the_aircraft_come_before_the_shipped_ones(folder):
    beside = load(folder, yaml.safe_dump(TREE, sort_keys=False)).airfoils[0]
    shipped = definition.aircraft(CONFIG / 'aircraft' / 'trainer.yaml').airfoils[0]
    assert beside.name == shipped.name
    assert len(beside.alpha) == 37 != len(shipped.alpha)


# ------------------------------------------------------------------------------- any bytes


@settings(max_examples=200, deadline=None, derandomize=True)
@given(start=st.integers(0, len(PLANE)), length=st.integers(0, 40),
       piece=st.one_of(st.binary(max_size=12), st.text(max_size=12).map(str.encode),
                       st.sampled_from([b'&a', b'*a', b'<<: ', b'!!', b'? ', b'- ', b'{', b'\t'])))
def test_any_damage_to_the_bytes_gives_an_aircraft_or_a_config_error(folder, start, length, piece):
    text = PLANE.encode()
    start = min(start, len(text))
    try:
        aircraft = load(folder, text[:start] + piece + text[start + length:])
    except ConfigError as error:
        assert re.match(r'\S*(plane\.yaml|\.csv): ', str(error))
        assert '\n' not in str(error)
    else:
        assert aircraft.mass.mass > 0.0
