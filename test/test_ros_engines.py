# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""An electric engine over DDS: its battery's topic, its diagnostics, its failure in flight."""

import pytest

pytest.importorskip('rclpy')

import yaml
from processes import Reports
from sensor_msgs.msg import BatteryState
from std_srvs.srv import Trigger
from test_engine_reader import ELECTRIC, TREE

pytestmark = [pytest.mark.ros, pytest.mark.timeout(300)]


def test_a_battery_shows_and_an_engine_fails_and_works_again_in_flight(start, probe, tmp_path):
    plane = tmp_path / 'electric.yaml'
    airfoils = {key: str(name) for key, name in TREE['airfoils'].items()}
    plane.write_text(yaml.safe_dump({**TREE, 'airfoils': airfoils, 'engines': [ELECTRIC]}))
    start('simulator', ros=['-p', f'aircraft:={plane}', '-p', 'uvlm.chordwise:=2', '-p',
                            'start_paused:=true', '-p', 'rates.battery:=1000.0', '-p',
                            'rates.diagnostics:=20.0', '-p', 'reset.time:=true'])
    reports = Reports(probe)
    batteries = probe.collect(BatteryState, 'battery')
    probe.spin_until(lambda: batteries, 'the battery')
    assert probe.set_parameter('step_count', 5).successful
    full = batteries[-1]
    assert full.present and full.percentage == 1.0 and full.charge == full.capacity == 5.0
    assert full.current < -1.0 and 19.8 < full.voltage < 25.2
    reports.wait_for('engines', 'nose_charge', '1')
    assert reports.message('engines') == 'at work'
    running = reports.number('engines', 'nose_rpm')
    assert running > 1000.0
    assert reports.number('engines', 'nose_current_A') == pytest.approx(-full.current, rel=1e-4)

    for text, name in (('tail', "no engine named 'tail'"), ('nose, tail', 'tail')):
        result = probe.set_parameter('engine_failures', text)
        assert not result.successful and name in result.reason
    assert probe.set_parameter('engine_failures', 'nose').successful
    assert probe.call(Trigger, 'step').success
    probe.spin_until(lambda: batteries[-1].current == 0.0, 'the failure')
    assert batteries[-1].voltage > full.voltage   # nothing sags
    probe.spin_until(lambda: reports.message('engines') == 'failed: nose', 'the report')
    assert reports.number('engines', 'nose_rpm') < running

    assert probe.set_parameter('engine_failures', '').successful
    assert probe.call(Trigger, 'step').success
    probe.spin_until(lambda: batteries[-1].current < -1.0, 'the engine')
    probe.spin_until(lambda: reports.message('engines') == 'at work', 'the report')
