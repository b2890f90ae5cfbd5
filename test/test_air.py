# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""The air from a scenario or the command line to all that depends on it, and where it ends."""

import json
import math
import re
from dataclasses import replace
from pathlib import Path

import instants
import numpy as np
import pytest
import wings

from poststall_sim import cli, definition, simulation, trim
from poststall_sim.aero import model as models
from poststall_sim.atmosphere import STANDARD, Air, Atmosphere, standard_air
from poststall_sim.envelope import exceeded
from poststall_sim.instruments import Instruments
from poststall_sim.records import ConfigError
from poststall_sim.sensors import Errors, Origin
from poststall_sim.stability import flight
from poststall_sim.topics import BAROMETER
from poststall_sim.turbulence import Spectrum, military
from poststall_sim.weather import GustShape, ShearLaw

HOT = Atmosphere(temperature_offset=30.0, sea_level_pressure=99000.0)
SCENARIO = """
name: rough
duration_s: 2.0
initial: {airspeed_m_s: 15.0, altitude_m: 100.0}
air:
  temperature_offset_K: 10.0
  sea_level_pressure_Pa: 100000.0
  wind_enu_m_s: [3.0, -1.0, 0.0]
  shear: {law: logarithmic, roughness_m: 0.05}
  gusts:
    - {velocity_enu_m_s: [0, 0, 2], length_m: 5, begin_m: 20}
    - {velocity_enu_m_s: [1, 0, 0], length_m: 2, begin_m: 4, heading_deg: 90, shape: rise}
  turbulence: {spectrum: von_karman, level: moderate, seed: 4}
"""


@pytest.fixture(scope='module')
def model():
    return models.build(wings.shipped_aircraft('trainer'))


def scenario(tmp_path, text=SCENARIO):
    (tmp_path / 'rough.yaml').write_text(text)
    return definition.scenario(tmp_path / 'rough.yaml')


def test_thin_air_is_flown_at_the_same_dynamic_pressure(model):
    """A glide at one angle is another airspeed only, in the trim and in the derivatives."""
    hot = replace(model, atmosphere=HOT)
    alpha = math.radians(5.0)
    standard, thin = (trim.glide(each, alpha=alpha, altitude=300.0) for each in (model, hot))
    density = standard_air(300.0).density / HOT.at(300.0).density
    assert density > 1.1
    assert thin.airspeed == pytest.approx(standard.airspeed * math.sqrt(density), rel=1e-6)
    assert thin.controls.deflections == pytest.approx(standard.controls.deflections, abs=1e-6)
    # Thin air damps roll less: the rate goes with density times airspeed.
    roll = [next(mode for mode in flight.quasi_steady_modes(each, at, altitude=300.0).modes
                 if mode.name.startswith('roll')).eigenvalue.real
            for each, at in ((model, standard), (hot, thin))]
    assert roll[1] / roll[0] == pytest.approx(1.0 / math.sqrt(density), rel=0.03)


def test_flight_and_barometer_are_in_the_air_of_the_model(model):
    flown = simulation.start(model.aircraft, airspeed=16.0, altitude=300.0, atmosphere=HOT)
    snapshot = flown.step(flown.trim)
    assert snapshot.air == HOT.at(snapshot.body.altitude)
    lift = -snapshot.force_B[2]
    assert lift == pytest.approx(model.aircraft.mass.mass * 9.80665, rel=0.03)
    sensors = Instruments({BAROMETER: Errors(1000.0, [0.0], [0.0], 0.0)}, Origin(0.0, 0.0, 0.0), 1,
                          instants.a_layout())
    (_, said), = sensors.step(snapshot)
    assert said['fluid_pressure'] == snapshot.air.pressure < standard_air(300.0).pressure - 1900.0


def test_a_scenario_has_its_air(tmp_path):
    read = scenario(tmp_path)
    assert read.atmosphere == Atmosphere(10.0, 100000.0)
    weather = read.weather
    assert weather.wind_N.tolist() == [-1.0, 3.0, 0.0]
    assert (weather.shear.law, weather.shear.constant) == (ShearLaw.LOGARITHMIC, 0.05)
    up, east = weather.gusts
    assert up.velocity_N.tolist() == [0.0, 0.0, -2.0] and up.direction_N.tolist() == [1.0, 0, 0]
    assert east.direction_N == pytest.approx([0.0, 1.0, 0.0], abs=1e-15)
    assert (up.shape, east.shape) == (GustShape.ONE_MINUS_COSINE, GustShape.RISE)
    expected = military(Spectrum.VON_KARMAN, 1.54333, altitude=100.0, seed=4)
    for name in ('horizontal', 'vertical', 'horizontal_scale', 'vertical_scale', 'seed'):
        assert getattr(weather.turbulence, name) == pytest.approx(
            getattr(expected, name), rel=1e-5), name
    calm = scenario(tmp_path, SCENARIO[:SCENARIO.index('air:')])
    assert calm.weather.uniform and not calm.weather.wind_N.any()
    assert calm.atmosphere == STANDARD
    own = scenario(tmp_path, SCENARIO.replace('level: moderate', 'sigma_m_s: 2, scale_m: 30'))
    assert (own.weather.turbulence.horizontal, own.weather.turbulence.vertical_scale) == (2, 30)


def test_the_example_of_the_documentation_is_read(tmp_path):
    text = (Path(__file__).parents[1] / 'docs' / 'air.md').read_text(encoding='utf-8')
    example, = re.findall(r'^```yaml\n(.*?)^```', text, re.MULTILINE | re.DOTALL)
    read = scenario(tmp_path, example)
    assert len(read.weather.gusts) == 2 and read.weather.turbulence.seed == 1
    assert read.atmosphere == Atmosphere(15.0, 100500.0)
    for line in re.findall(r'^poststall (.*)', text, re.MULTILINE):
        assert cli.parse(line.split()).command == 'fly'


@pytest.mark.parametrize('old, new, message', [
    ('temperature_offset_K: 10.0', 'temperature_offset_K: 288', 'air: temperature offset must be'),
    ('sea_level_pressure_Pa: 100000.0', 'sea_level_pressure_Pa: 1013', '50000 to 150000 Pa, got'),
    ('wind_enu_m_s: [3.0', 'wind_enu_m_s: [300', 'air.wind_enu_m_s[0]: must be within -100'),
    ('law: logarithmic', 'law: log', 'air.shear.law: must be one of power, logarithmic'),
    ('roughness_m: 0.05', 'exponent: 0.05', 'key roughness_m must be there'),
    ('length_m: 5', 'length_m: 0', 'air.gusts[0]: gust: length must be'),
    ('begin_m: 4', 'begin_s: 4', 'air.gusts[1]: unknown key begin_s with value 4'),
    ('level: moderate', 'level: rough', 'air.turbulence.level: must be one of light, moderate'),
    ('level: moderate, ', '', 'air.turbulence: expected either level or sigma_m_s, got neither'),
    ('seed: 4', 'seed: 0.5', 'air.turbulence.seed: must be a whole number, got 0.5'),
    ('spectrum', 'sprectum', 'did you mean spectrum'),
    ('shear:', 'sheer:', 'did you mean shear')])
def test_wrong_air_is_refused_with_its_place(tmp_path, old, new, message):
    with pytest.raises(ConfigError) as caught:
        scenario(tmp_path, SCENARIO.replace(old, new, 1))
    assert message in str(caught.value) and '\n' not in str(caught.value)


def test_fly_in_rough_air(tmp_path, capsys):
    """Same seed, same numbers; the scenario's air and the options' both arrive."""
    (tmp_path / 'rough.yaml').write_text(SCENARIO)

    def fly(*options):
        path = tmp_path / 'result.json'
        assert cli.main(['fly', '--scenario', str(tmp_path / 'rough.yaml'), '--duration', '0.4',
                         '--json', str(path), *options]) == 0
        return json.loads(path.read_text())

    first, again = fly(), fly()
    assert first['series'] == again['series']
    assert first['turbulence']['spectrum'] == 'von_karman' and first['turbulence']['seed'] == 4
    assert first['gusts'] == 2 and first['summary']['outside_the_method'] == []
    assert first['atmosphere']['temperature_offset_K'] == 10.0
    other = fly('--seed', '5', '--qnh', '990')
    assert other['series'] != first['series'] and other['turbulence']['seed'] == 5
    assert other['atmosphere']['sea_level_pressure_Pa'] == 99000.0
    own = fly('--turbulence', '0.5', '--gust', '0,0,1:2:1', '--wind', '1,0,0')
    assert own['turbulence']['vertical_m_s'] == 0.5 and own['gusts'] == 3
    assert own['wind_enu_m_s'] == [1.0, 0.0, 0.0]
    capsys.readouterr()


@pytest.mark.parametrize('options, message', [
    (['--seed', '3'], 'give --turbulence'), (['--turbulence', 'rough'], 'light, moderate, severe'),
    (['--turbulence', '-1'], 'light, moderate, severe'), (['--gust', '1,2,3'], 'LENGTH:BEGIN'),
    (['--qnh', '29.92'], '500 to 1500'), (['--gust', '0,0,200:1:1'], '-100 to 100'),
    (['--resume', 'x.npz', '--turbulence', 'light'], '--turbulence has no effect')])
def test_options_of_air_that_are_wrong_are_refused(options, message, capsys):
    try:
        code = cli.main(['fly', *options])
    except SystemExit as end:
        code = end.code
    assert code == 2
    assert message in capsys.readouterr().err


def with_tables(model, reynolds_range):
    """Return the model with section tables of other Reynolds numbers (n, 2), NaN for unknown."""
    return replace(model, lattice=replace(model.lattice, reynolds_range=reynolds_range))


def test_what_is_outside_the_method_is_said(model):
    """Mach 0.3 at 340.3 m/s of sound is 102.1 m/s; alpha counts to either side."""
    model = with_tables(model, np.full((model.lattice.strips, 2), np.nan))
    sound = Air(1.225, 1.46e-5, 101325.0, 288.15)
    fine = instants.a_snapshot(air=sound, airspeed=102.0, alpha=math.radians(39.9))
    assert exceeded(fine, model) == ()
    fast, = exceeded(replace(fine, airspeed=136.1), model)
    assert fast.text == 'Mach 0.40, above 0.3'
    assert fast.beyond == pytest.approx(4.0 / 3.0, rel=1e-3)
    steep, = exceeded(replace(fine, alpha=math.radians(-41.0)), model)
    assert steep.text == 'alpha -41 deg, beyond 40'
    both = replace(fine, airspeed=200.0, alpha=1.0)
    assert [each.quantity for each in exceeded(both, model)] == ['Mach', 'alpha']


def test_reynolds_numbers_far_from_those_of_the_tables_are_said(model):
    """Of the chord and the airspeed: within a factor of three of the tables all is well."""
    snapshot = instants.a_snapshot(air=Air(1.225, 1.5e-5, 101325.0, 288.15), airspeed=15.0)
    reynolds = 15.0 * model.lattice.strip_chord / 1.5e-5
    fine = np.column_stack([reynolds / 2.9, 2.9 * reynolds])
    far = fine.copy()
    far[3] = 6.0 * reynolds[3], 9.0 * reynolds[3]

    assert exceeded(snapshot, with_tables(model, fine)) == ()
    found, = exceeded(snapshot, with_tables(model, far))
    assert found.quantity == 'Reynolds' and found.beyond == pytest.approx(2.0)
    assert model.lattice.strip_names[3] in found.text
