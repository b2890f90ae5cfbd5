# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""Bags: ours read by the library they are written for, others' read by us."""

import numpy as np
import pytest

pytest.importorskip('rosbags', reason='rosbags is not installed')

from instants import a_layout, a_snapshot
from rosbags.highlevel import AnyReader
from rosbags.rosbag2 import StoragePlugin, Writer
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from poststall_sim import definition, inlets, jobs, recording, simulation, topics
from poststall_sim.aero.model import Settings
from poststall_sim.recording import BagError, Recorder
from poststall_sim.scenario import Channel, Scenario

STORE = get_typestore(Stores.ROS2_JAZZY)
STATED = [topic for topic in topics.PUBLISHED if topic.fields]


def test_what_was_written_is_what_a_foreign_reader_reads(tmp_path):
    """Every topic of the table, decoded with nothing but the definitions in the file."""
    with Recorder(tmp_path / 'bag') as recorder:
        for k in range(3):
            snapshot = a_snapshot(time_ns=k * 20_000_000, euler_deg=(5 * k, 10, 20))
            for topic in STATED:
                recorder.write(topic, topic.fields(snapshot, a_layout()), snapshot.time_ns)
    assert (tmp_path / 'bag' / 'metadata.yaml').exists()
    found = {}
    with AnyReader([tmp_path / 'bag']) as reader:
        for connection, logged_ns, data in reader.messages():
            found.setdefault(connection.topic, []).append(
                (logged_ns, reader.deserialize(data, connection.msgtype)))
    assert len(found) == len(STATED)
    assert [logged for logged, _ in found['/pose']] == [0, 20_000_000, 40_000_000]
    last = found['/pose'][-1][1]
    assert last.header.frame_id == 'map' and last.header.stamp.nanosec == 40_000_000
    assert [last.pose.position.x, last.pose.position.y, last.pose.position.z] == [20, 10, 30]
    joints = found['/joint_states'][0][1]
    assert joints.name == ['aileron', 'elevator', 'rudder', 'throttle']
    assert joints.position.tolist() == [0.01, -0.05, 0.02, 0.4]
    assert found['/strip_cl'][0][1].data.tolist() == [0.5, 1.0, 1.5, 2.0]
    assert found['/strip_cl'][0][1].layout.dim[0].label == 'strip'
    assert found['/odom'][0][1].pose.covariance.tolist() == [0.0] * 36


def test_a_namespace_stands_before_relative_names_only(tmp_path):
    with Recorder(tmp_path / 'bag') as recorder:
        for topic in STATED[:2]:
            recorder.write(topic, topic.fields(a_snapshot(), a_layout()), 0, namespace='/a/')
    assert set(recording.read(tmp_path / 'bag')) == {'/clock', '/a/pose'}


def test_reading_gives_arrays_over_simulated_time(tmp_path):
    with Recorder(tmp_path / 'bag') as recorder:
        for k in range(4):
            snapshot = a_snapshot(time_ns=k * 500_000_000, alpha=0.1 * k)
            for topic in STATED:
                recorder.write(topic, topic.fields(snapshot, a_layout()), snapshot.time_ns)
    series = recording.read(tmp_path / 'bag')
    assert series['/air_data/alpha'].time == pytest.approx([0.0, 0.5, 1.0, 1.5])
    assert series['/air_data/alpha']['data'] == pytest.approx([0.0, 0.1, 0.2, 0.3])
    assert series['/strip_cl']['data'].shape == (4, 4)
    assert series['/pose']['pose.position.z'] == pytest.approx([30.0] * 4)
    assert series['/joint_states'].by_name()['elevator'] == pytest.approx([-0.05] * 4)


def test_bytes_from_dds_are_written_as_they_came(tmp_path):
    """Rclpy's serialisation in, the same numbers out."""
    pytest.importorskip('rclpy', reason='rclpy is not installed')
    from rclpy.serialization import serialize_message

    from poststall_sim.ros.messages import available, message
    stated = [topic for topic in STATED if available(topic.type)]
    with Recorder(tmp_path / 'bag') as recorder:
        for topic in stated:
            data = serialize_message(message(topic.type, topic.fields(a_snapshot(), a_layout())))
            recorder.add_topic('/' + topic.name.lstrip('/'), topic.type, topic.qos)
            recorder.write_raw('/' + topic.name.lstrip('/'), data, 1_500_000_000)
    series = recording.read(tmp_path / 'bag')
    assert len(series) == len(stated)
    assert all(len(found) == 1 and found.skipped == 0 for found in series.values())
    assert series['/wrench']['wrench.force.z'] == [90.0]
    assert series['/strip_alpha']['data'].tolist() == [pytest.approx([0.1, 0.2, 0.3, 0.4])]


def _foreign_bag(path, *, clock=True):
    """Write a bag as another recorder would: wall time, SQLite, a type of its own, late start."""
    store = get_typestore(Stores.ROS2_JAZZY)
    store.register(get_types_from_msg('float64 gust\nstring why', 'other_msgs/msg/Gust'))
    wall = 1_700_000_000_000_000_000
    with Writer(path, version=8, storage_plugin=StoragePlugin.SQLITE3) as writer:
        def connect(name, kind):
            return writer.add_connection(name, kind, typestore=store)

        def put(connection, after_s, **values):
            kind = store.types[connection.msgtype]
            writer.write(connection, wall + round(after_s * 1e9), bytes(
                store.serialize_cdr(kind(**values), connection.msgtype)))

        time = store.types['builtin_interfaces/msg/Time']
        if clock:
            clocks = connect('/clock', 'rosgraph_msgs/msg/Clock')
        alphas = connect('/air_data/alpha', 'std_msgs/msg/Float64')
        gusts = connect('/gust', 'other_msgs/msg/Gust')
        for k in range(100):   # flown at twice the speed of time
            if clock:
                put(clocks, 0.05 * k, clock=time(k // 10, k % 10 * 100_000_000))
            put(alphas, 0.05 * k + 0.01, data=0.01 * k)
        put(gusts, 2.0, gust=3.0, why='because')


def test_a_bag_by_another_recorder_is_put_on_simulated_time(tmp_path):
    _foreign_bag(tmp_path / 'bag')
    series = recording.read(tmp_path / 'bag')
    alpha = series['/air_data/alpha']
    assert alpha['data'][50] == 0.5
    assert alpha.time[:-1] == pytest.approx(0.1 * np.arange(99) + 0.02, abs=1e-6)
    assert series['/gust'].time == pytest.approx([4.0], abs=1e-6)
    assert series['/gust']['gust'] == [3.0] and series['/gust']['why'] == ['because']


def test_without_a_clock_time_counts_from_the_first_message(tmp_path):
    _foreign_bag(tmp_path / 'bag', clock=False)
    alpha = recording.read(tmp_path / 'bag')['/air_data/alpha']
    assert alpha.time == pytest.approx(0.05 * np.arange(100), abs=1e-6)


def test_commands_of_someone_who_does_not_stamp_are_placed_by_the_clock(tmp_path):
    """Header stamps that are all zero are no times."""
    with Recorder(tmp_path / 'bag') as recorder:
        for k in range(10):
            snapshot = a_snapshot(time_ns=k * 100_000_000)
            recorder.write(STATED[0], STATED[0].fields(snapshot, a_layout()), snapshot.time_ns)
            recorder.write(inlets.PILOT, topics.joint_fields(0, {'elevator': 0.1}),
                           snapshot.time_ns)
    series = recording.read(tmp_path / 'bag')
    assert series['/pilot/surface_cmd'].time == pytest.approx(0.1 * np.arange(10))


def test_a_message_that_cannot_be_decoded_is_counted_and_the_rest_is_read(tmp_path):
    """Fast-CDR pads after an empty float64 array at the end: 4 bytes too many for rosbags."""
    joint = STORE.types['sensor_msgs/msg/JointState']
    header = STORE.types['std_msgs/msg/Header'](
        STORE.types['builtin_interfaces/msg/Time'](1, 0), '')
    good = bytes(STORE.serialize_cdr(
        joint(header, ['a'], np.ones(1), np.zeros(1), np.zeros(1)), 'sensor_msgs/msg/JointState'))
    with Recorder(tmp_path / 'bag') as recorder:
        recorder.add_topic('/cmd', 'sensor_msgs/msg/JointState', topics.Qos())
        recorder.write_raw('/cmd', good, 0)
        recorder.write_raw('/cmd', good + bytes(4), 1)
    found = recording.read(tmp_path / 'bag')['/cmd']
    assert (len(found), found.skipped) == (1, 1)


def test_a_bag_is_never_written_over(tmp_path):
    Recorder(tmp_path / 'bag').close()
    with pytest.raises(BagError, match='exists already'):
        Recorder(tmp_path / 'bag')
    assert recording.free_path(tmp_path / 'bag') == tmp_path / 'bag_2'
    (tmp_path / 'bag_2').mkdir()
    assert recording.free_path(tmp_path / 'bag') == tmp_path / 'bag_3'
    assert recording.free_path(tmp_path / 'other') == tmp_path / 'other'


def test_no_bag_or_half_a_bag_is_one_clear_error(tmp_path):
    with pytest.raises(BagError, match='nowhere'):
        recording.read(tmp_path / 'nowhere')
    Recorder(tmp_path / 'open')   # never closed: no metadata
    with pytest.raises(BagError, match='open'):
        recording.read(tmp_path / 'open')


@pytest.fixture(scope='module')
def flight():
    aircraft = definition.aircraft(definition.find('aircraft', 'trainer'))
    return simulation.start(aircraft, Settings(chordwise=2), airspeed=15.0, altitude=100.0)


def test_a_flight_without_ros_gives_the_bag_that_the_node_would(tmp_path, flight):
    """All topics of the table at their rates, the elevator moved, the report at the end."""
    scenario = Scenario('pull', 1.0, 15.0, 100.0, (
        Channel('elevator', ((0.0, 0.0), (0.2, -0.1))),))
    with recording.FlightRecorder(tmp_path / 'bag', flight) as recorder:
        for _ in jobs.fly(flight, scenario, 1.0, recorder):
            pass
    series = recording.read(tmp_path / 'bag')
    expected = {'/' + topic.name.lstrip('/') for topic in topics.PUBLISHED if topic.by_default}
    assert set(series) == expected | {'/pilot/surface_cmd'}
    # Compressed: markers, most of a bag, hold the same numbers over and over.
    with AnyReader([tmp_path / 'bag']) as reader:
        size = sum(len(data) for _, _, data in reader.messages())
    assert (tmp_path / 'bag' / 'bag.mcap').stat().st_size < 0.5 * size
    # Rates are met on average, so that the ends may add or lack one.
    assert len(series['/pose']) == pytest.approx(50, abs=1)
    assert len(series['/strip_cl']) == pytest.approx(20, abs=1)
    assert len(series['/strip_y']) == len(series['/strip_chord']) == 1
    assert series['/pose'].time[-1] == pytest.approx(flight.snapshot.time, abs=0.02)
    # Views: every marker in every message, the path ever longer, the transform as the pose.
    assert len(series['/markers']) == len(series['/strips']) == pytest.approx(5, abs=1)
    for message in series['/markers']['markers']:
        assert {marker.ns for marker in message} == {'body', 'strips', 'lift', 'wake', 'controls'}
    lengths = [len(poses) for poses in series['/path']['poses']]
    assert lengths[0] == 2 and lengths[-1] >= 10
    assert len(series['/tf']) == pytest.approx(50, abs=1) and len(series['/tf_static']) == 1
    assert series['/tf']['transforms'][-1][0].transform.translation.z == (
        series['/pose']['pose.position.z'][-1])
    assert series['/imu']['linear_acceleration.z'][0] == pytest.approx(9.8, abs=0.1)
    trim = flight.trim.deflections[flight.model.aircraft.control_names.index('elevator')]
    elevator = series['/joint_states'].by_name()['elevator']
    assert elevator[0] == pytest.approx(trim) and elevator[-1] == pytest.approx(trim - 0.1)
    alpha = series['/air_data/alpha']['data']
    assert alpha[-1] > alpha[0] + 0.02
    solver = series['/diagnostics'].diagnostics()['simulator: solver']
    assert int(solver['steps']) == round(flight.snapshot.time_ns / flight.dt_ns)

