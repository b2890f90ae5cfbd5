# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""A flight written to a file and gone on with: the same to the bit, or refused in one line."""

import dataclasses
import json
import math
import os
import zipfile

import numpy as np
import pytest
import wings

from poststall_sim import flight_file, simulation
from poststall_sim.aero import model as models
from poststall_sim.aero.model import Settings
from poststall_sim.aircraft import ConfigError
from poststall_sim.cli import main
from poststall_sim.state import Controls
from poststall_sim.weather import Weather

WIND = np.array([3.0, -2.0, 0.5])


@pytest.fixture(scope='module')
def flown():
    """Return a flight that has stalled: 60 steps of a pulled elevator in the wind."""
    flight = simulation.start(wings.shipped_aircraft('trainer'), airspeed=15.0, altitude=300.0,
                              weather=Weather(WIND))
    pull(flight, 60)
    return flight


def pull(flight, steps):
    """Fly on with the elevator moving, and return all that is measured at the end."""
    for _ in range(steps):
        deflections = flight.trim.deflections.copy()
        deflections[1] -= math.radians(12.0 + 3.0 * math.sin(flight.snapshot.time))
        flight.step(Controls(deflections, flight.trim.throttle))
    return dict(flight_file._arrays('', flight.saved()))


def same(first, second):
    """Tell whether two arrays agree to the bit; NaN stands for `by the static curve`."""
    return first.shape == second.shape and first.tobytes() == second.tobytes()


def test_flight_goes_on_from_its_file_to_the_bit(flown, tmp_path):
    """Fifty steps on, every number of the state, the wake's and the snapshot's included."""
    flight_file.save_state(flown, tmp_path / 'a.npz')
    resumed = flight_file.load_state(flown.model, tmp_path / 'a.npz')
    assert resumed is not flown and resumed.snapshot.time == flown.snapshot.time
    here, there = pull(flown, 50), pull(resumed, 50)
    assert here.keys() == there.keys() and len(here) > 40
    for key, value in here.items():
        assert same(value, there[key]), key
    # A reset leads to the same beginning as well.
    flown.reset()
    resumed.reset()
    again = dict(flight_file._arrays('', resumed.saved()))
    for key, value in dict(flight_file._arrays('', flown.saved())).items():
        assert same(value, again[key]), key


def test_paused_flight_stays_paused(flown, tmp_path):
    """Ground contact is remembered with its reason."""
    saved = dataclasses.replace(flown.saved(), paused_reason='ground contact, tested')
    flight = simulation.Flight.resumed(flown.model, saved)
    flight_file.save_state(flight, tmp_path / 'p.npz')
    again = flight_file.load_state(flown.model, tmp_path / 'p.npz')
    assert again.paused_reason == 'ground contact, tested'
    assert again.step(again.trim) is again.snapshot


def test_file_is_replaced_whole_or_not_at_all(flown, tmp_path):
    """Nothing half-written is left, and a folder that is not there is one line."""
    path = tmp_path / 'a.npz'
    for _ in range(2):
        flight_file.save_state(flown, path)
    assert [each.name for each in tmp_path.iterdir()] == ['a.npz']
    with pytest.raises(ConfigError, match=r'b\.npz: cannot be written: No such file'):
        flight_file.save_state(flown, tmp_path / 'none' / 'b.npz')


def changed(path, **arrays):
    """Write a file's arrays again with some of them exchanged, or left out with None."""
    with np.load(path) as file:
        kept = {key: file[key] for key in file.files} | arrays
    np.savez(path, **{key: value for key, value in kept.items() if value is not None})


def test_wrong_files_are_refused_in_one_line(flown, tmp_path):
    """Another format, aircraft or setting; truncated; something else; a field missing."""
    path = tmp_path / 'a.npz'

    def refused(message, model=flown.model):
        with pytest.raises(ConfigError, match=message) as caught:
            flight_file.load_state(model, path)
        assert '\n' not in str(caught.value)

    refused('there is no file')
    path.write_text('not a flight')
    refused('not the state of a flight')
    np.savez(path, a=1)
    refused('not the state of a flight')
    flight_file.save_state(flown, path)
    whole = path.read_bytes()
    path.write_bytes(whole[:len(whole) // 2])
    refused('not the state of a flight')
    path.write_bytes(whole)
    changed(path, format=np.array(flight_file.FORMAT + 1))
    refused(f'format {flight_file.FORMAT + 1}, expected {flight_file.FORMAT}')
    path.write_bytes(whole)
    changed(path, **{'state.body.q_NB': None})
    refused('state.body.q_NB is missing')
    path.write_bytes(whole)
    changed(path, format=np.array([flight_file.FORMAT] * 2))
    refused('not the state of a flight')
    path.write_bytes(whole)
    changed(path, **{'state.time_ns': np.zeros(2, dtype=np.int64)})
    refused('a field is not of its type or shape')
    path.write_bytes(whole)
    with zipfile.ZipFile(path, 'a') as packed:
        packed.writestr('format', 'two')
    refused('not the state of a flight|format')
    path.write_bytes(whole)
    aircraft = flown.model.aircraft
    heavier = dataclasses.replace(
        aircraft, mass=dataclasses.replace(aircraft.mass, mass=1.01 * aircraft.mass.mass))
    refused('another aircraft', models.build(heavier, flown.model.settings))
    refused('chordwise=4.*not .*chordwise=3', models.build(aircraft, Settings(chordwise=3)))


@pytest.mark.parametrize(('name', 'place', 'value'), [
    ('state.body.position_N', 0, math.nan), ('state.flow.wake.drift_N', 1, math.inf),
    ('state.flow.circulation', 3, math.nan), ('snapshot.force_B', 2, math.nan),
    ('weather.wind_N', 0, -math.inf), ('state.flow.share', 0, math.inf)])
def test_what_is_not_finite_is_refused_by_its_name(flown, tmp_path, name, place, value):
    """But NaN where that says that the static curve holds, as in every file of a test here."""
    path = tmp_path / 'a.npz'
    flight_file.save_state(flown, path)
    with np.load(path) as file:
        array = file[name].copy()
        assert np.isnan(file['state.flow.share']).any()
    array.flat[place] = value
    changed(path, **{name: array})
    with pytest.raises(ConfigError) as caught:
        flight_file.load_state(flown.model, path)
    assert str(caught.value) == f'{path}: {name} is not finite'


@pytest.mark.parametrize('name', ['position_N', 'velocity_B', 'rates_B', 'q_NB'])
def test_a_state_that_is_not_finite_pauses_the_flight_as_diverged(flown, name):
    flight = simulation.Flight.resumed(flown.model, flown.saved())
    before = flight.snapshot
    body = dataclasses.replace(flight.state.body, **{
        name: np.full_like(getattr(flight.state.body, name), math.nan)})
    flight.state = dataclasses.replace(flight.state, body=body)
    assert flight.step(flight.trim) is before
    assert 'diverged' in flight.paused_reason


def test_what_is_no_regular_file_or_too_large_is_not_opened(flown, tmp_path, monkeypatch):
    """A pipe would block whoever opens it; a small file may unpack to more than there is."""
    pipe, large = tmp_path / 'pipe.npz', tmp_path / 'large.npz'
    os.mkfifo(pipe)
    with open(large, 'wb') as file:
        file.truncate(flight_file.GREATEST + 1)   # sparse
    for path, message in ((pipe, 'not a regular file'), (tmp_path, 'not a regular file'),
                          (large, f'{flight_file.GREATEST + 1} bytes, more than any flight')):
        with pytest.raises(ConfigError, match=message):
            flight_file.load_state(flown.model, path)
        if path is not large:
            with pytest.raises(ConfigError, match=message):
                flight_file.save_state(flown, path)
    os.mkfifo(tmp_path / 'a.npz.part')
    with pytest.raises(ConfigError, match=r'a\.npz\.part: not a regular file'):
        flight_file.save_state(flown, tmp_path / 'a.npz')
    monkeypatch.setattr(flight_file, 'GREATEST', 100_000)
    np.savez_compressed(large, format=np.zeros(100_000))
    assert large.stat().st_size < 10_000
    with pytest.raises(ConfigError, match='bytes unpacked, more than any flight'):
        flight_file.load_state(flown.model, large)


def test_command_saves_and_resumes(tmp_path, capsys):
    """Two halves of a scenario end where the whole does, to the bit."""
    state, end = tmp_path / 'half.npz', {}
    fly = ['fly', '--aircraft', 'trainer', '--wind', '2,1,0']
    for name, arguments in (
            ('whole', [*fly, '--duration', '2']),
            ('first', [*fly, '--duration', '1', '--save', str(state)]),
            ('second', [*fly[:3], '--duration', '2', '--resume', str(state)])):
        assert main([*arguments, '--json', str(tmp_path / f'{name}.json')]) == 0
        series = json.loads((tmp_path / f'{name}.json').read_text())['series']
        end[name] = {key: values[-1] for key, values in series.items()}
    assert end['second'] == end['whole'] != end['first']
    assert main([*fly[:3], '--duration', '1', '--resume', str(state)]) == 2
    assert main([*fly[:3], '--airspeed', '15', '--resume', str(state)]) == 2
    said = capsys.readouterr().err
    assert 'the flight ends at 1 s: give --duration' in said
    assert '--airspeed has no effect with --resume' in said
