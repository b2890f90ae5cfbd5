# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""Refusals that no other test causes, each by the door that a user comes in by."""

import argparse
import math
import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest
import wings

from poststall_sim import (
    aero_database,
    avl_mass,
    avl_reader,
    avl_writer,
    cli,
    extension,
    failures,
    manoeuvre,
    sizing,
)
from poststall_sim import option_values as values
from poststall_sim.aero import model as models
from poststall_sim.aero.decambering import AngleForm
from poststall_sim.aero.separation import Separation
from poststall_sim.aircraft import ConfigError
from poststall_sim.nonlifting import NonliftingBody
from poststall_sim.stability import flight
from poststall_sim.stability.motion import Decambering

AVL = 'Test\n0.0\n0 0 0\n1 0.5 2\n0 0 0\n'
WING = 'SURFACE\nWing\n4 0 8 0\n'
ENDS = 'SECTION\n0 0 0 0.5 0\nSECTION\n0 1 0 0.5 0\n'


@pytest.fixture(scope='module')
def trainer():
    return wings.shipped_aircraft('trainer')


def refused(capsys, *words):
    """Return the one line that the command says before it ends with code 2."""
    try:
        code = cli.main([str(word) for word in words])
    except SystemExit as end:
        code = end.code
    assert code == 2
    *patience, line = capsys.readouterr().err.splitlines()
    assert all(each.endswith(' ...') for each in patience), 'on a machine slow to compile'
    return line


@pytest.mark.parametrize('reader, text, message', [
    (values.positive, '0', "must be above 0, got '0'"),
    (values.span, '1:2:3:4', "expected A:B:STEP, got '1:2:3:4'"),
    (values.deflections, 'elevator', "expected NAME=A:B:STEP, got 'elevator'"),
    (values.some_of(('csv', 'gz')), 'csv,xml', "expected one or some of csv,gz, got 'csv,xml'"),
    (values.state_space, 'system.txt', "expected a name that ends in .npz or .mat, got "
     "'system.txt'"),
    (values.reference, '1,2', "expected cg or X,Y,Z, got '1,2'"),
])
def test_an_option_that_cannot_be_read(reader, text, message):
    with pytest.raises(argparse.ArgumentTypeError) as said:
        reader(text)
    assert str(said.value) == message


@pytest.mark.parametrize('words, message', [
    (['fly', '--fail', 'rudder:float@400'],
     'poststall: rudder: fails after the end of the flight, at 25 s: give --duration'),
    (['fly', '--fail', 'rudder:lost=3'],
     'argument --fail: lost has no angle, only stuck has (see poststall fly --help)'),
    (['modes', '--alpha', '4', '--decambering', 'all', '--export', 'x.npz'],
     'poststall: --export writes one system: give --decambering fixed, variable or lagged'),
    (['modes', '--alpha', '4', '--order', '12'], 'poststall: --order is for --export'),
    (['database', '--alpha', '0:2:1', '--format', 'gz', '--output', 'tables'],
     'poststall: --format gz needs at least 4 angles of attack, got 3'),
    (['database', '--alpha', '0:2:1', '--deflect', 'flap=5', '--output', 'tables'],
     "poststall: there is no control 'flap', there are aileron, elevator, rudder"),
    (['new', 'mine', '--span', '2', '--chord', '0.3', '--mass', '3', '--tail-volume', '3'],
     'tail volume must be 0.2 to 1.5, got 3'),
])
def test_a_command_that_makes_no_sense(words, message, capsys, monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    assert refused(capsys, *words).endswith(message)


def test_a_scenario_faster_than_any_flight(capsys, tmp_path):
    path = tmp_path / 'fast.yaml'
    path.write_text('name: fast\nduration_s: 5\n'
                    'initial: {airspeed_m_s: 900, altitude_m: 100}\n'
                    'channels: {elevator: {relative: true, points_deg: [[0, 0]]}}\n')
    assert 'airspeed_m_s must be 0.1 to 400, got 900' in refused(
        capsys, 'fly', '--scenario', path)


def test_a_new_aircraft_does_not_write_over_a_file(capsys, tmp_path):
    path = tmp_path / 'mine.yaml'
    path.write_text('kept')
    said = refused(capsys, 'new', 'mine', '--span', 2, '--chord', 0.3, '--mass', 3,
                   '--output', path)
    assert said == f'poststall: {path} is there: give another --output'
    assert path.read_text() == 'kept'


@pytest.mark.parametrize('rows, message', [
    ('2,0.2,0.01,0\n4,0.4,0.01,0\n6,0.6,0.01,0\n8,0.8,0.02,0\n10,1.0,0.02,0\n',
     'begins at 2 deg: points below zero incidence are needed, or --symmetric'),
    ('40,0.9,0.8,-0.2\n60,0.8,1.4,-0.3\n', 'has no points within 30 deg of zero incidence'),
])
def test_points_of_a_section_that_cannot_be_extended(rows, message, capsys, tmp_path):
    path = tmp_path / 'section.csv'
    path.write_text('alpha,cl,cd,cm\n' + rows)
    assert refused(capsys, 'airfoil', path, '--extend').endswith(message)


@pytest.mark.parametrize('text, message', [
    ('', 'is empty, expected an AVL geometry'),
    (AVL, 'has no SURFACE'),
    (AVL + WING + 'SECTION\n0 0 0 0.5 0\n', 'surface Wing: needs at least 2 sections, got 1'),
    ('Test\n0.0\n0 0 0\n', 'the file ends where Sref Cref Bref must come'),
    (AVL + 'SURFACE\nWing\n4.5 0 8 0\n' + ENDS, 'must be a whole number from 0 to'),
    (AVL + WING + ENDS + 'NACA 0.2 0.8\n2412\n',
     'NACA: a part X1 X2 of an airfoil is not supported'),
    (AVL + WING + ENDS + 'AIRFOIL\n1 0\n0 0\n1 0\n', 'an airfoil must be at least 5 points'),
    (AVL + WING + 'SECTION\n0 0 0 0.5 0\nSECTION\n0.1 0 0 0.5 0\n',
     'surface Wing: two neighbouring sections stand at the same y and z'),
    (AVL + WING + 'YDUPLICATE\n0.0\nSECTION\n0 0 0 0.5 0\nSECTION\n0 0 1 0.5 0\n',
     'surface Wing: lies in the plane y = 0 of its YDUPLICATE'),
])
def test_an_avl_file_that_cannot_be_flown(text, message, tmp_path):
    path = tmp_path / 'test.avl'
    path.write_text(text)
    with pytest.raises(ConfigError) as said:
        avl_reader.aircraft(path)
    assert str(said.value).startswith(str(path)) and message in str(said.value)


@pytest.mark.parametrize('text, message', [
    ('# nothing\n', 'has no masses'),
    ('1.0 2.0\n', 'must be mass x y z and up to six inertias'),
    ('Lunit = 1 furlong\n1 0 0 0\n', 'must be Lunit, Munit, Tunit, g or rho'),
])
def test_a_mass_file_that_says_nothing(text, message, tmp_path):
    path = tmp_path / 'test.mass'
    path.write_text(text)
    with pytest.raises(ConfigError, match=message):
        avl_mass.read(path)


def test_a_control_that_avl_has_no_words_for(trainer):
    at = trainer.control_names.index('aileron')
    aileron = trainer.controls[at]
    first, second = aileron.effectors

    def text(*effectors):
        controls = list(trainer.controls)
        controls[at] = replace(aileron, effectors=effectors)
        return avl_writer.text(replace(trainer, controls=tuple(controls)), 4)

    with pytest.raises(ConfigError, match='control aileron: AVL has one hinge at a place of'):
        text(first, replace(first, hinge=first.hinge + 0.05))
    halved = replace(first, span=(first.span[0], 0.5 * sum(first.span)), gain=0.5 * first.gain)
    with pytest.raises(ConfigError, match='control aileron: AVL moves the left side of'):
        text(first, second, halved)


@pytest.mark.parametrize('settings, message', [
    ({'wake_length': 0.0}, 'wake_length must be above 0 m, got 0.0'),
    ({'axial_wake': True}, "the axial wake and AVL's rules are for steady flow"),
    ({'core': 0.0}, 'core must be 0.001 to 1 strip widths, got 0.0'),
    ({'angle_form': AngleForm.LINEAR, 'separation': Separation.LAG}, 'separation lag is for'),
    ({'tolerance': 0.0}, 'tolerance must be above 0 and at most 0.1, got 0.0'),
    ({'limit': 0}, 'limit must be at least 1 iteration, got 0'),
])
def test_settings_that_nothing_can_be_computed_with(settings, message):
    with pytest.raises(ConfigError, match=message):
        models.Settings(**settings)


def test_lengths_for_surfaces_that_are_not_there(trainer):
    with pytest.raises(ConfigError, match='ell must be one number or one for each of the 3 surf'):
        models.build(trainer, models.Settings(ell=(1.0, 1.0)))


@pytest.mark.parametrize('drag_area, message', [
    ((0.1, math.nan, 0.1), 'drag_area must be three finite numbers'),
    ((0.1, -0.1, 0.1), 'drag areas must not be negative'),
])
def test_a_body_that_pushes(drag_area, message):
    with pytest.raises(ConfigError, match=f'body gear: {message}'):
        NonliftingBody('gear', (0.0, 0.0, 0.0), drag_area)


def test_strip_edges_that_do_not_cut_a_span(trainer):
    wing = trainer.surfaces[0]
    each = wing.strips // 2 if wing.symmetric else wing.strips
    edges = tuple(np.linspace(0.0, 1.0, each + 1))
    with pytest.raises(ConfigError, match=f'strip points must be {each} numbers'):
        replace(wing, edges=edges, points=(0.5,))
    off = replace(wing.sections[0], leading_edge_G=tuple(
        0.501 * a + 0.499 * b for a, b in zip(wing.sections[0].leading_edge_G,
                                              wing.sections[-1].leading_edge_G)))
    with pytest.raises(ConfigError, match='the section at 0.499 of the span must be'):
        replace(wing, sections=(wing.sections[0], off, wing.sections[-1]), edges=edges)


def test_a_part_cannot_be_stuck_beyond_its_travel(trainer):
    with pytest.raises(ConfigError, match='aileron: .* cannot be stuck at'):
        failures.of_parts(trainer, {'aileron': failures.Failure(
            failures.Kind.STUCK, math.radians(60.0))})


def test_an_aircraft_without_an_elevator_has_no_trim(trainer):
    others = tuple(each for each in trainer.controls if each.name != 'elevator')
    model = models.build(replace(trainer, controls=others))
    with pytest.raises(ConfigError, match='trim moves the control named elevator'):
        manoeuvre.steady(model, manoeuvre.Task(airspeed=15.0), altitude=0.0)


def test_a_tail_out_of_proportion():
    with pytest.raises(ConfigError, match='tail volume must be 0.2 to 1.5, got 3'):
        sizing.Numbers(2.0, 0.3, 3.0, tail_volume=3.0)


def test_points_on_one_side_of_zero_incidence():
    alpha = np.radians([-12.0, -9.0, -6.0, -4.0, -2.0])
    points = extension.Points(alpha, 6.0 * alpha, 0.01 + 0.0 * alpha, 0.0 * alpha,
                              (alpha[0], alpha[-1]))
    with pytest.raises(ConfigError, match='must reach both sides of zero incidence'):
        extension.stall_of(points, softness=1.0)


def test_a_step_that_is_not_that_of_a_panel(trainer):
    model = models.build(trainer)
    trim = manoeuvre.steady(model, manoeuvre.Task(airspeed=12.0), altitude=0.0)
    with pytest.raises(ConfigError, match='dt must be .* the way of a panel at 12.0 m/s, got 1 s'):
        flight.linearise(model, trim, altitude=0.0, decamberings=(Decambering.FIXED,),
                         dt=1.0)


def test_a_database_that_is_not_whole(trainer, tmp_path):
    model, grid = models.build(trainer), aero_database.Grid([0.0, 2.0])
    air = {'airspeed': 15.0, 'altitude': 0.0}
    begun = aero_database.Database(tmp_path, model, grid, **air)
    with pytest.raises(ConfigError, match='0 of 2 conditions are computed'):
        begun.build_up()

    def resumed(message, model=model):
        with pytest.raises(ConfigError, match=message):
            aero_database.Database(tmp_path, model, grid, **air, resume=True)

    heavier = replace(trainer, mass=replace(trainer.mass, mass=2.0 * trainer.mass.mass))
    resumed('trainer was defined otherwise when the database was begun', models.build(heavier))
    table, manifest = tmp_path / aero_database.TABLE, tmp_path / aero_database.MANIFEST
    table.write_text('alpha\n')
    resumed('is not the table of its manifest.json')
    table.unlink()
    resumed('has a manifest.json and no database.csv')
    manifest.write_text('[]')
    resumed('is not the manifest of a database')


@pytest.mark.parametrize('library, words, message', [
    ('matplotlib', ['polar', '--alpha', '2', '--aircraft', 'wing_tail', '--plot', 'polar.png'],
     'poststall: figures need matplotlib: pip install matplotlib'),
    ('rosbags.rosbag2', ['plot', '.'],
     'poststall: bags need the rosbags library: pip install rosbags'),
    ('pyarrow', ['campaign', 'plot', '.'],
     "poststall: campaigns need pyarrow: pip install '.[campaign]' in the checkout "
     '(import of pyarrow halted; None in sys.modules)'),
])
def test_a_library_that_is_not_there(library, words, message, tmp_path):
    """In a process of its own: in this one others hold on to what they have imported."""
    (tmp_path / 'metadata.yaml').write_text('')
    code = (f'import sys; sys.modules[{library!r}] = None; from poststall_sim import cli; '
            f'sys.exit(cli.main({words!r}))')
    done = subprocess.run([sys.executable, '-c', code], cwd=tmp_path, capture_output=True,
                          text=True, timeout=240)   # compiling for the first time included
    # A first line may say that kernels are compiled.
    assert (done.returncode, done.stderr.splitlines()[-1]) == (2, message)
