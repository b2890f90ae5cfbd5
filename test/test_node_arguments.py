# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""What a node says to words that are not ROS's: help with its parameters, version, refusal."""

import dataclasses

import pytest

pytest.importorskip('rclpy')

from poststall_sim import __version__
from poststall_sim.ros import autopilot, pilot, simulator
from poststall_sim.ros.air_settings import AirSettings
from poststall_sim.ros.autopilot_settings import AutopilotSettings
from poststall_sim.ros.parameters import PilotSettings, SimulatorSettings
from poststall_sim.ros.sensor_settings import SensorSettings

NODES = {simulator: (SimulatorSettings, SensorSettings, AirSettings), pilot: (PilotSettings,),
         autopilot: (AutopilotSettings,)}


@pytest.mark.parametrize('node', NODES)
def test_help_lists_every_parameter_with_its_default(node, capsys):
    with pytest.raises(SystemExit) as end:
        node.main(['--help'])
    assert end.value.code == 0
    text = capsys.readouterr().out
    assert 'exit codes' in text and '--ros-args -p NAME:=VALUE' in text
    for kind in NODES[node]:
        for field in dataclasses.fields(kind):
            assert f"\n  {field.metadata['name']} := " in text
            assert f"\n      {field.metadata['description']}" in text


@pytest.mark.parametrize('node', NODES)
def test_version_and_a_word_that_means_nothing(node, capsys):
    with pytest.raises(SystemExit) as end:
        node.main(['--version'])
    assert (end.value.code, capsys.readouterr().out) == (0, f'poststall_sim {__version__}\n')
    with pytest.raises(SystemExit) as end:
        node.main(['trainer', '--ros-args', '-p', 'aircraft:=glider'])
    assert end.value.code == 2
    complaint, = capsys.readouterr().err.splitlines()
    assert 'unrecognized arguments: trainer' in complaint and '--ros-args -p' in complaint
