# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""
What the launch files start: the same nodes with the same arguments, and the files themselves.

The launch system comes with ROS 2 and not with pip. Where it is missing, what it would start is
started here by hand, in the form in which it hands parameters over: files, the last of them first.
"""

import dataclasses
import os
import runpy
import signal
import subprocess
import sys
from pathlib import Path

import pytest
import yaml

pytest.importorskip('rclpy', reason='rclpy is not installed')

from geometry_msgs.msg import PoseStamped, WrenchStamped
from processes import Probe, Reports, environment, free_domain, nanoseconds, send_until
from rcl_interfaces.srv import GetParameters
from rclpy.parameter import parameter_value_to_python
from sensor_msgs.msg import JointState, Joy

from poststall_sim import topics
from poststall_sim.aircraft import ConfigError
from poststall_sim.ros import launching
from poststall_sim.ros.air_settings import AirSettings
from poststall_sim.ros.parameters import SimulatorSettings
from poststall_sim.ros.sensor_settings import SensorSettings

ROOT = Path(__file__).resolve().parents[1]
PARAMETERS = ROOT / 'config' / 'simulator.yaml'

# What `ros2 launch poststall_sim sim.launch.py` says if nothing is said to it.
DEFAULTS = {
    'aircraft': '', 'real_time_factor': '', 'altitude': '', 'scenario': 'stall_and_recovery',
    'params_file': str(PARAMETERS), 'namespace': '', 'follow_clock': 'false',
    'autopilot': 'false', 'joystick': 'false', 'bag': 'false', 'rviz': 'false',
    'foxglove': 'false'}


def flat(tree, above=''):
    """Return the leaves of nested parameters by their dotted names."""
    result = {}
    for name, value in tree.items():
        result |= flat(value, f'{above}{name}.') if isinstance(value, dict) else {
            above + name: value}
    return result


@pytest.fixture(scope='module')
def shipped():
    """Return the parameters of the shipped file, by name."""
    return flat(yaml.safe_load(PARAMETERS.read_text())['/**/simulator']['ros__parameters'])


def test_the_shipped_parameter_file_names_defaults_of_parameters_that_there_are(shipped):
    defaults = {field.metadata['name']: field.default
                for kind in (SimulatorSettings, SensorSettings, AirSettings)
                for field in dataclasses.fields(kind)}
    for name, value in shipped.items():
        value = tuple(value) if isinstance(value, list) else value
        assert (name, type(value), value) == (name, type(defaults[name]), defaults[name])


def test_arguments_become_parameters():
    def parameters(**given):
        return launching.simulator_parameters({**DEFAULTS, **given})

    assert parameters() == {}          # all is as the parameter file says
    assert parameters(aircraft='747', real_time_factor='2', altitude='300') == {
        'aircraft': '747', 'real_time_factor': 2.0, 'initial.altitude': 300.0}
    assert parameters(namespace='/left') == parameters(namespace='left') == {
        'frames.prefix': 'left/'}
    assert parameters(joystick='true') == {'joy.enabled': True}
    assert parameters(follow_clock='True') == {'publish_clock': False, 'use_sim_time': True}
    assert launching.scenario_flies(DEFAULTS)
    assert not launching.scenario_flies({**DEFAULTS, 'autopilot': '1'})
    assert not launching.scenario_flies({**DEFAULTS, 'joystick': 'true'})
    with pytest.raises(ConfigError, match="joystick: must be true or false, got 'yes'"):
        parameters(joystick='yes')
    with pytest.raises(ConfigError, match="real_time_factor: must be a number, got 'fast'"):
        parameters(real_time_factor='fast')


@pytest.mark.ros
@pytest.mark.timeout(300)
def test_two_aircraft_share_time_and_nothing_else(start, probe, shipped, tmp_path):
    """As two_aircraft.launch.py; a stick flies the left one, an autopilot the right one."""
    def launched(namespace, **given):
        own = tmp_path / f'{namespace}.yaml'
        own.write_text(yaml.safe_dump({f'/{namespace}/simulator': {
            'ros__parameters': launching.simulator_parameters(
                {**DEFAULTS, 'namespace': namespace, **given})}}))
        return start('simulator', ros=[
            '-r', '__node:=simulator', '-r', f'__ns:=/{namespace}',
            '--params-file', str(PARAMETERS), '--params-file', str(own)])

    simulators = [launched('left', joystick='true', altitude='150.0'),
                  launched('right', follow_clock='true', altitude='170.0')]
    sides = ('left', 'right')
    poses = [probe.collect(PoseStamped, f'/{side}/pose') for side in sides]
    wrenches = [probe.collect(WrenchStamped, f'/{side}/wrench') for side in sides]
    joints = [probe.collect(JointState, f'/{side}/joint_states') for side in sides]
    probe.spin_until(lambda: all(map(len, poses + wrenches + joints)), 'two aircraft')
    assert [side[0].header.frame_id for side in poses] == ['map', 'map']
    assert [side[0].header.frame_id for side in wrenches] == ['left/base_link', 'right/base_link']
    assert [side[0].pose.position.z for side in poses] == pytest.approx([150.0, 170.0], abs=0.1)

    # One clock, which both live by.
    reports = Reports(probe, 'right/simulator')
    probe.spin_until(lambda: reports.heard, 'diagnostics')
    assert probe.node.count_publishers('/clock') == 1
    assert reports.level('flight') == topics.Level.OK
    starts = [nanoseconds(side[-1].header.stamp) for side in poses]
    for side, begin in zip(poses, starts):
        probe.spin_until(lambda side=side, begin=begin: nanoseconds(
            side[-1].header.stamp) > begin + 500_000_000, 'both to fly')

    def shared():
        left, right = ({nanoseconds(pose.header.stamp) for pose in side} for side in poses)
        return left & right
    # Of one dt and one time: the stamps are the same.
    probe.spin_until(lambda: len(shared()) > 20, 'stamps that both bear')

    # What nobody overrode is as the file says.
    names = [name for name in shipped if name not in ('joy.enabled', 'initial.altitude')]
    answer = probe.call(GetParameters, '/left/simulator/get_parameters', names=names)
    assert [list(value) if isinstance(shipped[name], list) else value
            for name, value in zip(names, map(parameter_value_to_python, answer.values))] == [
                shipped[name] for name in names]

    # Each is flown by its own: the stick's elevator on the left, a bank on the right.
    def deflection(side, name):
        return dict(zip(joints[side][-1].name, joints[side][-1].position))[name]

    trim = deflection(1, 'elevator')
    assert probe.node.count_subscribers('/right/joy') == 0
    stick = probe.publisher(Joy, '/left/joy')
    pulled = Joy(axes=[0.0, 0.0, 0.0, 0.0, -0.2], buttons=[0] * 8)
    begin = deflection(0, 'elevator')
    send_until(probe, stick, pulled, lambda: deflection(0, 'elevator') < begin - 0.03,
               'the stick to be obeyed')
    assert {dict(zip(joint.name, joint.position))['elevator'] for joint in joints[1]} == {trim}
    start('autopilot', ros=['-r', '__node:=autopilot', '-r', '__ns:=/right',
                            '-p', 'use_sim_time:=true', '-p', 'hold.roll:=0.3'])
    probe.spin_until(lambda: abs(deflection(1, 'aileron')) > 0.01, 'the autopilot to be obeyed')
    assert {dict(zip(joint.name, joint.position))['aileron'] for joint in joints[0]} == {0.0}
    for simulator in simulators:
        simulator.send(signal.SIGINT)
    assert [simulator.ended() for simulator in simulators] == [0, 0]
    for simulator in simulators:
        assert 'there is no parameter' not in simulator.says()


LAUNCHER = """
import sys
from launch import LaunchDescription, LaunchService
from launch.actions import IncludeLaunchDescription
from launch.launch_description_sources import PythonLaunchDescriptionSource

service = LaunchService()
service.include_launch_description(LaunchDescription([IncludeLaunchDescription(
    PythonLaunchDescriptionSource(sys.argv[1]),
    launch_arguments=[tuple(each.split(':=')) for each in sys.argv[2:]])]))
sys.exit(service.run())
"""


@pytest.mark.ros
@pytest.mark.timeout(300)
@pytest.mark.parametrize(('name', 'arguments', 'topic', 'frame'), [
    ('sim', ['altitude:=300.0'], '/wrench', 'base_link'),
    ('sim', ['namespace:=left', 'autopilot:=true'], '/left/wrench', 'left/base_link'),
    ('two_aircraft', [], '/right/wrench', 'right/base_link')])
def test_launch_file_starts_a_flight(name, arguments, topic, frame, tmp_path):
    pytest.importorskip('launch_ros', reason='launch comes with ROS 2, pip has it not')
    index = pytest.importorskip('ament_index_python')
    try:
        index.get_package_share_directory('poststall_sim')
    except index.PackageNotFoundError:
        pytest.skip('the package is not installed in a ROS workspace: build it with colcon')
    domain = free_domain()
    log = tmp_path / 'launch.log'
    with open(log, 'wb') as output:
        launched = subprocess.Popen(
            [sys.executable, '-c', LAUNCHER, str(ROOT / f'launch/{name}.launch.py'), *arguments],
            env=environment(domain), stdin=subprocess.DEVNULL, stdout=output,
            stderr=subprocess.STDOUT, start_new_session=True)
    probe = Probe(domain)
    try:
        heard = probe.collect(WrenchStamped, topic)
        probe.spin_until(lambda: heard or launched.poll() is not None, topic)
        assert heard, log.read_text()
        assert heard[0].header.frame_id == frame
        launched.send_signal(signal.SIGINT)
        launched.wait(20.0)
    finally:
        probe.close()
        if launched.poll() is None:
            os.killpg(launched.pid, signal.SIGKILL)


def test_launch_file_offers_its_arguments():
    pytest.importorskip('launch_ros', reason='launch comes with ROS 2, pip has it not')
    module = runpy.run_path(ROOT / 'launch/sim.launch.py')
    arguments = module['generate_launch_description']().get_launch_arguments()
    assert [each.name for each in arguments] == list(DEFAULTS)
