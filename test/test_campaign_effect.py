# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""What a campaign refuses because it changes nothing, and that it then changes nothing indeed."""

import campaigns
import pytest
import yaml

from poststall_sim import definition
from poststall_sim.aircraft import ConfigError
from poststall_sim.campaign import cases, compute
from poststall_sim.campaign import definition as files

FLIGHT = """\
name: brief
aircraft: plane.yaml
duration_s: 0.1
initial: {airspeed_m_s: 12.0, altitude_m: 150.0, alpha_deg: 9.0, roll_rate_deg_s: 60.0}
"""
STALLED = FLIGHT.replace('alpha_deg: 9.0', 'alpha_deg: 25.0')
WIND = FLIGHT + 'air: {wind_enu_m_s: [4, 0, 1]}\n'
SHEAR = 'air: {wind_enu_m_s: [%s, 0, 0], shear: {law: power, exponent: 0.1}}\n'
LAW = STALLED + 'autopilot: example\n'
# Where a recovery is looked for, and where it is not.
RECOVERING = 'keep: {quantities: [time_to_recover_s]}\nrecovered: {hold_s: 0.0}\n'
LOSING = 'keep: {quantities: [height_lost_m, final_alpha_deg]}\n'
STEADY = 'name: brief\nkind: %s\naircraft: plane.yaml\n'
POLAR = STEADY % 'polar' + 'condition: {airspeed_m_s: 12.0, alpha_deg: 5.0}\n'
TRIM = STEADY % 'trim' + 'condition: {airspeed_m_s: 12.0}\n'
MODES = STEADY % 'modes' + 'condition: {alpha_deg: 5.0, climb_deg: 0.0}\n'
LIFT = 'keep: {quantities: [CL]}\n'


@pytest.fixture
def checked(tmp_path):
    """Give a function that writes a campaign that varies a key, and checks it."""
    tree = yaml.safe_load(definition.find('aircraft', 'trainer').read_text())
    tree['airfoils']['spare'] = tree['airfoils']['tail']
    tree['bodies'] = [{'name': 'pod', 'position_m': [0.2, 0.0, -0.1],
                       'drag_area_m2': [0.01, 0.02, 0.02]}]
    tree['controls']['elevator']['actuator'] = {'rate_limit_deg_s': 200.0,
                                                'time_constant_s': 0.05}
    (tmp_path / 'plane.yaml').write_text(yaml.safe_dump(tree))

    def check(text, key, values):
        path = campaigns.written(tmp_path, f'{text}vary:\n  - {{key: {key}, values: {values}}}\n')
        read = files.campaign(path)
        cases.check(read)
        return read
    return check


def rows(read):
    builder = cases.Builder(read)
    # Both with the seed of the first, or turbulence would tell them apart.
    found = [compute.compute(builder.case(0, values)) for values in builder.design]
    numbers = [[each.quantities.get(name) for name in read.quantities] for each in found]
    return [[-1.0 if each is None else each for each in row] for row in numbers]


CURVES = '[naca0012_re3e5.csv, naca4415_re4e5.csv]'


@pytest.mark.parametrize('text, key, values', [
    (FLIGHT, 'aircraft.airfoils.spare', CURVES),
    (FLIGHT, 'aircraft.reference.span_m', '[3.2, 4.0]'),
    (FLIGHT, 'aircraft.reference.area_m2', '[1.28, 1.4]'),
    (FLIGHT, 'aircraft.controls.elevator.actuator.time_constant_s', '[0.05, 0.2]'),
    (FLIGHT + LOSING, 'recovered.alpha_deg', '[1.0, 12.0]'),
    (FLIGHT + LOSING, 'recovered.hold_s', '[0.0, 0.5]'),
    (STALLED + LOSING, 'spin_alpha_deg', '[16.0, 60.0]'),
    (FLIGHT, 'cpu_limit_s', '[600.0, 700.0]'),
    (FLIGHT, 'settings.lag_chords', '[3.0, 5.0]'),
    (FLIGHT + SHEAR % 0, 'air.shear.exponent', '[0.1, 0.3]'),
    (POLAR, 'aircraft.airfoils.spare', CURVES),
    (POLAR, 'aircraft.mass.mass_kg', '[8.0, 9.0]'),
    (POLAR, 'aircraft.mass.inertia_kgm2.yy', '[1.4, 1.8]'),
    (POLAR, 'aircraft.engines.0.static_thrust_N', '[35.0, 40.0]'),
    (POLAR, 'condition.airspeed_m_s', '[12.0, 15.0]'),
    (POLAR, 'settings.ground', '[true, false]'),
    (POLAR + LIFT, 'aircraft.mass.cg_m.0', '[0.19, 0.2]'),
    (POLAR + LIFT, 'aircraft.reference.span_m', '[3.2, 4.0]'),
    (TRIM, 'aircraft.mass.inertia_kgm2.yy', '[1.4, 1.8]'),
    (TRIM, 'aircraft.controls.elevator.actuator.time_constant_s', '[0.05, 0.2]'),
    (MODES, 'aircraft.controls.elevator.actuator.time_constant_s', '[0.05, 0.2]'),
])
def test_a_key_that_changes_nothing_is_refused_and_changes_nothing(
        checked, monkeypatch, text, key, values):
    with pytest.raises(ConfigError, match=rf'vary\[0\].key: {key} changes nothing here'):
        checked(text, key, values)
    monkeypatch.setattr(cases, '_require_effect', lambda *_: None)
    one, other = rows(checked(text, key, values))
    # To the bit, but that another airspeed is rounded another way.
    assert one == (pytest.approx(other, rel=1e-9, abs=1e-9) if 'airspeed' in key else other)


@pytest.mark.parametrize('text, key, values', [
    (FLIGHT, 'aircraft.mass.mass_kg', '[8.0, 9.0]'),
    (FLIGHT, 'aircraft.mass.inertia_kgm2.xx', '[1.2, 1.4]'),
    (FLIGHT, 'aircraft.mass.cg_m.0', '[0.17, 0.19]'),
    (FLIGHT, 'aircraft.reference.chord_m', '[0.4, 0.3]'),   # the step is made with it
    (FLIGHT, 'aircraft.airfoils.wing', CURVES),
    (FLIGHT, 'aircraft.engines.0.static_thrust_N', '[35.0, 40.0]'),
    (FLIGHT, 'aircraft.bodies.pod.drag_area_m2.0', '[0.01, 0.05]'),
    (LAW, 'aircraft.controls.elevator.actuator.time_constant_s', '[0.05, 0.2]'),
    (LAW, 'law.recovery_alpha_gain', '[0.5, 1.0]'),
    (LAW, 'autopilot', '[none, example]'),
    (WIND, 'air.wind_enu_m_s.2', '[0.0, 2.0]'),
    (FLIGHT + SHEAR % 4, 'initial.heading_deg', '[0.0, 90.0]'),
    (FLIGHT + SHEAR % 4, 'air.shear.exponent', '[0.1, 0.3]'),
    (FLIGHT + 'air: {gusts: [{velocity_enu_m_s: [0, 0, 3], length_m: 1, begin_m: 0}]}\n',
     'air.gusts.0.velocity_enu_m_s.2', '[3.0, 5.0]'),
    (FLIGHT + 'air: {turbulence: {level: light}}\n', 'air.turbulence.level', '[light, severe]'),
    (FLIGHT, 'initial.alpha_deg', '[9.0, 12.0]'),
    (FLIGHT, 'initial.airspeed_m_s', '[12.0, 13.0]'),
    (FLIGHT + 'settings: {separation: lag}\n', 'settings.lag_chords', '[3.0, 5.0]'),
    (FLIGHT + RECOVERING, 'recovered.rate_deg_s', '[30.0, 90.0]'),
    (STALLED, 'spin_alpha_deg', '[16.0, 60.0]'),
    (FLIGHT + LOSING + 'stop: {recovered: true}\nrecovered: {rate_deg_s: 90.0, hold_s: 0.0}\n',
     'recovered.alpha_deg', '[1.0, 12.0]'),
    (FLIGHT, 'duration_s', '[0.1, 0.12]'),
    (POLAR, 'aircraft.mass.cg_m.0', '[0.17, 0.19]'),
    (POLAR, 'aircraft.reference.span_m', '[3.2, 4.0]'),
    (POLAR, 'condition.beta_deg', '[0.0, 5.0]'),
    (TRIM, 'aircraft.mass.mass_kg', '[8.0, 9.0]'),
    (TRIM, 'aircraft.engines.0.static_thrust_N', '[35.0, 40.0]'),
    (TRIM, 'condition.altitude_m', '[0.0, 1000.0]'),
    (MODES, 'aircraft.mass.inertia_kgm2.yy', '[1.4, 1.8]'),
])
def test_a_key_that_acts_is_accepted_and_acts(checked, text, key, values):
    one, other = rows(checked(text, key, values))
    assert one != other


def test_a_polar_with_curves_by_reynolds_number_goes_by_airspeed(checked, tmp_path):
    tree = yaml.safe_load((tmp_path / 'plane.yaml').read_text())
    tree['airfoils']['wing'] = ['naca4415_re4e5.csv', 'naca4415_re3e6.csv']
    (tmp_path / 'plane.yaml').write_text(yaml.safe_dump(tree))
    one, other = rows(checked(POLAR, 'condition.airspeed_m_s', '[15.0, 60.0]'))
    assert one != pytest.approx(other, rel=1e-3)


@pytest.mark.parametrize('more, key', [
    ('recovered: {alpha_deg: 10.0}\n', 'recovered'), ('spin_alpha_deg: 20.0\n', 'spin_alpha_deg')])
def test_what_is_given_once_and_looked_at_by_nothing_is_refused(checked, more, key):
    varied = ('initial.alpha_deg', '[9.0, 12.0]')
    with pytest.raises(ConfigError, match=f'{key}: changes nothing, no quantity that is kept'):
        checked(FLIGHT + LOSING + more, *varied)
    checked(FLIGHT + more, *varied)
    stop = {'recovered': 'recovered', 'spin_alpha_deg': 'spun'}[key]
    checked(FLIGHT + LOSING + more + f'stop: {{{stop}: true}}\n', *varied)
