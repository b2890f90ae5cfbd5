# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""
Fly one aircraft: the simulator, who flies it, and what looks on or records if wanted.

    ros2 launch poststall_sim sim.launch.py aircraft:=trainer real_time_factor:=2.0 rviz:=true
"""

from launch import LaunchContext, LaunchDescription, LaunchDescriptionEntity
from launch.actions import DeclareLaunchArgument, ExecuteProcess, OpaqueFunction
from launch.substitutions import LaunchConfiguration, PathJoinSubstitution
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterValue
from launch_ros.substitutions import FindPackageShare

from poststall_sim.ros import launching

SHARE = FindPackageShare('poststall_sim')

ARGUMENTS = [
    DeclareLaunchArgument(
        'aircraft', default_value='',
        description='Name of a shipped aircraft, or the path of a YAML file; empty: as '
                    'params_file says.'),
    DeclareLaunchArgument(
        'real_time_factor', default_value='',
        description='Simulated seconds per second; 0 is as fast as possible; empty: as '
                    'params_file says.'),
    DeclareLaunchArgument(
        'altitude', default_value='',
        description='Where the flight begins, above the ground [m]; empty: as params_file says.'),
    DeclareLaunchArgument(
        'scenario', default_value='stall_and_recovery',
        description='Name of a shipped scenario, or the path of a YAML file.'),
    DeclareLaunchArgument(
        'params_file',
        default_value=PathJoinSubstitution([SHARE, 'config', 'simulator.yaml']),
        description='Parameters of the simulator; what other arguments say goes before it.'),
    DeclareLaunchArgument(
        'namespace', default_value='',
        description='Namespace of all that is started here, and prefix of the body frame.'),
    DeclareLaunchArgument(
        'follow_clock', default_value='false',
        description='Fly in the time of the /clock of another, and publish none.'),
    DeclareLaunchArgument(
        'autopilot', default_value='false',
        description='Let the example autopilot fly, not the pilot and his scenario.'),
    DeclareLaunchArgument(
        'joystick', default_value='false',
        description='Let a stick fly, not the pilot and his scenario; needs the package joy.'),
    DeclareLaunchArgument(
        'bag', default_value='false',
        description='Record all topics with ros2 bag, to a new folder rosbag2_* (MCAP).'),
    DeclareLaunchArgument(
        'rviz', default_value='false',
        description='Show the flight in RViz, which must be installed.'),
    DeclareLaunchArgument(
        'foxglove', default_value='false',
        description='Serve Foxglove on this machine, at ws://localhost:8765; needs the package '
                    'foxglove_bridge.'),
]
SHOWN_IN_RVIZ = ('markers', 'path', 'strips', 'wrench')


def processes(context: LaunchContext) -> list[LaunchDescriptionEntity]:
    """Return what the arguments ask for."""
    given = {argument.name: LaunchConfiguration(argument.name).perform(context)
             for argument in ARGUMENTS}
    namespace = given['namespace']
    on_clock = {'use_sim_time': True}

    def node(package: str, executable: str, parameters: dict, *files: str,
             **options: object) -> Node:
        # Bare text is read as YAML: an aircraft called `747` would come as a number.
        typed = {name: ParameterValue(value, value_type=type(value))
                 for name, value in parameters.items()}
        return Node(package=package, executable=executable, name=executable, namespace=namespace,
                    parameters=[*files, *([typed] if typed else [])], output='screen', **options)

    started = [node('poststall_sim', 'simulator', launching.simulator_parameters(given),
                    given['params_file'])]
    if launching.scenario_flies(given):
        started.append(node('poststall_sim', 'pilot', {
            'scenario': given['scenario'], **on_clock}))
    if launching.truth(given, 'autopilot'):
        started.append(node('poststall_sim', 'autopilot', on_clock))
    if launching.truth(given, 'joystick'):
        started.append(node('joy', 'joy_node', on_clock))
    if launching.truth(given, 'bag'):
        started.append(ExecuteProcess(
            cmd=['ros2', 'bag', 'record', '--all', '--use-sim-time', '--storage', 'mcap',
                 '--storage-preset-profile', 'zstd_fast'], output='screen'))
    if launching.truth(given, 'rviz'):
        view = PathJoinSubstitution([SHARE, 'config', 'rviz', 'poststall.rviz'])
        started.append(node(
            'rviz2', 'rviz2', on_clock, arguments=['-d', view],
            remappings=[(f'/{topic}', topic) for topic in SHOWN_IN_RVIZ]))
    if launching.truth(given, 'foxglove'):
        # It asks nobody who he is: by default it would serve the whole network.
        started.append(node('foxglove_bridge', 'foxglove_bridge', {
            'address': '127.0.0.1', **on_clock}))
    return started


def generate_launch_description() -> LaunchDescription:
    """Return the arguments, and what is started once they are known."""
    return LaunchDescription([*ARGUMENTS, OpaqueFunction(function=processes)])
