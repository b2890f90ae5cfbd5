# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""What can be asked of a simulator over DDS: trim, other states, wind, files, who flies."""

import math
import os
import re

import pytest

pytest.importorskip('rclpy', reason='rclpy is not installed')

from geometry_msgs.msg import (
    PoseStamped,
    PoseWithCovarianceStamped,
    TwistStamped,
    Vector3Stamped,
    WrenchStamped,
)
from nav_msgs.msg import Odometry
from processes import Reports, nanoseconds, send_sparingly, send_until
from sensor_msgs.msg import JointState, Joy
from std_msgs.msg import Float64, Float64MultiArray
from std_srvs.srv import SetBool, Trigger

pytestmark = [pytest.mark.ros, pytest.mark.timeout(300)]

PAUSED = ['-p', 'start_paused:=true', '-p', 'rates.diagnostics:=20.0', '-p', 'rates.state:=1000.0',
          '-p', 'rates.wind:=1000.0']


class Seen:
    """The latest of what a paused simulator shows, and stepping it."""

    def __init__(self, probe):
        self.probe = probe
        self.odoms = probe.collect(Odometry, 'odom', 1000)
        self.air = probe.collect(TwistStamped, 'twist/air', 1000)
        self.winds = probe.collect(Vector3Stamped, 'wind/applied', 1000)
        self.joints = probe.collect(JointState, 'joint_states', 1000)
        self.all = (self.odoms, self.air, self.winds, self.joints)
        probe.spin_until(lambda: all(self.all), 'the first state')

    def after(self, act):
        """Return what an act returns, when its state has been shown on every topic."""
        for heard in self.all:
            heard.clear()
        result = act()
        self.probe.spin_until(lambda: all(self.all), 'another state')
        return result

    def step(self):
        """Step, and return the odom of the last step, when that is there on every topic."""
        said = self.after(lambda: self.probe.call(Trigger, 'step')).message
        time_ns = round(1e9 * float(said.split()[-2]))
        self.probe.spin_until(lambda: all(
            nanoseconds(heard[-1].header.stamp) == time_ns for heard in self.all), said)
        return self.odoms[-1]

    def position(self):
        p = self.odoms[-1].pose.pose.position
        return p.x, p.y, p.z


@pytest.fixture
def seen(start, probe):
    start('simulator', ros=PAUSED)
    return Seen(probe)


def settled(reports):
    """Return how many commands have been accepted, once three more reports say the same."""
    while True:
        accepted, heard = reports.number('commands', 'accepted'), len(reports.heard)
        reports.probe.spin_until(lambda heard=heard: len(reports.heard) > heard + 2, 'diagnostics')
        if reports.number('commands', 'accepted') == accepted:
            return accepted


def command(reports, publisher, message):
    """Command until it is accepted, and until no such command is on its way any more."""
    before = settled(reports)
    send_sparingly(reports, publisher, message,
                   lambda: reports.number('commands', 'accepted') > before, 'the command')
    settled(reports)


def test_trim_says_what_it_found_and_the_flight_stays_on_it(seen, probe):
    assert probe.set_parameter('step_count', 150).successful
    elevator = probe.publisher(JointState, 'pilot/surface_cmd')
    reports = Reports(probe)
    command(reports, elevator, JointState(name=['elevator', 'aileron'], position=[-0.3, 0.1]))
    seen.step()
    assert abs(seen.odoms[-1].twist.twist.angular.y) > 0.1
    x, y, _ = seen.position()
    answer = seen.after(lambda: probe.call(Trigger, 'trim'))
    assert answer.success and answer.message.startswith('paused at simulated time')
    assert float(re.search(r'residual (\S+) of the weight', answer.message)[1]) < 1e-6
    assert seen.position() == pytest.approx((x, y, 150.0))
    told = dict(zip(seen.joints[-1].name, seen.joints[-1].position))
    for name in ('elevator', 'throttle'):
        assert float(re.search(rf'{name} ([-.\d]+)', answer.message)[1]) == pytest.approx(
            told[name], rel=1e-5)
    # A second and more on: as level and as fast, to what a trimmed flight wanders.
    seen.step()
    assert seen.position()[2] == pytest.approx(150.0, abs=0.01)
    air = seen.air[-1].twist
    assert math.hypot(air.linear.x, air.linear.z) == pytest.approx(12.0, abs=0.002)
    assert abs(air.angular.y) < 1e-3
    assert seen.joints[-1].position == pytest.approx(list(told.values()))


def test_after_a_reset_all_is_as_at_the_start_and_30_commands_at_once_are_heard_in_order(
        seen, probe):
    """While a long step is taken, what is commanded waits: more than most histories hold."""
    wrenches = probe.collect(WrenchStamped, 'wrench', 1000)
    lifts = probe.collect(Float64MultiArray, 'strip_cl', 1000)
    reports = Reports(probe)
    probe.spin_until(lambda: wrenches and lifts and reports.heard, 'the first state')

    def shown():
        """Return all that is shown but its time."""
        odom, joints = seen.odoms[-1], seen.joints[-1]
        return (odom.pose, odom.twist, joints.name, joints.position, seen.air[-1].twist,
                wrenches[-1].wrench, lifts[-1].data)
    first = shown()
    commands = probe.publisher(JointState, 'pilot/surface_cmd')
    assert probe.set_parameter('step_count', 400).successful
    step = probe.client(Trigger, 'step')

    def burst():
        """Command 30 times while the simulator steps; tell whether all was heard."""
        accepted = settled(reports)
        seen.odoms.clear()
        stepped = step.call_async(Trigger.Request())
        probe.spin_until(lambda: seen.odoms, 'the steps to begin')
        for k in range(30):
            commands.publish(JointState(name=['elevator'], position=[-0.01 * k]))
        assert not stepped.done()
        probe.spin_until(stepped.done, 'the steps')
        return settled(reports) == accepted + 30
    # Best effort: one may be lost on a busy machine, and the first while it is not known yet.
    assert any(burst() for _ in range(5))
    assert probe.set_parameter('step_count', 1).successful
    seen.step()
    told = dict(zip(seen.joints[-1].name, seen.joints[-1].position))
    assert told['elevator'] == pytest.approx(-0.29)

    assert shown() != first
    assert seen.after(lambda: probe.call(Trigger, 'reset')).success
    # Of wrench and strips some of the last step may come now only.
    probe.spin_until(lambda: shown() == first, 'the state of the start')


def test_initialpose_and_set_state_put_the_aircraft_there_or_say_why_not(seen, probe):
    reports = Reports(probe)
    wind = probe.publisher(Vector3Stamped, 'wind')
    pose = probe.publisher(PoseWithCovarianceStamped, 'initialpose')
    state = probe.publisher(Odometry, 'set_state')

    # As the button of RViz sends it: flat on the ground, heading east, and in the wind.
    def vector(frame='map', **values):
        message = Vector3Stamped()
        message.header.frame_id = frame
        for axis, value in values.items():
            setattr(message.vector, axis, value)
        return message

    seen.step()
    send_until(probe, wind, vector(x=2.0, y=-1.0), lambda: seen.step() and (
        seen.winds[-1].vector.x, seen.winds[-1].vector.y) == (2.0, -1.0), 'the wind')
    flat = PoseWithCovarianceStamped()
    flat.header.frame_id = 'map'
    flat.pose.pose.position.x = 40.0
    flat.pose.pose.orientation.w = 1.0
    seen.after(lambda: send_sparingly(reports, pose, flat, lambda: seen.odoms, 'the pose'))
    assert seen.position() == pytest.approx((40.0, 0.0, 150.0))
    time_0 = nanoseconds(seen.odoms[-1].header.stamp)
    assert probe.set_parameter('step_count', 100).successful
    seen.step()
    flown = 1e-9 * (nanoseconds(seen.odoms[-1].header.stamp) - time_0)
    x, y, z = seen.position()
    # Through the air to the east at trim speed, carried along by the wind.
    assert (x, y, z) == pytest.approx((40.0 + 14.0 * flown, -flown, 150.0), abs=0.02)

    # A full pose is taken as it is.
    full = PoseWithCovarianceStamped()
    full.pose.pose.position.z = 300.0
    full.pose.pose.orientation.x, full.pose.pose.orientation.w = math.sin(0.3), math.cos(0.3)
    seen.after(lambda: send_sparingly(reports, pose, full, lambda: seen.odoms, 'the pose'))
    assert seen.position() == (0.0, 0.0, 300.0)
    assert seen.odoms[-1].pose.pose.orientation.x == pytest.approx(math.sin(0.3))
    air = seen.air[-1].twist.linear
    assert math.hypot(air.x, air.z) == pytest.approx(12.0) and abs(air.y) < 1e-9

    # set_state takes what odom says.
    wanted = Odometry(child_frame_id='base_link')
    wanted.header.frame_id = 'map'
    for part, values in ((wanted.pose.pose.position, (5.0, -7.0, 90.0)),
                         (wanted.twist.twist.linear, (10.0, 0.5, -1.0)),
                         (wanted.twist.twist.angular, (0.1, -0.2, 0.3))):
        part.x, part.y, part.z = values
    q = wanted.pose.pose.orientation
    q.x, q.y, q.z, q.w = 0.1, 0.3, -0.5, math.sqrt(1.0 - 0.35)
    seen.after(lambda: send_sparingly(reports, state, wanted, lambda: seen.odoms, 'the state'))
    found = seen.odoms[-1]
    for path in ('pose.pose.position', 'twist.twist.linear', 'twist.twist.angular'):
        here, there = wanted, found
        for part in path.split('.'):
            here, there = getattr(here, part), getattr(there, part)
        assert (there.x, there.y, there.z) == pytest.approx((here.x, here.y, here.z))
    r = found.pose.pose.orientation
    assert abs(q.x * r.x + q.y * r.y + q.z * r.z + q.w * r.w) == pytest.approx(1.0)

    # None of these moves anything; each is counted, and says why.
    def changed(kind, **values):
        message = kind()
        message.header.frame_id = values.pop('frame', 'map')
        message.pose.pose.orientation.w = values.pop('w', 1.0)
        message.pose.pose.position.z = values.pop('z', 100.0)
        if kind is Odometry:
            message.twist.twist.linear.x = values.pop('u', 12.0)
            message.child_frame_id = values.pop('child', '')
        assert not values
        return message

    place = seen.position()
    for publisher, message in (
            (pose, changed(PoseWithCovarianceStamped, z=-5.0)),
            (pose, changed(PoseWithCovarianceStamped, frame='odom')),
            (pose, changed(PoseWithCovarianceStamped, w=0.0)),
            (pose, changed(PoseWithCovarianceStamped, z=math.nan)),
            (state, changed(Odometry, z=0.0)), (state, changed(Odometry, z=1e9)),
            (state, changed(Odometry, u=math.inf)), (state, changed(Odometry, u=1e6)),
            (state, changed(Odometry, w=math.nan)), (state, changed(Odometry, child='map')),
            (wind, vector(frame='base_link')), (wind, vector(x=math.nan)),
            (wind, vector(z=-500.0))):
        counted = reports.number('commands', 'refused_states')
        send_sparingly(reports, publisher, message, lambda counted=counted: reports.number(
            'commands', 'refused_states') > counted, 'the count')
    assert seen.position() == place
    assert probe.set_parameter('step_count', 1).successful
    assert seen.step().pose.pose.position.z == pytest.approx(90.0, abs=0.3)   # and it flies on
    assert (seen.winds[-1].vector.x, seen.winds[-1].vector.z) == (2.0, 0.0)


def test_a_flight_goes_on_from_its_file(seen, probe, tmp_path):
    """What follows is the same to the bit; and what is no such file is refused."""
    def ask(service, path):
        assert probe.set_parameter('flight_file', str(path)).successful
        return probe.call(Trigger, service)

    for service in ('save_state', 'load_state'):
        answer = probe.call(Trigger, service)
        assert not answer.success and 'flight_file is' in answer.message
    refused = probe.set_parameter('flight_file', str(tmp_path / 'flight.txt'))
    assert not refused.successful and '.npz' in refused.reason
    os.mkfifo(tmp_path / 'pipe.npz')
    for service in ('save_state', 'load_state'):
        assert 'not a regular file' in ask(service, tmp_path / 'pipe.npz').message
    assert 'there is no file' in ask('load_state', tmp_path / 'flight.npz').message

    elevator = probe.publisher(JointState, 'pilot/surface_cmd')
    reports = Reports(probe)
    command(reports, elevator, JointState(name=['elevator'], position=[-0.2]))
    assert probe.set_parameter('step_count', 40).successful
    seen.step()
    saved = ask('save_state', tmp_path / 'flight.npz')
    assert saved.success and 'simulated time' in saved.message
    first = seen.step()
    second = seen.step()
    # Time goes on, by default.
    answer = seen.after(lambda: probe.call(Trigger, 'load_state'))
    assert answer.success
    assert seen.odoms[-1].header.stamp == second.header.stamp
    again = seen.step()
    assert again.pose == first.pose and again.twist == first.twist
    # With reset.time the file's time comes back as well.
    assert probe.set_parameter('reset.time', True).successful
    seen.after(lambda: probe.call(Trigger, 'load_state'))
    assert seen.step() == first


def test_who_flies_by_stick_by_autopilot_and_by_both(start, probe):
    start('simulator', ros=[
        '-p', 'joy.enabled:=true', '-p', 'rates.diagnostics:=20.0', '-p', 'joy.scale.rudder:=0.2',
        '-p', 'initial.altitude:=2000.0', '-p', 'command.timeout:=1.0'])
    joints = probe.collect(JointState, 'joint_states')
    speeds = probe.collect(Float64, 'air_data/airspeed')
    poses = probe.collect(PoseStamped, 'pose')
    reports = Reports(probe)
    joy = probe.publisher(Joy, 'joy')
    autopilot = probe.publisher(JointState, 'autopilot/surface_cmd')
    probe.spin_until(lambda: joints and speeds and poses, 'the first state')

    def rudder():
        return dict(zip(joints[-1].name, joints[-1].position))['rudder']

    def stick(way=0.0, *down):
        return Joy(axes=[way] + [0.0] * 7, buttons=[int(index in down) for index in range(8)])

    def both(way, done, what, position=0.05):
        def again():
            joy.publish(stick(way))
            autopilot.publish(JointState(name=['rudder'], position=[position]))
            return done()
        probe.spin_until(again, what)

    # A stick at rest leaves it to the autopilot; one that is moved takes over; both add up.
    both(0.0, lambda: rudder() == 0.05, 'the autopilot at the rudder')
    reports.heard.clear()
    both(0.0, lambda: reports.value('commands', 'source') == 'autopilot', 'the source')
    both(1.0, lambda: rudder() == pytest.approx(0.2), 'the stick at the rudder')
    assert probe.set_parameter('command.source', 'sum').successful
    both(1.0, lambda: rudder() == pytest.approx(0.25), 'both at the rudder')
    assert probe.call(SetBool, 'engage', data=False).message == 'autopilot not engaged'
    both(-1.0, lambda: rudder() == pytest.approx(-0.2), 'the stick alone')
    reports.wait_for('commands', 'engaged', 'false')
    assert probe.set_parameter('command.source', 'auto').successful
    assert probe.call(SetBool, 'engage', data=True).success

    # A stamp that is too old, or older than the one before, and a stick of too few axes.
    def stamped(time_ns):
        message = JointState(name=['rudder'], position=[0.3])
        message.header.stamp.sec, message.header.stamp.nanosec = divmod(time_ns, 10**9)
        return message

    probe.spin_until(lambda: nanoseconds(poses[-1].header.stamp) > 1_500_000_000, 'some flight')
    send_until(probe, autopilot, stamped(1),
               lambda: reports.number('commands', 'refused_stale'), 'stale')

    def out_of_order():
        now = nanoseconds(poses[-1].header.stamp)
        autopilot.publish(stamped(now))
        autopilot.publish(stamped(now - 10_000_000))
        return reports.number('commands', 'refused_out_of_order')
    probe.spin_until(out_of_order, 'out of order')
    send_until(probe, joy, Joy(axes=[0.0]),
               lambda: reports.number('commands', 'refused_wrong_length'), 'a short stick')

    # Buttons: down is what counts, not how long.
    send_until(probe, joy, stick(0.0), lambda: rudder() == 0.0, 'the stick again')

    def press(index, done, what):
        send_until(probe, joy, stick(0.0, index), done, what)
        heard = len(reports.heard)
        send_until(probe, joy, stick(0.0, index), lambda: len(reports.heard) > heard + 2, 'time')
        assert done()
        send_until(probe, joy, stick(0.0), lambda: len(reports.heard) > heard + 5, 'its release')
    press(7, lambda: reports.value('flight', 'paused') == 'true', 'the pause')
    far = poses[-1].pose.position.y
    press(6, lambda: poses[-1].pose.position.y < far - 1.0, 'the reset')
    press(7, lambda: reports.value('flight', 'paused') == 'false', 'the end of the pause')
    level = poses[-1].pose.position.z
    send_until(probe, autopilot, JointState(name=['elevator', 'throttle'], position=[0.1, 0.0]),
               lambda: poses[-1].pose.position.z < level - 3.0, 'a dive')
    send_until(probe, joy, stick(0.0, 0), lambda: abs(poses[-1].pose.position.z - 2000.0) < 0.1
               and abs(speeds[-1].data - 12.0) < 0.1, 'the trim')
