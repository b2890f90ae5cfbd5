# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""
A DDS that is not ROS's own sees the flight and flies: rosless, which speaks RTPS from Rust.

What else is tested over DDS has Fast DDS at both ends. This one shares no line with it, so what
it reads and what it is obeyed in is on the wire as ROS 2 says, by name, type, quality and bytes.
"""

import math
import time

import pytest

pytest.importorskip('rclpy', reason='rclpy is not installed')
pytest.importorskip('rosless', reason='rosless, a DDS of its own, is not installed')

import rosless
from geometry_msgs.msg import PoseStamped
from processes import LIMIT, nanoseconds
from rclpy.qos import QoSProfile, ReliabilityPolicy
from sensor_msgs.msg import PointCloud2
from std_msgs.msg import Float64MultiArray

pytestmark = [pytest.mark.ros, pytest.mark.timeout(300)]

BEST_EFFORT = QoSProfile(depth=100, reliability=ReliabilityPolicy.BEST_EFFORT)


def next_of(subscription):
    message = subscription.read(timeout=LIMIT)
    assert message is not None, f'no {subscription.topic} in {LIMIT:g} s'
    return message


def pose_of(message):
    """Return the stamp and all numbers of a pose, whoever decoded it."""
    place, turn = message.pose.position, message.pose.orientation
    return (nanoseconds(message.header.stamp), message.header.frame_id,
            place.x, place.y, place.z, turn.x, turn.y, turn.z, turn.w)


def cloud_of(message):
    return nanoseconds(message.header.stamp), message.point_step, bytes(message.data)


def agreed(probe, subscription, ours, key, count):
    """Return what the stranger has heard, once so many messages are the same at both."""
    seen = []

    def same():
        seen.append(key(next_of(subscription)))
        return len(set(seen) & {key(message) for message in ours}) >= count

    probe.spin_until(same, f'{count} messages of {subscription.topic} alike')
    return seen


def fly_until(publisher, message, joints, done, what):
    """Repeat a command, as an autopilot does, until joint_states show it."""
    end = time.monotonic() + LIMIT
    while not done(next_of(joints)):
        publisher.send(message)
        assert time.monotonic() < end, f'waited {LIMIT:g} s for {what}'


def test_another_dds_sees_the_flight_and_flies_it(start, probe):
    start('simulator').wait_for('ready')
    stranger = rosless.Node(start.domain)
    poses = stranger.subscribe('pose', 'geometry_msgs/msg/PoseStamped')
    lifts = stranger.subscribe('strip_cl', 'std_msgs/msg/Float64MultiArray')
    clouds = stranger.subscribe('strips', 'sensor_msgs/msg/PointCloud2')
    joints = stranger.subscribe('joint_states', 'sensor_msgs/msg/JointState')
    places = stranger.subscribe('strip_y', 'std_msgs/msg/Float64MultiArray',
                                reliability='reliable', durability='transient_local')
    ours = [probe.collect(kind, topic, BEST_EFFORT) for kind, topic in (
        (PoseStamped, 'pose'), (Float64MultiArray, 'strip_cl'), (PointCloud2, 'strips'))]

    # What was published once, before it came, it is still told.
    strips = len(next_of(places).data)
    assert strips == 33

    # It hears what an rclpy node hears, to the bit, also of messages that come in pieces.
    seen = agreed(probe, poses, ours[0], pose_of, 25)
    assert all(before[0] < after[0] for before, after in zip(seen, seen[1:]))
    assert all(math.isfinite(value) for pose in seen for value in pose[2:])
    seen = agreed(probe, lifts, ours[1], lambda message: tuple(message.data), 10)
    assert all(len(values) == strips for values in seen)
    assert all(math.isfinite(value) for values in seen for value in values)
    agreed(probe, clouds, ours[2], cloud_of, 3)

    # By name, then as an array: the elevator goes where it says, and the others stay.
    joint = next_of(joints)
    trim = dict(zip(joint.name, joint.position))
    elevator = list(trim).index('elevator')
    by_name = stranger.advertise('autopilot/surface_cmd', 'sensor_msgs/msg/JointState')
    up = trim['elevator'] - 0.03
    fly_until(by_name, {'name': ['elevator'], 'position': [up]}, joints,
              lambda joint: joint.position[elevator] == pytest.approx(up, abs=1e-12),
              'the elevator by name')
    array = stranger.advertise('surface_commands', 'std_msgs/msg/Float64MultiArray')
    down = [value + (0.03 if name == 'elevator' else 0.0) for name, value in trim.items()]
    fly_until(array, {'data': down}, joints,
              lambda joint: list(joint.position) == pytest.approx(down, abs=1e-12),
              'the elevator by array')
