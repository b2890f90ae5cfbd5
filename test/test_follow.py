# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""A second aircraft in the time of a first one, or of any other /clock."""

import numpy as np
import pytest

pytest.importorskip('rclpy', reason='rclpy is not installed')

import rclpy
from geometry_msgs.msg import PoseStamped
from processes import LIMIT, Reports, free_domain, nanoseconds, send_until
from rclpy.parameter import Parameter
from rosgraph_msgs.msg import Clock
from std_srvs.srv import SetBool, Trigger

from poststall_sim import topics
from poststall_sim.ros.simulator import SimulatorNode

pytestmark = [pytest.mark.ros, pytest.mark.timeout(300)]

FOLLOW = ['-p', 'publish_clock:=false', '-p', 'use_sim_time:=true',
          '-p', 'rates.diagnostics:=20.0']


def clock(time_s):
    message = Clock()
    message.clock.sec, message.clock.nanosec = divmod(round(time_s * 1e9), 1_000_000_000)
    return message


def stamp(poses):
    return nanoseconds(poses[-1].header.stamp) if poses else None


def test_two_aircraft_live_in_one_time(start, probe):
    """The one leads, stepped by service; the other, of the same dt, bears the same stamps."""
    start('simulator', ros=['-r', '__ns:=/left', '-p', 'lockstep:=service',
                            '-p', 'step_count:=50'])
    left = probe.collect(PoseStamped, '/left/pose')
    stepped = probe.call(Trigger, '/left/step')
    assert stepped.success
    fifty = round(1e9 * float(stepped.message.split()[-2]))
    start('simulator', ros=['-r', '__ns:=/right', *FOLLOW])
    right = probe.collect(PoseStamped, '/right/pose')
    probe.spin_until(lambda: stamp(right) == stamp(left) == fifty, 'one time')
    begin = right[-1].pose.position.y
    assert begin == 0.0          # it began at the time that it found, and not before
    reports = Reports(probe, 'right/simulator')
    reports.wait_for('pace', 'steps', '0')
    for calls in range(2, 6):
        assert probe.call(Trigger, '/left/step').success
        # The time that is meant: between, the two bear the same stamps as well.
        probe.spin_until(
            lambda due=calls * fifty: stamp(left) == stamp(right) == due, 'one time')
    # Also where no state is due by its rate: who waits for it would wait for ever.
    assert probe.set_parameter('step_count', 1, node='/left/simulator').successful
    assert probe.call(Trigger, '/left/step').success
    probe.spin_until(
        lambda: stamp(right) == stamp(left) == 251 * fifty // 50, 'one step more')
    # The same aircraft, trimmed alike, has flown as far since: 201 steps. Their wakes are not
    # of one age, for which a trimmed flight wanders by a millimetre.
    first = next(pose for pose in left if nanoseconds(pose.header.stamp) == fifty)
    assert right[-1].pose.position.y == pytest.approx(
        left[-1].pose.position.y - first.pose.position.y, abs=2e-3)
    reports.wait_for('pace', 'steps', '201')
    assert reports.number('pace', 'lag_s') == 0.0
    assert reports.level('pace') == reports.level('flight') == topics.Level.OK
    assert probe.node.count_publishers('/clock') == 1


def test_a_clock_that_stands_jumps_and_is_not_alone(start, probe):
    """Paused time is not caught up with; a jump back begins again; two clocks are an error."""
    simulator = start('simulator', ros=[*FOLLOW, '-p', 'dt:=0.008',
                                     '-p', 'rates.state:=1000.0'])
    poses = probe.collect(PoseStamped, 'pose')
    reports = Reports(probe)
    reports.wait_for('pace', 'steps', '0')
    assert 'waits for /clock' in reports.message('pace')
    assert reports.level('pace') == topics.Level.WARN
    source = probe.publisher(Clock, '/clock')

    def goes_to(time_s, stamp_ns):
        send_until(probe, source, clock(time_s), lambda: stamp(poses) == stamp_ns, f'{time_s} s')

    goes_to(100.003, 100_000_000_000)      # in whole steps
    goes_to(100.5, 100_496_000_000)
    reports.wait_for('pace', 'steps', '62')
    assert probe.call(SetBool, 'pause', data=True).success
    send_until(probe, source, clock(130.0),
               lambda: reports.number('pace', 'lag_s') > 29.0, 'the lag of a pause')
    assert reports.level('pace') == topics.Level.WARN and 'behind' in reports.message('pace')
    place = poses[-1].pose.position.y
    assert probe.call(SetBool, 'pause', data=False).success
    goes_to(130.0, 130_000_000_000)
    assert poses[-1].pose.position.y == place
    goes_to(130.016, 130_016_000_000)
    assert poses[-1].pose.position.y == pytest.approx(place + 2 * 0.008 * 12.0, abs=1e-3)
    reports.wait_for('pace', 'lost_time_s', '29.504')

    result = probe.set_parameter('use_sim_time', False)
    assert not result.successful and 'settled at its start' in result.reason

    # A second source is an error, and its jumps are not followed.
    other = probe.node.create_publisher(Clock, '/clock', 1)
    probe.spin_until(lambda: reports.level('flight') == topics.Level.ERROR, 'the error')
    assert reports.message('flight').startswith('2 nodes publish /clock')
    send_until(probe, other, clock(3.0),
               lambda: reports.number('pace', 'clock_jumps_back'), 'the jump back')
    assert stamp(poses) == 130_016_000_000
    probe.node.destroy_publisher(other)
    probe.spin_until(lambda: reports.level('flight') == topics.Level.OK, 'one source again')

    # The one source jumps back: the flight begins again, at that time.
    goes_to(131.0, 131_000_000_000)
    goes_to(10.0, 10_000_000_000)
    assert poses[-1].pose.position.y == 0.0
    assert simulator.says().count('/clock jumped back') == 1
    goes_to(10.8, 10_800_000_000)
    # A reset leaves time alone, whatever reset.time says: it is another's.
    assert probe.set_parameter('reset.time', True).successful
    assert probe.call(Trigger, 'reset').success
    probe.spin_until(lambda: poses[-1].pose.position.y == 0.0, 'the reset')
    assert stamp(poses) == 10_800_000_000


def test_a_clock_before_0_or_beyond_all_stamps_is_refused_and_ends_nobody(start, probe):
    """The clock of rclpy raises over a negative one, in whoever follows it."""
    followers = [
        start('simulator', ros=[*FOLLOW, '-p', 'dt:=0.008', '-p', 'rates.state:=1000.0']),
        start('autopilot', ros=['-p', 'use_sim_time:=true'])]
    poses = probe.collect(PoseStamped, 'pose')
    reports = Reports(probe)
    source = probe.publisher(Clock, '/clock')
    send_until(probe, source, clock(100.0), lambda: stamp(poses) == 100_000_000_000, '100 s')
    wild = clock(0.0)
    for wild.clock.sec, wild.clock.nanosec in ((-1, 0), (2**31 - 1, 2**32 - 1)):
        refused = f'/clock refused: {wild.clock.sec} s'
        send_until(probe, source, wild, lambda refused=refused: (
            refused in followers[0].says()
            and 'rclpy cannot handle a message' in followers[1].says()), refused)
    probe.spin_until(lambda: reports.number('commands', 'dropped_by_rclpy') >= 1, 'the count')
    send_until(probe, source, clock(100.04), lambda: stamp(poses) == 100_040_000_000, 'the flight')
    assert reports.value('pace', 'clock_jumps_back') == '0'
    assert all(each.process.poll() is None for each in followers)
    assert not any('Traceback' in each.says() for each in followers)


def test_a_follower_that_joins_has_not_been_without_commands_since_0():
    """Silence is counted from when it takes on the time of the clock."""
    context = rclpy.Context()
    context.init(args=[], domain_id=free_domain())
    node = SimulatorNode(context=context, use_global_arguments=False, parameter_overrides=[
        Parameter(name, value=value) for name, value in {
            'publish_clock': False, 'use_sim_time': True, 'uvlm.chordwise': 1,
            'command.on_timeout': 'neutral', 'command.timeout': 1.0}.items()])
    try:
        def flown(time_s):
            """Return what the controls are told at a time, when it has been caught up with."""
            node._on_clock(clock(time_s))
            while node._follower.lag_ns(node.flight.snapshot.time_ns) >= node.flight.dt_ns:
                node._wake()
            return node.flight.snapshot.commanded

        flown(100.0)
        trim = node.flight.trim.deflections
        assert trim.any() and np.array_equal(flown(100.5).deflections, trim)
        assert not flown(101.5).deflections.any()   # and now he has been silent for 1 s
    finally:
        node.destroy_node()
        context.try_shutdown()


def test_time_is_made_or_followed_and_not_both(start):
    both = start('simulator', ros=['-p', 'use_sim_time:=true'])
    locked = start('simulator', ros=[*FOLLOW, '-p', 'lockstep:=service'])
    for process, text in ((both, 'set publish_clock to false to follow'), (locked, 'set one')):
        assert process.ended(LIMIT) == 2
        assert text in process.says()
