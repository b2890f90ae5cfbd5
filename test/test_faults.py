# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""A flight among faults: bad messages, killed and stopped processes, a full disk; over DDS."""

import array
import json
import math
import random
import resource
import signal
import subprocess
import sys
import time
from collections import Counter
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

pytest.importorskip('rclpy', reason='rclpy is not installed')

import rclpy
from geometry_msgs.msg import Vector3Stamped
from instants import a_scenario
from nav_msgs.msg import Odometry
from processes import (
    LIMIT,
    Reports,
    environment,
    free_domain,
    nanoseconds,
    owed,
    send_sparingly,
)
from rcl_interfaces.msg import Parameter, ParameterValue
from rcl_interfaces.srv import SetParameters, SetParametersAtomically
from rclpy.executors import SingleThreadedExecutor
from rclpy.qos import QoSProfile, ReliabilityPolicy
from rclpy.serialization import deserialize_message, serialize_message
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import Imu, JointState
from std_msgs.msg import Float64MultiArray
from std_srvs.srv import SetBool, Trigger

from poststall_sim import recording, topics
from poststall_sim.ros import messages
from poststall_sim.ros.recorder import RecorderNode

pytestmark = [pytest.mark.ros, pytest.mark.slow, pytest.mark.timeout(300)]

STATE_PERIOD_NS = 20_000_000
RELIABLE = [topic for topic in topics.PUBLISHED
            if topic.qos.reliable and topic.common and topic.by_default
            and messages.available(topic.type)]


EXPONENT = np.uint64(0x7ff0_0000_0000_0000)
"""All of its bits are set in what is not finite."""


class Flight:
    """What a simulator shows from now on, and whether it is in order."""

    def __init__(self, start, probe, *settings):
        self.process = start('simulator', ros=[
            '-p', 'rates.diagnostics:=20.0', '-p', 'initial.altitude:=1500.0', *settings])
        self.probe = probe
        self.clocks = probe.collect(Clock, '/clock', QoSProfile(
            depth=100, reliability=ReliabilityPolicy.BEST_EFFORT))
        self.odoms, self.infos = probe.collect_with_infos(Odometry, 'odom', 1000)
        self.joints = probe.collect(JointState, 'joint_states', 1000)
        self.reports = Reports(probe)
        self.seen = {}
        self.keeper = rclpy.create_node('keeper', context=probe.context)
        # The middleware keeps these until they are looked at: to spin for them all takes a core.
        self.kept = {topic: self.keeper.create_subscription(
            messages.message_class(topic.type), topic.name, lambda data: None,
            messages.qos_profile(topics.Qos(1000, True, topic.qos.latched)), raw=True)
            for topic in RELIABLE}
        self.go_on()

    def go_on(self, count=10):
        """Wait until the flight has gone on for some states."""
        before = len(self.odoms)
        self.probe.spin_until(lambda: len(self.odoms) > before + count and self.clocks
                              and self.reports.heard and self.joints, 'the flight to go on')

    def time_ns(self):
        return nanoseconds(self.odoms[-1].header.stamp)

    def taken(self, topic):
        """Return the bytes of what a topic has shown, all of which it kept until now."""
        subscription = self.kept[topic]
        with subscription.handle:
            while (found := subscription.handle.take_message(
                    subscription.msg_type, True)) is not None:
                self.seen.setdefault(topic, []).append(found[0])
        return self.seen.get(topic, [])

    def elevator(self):
        return dict(zip(self.joints[-1].name, self.joints[-1].position))['elevator']

    def require_order(self, *, anew=False):
        """
        Assert that it flies on, that all it showed is finite and that time never went back.

        Finite is every real number of 64 bits of every reliable topic, of the last 1000 messages.

        It has shown a state in every period, and odom, which is reliable, has lost none that it
        owed. anew : it was put elsewhere on the way, and each time showed its state at once.
        """
        self.go_on()
        assert self.process.process.poll() is None, self.process.says()
        assert 'Traceback' not in self.process.says()
        self.probe.spin_until(lambda: all(map(self.taken, self.kept)), 'all reliable topics')
        for topic in self.kept:
            for data in self.taken(topic):
                words = np.frombuffer(data[4:], '<u8', (len(data) - 4) // 8)   # as CDR aligns them
                if (words & EXPONENT == EXPONENT).any():   # that, or a text that looks like it
                    message = deserialize_message(data, messages.message_class(topic.type))
                    assert all(map(math.isfinite, reals(message))), (topic.name, message)
        for stamps in ([nanoseconds(clock.clock) for clock in self.clocks],
                       [nanoseconds(odom.header.stamp) for odom in self.odoms]):
            assert (np.diff(stamps) >= 0).all()
        assert self.reports.level('flight') == 0, self.reports.message('flight')
        assert not owed(self.infos)
        numbers = np.diff([info['publication_sequence_number'] for info in self.infos])
        periods = np.diff([nanoseconds(odom.header.stamp) // STATE_PERIOD_NS
                           for odom in self.odoms])
        assert (periods[numbers == 1] <= 1).all()
        if not anew:
            assert (periods >= 1).all()   # each period once


def reals(value):
    """Yield every real number in a message."""
    if isinstance(value, float):
        yield value
    elif hasattr(value, 'get_fields_and_field_types'):
        for name in value.get_fields_and_field_types():
            yield from reals(getattr(value, name))
    elif isinstance(value, np.ndarray | array.array):
        yield from (each for each in value if isinstance(each, float))
    elif isinstance(value, list | tuple):
        for each in value:
            yield from reals(each)


@pytest.fixture
def fly(start, probe):
    """Return what starts a simulator with settings and looks at it."""
    flights = []

    def fly(*settings):
        flights.append(Flight(start, probe, *settings))
        return flights[-1]
    yield fly
    for flight in flights:
        flight.keeper.destroy_node()


@pytest.fixture
def flight(fly):
    return fly()


def joints(names=(), positions=(), time_ns=0):
    message = JointState(name=list(names), position=list(positions))
    message.header.stamp.sec, message.header.stamp.nanosec = divmod(time_ns, 1_000_000_000)
    return message


def bad_commands():
    """
    Yield 20 kinds of commands that nobody should obey: topic, message, counter and its count.

    Bytes that are no message have no counter: they end in the middleware.
    """
    valid = serialize_message(joints(['elevator'], [-0.2]))
    garbage = random.Random(1)
    auto, pilot, array = 'autopilot/surface_cmd', 'pilot/surface_cmd', 'surface_commands'
    length, finite, unknown = 'refused_wrong_length', 'refused_not_finite', 'unknown_names'
    twice, states = 'refused_duplicate_name', 'refused_states'
    wind, state = Vector3Stamped(), Odometry()
    wind.vector.x = math.nan
    state.pose.pose.orientation.w, state.twist.twist.linear.x = 1.0, 1e300
    state.pose.pose.position.z = 100.0
    yield from (
        (auto, joints(['elevator'], [math.nan]), finite, 1),
        (auto, joints(['elevator', 'rudder'], [0.1, math.inf]), finite, 1),
        (auto, joints(['flap\x1b[31m\n' * 1000], [-math.inf]), finite, 1),
        (auto, joints(['elevator'], [0.0, 1.0]), length, 1),
        (auto, joints(['elevator', 'rudder'], [0.0]), length, 1),
        (auto, joints(), length, 1),
        (auto, joints((), [0.1] * 10_000), length, 1),
        (auto, joints(['rudder', 'rudder'], [0.0, 0.1]), twice, 1),
        (auto, joints([f'n{i // 2}' for i in range(2000)], [0.1] * 2000), twice, 1),
        (auto, joints(['flap'], [0.1]), unknown, 1),
        (auto, joints([''], [0.1]), unknown, 1),
        (pilot, joints(['\x1b]0;\n[FATAL] ' * 1000], [0.1]), unknown, 1),
        (pilot, joints([f'x{i}' for i in range(500)], [0.1] * 500), unknown, 500),
        (pilot, joints(['elevator'], [-0.2], time_ns=1), 'refused_stale', 1),
        (pilot, b'\x00\x01\x00\x00' + bytes(garbage.randrange(128, 256) for _ in range(200)),
         None, 0),
        (pilot, valid[:len(valid) // 2], None, 0),
        # The length of the list of names, claimed to be 2^32 - 1.
        (pilot, valid[:20] + b'\xff' * 4 + valid[24:], None, 0),
        (array, Float64MultiArray(data=[0.0] * 10_000), length, 1),
        ('wind', wind, states, 1),
        ('set_state', state, states, 1),
    )


def test_a_reliable_topic_owes_a_message_until_10_newer_ones_are_published():
    def heard(*numbers, late=()):
        """Return what is said of numbers published at 20 ms each, received at once or late."""
        return [{'publication_sequence_number': n, 'source_timestamp': 20 * n,
                 'received_timestamp': dict(late).get(n, 20 * n + 1)} for n in numbers]

    assert owed(heard(*range(5), *range(6, 30))) == [5]
    # Ten were published, the last at 300, before the first of them was received.
    assert owed(heard(*range(5), *range(6, 30), late=[(6, 300)])) == []
    assert owed(heard(*range(5), *range(6, 30), late=[(6, 299)])) == [5]
    assert owed(heard(*range(5), *range(26, 40), late=[(26, 700)])) == []
    assert owed(heard(*range(5), *range(26, 40))) == list(range(17, 26))


def test_a_subscriber_that_does_not_spin_for_1_s_keeps_what_its_own_history_holds(flight, probe):
    """Receiving goes on meanwhile, so that nothing is lost but to a history that is too short."""
    odom = next(topic for topic in RELIABLE if topic.name == 'odom')
    shallow = flight.keeper.create_subscription(Odometry, 'odom', lambda message: None, 10)

    def taken():
        """Return the numbers of what it has kept; an executor would take them one by one."""
        found = []
        with shallow.handle:
            while (item := shallow.handle.take_message(Odometry, False)) is not None:
                found.append(item[1]['publication_sequence_number'])
        return found

    probe.spin_until(taken, 'its first message')
    begun, end = len(flight.taken(odom)), time.monotonic() + LIMIT
    while len(flight.taken(odom)) < begun + 50:   # a second of the flight
        assert time.monotonic() < end
        time.sleep(0.02)
    before = time.time_ns()
    found = taken()
    after = time.time_ns()
    probe.spin_until(
        lambda: flight.infos[-1]['received_timestamp'] > after, 'all that came meanwhile')
    first, last = (max(info['publication_sequence_number'] for info in flight.infos
                       if info['received_timestamp'] < when) for when in (before, after))
    # The ten before it was looked at; what comes while it is read takes the place of what was.
    assert len(found) >= 10 and first - 10 <= found[0] <= last - 8
    assert last - first > 1 or found == list(range(found[0], found[0] + len(found)))
    flight.require_order()


def test_10_000_bad_commands_of_20_kinds_are_counted_and_move_nothing(fly, probe):
    flight = fly('-p', 'rates.diagnostics:=100.0')   # each round waits for one
    flight.probe.spin_until(lambda: flight.time_ns() > 1_000_000_000, 'a stamp of 1 ns to be old')
    kinds = list(bad_commands())
    assert len(kinds) == 20
    publishers = {
        topic: probe.publisher(next(
            type(message) for where, message, *_ in kinds if where == topic and
            not isinstance(message, bytes)), topic)
        for topic in {topic for topic, *_ in kinds}}
    counters = {counter for *_, counter, _ in kinds if counter}
    assert sum(count for *_, count in kinds) == 16 + 500
    before = {key: flight.reports.number('commands', key) for key in counters}
    trim = flight.elevator()
    sent = Counter()
    kinds = [(topic, message if isinstance(message, bytes) else serialize_message(message),
              counter, count) for topic, message, counter, count in kinds]   # once, not 500 times

    def put(topic, message, counter, count):
        publishers[topic].publish(message)
        if counter:
            sent[counter] += count

    def uncounted():
        return {key: sent[key] - flight.reports.number('commands', key) + before[key]
                for key in counters}

    def lost(until_now):
        """Return what is not counted: as much as until now, or what does not become less."""
        left = uncounted()
        while left != until_now:
            heard = len(flight.reports.heard)
            probe.spin_until(lambda left=left, heard=heard: uncounted() != left
                             or len(flight.reports.heard) > heard + 5, 'diagnostics')
            if uncounted() == left:
                break
            left = uncounted()
        return left

    # Who is not known yet is not heard: of each topic one that comes alone, until it is counted.
    for kind in {kind[0]: kind for kind in kinds if kind[2]}.values():
        heard = flight.reports.number('commands', kind[2])
        send_sparingly(
            flight.reports, SimpleNamespace(publish=lambda kind: put(*kind)), kind,
            lambda kind=kind, heard=heard: flight.reports.number('commands', kind[2]) > heard,
            kind[0])
    rounds, few, gone = 0, 0, lost({})
    while rounds < 500:
        for kind in kinds:   # more than the history of a topic at once would be lost on the way
            put(*kind)
        until_now, gone = gone, lost(gone)
        if all(gone[key] <= until_now[key] for key in counters):
            rounds += 1
        else:   # best effort: a few may be lost all the same, and their round is not one
            few += 1
            assert few < 50, (gone, dict(sent))
    assert min(gone.values()) >= 0, (gone, dict(sent))   # none was counted twice
    assert flight.reports.value('commands', 'accepted') == '0'
    assert flight.reports.value('commands', 'refused_out_of_order') == '0'
    assert flight.elevator() == trim
    said = flight.process.says()
    assert '\x1b]' not in said and '\n[FATAL]' not in said   # a name writes no log of its own
    assert len(said) < 200_000
    flight.require_order()


@pytest.mark.parametrize('times', [1, pytest.param(2, marks=pytest.mark.soak)])
def test_a_pilot_killed_1_or_2_times_leaves_trim_behind_and_is_obeyed_when_he_returns(
        fly, start, probe, tmp_path, times):
    flight = fly('-p', 'command.on_timeout:=trim')
    trim = flight.elevator()
    pull = a_scenario(tmp_path / 'pull.yaml', 'elevator', '[[0.0, -2.0], [60.0, -2.0]]')
    pull.write_text(pull.read_text().replace('duration_s: 2.0', 'duration_s: 60.0'))
    pulled = pytest.approx(trim - math.radians(2.0), abs=1e-6)
    commands = probe.collect(JointState, 'pilot/surface_cmd', 1000)
    for _ in range(times):
        commands.clear()
        pilot = start('pilot', ros=['-p', f'scenario:={pull}'])
        probe.spin_until(lambda: commands and flight.elevator() == pulled, 'the pilot to pull')
        pilot.send(signal.SIGKILL)
        assert pilot.ended() == -signal.SIGKILL
        probe.spin_until(lambda: flight.elevator() == pytest.approx(trim, abs=1e-9), 'trim')
        # command.timeout is 0.5 s, and a command that is older than that is not obeyed.
        assert 0.3e9 < nanoseconds(flight.joints[-1].header.stamp) - nanoseconds(
            commands[-1].header.stamp) < 1.1e9
        flight.reports.wait_for('commands', 'source', 'none')
    pilot = start('pilot', ros=['-p', f'scenario:={pull}'])
    probe.spin_until(lambda: flight.elevator() == pulled, 'the pilot to pull again')
    flight.reports.wait_for('commands', 'source', 'pilot')
    flight.require_order()


def test_a_simulator_stopped_for_2_s_goes_on_where_it_was_and_says_what_was_lost(flight, probe):
    began, lost = time.monotonic(), flight.reports.number('pace', 'lost_time_s')
    flight.process.send(signal.SIGSTOP)
    end = time.monotonic() + 2.0
    probe.spin_until(lambda: time.monotonic() > end, '2 s')
    stopped, continued = flight.time_ns(), time.monotonic()
    flight.process.send(signal.SIGCONT)
    probe.spin_until(
        lambda: flight.reports.number('pace', 'lost_time_s') > lost + 1.5, 'a report of the loss')
    assert flight.reports.number('pace', 'lost_wall_time_s') == pytest.approx(
        flight.reports.number('pace', 'lost_time_s'), abs=0.05)   # at a factor of 1
    ended = time.monotonic()
    # What was flown before, and not yet reported as lost, is less than half a second.
    assert flight.reports.number('pace', 'lost_time_s') < lost + ended - began + 0.5
    assert 1e-9 * (flight.time_ns() - stopped) < ended - continued + 1.0   # no leap
    flight.require_order()


def test_1_recorder_killed_leaves_a_bag_that_says_so_and_another_records(
        flight, start, probe, tmp_path):
    recorder = start('recorder', '--output', str(tmp_path / 'bag'))
    recorder.wait_for('ready')
    flight.go_on()
    recorder.send(signal.SIGKILL)
    assert recorder.ended() == -signal.SIGKILL
    with pytest.raises(recording.BagError, match='bag.*was not closed'):
        recording.read(tmp_path / 'bag')
    flight.go_on(50)
    other = start('recorder', '--output', str(tmp_path / 'other'))
    other.wait_for('ready')
    other.send(signal.SIGINT)
    assert other.ended() == 0
    assert len(recording.read(tmp_path / 'other')['/odom'])
    flight.require_order()


def test_bytes_too_short_for_a_stamp_are_recorded_as_they_came_and_end_no_recorder(tmp_path):
    """A recorder takes bytes as they are: nothing before it tells that they are no message."""
    context = rclpy.Context()
    context.init(args=[], domain_id=free_domain())
    recorder = RecorderNode(str(tmp_path / 'bag'), ['imu'], context=context)
    try:
        imus = recorder.create_publisher(Imu, 'imu', 10)
        executor = SingleThreadedExecutor(context=context)
        executor.add_node(recorder)
        end = time.monotonic() + LIMIT

        def turn_until(done):
            while not done():
                assert time.monotonic() < end
                executor.spin_once(timeout_sec=0.02)
        turn_until(imus.get_subscription_count)
        whole = serialize_message(Imu())
        for data in (whole[:4], whole[:7], whole):
            imus.publish(data)
        turn_until(lambda: recorder._recorder.messages == 3)
    finally:
        recorder.destroy_node()
        context.try_shutdown()
    series = recording.read(tmp_path / 'bag')['/imu']
    assert (len(series), series.skipped) == (1, 2)


@pytest.mark.soak
def test_1_recorder_whose_disk_is_full_ends_with_one_line(flight, start, tmp_path):
    """
    By a limit on the size of its files, EFBIG: a disk that is full, ENOSPC, needs root to mount.

    To the recorder both are the same: a write that fails half-way with an error of the system.
    """
    recorder = start('recorder', '--output', str(tmp_path / 'bag'))
    recorder.wait_for('ready')
    limit = 300_000   # less than the first chunk that it writes, and more than its log
    resource.prlimit(recorder.process.pid, resource.RLIMIT_FSIZE, (limit, limit))
    flight.probe.spin_until(lambda: recorder.process.poll() is not None, 'the end', LIMIT)
    assert recorder.ended() == 1
    said = recorder.says()
    assert said.count('[FATAL]') == 1 and said.count('cannot go on recording') == 1
    assert 'File too large' in said and 'Traceback' not in said
    with pytest.raises(recording.BagError, match='was not closed'):
        recording.read(tmp_path / 'bag')
    flight.require_order()


def test_1_state_in_which_it_diverges_pauses_it_and_a_reset_flies_on(flight, probe):
    state = probe.publisher(Odometry, 'set_state')
    wild = Odometry()
    wild.pose.pose.orientation.w, wild.pose.pose.position.z = 1.0, 1000.0
    for part, value in ((wild.twist.twist.linear, 400.0), (wild.twist.twist.angular, 100.0)):
        part.x = part.y = part.z = value   # the greatest that is taken
    send_sparingly(flight.reports, state, wild,
                   lambda: 'diverged' in flight.reports.message('flight'), 'the divergence')
    assert flight.reports.value('flight', 'paused') == 'true'
    refused = probe.call(SetBool, 'pause', data=False)
    assert not refused.success and 'call reset first' in refused.message
    assert probe.call(Trigger, 'reset').success
    probe.spin_until(lambda: flight.reports.level('flight') == 0, 'a report of the new flight')
    flight.require_order(anew=True)


def test_1_call_for_1_000_000_steps_is_left_when_a_signal_comes(flight, probe):
    assert probe.call(SetBool, 'pause', data=True).success
    assert probe.set_parameter('step_count', 1_000_000).successful
    step = probe.node.create_client(Trigger, 'step')
    probe.spin_until(step.service_is_ready, 'the service')
    begun = flight.time_ns()
    step.call_async(Trigger.Request())
    # By more than may still be on its way from before the pause.
    probe.spin_until(lambda: flight.time_ns() > begun + 200_000_000, 'the steps to begin')
    flight.process.send(signal.SIGTERM)
    assert flight.process.ended() == 0
    assert 'Traceback' not in flight.process.says()


def test_100_changes_of_parameters_in_flight_are_taken_or_refused_with_a_reason(flight, probe):
    changes = [
        ('wind.velocity', [0.5, -1.0, 0.0], True), ('wind.velocity', [math.nan, 0.0, 0.0], False),
        ('wind.velocity', [0.0], False), ('command.timeout', 1.0, True),
        ('command.timeout', -1.0, False), ('command.source', 'pilot', True),
        ('command.source', 'x' * 10_000, False), ('real_time_factor', 0.5, True),
        ('real_time_factor', math.inf, False), ('real_time_factor', 1.0, True),
        ('real_time_factor', 'fast', False), ('dt', 1e-9, False), ('step_count', 0, False),
        ('step_count', 2**62, False), ('flight_file', '/dev/zero', False),
        ('command.on_timeout', 'neutral', True), ('command.on_timeout', 'hold', True),
        ('aircraft', '../../etc/passwd', False), ('no.such', 1, False),
        ('wind.velocity', [0.0, 0.0, 0.0], True)]
    for _ in range(5):
        for name, value, fits in changes:
            result = probe.set_parameter(name, value)
            assert result.successful == fits, (name, value, result.reason)
            assert fits or result.reason
    for service in ('save_state', 'load_state'):
        assert not probe.call(Trigger, service).success
    flight.require_order()


def test_5_requests_for_parameters_of_types_there_are_not_leave_it_flying(flight, probe):
    """Lists without elements, and a type that ROS does not have: that ends in rclpy itself."""
    def asked(name, kind):
        return [Parameter(name=name, value=ParameterValue(type=kind))]

    for name, kind in (('joy.deadband', 7), ('real_time_factor', 8), ('step_count', 5)):
        result, = probe.call(SetParameters, '/simulator/set_parameters',
                             parameters=asked(name, kind)).results
        assert not result.successful and result.reason
    assert flight.reports.value('commands', 'dropped_by_rclpy') == '0'
    for service, name in ((SetParameters, 'set_parameters'),
                          (SetParametersAtomically, 'set_parameters_atomically')):
        client = probe.node.create_client(service, f'/simulator/{name}')
        probe.spin_until(client.service_is_ready, name)
        client.call_async(service.Request(parameters=asked('joy.deadband', 77)))
    flight.reports.wait_for('commands', 'dropped_by_rclpy', '2')
    assert flight.process.says().count('rclpy cannot handle a message') == 1   # of a kind, one
    assert probe.set_parameter('step_count', 2).successful
    flight.require_order()


def test_1_process_that_floods_it_with_huge_commands_stops_neither_time_nor_services(
        flight, start, probe):
    flooder = start(Path(__file__).with_name('flooder.py'))
    flooder.wait_for('floods')
    flight.probe.spin_until(
        lambda: flight.reports.number('commands', 'unknown_names') > 50_000, 'the flood')
    pause = probe.client(SetBool, 'pause')   # finding each other may take seconds of its own
    for _ in range(3):
        clocks, begun = len(flight.clocks), flight.time_ns()
        probe.spin_until(lambda begun=begun, clocks=clocks: len(flight.clocks) > clocks
                         and flight.time_ns() > begun + 100_000_000, 'time', 10.0)
        answer = pause.call_async(SetBool.Request(data=False))
        probe.spin_until(answer.done, 'an answer', 5.0)
        assert answer.result().success
    flooder.kill()
    flight.require_order()


def test_200_resets_pauses_and_steps_of_3_processes_at_once_are_all_answered(flight, start, probe):
    """More of them wait at a time than the middleware would keep for a service by itself."""
    assert probe.call(SetBool, 'pause', data=True).success
    callers = [subprocess.Popen(
        [sys.executable, str(Path(__file__).with_name('caller.py')), str(seed), str(count)],
        env=environment(start.domain), stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
        for seed, count in ((1, 67), (2, 67), (3, 66))]
    try:
        for caller in callers:
            assert caller.stdout.readline() == 'ready\n'
        for caller in callers:
            caller.stdin.write('go\n')
            caller.stdin.flush()
        probe.spin_until(lambda: all(caller.poll() is not None for caller in callers), 'the end')
        told = [json.loads(caller.stdout.read()) for caller in callers]
    finally:
        for caller in callers:
            caller.kill()
            caller.communicate()
    assert [each['answered'] for each in told] == [67, 67, 66]
    assert {text for each in told for text in each['refused']} <= {'not paused: pause first'}
    assert probe.call(SetBool, 'pause', data=False).success
    flight.require_order(anew=True)
