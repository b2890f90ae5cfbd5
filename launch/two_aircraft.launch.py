# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""
Fly two aircraft in one time: /left makes it, /right follows, 20 m higher than /left begins.

    ros2 launch poststall_sim two_aircraft.launch.py autopilot:=true bag:=true
"""

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, GroupAction, IncludeLaunchDescription
from launch.launch_description_sources import PythonLaunchDescriptionSource
from launch.substitutions import LaunchConfiguration, PathJoinSubstitution
from launch_ros.substitutions import FindPackageShare

BOTH = {
    'scenario': ('stall_and_recovery', 'Scenario that the pilots of both fly.'),
    'autopilot': ('false', 'Let example autopilots fly, not the pilots.'),
}
ONCE = {
    'real_time_factor': ('', 'Simulated seconds per second; 0 is as fast as possible.'),
    'bag': ('false', 'Record all topics of both with ros2 bag.'),
    'foxglove': ('false', 'Serve Foxglove on this machine.'),
}


def generate_launch_description() -> LaunchDescription:
    """Return the two aircraft, with their arguments."""
    one = PathJoinSubstitution(
        [FindPackageShare('poststall_sim'), 'launch', 'sim.launch.py'])

    def aircraft(namespace: str, arguments: dict) -> GroupAction:
        # In a group of its own: what one is told does not reach the other.
        return GroupAction([IncludeLaunchDescription(
            PythonLaunchDescriptionSource(one), launch_arguments=list({
                'namespace': namespace, 'params_file': LaunchConfiguration('params_file'),
                'aircraft': LaunchConfiguration(f'{namespace}_aircraft'),
                'joystick': 'false', 'rviz': 'false', **arguments}.items()))])

    both = {name: LaunchConfiguration(name) for name in BOTH}
    return LaunchDescription([
        *(DeclareLaunchArgument(
            f'{namespace}_aircraft', default_value='trainer',
            description=f'What flies in /{namespace}: a shipped name, or a path.')
          for namespace in ('left', 'right')),
        DeclareLaunchArgument(
            'params_file', default_value=PathJoinSubstitution(
                [FindPackageShare('poststall_sim'), 'config', 'simulator.yaml']),
            description='Parameters of both; one for /left/simulator or /right/simulator alone '
                        'stands in it under that name.'),
        *(DeclareLaunchArgument(name, default_value=default, description=description)
          for name, (default, description) in {**BOTH, **ONCE}.items()),
        aircraft('left', {
            **both, **{name: LaunchConfiguration(name) for name in ONCE},
            'altitude': '150.0', 'follow_clock': 'false'}),
        aircraft('right', {
            **both, 'real_time_factor': '', 'bag': 'false', 'foxglove': 'false',
            'altitude': '170.0', 'follow_clock': 'true'}),
    ])
