# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""The example autopilot over DDS: in lock-step to the bit, and beside wall time."""

import math

import numpy as np
import pytest

pytest.importorskip('rclpy', reason='rclpy is not installed')

from geometry_msgs.msg import TwistStamped
from nav_msgs.msg import Odometry
from processes import Reports, nanoseconds, send_sparingly
from rclpy.serialization import deserialize_message
from sensor_msgs.msg import Imu
from std_msgs.msg import Float64
from std_srvs.srv import SetBool

from poststall_sim.autopilot_law import Law
from poststall_sim.frames import (
    euler_from_quaternion,
    quaternion_enu_flu,
    quaternion_from_enu_flu,
    quaternion_from_euler,
    swap_body_flu,
    velocity_from_flow_angles,
)
from poststall_sim.topics import Level

pytestmark = [pytest.mark.ros, pytest.mark.timeout(300)]

LAW = Law()
PAUSED = ['-p', 'start_paused:=true', '-p', 'rates.diagnostics:=20.0']


def state(*, roll, pitch, alpha, airspeed):
    """Return a nav_msgs/Odometry 150 m up, heading north, of angles in deg."""
    roll, pitch, alpha = np.radians([roll, pitch, alpha])
    message = Odometry()
    message.pose.pose.position.z = 150.0
    q, v = message.pose.pose.orientation, message.twist.twist.linear
    q.x, q.y, q.z, q.w = quaternion_enu_flu(quaternion_from_euler(roll, pitch, 0.0)).tolist()
    v.x, v.y, v.z = swap_body_flu(velocity_from_flow_angles(airspeed, alpha, 0.0)).tolist()
    return message


STALLED = state(roll=30.0, pitch=25.0, alpha=25.0, airspeed=9.0)
BANKED = state(roll=-35.0, pitch=12.0, alpha=6.0, airspeed=14.0)


def attitude(orientation):
    """Return roll and pitch [rad] of a geometry_msgs/Quaternion."""
    q = orientation
    return euler_from_quaternion(quaternion_from_enu_flu(np.array([q.x, q.y, q.z, q.w])))[:2]


def put(probe, message):
    """Put a paused aircraft into a state, and wait until it is there."""
    odoms = probe.collect(Odometry, 'odom')
    wanted = message.twist.twist.linear.z
    send_sparingly(Reports(probe), probe.publisher(Odometry, 'set_state'), message,
                   lambda: odoms and abs(odoms[-1].twist.twist.linear.z - wanted) < 1e-9,
                   'the state')


def flown_in_lockstep(start, probe, first, count):
    """Return the bytes of odom and what the autopilot said over so many steps from a state."""
    start('simulator', ros=['-p', 'lockstep:=command', *PAUSED])
    put(probe, first)
    autopilot = start('autopilot', ros=['-p', 'lockstep:=true'])
    autopilot.wait_for('flies aileron, elevator, rudder, throttle')
    odoms = []
    probe.node.create_subscription(Odometry, 'odom', odoms.append, 1000, raw=True)
    probe.spin_until(lambda: odoms, 'the first state')
    assert probe.call(SetBool, 'pause', data=False).success
    probe.spin_until(lambda: len(odoms) > count, f'{count} steps')
    begun = [data for data in odoms
             if nanoseconds(deserialize_message(data, Odometry).header.stamp) == 0]
    return odoms[len(begun) - 1:len(begun) + count], autopilot.says()


@pytest.mark.soak
def test_it_leaves_a_stall_in_lockstep_and_twice_to_the_bit(start, probe, another_graph):
    count = 1250   # 10 s
    first, says = flown_in_lockstep(start, probe, STALLED, count)
    last = deserialize_message(first[-1], Odometry)
    assert nanoseconds(last.header.stamp) == 10_000_000_000
    roll, pitch = attitude(last.pose.pose.orientation)
    assert (roll, pitch) == pytest.approx((LAW.roll, LAW.pitch), abs=math.radians(1.0))
    velocity = last.twist.twist.linear
    assert math.hypot(velocity.x, velocity.y, velocity.z) == pytest.approx(
        LAW.airspeed, abs=0.3)
    heights = [deserialize_message(data, Odometry).pose.pose.position.z for data in first]
    assert min(heights) > 142.0
    assert says.count('stalled at 0.000 s') == 1 and says.count('recovered at') == 1

    second, says_again = flown_in_lockstep(*another_graph, STALLED, count)
    assert first == second

    def told(text):
        return [line.rpartition(': ')[2] for line in text.splitlines() if ' at ' in line]
    assert told(says) == told(says_again)


def test_a_lockstep_goes_on_with_states_between_and_others_who_begin_to_listen(start, probe):
    """What has no stamp may then be taken for another state's, but nothing is waited for ever."""
    start('simulator', ros=['-p', 'lockstep:=command', '-p', 'step_count:=5', *PAUSED])
    put(probe, BANKED)
    start('autopilot', ros=['-p', 'lockstep:=true']).wait_for('flies aileron')
    assert probe.call(SetBool, 'pause', data=False).success
    odoms = probe.collect(Odometry, 'odom')

    def reached(time_s):
        return odoms and nanoseconds(odoms[-1].header.stamp) >= time_s * 1e9
    for k in range(10):
        for kind, topic in ((Imu, 'imu'), (TwistStamped, 'twist/air')):
            probe.collect(kind, topic)
        probe.spin_until(lambda k=k: reached(k), f'{k} s')
    assert attitude(odoms[-1].pose.pose.orientation) == pytest.approx(
        (LAW.roll, LAW.pitch), abs=math.radians(1.0))


def test_it_is_heard_by_a_flight_that_goes_as_fast_as_it_can(start, probe):
    """Many steps to a turn of the executor: commands do not wait behind them and grow old."""
    start('simulator', ros=['-p', 'real_time_factor:=0.0', '-p', 'rates.diagnostics:=20.0',
                            '-p', 'initial.altitude:=2000.0'])
    start('autopilot').wait_for('flies aileron')
    reports = Reports(probe)
    probe.spin_until(lambda: reports.number('commands', 'accepted') > 100, 'the autopilot')
    before = {key: reports.number('commands', key) for key in ('accepted', 'refused_stale')}
    probe.spin_until(lambda: reports.number('commands', 'accepted') > before['accepted'] + 300,
                     'more of its commands')
    assert reports.number('commands', 'refused_stale') - before['refused_stale'] < 30
    assert reports.level('flight') == Level.OK


def test_it_holds_attitude_and_airspeed_beside_wall_time(start, probe):
    """An answer may come some states late, and nothing waits for it."""
    start('simulator', ros=PAUSED)
    put(probe, BANKED)
    start('autopilot').wait_for('flies aileron')
    imus, airspeeds = probe.collect(Imu, 'imu'), probe.collect(Float64, 'air_data/airspeed')
    assert probe.call(SetBool, 'pause', data=False).success

    def held():
        return imus and airspeeds and np.abs(
            attitude(imus[-1].orientation) - (LAW.roll, LAW.pitch)).max() < math.radians(1.0) \
            and abs(airspeeds[-1].data - LAW.airspeed) < 0.5
    probe.spin_until(held, 'what is to be held')
    reports = Reports(probe)
    # Not at every report: what a machine that stood still made it say too late is refused.
    probe.spin_until(lambda: reports.number('commands', 'accepted') > 0
                     and reports.level('commands') == Level.OK, 'commands that are obeyed')
    # Another setpoint, while it flies.
    assert probe.set_parameter('hold.roll', 0.4, node='/autopilot').successful
    probe.spin_until(lambda: abs(attitude(imus[-1].orientation)[0] - 0.4) < math.radians(1.0),
                     'the other bank')
    assert not probe.set_parameter('hold.roll', 4.0, node='/autopilot').successful
