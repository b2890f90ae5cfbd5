# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""
Fly one aircraft: the simulator, a pilot or the autopilot, and RViz if wanted.

    ros2 launch poststall_sim sim.launch.py aircraft:=trainer real_time_factor:=2.0 rviz:=true
"""

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument
from launch.conditions import IfCondition, UnlessCondition
from launch.substitutions import LaunchConfiguration, PathJoinSubstitution
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterValue
from launch_ros.substitutions import FindPackageShare


def generate_launch_description() -> LaunchDescription:
    """Return the simulator, who flies and RViz, with their arguments."""
    # A bare substitution is read as YAML: an aircraft called `747` or a factor of `2` would
    # reach the node with the wrong type.
    aircraft = ParameterValue(LaunchConfiguration('aircraft'), value_type=str)
    real_time_factor = ParameterValue(LaunchConfiguration('real_time_factor'), value_type=float)
    scenario = ParameterValue(LaunchConfiguration('scenario'), value_type=str)

    view = PathJoinSubstitution(
        [FindPackageShare('poststall_sim'), 'config', 'rviz', 'poststall.rviz'])

    return LaunchDescription([
        DeclareLaunchArgument(
            'aircraft', default_value='trainer',
            description='Name of a shipped aircraft, or the path of a YAML file.'),
        DeclareLaunchArgument(
            'real_time_factor', default_value='1.0',
            description='Simulated seconds per second; 0 is as fast as possible.'),
        DeclareLaunchArgument(
            'scenario', default_value='stall_and_recovery',
            description='Name of a shipped scenario, or the path of a YAML file.'),
        DeclareLaunchArgument(
            'autopilot', default_value='false',
            description='Let the example autopilot fly, not the pilot and his scenario.'),
        DeclareLaunchArgument(
            'rviz', default_value='false',
            description='Show the flight in RViz, which must be installed.'),
        Node(
            package='poststall_sim', executable='simulator', name='simulator', output='screen',
            parameters=[{'aircraft': aircraft, 'real_time_factor': real_time_factor}]),
        Node(
            package='poststall_sim', executable='pilot', name='pilot', output='screen',
            parameters=[{'scenario': scenario, 'use_sim_time': True}],
            condition=UnlessCondition(LaunchConfiguration('autopilot'))),
        Node(
            package='poststall_sim', executable='autopilot', name='autopilot', output='screen',
            parameters=[{'use_sim_time': True}],
            condition=IfCondition(LaunchConfiguration('autopilot'))),
        Node(
            package='rviz2', executable='rviz2', name='rviz2', arguments=['-d', view],
            parameters=[{'use_sim_time': True}],
            condition=IfCondition(LaunchConfiguration('rviz'))),
    ])
