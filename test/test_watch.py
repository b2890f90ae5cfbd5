# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""The live page: what it is told, who may open it, who may fly; and the page in Chromium."""

import importlib
import importlib.util
import json
import math
import re
import signal
import socket
import sys
import time
from urllib.parse import urlsplit

import numpy as np
import pytest
import stumbling_watch
from browsers import SCREENS, Tab, chromium
from processes import Probe, Reports, nanoseconds, starter
from scripted_page import Scripted
from watching import SCRIPT, Page, address

from poststall_sim import cli
from poststall_sim.frames import quaternion_enu_flu, quaternion_from_euler
from poststall_sim.watch import orders
from poststall_sim.watch.orders import Act, Fly, Release
from poststall_sim.watch.scene import SILENT, Scene, groups
from poststall_sim.watch.stick import SILENCE, Stick

LIMITS = {'elevator': (-0.4, 0.3), 'throttle': (0.0, 1.0)}


def test_orders_are_read_and_cut_to_the_limits():
    assert orders.read('{"take": {"elevator": -9, "throttle": 0.25}}', LIMITS) == Fly(
        {'elevator': -0.4, 'throttle': 0.25}, take=True)
    assert orders.read('{"fly": {"elevator": 0.1}}', LIMITS) == Fly({'elevator': 0.1}, take=False)
    assert orders.read('{"release": true}', LIMITS) == Release()
    assert orders.read('{"act": "fly on"}', LIMITS) == Act('fly on')


GARBAGE = (
    '', 'fly', '[]', '{}', 'null', '{"fly": {}}', '{"fly": [1]}', '{"release": 1}', '[' * 4000,
    '{"fly": {"elevator": NaN}}', '{"fly": {"elevator": Infinity}}',
    '{"fly": {"elevator": 1e999}}', '{"fly": {"elevator": "0.1"}}',
    '{"fly": {"elevator": true}}', '{"fly": {"elevator": null}}', '{"fly": {"elevator": [0]}}',
    '{"fly": {"flap": 0.1}}', '{"fly": {"elevator": 0.1, "": 0}}', '{"act": "rm"}',
    '{"act": ["reset"]}', '{"act": {}}', '{"act": "reset", "fly": {"elevator": 0}}',
    '{"state": {"time": 0}}', '{"fly": {"elevator": %s}}' % ('9' * 3900 + '.'), '\x00\u2028{')


@pytest.mark.parametrize('text', GARBAGE, ids=lambda text: text[:30])
def test_what_is_no_order_is_refused(text):
    with pytest.raises(orders.Refused):
        orders.read(text, LIMITS)


def test_a_whole_number_of_many_digits_is_cut_to_the_limit():
    # json makes an int of it that is no float any more.
    assert orders.read('{"fly": {"elevator": %s}}' % ('9' * 400), LIMITS).values == {
        'elevator': 0.3}


def test_who_takes_the_controls_last_has_them_until_he_is_silent():
    stick = Stick()
    stick.hold('a', {'elevator': 0.1}, 0.0, take=False)
    assert stick.values(0.0) == {}
    stick.hold('a', {'elevator': 0.1}, 0.0, take=True)
    stick.hold('b', {'elevator': 0.2}, 0.1, take=True)
    stick.hold('a', {'elevator': 0.3}, 0.2, take=False)
    stick.release('a')
    assert (stick.holder, stick.values(0.1 + SILENCE)) == ('b', {'elevator': 0.2})
    assert (stick.values(0.11 + SILENCE), stick.holder) == ({}, None)


def test_a_scene_says_what_is_there_and_never_a_nan():
    scene = Scene('/')
    attitude = quaternion_enu_flu(quaternion_from_euler(0.3, -0.2, 1.2))
    scene.pose(10.0, 5.0, (1.0, 2.0, 30.0), tuple(attitude), (20.0, 0.0, 0.0))
    scene.pose(10.0, 6.0, (math.nan, 2.0, 30.0), tuple(attitude), (20.0, 0.0, 0.0))
    scene.values(alpha=math.nan, cl=[0.5, math.inf], controls={'elevator': -math.inf})
    number, state = scene.parts()['state']
    assert (state['time'], state['altitude'], state['alpha']) == (5.0, 30.0, None)
    assert state['cl'] == [0.5, None] and state['controls'] == {'elevator': None}
    assert (state['bank'], state['pitch'], state['heading']) == pytest.approx((0.3, -0.2, 1.2))
    # 20 m/s along the nose: heading is from north to the east, the nose 0.2 rad down.
    assert state['velocity'] == pytest.approx([
        20 * math.cos(0.2) * math.sin(1.2), 20 * math.cos(0.2) * math.cos(1.2),
        -20 * math.sin(0.2)])
    scene.values(alpha=0.1)
    assert scene.parts()['state'][0] > number
    json.dumps(scene.parts(), allow_nan=False)


def test_a_scene_says_plainly_whether_a_simulator_is_there():
    scene = Scene('/left')

    def said(now, publishers=1):
        scene.look(now, publishers, '/left/odom')
        return scene.parts()['link'][1]['text']

    def reported(**values):
        scene.report({'flight': (0, 'flying', values)})

    assert said(0.0, 0) == 'waiting for a simulator: nobody publishes /left/odom'
    assert said(0.0) == 'a simulator is there, its state has not come yet'
    scene.pose(1.0, 0.0, (0.0, 0.0, 9.0), (0.0, 0.0, 0.0, 1.0), (9.0, 0.0, 0.0))
    assert said(1.0) == said(1.0 + SILENT) == 'flying'
    assert said(6.0) == 'no state for 5 s: the simulator stands still, or has gone'
    reported(paused='true', paused_reason='')
    assert said(6.0) == 'paused'
    reported(paused='true', paused_reason='ground')
    assert said(6.0) == 'paused: ground'
    assert said(6.0, 0).startswith('the simulator has gone: nobody publishes /left/odom')


def test_strips_are_grouped_by_surface_the_widest_first():
    found = groups(['fin_1', 'fin_2', 'main_wing_1', 'main_wing_2', 'tail_1', 'tail_2'],
                   [0.0, 0.0, 1.0, -1.0, 0.4, -0.4])
    assert [(group['name'], group['begin'], group['end'], group['upright']) for group in found] \
        == [('main_wing', 2, 4, False), ('tail', 4, 6, False), ('fin', 0, 2, True)]


@pytest.mark.parametrize('missing, said', [
    ('aiohttp', 'pip install aiohttp'), ('plotly.offline', 'pip install plotly'),
    ('rclpy', "pip install '.[ros]' in the checkout")])
def test_without_what_it_needs_the_command_says_what_to_install(monkeypatch, capsys, missing,
                                                                said):
    for needed in {'aiohttp', 'rclpy', 'plotly'} - {missing.partition('.')[0]}:
        pytest.importorskip(needed)
    for package, name in (('poststall_sim.watch', 'server'), ('poststall_sim.ros', 'watch')):
        monkeypatch.delitem(sys.modules, f'{package}.{name}', raising=False)
        monkeypatch.delattr(importlib.import_module(package), name, raising=False)
    monkeypatch.setitem(sys.modules, missing, None)
    monkeypatch.setenv('ROS_AUTOMATIC_DISCOVERY_RANGE', 'LOCALHOST')
    with socket.create_server(('127.0.0.1', 0)) as taken:   # so that it never serves here
        port = taken.getsockname()[1]
        assert cli.main(['watch', '--port', str(port)]) == 2
    complaint = capsys.readouterr().err
    assert said in complaint and complaint.count('\n') == 1


def test_a_name_that_is_no_namespace_is_refused_in_one_line(capsys):
    for needed in ('aiohttp', 'rclpy', 'plotly'):
        pytest.importorskip(needed)
    assert cli.main(['watch', '--namespace', 'a b']) == 2
    complaint = capsys.readouterr().err
    assert complaint.startswith('poststall: --namespace a b: ') and complaint.count('\n') == 1


needs_all = [pytest.mark.ros, *(
    pytest.mark.skipif(not importlib.util.find_spec(name), reason=f'{name} is not installed')
    for name in ('rclpy', 'aiohttp', 'plotly'))]


def marked(test):
    for mark in needs_all:
        test = mark(test)
    return test


@pytest.fixture(scope='module')
def flight(tmp_path_factory):
    """Fly a simulator, with a page that may fly it and one that may not; and a probe."""
    for start in starter(tmp_path_factory.mktemp('flight')):
        start('simulator', ros=['-p', 'initial.altitude:=2000.0',
                                '-p', 'rates.diagnostics:=10.0'])
        both = [start(SCRIPT, '--port', '0', *more) for more in (['--control'], [])]
        probe = Probe(start.domain)
        yield *(address(each) for each in both), probe
        probe.close()


@pytest.fixture
def pages():
    """Open connections, closed at the end."""
    opened = []

    def open_page(url, **headers):
        opened.append(Page(url, **headers))
        return opened[-1]

    yield open_page
    for page in opened:
        page.close()


def seen(page):
    """Return the state that a page was sent last."""
    return page.until(lambda parts: {'moving', 'stick', 'setup'} <= parts.keys()
                      and parts['setup']['limits'] and parts['setup']['strips']
                      and parts.get('state'), 'the state')


def test_the_aircraft_whose_limits_the_sliders_have_is_read_before_anything_is_served(capsys):
    for needed in ('aiohttp', 'rclpy', 'plotly'):
        pytest.importorskip(needed)
    assert cli.main(['watch', '--aircraft', 'trainr']) == 2
    complaint = capsys.readouterr().err
    assert 'did you mean trainer' in complaint and complaint.count('\n') == 1


@pytest.fixture
def scripted():
    for needed in ('aiohttp', 'plotly'):
        pytest.importorskip(needed)
    page = Scripted()
    yield page
    page.end()


def test_a_page_that_does_not_read_does_not_keep_the_server(scripted):
    """A laptop that was closed, behind ssh: what it is sent piles up, a goodbye too."""
    host = urlsplit(scripted.url).netloc
    with socket.socket() as dead:
        dead.settimeout(5.0)
        dead.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
        dead.connect(('127.0.0.1', urlsplit(scripted.url).port))
        dead.sendall((f'GET /live HTTP/1.1\r\nHost: {host}\r\nOrigin: http://{host}\r\n'
                      'Connection: Upgrade\r\nUpgrade: websocket\r\nSec-WebSocket-Version: 13'
                      '\r\nSec-WebSocket-Key: ' + 22 * 'A' + '==\r\n\r\n').encode())
        assert dead.recv(12) == b'HTTP/1.1 101'
        for k in range(16):
            scripted.show(0.02 * k, cl=[0.1] * 100_000)   # 8 MB in all
            time.sleep(0.025)
        scripted.process.send_signal(signal.SIGINT)
        assert scripted.process.wait(8.0) == 0   # a second or two are given to say goodbye


@marked
def test_the_page_is_served_whole_and_asks_nobody_else(flight, pages):
    page = pages(flight[1])
    status, headers, text = page.get('/')
    policy = headers['Content-Security-Policy']
    assert status == 200 and headers['X-Content-Type-Options'] == 'nosniff'
    assert "default-src 'none'" in policy and "frame-ancestors 'none'" in policy
    sources = re.findall(r'(?:ws|http)s?://[^ ;]+', policy)
    assert sources == [page.address.replace('http', 'ws'),
                       f'ws://localhost:{urlsplit(page.address).port}']
    files = re.findall(r'(?:src|href)="([^"]+)"', text)
    assert len(files) == 6   # scripts, style, and an icon that is none
    for name in files:
        if name != 'data:,':
            status, headers, body = page.get('/' + name)
            assert status == 200 and len(body) > 500, name
            assert headers['Content-Security-Policy'] == policy
    assert page.get('/../setup.py')[0] == page.get('/live.js/..%2f..%2fcli.py')[0] == 404


@marked
def test_pages_show_what_the_topics_say(flight, pages):
    from nav_msgs.msg import Odometry
    from sensor_msgs.msg import JointState
    from std_msgs.msg import Float64, Float64MultiArray
    from std_srvs.srv import SetBool
    probe, page = flight[2], pages(flight[1])
    heard = {name: probe.collect(kind, name) for name, kind in (
        ('odom', Odometry), ('joint_states', JointState), ('joint_targets', JointState),
        ('strip_cl', Float64MultiArray), ('strip_stalled', Float64MultiArray),
        *((f'air_data/{name}', Float64) for name in ('airspeed', 'alpha', 'load_factor')))}
    # First, as a simulator that compiles takes longer than a page may be silent.
    probe.spin_until(lambda: all(heard.values()), 'all topics')
    assert page.connect() == 101
    probe.call(SetBool, 'pause', data=True)
    page.until(lambda parts: parts.get('link', {}).get('text') == 'paused', 'the pause')
    probe.spin_until(lambda: 1e-9 * nanoseconds(heard['odom'][-1].header.stamp)
                     == seen(page)['time'], 'the last state')
    end = time.monotonic() + 0.3   # all of the state at rest has come after that, as it was
    probe.spin_until(lambda: time.monotonic() > end)
    page.until(lambda parts: parts['state']['cl'] == list(heard['strip_cl'][-1].data))
    state, last = page.parts['state'], {name: found[-1] for name, found in heard.items()}
    place = last['odom'].pose.pose.position
    assert state['place'] == [place.x, place.y, place.z]
    for name in ('airspeed', 'alpha', 'load_factor'):
        assert state[name] == last[f'air_data/{name}'].data
    for part, name in (('controls', 'joint_states'), ('targets', 'joint_targets')):
        assert state[part] == dict(zip(last[name].name, last[name].position))
    assert state['stalled'] == list(last['strip_stalled'].data)
    setup = page.parts['setup']
    assert setup['aircraft'] == 'trainer'
    assert [group['name'] for group in setup['strips']['groups']] == ['wing', 'tail', 'fin']
    strips = np.array(page.parts['shape']['strips']).reshape(-1, 3)
    assert np.ptp(strips[:, 1]) == pytest.approx(3.2, abs=1e-3)   # the trainer's span
    probe.call(SetBool, 'pause', data=False)
    before = state['time']
    page.until(lambda parts: parts['state']['time'] > before + 0.2, 'the flight going on')
    page.until(lambda parts: 'real_time_factor_now' in parts.get('report', {}).get(
        'pace', {'values': {}})['values'], 'the diagnostics')


@marked
def test_a_page_outlives_what_rclpy_stumbles_over_and_who_poses_as_a_simulator(flight, pages):
    """A parameter of a type that ROS does not have; a node whose report is one, and no more."""
    from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
    from rcl_interfaces.msg import Parameter, ParameterValue
    from rcl_interfaces.srv import SetParameters
    probe, page = flight[2], pages(flight[1])
    assert page.connect() == 101
    page.until(lambda parts: 'report' in parts and 'state' in parts, 'the flight')
    client = probe.node.create_client(SetParameters, '/watch/set_parameters')
    probe.spin_until(client.service_is_ready, 'the service')
    client.call_async(SetParameters.Request(parameters=[
        Parameter(name='use_sim_time', value=ParameterValue(type=77))]))
    liar = probe.publisher(DiagnosticArray, '/diagnostics')
    said = DiagnosticArray(status=[DiagnosticStatus(
        name='probe: flight', message='a lie', hardware_id='trainer')])

    def believed():
        liar.publish(said)
        page.hear()
        return page.parts['report'].get('flight', {}).get('text') == 'a lie'
    probe.spin_until(believed, 'the lie')
    end = time.monotonic() + 0.5   # it asks the liar for parameters that he does not have
    probe.spin_until(lambda: time.monotonic() > end)
    page.until(lambda parts: parts['report']['flight']['text'] == 'flying', 'the truth')
    before = page.parts['state']['time']
    page.until(lambda parts: parts['state']['time'] > before + 0.5, 'the flight going on')


@marked
def test_the_page_with_the_key_flies_until_it_is_closed(flight, pages):
    from sensor_msgs.msg import JointState
    probe, page = flight[2], pages(flight[0])
    joints, reports = probe.collect(JointState, 'joint_states'), Reports(probe)
    assert page.connect() == 101
    targets = seen(page)['targets']
    assert page.parts['setup']['limits'].keys() == targets.keys()

    def elevator():
        return dict(zip(joints[-1].name, joints[-1].position))['elevator']

    def flown(order):
        page.send(order)
        return joints and elevator() == pytest.approx(targets['elevator'] - 0.03, abs=1e-4)

    moved = targets | {'elevator': targets['elevator'] - 0.03}
    page.send({'take': targets})
    probe.spin_until(lambda: flown({'fly': moved}), 'the elevator')
    reports.wait_for('commands', 'source', 'pilot')
    page.until(lambda parts: parts['stick']['mine'], 'the controls')
    other = pages(flight[0])
    other.connect()
    other.until(lambda parts: parts.get('stick') == {
        'kind': 'stick', 'may': True, 'mine': False, 'taken': True}, 'that they are taken')
    page.close()
    reports.wait_for('commands', 'source', 'none')
    other.until(lambda parts: not parts['stick']['taken'], 'that they are free')


@marked
def test_without_control_or_without_the_key_no_page_flies(flight, pages):
    """What they send is not even read: the simulator hears no pilot, and no button works."""
    from sensor_msgs.msg import JointState
    from std_srvs.srv import Trigger
    probe, reports = flight[2], Reports(flight[2])
    reports.wait_for('commands', 'source', 'none')
    heard = probe.collect(JointState, 'pilot/surface_cmd')
    for url, key in ((flight[1], None), (flight[0], '')):
        page = pages(url)
        assert page.connect(key) == 101
        targets = seen(page)['targets']
        assert page.parts['stick'] == {'kind': 'stick', 'may': False, 'mine': False,
                                       'taken': False}
        for order in ({'take': targets}, {'fly': targets}, {'act': 'pause'}, 'garbage'):
            page.send(order)
        count = len(reports.heard)
        probe.spin_until(lambda count=count: len(reports.heard) > count + 1, 'two reports')
        page.until(lambda parts, now=page.parts['state']['time']: parts['state']['time'] > now)
        assert not heard and 'answer' not in page.parts
        assert reports.value('flight', 'paused') == 'false'
    assert probe.call(Trigger, 'reset').success   # the services that it kept from are there


@marked
def test_strangers_are_refused(flight, pages):
    url = flight[0]
    address, key = url.split('/#')
    port = urlsplit(url).port
    assert len(key) >= 20
    assert pages(url).connect() == 101
    for origin in ('http://evil.example', 'null', '', f'https://127.0.0.1:{port}',
                   f'http://127.0.0.1:{port + 1}', f'http://127.0.0.1:{port}.evil.example'):
        assert pages(url, Origin=origin).connect() == 403, origin
    for wrong in (key[:-1], key + 'x', 'x', '\u00e9'):
        assert pages(url).connect(wrong) == 403, wrong
    assert pages(flight[1]).connect(key) == 403   # that of another server
    for host in ('evil.example', f'evil.example:{port}', '127.0.0.1', f'127.0.0.2:{port}'):
        status, _, text = pages(url).get('/', Host=host)
        assert status == 403 and 'script' not in text, host
        assert pages(url, Host=host).connect() == 403
    assert pages(url).get('/', Host=f'localhost:{port}')[0] == 200
    with pytest.raises(ConnectionRefusedError):   # the rest of 127/8 is this machine as well
        socket.create_connection(('127.0.0.2', port), 5.0)


@marked
def test_garbage_does_not_end_it(flight, pages):
    page = pages(flight[0])
    page.connect()
    limits = seen(page) and page.parts['setup']['limits']
    for text in GARBAGE:
        if len(text) < orders.LONGEST:
            assert page.ask(text)['text'].startswith('refused: '), text[:40]
    page.send(b'\x00\xff' * 100)   # bytes are no orders: ignored
    assert 'expected a finite number' in page.ask('{"take": {"elevator": 1e999}}')['text']
    page.send('x' * (orders.LONGEST + 1))
    while page.hear():
        pass   # too long: that connection is closed
    again = pages(flight[0])
    again.connect()
    assert seen(again) and again.parts['setup']['limits'] == limits
    assert not again.parts['stick']['taken']


@marked
def test_the_buttons_pause_and_trim_and_reset(flight, pages):
    page = pages(flight[0])
    page.connect()
    seen(page)
    assert page.ask({'act': 'pause'}) == {'kind': 'answer', 'done': True, 'text': 'pause: paused'}
    page.until(lambda parts: parts['link']['text'] == 'paused', 'the pause')
    assert 'trimmed at' in page.ask({'act': 'trim'})['text']
    assert page.ask({'act': 'fly on'})['text'] == 'fly on: flying'
    assert page.ask({'act': 'reset'})['done']
    page.until(lambda parts: parts['link']['text'] == 'flying', 'the flight')


@marked
def test_it_waits_for_a_simulator_misses_it_and_ends_at_a_signal(start, probe, pages, tmp_path):
    from nav_msgs.msg import Odometry
    said = tmp_path / 'said.json'
    process = start(SCRIPT, '--port', '0', '--namespace', 'left', '--json', str(said))
    url = address(process)
    port = urlsplit(url).port
    second = start(SCRIPT, '--port', str(port))
    page = pages(url)
    page.connect()

    def says(text):
        page.until(lambda parts: parts.get('link', {}).get('text', '').startswith(text), text)

    says('waiting for a simulator: nobody publishes /left/odom')
    publisher = probe.publisher(Odometry, '/left/odom')
    says('a simulator is there')
    probe.node.destroy_publisher(publisher)
    says('waiting')
    assert second.ended() == 2
    assert second.says() == (f'poststall: port {port} is in use: choose another with --port, '
                             'or 0 for any that is free\n')
    assert json.loads(said.read_text()) == {
        'url': url, 'namespace': '/left', 'control': False}
    process.send(signal.SIGINT)
    assert process.ended() == 0
    assert 'Traceback' not in process.says()
    while page.hear():
        pass   # it was closed, not cut


@marked
def test_strips_have_their_names_also_where_these_come_first(start, probe, pages):
    """Where strips are comes by topics, what they are called by a service: in any order."""
    from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
    from rclpy.qos import DurabilityPolicy, QoSProfile
    from std_msgs.msg import Float64MultiArray
    latched = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
    page = pages(address(start(SCRIPT, '--port', '0')))
    page.connect()
    probe.node.declare_parameter('aircraft', 'trainer')
    probe.node.declare_parameter('strip_names', ['wing_1', 'wing_2', 'fin_1'])
    reports = probe.publisher(DiagnosticArray, '/diagnostics')
    said = DiagnosticArray(status=[DiagnosticStatus(name='probe: flight', hardware_id='trainer')])

    def known():
        reports.publish(said)
        page.hear()
        return page.parts['setup']['limits']
    probe.spin_until(known, 'the limits')
    assert page.parts['setup']['strips'] is None
    for name, values in (('strip_y', [1.0, -1.0, 0.0]), ('strip_cl_max', [1.4, 1.4, 1.3])):
        probe.node.create_publisher(Float64MultiArray, name, latched).publish(
            Float64MultiArray(data=values))
    strips = page.until(lambda parts: parts['setup']['strips'], 'the strips')
    assert [group['name'] for group in strips['groups']] == ['wing', 'fin']


@marked
def test_an_exception_of_its_own_ends_it_with_a_traceback_and_pages_are_told_why(
        start, probe, pages):
    """What it went on to show would be of the past, and look as if it were not."""
    from nav_msgs.msg import Odometry
    process = start(stumbling_watch.SCRIPT, '--port', '0')
    page = pages(address(process))
    assert page.connect() == 101
    publisher, said = probe.publisher(Odometry, '/odom'), Odometry()
    said.pose.pose.orientation.w = 1.0
    for altitude in (12.0, 13.0):
        said.pose.pose.position.z = altitude
        publisher.publish(said)
        if altitude == 12.0:
            page.until(lambda parts: parts.get('state', {}).get('altitude') == 12.0, 'the state')
    while page.hear():
        pass
    assert page.goodbye.startswith('OSError: thirteen \u2014 far') and len(page.goodbye) == 121
    assert process.ended() == 1
    log = process.says()
    assert log.count('Traceback') == 2 and 'in stumbling' in log   # where, and what it ended
    assert log.rstrip().endswith('RuntimeError: the live page has stopped')


@pytest.fixture(scope='module')
def browser():
    yield from chromium()


ELEVATOR = 'document.getElementById("control-elevator")'
HISTORIES = """(() => {
    const figure = document.getElementById("histories"), layout = figure._fullLayout;
    return ["y", "y2", "y3", "y4"].map((id) => [
        ...layout[id.replace("y", "yaxis")].range,
        [...figure.querySelectorAll("." + id + "tick text")].map((each) => each.textContent)]);
})()"""
"""Begin and end of each history's range, and the labels on it."""
CUT = """(() => {
    const figure = document.getElementById("histories"), edge = figure.getBoundingClientRect();
    const labels = [...figure.querySelectorAll("[class*=ytick] text, [class*=y2tick] text")]
        .filter((each) => each.getBoundingClientRect().left < edge.left);
    const gauges = [...document.querySelectorAll("#gauges dd")]
        .filter((each) => each.scrollWidth > each.clientWidth);
    return [...labels, ...gauges].map((each) => each.textContent);
})()"""
"""What is written of labels and gauges beyond their place."""


@pytest.mark.browser
def test_histories_are_of_what_is_known_and_of_the_aircraft_that_is_there(browser, scripted):
    def lines():
        return {line['name']: line['y'] for line in page.evaluate(
            'document.getElementById("histories").data')}

    with Tab(browser, scripted.url, SCREENS[0]) as tab:
        page = tab.page
        for k in range(5):   # what the air says comes later
            scripted.show(0.2 * k, targets={'elevator': -0.1}, controls={'elevator': -0.1})
            page.wait_for_timeout(60)
        scripted.show(1.0, alpha=0.5, beta=0.0)
        tab.until('document.getElementById("histories").data?.[1].y.at(-1) !== null')
        alpha = lines()['alpha']
        assert alpha[0] is None and alpha[-1] == pytest.approx(math.degrees(0.5))
        low, high = page.evaluate('document.getElementById("histories")._fullLayout.yaxis2.range')
        assert low < math.degrees(0.5) < high
        scripted.show(0.0, targets={'flap': 0.2}, controls={'flap': 0.2})
        tab.until('document.getElementById("histories").data.at(-1).name === "flap"')
        tab.until('document.getElementById("histories").data.at(-1).y.length')
        shown = lines()
        assert 'elevator' not in shown and shown['flap'] == [pytest.approx(math.degrees(0.2))]


@pytest.mark.browser
def test_a_page_whose_server_stumbles_says_that_it_has_stopped_and_why(browser, scripted):
    scripted.show(0.0)
    with Tab(browser, scripted.url, SCREENS[0], ends=True) as tab:
        tab.until('document.getElementById("link").textContent === "flying"')
        scripted.stumble()
        text = 'document.getElementById("link").textContent'
        tab.until(f'{text} !== "flying"')
        said = tab.page.evaluate(text)
        assert said.startswith('poststall watch has stopped, its terminal says where: JSONDecode')
        assert scripted.process.wait(8.0) == 1
        tab.page.wait_for_timeout(1200)   # it has tried again: that changes nothing
        assert tab.page.evaluate(text) == said
        assert tab.page.evaluate('document.body.classList.contains("stale")')


@marked
@pytest.mark.browser
@pytest.mark.parametrize('size', SCREENS, ids=['desk', 'phone'])
def test_the_page_draws_and_its_slider_moves_the_aircraft(browser, flight, pages, size):
    from sensor_msgs.msg import JointState
    probe = flight[2]
    joints = probe.collect(JointState, 'joint_states')

    def elevator():
        return dict(zip(joints[-1].name, joints[-1].position))['elevator']

    with Tab(browser, flight[0], size) as tab:
        page = tab.page
        tab.until('document.getElementById("link").textContent === "flying"')
        tab.until('document.querySelectorAll("#view canvas").length > 0')
        tab.until('document.getElementById("histories").data?.[0].x.length > 3')
        assert page.title() == 'Flight of trainer'
        loading = 'Array.from(document.getElementById("loading").data[0].y)'
        lift = tab.until(f'document.getElementById("loading").data && {loading}')
        assert len(lift) == 20 and min(lift) > 0.0
        for begin, end, texts in page.evaluate(HISTORIES):
            assert end - begin >= 0.999   # else steady flight shows the noise of its last digits
            plain = [text.replace('\u2212', '-') for text in texts]
            assert plain and all(re.fullmatch(r'-?\d+(\.\d{1,2})?', text)
                                 and begin - 0.01 <= float(text) <= end + 0.01
                                 for text in plain), (begin, end, texts)
        assert page.evaluate(CUT) == []
        if size[0] > 700:   # all of it on one screen
            assert page.evaluate('document.documentElement.scrollHeight') <= size[1]
        airspeed = page.locator('[data-gauge=airspeed] dd').inner_text()
        assert float(re.match(r'[\d.]+', airspeed).group()) == pytest.approx(15.0, abs=8.0)
        count = 'document.getElementById("histories").data[0].x.length'
        tab.until(f'{count} > {page.evaluate(count)}')
        alpha = 'document.querySelector("[data-gauge=alpha] dd").textContent'
        trimmed = page.evaluate(alpha)
        assert page.evaluate(f'{ELEVATOR}.disabled')
        page.click('#take')
        tab.until(f'!{ELEVATOR}.disabled')
        probe.spin_until(lambda: joints, 'joint_states')
        before, box = elevator(), page.locator('#control-elevator').bounding_box()
        place = box['x'] + 0.35 * box['width'], box['y'] + 0.5 * box['height']
        (page.touchscreen.tap if size[0] < 700 else page.mouse.click)(*place)
        told = math.radians(page.evaluate(f'Number({ELEVATOR}.value)'))
        assert told < before - 0.02

        def follows(value):
            page.wait_for_timeout(20)   # the page's own events are read meanwhile
            return elevator() == pytest.approx(value, abs=1e-4)

        probe.spin_until(lambda: follows(told), 'the elevator where the slider is')
        tab.until(f'Math.abs({loading}[10] - {lift[10]}) > 0.02')
        tab.until(f'{alpha} !== {json.dumps(trimmed)}')
        if size[0] > 700:
            page.keyboard.press('ArrowUp')
            low, high = (math.radians(page.evaluate(f'Number({ELEVATOR}.{end})'))
                         for end in ('min', 'max'))
            probe.spin_until(lambda: follows(told + 0.02 * (high - low)), 'the key')
        page.click('#take')
        tab.until(f'{ELEVATOR}.disabled')
        assert page.evaluate('document.documentElement.scrollWidth') == size[0]
        for figure in ('view', 'loading', 'histories'):
            assert tab.inked(f'#{figure}') > 1000, figure
    Reports(probe).wait_for('commands', 'source', 'none')
