# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""The table of topics: axes against attitudes made by hand, and what no field may be."""

import math
from types import SimpleNamespace

import numpy as np
import pytest
from instants import a_layout, a_snapshot

from poststall_sim import definition, inlets, topics
from poststall_sim.aero import lattice as lattices
from poststall_sim.state import Status
from poststall_sim.topics import PUBLISHED, Rate, Schedule


def fields(name, snapshot=None, layout=None):
    topic = next(topic for topic in PUBLISHED if topic.name == name)
    return topic.fields(snapshot or a_snapshot(), layout or a_layout())


def test_position_is_east_north_up():
    position = fields('pose')['pose']['position']
    assert position == pytest.approx({'x': 20.0, 'y': 10.0, 'z': 30.0})


# An attitude by hand: half the angle about the axis that FLU and ENU give it.
@pytest.mark.parametrize(('euler_deg', 'xyzw'), [
    ((0, 0, 90), (0, 0, 0, 1)),                                          # level, to the east
    ((0, 0, 0), (0, 0, math.sin(math.pi / 4), math.cos(math.pi / 4))),   # north: left by 90 deg
    ((0, 0, 180), (0, 0, -math.sin(math.pi / 4), math.cos(math.pi / 4))),
    ((0, 30, 90), (0, -math.sin(math.radians(15)), 0, math.cos(math.radians(15)))),   # nose up
    ((30, 0, 90), (math.sin(math.radians(15)), 0, 0, math.cos(math.radians(15)))),    # right down
    ((0, 90, 90), (0, -math.sin(math.pi / 4), 0, math.cos(math.pi / 4))),             # vertical
])
def test_attitude_is_that_of_flu_in_enu(euler_deg, xyzw):
    q = fields('pose', a_snapshot(euler_deg=euler_deg))['pose']['orientation']
    found = np.array([q[axis] for axis in 'xyzw'])
    assert found * np.sign(found[3]) == pytest.approx(np.array(xyzw), abs=1e-12)


def test_body_vectors_are_forward_left_up():
    twist = fields('twist')['twist']
    assert twist['linear'] == pytest.approx({'x': 15.0, 'y': -1.0, 'z': -2.0})
    assert twist['angular'] == pytest.approx({'x': 0.1, 'y': -0.2, 'z': -0.3})
    air = fields('twist/air')['twist']
    assert air['linear'] == pytest.approx({'x': 14.0, 'y': -0.5, 'z': -1.5})
    assert fields('odom')['twist']['twist'] == twist
    assert fields('odom')['pose']['pose'] == fields('pose')['pose']


def test_lift_points_up_and_a_nose_up_moment_is_negative_about_left():
    wrench = fields('wrench')['wrench']
    assert wrench['force'] == pytest.approx({'x': -5.0, 'y': -0.25, 'z': 90.0})
    assert wrench['torque'] == pytest.approx({'x': 1.0, 'y': -2.0, 'z': -3.0})
    assert fields('wrench/propulsion')['wrench']['force']['x'] == 8.0
    accel = fields('accel')['accel']
    assert accel['linear'] == pytest.approx({'x': 0.4, 'y': -0.5, 'z': -0.6})


def test_at_rest_on_its_back_an_accelerometer_feels_gravity_downwards():
    """Specific force is acceleration less gravity: +g along body z-up when level, -g inverted."""
    for roll, up in ((0.0, 1.0), (180.0, -1.0)):
        still = a_snapshot(euler_deg=(roll, 0, 30), acceleration_B=np.zeros(3))
        felt = fields('imu', still)
        assert felt['linear_acceleration'] == pytest.approx(
            {'x': 0.0, 'y': 0.0, 'z': up * 9.80665}, abs=1e-12)
        assert felt['orientation'] == fields('pose', still)['pose']['orientation']
        assert felt['angular_velocity'] == fields('twist', still)['twist']['angular']
    nose_up = a_snapshot(euler_deg=(0, 90, 0), acceleration_B=np.array([1.0, 0.0, 0.0]))
    assert fields('imu', nose_up)['linear_acceleration']['x'] == pytest.approx(10.80665)


def test_the_cloud_holds_each_strip_at_its_place():
    cloud = fields('strips')
    names = [field['name'] for field in cloud['fields']]
    assert [field['offset'] for field in cloud['fields']] == [4 * i for i in range(len(names))]
    assert cloud['row_step'] == cloud['width'] * cloud['point_step'] == len(cloud['data'])
    rows = cloud['data'].view('<f4').reshape(cloud['width'], -1)
    found = dict(zip(names, rows.T))
    layout, strips = a_layout(), a_snapshot().strips
    assert np.column_stack([found['x'], found['y'], found['z']]) == pytest.approx(
        layout.strip_place, rel=1e-6)
    for name, values in (('cl', strips.cl), ('cd', strips.cd), ('cm', strips.cm),
                         ('alpha', strips.alpha), ('decambering', strips.delta),
                         ('stalled', strips.stalled)):
        assert found[name] == pytest.approx(values.astype(float), rel=1e-6), name


def _turned(transform, vector):
    """Return a vector of the child frame in the parent frame, by Rodrigues' formula."""
    q = transform['rotation']
    axis, w = np.array([q[key] for key in 'xyz']), q['w']
    return vector + 2.0 * np.cross(axis, np.cross(axis, vector) + w * vector)


def test_transforms_turn_aviation_into_ros():
    """The pose is that of base_link; north-east-down and forward-right-down by their axes."""
    snapshot = a_snapshot(euler_deg=(10, 20, 30))
    moving = fields('/tf', snapshot)['transforms'][0]
    assert (moving['header']['frame_id'], moving['child_frame_id']) == ('map', 'base_link')
    pose = fields('pose', snapshot)['pose']
    assert moving['transform'] == {'translation': pose['position'],
                                   'rotation': pose['orientation']}
    ned, frd = (each for each in fields('/tf_static')['transforms'])
    assert (ned['header']['frame_id'], ned['child_frame_id']) == ('map', 'map_ned')
    assert (frd['header']['frame_id'], frd['child_frame_id']) == ('base_link', 'base_link_frd')
    north_east_down = np.eye(3)
    assert np.array([_turned(ned['transform'], v) for v in north_east_down]) == pytest.approx(
        np.array([[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, -1.0]]), abs=1e-12)
    assert np.array([_turned(frd['transform'], v) for v in np.eye(3)]) == pytest.approx(
        np.diag([1.0, -1.0, -1.0]), abs=1e-12)


def test_the_axes_of_aviation_say_the_same_through_the_static_transforms():
    snapshot = a_snapshot(euler_deg=(10, 20, 30))
    ned, frd = (each['transform'] for each in fields('/tf_static')['transforms'])
    odom, plain = fields('odom_ned', snapshot), fields('odom', snapshot)
    assert (odom['header']['frame_id'], odom['child_frame_id']) == ('map_ned', 'base_link_frd')

    def xyz(value):
        return np.array([value[key] for key in 'xyz'])

    assert _turned(ned, xyz(odom['pose']['pose']['position'])) == pytest.approx(
        xyz(plain['pose']['pose']['position']))
    for part in ('linear', 'angular'):
        assert _turned(frd, xyz(odom['twist']['twist'][part])) == pytest.approx(
            xyz(plain['twist']['twist'][part]))
    # A body vector reaches map by both ways.
    forward = _turned(frd, np.array([1.0, 2.0, 3.0]))
    by_ros = _turned({'rotation': plain['pose']['pose']['orientation']}, forward)
    by_ned = _turned(ned, _turned({'rotation': odom['pose']['pose']['orientation']},
                                  np.array([1.0, 2.0, 3.0])))
    assert by_ros == pytest.approx(by_ned)
    force = fields('wrench_frd')['wrench']['force']
    assert force == pytest.approx({'x': -5.0, 'y': 0.25, 'z': -90.0})


def test_wind_is_where_it_blows_to():
    """A wind_N towards north is +y in ENU."""
    assert fields('wind/applied')['vector'] == pytest.approx({'x': 0.0, 'y': 5.0, 'z': 0.0})


def test_frames_and_stamps_of_one_step_are_one():
    layout = a_layout(map_frame='world', base_frame='a/base_link')
    headers = {topic.name: topic.fields(a_snapshot(), layout)['header'] for topic in PUBLISHED
               if topic.fields and 'header' in topic.fields(a_snapshot(), layout)}
    assert {header['stamp']['sec'] for header in headers.values()} == {1}
    assert {header['stamp']['nanosec'] for header in headers.values()} == {500_000_000}
    assert fields('/clock')['clock'] == {'sec': 1, 'nanosec': 500_000_000}
    assert headers['pose']['frame_id'] == headers['odom']['frame_id'] == 'world'
    assert headers['wind/applied']['frame_id'] == 'world'
    assert headers['wrench']['frame_id'] == headers['twist/air']['frame_id'] == 'a/base_link'
    assert fields('odom', layout=layout)['child_frame_id'] == 'a/base_link'


def test_joint_states_hold_every_control_and_the_throttle_in_arrays_of_one_length():
    joints = fields('joint_states')
    assert joints['name'] == ['aileron', 'elevator', 'rudder', 'throttle']
    assert joints['position'] == pytest.approx([0.01, -0.05, 0.02, 0.4])
    assert joints['velocity'] == pytest.approx([0.1, 0.2, -0.3, 0.5])
    assert joints['effort'].tolist() == [0.0] * 4
    glider = fields('joint_states', layout=a_layout(engines=False))
    assert glider['name'] == ['aileron', 'elevator', 'rudder']


def _leaves(value):
    if isinstance(value, dict):
        for item in value.values():
            yield from _leaves(item)
    elif isinstance(value, list) and value and isinstance(value[0], dict):
        for item in value:
            yield from _leaves(item)
    else:
        yield value


@pytest.mark.parametrize('topic', [t for t in PUBLISHED if t.fields], ids=lambda t: t.name)
def test_no_field_is_empty_and_every_number_is_builtin_and_finite(topic):
    for leaf in _leaves(topic.fields(a_snapshot(), a_layout())):
        if isinstance(leaf, np.ndarray):
            assert leaf.dtype in (np.float64, np.uint8) and leaf.size and np.isfinite(leaf).all()
        elif isinstance(leaf, list):
            assert leaf and all(type(item) is str for item in leaf)
        else:
            assert type(leaf) in (float, int, bool, str)
            assert type(leaf) is str or math.isfinite(leaf)


def test_strips_run_from_the_left_tip_to_the_right():
    """In FLU y is positive to the left; the surfaces come in the order of the file."""
    aircraft = definition.aircraft(definition.find('aircraft', 'trainer'))
    flight = SimpleNamespace(
        model=SimpleNamespace(aircraft=aircraft, lattice=lattices.build(aircraft, 1)))
    layout = topics.layout(flight)
    wing = aircraft.surfaces[0]
    y = layout.strip_y[:wing.strips]
    half_span = wing.sections[-1].leading_edge_G[1]
    assert (np.diff(y) < 0.0).all()
    assert y == pytest.approx(-y[::-1])
    assert y[0] == pytest.approx(half_span * (1.0 - 1.0 / wing.strips), rel=1e-6)
    assert layout.strip_names[0].startswith(wing.name)
    assert len(layout.strip_names) == len(layout.strip_y) == len(layout.strip_chord)


def test_a_rate_that_does_not_divide_the_steps_is_met_on_average():
    """With steps of 6 ms, 50 Hz and 20 Hz cannot be even, but 3 s hold 150 and 60."""
    schedule = Schedule({Rate.CLOCK: 100.0, Rate.STATE: 50.0, Rate.STRIPS: 20.0, Rate.WIND: 0.0})
    due = [topic.name for k in range(500) for topic in schedule.due(k * 6_000_000)]
    assert due.count('pose') == 150
    assert due.count('strip_cl') == 60
    assert due.count('/clock') == 300
    assert due.count('wind/applied') == 0
    assert 'strip_y' not in due and '/diagnostics' not in due


def test_a_rate_above_the_steps_means_every_step_once():
    schedule = Schedule({Rate.CLOCK: 10_000.0})
    due = [topic.name for k in range(100) for topic in schedule.due(k * 6_000_000)]
    assert due.count('/clock') == 100


def test_names_are_unique_and_the_clock_is_what_time_sources_subscribe_to():
    names = [topic.name for topic in PUBLISHED + inlets.SUBSCRIBED]
    assert len(set(names)) == len(names)
    assert topics.CLOCK in PUBLISHED and topics.DIAGNOSTICS in PUBLISHED
    assert topics.CLOCK.name == '/clock' and not topics.CLOCK.qos.reliable
    assert topics.DIAGNOSTICS.name == '/diagnostics'
    assert {topic for topic in PUBLISHED if topic.qos.latched} == {
        topics.PATH, *(topic for topic in PUBLISHED if topic.rate is Rate.ONCE)}


def test_the_tally_says_what_the_worst_step_was():
    tally = topics.SolverTally()
    for iterations, residual, status in ((2, 1e-8, Status.CONVERGED),
                                         (60, 3e-3, Status.NOT_CONVERGED),
                                         (4, 1e-7, Status.CONVERGED)):
        snapshot = a_snapshot(iterations=iterations, max_residual=residual, status=status)
        tally.add(snapshot)
    condition = tally.condition('solver', snapshot, 'nonlocal')
    assert condition.level is topics.Level.OK
    assert condition.values['iterations_mean'] == 22.0
    assert condition.values['iterations_max'] == 60
    assert condition.values['residual_max'] == 3e-3
    assert (condition.values['converged'], condition.values['not_converged']) == (2, 1)
    assert condition.values['stalled_strips_max'] == 2


def test_diagnostics_are_text_that_tools_read_as_numbers():
    found = topics.diagnostics_fields(0, 'trainer', [topics.Condition(
        topics.Level.WARN, 'x', 'why', {'a': 0.1234567, 'b': True, 'c': 3, 'd': 'text'})])
    status = found['status'][0]
    assert status['level'] == 1 and status['hardware_id'] == 'trainer'
    assert [item['value'] for item in status['values']] == ['0.123457', 'true', '3', 'text']
