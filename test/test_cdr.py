# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""Messages written as bytes: read back by libraries that share no code with the writer."""

import numpy as np
import pytest

from poststall_sim import cdr

MARKER = {
    'header': {'stamp': {'sec': 3, 'nanosec': 4}, 'frame_id': 'a/base_link'}, 'ns': 'lift',
    'id': 7, 'type': 5, 'pose': {'orientation': {'w': 1.0}}, 'scale': {'x': 0.5},
    'color': {'r': 0.25, 'g': 0.5, 'b': 0.75, 'a': 1.0}, 'lifetime': {'sec': 1, 'nanosec': 2},
    'frame_locked': True, 'text': 'äöü'}
POINTS = np.arange(12.0).reshape(4, 3) + 0.1
COLOURS = np.linspace(0.0, 1.0, 16).reshape(4, 4)
MARKERS = {'markers': [
    {**MARKER, 'points': POINTS, 'colors': COLOURS}, {'ns': 'x'},
    {**MARKER, 'ns': 'odd', 'points': POINTS[:1]}]}
PATH = {'header': {'frame_id': 'map'}, 'poses': [
    {'header': {'stamp': {'sec': k, 'nanosec': 5}, 'frame_id': 'm' * k},
     'pose': {'position': {'x': 1.5 * k, 'y': -2.0, 'z': 3.0}, 'orientation': {'w': 0.5}}}
    for k in range(4)]}
MESSAGES = [('visualization_msgs/msg/MarkerArray', MARKERS), ('nav_msgs/msg/Path', PATH),
            ('visualization_msgs/msg/MarkerArray', {}), ('nav_msgs/msg/Path', {})]


def assert_holds(found, fields):
    for key, value in fields.items():
        part = getattr(found, key)
        if isinstance(value, dict):
            assert_holds(part, value)
        elif isinstance(value, list):
            assert len(part) == len(value)
            for item, expected in zip(part, value):
                assert_holds(item, expected)
        elif isinstance(value, np.ndarray):
            names = 'xyz' if value.shape[1] == 3 else 'rgba'
            assert np.array([[getattr(item, name) for name in names] for item in part]) \
                == pytest.approx(value, rel=1e-7)
        else:
            assert part == value


@pytest.mark.parametrize(('kind', 'fields'), MESSAGES)
def test_rclpy_reads_what_was_written(kind, fields):
    pytest.importorskip('rclpy', reason='rclpy is not installed')
    from rclpy.serialization import deserialize_message, serialize_message

    from poststall_sim.ros.messages import message_class
    data = cdr.serialize(kind, fields)
    found = deserialize_message(data, message_class(kind))
    assert_holds(found, fields)
    assert 0 <= len(serialize_message(found)) - len(data) < 4   # it pads the end


@pytest.mark.parametrize(('kind', 'fields'), MESSAGES)
def test_rosbags_reads_what_was_written_and_has_the_same_definitions(kind, fields):
    rosbags = pytest.importorskip('rosbags.typesys', reason='rosbags is not installed')
    store = rosbags.get_typestore(rosbags.Stores.ROS2_JAZZY)
    assert_holds(store.deserialize_cdr(cdr.serialize(kind, fields), kind), fields)
    for name, members in cdr.DEFINITIONS.items():
        _, definition = store.fielddefs[name]
        assert [member for member, _ in members] == [member for member, _ in definition]
