# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""
A DDS that is not ROS's Fast DDS sees the flight and flies.

What else is tested over DDS has Fast DDS at both ends, which agrees with itself whatever it puts
on the wire. These share no line with it, so what they read and are obeyed in is as ROS 2 says, by
name, type, quality of service and bytes.
"""

import math
import time

import pytest

pytest.importorskip('rclpy', reason='rclpy is not installed')

from geometry_msgs.msg import PoseStamped
from processes import LIMIT, nanoseconds
from rclpy.qos import QoSProfile, ReliabilityPolicy
from sensor_msgs.msg import PointCloud2
from std_msgs.msg import Float64MultiArray
from strangers import Cyclone, Rosless

pytestmark = [pytest.mark.ros, pytest.mark.timeout(300)]

BEST_EFFORT = QoSProfile(depth=100, reliability=ReliabilityPolicy.BEST_EFFORT)
ARRAY, JOINTS = 'std_msgs/msg/Float64MultiArray', 'sensor_msgs/msg/JointState'


def pose_of(message):
    """Return the stamp and all numbers of a pose, whoever decoded it."""
    place, turn = message.pose.position, message.pose.orientation
    return (nanoseconds(message.header.stamp), message.header.frame_id,
            place.x, place.y, place.z, turn.x, turn.y, turn.z, turn.w)


def lifts_of(message):
    return tuple(message.data)


def cloud_of(message):
    return nanoseconds(message.header.stamp), message.point_step, bytes(message.data)


def agreed(probe, read, ours, key, count):
    """Return what the stranger has heard, once so many messages are the same at both."""
    seen = []

    def same():
        seen.append(key(read()))
        return len(set(seen) & {key(message) for message in ours}) >= count

    probe.spin_until(same, f'{count} messages alike')
    return seen


def fly_until(send, fields, joints, done, what):
    """Repeat a command, as an autopilot does, until joint_states show it."""
    end = time.monotonic() + LIMIT
    while not done(joints()):
        send(**fields)
        assert time.monotonic() < end, f'waited {LIMIT:g} s for {what}'


@pytest.mark.parametrize('participant', [Cyclone, Rosless])
def test_another_dds_sees_the_flight_and_flies_it(participant, start, probe):
    stranger = participant(start.domain)
    start('simulator').wait_for('ready')
    poses = stranger.reader('pose', 'geometry_msgs/msg/PoseStamped')
    lifts = stranger.reader('strip_cl', ARRAY)
    clouds = stranger.reader('strips', 'sensor_msgs/msg/PointCloud2')
    joints = stranger.reader('joint_states', JOINTS)
    ours = [probe.collect(kind, topic, BEST_EFFORT) for kind, topic in (
        (PoseStamped, 'pose'), (Float64MultiArray, 'strip_cl'), (PointCloud2, 'strips'))]

    # What was published once, before it came, it is still told.
    strips = len(stranger.reader('strip_y', ARRAY, latched=True)().data)
    assert strips == 33

    # It hears what an rclpy node hears, to the bit.
    seen = agreed(probe, poses, ours[0], pose_of, 25)
    assert all(before[0] < after[0] for before, after in zip(seen, seen[1:]))
    assert all(math.isfinite(value) for pose in seen for value in pose[2:])
    seen = agreed(probe, lifts, ours[1], lifts_of, 10)
    assert all(len(values) == strips for values in seen)
    assert all(math.isfinite(value) for values in seen for value in values)
    agreed(probe, clouds, ours[2], cloud_of, 3)

    # By name, then as an array: the elevator goes where it says, and the others stay.
    joint = joints()
    trim = dict(zip(joint.name, joint.position))
    elevator = list(trim).index('elevator')
    up = trim['elevator'] - 0.03
    fly_until(stranger.writer('autopilot/surface_cmd', JOINTS),
              {'name': ['elevator'], 'position': [up]}, joints,
              lambda joint: joint.position[elevator] == pytest.approx(up, abs=1e-12),
              'the elevator by name')
    down = [value + (0.03 if name == 'elevator' else 0.0) for name, value in trim.items()]
    fly_until(stranger.writer('surface_commands', ARRAY), {'data': down}, joints,
              lambda joint: list(joint.position) == pytest.approx(down, abs=1e-12),
              'the elevator by array')
