# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""The command `modes`: what it prints and writes, its complaints, its figure."""

import json
import math
from pathlib import Path

import numpy as np
import pytest

from poststall_sim import cli, modal_analysis
from poststall_sim.stability.modes import plain

ROOT = Path(__file__).resolve().parents[1]
FEW = ['--strips', 'wing=8', '--strips', 'tail=4', '--strips', 'fin=3', '--panels', '2',
       '--wake', '30']
"""A lattice on which a point takes a fraction of a second."""
NAMES = {'short period', 'phugoid', 'Dutch roll', 'roll', 'spiral'}


def result(tmp_path, *words, code=0):
    """Run the command in this process and return what it writes as JSON."""
    path = tmp_path / 'modes.json'
    assert cli.main(['modes', *FEW, *words, '--json', str(path)]) == code
    return json.loads(path.read_text(), parse_constant=pytest.fail)


@pytest.fixture(scope='module')
def glides(tmp_path_factory):
    return result(tmp_path_factory.mktemp('modes'), 'trainer', '--alpha', '4:20:8',
                  '--decambering', 'all', '--quasi-steady')


def test_there_is_a_point_for_each_angle_and_model(glides):
    assert glides['aircraft'] == 'trainer' and glides['wake'] == 'prescribed'
    assert [(p['alpha_deg'], p['decambering']) for p in glides['points']] == [
        (alpha, model) for alpha in (4.0, 12.0, 20.0)
        for model in ('fixed', 'variable', 'lagged', 'quasi-steady')]
    for point in glides['points']:
        assert set(point) == {'alpha_deg', 'trim', 'decambering', 'status', 'message',
                              'departed', 'dt_s', 'wake_rows', 'residual', 'modes'}
        assert point['wake_rows'] == (None if point['decambering'] == 'quasi-steady' else 30)
        assert (point['status'], point['message']) == ('converged', 'found')
        assert point['residual'] < 1e-8
        assert {plain(mode['name']) for mode in point['modes']} >= NAMES
        trim = point['trim']
        assert trim['kind'] == 'glide' and trim['climb_angle_deg'] < 0.0
        assert {len(column) for column in trim['strips'].values()} == {8 + 4 + 3}


def test_numbers_of_a_mode_fit_each_other(glides):
    for mode in (mode for point in glides['points'] for mode in point['modes']):
        assert set(mode) == {'name', 'real', 'imag', 'omega_n', 'zeta', 'stable',
                             'time_to_half_or_double_s', 'period_s', 'share', 'participation'}
        assert mode['imag'] >= 0.0 and 0.0 <= mode['share'] <= 1.0
        assert mode['omega_n'] == pytest.approx(math.hypot(mode['real'], mode['imag']))
        assert mode['zeta'] == pytest.approx(-mode['real'] / mode['omega_n'])
        assert mode['stable'] is (mode['real'] < 0.0)
        assert mode['time_to_half_or_double_s'] == pytest.approx(
            math.log(2.0) / abs(mode['real']))
        if mode['imag']:
            assert mode['period_s'] == pytest.approx(2.0 * math.pi / mode['imag'])
        else:
            assert mode['period_s'] is None   # infinite, which JSON has not
        assert sum(mode['participation'].values()) == pytest.approx(1.0)


def test_before_the_stall_the_models_agree_and_past_it_they_part(glides):
    found = {(p['alpha_deg'], p['decambering']): {m['name']: m for m in p['modes']}
             for p in glides['points']}
    slow = [found[4.0, model]['phugoid'] for model in ('fixed', 'variable', 'quasi-steady')]
    assert np.ptp([mode['imag'] for mode in slow]) < 0.05
    fixed, variable = (found[20.0, model]['roll']['real'] for model in ('fixed', 'variable'))
    assert variable > 0.5 * fixed   # the damping in roll is all but gone


def test_the_table_has_a_row_for_each_point_and_marks_the_wakes_modes(capsys, tmp_path):
    points = result(tmp_path, 'trainer', '--alpha', '4:8:4')['points']
    lines = capsys.readouterr().out.splitlines()
    assert lines[0].split()[:5] == ['alpha', '[deg]', 'V', '[m/s]', 'decambering']
    assert all(f'{name} [1/s]' in lines[0] for name in NAMES)
    assert [line.split()[:3] for line in lines[1:3]] == [
        [f'{p["alpha_deg"]:.2f}', f'{p["trim"]["airspeed_m_s"]:.2f}', 'variable'] for p in points]
    for point, line in zip(points, lines[1:3]):
        for mode in point['modes']:
            if plain(mode['name']) in NAMES:
                pair = f'+-{mode["imag"]:.3f}i' if mode['imag'] else ''
                assert f'{mode["real"]:z.3f}{pair}{"~" if mode["share"] < 0.5 else ""}' in line
    assert any('~ less than half' in line for line in lines) is any(
        mode['share'] < 0.5 for point in points for mode in point['modes']
        if not mode['name'].startswith('wake'))


def test_each_option_changes_the_modes(tmp_path):
    def phugoid(*words):
        point, = result(tmp_path, '--aircraft', 'trainer', '--alpha', '12', *words)['points']
        return point['trim']['airspeed_m_s'], *(
            value for mode in point['modes'] if mode['name'] == 'phugoid'
            for value in (mode['real'], mode['imag']))

    ways = {words: phugoid(*words) for words in (
        (), ('--level',), ('--climb', '5'), ('--altitude', '2000'), ('--dt', '0.02'),
        ('--decambering', 'fixed'), ('--decambering', 'lagged'), ('--no-decambering',),
        ('--decambering', 'lagged', '--lag', '1'), ('--wake', '12'), ('--closure', 'local'))}
    assert len(set(ways.values())) == len(ways)


def test_a_trim_that_fails_is_a_row_that_says_why(tmp_path, capsys):
    points = result(tmp_path, 'trainer', '--alpha', '12:40:28')['points']
    assert [p['status'] for p in points] == ['converged', 'not_converged']
    assert points[1]['modes'] == [] and points[1]['residual'] is None
    said = capsys.readouterr()
    assert points[1]['message'] in said.out and '1 of 2 points have no modes' in said.err
    result(tmp_path, 'trainer', '--alpha', '40', code=1)
    assert 'poststall: no modes: ' in capsys.readouterr().err


@pytest.mark.parametrize('words, message', [
    (['trainer', '--alpha', '5:1:1'], 'step must lead from A to B'),
    (['trainer', '--alpha', '80'], 'must be -40 to 50, got 80'),
    (['trainr'], 'did you mean trainer'),
    (['--decambering', 'late'], "invalid choice: 'late'"),
    (['--lag', '2'], '--lag is for --decambering lagged or all'),
    (['--decambering', 'lagged', '--lag', '0'], 'lag must be 0.001 to 100 chords'),
    (['--decambering', 'fixed', '--no-decambering'], '--decambering has no effect with --no'),
    (['--level', '--climb', '3'], 'not allowed with argument --level'),
    (['wing_tail', '--level', '--alpha', '4'], 'wing_tail has no engine'),
    (['--wake', '1'], 'must be 2 to 2000, got 1'),
    (['--dt', '0'], 'must be 1e-05 to 1, got 0'),
    (['--plot', 'x.foo'], "expected a name that ends in .png, .svg, .pdf, got 'x.foo'"),
])
def test_bad_input_is_one_line_and_code_2(words, message, capsys):
    try:
        code = cli.main(['modes', *words])
    except SystemExit as end:
        code = end.code
    said = capsys.readouterr()
    assert (code, said.out) == (2, '')
    assert message in said.err and said.err.count('\n') == 1


def test_an_aircraft_without_an_elevator_is_refused(tmp_path, capsys):
    text = (ROOT / 'config/aircraft/wing_tail.yaml').read_text().replace('elevator:', 'tab:')
    (tmp_path / 'tabbed.yaml').write_text(text)
    (tmp_path / 'naca4415_re3e6.csv').write_text(
        (ROOT / 'config/airfoils/naca4415_re3e6.csv').read_text())
    assert cli.main(['modes', str(tmp_path / 'tabbed.yaml'), '--alpha', '4']) == 2
    assert 'trim moves the control named elevator' in capsys.readouterr().err


def test_decambering_that_lags_by_itself_is_no_mode_of_the_body(tmp_path):
    """
    Its eigenvalues stand close together at -V / (lag chord) and have next to nothing of the body.

    Newton's method for a quick mode of the body may run into them.
    """
    for aircraft, alpha in (('wing_tail', 5.0), ('trainer', 19.0)):
        path = tmp_path / f'{aircraft}.json'
        assert cli.main(['modes', aircraft, '--alpha', f'{alpha}', '--decambering', 'lagged',
                         '--json', str(path)]) == 0
        point, = json.loads(path.read_text())['points']
        short, = (mode for mode in point['modes'] if mode['name'] == 'short period')
        assert short['imag'] > 0.2 and 0.5 < short['share'] <= 1.0
        chord = 1.0 if aircraft == 'wing_tail' else 0.4
        lag = -point['trim']['airspeed_m_s'] / (3.0 * chord)
        near = [mode['share'] for mode in point['modes'] if abs(mode['real'] / lag - 1.0) < 1e-4]
        assert all(share < 0.3 for share in near)


def test_a_frozen_wake_is_another_model(tmp_path):
    """Past the stall the spiral's wake, which turns with sideslip, makes a part of it."""
    found = [result(tmp_path, 'trainer', '--alpha', '20', *words)
             for words in ([], ['--frozen-wake'])]
    assert [each['wake'] for each in found] == ['prescribed', 'frozen']
    air, frozen = ({m['name']: m for m in each['points'][0]['modes']} for each in found)
    assert frozen['spiral']['real'] < 0.98 * air['spiral']['real']


@pytest.mark.parametrize('order', [None, 24])
def test_the_linear_system_goes_into_a_file(tmp_path, order):
    """At the last angle, with the eigenvalues of the modes that are printed."""
    path = tmp_path / 'trainer.npz'
    words = [] if order is None else ['--order', str(order)]
    found = result(tmp_path, 'trainer', '--alpha', '14:20:3', '--export', str(path), *words)
    spiral = next(m for m in found['points'][-1]['modes'] if m['name'] == 'spiral')
    with np.load(path) as file:
        values = np.log(np.linalg.eigvals(file['a']).astype(complex) + 1e-300) / file['dt']
        assert math.degrees(file['trim_alpha']) == pytest.approx(20.0)
        assert list(file['inputs'])[:3] == ['aileron', 'elevator', 'rudder']
        assert (int(file['order']) == -1) is (order is None)
    assert np.abs(values - spiral['real']).min() < 1e-2 * spiral['real']


def test_the_table_says_where_a_branch_has_ended():
    point = {'alpha_deg': 1.0, 'trim': {'airspeed_m_s': 10.0}, 'decambering': 'fixed',
             'status': 'converged', 'message': 'found; ended at a fold', 'departed': True,
             'modes': []}
    _, (row,) = modal_analysis.table([point])
    assert row[-1] == 'found; ended at a fold'


def test_the_table_puts_split_and_coupled_modes_under_their_branch():
    def mode(name, real):
        return {'name': name, 'real': real, 'imag': 0.0, 'share': 1.0}

    point = {'alpha_deg': 1.0, 'trim': {'airspeed_m_s': 10.0}, 'decambering': 'fixed',
             'status': 'converged', 'message': 'found', 'departed': False,
             'modes': [mode('coupled short period, fast', -4.0), mode('short period, slow', -2.0),
                       mode('phugoid, slow + spiral', -1.0), mode('wake 1', -9.0)]}
    head, (row,) = modal_analysis.table([point])
    assert head == ('alpha [deg]', 'V [m/s]', 'decambering', 'short period [1/s]',
                    'phugoid, slow + spiral [1/s]', '')
    assert row[3:] == ['-4.000 , -2.000 ', '-1.000 ', '']
