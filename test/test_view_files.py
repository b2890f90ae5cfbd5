# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""What the RViz and Foxglove files name is published, with the type that each needs."""

import json
import re
from pathlib import Path

import pytest
import yaml
from instants import a_layout, a_snapshot

from poststall_sim import topics

CONFIG = Path(__file__).resolve().parents[1] / 'config'
BY_NAME = {'/' + topic.name.lstrip('/'): topic for topic in topics.PUBLISHED}

RVIZ_TYPES = {
    'MarkerArray': 'visualization_msgs/msg/MarkerArray', 'Path': 'nav_msgs/msg/Path',
    'PointCloud2': 'sensor_msgs/msg/PointCloud2', 'Wrench': 'geometry_msgs/msg/WrenchStamped'}
"""What each display of RViz subscribes to."""
FOXGLOVE_TYPES = {
    '/markers': 'visualization_msgs/msg/MarkerArray', '/path': 'nav_msgs/msg/Path',
    '/strips': 'sensor_msgs/msg/PointCloud2'}
"""What the 3D panel can draw."""


@pytest.fixture(scope='module')
def rviz():
    return yaml.safe_load((CONFIG / 'rviz/poststall.rviz').read_text())['Visualization Manager']


@pytest.fixture(scope='module')
def foxglove():
    return json.loads((CONFIG / 'foxglove/poststall.json').read_text())


def test_rviz_displays_subscribe_to_what_is_published_as_it_is_published(rviz):
    shown = set()
    for display in rviz['Displays']:
        if 'Topic' not in display:
            continue
        given = display['Topic']
        topic = BY_NAME[given['Value']]
        shown.add(topic.name)
        assert RVIZ_TYPES[display['Class'].rpartition('/')[2]] == topic.type
        assert given['Reliability Policy'] == (
            'Reliable' if topic.qos.reliable else 'Best Effort')
        assert given['Durability Policy'] == (
            'Transient Local' if topic.qos.latched else 'Volatile')
        assert given['Depth'] == topic.qos.depth
    assert {'markers', 'path', 'strips'} <= shown


def test_rviz_frames_and_channels_are_ours(rviz):
    layout = a_layout()
    assert rviz['Global Options']['Fixed Frame'] == layout.map_frame
    assert rviz['Views']['Current']['Target Frame'] == layout.base_frame
    cloud = next(d for d in rviz['Displays'] if d['Class'].endswith('PointCloud2'))
    fields = BY_NAME['/strips'].fields(a_snapshot(), layout)['fields']
    assert cloud['Channel Name'] in {field['name'] for field in fields}
    markers = next(d for d in rviz['Displays'] if d['Class'].endswith('MarkerArray'))
    assert set(markers['Namespaces']) == {'body', 'strips', 'controls', 'lift', 'wake'}


def _resolve(path):
    """Return the topic of a message path, and what its fields are there."""
    name, _, members = path.partition('.')
    topic = BY_NAME[name]
    value = topic.fields(a_snapshot(), a_layout())
    for member in members.split('.'):
        key, index = re.fullmatch(r'(\w+)(?:\[(.*)\])?', member).groups()
        value = value[key]
        if index and index != ':':
            value = value[int(index)]
    return topic, value


def test_foxglove_panels_name_topics_and_fields_that_are_there(foxglove):
    named = set()
    for panel, config in foxglove['configById'].items():
        if panel.startswith('3D!'):
            named |= {BY_NAME[name].name for name in config['topics']}
            for name in config['topics']:
                assert BY_NAME[name].type == FOXGLOVE_TYPES[name]
            assert config['followTf'] == a_layout().base_frame
        elif panel.startswith('Plot!'):
            for series in config['paths']:
                topic, value = _resolve(series['value'])
                named.add(topic.name)
                assert topic.by_default, topic.name
                if '[:]' in series['value']:
                    _, across = _resolve(config['xAxisPath']['value'])
                    assert len(value) == len(across)
                else:
                    assert float(value) == value
        else:
            assert panel.startswith('DiagnosticSummary!')
            named.add(BY_NAME[config['topicToRender']].name)
    assert {'markers', 'path', 'strip_cl', 'strip_cl_max', 'air_data/alpha', 'joint_states',
            '/diagnostics'} <= named


def test_foxglove_lays_out_every_panel_once(foxglove):
    def panels(layout):
        if isinstance(layout, str):
            return [layout]
        assert 0 < layout['splitPercentage'] < 100
        return panels(layout['first']) + panels(layout['second'])
    assert sorted(panels(foxglove['layout'])) == sorted(foxglove['configById'])
