# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""Actuators and failures of a simulator over DDS, and the parameters that ask for them."""

import math

import numpy as np
import pytest
import wings

from poststall_sim.aircraft import ConfigError
from poststall_sim.ros import surfaces
from poststall_sim.ros.parameters import SimulatorSettings

pytest.importorskip('rclpy', reason='rclpy is not installed')

from processes import Reports, nanoseconds, send_until
from sensor_msgs.msg import JointState
from std_srvs.srv import Trigger

DEG = math.radians(1.0)
TAU = 0.05


def test_parameters_take_the_place_of_the_aircrafts_limits_and_actuators():
    trainer = wings.shipped_aircraft('trainer')
    same = surfaces.with_controls(trainer, SimulatorSettings())
    assert [each.actuator for each in same.controls] == [
        each.actuator for each in trainer.controls]
    moved = surfaces.with_controls(trainer, SimulatorSettings(
        servo_tau=(0.1,), surface_rate_limits_deg=(100.0, 200.0, 0.0)))
    assert [each.actuator.time_constant for each in moved.controls] == [0.1] * 3
    assert [each.actuator.rate_limit / DEG for each in moved.controls] == pytest.approx(
        [100.0, 200.0, math.inf])
    own = [control.limits for control in trainer.controls]
    assert [control.limits for control in moved.controls] == own
    held = surfaces.with_controls(trainer, SimulatorSettings(
        surface_limits_deg=(5.0, -1.0, 0.0)))
    assert [control.limits for control in held.controls] == [(-5.0 * DEG, 5.0 * DEG), *own[1:]]
    assert [part.travel for part in held.movables[:2]] == [(-5.0 * DEG, 5.0 * DEG)] * 2
    everywhere = surfaces.with_controls(trainer, SimulatorSettings(surface_limits_deg=(40.0,)))
    assert {control.limits for control in everywhere.controls} == {(-40.0 * DEG, 40.0 * DEG)}
    with pytest.raises(ConfigError, match='parameter surface_limits_deg: must be one number, or '):
        surfaces.with_controls(trainer, SimulatorSettings(surface_limits_deg=(5.0, 5.0)))
    with pytest.raises(ConfigError, match='parameter servo_tau: must be one number, or one for '
                       'each of the 3 controls aileron, elevator, rudder; got 2'):
        surfaces.with_controls(trainer, SimulatorSettings(servo_tau=(0.1, 0.2)))


@pytest.mark.ros
@pytest.mark.timeout(300)
def test_surfaces_lag_and_fail_as_the_parameters_say(start, probe):
    start('simulator', ros=[
        '-p', 'start_paused:=true', '-p', 'rates.diagnostics:=20.0', '-p', 'rates.state:=1000.0',
        '-p', f'servo_tau:=[{TAU}]', '-p', 'surface_rate_limits_deg:=[300, 300, 300]',
        '-p', 'surface_limits_deg:=[8, 0, 0]',
        '-p', 'command.timeout:=1000.0'])
    heard = {name: probe.collect(JointState, name, 1000)
             for name in ('joint_states', 'joint_targets', 'surface_states')}
    probe.spin_until(lambda: all(heard.values()), 'the first state')
    reports, command = Reports(probe), probe.publisher(JointState, 'pilot/surface_cmd')
    dt = reports.number('pace', 'dt_s')

    def seen():
        return {name: dict(zip(found[-1].name, found[-1].position))
                for name, found in heard.items()}

    def step():
        said = probe.call(Trigger, 'step').message
        time_ns = round(1e9 * float(said.split()[-2]))
        probe.spin_until(lambda: all(nanoseconds(found[-1].header.stamp) == time_ns
                                     for found in heard.values()), said)
        return seen()

    trim = seen()['joint_states']
    assert list(seen()['surface_states']) == [
        'aileron_right', 'aileron_left', 'elevator_right', 'elevator_left', 'rudder']
    assert reports.level('controls') == 0
    send_until(probe, command, JointState(name=['aileron'], position=[0.1]),
               lambda: reports.number('commands', 'accepted') > 0, 'the command')
    for k in range(1, 4):
        found = step()
        expected = 0.1 * (1.0 - math.exp(-k * dt / TAU))
        assert found['joint_targets']['aileron'] == 0.1
        assert found['joint_states']['aileron'] == pytest.approx(expected, rel=1e-9)
        assert found['surface_states']['aileron_right'] == pytest.approx(-expected, rel=1e-9)

    # Of a command beyond the limit that the parameter has set, it is the limit that is flown to.
    send_until(probe, command, JointState(name=['aileron'], position=[0.3]),
               lambda: reports.number('commands', 'beyond_limits') > 0, 'the cut')
    for _ in range(3):
        found = step()
        assert found['joint_targets']['aileron'] == 8.0 * DEG > found['joint_states']['aileron']

    assert probe.set_parameter('failures', ['aileron_right:stuck', 'elevator:stuck=-5']).successful
    stuck = found['surface_states']['aileron_right']
    found = step()
    assert found['surface_states']['aileron_right'] == stuck
    assert found['surface_states']['aileron_left'] > -stuck
    assert found['joint_states']['elevator'] == pytest.approx(-5.0 * DEG)
    assert found['joint_targets']['elevator'] == pytest.approx(trim['elevator'])
    reports.wait_for('controls', 'failed', 'aileron_right:stuck, elevator:stuck=-5')
    assert reports.level('controls') == 1 and 'failed: ' in reports.message('controls')

    refused = probe.set_parameter('failures', ['flap:lost'])
    assert not refused.successful and "nothing is named 'flap'" in refused.reason
    refused = probe.set_parameter('failures', ['rudder:loose'])
    assert not refused.successful and 'must be one of stuck, float, lost' in refused.reason
    assert probe.set_parameter('failures', ['']).successful
    reports.wait_for('controls', 'failed', '')
    found = step()
    assert found['joint_states']['elevator'] == pytest.approx(trim['elevator'])
    assert np.isfinite(list(found['surface_states'].values())).all()
