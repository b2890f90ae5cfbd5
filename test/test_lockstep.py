# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""Lock-step over DDS: one command, one turn; the same commands, the same bytes."""

import math
import signal
import time

import pytest

pytest.importorskip('rclpy', reason='rclpy is not installed')

from processes import Reports, arrives, nanoseconds, send_sparingly, send_until
from rclpy.serialization import deserialize_message
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64MultiArray
from std_srvs.srv import SetBool, Trigger

from poststall_sim import topics
from poststall_sim.ros import messages

pytestmark = [pytest.mark.ros, pytest.mark.timeout(300)]

SHOWN = [topic for topic in topics.PUBLISHED
         if topic is not topics.DIAGNOSTICS and topic.common and messages.available(topic.type)]
BY_DEFAULT = [topic for topic in SHOWN if topic.by_default]
IN_STEP = [topic.name for topic in SHOWN if topic.rate.shows_state
           and topic.rate is not topics.Rate.ONCE and topic.qos.reliable and topic.qos.depth >= 10]
SPARSE = [topic for topic in SHOWN if topic.rate is not topics.Rate.ONCE
          and topic is not topics.CLOCK and topic.name not in IN_STEP]
"""What is best effort, keeps the latest only or comes when a sensor has something."""
JOINTS = topics.JOINT_STATES.name
EVERYTHING = ['-p', 'publish_ned:=true', *(
    part for sensor in ('imu', 'gps', 'pitot', 'barometer')
    for part in ('-p', f'sensors.{sensor}.rate:=100.0'))]


class Tape:
    """The bytes of every topic but /diagnostics, as they come."""

    def __init__(self, probe, shown):
        self.probe = probe
        self.heard = {topic.name: [] for topic in shown}
        self._numbers = {topic.name: [] for topic in shown}
        self.in_step = [name for name in IN_STEP if name in self.heard]
        for topic in shown:
            def hear(data, info, name=topic.name):
                self.heard[name].append(data)
                self._numbers[name].append(info['publication_sequence_number'])
            probe.node.create_subscription(
                messages.message_class(topic.type), topic.name, hear,
                messages.qos_profile(topics.Qos(1000, topic.qos.reliable, topic.qos.latched)),
                raw=True)
        probe.spin_until(lambda: all(self.heard[topic.name] for topic in shown
                                     if topic.rate.shows_state), 'the first state on every topic')
        # Who was there at once is shown the first state twice: with the clock of a later look.
        seen = len(self.heard[topics.CLOCK.name])
        probe.spin_until(
            lambda: len(self.heard[topics.CLOCK.name]) > seen + 5, 'the clock of standing time')
        self.joints = deserialize_message(self.heard[JOINTS][0], JointState)
        self._before = {name: numbers[-1] for name, numbers in self._numbers.items() if numbers}
        for topic in shown:
            if topic.rate not in (topics.Rate.ONCE, topics.Rate.CLOCK):
                self.heard[topic.name].clear()
                self._numbers[topic.name].clear()

    def steps(self):
        return len(self.heard[JOINTS])

    def time_ns(self):
        """Return the time of the latest state, 0 before the first step."""
        latest = self.heard[JOINTS][-1:]
        return nanoseconds(
            deserialize_message(latest[0], JointState).header.stamp) if latest else 0

    def by_step(self, name):
        """Return the bytes of a topic that has one message a step, by the number of the step."""
        return {number - self._before[name]: data
                for number, data in zip(self._numbers[name], self.heard[name])}

    def complete(self, count):
        """Wait for so many messages of every topic that has one a step; return bytes by topic."""
        self.probe.spin_until(
            lambda: all(len(self.heard[name]) >= count for name in self.in_step),
            f'{count} steps')
        # The clock is best effort, and said again while time stands.
        self.probe.spin_until(
            lambda: self.time_ns() in self.clocks(), 'the clock of the last step')
        return {name: list(data) for name, data in self.heard.items()
                if name != topics.CLOCK.name}, self.clocks()

    def clocks(self):
        """Return the times that the clock has shown [ns]."""
        return {nanoseconds(deserialize_message(data, Clock).clock)
                for data in self.heard[topics.CLOCK.name]}


def by_time(topic, messages_):
    """Return the bytes of messages by those of the stamp that each begins with."""
    begin = 8 if topic is topics.MARKERS else 4   # after the length of its array
    return {data[begin:begin + 8]: data for data in messages_}


def require_same(one, two, count):
    """Assert that two tapes hold the same bytes, of what is sparse those that both have."""
    (first, clocks), (second, other_clocks) = one.complete(count), two.complete(count)
    assert first.keys() == second.keys() == {
        topic.name for topic in SHOWN if topic is not topics.CLOCK}
    for topic in SPARSE:
        found = [by_time(topic, each.pop(topic.name)) for each in (first, second)]
        # GPS shows what it saw 0.1 s, some 12 steps, and more before the last.
        common = found[0].keys() & found[1].keys()
        assert len(common) >= count // 2, topic.name
        assert all(found[0][time] == found[1][time] for time in common), topic.name
    assert {name: len(data) for name, data in first.items()} == {
        name: len(data) for name, data in second.items()}
    for name, data in first.items():
        assert data == second[name], name
    # /clock is best effort, so not every stamp need arrive; what does is of the same times.
    times = {k * one.time_ns() // count for k in range(count + 1)}
    assert clocks <= times and other_clocks <= times and one.time_ns() in clocks


def pulled(joints, k):
    """Return all commands of the step k: a pull into the stall, with some aileron."""
    pull = {'elevator': -0.3 * min(k / 20, 1.0), 'aileron': 0.05 * math.sin(0.3 * k)}
    return [position + pull.get(name, 0.0)
            for name, position in zip(joints.name, joints.position)]


def flown_by_name(probe, tape, count):
    """Fly as a client that knows nothing of DDS does: send until the next state is there."""
    publisher = probe.publisher(JointState, 'autopilot/surface_cmd')
    for k in range(count):
        command = JointState(name=tape.joints.name, position=pulled(tape.joints, k))
        now_ns = tape.time_ns()
        command.header.stamp.sec, command.header.stamp.nanosec = divmod(now_ns, 1_000_000_000)

        def again(command=command, k=k):
            publisher.publish(command)
            return tape.steps() > k
        probe.spin_until(again, f'step {k}')
        publisher.publish(command)   # one more, that comes late


def array_publisher(probe, tape, reports):
    """Return a publisher of arrays that is heard, tried while the simulator is paused."""
    publisher = probe.publisher(Float64MultiArray, 'surface_commands')
    arrives(reports, publisher, Float64MultiArray(data=tape.joints.position))
    reports.wait_for('pace', 'steps', '0')
    assert probe.call(SetBool, 'pause', data=False).success
    return publisher


def step_by_array(reports, publisher, tape, position, accepted):
    """
    Take one step by an array: new whenever it comes, and best effort, so it may not come.

    accepted : how many commands were before. The count may be seen before the state, or after.
    """
    steps = tape.steps()
    send_sparingly(reports, publisher, Float64MultiArray(data=position), lambda: (
        tape.steps() > steps or reports.number('commands', 'accepted') > accepted), 'the command')
    tape.probe.spin_until(lambda: tape.steps() > steps, f'step {steps}')


def flown_by_array(probe, tape, count):
    """Fly slowly, with the clock of standing time coming several times at every third step."""
    reports = Reports(probe)
    publisher = array_publisher(probe, tape, reports)
    clocks, accepted = tape.heard[topics.CLOCK.name], reports.number('commands', 'accepted')
    for k in range(count):
        step_by_array(reports, publisher, tape, pulled(tape.joints, k), accepted + k)
        if k % 3 == 0:
            seen = len(clocks)
            probe.spin_until(
                lambda seen=seen: len(clocks) > seen + 1, 'the clock of standing time')


def test_the_same_commands_give_the_same_bytes_at_any_speed(start, probe, another_graph):
    """Fast and with every command sent again and again, or slowly and by another topic."""
    count = 60
    start('simulator', ros=['-p', 'lockstep:=command', '-p', 'rates.diagnostics:=10.0',
                            *EVERYTHING])
    fast = Tape(probe, SHOWN)
    flown_by_name(probe, fast, count)
    fast.complete(count)
    reports = Reports(probe)
    reports.wait_for('pace', 'steps', str(count))
    probe.spin_until(lambda: reports.number('commands', 'repeated_in_lockstep') >= count,
                     'the count of what came again')
    assert reports.value('commands', 'accepted') == str(count)
    assert reports.message('flight') == 'waits for the next command'

    start_other, other = another_graph
    start_other('simulator', ros=[
        '-p', 'lockstep:=command', '-p', 'real_time_factor:=7.0', '-p', 'rates.clock:=20.0',
        '-p', 'start_paused:=true', '-p', 'rates.diagnostics:=20.0', *EVERYTHING])
    slow = Tape(other, SHOWN)
    flown_by_array(other, slow, count)
    require_same(fast, slow, count)
    stalled = deserialize_message(fast.heard['strip_stalled'][-1], Float64MultiArray)
    assert any(stalled.data)   # it was no cruise that was compared


def test_lockstep_by_service_gives_the_same_bytes_at_any_speed(start, probe, another_graph):
    """Step after step at once, or with the clock of standing time between them."""
    count = 40
    banked = ['-p', 'initial.trim:=false', '-p', 'initial.euler_deg:=[-35.0, 12.0, 0.0]']
    start_other, other = another_graph
    start('simulator', ros=['-p', 'lockstep:=service', *banked, *EVERYTHING])
    start_other('simulator', ros=['-p', 'lockstep:=service', '-p', 'real_time_factor:=7.0',
                                  '-p', 'rates.clock:=20.0', *banked, *EVERYTHING])
    fast, slow = Tape(probe, SHOWN), Tape(other, SHOWN)
    for tape in (fast, slow):
        step = tape.probe.client(Trigger, 'step')
        clocks = tape.heard[topics.CLOCK.name]
        for k in range(count):
            future = step.call_async(Trigger.Request())
            tape.probe.spin_until(future.done, f'step {k}')
            assert future.result().success
            if tape is slow and k % 3 == 0:
                seen = len(clocks)
                tape.probe.spin_until(
                    lambda seen=seen, clocks=clocks: len(clocks) > seen + 1, 'standing time')
    require_same(fast, slow, count)


def with_autopilot(start):
    """Start a simulator, paused in a bank, and the example autopilot; return both."""
    return start('simulator', ros=[
        '-p', 'lockstep:=command', '-p', 'start_paused:=true', '-p', 'initial.trim:=false',
        '-p', 'initial.euler_deg:=[-35.0, 12.0, 0.0]', *EVERYTHING]), start(
            'autopilot', ros=['-p', 'lockstep:=true'])


def flown_by_autopilot(simulator, autopilot, probe, count, *, slowly):
    """
    Return the tape of so many steps.

    slowly : the simulator stands still, as a process, again and again.
    """
    autopilot.wait_for('flies aileron')
    tape = Tape(probe, SHOWN)
    assert probe.call(SetBool, 'pause', data=False).success
    while slowly and tape.steps() < count:
        simulator.send(signal.SIGSTOP)
        until = time.monotonic() + 0.02
        probe.spin_until(lambda until=until: time.monotonic() > until)
        simulator.send(signal.SIGCONT)
        steps = tape.steps()
        probe.spin_until(lambda steps=steps: tape.steps() > steps, 'another step')
    tape.complete(count)
    return tape


def test_with_an_autopilot_in_the_loop_the_same_bytes_come_twice_at_any_speed(
        start, probe, another_graph):
    """Those two wait for each other but not for who listens: of what he missed nothing is said."""
    count = 50
    start_other, other = another_graph
    one, two = with_autopilot(start), with_autopilot(start_other)
    fast = flown_by_autopilot(*one, probe, count, slowly=False)
    slow = flown_by_autopilot(*two, other, count, slowly=True)
    compared = [topic for topic in SHOWN
                if topic.rate not in (topics.Rate.ONCE, topics.Rate.CLOCK)]

    def both_heard(topic):
        """Return what each has of a topic, of the steps that both have something of."""
        each = [tape.by_step(topic.name) if topic.name in IN_STEP
                else by_time(topic, tape.heard[topic.name]) for tape in (fast, slow)]
        common = each[0].keys() & each[1].keys()
        return [[found[key] for key in common] for found in each]

    # Of a fast flight that outran this process, the slow one may have to come as far.
    while any(len(both_heard(topic)[0]) < count // 5 for topic in compared):
        for tape in (fast, slow):
            steps = tape.steps()
            tape.probe.spin_until(
                lambda tape=tape, steps=steps: tape.steps() > steps + count, 'more steps')
    for topic in compared:
        heard, heard_again = both_heard(topic)
        same = heard == heard_again
        assert same, topic.name
    told = [deserialize_message(data, JointState)
            for tape in (fast, slow) for data in tape.heard[JOINTS]]
    ailerons = [each.position[each.name.index('aileron')] for each in told]
    assert max(ailerons) > 0.02   # it was flown: from a bank to the left, stick to the right


def test_two_who_fly_in_lockstep_are_both_heard_and_the_first_of_a_state_moves_it(start, probe):
    """Under `sum`; what bears the time of another clock is refused with the reason."""
    start('simulator', ros=['-p', 'lockstep:=command', '-p', 'command.source:=sum',
                            '-p', 'rates.diagnostics:=20.0', '-p', 'rates.state:=1000.0'])
    tape, reports = Tape(probe, BY_DEFAULT), Reports(probe)
    trim = dict(zip(tape.joints.name, tape.joints.position))
    publishers = {name: probe.publisher(JointState, f'{name}/surface_cmd')
                  for name in ('autopilot', 'pilot')}

    def say(who, elevator, done, what, stamp=None):
        message = JointState(name=list(trim), position=[
            value + elevator * (name == 'elevator') for name, value in trim.items()])
        time_ns = tape.time_ns() if stamp is None else stamp
        message.header.stamp.sec, message.header.stamp.nanosec = divmod(time_ns, 1_000_000_000)
        send_until(probe, publishers[who], message, done, what)

    first = tape.time_ns()
    say('autopilot', 0.02, lambda: tape.steps() == 1, 'the first step')
    say('pilot', 0.05, lambda: reports.number('commands', 'accepted') == 2, 'the pilot', first)
    assert tape.steps() == 1                # his answer is to a state that has gone by
    say('autopilot', 0.02, lambda: tape.steps() == 2, 'the second step')
    shown = deserialize_message(tape.heard[JOINTS][-1], JointState)
    assert dict(zip(shown.name, shown.position))['elevator'] == pytest.approx(
        trim['elevator'] + 0.07, abs=1e-9)
    say('pilot', 0.0, lambda: reports.number('commands', 'refused_ahead_of_time') > 0,
        'the refusal', 1_700_000_000_000_000_000)
    assert tape.steps() == 2
    refused = probe.set_parameter('real_time_factor', 2.0)
    assert not refused.successful and 'the next command' in refused.reason


def test_lockstep_by_service_is_that_by_command_and_nothing_else_moves_it(
        start, probe, another_graph):
    count = 12
    start('simulator', ros=['-p', 'lockstep:=service', '-p', 'rates.diagnostics:=10.0'])
    asked = Tape(probe, BY_DEFAULT)
    reports = Reports(probe)
    reports.wait_for('flight', 'paused', 'false')
    assert reports.message('flight') == 'waits for the step service'
    for _ in range(count):
        assert probe.call(Trigger, 'step').success
    by_service, _ = asked.complete(count)
    dt = asked.time_ns() // count
    assert asked.time_ns() == count * dt
    assert probe.set_parameter('step_count', 5).successful
    assert probe.call(Trigger, 'step').message == (
        f'at simulated time {17 * dt * 1e-9:.9g} s')
    reports.wait_for('pace', 'steps', '17')   # unpaused all the while, and nothing else stepped

    start_other, other = another_graph
    start_other('simulator', ros=['-p', 'lockstep:=command', '-p', 'rates.diagnostics:=20.0',
                                  '-p', 'start_paused:=true'])
    told = Tape(other, BY_DEFAULT)
    other_reports = Reports(other)
    pilot = other.publisher(JointState, 'pilot/surface_cmd')
    # Neither a full command while paused nor a part of one makes it advance.
    array = array_publisher(other, told, other_reports)
    arrives(other_reports, pilot,
            JointState(name=['aileron'], position=[told.joints.position[0]]))
    other_reports.wait_for('pace', 'steps', '0')
    assert 'pause first' in other.call(Trigger, 'step').message
    accepted = other_reports.number('commands', 'accepted')
    for k in range(count):
        step_by_array(other_reports, array, told, told.joints.position, accepted + k)
    by_command, _ = told.complete(count)
    for name in told.in_step:
        assert by_service[name][:count] == by_command[name], name
