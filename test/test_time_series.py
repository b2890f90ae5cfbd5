# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""A flight to CSV and .mat: what is read back is what was flown, also by way of a bag."""

import csv
import json

import numpy as np
import pytest
from scipy import io

from poststall_sim import cli, flight_export, time_series
from poststall_sim.aircraft import ConfigError
from poststall_sim.time_series import FlightSeries, Series, Strips


def read_csv(path):
    """Return columns by head, as anyone's reader gives them."""
    with path.open(newline='') as file:
        head, *rows = csv.reader(file)
    return dict(zip(head, np.array(rows, dtype=float).T))


@pytest.fixture(scope='module')
def flown(tmp_path_factory):
    """Return the folder of a flight in wind, with all that can be written of it."""
    folder = tmp_path_factory.mktemp('flight')
    words = ['fly', '--duration', '0.4', '--wind', '1,-2,0.5']
    for option, name in (('json', 'flight.json'), ('csv', 'flight.csv'), ('mat', 'flight.mat')):
        words += [f'--{option}', str(folder / name)]
    assert cli.main(words) == 0
    return folder


def test_csv_has_the_series_of_the_json_with_units_in_the_heads(flown):
    told = json.loads((flown / 'flight.json').read_text())['series']
    columns = read_csv(flown / 'flight.csv')
    assert next(iter(columns)) == 'time [s]'
    for key, values in told.items():
        name, unit = flight_export.named(key)
        assert columns[f'{name} [{unit}]'] == pytest.approx(values, rel=1e-9), key
    assert {'airspeed [m/s]', 'pitch_rate [deg/s]', 'elevator [deg]', 'throttle [-]', 'CL [-]',
            'force_z [N]', 'thrust_moment_y [N m]', 'density [kg/m^3]',
            'acceleration_x [m/s^2]'} <= set(columns)
    # Weightless it is not: lift carries it, along z of the body.
    assert columns['force_z [N]'][0] == pytest.approx(-9.0 * 9.8, rel=0.05)
    assert set(columns['wind_north [m/s]']) == {-2.0} and set(columns['wind_up [m/s]']) == {0.5}


def test_mat_has_the_same_and_the_strips(flown):
    told = io.loadmat(flown / 'flight.mat', simplify_cells=True)
    columns = read_csv(flown / 'flight.csv')
    for head, values in columns.items():
        name, _, unit = head.partition(' [')
        assert told[name] == pytest.approx(values, rel=1e-9, abs=1e-12)
        assert told['units'][name] == unit.rstrip(']')
    strips = told['strips']
    steps, count = strips['cl'].shape
    assert steps == len(told['time']) and count == len(strips['y']) == len(strips['surface'])
    assert strips['alpha'].shape == strips['decambering'].shape == (steps, count)
    assert strips['units']['alpha'] == 'deg' and strips['units']['circulation'] == 'm^2/s'
    # Strips go from left to right, y to the left; their lift is the aircraft's.
    wing = strips['surface'] == 'wing'
    assert np.all(np.diff(strips['y'][wing]) < 0.0) and wing.sum() == 20
    whole = np.sum(strips['cl'][0, wing] * strips['chord'][wing]) / strips['chord'][wing].sum()
    assert whole == pytest.approx(told['CL'][0], rel=0.05)


def test_a_bag_gives_the_flight_that_was_flown(tmp_path):
    pytest.importorskip('rosbags', reason='bags need rosbags')
    bag = tmp_path / 'bag'
    files = [str(tmp_path / name) for name in ('a.csv', 'a.mat', 'b.csv', 'b.mat')]
    assert cli.main(['fly', '--duration', '0.4', '--wind', '1,-2,0.5', '--record', str(bag),
                     '--csv', files[0], '--mat', files[1]]) == 0
    assert cli.main(['export', str(bag), '--csv', files[2], '--mat', files[3],
                     '--json', str(tmp_path / 'told.json')]) == 0
    flown, read = (read_csv(tmp_path / name) for name in ('a.csv', 'b.csv'))
    # What a bag's topics do not have, or not at the rate of the state.
    assert set(flown) - set(read) == {
        'stalled_wing_strips [-]', 'iterations [-]', 'residual [rad]', 'density [kg/m^3]',
        'not_converged_steps [-]',
        *(f'{name}_commanded [deg]' for name in ('aileron', 'elevator', 'rudder'))}
    for head, values in read.items():
        # In ROS axes and back: rounding, of angles near 0 too.
        assert values == pytest.approx(flown[head], rel=1e-6, abs=1e-6), head
    a, b = (io.loadmat(tmp_path / name, simplify_cells=True)['strips']
            for name in ('a.mat', 'b.mat'))
    for name in ('y', 'chord', 'surface'):
        assert np.array_equal(a[name], b[name]), name
    # Two rates, whose messages now and then are of the same step.
    same, here, there = np.intersect1d(np.round(1e9 * a['time']), np.round(1e9 * b['time']),
                                       return_indices=True)
    assert same.size >= 3
    for name in ('cl', 'cd', 'cm', 'alpha', 'decambering', 'circulation', 'stalled'):
        assert b[name][there] == pytest.approx(a[name][here], abs=1e-9), name
    told = json.loads((tmp_path / 'told.json').read_text())
    assert told['units']['alpha'] == 'deg' and told['name'] == 'trainer'


def test_what_is_not_known_is_blank(tmp_path):
    flight = FlightSeries('plane', {
        'time': Series(np.array([0.0, 0.1]), 's'),
        'alpha': Series(np.array([np.nan, 2.0]), 'deg')},
        Strips(np.zeros(1), np.zeros(2), ('wing', 'wing')))
    time_series.write_csv(tmp_path / 'a.csv', flight)
    assert (tmp_path / 'a.csv').read_text() == 'time [s],alpha [deg]\n0,\n0.1,2\n'
    time_series.write_mat(tmp_path / 'a.mat', flight)
    assert 'chord' not in io.loadmat(tmp_path / 'a.mat', simplify_cells=True)['strips']


def test_files_that_cannot_be_written_and_exports_of_nothing_are_told(tmp_path, capsys):
    flight = FlightSeries('plane', {'time': Series(np.zeros(1), 's')})
    with pytest.raises(ConfigError, match='cannot be written'):
        time_series.write_csv(tmp_path / 'none' / 'a.csv', flight)
    assert cli.main(['export', str(tmp_path)]) == 2
    assert 'give --csv or --mat' in capsys.readouterr().err
    assert cli.main(['export', str(tmp_path), '--csv', str(tmp_path / 'a.csv')]) == 2
    assert 'is not a bag' in capsys.readouterr().err
