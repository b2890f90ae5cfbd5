# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""Polars of others read, extended, drawn and written back: the command `airfoil`."""

import json
import math

import numpy as np
import pytest
import wings

from poststall_sim import airfoil_writer, cli, definition, polar_import
from poststall_sim.aero.polars import section_polar
from poststall_sim.aircraft import ConfigError
from poststall_sim.polar_import import Format

ALPHA = np.arange(-13.0, 17.1, 0.5)

XFOIL_HEAD = """
       XFOIL         Version 6.99

 Calculated polar for: SECTION BY FORMULA

 1 1 Reynolds number fixed          Mach number fixed

 xtrf =   1.000 (top)        1.000 (bottom)
 Mach =   0.000     Re =     0.400 e 6     Ncrit =   9.000

   alpha    CL        CD       CDp       CM     Top_Xtr  Bot_Xtr
  ------ -------- --------- --------- -------- -------- --------
"""
TOOLS_HEAD = """Xfoil polar. Reynolds number fixed. Mach  number fixed
Polar key,xf-section-400000
Airfoil,section
Reynolds number,400000
Ncrit,9
Mach,0
Max Cl/Cd,97.7
Max Cl/Cd alpha,5.25
Url,http://airfoiltools.com/polar/csv?polar=xf-section-400000

Alpha,Cl,Cd,Cdp,Cm,Top_Xtr,Bot_Xtr
"""


def rows():
    """Return alpha [deg], cl, cd, cm of a section by formula that stalls at about 14 deg."""
    values = section_polar(wings.stalling(-4.0, 16.0, 2.0)).at(np.radians(ALPHA))
    return [(a, *row[:3]) for a, row in zip(ALPHA, values)]


@pytest.fixture(scope='module')
def files(tmp_path_factory):
    """Return a folder with the same points in three formats."""
    folder = tmp_path_factory.mktemp('polars')
    (folder / 'xfoil.txt').write_text(XFOIL_HEAD + ''.join(
        f'{a:8.3f} {cl:8.4f} {cd:9.5f} {cd / 3:9.5f} {cm:8.4f}   0.50   1.00\n'
        for a, cl, cd, cm in rows()))
    (folder / 'tools.csv').write_text(TOOLS_HEAD + ''.join(
        f'{a:.3f},{cl:.4f},{cd:.5f},{cd / 3:.5f},{cm:.4f},0.5,1.0\n' for a, cl, cd, cm in rows()))
    # In any order, with one alpha twice: the last one counts.
    lines = [f'{cm:.4f}, {a:g}, {cl:.4f}, {cd:.5f}\n' for a, cl, cd, cm in rows()]
    (folder / 'plain.csv').write_text(
        '# reynolds: 4e5\n# from a tunnel\ncm, alpha, cl, cd\n0,3,9,9\n' + ''.join(lines[::-1]))
    (folder / 'measured.csv').write_text('alpha_deg,cl\n0,0.4\n10,1.4\n16,1.3\n')
    return folder


def run(tmp_path, *words, code=0):
    """Run the command and return its JSON."""
    path = tmp_path / 'result.json'
    assert cli.main(['airfoil', *map(str, words), '--json', str(path)]) == code
    return json.loads(path.read_text())


@pytest.mark.parametrize(('name', 'form'), [
    ('xfoil.txt', Format.XFOIL), ('tools.csv', Format.AIRFOILTOOLS), ('plain.csv', Format.CSV)])
def test_the_same_points_are_read_from_every_format(files, name, form):
    for asked in (None, form):
        found = polar_import.points(files / name, asked)
        assert found.format is form and found.reynolds == 4e5
        expected = np.array(rows())
        assert np.degrees(found.alpha) == pytest.approx(expected[:, 0], abs=1e-9)
        assert np.column_stack([found.cl, found.cd, found.cm]) == pytest.approx(
            expected[:, 1:], abs=6e-5)


@pytest.mark.parametrize(('text', 'message'), [
    ('', 'no CSV of a polar'), ('alpha,cl,cd,cm\n', 'has no points'),
    ('alpha,cl,cd\n1,2,3\n', 'has no column cm, but alpha, cl, cd'),
    ('alpha,cl,cl,cd,cm\n', 'names a column twice'),
    ('alpha,cl,cd,cm\n1,2,3\n', 'line 2: must have 4 values, got 3'),
    ('alpha,cl,cd,cm\n1,2,nan,0\n', r'line 2.cd: must be a'),
    ('alpha,cl,cd,cm\n1,2e9,0,0\n', r'line 2.cl: must be within'),
    ('alpha,cl,cd,cm\n1,,0,0\n', r'line 2.cl: must be a number'),
    (XFOIL_HEAD + '1.0 0.5 ***** 0.1 0.0 0.1 0.2\n', r'line 13.cd: must be a number'),
    (XFOIL_HEAD.replace('alpha', 'a'), 'must name a column alpha')])
def test_what_is_no_polar_is_refused_in_one_line(tmp_path, text, message):
    (tmp_path / 'p.csv').write_text(text)
    with pytest.raises(ConfigError, match=message) as caught:
        polar_import.points(tmp_path / 'p.csv')
    assert '\n' not in str(caught.value)


def test_a_format_asked_for_is_not_guessed(files):
    with pytest.raises(ConfigError, match='no polar of XFOIL'):
        polar_import.points(files / 'tools.csv', Format.XFOIL)


def test_imported_polar_is_extended_and_flies(files, tmp_path, capsys):
    """The whole way: XFOIL's file to ours, read as aircraft files read it."""
    output, figure = tmp_path / 'made.csv', tmp_path / 'made.png'
    found = run(tmp_path, files / 'xfoil.txt', '--extend', '--clmax', 1.4, '--alpha-stall', 13,
                '--softness', 1.5, '--output', output, '--plot', figure, '--measured',
                files / 'measured.csv')
    text = capsys.readouterr().out
    assert 'zero-lift angle' in text and 'one solution to' in text
    assert figure.stat().st_size > 20_000
    assert found['positive_stall']['cl'] == pytest.approx(1.4, abs=3e-3)
    assert found['positive_stall']['alpha_deg'] == pytest.approx(13.0, abs=0.3)
    assert found['negative_stall']['cl'] < -0.8 and found['reynolds'] == 4e5
    assert found['measured']['cl'] == [0.4, 1.4, 1.3] and found['measured']['cd'] is None
    made = definition.airfoil(output)
    assert made.reynolds == 4e5 and made.name == 'made'
    assert np.abs(made.cl - found['table']['cl']).max() < 1e-5
    inside = np.abs(np.degrees(made.alpha)) <= 4.0
    expected = np.interp(made.alpha[inside], np.radians(ALPHA), [row[1] for row in rows()])
    assert made.cl[inside] == pytest.approx(expected, abs=1e-4)
    # And once more through the command: the same section.
    again = run(tmp_path, output)
    for key in ('zero_lift_deg', 'lift_slope_per_rad'):
        assert again[key] == pytest.approx(found[key], abs=1e-3)
    assert not again['extended']


def test_a_shipped_section_by_its_name(tmp_path, capsys):
    found = run(tmp_path, 'naca4415_re4e5')
    assert found['zero_lift_deg'] == pytest.approx(-4.335, abs=2e-3)    # its own header
    assert found['positive_stall']['cl'] == pytest.approx(1.38, abs=1e-3)
    assert found['positive_stall']['steepest_fall_per_deg'] == pytest.approx(-0.077, abs=1e-3)
    assert found['flags'] == [] and found['points'] is None
    limit = found['wing']['steepest_unique_fall_per_deg']
    assert -9.9 < math.degrees(limit) < -8.0


def test_a_stall_too_sharp_for_one_solution_is_flagged(tmp_path, files, capsys):
    """Lift that falls by 0.2 per deg: more than any averaging over a chord stands."""
    alpha = np.radians(np.arange(-180.0, 181.0))
    foil = wings.stalling(-4.0, 15.0, 0.8)
    path = tmp_path / 'sharp.csv'
    values = section_polar(foil).at(alpha)[:, :3]
    values[-1] = values[0]
    airfoil_writer.write(path, wings.Airfoil('sharp', alpha, *values.T), ['by formula'])
    found = run(tmp_path, path)
    assert found['flags'] == ['MAY_NOT_BE_UNIQUE']
    assert 'EXCEEDED' in capsys.readouterr().out
    assert found['reynolds'] is None


def test_finite_wing_and_symmetric_section(tmp_path, files, capsys):
    flat = run(tmp_path, files / 'xfoil.txt', '--extend', '--aspect-ratio', 6)
    section = run(tmp_path, files / 'xfoil.txt', '--extend', '--cd90', 1.98)
    at_90 = flat['table']['alpha_deg'].index(90.0)
    assert flat['table']['cd'][at_90] == pytest.approx(1.1 + 0.018 * 6)
    assert section['table']['cd'][at_90] == pytest.approx(1.98)
    mirrored = run(tmp_path, files / 'xfoil.txt', '--extend', '--symmetric')
    assert mirrored['zero_lift_deg'] == pytest.approx(0.0, abs=1e-9)
    assert mirrored['table']['cl'] == [-cl for cl in mirrored['table']['cl'][::-1]]


@pytest.mark.parametrize(('words', 'message'), [
    (['xfoil.txt'], 'covers -13 to 17 deg only: give --extend'),
    (['xfoil.txt', '--clmax', '1.4'], '--clmax is of the extension: give --extend'),
    (['xfoil.txt', '--extend', '--measured', 'measured.csv'], '--measured is drawn: give --plot'),
    (['xfoil.txt', '--extend', '--symmetric', '--clmin', '-1.0'], '--symmetric has one stall'),
    (['xfoil.txt', '--extend', '--aspect-ratio', '6', '--cd90', '2.0'], 'give no --cd90'),
    (['gone.csv'], 'found no file'),
    (['measured.csv', '--extend'], 'has no column cd')])
def test_what_cannot_be_done_is_said_in_one_line(files, monkeypatch, capsys, words, message):
    monkeypatch.chdir(files)
    assert cli.main(['airfoil', *words]) == 2
    said = capsys.readouterr().err
    assert message in said and said.count('\n') == 1


@pytest.mark.parametrize('words', [
    ['x', '--clmax', '9'], ['x', '--alpha-stall', '30'], ['x', '--wing', '12'],
    ['x', '--wing', '12,21'], ['x', '--clmin', '1'], ['x', '--import', 'excel']])
def test_options_out_of_reach_are_refused(words, capsys):
    with pytest.raises(SystemExit) as end:
        cli.main(['airfoil', *words])
    assert end.value.code == 2 and capsys.readouterr().err.count('\n') == 1
