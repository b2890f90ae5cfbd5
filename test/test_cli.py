# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""The command line: what it prints and writes, its units, its exit codes, its complaints."""

import importlib
import json
import math
import os
import re
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import numba
import numpy as np
import pytest

from poststall_sim import __version__, cli, definition, interrupts, jobs, simulation, terminal
from poststall_sim.aero import model as models
from poststall_sim.frames import GRAVITY

ROOT = Path(__file__).resolve().parents[1]
COMMANDS = ['polar', 'trim', 'modes', 'derivatives', 'database', 'fly', 'plot', 'export',
            'airfoil', 'campaign']


def run(*words):
    """Run the command as a user does."""
    return subprocess.run([sys.executable, '-m', 'poststall_sim.cli', *words], cwd=ROOT,
                          capture_output=True, text=True, timeout=120)


def result(tmp_path, *words, code=0):
    """Run the command in this process and return what it writes as JSON."""
    path = tmp_path / 'result.json'
    assert cli.main([*words, '--json', str(path)]) == code
    return json.loads(path.read_text())


def test_version_and_help():
    done = run('--version')
    assert (done.returncode, done.stdout) == (0, f'poststall_sim {__version__}\n')
    done = run('--help')
    assert done.returncode == 0
    assert all(name in done.stdout for name in COMMANDS)


@pytest.mark.parametrize('name', COMMANDS)
def test_help_of_each_command_gives_an_example_that_parses(name, capsys):
    with pytest.raises(SystemExit) as end:
        cli.main([name, '--help'])
    assert end.value.code == 0
    text = capsys.readouterr().out
    assert '--json' in text and 'exit codes' in text
    assert ('--aircraft' in text) != (name in ('airfoil', 'campaign'))
    example, = (line for line in text.splitlines() if line.startswith('example: '))
    words = example.split()
    assert words[1:3] == ['poststall', name]
    assert cli.parse(words[2:]).command == name


def test_as_a_user_runs_it(tmp_path):
    done = run('polar', '--aircraft', 'wing_tail', '--alpha', '-2:2:2',
               '--json', str(tmp_path / 'polar.json'))
    assert done.returncode == 0, done.stderr
    lines = done.stdout.splitlines()
    assert lines[0].split()[:5] == ['alpha', '[deg]', 'CL', 'CD', 'CY']
    assert [line.split()[0] for line in lines[1:]] == ['-2.00', '0.00', '2.00']
    points = json.loads((tmp_path / 'polar.json').read_text())['points']
    assert [f'{p["CL"]:z.4f}' for p in points] == [line.split()[1] for line in lines[1:]]


def test_json_and_plot_without_a_file(tmp_path):
    """The JSON alone is on the standard output, for a pipe; the figure is named by its command."""
    said = tmp_path / 'said'
    said.write_text('before\n')
    with open(said, 'a') as output:   # what stands there already stays
        done = subprocess.run(
            [sys.executable, '-m', 'poststall_sim.cli', 'trim', '--alpha', '4', '--json',
             '--plot'], cwd=tmp_path, stdout=output, stderr=subprocess.PIPE, text=True,
            timeout=120)
    before, _, found = said.read_text().partition('\n')
    point, = json.loads(found)['trims']
    assert before == 'before'
    assert point['alpha_deg'] == pytest.approx(4.0)
    assert 'glide' in done.stderr and 'figure trim.png' in done.stderr
    assert (tmp_path / 'trim.png').stat().st_size > 10_000


@pytest.mark.parametrize('words, message', [
    ([], 'arguments are required: COMMAND'),
    (['dive'], "invalid choice: 'dive'"),
    (['polar', '--alpha', '0:10:x'], "expected a number, got 'x'"),
    (['polar', '--alpha', '0:10:-1'], 'step must lead from A to B'),
    (['polar', '--alpha', '0:1:1e-9'], 'at most 10000'),
    (['polar', '--alpha', 'nan'], "expected a number, got 'nan'"),
    (['polar', '--aircraft', 'trainr'], 'did you mean trainer'),
    (['polar', '--deflect', 'elevator'], "expected NAME=DEG, got 'elevator'"),
    (['polar', '--deflect', 'flap=5'], "no control 'flap', it has aileron, elevator, rudder"),
    (['polar', '--deflect', 'elevator=-50'], 'elevator goes from -30 to 20 deg, got -50'),
    (['polar', '--panels', '99'], 'chordwise panels must be 1 to 32, got 99'),
    (['polar', '--airspeed', '0'], 'must be 0.1 to 400, got 0'),
    (['polar', '--airspeed', '1e300'], 'must be 0.1 to 400, got 1e+300'),
    (['polar', '--p', '1e300'], 'must be -10 to 10, got 1e+300'),
    (['polar', '--altitude', '20001'], 'must be -500 to 20000, got 20001'),
    (['polar', '--closure', 'nonlocal', '--scheme', 'D'], 'give --closure local'),
    (['polar', '--closure', 'local', '--ell', '1'], '--ell is for the non-local closure'),
    (['polar', '--damping', '0.5'], '--damping is for schemes A to D'),
    (['polar', '--scheme', 'A', '--damping', '1.5'], 'damping must be above 0 and at most 1'),
    (['polar', '--start', 'schemeA1'], '--start schemeA1 is for schemes A to D'),
    (['polar', '--start', 'given'], 'expected zero, schemeA1, previous or given=FILE'),
    (['polar', '--start', 'given=no_such_file'], 'no_such_file'),
    (['polar', '--start', 'zero', '--sweep', 'updown'], 'it goes with --start previous'),
    (['polar', '--ell', 'wings=2'], "no surface 'wings', there are wing, tail, fin"),
    (['polar', '--ell', '-1'], 'ell must be 0 to 10 chords'),
    (['polar', '--ell', '=2'], 'expected N or NAME=N'),
    (['polar', '--strips', 'wing=7'], 'even on a symmetric surface, got 7'),
    (['polar', '--strips', 'wing=x'], "expected a whole number from 0 on, got 'x'"),
    (['polar', '--starts', '-3'], 'expected a whole number'),
    (['trim'], 'trim needs --airspeed (powered), --alpha (glide) or both'),
    (['trim', '--airspeed', '-5'], 'must be 0.1 to 400, got -5'),
    (['fly', '--scenario', 'loop'], "found no file 'loop' in scenarios"),
    (['fly', '--wind', '1,2'], "expected E,N,U, got '1,2'"),
    (['plot', 'no_such_bag'], 'there is no bag no_such_bag'),
    (['plot', 'config'], 'config is not a bag: it has no metadata.yaml'),
    (['plot', 'bag', '--output', 'README.md'], 'expected a folder, README.md is a file'),
    (['plot', 'bag', '--output', 'README.md/figures'], 'README.md is a file'),
    (['fly', '--wind', '0,0,1e3'], 'each must be -100 to 100, got 1000'),
    (['fly', '--altitude', '1e9'], 'must be 0.1 to 20000, got 1e+09'),
    (['fly', '--altitude', '0'], 'must be 0.1 to 20000, got 0'),
    (['fly', '--duration', '1e308'], 'must be 0.001 to 1e+06'),
    (['trim', '--airspeed', '15', '--climb', '91'], 'must be -90 to 90, got 91'),
    (['trim', '--all', '--alpha', '5'], '--all is of straight flight at an airspeed'),
    (['trim', '--aircraft', 'wing_tail', '--airspeed', '30', '--climb', '2'],
     'wing_tail has no engine: --climb has no effect'),
    (['trim', '--airspeed', '12', '--failed', 'engine_1', '--climb', '2'],
     'trainer has no engine that works: --climb has no effect'),
    (['trim', '--aircraft', 'wing_tail', '--airspeed', '30', '--throttle', '0.5'],
     'wing_tail has no engine: --throttle has no effect'),
    (['polar', '--no-decambering', '--closure', 'local'], '--closure has no effect with --no'),
    (['polar', '--no-decambering', '--scheme', 'D'], '--scheme has no effect with --no'),
    (['polar', '--no-decambering', '--start', 'zero'], '--start has no effect with --no'),
    (['polar', '--seed', '0'], '--seed is of the random starts: give --starts'),
    (['polar', '--deflect', 'elevator=1', '--deflect', 'elevator=2'], 'elevator is given twice'),
    (['polar', '--start', 'given=/nope'], 'there is no file /nope'),
    (['polar', '--plot', 'x.foo'], "expected a name that ends in .png, .svg, .pdf, got 'x.foo'"),
    (['polar', '--plot', 'config'], "expected a file, 'config' is a folder"),
    (['trim', '--plot', 'no_such_folder/x.png'], 'there is no folder no_such_folder'),
    (['fly', '--json', 'config'], "expected a file, 'config' is a folder"),
    (['fly', '--csv', 300 * 'x'], 'File name too long'),
    (['fly', '--csv', '-'], 'expected a file: - is for --json'),
    (['fly', '--save', '/dev/null'], "expected a file, '/dev/null' is none"),
    (['fly', '--resume', 'x', '--wind', '0,0,1'], '--wind has no effect with --resume'),
    (['polar', '--alpha', '-1e308:1e308'], 'at most 10000'),
    (['watch', '--port', 400 * '9'], 'expected a whole number'),
    (['airfoil', 'naca4415_re4e5', '--softness', '0'], '--softness is of the extension'),
    (['fly', '--json', 'no_such_folder/x.json'], 'there is no folder no_such_folder'),
])
def test_bad_input_is_one_line_and_code_2(words, message, capsys):
    try:
        code = cli.main(words)
    except SystemExit as end:
        code = end.code
    said = capsys.readouterr()
    assert code == 2
    assert said.out == ''
    assert message in said.err
    *patience, complaint = said.err.splitlines()
    assert complaint.startswith('poststall')
    assert all(line.endswith(' ...') for line in patience), 'on a machine that is slow to compile'
    assert 'Traceback' not in said.err


def test_a_broken_aircraft_file_is_one_line_that_names_file_and_key(tmp_path, capsys):
    path = tmp_path / 'broken.yaml'
    path.write_text((ROOT / 'config/aircraft/trainer.yaml').read_text()
                    .replace('mass_kg: 9.0', 'mass_kg: -9.0'))
    for airfoil in (ROOT / 'config/airfoils').glob('*.csv'):
        shutil.copy(airfoil, tmp_path)
    assert cli.main(['trim', '--aircraft', str(path), '--airspeed', '15']) == 2
    said = capsys.readouterr().err
    assert 'broken.yaml' in said and 'mass' in said and '-9' in said and said.count('\n') == 1


def test_ranges_keep_their_ends_and_their_direction():
    assert cli.parse(['polar', '--alpha', '-4:4:2']).alpha == [-4.0, -2.0, 0.0, 2.0, 4.0]
    assert cli.parse(['polar', '--alpha', '2:0']).alpha == [2.0, 1.0, 0.0]
    assert cli.parse(['polar', '--alpha', '0:0.3:0.1']).alpha == [0.0, 0.1, 0.2, 0.3]
    assert cli.parse(['polar', '--alpha=-7']).alpha == [-7.0]
    assert cli.parse(['fly', '--wind', '-1,2,-3']).wind.tolist() == [-1.0, 2.0, -3.0]


def test_polar_writes_every_point_with_its_strips(tmp_path):
    found = result(tmp_path, 'polar', '--alpha', '2:20:6', '--beta', '3')
    assert found['aircraft'] == 'trainer' and found['settings']['panels'] == 4
    assert (found['closure'], found['scheme']) == ('nonlocal', 'newton')
    assert 'centre of gravity' in found['axes']
    assert [p['alpha_deg'] for p in found['points']] == pytest.approx([2.0, 8.0, 14.0, 20.0])
    for point in found['points']:
        assert set(point) == {
            'alpha_deg', 'beta_deg', 'CL', 'CD', 'CY', 'Cl', 'Cm', 'Cn', 'CDi_far',
            'iterations', 'status', 'max_residual', 'uniqueness', 'flags', 'stalled_strips',
            'strips'}
        assert point['status'] == 'converged' and point['max_residual'] <= 1e-5
        assert set(point['strips']) == {
            'surface', 'y_m', 'alpha_deg', 'cl', 'delta_deg', 'residual', 'stalled'}
        assert {len(column) for column in point['strips'].values()} == {33}
        assert point['strips']['surface'] == ['wing'] * 20 + ['tail'] * 8 + ['fin'] * 5
        assert point['strips']['y_m'][0] == pytest.approx(1.52)   # the left tip comes first
        assert point['uniqueness'] > 0.0 and point['flags'] == []
        # Wind from the right: to the left, left wing down (dihedral), nose into the wind.
        assert point['CY'] < 0.0 and point['Cl'] < 0.0 and point['Cn'] > 0.0
    slope = (found['points'][1]['CL'] - found['points'][0]['CL']) / math.radians(6.0)
    assert 4.0 < slope < 2.0 * math.pi
    assert found['points'][-1]['stalled_strips'] >= 10


def test_coefficients_do_not_depend_on_airspeed_and_altitude(tmp_path):
    slow = result(tmp_path, 'polar', '--alpha', '5')['points'][0]
    fast = result(tmp_path, 'polar', '--alpha', '5', '--airspeed', '60',
                  '--altitude', '3000')['points'][0]
    for key in jobs.COEFFICIENTS:
        assert fast[key] == pytest.approx(slow[key], abs=1e-5)


def test_deflections_are_degrees_trailing_edge_down(tmp_path):
    neutral, down = (result(tmp_path, 'polar', '--alpha', '0', *words)['points'][0]
                     for words in ([], ['--deflect', 'elevator=5', '--deflect', 'aileron=5']))
    assert down['CL'] > neutral['CL'] and down['Cm'] < neutral['Cm']
    assert down['Cl'] > neutral['Cl'] + 0.01   # a positive aileron rolls to the right


def test_attached_flow_goes_on_rising(tmp_path):
    with_stall, without = (
        [p['CL'] for p in result(tmp_path, 'polar', '--alpha', '12:24:12', *words)['points']]
        for words in ([], ['--no-decambering']))
    assert with_stall[1] < with_stall[0] < without[0] < without[1]


def test_local_closure_and_its_options_reach_the_solver(tmp_path):
    found = result(tmp_path, 'polar', '--alpha', '5', '--closure', 'local', '--panels', '6')
    assert (found['closure'], found['scheme']) == ('local', 'robust')
    assert found['settings'] == {
        'panels': 6, 'closure': 'local', 'strips': {'wing': 20, 'tail': 8, 'fin': 5},
        'ell_chords': 1.0, 'decambering': True, 'axial_wake': False, 'as_avl': False,
        'angle_form': 'exact', 'damping': 1.0,
        'symmetric': False, 'tolerance': models.Settings().tolerance,
        'limit': models.Settings().limit}


@pytest.mark.parametrize('scheme', 'ABCD')
def test_schemes_agree_in_attached_flow_and_say_who_they_are(tmp_path, scheme):
    robust, found = (result(tmp_path, 'polar', '--aircraft', 'wing_tail', '--alpha', '4', *words)
                     for words in (['--closure', 'local'],
                                   ['--scheme', scheme, '--damping', '0.8', '--symmetric']))
    assert (found['closure'], found['scheme']) == ('local', scheme)
    assert found['settings']['damping'] == 0.8 and found['settings']['symmetric'] is True
    assert found['points'][0]['CL'] == pytest.approx(robust['points'][0]['CL'], abs=1e-4)


def test_each_option_of_the_solver_changes_a_result(tmp_path):
    def point(*words):
        return result(tmp_path, 'polar', '--aircraft', 'wing_tail', '--alpha', '22',
                      *words)['points'][0]

    plain = point()
    for words in (['--ell', '2'], ['--ell', 'wing=0.5'], ['--strips', '12'],
                  ['--strips', 'wing=40'], ['--panels', '2'], ['--angle-form', 'linear'],
                  ['--p', '0.05'], ['--q', '0.01'], ['--r', '0.05'], ['--beta', '5'],
                  ['--closure', 'local'], ['--no-decambering']):
        changed = point(*words)
        assert any(abs(changed[key] - plain[key]) > 1e-4 for key in jobs.COEFFICIENTS), words
    assert len(point('--strips', 'wing=40', '--strips', 'tail=8')['strips']['cl']) == 48
    by_scheme = ['--scheme', 'D', '--tolerance', '1e-3']
    ways = [point(*by_scheme, *words) for words in (
        [], ['--damping', '0.5'], ['--start', 'schemeA1'], ['--tolerance', '1e-2'])]
    assert len({(way['iterations'], way['max_residual']) for way in ways}) == 4
    assert point(*by_scheme, '--limit', '500')['status'] == 'converged'


def test_rates_have_the_signs_of_the_body_axes(tmp_path):
    still, rolling, pitching = (
        result(tmp_path, 'polar', '--alpha', '4', *words)['points'][0]
        for words in ([], ['--p', '0.05'], ['--q', '0.01']))
    assert rolling['Cl'] < still['Cl'] - 0.01 and pitching['Cm'] < still['Cm'] - 0.01


def test_too_few_iterations_are_marked_and_end_with_1(tmp_path, capsys):
    found = result(tmp_path, 'polar', '--alpha', '22', '--scheme', 'D', '--limit', '1', code=1)
    assert found['points'][0]['status'] == 'not_converged'
    said = capsys.readouterr()
    assert '! ' in said.out and 'not_converged' in said.out and 'did not converge' in said.err


def test_powered_trim_carries_the_weight(tmp_path, capsys):
    trim, = result(tmp_path, 'trim', '--airspeed', '15', '--climb', '5')['trims']
    assert trim['trimmed'] and trim['message'] == 'trimmed' and trim['residual'] < 1e-6
    assert trim['climb_angle_deg'] == pytest.approx(5.0)
    assert trim['sink_rate_m_s'] == pytest.approx(-15.0 * math.sin(math.radians(5.0)))
    assert -30.0 < trim['elevator_deg'] < 20.0 and 0.0 < trim['throttle'] < 1.0
    assert trim['controls']['elevator_deg'] == trim['elevator_deg']
    # Lift and the part of the thrust across the path balance the weight's.
    lift = trim['CL'] * 0.5 * 1.225 * 15.0 ** 2 * 1.28
    push = 35.0 * trim['throttle'] * 0.5 * math.sin(math.radians(trim['alpha_deg']))
    assert lift + push == pytest.approx(9.0 * GRAVITY * math.cos(math.radians(5.0)), rel=2e-3)
    assert 'trimmed' in capsys.readouterr().out


def test_glides_fall_along_drag_over_lift(tmp_path):
    trims = result(tmp_path, 'trim', '--alpha', '2:14:4', '--aircraft', 'wing_tail')['trims']
    for trim in trims:
        assert trim['kind'] == 'glide' and trim['throttle'] == 0.0
        assert math.tan(math.radians(-trim['climb_angle_deg'])) == pytest.approx(
            trim['CD'] / trim['CL'], rel=1e-6)
    assert [t['alpha_deg'] for t in trims] == pytest.approx([2.0, 6.0, 10.0, 14.0])


def test_without_a_trim_it_says_why_and_ends_with_1(tmp_path, capsys):
    trim, = result(tmp_path, 'trim', '--airspeed', '6', code=1)['trims']
    assert not trim['trimmed']
    said = capsys.readouterr()
    assert trim['message'] in said.out and trim['message'] in said.err
    assert 'its limits are' in trim['message']
    assert cli.main(['trim', '--airspeed', '3']) == 1
    said = capsys.readouterr().err
    assert 'no balance found' in said and 'too slow or too fast?' in said


def test_a_throttle_of_0_is_one(tmp_path):
    """An option that says 0 is given: at this airspeed the aircraft glides."""
    held, = result(tmp_path, 'trim', '--airspeed', '15', '--throttle', '0')['trims']
    assert held['throttle'] == 0.0 and held['airspeed_m_s'] == 15.0
    assert math.tan(math.radians(-held['climb_angle_deg'])) == pytest.approx(
        held['CD'] / held['CL'], rel=1e-3)


def test_a_reader_who_has_seen_enough_hears_no_complaint(monkeypatch):
    """As in `poststall ... | true`: what is printed goes out at the end."""
    read, write = os.pipe()
    os.close(read)
    with open(write, 'w') as pipe:
        monkeypatch.setattr(sys, 'stdout', pipe)
        assert cli.main(['airfoil', 'naca4415_re4e5']) == 0


def test_without_an_engine_it_glides(tmp_path):
    trim, = result(tmp_path, 'trim', '--aircraft', 'wing_tail', '--airspeed', '30')['trims']
    assert trim['kind'] == 'glide' and trim['trimmed'] and trim['throttle'] == 0.0
    assert trim['airspeed_m_s'] == 30.0
    assert math.tan(math.radians(-trim['climb_angle_deg'])) == pytest.approx(
        trim['CD'] / trim['CL'], rel=1e-5)
    scenario = a_scenario(tmp_path, 'elevator: {relative: true, points_deg: [[0, 0]]}')
    series = result(tmp_path, 'fly', '--aircraft', 'wing_tail', '--airspeed', '30',
                    '--scenario', scenario)['series']
    assert series['sink_rate_m_s'][-1] == pytest.approx(trim['sink_rate_m_s'], rel=0.01)


def a_scenario(tmp_path, channel):
    """Write a scenario of 0.2 s with one channel and return its file."""
    path = tmp_path / 'short.yaml'
    path.write_text('name: short\nduration_s: 0.2\ninitial: {airspeed_m_s: 15.0, '
                    'altitude_m: 100.0}\nchannels:\n  ' + channel + '\n')
    return str(path)


@pytest.mark.parametrize('channel, message', [
    ('elevator: {relative: false, points_deg: [[0, 20], [0.1, 80]]}',
     'scenario short: elevator goes from -30 to 20 deg, got 80'),
    ('throttle: {relative: false, points: [[0, 1.5]]}', 'must be within 0 to 1, got 1.5'),
    ('elevator: {relative: true, points_deg: [[0, 0], [0.3, 1]]}',
     'elevator has a point at 0.3 s, the scenario ends at 0.2 s')])
def test_a_scenario_that_cannot_be_flown_as_written_is_refused(tmp_path, capsys, channel, message):
    assert cli.main(['fly', '--scenario', a_scenario(tmp_path, channel)]) == 2
    said = capsys.readouterr().err
    assert message in said and said.count('\n') == 1


def test_limits_themselves_and_relative_values_beyond_them_are_flown(tmp_path):
    for channel in ('elevator: {relative: false, points_deg: [[0, 20], [0.2, -30]]}',
                    'elevator: {relative: true, points_deg: [[0, 0], [0.2, 60]]}'):
        path = a_scenario(tmp_path, channel)
        assert result(tmp_path, 'fly', '--scenario', path)['summary']['steps'] > 10


def test_a_flight_tells_what_it_did(tmp_path, capsys):
    found = result(tmp_path, 'fly', '--duration', '0.5', '--airspeed', '16', '--altitude', '80',
                   '--wind', '1,-2,0')
    summary, series = found['summary'], found['series']
    assert summary['steps'] == math.ceil(0.5 / summary['dt_s'] - 1e-9)
    assert summary['flown_s'] == pytest.approx(summary['steps'] * summary['dt_s'])
    assert summary['ended_early'] is None and summary['not_converged_steps'] == 0
    assert summary['deepest_stall'] == {'stalled_wing_strips': 0}
    assert summary['residual_max'] <= 1e-5 and summary['real_time_factor'] > 0.0
    assert len({len(values) for values in series.values()}) == 1
    assert np.diff(series['time_s']) == pytest.approx(0.02, abs=summary['dt_s'])
    assert series['airspeed_m_s'][0] == pytest.approx(16.0)
    assert series['altitude_m'][0] == pytest.approx(80.0)
    # Level flight north at 16 m/s through air that goes south at 2 m/s and east at 1 m/s.
    assert series['north_m'][-1] == pytest.approx(14.0 * series['time_s'][-1], rel=0.01)
    assert series['east_m'][-1] == pytest.approx(series['time_s'][-1], rel=0.01)
    printed = capsys.readouterr().out
    assert 'real-time factor' in printed and 'bag' not in printed


def test_a_flight_into_the_ground_ends_there(tmp_path, capsys):
    found = result(tmp_path, 'fly', '--altitude', '0.5', '--wind', '0,0,-3')
    assert found['summary']['ended_early'].startswith('ground contact')
    assert found['summary']['flown_s'] < 1.0
    assert 'ended early: ground contact' in capsys.readouterr().err


def test_a_flight_without_trim_or_with_foreign_controls_does_not_start(tmp_path, capsys):
    assert cli.main(['fly', '--airspeed', '4']) == 1
    assert 'no level trim at 4 m/s' in capsys.readouterr().err
    scenario = tmp_path / 'flaps.yaml'
    scenario.write_text(
        'name: flaps\nduration_s: 1.0\ninitial: {airspeed_m_s: 15.0, altitude_m: 100.0}\n'
        'channels: {flap: {relative: true, points_deg: [[0.0, 0.0], [1.0, 5.0]]}}\n')
    assert cli.main(['fly', '--scenario', str(scenario), '--record', str(tmp_path / 'b')]) == 2
    assert 'scenario flaps moves flap: trainer has aileron' in capsys.readouterr().err
    assert not (tmp_path / 'b').exists()


def test_a_bag_is_recorded_once_and_can_be_drawn(tmp_path, capsys):
    pytest.importorskip('rosbags', reason='bags need rosbags')
    pytest.importorskip('matplotlib', reason='figures need matplotlib')
    bag = tmp_path / 'bag'
    assert cli.main(['fly', '--duration', '0.3', '--record', str(bag)]) == 0
    assert (bag / 'metadata.yaml').exists() and str(bag) in capsys.readouterr().out
    assert cli.main(['fly', '--duration', '0.3', '--record', str(bag)]) == 2
    assert 'bag' in capsys.readouterr().err
    found = result(tmp_path, 'plot', str(bag))
    assert found['name'] == 'trainer' and found['notes'] == []
    assert found['flight']['airspeed_max_m_s'] == pytest.approx(12.0, rel=0.01)
    for path in found['figures']:
        assert Path(path).parent == tmp_path / 'bag_figures' and Path(path).stat().st_size > 10_000
    (tmp_path / 'empty').mkdir()
    capsys.readouterr()
    assert cli.main(['plot', str(tmp_path / 'empty')]) == 2
    assert capsys.readouterr().err.count('\n') == 1


def test_the_flight_is_the_one_that_the_library_flies():
    aircraft = definition.aircraft(definition.find('aircraft', 'trainer'))
    scenario = definition.scenario(definition.find('scenarios', 'stall_and_recovery'))
    flights = [simulation.start(aircraft, airspeed=15.0, altitude=100.0) for _ in range(2)]
    last = list(jobs.fly(flights[0], scenario, 0.1))[-1]
    while flights[1].snapshot.time_ns < 100_000_000:
        flights[1].step(flights[1].trim)   # nothing moves in the first second
    assert last.time_ns == flights[1].snapshot.time_ns
    np.testing.assert_array_equal(last.body.position_N, flights[1].snapshot.body.position_N)


def test_tables_have_their_units_in_the_headings(capsys):
    """Of trims what is 0 everywhere is left out: here nothing is but the pull and the turn."""
    assert cli.main(['trim', '--airspeed', '15', '--sideslip', '5', '--fail',
                     'aileron_right:stuck=2']) == 0
    head, row = (re.split(r'  +', line.strip()) for line in
                 capsys.readouterr().out.splitlines()[:2])
    assert head == ['V [m/s]', 'alpha [deg]', 'beta [deg]', 'bank [deg]', 'throttle',
                    'climb [deg]', 'sink [m/s]', 'aileron [deg]', 'elevator [deg]',
                    'rudder [deg]', 'aileron_right [deg]', 'residual']
    assert row[:2] == ['steady', '15.000']
    for words, found in ((['show'], ['sweep [deg]', 'dihedral [deg]']),
                         (['derivatives', '--alpha', '2'],
                          ['by alpha [1/rad]', 'by p b/2V', 'by elevator [1/rad]']),
                         (['polar', '--alpha', '2:4:2'], ['alpha [deg]', 'residual [rad]'])):
        assert cli.main(words) == 0
        said = capsys.readouterr().out
        assert all(each in said for each in found)


def said_while_compiling(tmp_path, monkeypatch, capsys, name, patience):
    """Import a module with kernels as if for the first time, call it, return what is said."""
    monkeypatch.syspath_prepend(tmp_path)
    sys.modules.pop(name, None)
    with terminal.telling_of_compiling(patience):
        assert importlib.import_module(name).outer(2.0) == 5.0
    return capsys.readouterr().err


@pytest.mark.skipif(numba.config.DISABLE_JIT, reason='nothing is compiled')
def test_compiling_is_said_once_where_it_takes_long_and_not_where_kernels_are_loaded(
        tmp_path, monkeypatch, capsys):
    (tmp_path / 'kernels_to_compile.py').write_text(
        'from numba import njit\n\n\n@njit(cache=True)\ndef inner(x):\n    return 2.0 * x\n\n\n'
        '@njit(cache=True)\ndef outer(x):\n    return inner(x) + 1.0\n')
    name = 'kernels_to_compile'
    assert said_while_compiling(tmp_path, monkeypatch, capsys, name, 0.0) \
        == 'compiling the solver, once: up to a minute ...\n'
    assert said_while_compiling(tmp_path, monkeypatch, capsys, name, 0.0) == ''
    (tmp_path / f'{name}.py').write_text((tmp_path / f'{name}.py').read_text() + '\n')
    assert said_while_compiling(tmp_path, monkeypatch, capsys, name, 600.0) == ''


def test_an_interrupt_in_a_call_from_the_compiler_waits_for_its_end():
    """What is raised in a function that LLVM calls is printed and lost, and the kernel too."""
    called, ended = {'__name__': 'llvmlite.binding.executionengine'}, []
    exec('def notify(raise_signal, number, ended):\n'
         '    raise_signal(number)\n'
         '    ended.append(True)\n', called)
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        with pytest.raises(KeyboardInterrupt):
            with interrupts.not_in_the_compiler():
                called['notify'](signal.raise_signal, signal.SIGINT, ended)
                assert ended
                time.sleep(10.0)
        assert signal.getsignal(signal.SIGINT) is signal.default_int_handler
    finally:
        signal.signal(signal.SIGINT, before)
