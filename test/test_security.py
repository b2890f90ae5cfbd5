# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""The SROS2 policy against tables and running nodes; names in the log; the demo's range."""

import importlib.util
import xml.etree.ElementTree as ElementTree
from pathlib import Path

import pytest

from poststall_sim import inlets, topics

POLICY = Path(__file__).parents[1] / 'config' / 'sros2' / 'policy.xml'

COMMON = {'/rosout', '/parameter_events'}


def resolved(name, node):
    if name.startswith('~/'):
        return f'/{node}/{name[2:]}'
    return '/' + name.lstrip('/')


def allowed(node, kind, verb):
    """Return the full names that the policy allows a node to use so."""
    root = ElementTree.parse(POLICY).getroot()
    profile, = root.findall(
        f"./enclaves/enclave[@path='/poststall_sim/{node}']/profiles/profile[@node='{node}']")
    assert profile.get('ns') == '/'
    found = [resolved(item.text, node) for group in profile.findall(kind)
             if group.get(verb) == 'ALLOW' for item in group]
    assert len(found) == len(set(found))
    return set(found)


def full(table):
    return {resolved(topic.name, '') for topic in table}


def test_the_policy_allows_each_node_the_topics_of_the_tables_and_no_other():
    published, subscribed = full(topics.PUBLISHED), full(inlets.SUBSCRIBED)
    assert allowed('simulator', 'topics', 'publish') == published | COMMON
    assert allowed('simulator', 'topics', 'subscribe') == subscribed | {'/clock'}
    assert allowed('pilot', 'topics', 'publish') == full([inlets.PILOT]) | COMMON
    assert allowed('pilot', 'topics', 'subscribe') == full(
        [topics.CLOCK, topics.JOINT_STATES, topics.AIRSPEED])
    assert allowed('autopilot', 'topics', 'publish') == full([inlets.AUTOPILOT]) | COMMON
    assert allowed('autopilot', 'topics', 'subscribe') == {
        '/clock', '/imu', '/joint_states', '/strip_stalled', '/twist/air'}
    assert allowed('recorder', 'topics', 'publish') == COMMON
    assert allowed('recorder', 'topics', 'subscribe') == published | subscribed | {'/rosout'}


def test_nobody_but_the_pilot_may_ask_and_he_only_for_the_pause():
    assert allowed('pilot', 'services', 'request') == {'/pause'}
    for node in ('simulator', 'autopilot', 'recorder'):
        assert not allowed(node, 'services', 'request')
    text = POLICY.read_text()
    assert '*' not in text and 'DENY' not in text   # what is not named is denied


@pytest.mark.ros
@pytest.mark.skipif(not importlib.util.find_spec('rclpy'), reason='rclpy is not installed')
def test_running_nodes_use_nothing_that_the_policy_does_not_allow(start, probe, tmp_path):
    start('simulator', ros=['-p', 'joy.enabled:=true', '-p', 'publish_ned:=true',
                            '-p', 'sensors.imu.rate:=10.0']).wait_for('ready')
    start('recorder', '--output', str(tmp_path / 'bag')).wait_for('ready')
    start('pilot').wait_for('scenario begins')
    start('autopilot').wait_for('flies aileron')
    node = probe.node
    for name, publishes, hears in (('simulator', '/diagnostics', '/set_state'),
                                   ('recorder', '/rosout', '/odom'),
                                   ('autopilot', '/autopilot/surface_cmd', '/imu'),
                                   ('pilot', '/pilot/surface_cmd', '/clock')):
        probe.spin_until(lambda name=name: name in node.get_node_names(), name)

        def used(kind, name=name):
            find = getattr(node, f'get_{kind}_names_and_types_by_node')
            return {each for each, _ in find(name, '/')}

        probe.spin_until(lambda used=used, publishes=publishes, hears=hears: (
            publishes in used('publisher') and hears in used('subscriber')
            and len(used('service')) > 5), f'what {name} uses')
        for ros, kind, verb in (('publisher', 'topics', 'publish'),
                                ('subscriber', 'topics', 'subscribe'),
                                ('service', 'services', 'reply'),
                                ('client', 'services', 'request')):
            assert used(ros) <= allowed(name, kind, verb), (name, kind, verb)


def test_the_demo_talks_on_this_machine_only(monkeypatch, tmp_path):
    """Its processes and its own node get the discovery range before any of them starts."""
    pytest.importorskip('rosbags', reason='rosbags is not installed')
    from poststall_sim import demo

    class Stop(Exception):
        pass

    def observed():
        seen.update(demo.os.environ)
        raise Stop

    seen = {}
    monkeypatch.setenv('ROS_AUTOMATIC_DISCOVERY_RANGE', 'SUBNET')
    monkeypatch.setenv('ROS_DOMAIN_ID', '0')
    monkeypatch.setenv('PYTHONUNBUFFERED', '1')
    monkeypatch.setattr(demo, 'Observer', observed)
    options = demo.argparse.Namespace(
        scenario='stall_and_recovery', seconds=0.0, output=tmp_path, aircraft='trainer', rate=1.0)
    with pytest.raises(Stop):
        demo.fly(options, tmp_path / 'bag')
    assert seen['ROS_AUTOMATIC_DISCOVERY_RANGE'] == 'LOCALHOST'
