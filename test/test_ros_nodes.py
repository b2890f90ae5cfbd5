# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""The nodes as their users meet them: processes of their own, over DDS."""

import math
import signal

import numpy as np
import pytest

pytest.importorskip('rclpy', reason='rclpy is not installed')

from geometry_msgs.msg import PoseStamped, Vector3Stamped, WrenchStamped
from instants import a_scenario
from processes import LIMIT, Reports, nanoseconds, send_until
from rcl_interfaces.srv import GetParameters
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64, Float64MultiArray
from std_srvs.srv import SetBool, Trigger

from poststall_sim import recording, topics
from poststall_sim.ros.messages import available

pytestmark = [pytest.mark.ros, pytest.mark.timeout(300)]

BEST_EFFORT = QoSProfile(depth=1, reliability=ReliabilityPolicy.BEST_EFFORT)
LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)


def test_paused_stepped_flown_and_stopped(start, probe):
    """Clock while paused, lock-step, late subscribers, real time, run-time changes, SIGINT."""
    simulator = start('simulator', ros=[
        '-p', 'start_paused:=true', '-p', 'rates.diagnostics:=10.0'])
    clocks = probe.collect(Clock, '/clock', BEST_EFFORT)
    probe.spin_until(lambda: len(clocks) >= 5, 'the clock of a paused simulator')
    assert {nanoseconds(clock.clock) for clock in clocks} == {0}

    # Who comes late sees the present state, and the geometry.
    poses = probe.collect(PoseStamped, 'pose')
    strip_y = probe.collect(Float64MultiArray, 'strip_y', LATCHED)
    probe.spin_until(lambda: poses and strip_y, 'a pose and strip_y while paused')
    assert poses[0].header.frame_id == 'map'
    assert poses[0].pose.position.z == pytest.approx(150.0)
    names = probe.call(GetParameters, '/simulator/get_parameters',
                       names=['surfaces', 'strip_names'])
    surfaces, strip_names = (list(v.string_array_value) for v in names.values)
    assert surfaces == ['aileron', 'elevator', 'rudder', 'throttle']
    assert len(strip_names) == len(strip_y[0].data)

    # One step is one dt, whoever asks; several are several.
    reports = Reports(probe)
    probe.spin_until(lambda: reports.heard, 'diagnostics')
    dt = round(reports.number('pace', 'dt_s') * 1e9)
    poses.clear()
    assert probe.call(Trigger, 'step').success
    probe.spin_until(lambda: poses and nanoseconds(poses[-1].header.stamp) > 0,
                     'the pose after a step')
    assert nanoseconds(poses[-1].header.stamp) == dt
    assert probe.set_parameter('step_count', 7).successful
    assert probe.call(Trigger, 'step').success
    probe.spin_until(lambda: nanoseconds(poses[-1].header.stamp) == 8 * dt, 'eight steps')
    reports.wait_for('pace', 'steps', '8')
    assert reports.value('pace', 'steps_unpaced') == reports.value('solver', 'steps') == '8'

    # Stamps advance with wall time, but for what the reports say was lost; pausing is
    # idempotent; a flying simulator is not stepped.
    assert probe.call(SetBool, 'pause', data=False).success
    assert probe.call(SetBool, 'pause', data=False).success
    refused = probe.call(Trigger, 'step')
    assert not refused.success and 'pause first' in refused.message
    begin = nanoseconds(poses[-1].header.stamp)
    probe.spin_until(lambda: nanoseconds(poses[-1].header.stamp) > begin + 2_500_000_000,
                     '2.5 s of flight')
    # As a report has it at the moment at which it goes out. One in which a busy machine has just
    # stood still, so that nothing is lost yet, is one of many.
    went_out, time, lost = np.array([
        row for row in reports.history(('flight', 'time_s'), ('pace', 'lost_time_s'))
        if row[1] > begin * 1e-9]).T
    half = len(time) // 2
    behind = went_out - time - lost
    assert half > 5 and time[-1] + lost[-1] > begin * 1e-9 + 2.0
    assert np.median(behind[half:]) == pytest.approx(np.median(behind[:half]), abs=0.05)
    reports.heard.clear()
    assert reports.value('pace', 'steps') == reports.value('solver', 'steps')
    assert reports.value('pace', 'steps_unpaced') == '8'
    stamps = np.array([nanoseconds(pose.header.stamp) for pose in poses])
    assert (stamps % dt == 0).all()
    moving = np.diff(stamps[stamps > begin])
    assert moving.min() >= dt and np.median(moving) <= 20_000_000 + dt

    # What may change while it runs, and what may not.
    result = probe.set_parameter('command.source', 'nobody')
    assert not result.successful and 'auto, pilot, autopilot' in result.reason
    result = probe.set_parameter('uvlm.chordwise', 8)
    assert not result.successful and 'read-only' in result.reason
    result = probe.set_parameter('use_sim_time', True)
    assert not result.successful and 'source of simulated time' in result.reason
    assert probe.set_parameter('use_sim_time', False).successful
    for value in (True, 'fast'):
        result = probe.set_parameter('real_time_factor', value)
        assert not result.successful and 'DOUBLE' in result.reason
    assert probe.set_parameter('real_time_factor', 2).successful   # a whole number will do
    reports.wait_for('pace', 'real_time_factor_asked', '2')
    assert probe.set_parameter('real_time_factor', 0.5).successful
    reports.wait_for('pace', 'real_time_factor_asked', '0.5')
    far = poses[-1].pose.position.y
    answer = probe.call(Trigger, 'reset')
    assert answer.success and answer.message.startswith('flying at')
    probe.spin_until(lambda: poses[-1].pose.position.y < far, 'the reset')
    assert nanoseconds(poses[-1].header.stamp) > begin   # time goes on

    # Wind is where it blows to: to the south, it meets an aircraft that flies north.
    winds = probe.collect(Vector3Stamped, 'wind/applied')
    speeds = probe.collect(Float64, 'air_data/airspeed')
    probe.spin_until(lambda: winds and speeds, 'wind and airspeed')
    assert (winds[-1].vector.x, winds[-1].vector.y) == (0.0, 0.0)
    before = speeds[-1].data
    assert not probe.set_parameter('wind.velocity', [0.0, math.nan, 0.0]).successful
    assert probe.set_parameter('wind.velocity', [0.5, -2.0, 0.0]).successful
    probe.spin_until(lambda: winds[-1].vector.y == -2.0 and winds[-1].vector.x == 0.5, 'wind')
    probe.spin_until(lambda: max(speed.data for speed in speeds) > before + 1.0,
                     'the airspeed to rise')

    simulator.send(signal.SIGINT)
    simulator.send(signal.SIGINT)
    assert simulator.ended() == 0
    assert 'Traceback' not in simulator.says()


def test_alpha_answers_the_elevator_and_bad_commands_do_not_stop_the_flight(start, probe):
    simulator = start('simulator', ros=[   # high, so that a slow test does not end on the ground
        '-p', 'rates.diagnostics:=20.0', '-p', 'initial.altitude:=1500.0'])
    alphas = probe.collect(Float64, 'air_data/alpha')
    joints = probe.collect(JointState, 'joint_states')
    wrenches = probe.collect(WrenchStamped, 'wrench')
    reports = Reports(probe)
    command = probe.publisher(JointState, 'autopilot/surface_cmd')
    array = probe.publisher(Float64MultiArray, 'surface_commands')
    probe.spin_until(lambda: alphas and joints and reports.heard and wrenches, 'the first state')
    trim_alpha = alphas[-1].data
    trim = dict(zip(joints[-1].name, joints[-1].position))
    assert wrenches[-1].wrench.force.z == pytest.approx(9.0 * 9.81, rel=0.05)   # lift: weight

    def elevator_of(message):
        return dict(zip(message.name, message.position))['elevator']

    # Trailing edge up lifts the nose; down lowers it.
    up = JointState(name=['elevator'], position=[trim['elevator'] - 0.07])
    send_until(probe, command, up, lambda: alphas[-1].data > trim_alpha + 0.03, 'alpha to rise')
    probe.spin_until(lambda: elevator_of(joints[-1]) == pytest.approx(up.position[0]),
                     'the elevator where it was told to be')
    down = [trim[name] + (0.07 if name == 'elevator' else 0.0) for name in joints[-1].name]
    send_until(probe, array, Float64MultiArray(data=down),
               lambda: alphas[-1].data < trim_alpha - 0.03, 'alpha to fall')
    probe.spin_until(lambda: elevator_of(joints[-1]) == pytest.approx(down[1]),
                     'the elevator where the array has it')

    # None of these moves anything; each is counted.
    for publisher, message, key in (
            (command, JointState(name=['elevator', 'rudder'], position=[0.0, math.nan]),
             'refused_not_finite'),
            (command, JointState(name=['elevator'], position=[0.0, 1.0]), 'refused_wrong_length'),
            (command, JointState(name=['rudder', 'rudder'], position=[0.0, 1.0]),
             'refused_duplicate_name'),
            (command, JointState(name=['flap'], position=[0.1]), 'unknown_names'),
            (array, Float64MultiArray(data=[0.0]), 'refused_wrong_length'),
            (array, Float64MultiArray(data=[0.0, math.inf, 0.0, 0.0]), 'refused_not_finite')):
        counted = reports.number('commands', key)
        send_until(probe, publisher, message, lambda counted=counted, key=key: reports.number(
            'commands', key) > counted, f'a count of {key}')
    assert elevator_of(joints[-1]) == pytest.approx(down[1])
    assert dict(zip(joints[-1].name, joints[-1].position))['rudder'] == trim['rudder']

    # Beyond limits: cut, counted, and the pilot goes before the autopilot.
    pilot = probe.publisher(JointState, 'pilot/surface_cmd')
    send_until(probe, pilot, JointState(name=['elevator', 'throttle'], position=[-3.0, 7.0]),
               lambda: elevator_of(joints[-1]) == pytest.approx(math.radians(-30.0)),
               'the elevator at its limit')
    probe.spin_until(lambda: reports.value('commands', 'beyond_limits') != '0', 'the count')
    assert dict(zip(joints[-1].name, joints[-1].position))['throttle'] == 1.0
    count = len(alphas)
    probe.spin_until(lambda: len(alphas) > count + 10, 'the flight to go on')
    assert reports.value('flight', 'paused') == 'false'
    assert simulator.says().count('there is no control flap') == 1
    assert all(math.isfinite(alpha.data) for alpha in alphas)
    simulator.send(signal.SIGTERM)
    assert simulator.ended() == 0


def test_namespace_remap_and_parameter_file(start, probe, tmp_path):
    """What a user's launch file does: all of it reaches the node, for one of two aircraft."""
    (tmp_path / 'parameters.yaml').write_text("""
/left/simulator:
  ros__parameters:
    aircraft: trainer
    initial: {airspeed: 18.0, altitude: 1000.0}
    frames: {prefix: left/}
    rates: {state: 10.0}
    wind: {velocity: [0.0, 3.0, 0.0]}
""")
    simulator = start('simulator', ros=[
        '-r', '__ns:=/left', '-r', 'wrench:=forces', '-r', '/clock:=/left/clock',
        '--params-file', str(tmp_path / 'parameters.yaml'), '-p', 'initial.altitude:=900.0',
        '-p', 'rates.diagnostics:=10.0', '-p', 'airspeed:=15.0'])
    forces = probe.collect(WrenchStamped, '/left/forces')
    poses = probe.collect(PoseStamped, '/left/pose')
    clocks = probe.collect(Clock, '/left/clock', BEST_EFFORT)
    probe.spin_until(lambda: len(forces) > 5 and poses and len(clocks) > 5, 'the remapped topics')
    assert forces[0].header.frame_id == 'left/base_link'
    assert poses[0].pose.position.z == pytest.approx(900.0, abs=1.0)
    # Trimmed in the wind: through the air at 18 m/s to the north, drifting with 3 m/s more.
    poses.clear()
    probe.spin_until(lambda: len(poses) > 5, 'more poses')
    north = [pose.pose.position.y for pose in poses]
    times = [nanoseconds(pose.header.stamp) * 1e-9 for pose in poses]
    assert np.polyfit(times, north, 1)[0] == pytest.approx(21.0, abs=0.2)
    stamps = np.array([nanoseconds(force.header.stamp) for force in forces])
    assert np.median(np.diff(stamps)) == pytest.approx(1e8, rel=0.1)
    assert not probe.node.count_publishers('/clock')
    assert ('no parameter airspeed, its value is not used; did you mean initial.airspeed?'
            in simulator.says())

    # A second source of the same time is an error that says what to do.
    reports = Reports(probe, 'left/simulator')
    probe.spin_until(lambda: reports.heard, 'diagnostics')
    assert reports.level('flight') == topics.Level.OK
    probe.node.create_publisher(Clock, '/left/clock', 1)
    probe.spin_until(lambda: reports.level('flight') == topics.Level.ERROR, 'the error')
    assert reports.message('flight') == (
        '2 nodes publish /left/clock, one may: set publish_clock to false on all but one')
    simulator.send(signal.SIGTERM)
    assert simulator.ended() == 0


def test_parameters_act(start, probe):
    """Those that no other test needs: each changes what can be seen."""
    start('simulator', ros=[
        '-p', 'publish_clock:=false', '-p', 'real_time_factor:=0', '-p', 'dt:=0.012',
        '-p', 'max_steps_per_wake:=3', '-p', 'frames.map:=world', '-p', 'frames.base:=body',
        '-p', 'rates.strips:=0.0', '-p', 'rates.wind:=1.0', '-p', 'reset.time:=true',
        '-p', 'rates.diagnostics:=10.0', '-p', 'decambering.enabled:=false',
        '-p', 'uvlm.spanwise:=8',
        '-p', 'command.on_timeout:=neutral', '-p', 'command.timeout:=3.0'])
    poses = probe.collect(PoseStamped, 'pose')
    winds, infos = probe.collect_with_infos(Vector3Stamped, 'wind/applied', 10)
    strips = probe.collect(Float64MultiArray, 'strip_cl')
    strip_y = probe.collect(Float64MultiArray, 'strip_y', LATCHED)
    joints = probe.collect(JointState, 'joint_states')
    wrenches = probe.collect(WrenchStamped, 'wrench')
    reports = Reports(probe)
    probe.spin_until(lambda: len(winds) > 2 and len(reports.heard) > 5 and all(
        (strip_y, poses, joints, wrenches)), 'messages')
    assert poses[0].header.frame_id == 'world' and wrenches[0].header.frame_id == 'body'
    assert reports.value('pace', 'dt_s') == '0.012'
    assert reports.value('solver', 'closure').startswith('off')
    assert len(strip_y[0].data) == 3 * 8   # of wing, tail and fin
    assert not strips
    assert not probe.node.count_publishers('strip_cl')   # off is off, its rate being 0
    assert not probe.node.count_publishers('/clock')
    gaps = np.diff([nanoseconds(wind.header.stamp) for wind in winds])
    seconds = np.diff([info['publication_sequence_number'] for info in infos])
    # It comes with the first step of its second.
    assert gaps == pytest.approx(1e9 * seconds, abs=24e6)
    # Kept to wall time it would be 1, and more in a report only after the machine stood still; as
    # fast as possible it is 15 on an idle desktop, and 6 beside two others that compute.
    now = [value for _, value in reports.history(('pace', 'real_time_factor_now'))]
    assert np.median(now) > 1.5

    # After 3 s of silence the controls are neutral, the throttle closed.
    probe.spin_until(lambda: not any(joints[-1].position), 'neutral controls')
    assert any(joints[0].position) or nanoseconds(joints[0].header.stamp) > 3_000_000_000
    # Paused, so that time stays where it starts again until that has been seen.
    assert probe.call(SetBool, 'pause', data=True).success
    assert nanoseconds(poses[-1].header.stamp) > 0
    assert probe.call(Trigger, 'reset').success
    probe.spin_until(lambda: nanoseconds(poses[-1].header.stamp) == 0, 'time to start again')


def test_what_cannot_be_flown_is_one_line_and_exit_code_2(start):
    cases = [
        (['-p', 'use_sim_time:=true'], 'use_sim_time'),
        (['-p', 'aircraft:=trianer'], "found no file 'trianer'"),
        (['-p', 'real_time_factor:=-1.0'], 'real_time_factor: must be from 0 to 1000, got -1.0'),
        (['-p', 'dt:=0.5'], 'dt must be'),
        (['--params-file', '/nowhere.yaml'], '/nowhere.yaml')]
    processes = [(start('simulator', ros=arguments), text) for arguments, text in cases]
    for process, text in processes:
        assert process.ended(LIMIT) == 2
        fatal = [line for line in process.says().splitlines() if '[FATAL]' in line]
        assert len(fatal) == 1 and text in fatal[0]
        assert 'Traceback' not in process.says()


def test_a_signal_while_it_compiles_ends_it_at_once(start):
    simulator = start('simulator')
    simulator.wait_for('building the lattice')
    simulator.send(signal.SIGTERM)
    assert simulator.ended() == 0
    assert 'Traceback' not in simulator.says()


def test_ground_contact_pauses_with_its_reason_until_reset_flies_on(start, probe):
    simulator = start('simulator', ros=[
        '-p', 'initial.altitude:=2.0', '-p', 'start_paused:=true', '-p', 'step_count:=2000',
        '-p', 'rates.diagnostics:=10.0', '-p', 'command.timeout:=100.0'])
    reports = Reports(probe)
    poses = probe.collect(PoseStamped, 'pose')
    pilot = probe.publisher(JointState, 'pilot/surface_cmd')
    down = JointState(name=['elevator'], position=[0.3])
    send_until(probe, pilot, down, lambda: reports.value('commands', 'accepted') != '0',
               'the command')
    answer = probe.call(Trigger, 'step')
    assert not answer.success and 'ground contact' in answer.message
    probe.spin_until(lambda: 'ground contact' in reports.value('flight', 'paused_reason'),
                     'the reason in diagnostics')
    assert reports.level('flight') == int(topics.Level.WARN)
    assert not probe.call(SetBool, 'pause', data=False).success

    # The pause was asked for before, so it stays; and then it flies.
    assert probe.call(Trigger, 'reset').message.startswith('paused at')
    assert probe.call(SetBool, 'pause', data=False).success
    probe.spin_until(lambda: poses[-1].pose.position.z == pytest.approx(2.0, abs=0.2),
                     'the flight to begin again')

    def fly_into_the_ground():
        reports.wait_for('flight', 'paused_reason', '')
        send_until(probe, pilot, down, lambda: reports.value('flight', 'paused_reason'), 'ground')

    # What stopped by itself flies on by itself.
    fly_into_the_ground()
    assert simulator.says().count('call the reset service to fly again') == 1
    stopped = nanoseconds(poses[-1].header.stamp)
    assert probe.call(Trigger, 'reset').message.startswith('flying at')
    probe.spin_until(lambda: nanoseconds(poses[-1].header.stamp) > stopped + 300_000_000,
                     'the flight to go on')
    assert reports.value('pace', 'steps') == reports.value('solver', 'steps')

    # Unless a pause was asked for meanwhile.
    fly_into_the_ground()
    assert probe.call(SetBool, 'pause', data=True).success
    assert probe.call(Trigger, 'reset').message.startswith('paused at')


def test_pilot_and_recorder_make_a_bag_of_a_scenario(start, probe, tmp_path):
    """A paused simulator flies when the pilot is there; the recorder misses nothing of it."""
    def recorded(topic):
        return any(info.node_name == 'recorder'
                   for info in probe.node.get_subscriptions_info_by_topic(topic))

    pull = a_scenario(tmp_path / 'pull.yaml', 'elevator', '[[0.5, 0.0], [1.0, -3.0]]')
    simulator = start('simulator', ros=['-p', 'start_paused:=true'])
    recorder = start('recorder', '--output', str(tmp_path / 'bag'))
    picky = start('recorder', '--output', str(tmp_path / 'part'), '--topics', 'air_data/alpha',
                  '/markers', 'strip_cl', '--exclude-topics', 'markers',
                  ros=['-r', '__node:=picky'])
    recorder.wait_for('ready')
    picky.wait_for('ready: 3 topics')   # /clock is listened to as well, and not recorded
    # A pilot begins as soon as he knows the airspeed, and whoever has not found him by then misses
    # his first commands, of the first seconds at the worst. So he is told when he is recorded.
    pilot = start('pilot', ros=['-p', f'scenario:={pull}', '-p', 'exit_when_done:=true',
                                '-r', 'air_data/airspeed:=told/airspeed'])
    probe.spin_until(lambda: recorded('/pilot/surface_cmd'), 'the recorder to find the pilot')
    send_until(probe, probe.publisher(Float64, 'told/airspeed'), Float64(data=12.0),
               lambda: 'scenario begins' in pilot.says(), 'the scenario')
    assert pilot.ended(LIMIT) == 0
    # A signal ends it with what it has not read yet. Of each topic it reads one message for every
    # answer at the least, so this many take it past 2 s in which it may have stood still.
    asked = probe.client(GetParameters, '/recorder/get_parameters')
    for _ in range(100):
        answer = asked.call_async(GetParameters.Request())
        probe.spin_until(answer.done, 'an answer of the recorder')
    for process in (recorder, picky, simulator):
        process.send(signal.SIGINT)
    assert recorder.ended() == picky.ended() == simulator.ended() == 0
    again = start('recorder', '--output', str(tmp_path / 'bag'))

    series = recording.read(tmp_path / 'bag')
    published = {'/' + topic.name.lstrip('/') for topic in topics.PUBLISHED
                 if topic.by_default and available(topic.type)}
    assert published | {'/pilot/surface_cmd'} <= set(series)
    assert not any(found.skipped for found in series.values())
    pose, commands = series['/pose'], series['/pilot/surface_cmd']
    assert pose.time[0] == 0.0 and pose.time[-1] >= 1.9
    flown = pose.time[pose.time <= 2.0]
    # 50 Hz and reliable; a recorder that a busy machine stops for 0.2 s outruns the history.
    assert len(np.unique(flown)) == pytest.approx(100, abs=15)
    for name, rate in (('/pose', 50.0), ('/odom', 50.0), ('/joint_states', 50.0),
                       ('/wind/applied', 5.0)):
        gaps = np.diff(np.unique(series[name].time))   # by default; in whole steps of 8 ms
        assert np.median(gaps) == pytest.approx(1.0 / rate, abs=8.1e-3), name
    # At most one for each sample of /clock, of which a busy machine loses many: best effort.
    assert np.count_nonzero((commands.time > 0.0) & (commands.time < 2.0)) >= 20
    elevator = series['/joint_states'].by_name()['elevator']
    assert elevator[-1] - elevator[0] == pytest.approx(math.radians(-3.0), abs=1e-6)
    assert series['/air_data/alpha']['data'][-1] > series['/air_data/alpha']['data'][0] + 0.02

    # What it was told to, by names as ROS resolves them, on the clock that it does not record.
    part = recording.read(tmp_path / 'part')
    assert set(part) == {'/air_data/alpha', '/strip_cl'}
    assert 'messages of 2 topics' in picky.says()
    assert part['/air_data/alpha'].time[-1] == pytest.approx(pose.time[-1], abs=0.5)

    assert again.ended() == 2 and 'exists already' in again.says()   # never written over


def test_a_pilot_without_his_scenario_or_with_another_s_controls_ends_with_2(
        start, probe, tmp_path):
    """And a simulator that waits for him stays paused: nothing flies on a refused scenario."""
    flap = a_scenario(tmp_path / 'flap.yaml', 'flap', '[[0.5, 0.0]]')
    nowhere = start('pilot', ros=['-p', 'scenario:=nowhere'])
    start('simulator', ros=['-p', 'start_paused:=true', '-p', 'rates.diagnostics:=10.0'])
    reports = Reports(probe)
    stranger = start('pilot', ros=['-p', f'scenario:={flap}'])
    assert nowhere.ended(LIMIT) == 2 and 'nowhere' in nowhere.says()
    assert stranger.ended(LIMIT) == 2
    assert ('moves flap, which the aircraft does not have; it has aileron, elevator, rudder, '
            'throttle') in stranger.says()
    reports.heard.clear()
    probe.spin_until(lambda: len(reports.heard) >= 3, 'diagnostics')
    assert reports.value('flight', 'paused') == 'true'
    assert reports.value('flight', 'time_s') == '0'
