# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""The table of topics that the simulator listens to, in the terms of `topics`."""

from poststall_sim.topics import Qos, Rate, Topic

_COMMANDS = Qos(depth=32, reliable=False)
_LATEST = Qos(depth=1, reliable=False)

AUTOPILOT = Topic('autopilot/surface_cmd', 'sensor_msgs/msg/JointState', Rate.ONCE,
                  'deflections by name [rad], throttle 0..1; those not named hold', qos=_COMMANDS)
PILOT = Topic('pilot/surface_cmd', 'sensor_msgs/msg/JointState', Rate.ONCE,
              'the same from the pilot, who goes before the autopilot', qos=_COMMANDS)
SURFACES = Topic('surface_commands', 'std_msgs/msg/Float64MultiArray', Rate.ONCE,
                 'for the autopilot: values in the order of the parameter `surfaces`',
                 qos=_LATEST)
JOY = Topic('joy', 'sensor_msgs/msg/Joy', Rate.ONCE,
            'with `joy.enabled`: stick and buttons of the pilot, see `joy.*`', qos=_LATEST)
WIND = Topic('wind', 'geometry_msgs/msg/Vector3Stamped', Rate.ONCE,
             'velocity of the air in map, where it blows TO [m/s]; until one comes, the parameter '
             '`wind.velocity`', qos=Qos(depth=1))
INITIAL_POSE = Topic(
    'initialpose', 'geometry_msgs/msg/PoseWithCovarianceStamped', Rate.ONCE,
    'begin again at this pose in map, at trim speed; with z = 0, as the button of RViz sends it: '
    'in straight trim on this heading, at `initial.altitude`', qos=Qos(depth=1))
SET_STATE = Topic(
    'set_state', 'nav_msgs/msg/Odometry', Rate.ONCE,
    'go on from this state, in the terms of `odom`; controls stay', qos=Qos(depth=1))

COMMANDS: tuple[Topic, ...] = (AUTOPILOT, PILOT, SURFACES)
SUBSCRIBED: tuple[Topic, ...] = (*COMMANDS, JOY, WIND, INITIAL_POSE, SET_STATE)
