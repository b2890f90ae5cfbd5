# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""Plain fields into rclpy messages and back, commands out of messages, parameters."""

import array
import math

import numpy as np
import pytest

pytest.importorskip('rclpy', reason='rclpy is not installed')

import rclpy
from instants import a_layout, a_snapshot
from processes import free_domain
from rclpy.serialization import deserialize_message, serialize_message
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64MultiArray

from poststall_sim import topics
from poststall_sim.aircraft import ConfigError
from poststall_sim.frames import quaternion_from_enu_flu, swap_body_flu, swap_ned_enu
from poststall_sim.ros import declaration, parameters
from poststall_sim.ros.air_settings import AirSettings
from poststall_sim.ros.messages import (
    Refusal,
    RefusedCommand,
    RefusedState,
    available,
    body_from_odometry,
    commands_from_array,
    commands_from_joint_state,
    fill,
    message,
    message_class,
    wind_from_vector,
)
from poststall_sim.ros.sensor_settings import SensorSettings

PUBLISHED = [topic for topic in topics.PUBLISHED if topic.fields and available(topic.type)]


def _assert_holds(found, fields):
    """Assert that a message says what the fields say, whoever decoded it."""
    for key, value in fields.items():
        part = getattr(found, key)
        if isinstance(value, dict):
            _assert_holds(part, value)
        elif isinstance(value, list) and value and isinstance(value[0], dict):
            assert len(part) == len(value)
            for item, expected in zip(part, value):
                _assert_holds(item, expected)
        elif isinstance(value, np.ndarray):
            assert np.array_equal(np.array(part), value)
        elif isinstance(part, bytes):
            assert part == bytes([value])
        else:
            assert part == value


@pytest.mark.parametrize('topic', PUBLISHED, ids=lambda t: t.name)
def test_what_goes_over_the_wire_is_what_the_fields_say(topic):
    """Decoded by rclpy, and by rosbags, which shares no code with it."""
    rosbags = pytest.importorskip('rosbags.typesys')
    fields = topic.fields(a_snapshot(euler_deg=(10, 20, 30)), a_layout())
    data = serialize_message(message(topic.type, fields))
    _assert_holds(deserialize_message(data, message_class(topic.type)), fields)
    store = rosbags.get_typestore(rosbags.Stores.ROS2_JAZZY)
    _assert_holds(store.deserialize_cdr(data, topic.type), fields)


@pytest.mark.parametrize('topic', PUBLISHED, ids=lambda t: t.name)
def test_a_kept_message_refilled_is_as_good_as_a_new_one(topic):
    kept = message(topic.type, topic.fields(a_snapshot(), a_layout()))
    later = a_snapshot(euler_deg=(-40, 70, 200), time_ns=7_000_000_123, alpha=-0.3,
                       strips=4, force_B=np.array([1.0, 2.0, 3.0]))
    fields = topic.fields(later, a_layout(strip_place=np.arange(12.0).reshape(4, 3)))
    assert fill(kept, fields) == message(topic.type, fields)


def test_an_array_may_change_its_length():
    kept = message('std_msgs/msg/Float64MultiArray', {'data': np.arange(3.0)})
    assert fill(kept, {'data': np.arange(5.0)}).data.tolist() == [0.0, 1.0, 2.0, 3.0, 4.0]


def test_an_array_is_refilled_in_place():
    """A list is checked element by element, some microseconds each: there is none here."""
    kept = message('std_msgs/msg/Float64MultiArray', {'data': np.zeros(60)})
    buffer = kept.data
    fill(kept, {'data': np.arange(60.0)})
    assert kept.data is buffer and type(buffer) is array.array
    assert np.array_equal(np.frombuffer(buffer), np.arange(60.0))


def test_diagnostics_keep_level_and_values():
    found = message('diagnostic_msgs/msg/DiagnosticArray', topics.diagnostics_fields(
        5, 'x', [topics.Condition(topics.Level.ERROR, 'n', 'm', {'k': 1.5})]))
    assert found.status[0].level == b'\x02'
    assert found.status[0].values[0].key == 'k' and found.status[0].values[0].value == '1.5'


def an_odom(snapshot):
    return message('nav_msgs/msg/Odometry', next(
        t for t in PUBLISHED if t.name == 'odom').fields(snapshot, a_layout()))


def test_a_body_read_from_its_odom_is_the_body():
    for euler_deg in ((0, 0, 0), (170, -80, 300), (5, 89.9, 10), (-90, 45, -120)):
        body = a_snapshot(euler_deg=euler_deg).body
        found = body_from_odometry(an_odom(a_snapshot(euler_deg=euler_deg)), map_frame='map',
                                   base_frame='base_link')
        for key in ('position_N', 'velocity_B', 'rates_B'):
            assert getattr(found, key) == pytest.approx(getattr(body, key), abs=1e-12)
        assert abs(found.q_NB @ body.q_NB) == pytest.approx(1.0, abs=1e-12)


@pytest.mark.parametrize(('path', 'value', 'text'), [
    ('pose.pose.position.x', math.nan, 'not finite'),
    ('pose.pose.position.y', -2e6, r'beyond 1e\+06'),
    ('pose.pose.position.z', -0.001, 'altitude -0.001 m'),
    ('pose.pose.position.z', 20001.0, 'altitude 20001 m'),
    ('pose.pose.orientation.w', 2.0, 'it must be 1'),
    ('pose.pose.orientation.x', math.nan, 'it must be 1'),
    ('twist.twist.linear.z', math.inf, 'velocity .* not finite'),
    ('twist.twist.linear.x', 401.0, 'velocity .* beyond 400'),
    ('twist.twist.angular.x', 101.0, 'angular velocity .* beyond 100'),
    ('header.frame_id', 'odom', "frame_id is 'odom', it must be 'map' or empty"),
    ('child_frame_id', 'map', "child_frame_id is 'map', it must be 'base_link' or empty"),
])
def test_a_state_that_cannot_be_is_refused_with_its_reason(path, value, text):
    odom = an_odom(a_snapshot())
    *parts, last = path.split('.')
    owner = odom
    for part in parts:
        owner = getattr(owner, part)
    setattr(owner, last, value)
    with pytest.raises(RefusedState, match=text):
        body_from_odometry(odom, map_frame='map', base_frame='base_link')


def test_a_wind_is_where_it_blows_to_in_map_or_no_frame():
    for frame in ('', 'world'):
        found = message('geometry_msgs/msg/Vector3Stamped', {
            'header': {'frame_id': frame}, 'vector': {'x': 1.0, 'y': 2.0, 'z': 3.0}})
        assert wind_from_vector(found, map_frame='world').tolist() == [2.0, 1.0, -3.0]
    with pytest.raises(RefusedState, match='frame_id'):
        wind_from_vector(found, map_frame='map')


def test_a_state_survives_the_way_to_ros_and_back():
    for euler_deg in ((0, 0, 0), (170, -80, 300), (5, 89.9, 10), (-90, 45, -120)):
        snapshot = a_snapshot(euler_deg=euler_deg)
        odom = an_odom(snapshot)
        p, q = odom.pose.pose.position, odom.pose.pose.orientation
        v = odom.twist.twist.linear
        assert swap_ned_enu(np.array([p.x, p.y, p.z])) == pytest.approx(snapshot.body.position_N)
        assert swap_body_flu(np.array([v.x, v.y, v.z])) == pytest.approx(snapshot.body.velocity_B)
        back = quaternion_from_enu_flu(np.array([q.x, q.y, q.z, q.w]))
        assert abs(back @ snapshot.body.q_NB) == pytest.approx(1.0, abs=1e-12)


NAMES = ('aileron', 'elevator', 'throttle')


def joints(names, positions):
    return JointState(name=names, position=positions)


def test_a_joint_state_commands_by_name():
    found = commands_from_joint_state(joints(['elevator', 'flap'], [-0.1, 0.2]), NAMES)
    assert found.values == {'elevator': -0.1}
    assert found.unknown == ('flap',)


@pytest.mark.parametrize(('names', 'positions', 'refusal', 'text'), [
    (['elevator'], [math.nan], Refusal.NOT_FINITE, 'elevator is nan'),
    (['aileron', 'elevator'], [0.0, math.inf], Refusal.NOT_FINITE, 'elevator is inf'),
    (['flap'], [-math.inf], Refusal.NOT_FINITE, 'flap is -inf'),
    (['elevator'], [], Refusal.LENGTH, 'name has 1 entries and position 0'),
    (['elevator'], [0.1, 0.2], Refusal.LENGTH, 'name has 1 entries and position 2'),
    ([], [], Refusal.LENGTH, 'empty'),
    (['elevator', 'elevator'], [0.1, 0.2], Refusal.DUPLICATE, 'elevator named more than once'),
])
def test_a_bad_joint_state_is_refused_whole(names, positions, refusal, text):
    with pytest.raises(RefusedCommand, match=text) as caught:
        commands_from_joint_state(joints(names, positions), NAMES)
    assert caught.value.refusal is refusal
    assert isinstance(caught.value, ValueError)


def test_an_array_commands_in_order():
    found = commands_from_array(Float64MultiArray(data=[0.1, -0.2, 0.5]), NAMES)
    assert found.values == {'aileron': 0.1, 'elevator': -0.2, 'throttle': 0.5}


@pytest.mark.parametrize(('data', 'refusal', 'text'), [
    ([], Refusal.LENGTH, 'got 0 values, expected 3'),
    ([0.0] * 4, Refusal.LENGTH, 'got 4 values, expected 3 .* aileron, elevator, throttle'),
    ([0.0, math.nan, 0.0], Refusal.NOT_FINITE, 'elevator is nan'),
])
def test_a_bad_array_is_refused_whole(data, refusal, text):
    with pytest.raises(RefusedCommand, match=text) as caught:
        commands_from_array(Float64MultiArray(data=data), NAMES)
    assert caught.value.refusal is refusal


@pytest.fixture
def declared(monkeypatch):
    """Declare the simulator's parameters with given ones; return them, the node, the warnings."""
    context, nodes = rclpy.Context(), []
    context.init(args=[], domain_id=free_domain())

    def declare(*given):
        nodes.append(rclpy.create_node('simulator', context=context, cli_args=[
            '--ros-args', *(part for item in given for part in ('-p', item))]))
        heard = []
        monkeypatch.setattr(nodes[-1].get_logger().__class__, 'warning',
                            lambda self, text, **_: heard.append(text))
        settings, _ = declaration.declare_all(
            nodes[-1], parameters.SimulatorSettings, AirSettings)
        return settings, nodes[-1], heard

    yield declare
    for node in nodes:
        node.destroy_node()
    context.try_shutdown()


@pytest.mark.ros
@pytest.mark.parametrize(('given', 'text'), [
    ('real_time_factor:=true', 'real_time_factor: must be a number, got True'),
    ('real_time_factor:=fast', "real_time_factor: must be a number, got 'fast'"),
    ('real_time_factor:=.nan', 'real_time_factor: must be from 0 to 1000, got nan'),
    ('wind.velocity:=[true, true, true]', 'wind.velocity: must be a list of numbers'),
    ('wind.velocity:=[1, 2]', 'wind.velocity: must be 3 numbers'),
    ('step_count:=2.0', 'step_count: must be a whole number, got 2.0'),
    ('aircraft:=747', 'aircraft: must be text, got 747'),
    ("frames.base:=''", 'frames.base: must not be empty'),
    ("frames.map:=' '", 'frames.map: must not be empty'),
    ('initial.altitude:=0', 'initial.altitude: must be from 0.1 to 20000, got 0'),
    ('initial.altitude:=-1.0', 'initial.altitude: must be from 0.1 to 20000, got -1'),
])
def test_a_parameter_that_is_not_right_is_refused_by_name(declared, given, text):
    with pytest.raises(ConfigError) as caught:
        declared(given)
    assert text in str(caught.value) and '\n' not in str(caught.value)


@pytest.mark.ros
def test_whole_numbers_are_real_ones_where_those_are_wanted(declared):
    settings, node, warnings = declared('real_time_factor:=2', 'wind.velocity:=[0, 3, -1]',
                                        'use_sim_time:=false')
    assert settings.real_time_factor == node.get_parameter('real_time_factor').value == 2.0
    assert type(node.get_parameter('real_time_factor').value) is float
    assert list(node.get_parameter('wind.velocity').value) == [0.0, 3.0, -1.0]
    assert not warnings


@pytest.mark.ros
def test_defaults_of_rates_are_those_of_the_table(declared):
    _, node, _ = declared()
    declaration.declare(node, SensorSettings)
    for rate in topics.Rate:
        if rate.parameter:
            assert node.get_parameter(rate.parameter).value == rate.default
            assert rate.counts in node.describe_parameter(rate.parameter).description


@pytest.mark.ros
@pytest.mark.parametrize(('given', 'meant'), [
    ('airspeed', 'initial.airspeed'), ('initial.airpseed', 'initial.airspeed'),
    ('altitute', 'initial.altitude'), ('state', 'rates.state'), ('zzz', None)])
def test_a_parameter_that_nobody_reads_is_warned_of(declared, given, meant):
    _, _, warnings = declared(f'{given}:=15.0')
    assert warnings == [f'there is no parameter {given}, its value is not used'
                        + (f'; did you mean {meant}?' if meant else '')]


def test_errors_show_strange_names_shortened_and_without_control_characters():
    """What a stranger names ends in the log; counting 100 000 names takes no minute."""
    strange = '\x1b[2J\n[FATAL] ' + 'x' * 100_000
    names = [f'n{i // 2}' for i in range(100_000)]
    for message_, refusal in (
            (JointState(name=[strange], position=[math.nan]), Refusal.NOT_FINITE),
            (JointState(name=[strange] * 2, position=[0.0] * 2), Refusal.DUPLICATE),
            (JointState(name=names, position=[0.0] * len(names)), Refusal.DUPLICATE)):
        with pytest.raises(RefusedCommand) as caught:
            commands_from_joint_state(message_, ('elevator',))
        assert caught.value.refusal is refusal
        assert len(str(caught.value)) < 300 and str(caught.value).isprintable()
    wind = message('geometry_msgs/msg/Vector3Stamped', {'header': {'frame_id': strange}})
    with pytest.raises(RefusedState) as state:
        wind_from_vector(wind, map_frame='map')
    assert len(str(state.value)) < 300 and str(state.value).isprintable()
